#!/usr/bin/python3
"""How good are the deadlines of klingel hil? Runs it and cyclictest on this machine by turns and compares.

Both wake up every step of the model with the same SCHED_FIFO priority, the same duration and, if wanted, on the same
processor; cyclictest (Debian package rt-tests) does nothing else, klingel hil also steps the vehicle and serves a bus.
What is compared is the lateness of the wake-up. They take turns, so that what else the machine does meets both.

    tools/cyclictest.py models/two_axle_wagon.yaml models/demo_track.yaml --time 60 --plot latency.png

Exit status 0 if both ran; with --factor F also only if the p99.9 of klingel hil is at most F times that of cyclictest
plus 10 us.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BUCKETS = 2000  # of 1 us, as klingel hil has them
SLACK_US = 10.0
FORMATS = ("png", "pdf", "svg")


class Failed(Exception):
    pass


@dataclasses.dataclass
class Histogram:
    """Lateness of wake-ups in whole microseconds."""

    buckets: dict[int, int] = dataclasses.field(default_factory=dict)
    overflow: int = 0
    least_us: float = float("inf")
    most_us: float = 0.0
    sum_us: float = 0.0

    @property
    def count(self) -> int:
        return sum(self.buckets.values()) + self.overflow

    def add(self, buckets: dict[str, int], overflow: int, least_us: float, most_us: float, mean_us: float) -> None:
        for us, n in buckets.items():
            self.buckets[int(us)] = self.buckets.get(int(us), 0) + int(n)
        self.overflow += overflow
        self.least_us = min(self.least_us, least_us)
        self.most_us = max(self.most_us, most_us)
        self.sum_us += mean_us * (sum(map(int, buckets.values())) + overflow)

    def quantile_us(self, share: float) -> float:
        """The end of the bucket that a share of the samples does not exceed; overflow counts as the maximum."""
        wanted, below = share * self.count, 0
        for us in sorted(self.buckets):
            below += self.buckets[us]
            if below >= wanted:
                return us + 1.0
        return self.most_us

    def later_than(self) -> tuple[list[float], list[float]]:
        """For each bucket's end the share of the samples that came later; what is 0 is left out."""
        x, y, left = [], [], self.count
        for us in range(0, max(self.buckets, default=0) + 1):
            left -= self.buckets.get(us, 0)
            if left > 0:
                x.append(us + 1.0)
                y.append(left / self.count)
        return x, y

    def told(self) -> dict[str, object]:
        return {"count": self.count, "min_us": self.least_us, "avg_us": self.sum_us / max(self.count, 1),
                "p50_us": self.quantile_us(0.5), "p99_us": self.quantile_us(0.99), "p99_9_us": self.quantile_us(0.999),
                "max_us": self.most_us, "overflow": self.overflow,
                "histogram": {str(us): self.buckets[us] for us in sorted(self.buckets)}}


def perform(command: list[str], seconds: float) -> None:
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=seconds + 60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failed(f"{command[0]}: {error}") from None
    if done.returncode != 0:
        raise Failed(f"{' '.join(command)}: status {done.returncode}\n{done.stdout[-500:]}{done.stderr[-1500:]}")


def run_klingel(options: argparse.Namespace, seconds: float, folder: pathlib.Path, histogram: Histogram) -> dict:
    report = folder / "hil.json"
    command = [options.klingel, "hil", *options.files, "--bus", options.bus, "--start", "--speed", options.speed,
               "--time", f"{seconds:g}", "--priority", str(options.priority), "--report", str(report)]
    perform(command + (["--cpu", str(options.cpu)] if options.cpu is not None else []), seconds)
    loop = json.loads(report.read_text())["loop"]
    late = loop["wake_up_us"]
    histogram.add(late["histogram"], late["overflow"], late["min"], late["max"], late["avg"])
    return loop


