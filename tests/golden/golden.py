#!/usr/bin/python3
"""Same inputs, same bits: builds the core with several compilers, levels and targets and compares what it computes.

Compiles the core and golden.c for each build (below build/golden), links the models of scenarios.py, which klingel build
made of every file in models/, runs it here or in QEMU, and compares the hash of every scenario's streams of states and
outputs with golden.json. Slow targets may stop early: the hash of a stream is recorded at every row of the trace, so that
as far as they went is compared all the same.

    golden.py              a representative part of the matrix, some minutes; exit 1 and the differences, in
                           engineering units, if a bit moved
    golden.py --all        the whole matrix (make golden-all)
    golden.py --only TEXT  the builds whose name contains TEXT
    golden.py --record     write golden.json anew and say what changed; the commit's message says why
    golden.py --release    what is recorded belongs to a release: from now on other numerics need another
                           KL_MODEL_VERSION (core/kl_vehicle.h), and --record refuses without
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from scenarios import Scenario, all_scenarios  # noqa: E402
from targets import STRICT, TARGETS, WARN  # noqa: E402

HERE = ROOT / "tests" / "golden"
GOLDEN = HERE / "golden.json"
REALS = {"double": [], "float": ["-DKL_REAL_FLOAT"]}
SANITIZE = "-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all"
PLAIN = "-O2 -DKL_PLAIN_LANES"  # the steps that work on two lanes, as a target without vectors does them
LTO = "-O2 -flto"
NEWER = "-O3 -march=x86-64-v3 -mno-fma"  # as the Makefile builds where the processor has it
LEVELS = ["-O0", "-O2", "-O3", "-Os"]
FIRST_NUMBER = 3  # of a trace: behind time and two hashes
FLASH = 2_600_000  # bytes of models in one program for a board of 4 MiB
ROOM = 8  # bodies and wheelsets that bare metal has room for
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


def is_newer() -> bool:
    """Whether this processor has the instructions of NEWER."""
    loader = pathlib.Path("/lib64/ld-linux-x86-64.so.2")
    return loader.exists() and "x86-64-v3 (supported" in subprocess.run([loader, "--help"], capture_output=True, text=True).stdout


# What every run of the tests does.
FIRST = Build("x86-64", "gcc", "-O0")  # the one that is recorded
PART = [FIRST, Build("x86-64", "gcc", "-O3"), Build("x86-64", "clang", "-O0"), Build("x86-64", "clang", "-O3"),
        Build("x86-64", "gcc", PLAIN), Build("x86-64", "gcc", SANITIZE), Build("x86-64", "gcc", "-O0", "float"),
        Build("aarch64", "gcc", "-O2"), Build("riscv64", "gcc", "-O2"), Build("cortex-m7", "gcc", "-O2"),
        Build("cortex-m4", "gcc", "-Os", steps=FEW), Build("cortex-m3", "gcc", "-O2", steps=FEW),
        Build("cortex-m4", "gcc", "-O2", "float")]
PART += [Build("x86-64", "gcc", NEWER)] if is_newer() else []


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
    builds += [Build("x86-64", compiler, NEWER, real) for compiler in ("gcc", "clang") for real in REALS if is_newer()]
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
    columns: list[str] = dataclasses.field(default_factory=list)
    inputs: str = ""  # digest of the files that define it


@dataclasses.dataclass
class Golden:
    """golden.json."""

    version: int = 0  # KL_MODEL_VERSION
    released: bool = False
    reals: dict[str, dict[str, Result]] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Model:
    """A scenario's model as C source."""

    scenario: Scenario
    source: pathlib.Path
    symbol: str
    size: int  # bytes of constants
    wide: bool  # more bodies or wheelsets than bare metal has room for


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


# ---- the models ----

LOCK = threading.Lock()


def model_version() -> int:
    return int(re.search(r"#define KL_MODEL_VERSION (\d+)u", (ROOT / "core/kl_vehicle.h").read_text()).group(1))


def digest(paths: list[pathlib.Path]) -> str:
    """Of files and of those that they name, in order."""
    told = hashlib.sha256()
    seen: set[pathlib.Path] = set()
    waiting = list(paths)
    while waiting:
        path = waiting.pop(0).resolve()
        if path in seen or not path.is_file():
            continue
        seen.add(path)
        told.update(path.read_bytes())
        if path.suffix == ".yaml":
            waiting += [path.parent / name for name in re.findall(r"(?:points|file|samples|vehicle): *([^\s,}#]+)",
                                                                  path.read_text())]
    return told.hexdigest()[:16]


