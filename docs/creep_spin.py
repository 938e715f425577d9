#!/usr/bin/python3
"""Holds Shen-Hedrick-Elkins and Polach against CONTACT where an ellipse is long and spin grows, and compares the laws in one
contact of the wagon: prints the figures of "Polach and spin" in docs/creep_laws.md.

usage: docs/creep_spin.py [--klingel build/klingel]
"""

from __future__ import annotations

import argparse
import csv
import math
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
G, C, LOAD, FRICTION = 82e9, 5e-3, 60e3, 0.3  # of the contacts that stand for the dimensionless points
BANDS = ((0.0, 0.3), (0.3, 1.0), (1.0, 2.0), (2.0, 6.0))
WAGON = {"a": 10.10, "b": 1.44, "load": 106.5e3, "along": 0.0030666, "across": 0.00051, "spin": 0.620}


class Contact:
    """One contact: what `klingel creep` makes of it."""

    def __init__(self, program: pathlib.Path, a_mm: float, b_mm: float, load_N: float):
        self.words = [str(program), "creep", str(ROOT / "models/creep/contact.csv"), "--a", repr(a_mm), "--b", repr(b_mm),
                      "--load", repr(load_N), "--friction", repr(FRICTION), "--rows", "2", "--csv"]

    def forces(self, along: float, across: float, spin: float) -> dict[str, tuple[float, float]]:
        """T1 and T2 by law, N; 0 at a creepage of 0 along, where nothing is swept."""
        done = subprocess.run([*self.words, "--sweep", "along", "--to", repr(abs(along)), f"--across={across!r}",
                               f"--spin={spin!r}"], capture_output=True, text=True, check=True)
        rows = csv.DictReader(line for line in done.stdout.splitlines() if not line.startswith("#"))
        sign = math.copysign(1.0, along)
        return {row["law"]: (sign * float(row["t1_N"]), float(row["t2_N"])) for row in rows}  # the last row of a law stays


def points() -> list[dict[str, float]]:
    text = (ROOT / "tests/reference/creep_check_points.csv").read_text()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return [{key: float(value) for key, value in row.items() if key != "set"} for row in rows]


def kalker() -> list[tuple[float, float, float]]:
    """1 - b/a, C11, C23 of the lines with a/b >= 1, for steel."""
    text = (ROOT / "tests/reference/kalker.csv").read_text()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return sorted((1.0 - 1.0 / float(row["a_over_b"]), float(row["c11"]), float(row["c23"])) for row in rows
                  if row["kind"] == "line" and float(row["poisson"]) == 0.28 and float(row["a_over_b"]) >= 1.0)


def coefficients(table: list[tuple[float, float, float]], a_over_b: float) -> tuple[float, float]:
    """Linear in b/a between the lines."""
    at = min(1.0 - 1.0 / a_over_b, table[-1][0])
    k = next(i for i in range(1, len(table)) if at <= table[i][0])
    t = (at - table[k - 1][0]) / (table[k][0] - table[k - 1][0])
    return tuple(table[k - 1][i] + t * (table[k][i] - table[k - 1][i]) for i in (1, 2))


def against_contact(program: pathlib.Path) -> None:
    found: dict[tuple[float, float], list[tuple[float, ...]]] = {band: [] for band in BANDS}
    limit = FRICTION * LOAD
    unit = limit / (G * C * C)
    table = kalker()
    for point in points():
        if point["a_over_b"] < 2.0 or point["X"] == 0.0:
            continue
        c11, c23 = coefficients(table, point["a_over_b"])
        spin = abs(c23 * point["Z"])  # p
        band = next((b for b in BANDS if b[0] <= spin < b[1]), None)
        if band is None or abs(c11 * point["X"]) <= 0.5 * spin:
            continue
        root = math.sqrt(point["a_over_b"])
        contact = Contact(program, 1e3 * C * root, 1e3 * C / root, LOAD)
        values = [abs(point["fx"])]
        forces = contact.forces(unit * point["X"], unit * point["Y"], unit / C * point["Z"])
        for law in ("she", "polach"):
            t1, t2 = forces[law]
            values += [abs(t1) / limit, math.hypot(t1 / limit - point["fx"], t2 / limit - point["fy"])]
        found[band].append(tuple(values))
    print("|p|          points   |T1|: CONTACT     SHE  Polach   |dT|: SHE  Polach")
    for (low, high), rows in found.items():
        contact, she, she_off, polach, polach_off = (sum(row[i] for row in rows) / len(rows) for i in range(5))
        print(f"{low:g} to {high:<6g} {len(rows):8d} {contact:15.3f} {she:7.3f} {polach:7.3f} {she_off:11.3f} {polach_off:7.3f}")


def in_the_wagon(program: pathlib.Path) -> None:
    contact = Contact(program, WAGON["a"], WAGON["b"], WAGON["load"])
    forces = contact.forces(WAGON["along"], WAGON["across"], WAGON["spin"])
    print("\nkN      table  FASTSIM     SHE  Polach")
    for i, name in enumerate(("T1", "T2")):
        print(name + "   " + "".join(f"{1e-3 * abs(forces[law][i]):8.1f}" for law in ("table", "fastsim", "she", "polach")))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--klingel", default="build/klingel", type=pathlib.Path, help="default: build/klingel")
    program = parser.parse_args().klingel.resolve()
    against_contact(program)
    in_the_wagon(program)
    return 0


if __name__ == "__main__":
    sys.exit(main())
