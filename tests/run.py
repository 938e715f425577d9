#!/usr/bin/python3
"""Runs Klingel's tests and closes with one line 'N passed, N failed'.

Jobs are cmocka programs, Python unittest files and plain commands (one test each, passed on exit status 0).
A failed job prints its output and the one command that runs it again.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import time
from dataclasses import dataclass, field

ROOT = pathlib.Path(__file__).resolve().parent.parent
PYTHON = "/usr/bin/python3"


@dataclass
class Job:
    name: str
    command: list[str]
    kind: str = "plain"  # cmocka | unittest | plain
    timeout_s: int = 600
    environment: dict[str, str] = field(default_factory=dict)


@dataclass
class Result:
    passed: int
    failed: int
    skipped: int
    output: str
    seconds: float


def count_cmocka(output: str, status: int) -> tuple[int, int, int]:
    passed = sum(int(n) for n in re.findall(r"^\[  PASSED  \] (\d+) test", output, re.M))
    failed = sum(int(n) for n in re.findall(r"^\[  FAILED  \] .*?(\d+) test\(s\)", output, re.M))
    skipped = sum(int(n) for n in re.findall(r"^\[  SKIPPED \] .*?(\d+) test\(s\)", output, re.M))
    if status != 0 and failed == 0 or passed + failed + skipped == 0:
        failed = max(failed, 1)  # died, or ran nothing
    return passed, failed, skipped


def count_unittest(output: str, status: int) -> tuple[int, int, int]:
    ran = re.search(r"^Ran (\d+) test", output, re.M)
    total = int(ran.group(1)) if ran else 0
    bad = sum(int(n) for n in re.findall(r"(?:failures|errors|unexpected successes)=(\d+)", output))
    skipped = sum(int(n) for n in re.findall(r"skipped=(\d+)", output))
    if status != 0 and bad == 0 or total == 0:
        bad = max(bad, 1)
    return max(total - bad - skipped, 0), bad, skipped


def run(job: Job) -> Result:
    start = time.monotonic()
    environment = {**os.environ, **job.environment}
    try:
        done = subprocess.run(job.command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=job.timeout_s,
                              check=False)
        status, output = done.returncode, done.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired as expired:
        status = 1
        output = (expired.stdout or b"").decode(errors="replace") + f"\ntimed out after {job.timeout_s} s\n"
    if job.kind == "cmocka":
        counts = count_cmocka(output, status)
    elif job.kind == "unittest":
        counts = count_unittest(output, status)
    else:
        counts = (1, 0, 0) if status == 0 else (0, 1, 0)
    return Result(*counts, output, time.monotonic() - start)


def c_programs(build: str) -> list[Job]:
    jobs = []
    for room in ("core", "port", "hal_linux", "tools"):
        for source in sorted((ROOT / "tests" / room).glob("test_*.c")):
            program = f"{build}/tests/{room}/{source.stem}"
            jobs.append(Job(f"{room}/{source.stem}", [program], "cmocka"))
    return jobs


# tests of commands that calculate, draw or record for ten seconds and more
LONG = {"test_analysis", "test_bench_session", "test_cli_build", "test_cli_examples", "test_docs", "test_fine_step", "test_models", "test_pages",
        "test_plot", "test_replay", "test_timing"}


def python_tests(build: str, long: bool) -> list[Job]:
    environment = {"KLINGEL": f"{build}/klingel", "BUILD": build, "PYTHONDONTWRITEBYTECODE": "1"}
    return [Job(f"tools/{test.stem}", [PYTHON, str(test.relative_to(ROOT))], "unittest",
                environment=environment)
            for test in sorted((ROOT / "tests" / "tools").glob("test_*.py")) if (test.stem in LONG) == long]


def fast_jobs(build: str) -> list[Job]:
    return (c_programs(build)
            + [Job("conformance", [f"{build}/tests/conformance/conformance"], "cmocka")]
            + python_tests(build, long=False))


def slow_jobs(build: str) -> list[Job]:
    stream = f"{build}/tests/hal_linux/stream_socketcand"
    environment = {"KLINGEL": f"{build}/klingel", "BUILD": build, "PYTHONDONTWRITEBYTECODE": "1"}
    return python_tests(build, long=True) + [
        Job("golden", [PYTHON, "tests/golden/golden.py", "--build", f"{build}/golden"], "plain", 1800, environment),
        Job("creep bits and storm", [PYTHON, "tests/golden/creep.py"], environment=environment),
        Job("reference values", ["sh", "tests/reference/check.sh"]),
        Job("float build", ["make", "-s", f"BUILD={build}/float", "REAL=-DKL_REAL_FLOAT",
                            f"{build}/float/libklingel_port.a", f"{build}/float/libklingel_core.a"]),
        Job("clang build", ["make", "-s", f"BUILD={build}/clang", "CC=clang", "lib"]),
        Job("conformance on vcan", ["sh", "tests/conformance/run_vcan.sh",
                                    f"{build}/tests/conformance/conformance"], "cmocka", 900),
        Job("guest with vcan", [PYTHON, "tests/tools/vm/test_vcan_vm.py"], "unittest", 900),
        Job("socketcand at 10 frames/ms", [PYTHON, "tests/hal_linux/socketcand_python_can.py", stream,
                                           "--seconds", "5", "--frames", "10"]),
        Job("footprint", [PYTHON, "tools/footprint.py", "--build", build, "--check"], "plain", 1200),
        Job("firmware in QEMU", [PYTHON, "tests/firmware/test_firmware.py"], "unittest", 600, environment),
        Job("demo on vcan", [PYTHON, "tests/demo_vcan.py"], "plain", 900, environment),
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", help="build directory (default: build)")
    parser.add_argument("--all", action="store_true", help="the slow jobs as well (guest, golden, ...)")
    parser.add_argument("--only", metavar="TEXT", help="only jobs whose name contains TEXT")
    parser.add_argument("--list", action="store_true", help="list the jobs and stop")
    arguments = parser.parse_args()

    jobs = fast_jobs(arguments.build) + (slow_jobs(arguments.build) if arguments.all or arguments.only else [])
    if arguments.only:
        jobs = [job for job in jobs if arguments.only in job.name]
    if arguments.list:
        print("\n".join(job.name for job in jobs))
        return 0
    if not jobs:
        print(f"run.py: no job's name contains '{arguments.only}' (see --list)", file=sys.stderr)
        return 2

    passed = failed = skipped = 0
    for job in jobs:
        result = run(job)
        passed, failed, skipped = passed + result.passed, failed + result.failed, skipped + result.skipped
        state = "ok    " if result.failed == 0 else "FAILED"
        extra = f", {result.skipped} skipped" if result.skipped else ""
        print(f"{state} {job.name:32s} {result.passed:4d} passed{extra}  {result.seconds:6.1f} s",
              flush=True)
        if result.failed:
            again = " ".join([f"{k}={v}" for k, v in job.environment.items()] + job.command)
            print(result.output[-6000:], f"run it again: {again}", sep="\n", flush=True)
    tail = f", {skipped} skipped" if skipped else ""
    print(f"{passed} passed, {failed} failed{tail}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
