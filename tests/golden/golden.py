#!/usr/bin/python3
"""Same inputs, same bits: builds the core with several compilers, levels and targets and compares what it computes.

Compiles the core and golden.c for each build (below build/golden), runs it here or in QEMU, and compares the hash of
every scenario's streams of states and outputs with golden.json. Slow targets may stop early: the hash of a stream is
recorded at every row of the trace, so that as far as they went is compared all the same.

    golden.py              a representative part of the matrix, some minutes; exit 1 and the differences, in
                           engineering units, if a bit moved
    golden.py --all        the whole matrix (make golden-all)
    golden.py --only TEXT  the builds whose name contains TEXT
    golden.py --record     write golden.json anew and say what changed; the commit's message says why
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from targets import STRICT, TARGETS, WARN  # noqa: E402

HERE = ROOT / "tests" / "golden"
GOLDEN = HERE / "golden.json"
REALS = {"double": [], "float": ["-DKL_REAL_FLOAT"]}
SANITIZE = "-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all"
PLAIN = "-O2 -DKL_PLAIN_LANES"  # the steps that work on two lanes, as a target without vectors does them
LTO = "-O2 -flto"
LEVELS = ["-O0", "-O2", "-O3", "-Os"]
TRACE = ["t_s", "state", "output", "y1_mm", "yaw1_mrad", "Q1_right_kN", "Y1_kN", "body_y_mm", "body_roll_mrad"]
NUMBERS = range(3, len(TRACE))  # columns that are quantities
FEW = 1000  # steps on a target that computes double in software
AT_ONCE = 2
PATIENCE_S = 1200


@dataclasses.dataclass(frozen=True)
class Build:
    target: str
    compiler: str
    options: str
    real: str = "double"
    steps: int = 0  # 0: all

    @property
    def name(self) -> str:
        text = self.options.replace("-fno-sanitize-recover=all", "").replace("-g ", "")
        text = text.replace("-fsanitize=address,undefined", "sanitized").replace("-DKL_PLAIN_LANES", "plain lanes")
        return " ".join([self.target, self.compiler, *text.split(), self.real])

    @property
    def folder(self) -> str:
        return "".join(c if c.isalnum() or c in "._" else "-" for c in self.name)


# What every run of the tests does.
FIRST = Build("x86-64", "gcc", "-O0")  # the one that is recorded
PART = [FIRST, Build("x86-64", "gcc", "-O3"), Build("x86-64", "clang", "-O0"), Build("x86-64", "clang", "-O3"),
        Build("x86-64", "gcc", PLAIN), Build("x86-64", "gcc", SANITIZE), Build("x86-64", "gcc", "-O0", "float"),
        Build("aarch64", "gcc", "-O2"), Build("riscv64", "gcc", "-O2"), Build("cortex-m7", "gcc", "-O2"),
        Build("cortex-m4", "gcc", "-Os", steps=FEW), Build("cortex-m3", "gcc", "-O2", steps=FEW),
        Build("cortex-m4", "gcc", "-O2", "float")]


def matrix() -> list[Build]:
    builds = list(PART)
    for target in TARGETS.values():
        slow = target.name in ("cortex-m4", "cortex-m3")
        for compiler in target.compilers:
            builds += [Build(target.name, compiler, level, steps=0 if level == "-O2" or not slow else 2 * FEW)
                       for level in LEVELS]
            builds += [Build(target.name, compiler, LTO, steps=2 * FEW if slow else 0)] if compiler == "gcc" else []
        builds += [Build(target.name, "gcc", "-O2", "float")]
    builds += [Build("x86-64", compiler, more, real) for compiler in ("gcc", "clang") for more in (SANITIZE, PLAIN)
               for real in REALS]
    builds += [Build("x86-64", "clang", "-O3", "float"), Build("cortex-m7", "gcc", PLAIN)]
    known: dict[str, Build] = {}
    for build in builds:  # the longer run of two alike
        if build.name not in known or build.steps == 0:
            known[build.name] = build
    return list(known.values())


@dataclasses.dataclass
class Result:
    """What one scenario did."""

    hashes: dict[str, str]
    faults: int
    trace: list[list[float | str]]
    steps: int = 0


@dataclasses.dataclass
class Outcome:
    build: Build
    results: dict[str, Result]
    seconds: float
    problem: str = ""  # it could not be built or run


class Failed(Exception):
    pass


def run(command: list[str]) -> str:
    try:
        done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=False, timeout=PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failed(str(error)) from None
    if done.returncode != 0:
        raise Failed(f"{' '.join(command)}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
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


def compile_one(build: Build, folder: pathlib.Path) -> pathlib.Path:
    target = TARGETS[build.target]
    folder.mkdir(parents=True, exist_ok=True)
    write_profiles(folder / "profiles.inc")
    sources = [str(path.relative_to(ROOT)) for path in sorted((ROOT / "core").glob("*.c"))]
    program = folder / "golden"
    run([*target.compilers[build.compiler][:1], *STRICT, *WARN, *target.compilers[build.compiler][1:],
         *build.options.split(), *REALS[build.real], "-ffreestanding", "-Icore", "-Itests/core", f"-I{folder}",
         "-o", str(program), *sources, str(HERE.relative_to(ROOT) / "golden.c"), *target.start, *target.link])
    return program


def results_of(text: str) -> dict[str, Result]:
    results: dict[str, Result] = {}
    traces: dict[str, list[list[float | str]]] = {}
    for line in text.splitlines():
        words = line.split()
        if words and words[0] == "trace":
            row = [float(word) if column == 0 or column in NUMBERS else word for column, word in enumerate(words[2:])]
            traces.setdefault(words[1], []).append(row)
        elif words and words[0] == "scenario":
            fields = dict(zip(words[2::2], words[3::2]))
            results[words[1]] = Result({k: fields[k] for k in ("model", "state", "output")}, int(fields["faults"]),
                                       traces.get(words[1], []), int(fields["steps"]))
    return results


def perform(build: Build, out: pathlib.Path) -> Outcome:
    began = time.monotonic()
    try:
        program = compile_one(build, out / build.folder)
        limit = ["--steps", str(build.steps)] if build.steps else []
        results = results_of(run(TARGETS[build.target].command(program, limit)))
    except Failed as failed:
        return Outcome(build, {}, time.monotonic() - began, str(failed))
    return Outcome(build, results, time.monotonic() - began)


def difference(now: Result, then: Result) -> str:
    """In engineering units, where it can be seen; else the hashes. A shorter run is compared as far as it went."""
    whole = now.steps == then.steps
    names = now.hashes if whole else ["model"]
    moved = [name for name in names if now.hashes[name] != then.hashes.get(name)]
    text = [f"{', '.join(moved)} differ"] if moved else []
    if whole and now.faults != then.faults:
        text.append(f"faults {then.faults} -> {now.faults}")
    if now.steps > then.steps or (whole and len(now.trace) != len(then.trace)):
        return "; ".join(text + ["another length"])
    rows = list(zip(now.trace, then.trace))
    first = next((a[0] for a, b in rows if a[:3] != b[:3]), None)
    if first is not None:
        text.append(f"streams part before {first:g} s")
    seen = len(text)
    for column in NUMBERS:
        most, a, b = max(((abs(a[column] - b[column]), a, b) for a, b in rows), key=lambda row: row[0],
                         default=(0.0, [], []))
        if most > 0.0:
            text.append(f"{TRACE[column]} by up to {most:.3g} ({b[column]:.6g} -> {a[column]:.6g} at {a[0]:g} s)")
    if first is not None and len(text) == seen:
        text.append("by less than the trace shows")
    return "; ".join(text)


def compare(now: dict[str, Result], then: dict[str, Result]) -> list[str]:
    problems = [f"scenario {name} is missing" for name in then if name not in now]
    problems += [f"scenario {name} is new" for name in now if name not in then]
    for name in now:
        if name in then and (text := difference(now[name], then[name])):
            problems.append(f"{name}: {text}")
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
                          f'   "steps": {result.steps},\n   "trace": [\n{rows}\n   ]\n  }}')
        text.append(f' "{real}": {{\n' + ",\n".join(blocks) + "\n }")
    GOLDEN.write_text("{\n" + ",\n".join(text) + "\n}\n")


def record(out: pathlib.Path) -> dict[str, dict[str, Result]]:
    golden = load()
    for real in REALS:
        outcome = perform(dataclasses.replace(FIRST, real=real), out)
        if outcome.problem:
            sys.exit(f"golden.py: {outcome.problem}")
        for line in compare(outcome.results, golden.get(real, {})):
            print(f"changed, {real}: {line}")
        golden[real] = outcome.results
    store(golden)
    return load()


def verdict(outcome: Outcome, golden: dict[str, dict[str, Result]]) -> list[str]:
    if outcome.problem:
        return [outcome.problem]
    return compare(outcome.results, golden.get(outcome.build.real, {}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", action="store_true", help="write golden.json anew, saying what changed")
    parser.add_argument("--all", action="store_true", help="the whole matrix")
    parser.add_argument("--only", metavar="TEXT", help="of the whole matrix, the builds whose name contains TEXT")
    parser.add_argument("--build", default="build/golden", help="where to build (default %(default)s)")
    arguments = parser.parse_args()
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"
    out = (ROOT / arguments.build).resolve()
    golden = record(out) if arguments.record else load()
    builds = matrix() if arguments.all or arguments.only else PART
    builds = [build for build in builds if (arguments.only or "") in build.name]
    problems: list[str] = []
    lines: list[str] = []
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        for outcome in pool.map(lambda build: perform(build, out), builds):
            found = verdict(outcome, golden)
            steps = sum(result.steps for result in outcome.results.values())
            word = "same bits" if not found else "NOT BUILT OR RUN" if outcome.problem else "DIFFERS"
            lines.append(f"{outcome.build.name:42s} {len(outcome.results):3d} {steps:8d} {outcome.seconds:8.1f}  {word}")
            print(lines[-1], flush=True)
            problems += [f"{outcome.build.name}: {text}" for text in found]
    print(f"\n{'build':38s} scenarios    steps  seconds")
    print("\n".join(sorted(lines)))
    if problems or not builds:
        print("\n" + "\n".join(problems))
        sys.exit("golden.py: the bits moved; to accept: tests/golden/golden.py --record")
    print(f"{len(builds)} builds agree with {GOLDEN.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