def inputs_of(name: str) -> str:
    for scenario in all_scenarios():
        if scenario.name == name:
            own = hashlib.sha256(repr(dataclasses.astuple(scenario)).encode()).hexdigest()[:8]
            return own + digest([ROOT / scenario.vehicle, ROOT / scenario.track])
    return digest([HERE / "golden.c", ROOT / "tests/core/vehicles.h", ROOT / "models/profiles/s1002.csv",
                   ROOT / "models/profiles/uic60.csv"])


def klingel_of(real: str, out: pathlib.Path) -> str:
    """The command that makes the models: of the same real type."""
    if real == "double" and "KLINGEL" in os.environ:
        return os.environ["KLINGEL"]
    folder = (out / f"klingel-{real}").relative_to(ROOT)
    run(["make", "-s", "-j2", f"BUILD={folder}", "CC=gcc", "OPT=-O1", "FAT=", "TOGETHER=", f"REAL={' '.join(REALS[real])}",
         f"{folder}/klingel"])
    return f"{folder}/klingel"


@functools.cache
def models_of(real: str, out: pathlib.Path) -> tuple[Model, ...]:
    klingel = klingel_of(real, out)
    folder = out / f"models-{real}"
    folder.mkdir(parents=True, exist_ok=True)
    models = []
    for i, scenario in enumerate(all_scenarios()):
        source = folder / f"{scenario.name}.c"
        said = run([klingel, "build", scenario.vehicle, scenario.track, "-o", str(source), "--name", f"golden_{i}"])
        text = source.read_text()
        counts = [int(n) for n in re.findall(r"\.n_(?:bodies|wheelsets) = (\d+)", text)]
        models.append(Model(scenario, source, f"golden_{i}", int(re.search(r"about (\d+) bytes", said).group(1)),
                            max(counts) > ROOM))
    return tuple(models)


@functools.cache
def model_objects(target_name: str, real: str, out: pathlib.Path) -> dict[str, pathlib.Path]:
    """Compiled once for a target: constants are the same at every level."""
    target = TARGETS[target_name]
    folder = out / f"objects-{target_name}-{real}"
    folder.mkdir(parents=True, exist_ok=True)
    objects = {}
    for model in models_of(real, out):
        if not (target.machine and model.wide):
            objects[model.symbol] = folder / f"{model.scenario.name}.o"
            run([*target.compilers["gcc"], *STRICT, "-O1", *REALS[real], "-ffreestanding", "-Icore", "-c", str(model.source),
                 "-o", str(objects[model.symbol])])
    return objects


def groups_of(models: list[Model], limit: int) -> list[list[Model]]:
    """As many programs as it takes for the models to fit."""
    groups: list[list[Model]] = [[]]
    for model in models:
        if groups[-1] and sum(m.size for m in groups[-1]) + model.size > limit:
            groups.append([])
        groups[-1].append(model)
    return groups


def write_linked(path: pathlib.Path, models: list[Model]) -> None:
    lines = ["/* written by golden.py */", *(f"extern const struct kl_model {m.symbol};" for m in models),
             "static const struct linked linked[] = {"]
    for m in models:
        s = m.scenario
        lines.append(f'    {{"{s.name}", &{m.symbol}, {{{s.from_m!r}, {s.speed_m_s!r}, {s.to_m_s!r}, {s.y_mm!r} * 1e-3, '
                     f"{s.steps}u}}}},")
    path.write_text("\n".join([*lines, "    {0},", "};"]) + "\n")


# ---- a build ----

def compile_one(build: Build, folder: pathlib.Path, out: pathlib.Path) -> list[pathlib.Path]:
    """One program, or several where memory is short; the first also has the scenarios of golden.c."""
    target = TARGETS[build.target]
    folder.mkdir(parents=True, exist_ok=True)
    write_profiles(folder / "profiles.inc")
    command = [*target.compilers[build.compiler][:1], *STRICT, *WARN, *target.compilers[build.compiler][1:],
               *build.options.split(), *REALS[build.real], "-ffreestanding", "-Icore", "-Itests/core"]
    core = []
    for path in sorted((ROOT / "core").glob("*.c")):
        core.append(str(folder / f"{path.stem}.o"))
        run([*command, "-c", str(path.relative_to(ROOT)), "-o", core[-1]])
    with LOCK:
        objects = model_objects(build.target, build.real, out)
        models = [model for model in models_of(build.real, out) if model.symbol in objects]
    programs = []
    for k, group in enumerate(groups_of(models, FLASH if target.machine else 1 << 40)):
        here = folder / f"group{k}"
        here.mkdir(exist_ok=True)
        write_linked(here / "linked.inc", group)
        programs.append(folder / f"golden{k}")
        run([*command, f"-I{folder}", f"-I{here}", "-o", str(programs[-1]), *core, str(HERE.relative_to(ROOT) / "golden.c"),
             *(str(objects[model.symbol]) for model in group), *target.start, *target.link])
    return programs


