#!/usr/bin/python3
"""What core and port cost on each target: code, constants, state, worst stack, instructions of a step; what they import.

    footprint.py            print the table and write footprint.json (make footprint)
    footprint.py --check    also exit 1 where a limit is passed, or something is imported that docs/porting.md does
                            not list

Code and constants are what GCC 12 makes with the flags of the Makefile; "path" is what a firmware links that finds its
model in flash: everything that kl_step, kl_init and kl_model_check may call. The stack is the deepest path of calls, by
frames (tools/stack_paths.py), without interrupts, which come on top. Instructions are counted by QEMU (-icount), the
same on every run; loads, stores and branches count one each, so they are no cycles.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys

from stack_paths import Graph, Refused
from targets import ROOT, STRICT, TARGETS, TOGETHER, WARN, Target

COLUMNS = [("x86-64", "-O2"), ("aarch64", "-O2"), ("riscv64", "-O2"), ("cortex-m7", "-O2"), ("cortex-m7", "-Os"),
           ("cortex-m4", "-O2"), ("cortex-m3", "-O2")]
FIRMWARE = ("cortex-m7", "-O2")  # the limits hold there
STEP_ROOTS = ["kl_step", "kl_init", "kl_model_check"]
STACK_ROOTS = ["kl_step", "kl_init", "kl_rates", "kl_observe", "kl_node_init", "kl_node_cycle"]
# What a vehicle keeps between steps; its edges; and the scratch that all vehicles of a thread share.
STRUCTS = {"kl_state": "state", "kl_input": "input", "kl_output": "output", "kl_work": "scratch", "kl_node": "node",
           "kl_slcan_link": "slcan link", "kl_model": "model"}
IMPORTS = {"memcpy", "memmove", "memset", "memcmp"}
RUN_TIME = re.compile(r"__(aeabi_\w+|\w*(div|mod|clz|ctz|popcount|float|fix|mul|lsh|ash)\w*(di|si|df|sf)\d?)$")

# Where a call through a pointer may lead, by the member that is called. A port with other back ends adds its own.
POINTERS = {
    "send": ["link_send", "vbus_send"], "receive": ["link_receive", "vbus_receive"],
    "is_up": ["link_is_up", "vbus_is_up"], "counts": ["link_counts", "vbus_counts"],
    "recover": ["link_recover", "vbus_recover"], "service": ["link_service", "vbus_service"],
    "close": ["link_close", "vbus_close"], "kick": ["board_kick"], "write": ["hash_write"],
    "told": [],  # a recorder of the host; firmware has none
}
# Frames of functions without source here, in bytes. The four of libc save at most eight registers; those of libgcc
# (software arithmetic, 64-bit division) at most nine and call one more.
OUTSIDE = 64
OUTSIDE_RUN_TIME = 96

BOGIE_VEHICLE = "manchester_vehicle1"  # the size of vehicle that the number of instructions is aimed at
LIMITS = {
    "code on the step's path": 33 * 1024,
    "state of a vehicle": 8 * 1024,
    "stack of kl_step": 2 * 1024,
    "instructions, bogie vehicle": 20_000,
    "instructions, worst / best, %": 110,
}


@dataclasses.dataclass
class Built:
    target: Target
    level: str
    folder: pathlib.Path
    objects: dict[str, pathlib.Path]  # by source


def run(command: list[str], **more: object) -> str:
    done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=False, **more)
    if done.returncode != 0:
        sys.exit(f"footprint.py: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def sources(*folders: str) -> list[str]:
    return [str(path.relative_to(ROOT)) for folder in folders for path in sorted((ROOT / folder).glob("*.c"))]


def flags(target: Target, level: str) -> list[str]:
    command = target.compilers["gcc"]
    return [command[0], *STRICT, *WARN, *command[1:], level, "-ffreestanding", "-Icore", "-Iport"]


def compile_all(name: str, level: str, out: pathlib.Path, pool: concurrent.futures.Executor) -> Built:
    target = TARGETS[name]
    folder = out / f"{name}{level}"
    built = Built(target, level, folder, {})
    firmware = sources("port/template", "port/mps2") if (name, level) == FIRMWARE else []
    jobs = []
    for source in [*sources("core", "port"), *[s for s in firmware if s != "port/template/board.c"]]:
        built.objects[source] = folder / (source[:-1] + "o")
        built.objects[source].parent.mkdir(parents=True, exist_ok=True)
        jobs.append(pool.submit(run, [*flags(target, level), "-Iport/template", "-Iport/mps2",
                                      "-DKL_FIRMWARE_MODEL=firmware_model", "-ffunction-sections", "-fdata-sections",
                                      "-fcallgraph-info=su", "-c", source, "-o", str(built.objects[source])]))
    for job in jobs:
        job.result()
    return built


# ---- sizes ----

def sections(built: Built, room: str) -> dict[str, int]:
    """Bytes of code, constants and writable data of a folder's objects."""
    totals = {"code": 0, "constants": 0, "writable": 0}
    objects = [str(path) for source, path in built.objects.items() if pathlib.Path(source).parent.as_posix() == room]
    for line in run([f"{built.target.prefix}size", "-A", *objects]).splitlines():
        words = line.split()
        if len(words) != 3 or not words[0].startswith("."):
            continue
        kind = {".text": "code", ".rodata": "constants", ".data": "writable", ".bss": "writable",
                ".sdata": "writable", ".sbss": "writable", ".srodata": "constants"}.get("." + words[0].split(".")[1], "")
        if words[0].startswith(".data.rel.ro"):
            kind = "constants"
        if kind:
            totals[kind] += int(words[1])
    return totals