def run_cyclictest(options: argparse.Namespace, seconds: float, period_ns: int, folder: pathlib.Path,
                   histogram: Histogram) -> None:
    report = folder / "cyclictest.json"
    loops = max(int(seconds * 1e9 / period_ns), 1)
    command = ["cyclictest", "-q", "-i", str(period_ns // 1000), "-l", str(loops), "-h", str(BUCKETS), f"--json={report}"]
    command += ["-m", "--policy=fifo", "-p", str(options.priority)] if options.priority > 0 else ["--policy=other"]
    perform(command + (["-a", str(options.cpu)] if options.cpu is not None else []), seconds)
    thread = json.loads(report.read_text())["thread"]["0"]
    buckets = thread["histogram"]
    histogram.add(buckets, max(int(thread["cycles"]) - sum(map(int, buckets.values())), 0), thread["min"], thread["max"],
                  thread["avg"])


def print_table(told: dict[str, dict]) -> None:
    print(f"{'lateness of wake-ups, us':26s}{'count':>9s}{'min':>8s}{'avg':>8s}{'p50':>8s}{'p99':>8s}{'p99.9':>8s}{'max':>9s}")
    for name in ("cyclictest", "klingel hil"):
        one = told[name]
        print(f"{name:26s}{one['count']:9d}{one['min_us']:8.1f}{one['avg_us']:8.1f}{one['p50_us']:8.0f}{one['p99_us']:8.0f}"
              f"{one['p99_9_us']:8.0f}{one['max_us']:9.1f}")


def picture(path: pathlib.Path, options: argparse.Namespace, both: dict[str, Histogram], notes: str) -> None:
    def panel(row: int, title: str, y_label: str, items: list[dict]) -> dict:
        return {"row": row, "column": 0, "rows": 1, "columns": 1, "title": title, "x_label": "lateness [us]",
                "y_label": y_label, "x_range": [1, most], "y_range": None, "equal": False, "y_down": False, "x_log": True,
                "y_log": True, "items": items}

    def line(colour: str, pen: str, name: str, x: list[float], y: list[float]) -> dict:
        return {"kind": "line", "colour": colour, "pen": pen, "thin": False, "label": name, "x": x, "y": y}

    buckets, later = [], []
    most = max(max(histogram.buckets, default=1) for histogram in both.values()) + 1
    for name, colour in (("cyclictest", "second"), ("klingel hil", "first")):
        x = sorted(both[name].buckets)
        buckets.append(line(colour, "points", name, [us + 0.5 for us in x], [both[name].buckets[us] for us in x]))
        later.append(line(colour, "solid", name, *both[name].later_than()))
    description = {"klingel_plot": 1, "format": path.suffix[1:], "title": "Wake-ups: klingel hil beside cyclictest",
                   "notes": notes, "panels": [panel(0, "Histogram, 1 us wide", "wake-ups [-]", buckets),
                                              panel(1, "Later than", "share of the wake-ups [-]", later)]}
    done = subprocess.run([sys.executable, "-B", str(ROOT / "tools/plot.py")], input=json.dumps(description).encode(),
                          capture_output=True, check=False)
    if done.returncode != 0:
        raise Failed(f"no picture: {done.stderr.decode().strip()}")
    path.write_bytes(done.stdout)


def measure(options: argparse.Namespace) -> dict:
    both = {"cyclictest": Histogram(), "klingel hil": Histogram()}
    overruns = own = 0
    fifo = True
    seconds = options.time / options.rounds
    with tempfile.TemporaryDirectory(prefix="klingel-cyclictest") as name:
        folder = pathlib.Path(name)
        for _ in range(options.rounds):
            loop = run_klingel(options, seconds, folder, both["klingel hil"])
            overruns += loop["overruns"]
            own += loop["overruns"] - loop["system_overruns"]
            fifo = fifo and loop["fifo"]
            run_cyclictest(options, seconds, loop["period_ns"], folder, both["cyclictest"])
    told = {name: histogram.told() for name, histogram in both.items()}
    notes = (f"{options.time:g} s each in {options.rounds} turns, every {loop['period_ns'] / 1e3:g} us, "
             f"{'SCHED_FIFO ' + str(options.priority) if fifo and options.priority else 'no real-time scheduling'}, "
             f"{os.uname().release}; klingel hil: {overruns} overruns, {own} of its own making")
    if options.plot:
        picture(options.plot, options, both, notes)
    return {**told, "overruns": overruns, "own_overruns": own, "fifo": fifo, "notes": notes}


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="MODEL [TRACK]", help="for klingel hil")
    parser.add_argument("--time", type=float, default=60.0, metavar="S", help="of each, s (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=4, metavar="N", help="turns that this is divided into (default %(default)s)")
    parser.add_argument("--priority", type=int, default=80, metavar="N", help="SCHED_FIFO, of both; 0: none (default %(default)s)")
    parser.add_argument("--cpu", type=int, metavar="N", help="the processor of both (default: any)")
    parser.add_argument("--speed", default="27", metavar="V", help="of the vehicle, as klingel hil takes it (default %(default)s)")
    parser.add_argument("--bus", default="socketcand:0", metavar="BUS", help="as klingel hil takes it (default %(default)s)")
    parser.add_argument("--klingel", default=os.environ.get("KLINGEL", str(ROOT / "build/klingel")), metavar="PROGRAM")
    parser.add_argument("--json", metavar="FILE", help="figures and histograms; - is standard output, in place of the table")
    parser.add_argument("--plot", type=pathlib.Path, metavar="FILE", help="both histograms, .png, .pdf or .svg")
    parser.add_argument("--factor", type=float, metavar="F", help="fail where klingel hil is later than F times cyclictest")
    options = parser.parse_args()
    if len(options.files) > 2 or not 0 < options.time <= 1e6 or not 1 <= options.rounds <= 1000:
        parser.error("at most MODEL and TRACK; --time within 0..1e6 s; --rounds within 1..1000")
    if not 0 <= options.priority <= 99:
        parser.error("--priority must be within 0..99")
    if options.plot and options.plot.suffix[1:] not in FORMATS:
        parser.error(f"--plot {options.plot}: must end in .png, .pdf or .svg")
    return options


def main() -> int:
    options = arguments()
    if shutil.which("cyclictest") is None:
        raise Failed("there is no cyclictest; install the Debian package rt-tests (make deps)")
    told = measure(options)
    if options.json != "-":
        print_table(told)
        print(told["notes"])
    if options.json:
        text = json.dumps(told, indent=1) + "\n"
        sys.stdout.write(text) if options.json == "-" else pathlib.Path(options.json).write_text(text)
    ours, theirs = told["klingel hil"]["p99_9_us"], told["cyclictest"]["p99_9_us"]
    if options.factor is not None and ours > options.factor * theirs + SLACK_US:
        raise Failed(f"p99.9 of klingel hil is {ours:g} us, of cyclictest {theirs:g} us")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (Failed, OSError, KeyError, ValueError) as error:
        sys.exit(f"cyclictest.py: {error}")
