#!/usr/bin/python3
"""The demonstration's plant model on a real vcan0, checked for correctness (never for timing).

Runs `klingel hil` on vcan0 beside can-utils' candump, here if the kernel has a vcan0, else in a QEMU guest, then takes
vcan0 down and up in the middle and fills it. From candump's log, read here without any of Klingel's code, it checks that
every cyclic message came, that the 16-bit counter of each grows by one from frame to frame before and after the gap, and
that the model's report agrees with what was heard.
"""
import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOREIGN = {0x7AB, 0x010}  # what the session below sends itself: nonsense, and a malformed command
IN_FLIGHT = 1000  # net.core.netdev_max_backlog: what the kernel may have taken, and drops as vcan0 goes down
LINE = re.compile(r"^\((\d+\.\d+)\) (\S+) ([0-9A-F]{3})#([0-9A-F]*)")

SCRIPT = """
set -eu
out="$1"; klingel="$2"; seconds="$3"; scratch="$4"
candump -D -L -r 8388608 vcan0 >"$scratch/bus.log" &
dump=$!
sleep 1
"$klingel" hil models/two_axle_wagon.yaml models/demo_track.yaml --bus vcan0 --speed 27 --start \\
    --time "$seconds" --report "$out/timing.json" >"$out/hil.txt" 2>&1 &
hil=$!
sleep $((seconds / 2 + 1))
ip link set vcan0 down; sleep 1; ip link set vcan0 up
cansend vcan0 7AB#DEADBEEF
cansend vcan0 010#00
wait $hil
sleep 1
kill $dump 2>/dev/null || true
[ "$scratch" = "$out" ] || cp "$scratch/bus.log" "$out/bus.log"
"""


def run_session(klingel: str, out: pathlib.Path, seconds: int, program: list[str]) -> int:
    script = out / "session.sh"
    script.write_text(SCRIPT)
    # the guest writes to the host slowly: candump's log goes to its memory first
    scratch = "/run" if program else str(out)
    command = ["sh", str(script), str(out), klingel, str(seconds), scratch]
    return subprocess.run(program + command, cwd=ROOT, check=False).returncode


def read_log(path: pathlib.Path) -> dict[int, list[tuple[float, int, bytes]]]:
    frames: dict[int, list[tuple[float, int, bytes]]] = collections.defaultdict(list)
    for number, line in enumerate(path.read_text().splitlines(), 1):
        match = LINE.match(line)
        if match is None:
            raise SystemExit(f"{path}:{number}: not a candump line: {line!r}")
        frames[int(match[3], 16)].append((float(match[1]), number, bytes.fromhex(match[4])))
    return frames


def check_counters(frames: dict[int, list[tuple[float, int, bytes]]], foreign: set[int]) -> list[str]:
    """One gap is allowed in each message: while vcan0 was down."""
    problems = []
    for can_id, heard in sorted(frames.items()):
        if can_id in foreign:
            continue
        counters = [int.from_bytes(data[:2], "little") for _, _, data in heard]
        gaps = [i for i in range(1, len(heard)) if (counters[i] - counters[i - 1]) % 65536 != 1]
        if len(gaps) > 1:
            problems.append(f"message {can_id:03X}: {len(gaps)} gaps in {len(heard)} frames")
    return problems


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=10, help="seconds of model time (default: 10)")
    parser.add_argument("--klingel", default="build/klingel", help="default: build/klingel")
    parser.add_argument("--out", default="build/demo_vcan", help="default: build/demo_vcan")
    arguments = parser.parse_args()

    out = (ROOT / arguments.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    native = pathlib.Path("/sys/class/net/vcan0").exists()
    program = [] if native else [str(ROOT / "tools/vm/vcan_vm.py"), "--timeout", "400",
                                 "--writable", str(out), "--"]
    print(f"demo_vcan: {'on this machine' if native else 'in a QEMU guest'}", flush=True)
    status = run_session(str((ROOT / arguments.klingel).resolve()), out, arguments.seconds, program)
    if (out / "hil.txt").exists():
        print((out / "hil.txt").read_text())
    if status != 0:
        print(f"demo_vcan: the session ended with status {status}", file=sys.stderr)
        return 1
    frames = read_log(out / "bus.log")
    report = json.loads((out / "timing.json").read_text())
    problems = check_counters(frames, foreign=FOREIGN)
    heard = sum(len(f) for i, f in frames.items() if i not in FOREIGN)
    busy = [f"{i:03X}: {len(f)}" for i, f in sorted(frames.items())]
    print(f"heard {heard} frames of {len(frames)} messages: {', '.join(busy)}")
    if len(frames) < 10 or heard < 1000:
        problems.append("too few messages or frames")
    sent = report["bus"]["sent"]
    if not 0 <= sent - heard <= IN_FLIGHT:
        problems.append(f"the model says it sent {sent} frames, candump heard {heard}")
    if report["bus"]["send_dropped"] == 0:
        problems.append("vcan0 was down for a second, and no drop was counted")
    for problem in problems:
        print(f"demo_vcan: {problem}", file=sys.stderr)
    print("demo_vcan: " + ("FAILED" if problems else "ok"))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
