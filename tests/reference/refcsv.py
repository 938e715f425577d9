"""Reading, writing and checking the reference CSV files; shared by the generators in this folder.

A file is: comment lines that begin with '#', one header line, rows. A generator is a function that returns
{file name: Table}; `main` gives it its command line.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import math
import pathlib
import sys
from collections.abc import Callable, Sequence

HERE = pathlib.Path(__file__).resolve().parent
Cell = float | int | str


@dataclasses.dataclass
class Table:
    """One CSV file. `rel` and `abs_of_max` are what --check allows: rel * |value| + abs_of_max * max |column|."""

    comments: list[str]
    columns: list[str]
    rows: list[Sequence[Cell]]
    digits: int = 15
    rel: float = 1e-11
    abs_of_max: float = 1e-11


def _text(cell: Cell, digits: int) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int):
        return str(cell)
    return f"{float(cell) + 0.0:.{digits}g}"


def write(path: pathlib.Path, table: Table) -> None:
    with path.open("w", encoding="ascii", newline="\n") as out:
        for line in table.comments:
            out.write(f"# {line}\n")
        out.write(",".join(table.columns) + "\n")
        for row in table.rows:
            if len(row) != len(table.columns):
                raise ValueError(f"{path.name}: {len(row)} cells for {len(table.columns)} columns")
            out.write(",".join(_text(cell, table.digits) for cell in row) + "\n")


def read(path: pathlib.Path) -> tuple[list[str], list[str], list[list[str]]]:
    """Comments, columns and rows of a file, all as text."""
    comments, body = [], []
    for line in path.read_text(encoding="ascii").splitlines():
        (comments if line.startswith("#") else body).append(line)
    rows = list(csv.reader(body))
    return comments, rows[0], rows[1:]


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def compare(path: pathlib.Path, table: Table) -> list[str]:
    """What differs between a committed file and a fresh table; empty if nothing does."""
    if not path.exists():
        return [f"{path.name}: missing"]
    comments, columns, rows = read(path)
    faults = []
    if comments != [f"# {line}" for line in table.comments]:
        faults.append(f"{path.name}: comments differ")
    if columns != table.columns or len(rows) != len(table.rows):
        return faults + [f"{path.name}: columns or number of rows differ"]
    for k, name in enumerate(columns):
        old = [row[k] for row in rows]
        new = [_text(row[k], table.digits) for row in table.rows]
        scale = max((abs(v) for v in map(_number, new) if v is not None and math.isfinite(v)), default=0.0)
        for i, (a, b) in enumerate(zip(old, new)):
            if a == b:
                continue
            x, y = _number(a), _number(b)
            if x is None or y is None or not abs(x - y) <= table.rel * abs(y) + table.abs_of_max * scale:
                faults.append(f"{path.name}: row {i + 1}, {name}: committed {a}, computed {b}")
    return faults


def main(description: str, generate: Callable[[], dict[str, Table]]) -> None:
    """Command line of a generator: write the files, or with --check compare them."""
    parser = argparse.ArgumentParser(description=description.strip(), formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="regenerate and compare with the committed files; exit 1 on a difference")
    parser.add_argument("--output", type=pathlib.Path, default=HERE, metavar="DIR", help="folder of the CSV files (default: beside this script)")
    arguments = parser.parse_args()
    failed = False
    for name, table in generate().items():
        path = arguments.output / name
        if arguments.check:
            faults = compare(path, table)
            failed = failed or bool(faults)
            for fault in faults[:10]:
                print(fault, file=sys.stderr)
            if len(faults) > 10:
                print(f"{name}: and {len(faults) - 10} more", file=sys.stderr)
            print(f"{name}: {'DIFFERS' if faults else 'ok'} ({len(table.rows)} rows)")
        else:
            write(path, table)
            print(f"{path}: {len(table.rows)} rows")
    sys.exit(1 if failed else 0)