def function_sizes(built: Built) -> dict[str, int]:
    """By the title that the call graph has: statics with their file."""
    sizes: dict[str, int] = {}
    for source, path in built.objects.items():
        for line in run([f"{built.target.prefix}nm", "-S", "--defined-only", str(path)]).splitlines():
            words = line.split()
            if len(words) == 4 and words[2] in "tTwW":
                name = words[3].removesuffix(".cold")
                for title in {name, f"{source}:{name}"}:
                    sizes[title] = sizes.get(title, 0) + int(words[1], 16)
    return sizes


def struct_sizes(built: Built) -> dict[str, int]:
    text = '#include "klingel.h"\n#include "kl_node.h"\n#include "kl_slcan_link.h"\n'
    text += "".join(f"extern char size_{name}[sizeof(struct {name})];\nchar size_{name}[sizeof(struct {name})];\n"
                    for name in STRUCTS)
    path = built.folder / "structs.c"
    path.write_text(text)
    run([*flags(built.target, built.level), "-c", str(path), "-o", str(path.with_suffix(".o"))])
    lines = run([f"{built.target.prefix}nm", "-S", str(path.with_suffix(".o"))]).splitlines()
    return {words[3][5:]: int(words[1], 16) for words in map(str.split, lines) if len(words) == 4}


def imports(built: Built) -> list[str]:
    """What core and port want from outside and docs/porting.md does not list; and writable data."""
    defined: set[str] = set()
    wanted: set[str] = set()
    problems = []
    for source, path in built.objects.items():
        if pathlib.Path(source).parent.as_posix() not in ("core", "port"):
            continue
        for line in run([f"{built.target.prefix}nm", "-P", str(path)]).splitlines():
            name, kind = line.split()[:2]
            (wanted if kind == "U" else defined).add(name)
    outside = wanted - defined - IMPORTS
    problems += [f"{room} has {size} bytes of writable data" for room in ("core", "port")
                 if (size := sections(built, room)["writable"])]
    problems += [f"symbol from outside: {name}" for name in sorted(outside) if not RUN_TIME.match(name)]
    return [f"{built.target.name} {built.level}: {problem}" for problem in problems]


# ---- stack ----

def graph_of(built: Built) -> Graph:
    outside = {name: OUTSIDE for name in IMPORTS}
    for path in built.objects.values():
        for name in re.findall(r'title: "(__\w+)"', path.with_suffix(".ci").read_text()):
            if RUN_TIME.match(name):
                outside[name] = OUTSIDE_RUN_TIME
    return Graph(ROOT, [path.with_suffix(".ci") for path in built.objects.values()], POINTERS, outside)


def stack_of(graph: Graph, names: list[str]) -> dict[str, object]:
    told = {}
    for name in names:
        try:
            path = graph.worst(name)
            told[name] = {"bytes": path.bytes, "path": [f"{f}" for f in path.functions]}
        except Refused as refused:
            told[name] = {"bytes": None, "refused": str(refused)}
    return told


# ---- instructions ----

def vehicles() -> list[pathlib.Path]:
    return [path for path in sorted((ROOT / "models").glob("*.yaml"))
            if re.search(r"^wheelsets:", path.read_text(), re.M)]


def count_steps(vehicle: pathlib.Path, klingel: pathlib.Path, out: pathlib.Path) -> list[dict[str, object]]:
    target = TARGETS[FIRMWARE[0]]
    folder = out / "count" / vehicle.stem
    folder.mkdir(parents=True, exist_ok=True)
    run([str(klingel), "build", str(vehicle), "models/demo_track.yaml", "--name", "count_model", "-o",
         str(folder / "model.c")])
    program = folder / "count_steps"
    run([*flags(target, FIRMWARE[1]), *TOGETHER, "-DMODEL=count_model", *target.link, *sources("core"), str(folder / "model.c"),
         "tests/target/count_steps.c", *target.start, "-o", str(program)])
    told = []
    command = target.command(program, [], ["-icount", "shift=6,sleep=off"])
    for line in run(command, timeout=600).splitlines():
        words = line.split()
        if words and words[0] == "count":
            told.append({"model": words[1], "speed_m_s": float(words[2]), "friction": float(words[3]),
                         **{key: int(value) for key, value in zip(words[4::2], words[5::2])}})
    if not told:
        sys.exit(f"footprint.py: {vehicle.stem}: nothing was counted; does its model pass kl_model_check?")
    return told


