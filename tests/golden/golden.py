#!/usr/bin/python3
"""Same inputs, same bits: builds the core with several compilers and levels and compares what it computes.

Builds libklingel_core.a with gcc and clang at -O0 and -O3 (each in a directory of its own below build/golden), links
golden.c against it, and compares every hash of every scenario with golden.json and with the other builds. One more
build runs under the address and undefined-behaviour sanitizers. Finally looks into the library: no symbol from
outside but memcpy, memmove, memset and memcmp, and no writable data.

    golden.py              check; exit 1 and the differences, in engineering units, if a bit moved
    golden.py --record     write golden.json anew and say what changed; the commit's message says why
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / "tests" / "golden"
GOLDEN = HERE / "golden.json"
STRICT = "-std=c11 -ffp-contract=off -fno-fast-math -fno-math-errno".split()
WARN = "-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wvla -Werror".split()
SANITIZE = "-O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
PLAIN = "-O2 -DKL_PLAIN_LANES"  # the steps that work on two lanes, as a target without vectors does them
BUILDS = [("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O0"), ("clang", "-O3"), ("gcc", PLAIN), ("gcc", SANITIZE)]
MAY_BE_UNDEFINED = {"memcpy", "memmove", "memset", "memcmp"}
TRACE = ["t_s", "y1_mm", "yaw1_mrad", "Q1_right_kN", "Y1_kN", "body_y_mm", "body_roll_mrad"]


@dataclasses.dataclass
class Result:
    """What one scenario did."""

    hashes: dict[str, str]
    faults: int
    trace: list[list[float]]


def fail(message: str) -> None:
    sys.exit(f"golden.py: {message}")


def run(command: list[str], **more: object) -> str:
    done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=False, **more)
    if done.returncode != 0:
        fail(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.stdout


def write_profiles(path: pathlib.Path) -> None:
    """The profile files as C arrays: the decimals as they stand, so that every compiler reads the same numbers."""
    lines = ["/* written by golden.py from models/profiles: eta, zeta in mm */"]
    for name in ("s1002", "uic60"):
        rows = [line.strip() for line in (ROOT / "models" / "profiles" / f"{name}.csv").read_text().splitlines()
                if line and line[0] in "-0123456789"]
        lines.append(f"#define PROFILE_{name.upper()}_POINTS {len(rows)}u")
        lines.append(f"static const double profile_{name}[{len(rows)}][2] = {{")
        lines += [f"    {{{row.replace(',', ', ')}}}," for row in rows]
        lines.append("};")
    path.write_text("\n".join(lines) + "\n")


def build(compiler: str, level: str, real: str, out: pathlib.Path) -> pathlib.Path:
    """Builds the library by the Makefile and the program on top; returns the program."""
    out.mkdir(parents=True, exist_ok=True)
    write_profiles(out / "profiles.inc")
    library = out / "libklingel_core.a"
    run(["make", "-s", f"CC={compiler}", f"OPT={level}", f"REAL={real}", f"BUILD={out.relative_to(ROOT)}",
         str(library.relative_to(ROOT))])
    program = out / "golden"
    run([compiler, *STRICT, *level.split(), "-g", *WARN, *real.split(), "-Icore", "-Itests/core", f"-I{out}", "-o", str(program),
         str(HERE / "golden.c"), str(library)])
    return program


def results_of(program: pathlib.Path) -> dict[str, Result]:
    results: dict[str, Result] = {}
    traces: dict[str, list[list[float]]] = {}
    for line in run([str(program)]).splitlines():
        words = line.split()
        if words[0] == "trace":
            traces.setdefault(words[1], []).append([float(word) for word in words[2:]])
        elif words[0] == "scenario":
            fields = dict(zip(words[2::2], words[3::2]))
            results[words[1]] = Result({k: fields[k] for k in ("model", "state", "output")}, int(fields["faults"]),
                                       traces.get(words[1], []))
    return results


def difference(now: Result, then: Result) -> str:
    """In engineering units, where it can be seen; else the hashes."""
    moved = [name for name in now.hashes if now.hashes[name] != then.hashes.get(name)]
    text = [f"{', '.join(moved)} differ"] if moved else []
    if now.faults != then.faults:
        text.append(f"faults {then.faults} -> {now.faults}")
    if len(now.trace) != len(then.trace):
        return "; ".join(text + ["another length"])
    for column, name in enumerate(TRACE[1:], start=1):
        rows = [(abs(a[column] - b[column]), a, b) for a, b in zip(now.trace, then.trace)]
        most, a, b = max(rows, key=lambda row: row[0], default=(0.0, [], []))
        if most > 0.0:
            text.append(f"{name} by up to {most:.3g} ({b[column]:.6g} -> {a[column]:.6g} at {a[0]:g} s)")
    if moved and len(text) == 1:
        text.append("less than the trace shows")
    return "; ".join(text)


def compare(now: dict[str, Result], then: dict[str, Result], what: str) -> list[str]:
    problems = [f"{what}: scenario {name} is missing" for name in then if name not in now]
    problems += [f"{what}: scenario {name} is new" for name in now if name not in then]
    for name in now:
        if name in then and (text := difference(now[name], then[name])):
            problems.append(f"{what}: {name}: {text}")
    return problems


def check_library(library: pathlib.Path) -> list[str]:
    """No symbol from outside, no writable data."""
    problems = []
    defined: set[str] = set()
    undefined: set[str] = set()
    for line in run(["nm", "-P", str(library)]).splitlines():
        words = line.split()
        if len(words) < 2 or len(words[1]) != 1:
            continue
        name, kind = words[0], words[1]
        if kind == "U":
            undefined.add(name)
        else:
            defined.add(name)
        if kind in "dDbBcCsSgG":
            problems.append(f"{library.parent.name}: writable data: {name} ({kind})")
    for name in sorted(undefined - defined - MAY_BE_UNDEFINED):
        problems.append(f"{library.parent.name}: symbol from outside: {name}")
    for line in run(["size", "-A", str(library)]).splitlines():
        words = line.split()
        if len(words) == 3 and (words[0].startswith(".data") or words[0].startswith(".bss")) and words[1] != "0":
            if not words[0].startswith(".data.rel.ro"):
                problems.append(f"{library.parent.name}: {words[1]} bytes in {words[0]}")
    return problems


def load() -> dict[str, dict[str, Result]]:
    if not GOLDEN.exists():
        return {}
    document = json.loads(GOLDEN.read_text())
    return {real: {name: Result(**entry) for name, entry in entries.items()} for real, entries in document.items()}


def store(golden: dict[str, dict[str, Result]]) -> None:
    """JSON with one row of a trace on a line, so that a change reads well."""
    text = []
    for real, entries in golden.items():
        blocks = []
        for name, result in entries.items():
            rows = ",\n".join(f"    {json.dumps(row)}" for row in result.trace)
            blocks.append(f'  "{name}": {{\n   "hashes": {json.dumps(result.hashes)},\n   "faults": {result.faults},\n'
                          f'   "trace": [\n{rows}\n   ]\n  }}')
        text.append(f' "{real}": {{\n' + ",\n".join(blocks) + "\n }")
    GOLDEN.write_text("{\n" + ",\n".join(text) + "\n}\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", action="store_true", help="write golden.json anew, saying what changed")
    parser.add_argument("--build", default="build/golden", help="where to build (default %(default)s)")
    arguments = parser.parse_args()
    golden = load()
    problems: list[str] = []
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"
    recorded: dict[str, Result] = {}
    for compiler, level in BUILDS:
        name = f"{compiler}{level.split()[0]}" + ("-sanitize" if level == SANITIZE else "")
        out = ROOT / arguments.build / name
        now = results_of(build(compiler, level, "", out))
        if arguments.record and not recorded:
            recorded = now
            for line in compare(now, golden.get("double", {}), "changed"):
                print(line)
            golden["double"] = now
            store(golden)
        problems += compare(now, golden.get("double", {}), name)
        if level != SANITIZE:
            problems += check_library(out / "libklingel_core.a")
        print(f"{name}: {len(now)} scenarios", flush=True)
    if problems:
        print("\n".join(problems))
        fail("the bits moved; to accept: tests/golden/golden.py --record")
    print(f"all builds agree with {GOLDEN.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