def results_of(text: str) -> dict[str, Result]:
    results: dict[str, Result] = {}
    traces: dict[str, list[list[float | str]]] = {}
    columns: dict[str, list[str]] = {}
    for line in text.splitlines():
        words = line.split()
        if words and words[0] == "version" and int(words[1]) != model_version():
            raise Failed(f"compiled with model version {words[1]}")
        if words and words[0] == "columns":
            columns[words[1]] = words[2:]
        elif words and words[0] == "trace":
            row = [word if column in (1, 2) else float(word) for column, word in enumerate(words[2:])]
            traces.setdefault(words[1], []).append(row)
        elif words and words[0] == "scenario":
            fields = dict(zip(words[2::2], words[3::2]))
            results[words[1]] = Result({k: fields[k] for k in ("model", "state", "output")}, int(fields["faults"]),
                                       traces.get(words[1], []), int(fields["steps"]), columns[words[1]],
                                       inputs_of(words[1]))
    return results


def perform(build: Build, out: pathlib.Path) -> Outcome:
    began = time.monotonic()
    try:
        limit = ["--steps", str(build.steps)] if build.steps else []
        results: dict[str, Result] = {}
        for k, program in enumerate(compile_one(build, out / build.folder, out)):
            results |= results_of(run(TARGETS[build.target].command(program, limit + ["--linked"] * (k > 0))))
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
    if now.columns != then.columns:
        return "; ".join(text + ["other columns"]) if text else ""
    rows = list(zip(now.trace, then.trace))
    first = next((a[0] for a, b in rows if a[:3] != b[:3]), None)
    if first is not None:
        text.append(f"streams part before {first:g} s")
    seen = len(text)
    largest: dict[str, tuple[float, str]] = {}  # of each unit
    for column in range(FIRST_NUMBER, len(then.columns)):
        most, a, b = max(((abs(a[column] - b[column]), a, b) for a, b in rows), key=lambda row: row[0],
                         default=(0.0, [], []))
        name = then.columns[column]
        if most > largest.get(name.rsplit("_", 1)[1], (0.0, ""))[0]:
            largest[name.rsplit("_", 1)[1]] = (most, f"{name} by up to {most:.3g} ({b[column]:.6g} -> {a[column]:.6g} at "
                                                     f"{a[0]:g} s)")
    text += [words for _, words in largest.values()]
    if first is not None and len(text) == seen:
        text.append("by less than the trace shows")
    return "; ".join(text)


def compare(now: dict[str, Result], then: dict[str, Result], partial: bool = False) -> list[str]:
    """`partial`: what is missing had no room."""
    problems = [f"scenario {name} is missing" for name in then if name not in now and not partial]
    problems += [f"scenario {name} is new" for name in now if name not in then]
    for name in now:
        if name in then and (text := difference(now[name], then[name])):
            problems.append(f"{name}: {text}{'' if now[name].inputs == then[name].inputs else ' (its files changed)'}")
    return problems


def numerics_changed(now: dict[str, Result], then: dict[str, Result]) -> list[str]:
    """Scenarios that do otherwise, though nothing but the program changed."""
    return [name for name in now if name in then and now[name].inputs == then[name].inputs
            and difference(now[name], then[name])]


# ---- golden.json ----

def load(path: pathlib.Path) -> Golden:
    if not path.exists():
        return Golden()
    document = json.loads(path.read_text())
    reals = {real: {name: Result(**entry) for name, entry in document[real].items()} for real in REALS if real in document}
    return Golden(document.get("model_version", 0), document.get("released", False), reals)


def store(golden: Golden, path: pathlib.Path) -> None:
    """JSON with one row of a trace on a line, so that a change reads well."""
    text = [f' "model_version": {golden.version},\n "released": {json.dumps(golden.released)}']
    for real, entries in golden.reals.items():
        blocks = []
        for name, result in entries.items():
            rows = ",\n".join(f"    {json.dumps(row)}" for row in result.trace)
            blocks.append(f'  "{name}": {{\n   "inputs": "{result.inputs}",\n   "hashes": {json.dumps(result.hashes)},\n'
                          f'   "faults": {result.faults},\n   "steps": {result.steps},\n'
                          f'   "columns": {json.dumps(result.columns)},\n   "trace": [\n{rows}\n   ]\n  }}')
        text.append(f' "{real}": {{\n' + ",\n".join(blocks) + "\n }")
    path.write_text("{\n" + ",\n".join(text) + "\n}\n")