# ---- all of it ----

def measure(built: Built) -> dict[str, object]:
    graph = graph_of(built)
    sizes = function_sizes(built)
    path = [title for title in graph.reached(STEP_ROOTS) if not title.startswith("port/")]
    told: dict[str, object] = {
        "target": built.target.name, "level": built.level,
        "core": sections(built, "core"), "port": sections(built, "port"),
        "step_path_code": sum(sizes.get(title, 0) for title in path),
        "structs": struct_sizes(built), "stack": stack_of(graph, STACK_ROOTS),
    }
    if (built.target.name, built.level) == FIRMWARE:
        told["firmware_stack"] = stack_of(graph, ["main", "mps2_systick", "mps2_uart_receive", "mps2_uart_transmit"])
    return told


def print_table(all_told: list[dict], counts: list[dict]) -> None:
    def row(label: str, values: list[object]) -> None:
        print(f"{label:30s}" + "".join(f"{'-' if value is None else value:>14}" for value in values))

    row("bytes", [f"{told['target']} {told['level']}" for told in all_told])
    for room in ("core", "port"):
        for kind in ("code", "constants", "writable"):
            row(f"{room}: {kind}", [told[room][kind] for told in all_told])
    row("core: code on the step's path", [told["step_path_code"] for told in all_told])
    for name in STRUCTS:
        row(f"{STRUCTS[name]}: struct {name}", [told["structs"][name] for told in all_told])
    for name in STACK_ROOTS:
        row(f"stack of {name}", [told["stack"][name]["bytes"] for told in all_told])
    firmware = next((told for told in all_told if "firmware_stack" in told), None)
    if firmware:
        for name, path in firmware["firmware_stack"].items():
            print(f"firmware, stack of {name}: {path.get('refused', path['bytes'])}")
        print("deepest in kl_step: " + " > ".join(firmware["stack"]["kl_step"].get("path", [])))
    print(f"\ninstructions of a step, {' '.join(FIRMWARE)}, under QEMU -icount")
    for model in sorted({count["model"] for count in counts}):
        mine = [count for count in counts if count["model"] == model]
        least, most = min(count["least"] for count in mine), max(count["most"] for count in mine)
        steps = sum(count["steps"] for count in mine)
        print(f"  {model:24s} least {least:6d}  most {most:6d}  most/least {most / least:5.3f}  over {steps} steps, "
              f"0 to 140 m/s, with and without grip")


def judge(all_told: list[dict], counts: list[dict]) -> list[str]:
    firmware = next(told for told in all_told if (told["target"], told["level"]) == FIRMWARE)
    spread = [100 * max(c["most"] for c in counts if c["model"] == model) /
              min(c["least"] for c in counts if c["model"] == model) for model in {c["model"] for c in counts}]
    now = {
        "code on the step's path": firmware["step_path_code"],
        "state of a vehicle": firmware["structs"]["kl_state"],
        "stack of kl_step": firmware["stack"]["kl_step"]["bytes"],
        "instructions, bogie vehicle": max(count["most"] for count in counts if count["model"] == BOGIE_VEHICLE),
        "instructions, worst / best, %": round(max(spread), 2),
    }
    problems = [f"{told['target']} {told['level']}: stack of {name}: {path['refused']}" for told in all_told
                for name, path in told["stack"].items() if "refused" in path]
    print(f"\nlimits, {' '.join(FIRMWARE)}")
    for name, limit in LIMITS.items():
        value = now[name]
        kept = value is not None and value <= limit
        print(f"  {name:30s} {value if value is not None else '?':>8}  {'ok' if kept else f'ABOVE {limit}'}")
        if not kept:
            problems.append(f"{name}: {value}, at most {limit}")
    return problems


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", help="the build directory, with klingel in it (default %(default)s)")
    parser.add_argument("--check", action="store_true", help="exit 1 where a limit or the list of imports is not kept")
    parser.add_argument("--json", metavar="FILE", help="default: footprint/footprint.json in the build directory")
    arguments = parser.parse_args()
    build = (ROOT / arguments.build).resolve()
    out = build / "footprint"
    problems: list[str] = []
    with concurrent.futures.ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        all_built = [compile_all(name, level, out, pool) for name, level in COLUMNS]
        try:
            all_told = [measure(built) for built in all_built]
        except Refused as refused:
            sys.exit(f"footprint.py: {refused}")
        klingel = build / "klingel"
        counts = [count for found in pool.map(lambda v: count_steps(v, klingel, out), vehicles()) for count in found]
    for built in all_built:
        problems += imports(built)
    print_table(all_told, counts)
    problems += judge(all_told, counts)
    path = pathlib.Path(arguments.json) if arguments.json else out / "footprint.json"
    path.write_text(json.dumps({"targets": all_told, "instructions": counts, "limits": LIMITS}, indent=1) + "\n")
    print(f"\nas JSON: {os.path.relpath(path, ROOT)}")
    if problems:
        print("\n".join(problems))
        sys.exit(1 if arguments.check else 0)


if __name__ == "__main__":
    main()
