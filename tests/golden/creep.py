#!/usr/bin/python3
"""Creep forces: the same bits from every compiler and with lanes or without; and a storm of absurd contacts.

Builds the core with several compilers and levels and links creep.c and the creep-force table as klingel creep
writes it. The hashes of all laws must agree between the builds. Then 100 million contacts, half of them absurd.

    creep.py                   both
    creep.py --storm 1000000   that many contacts
"""

from __future__ import annotations

import argparse
import os
import pathlib
import sys

from golden import HERE, PLAIN, ROOT, SANITIZE, STRICT, WARN, Failed, run

BUILDS = [("gcc", "-O3"), ("gcc", "-O0"), ("clang", "-O0"), ("clang", "-O3"), ("gcc", PLAIN), ("gcc", SANITIZE)]
STORM = 100_000_000


def build(compiler: str, level: str, out: pathlib.Path, table: pathlib.Path) -> pathlib.Path:
    out.mkdir(parents=True, exist_ok=True)
    library = out / "libklingel_core.a"
    run(["make", "-s", f"CC={compiler}", f"OPT={level}", "REAL=", f"BUILD={out.relative_to(ROOT)}",
         str(library.relative_to(ROOT))])
    program = out / "creep"
    run([compiler, *STRICT, *level.split(), *WARN, "-Icore", "-o", str(program), str(HERE / "creep.c"), str(table),
         str(library), "-lm"])
    return program


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--storm", type=int, default=STORM, metavar="N", help="contacts (default %(default)s)")
    parser.add_argument("--build", default="build/golden", help="where to build (default %(default)s)")
    arguments = parser.parse_args()
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"
    folder = ROOT / arguments.build
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "creep_table.c"
    run([os.environ.get("KLINGEL", "build/klingel"), "creep", "models/creep/contact.csv", "--source", str(table), "--name", "creep_table"])
    first: str | None = None
    fast: pathlib.Path | None = None
    for compiler, level in BUILDS:
        name = f"{compiler}{level.split()[0]}" + ("-sanitize" if level == SANITIZE else "")
        name += "-plain" if "KL_PLAIN_LANES" in level else ""
        program = build(compiler, level, folder / f"creep-{name}", table)
        hashes = run([str(program), "hash", "200000"])
        first = first or hashes
        if hashes != first:
            raise Failed(f"creep forces differ: {name}\n{hashes}instead of\n{first}")
        if level == SANITIZE:
            run([str(program), "storm", "300000"])
        fast = program if (compiler, level) == ("gcc", "-O3") else fast
        print(f"{name}: the same bits", flush=True)
    print(run([str(fast), "storm", str(arguments.storm)]), end="")


if __name__ == "__main__":
    try:
        main()
    except Failed as failed:
        sys.exit(f"creep.py: {failed}")