def record(out: pathlib.Path, path: pathlib.Path) -> Golden:
    golden = load(path)
    version = model_version()
    new = Golden(version, golden.released and golden.version == version)
    moved: list[str] = []
    for real in REALS:
        outcome = perform(dataclasses.replace(FIRST, real=real), out)
        if outcome.problem:
            sys.exit(f"golden.py: {outcome.problem}")
        then = golden.reals.get(real, {})
        for line in compare(outcome.results, then):
            print(f"changed, {real}: {line}")
        moved += [f"{name} ({real})" for name in numerics_changed(outcome.results, then)]
        new.reals[real] = outcome.results
    if moved and golden.released and golden.version == version:
        sys.exit(f"golden.py: numerics changed in {', '.join(moved)}, and model version {version} is released: raise "
                 "KL_MODEL_VERSION in core/kl_vehicle.h, then record again. Nothing was written")
    store(new, path)
    return load(path)


def release(path: pathlib.Path) -> None:
    golden = load(path)
    if golden.version != model_version():
        sys.exit(f"golden.py: KL_MODEL_VERSION is {model_version()}, {path.name} is of {golden.version}: --record first")
    golden.released = True
    store(golden, path)
    print(f"{path.name}: model version {golden.version} is released")


# ---- the command ----

def verdict(outcome: Outcome, golden: Golden) -> list[str]:
    if outcome.problem:
        return [outcome.problem]
    return compare(outcome.results, golden.reals.get(outcome.build.real, {}), bool(TARGETS[outcome.build.target].machine))


def advice(golden: Golden, moved: bool) -> str:
    version = model_version()
    if golden.version != version:
        return f"KL_MODEL_VERSION is {version}, and recorded is {golden.version}: tests/golden/golden.py --record"
    if moved and golden.released:
        return (f"numerics changed, raise KL_MODEL_VERSION and re-record: version {version} is released, and whoever has a "
                "recording or a snapshot of it must see that it is of another")
    return "the bits moved; to accept: tests/golden/golden.py --record"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", action="store_true", help="write golden.json anew, saying what changed")
    parser.add_argument("--all", action="store_true", help="the whole matrix")
    parser.add_argument("--only", metavar="TEXT", help="of the whole matrix, the builds whose name contains TEXT")
    parser.add_argument("--release", action="store_true", help="mark what is recorded as that of a release, and stop")
    parser.add_argument("--golden", type=pathlib.Path, default=GOLDEN, metavar="FILE", help="in place of golden.json")
    parser.add_argument("--build", default="build/golden", help="where to build (default %(default)s)")
    arguments = parser.parse_args()
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"
    out = (ROOT / arguments.build).resolve()
    if arguments.release:
        release(arguments.golden)
        return
    golden = record(out, arguments.golden) if arguments.record else load(arguments.golden)
    builds = matrix() if arguments.all or arguments.only else PART
    builds = [build for build in builds if (arguments.only or "") in build.name]
    problems: list[str] = []
    lines: list[str] = []
    moved = False
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        for outcome in pool.map(lambda build: perform(build, out), builds):
            found = verdict(outcome, golden)
            moved = moved or bool(numerics_changed(outcome.results, golden.reals.get(outcome.build.real, {})))
            steps = sum(result.steps for result in outcome.results.values())
            word = "same bits" if not found else "NOT BUILT OR RUN" if outcome.problem else "DIFFERS"
            lines.append(f"{outcome.build.name:42s} {len(outcome.results):3d} {steps:8d} {outcome.seconds:8.1f}  {word}")
            print(lines[-1], flush=True)
            problems += [f"{outcome.build.name}: {text}" for text in found]
    print(f"\n{'build':38s} scenarios    steps  seconds")
    print("\n".join(sorted(lines)))
    if not builds:
        sys.exit(f"golden.py: no build's name contains '{arguments.only}'")
    if problems or golden.version != model_version():
        print("\n" + "\n".join(problems))
        sys.exit(f"golden.py: {advice(golden, moved)}")
    print(f"{len(builds)} builds agree with {os.path.relpath(arguments.golden, ROOT)}, model version {golden.version}")


if __name__ == "__main__":
    main()
