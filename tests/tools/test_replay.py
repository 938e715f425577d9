#!/usr/bin/python3
"""klingel run and hil --record, replay, diff, and snapshots: the same bits in another process.

usage: KLINGEL=build/klingel python3 tests/tools/test_replay.py [-v]
"""

from __future__ import annotations

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import zlib

from cli import CURVE, DEMO, KLINGEL, RESTRAINED, ROOT, WAGON, klingel, output, rows

RUN = ("run", WAGON, DEMO, "--speed", "25", "--speed-to", "27", "--initial", "front.y=2mm")
STRICT = "-std=c11 -ffp-contract=off -fno-math-errno -O2".split()


class Temporary(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="klingel-replay")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def record(self, name: str, *more: object, run: tuple[str, ...] = RUN, seconds: float = 3) -> pathlib.Path:
        path = self.folder / name
        output(*run, "--time", seconds, "--record", path, *more)
        return path

    def fails(self, *arguments: object, says: str, status: int = 1) -> subprocess.CompletedProcess:
        done = klingel(*arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertIn(says, done.stdout + done.stderr)
        return done


class Help(Temporary):
    def test_commands_explain_themselves(self) -> None:
        for command, operands in (("replay", "FILE [MODEL [TRACK]]"), ("diff", "A B")):
            text = output(command, "--help")
            self.assertTrue(text.startswith(f"usage: klingel {command} {operands} [options]"))
            self.assertIn(f"  {command} ", output("--help"))
            self.assertLess(max(map(len, text.splitlines())), 100)
            self.fails(command, says=f"an argument is missing: expected {operands}", status=2)
            for line in text.split("example:\n")[1].replace("\\\n", " ").strip().splitlines():
                words = [str(ROOT / w) if w.startswith("models/") else w for w in line.split()]
                done = subprocess.run([str(KLINGEL), *words[1:]], cwd=self.folder, capture_output=True, text=True,
                                      timeout=60, check=False)
                self.assertEqual((done.returncode, done.stderr), (0, ""), line)

    def test_misuse(self) -> None:
        a = self.record("a.klr")
        for arguments, says in ((("replay", a, WAGON, DEMO, "more"), "one argument too many"),
                                (("diff", a), "expected A B"), (("diff", a, a, a), "one argument too many"),
                                (("diff", a, a, "--set", "x=1"), "--set: recordings"),
                                (("diff", a, a, "--tolerance", "-1"), "must be within 0.."),
                                (("diff", a, a, "--track", DEMO), "--track needs --model"),
                                ((*RUN, "--time", "1", "--record", self.folder / "x.yaml"), "not be written over"),
                                ((*RUN, "--time", "1", "--record", "-"), "a recording needs a file"),
                                ((*RUN, "--time", "1", "--record", a, "--record-every", "0"), "--record-every 0"),
                                ((*RUN, "--time", "1", "--snapshot-at", "1"), "needs --snapshot FILE"),
                                ((*RUN, "--time", "1", "--snapshot", self.folder / "s", "--snapshot-at", "2"),
                                 "this run goes from 0 to 1 s"),
                                ((*RUN, "--time", "1", "--from-snapshot", a), "exclude each other"),
                                (("run", WAGON, "--from-snapshot", a), "--time T is missing")):
            with self.subTest(arguments=arguments):
                self.fails(*arguments, says=says, status=2)


class Replay(Temporary):
    def test_the_same_bits(self) -> None:
        final = output(*RUN, "--time", "3", "--final-hash")
        path = self.record("a.klr")
        text = output("replay", path)
        self.assertIn("3000 steps of 1 ms, recorded by klingel run of two_axle_wagon", text)
        self.assertIn("states      3 compared with the recorded ones, 0 differ\n", text)
        self.assertIn(f"state hash  {final.strip()}, as recorded\n", text)
        self.assertEqual(output("replay", path, WAGON, DEMO, "--final-hash"), final)

    def test_csv_is_that_of_the_run(self) -> None:
        path = self.record("a.klr", "--csv", self.folder / "run.csv", "--every", "7")
        self.assertEqual(output("replay", path, "--csv", "--every", "7"), (self.folder / "run.csv").read_text())

    def test_values_and_sets_are_kept(self) -> None:
        path = self.record("a.klr", "--set", "track.irregularities.spectrum.seed=7", "--set", "wheelsets[0].mass_kg=1450")
        self.assertIn("as recorded", output("replay", path))

    def test_the_file_describes_itself(self) -> None:
        lines = self.record("a.klr", "--record-every", "500").read_text().splitlines()
        head = dict(line.split(" ", 1) for line in lines[:10])
        self.assertEqual(lines[0], "klingel recording 1")
        self.assertEqual((head["model"], head["real"], head["step_ns"]), ("two_axle_wagon", "double", "1000000"))
        self.assertEqual((head["vehicle"], head["track"]), (WAGON, DEMO))
        self.assertIn("input 11 rear.right.friction_factor", lines)
        crc = 0
        for line in lines:  # Python's own CRC-32
            if line.startswith("crc "):
                self.assertEqual(line, f"crc {crc:08x}")
                crc = 0
            else:
                crc = zlib.crc32(line.encode() + b"\n", crc)
        self.assertEqual(sum(line.startswith("state ") for line in lines), 6)
        self.assertEqual(lines[-3].split()[0], "state")
        self.assertRegex(lines[-2], r"^end 3000 [0-9a-f]{16}$")

    def test_truncated_and_damaged(self) -> None:
        path = self.record("a.klr", "--record-every", "10")
        whole = path.read_bytes()
        self.assertGreater(whole.count(b"\ncrc "), 5)
        cut = self.folder / "cut.klr"
        cut.write_bytes(whole[:len(whole) // 2])
        done = self.fails("replay", cut, says="the file was cut off in the block that begins here; good up to step ")
        step = int(done.stderr.split()[-1])
        self.assertTrue(0 < step < 3000)
        self.assertIn(f"{step} steps of 1 ms", done.stdout)
        self.assertIn(", 0 differ", done.stdout)
        # as far as it goes it is the run's own
        self.assertIn(output(*RUN, "--time", step / 1000, "--final-hash").strip(), done.stdout)
        at = whole.rindex(b"\nstate ") + 40
        cut.write_bytes(whole[:at] + b"%c" % (whole[at] ^ 1) + whole[at + 1:])
        self.fails("replay", cut, says="damaged: its CRC is wrong; good up to step ")
        cut.write_bytes(b"")
        self.fails("replay", cut, says="not a recording")
        self.fails("replay", self.folder / "none", says="No such file")
        self.fails("replay", WAGON, says=f"{WAGON}:1: not a recording")

    def test_another_model_is_said(self) -> None:
        path = self.record("a.klr")
        self.fails("replay", path, WAGON, says="--changed-model replays it all the same")
        done = self.fails("replay", path, WAGON, DEMO, "--set", "wheelsets.front.mass_kg=1401", "--changed-model",
                          says="NOT AS RECORDED")
        self.assertRegex(done.stdout, r"parts +after step 0, by step 1000 at the latest; most there: \w+\.")
        self.fails("replay", path, RESTRAINED, "--changed-model", says="inputs and a step of")

    def test_a_run_that_derails_is_recorded_to_its_end(self) -> None:
        path = self.folder / "d.klr"
        done = klingel("run", RESTRAINED, "--speed", "100", "--time", "100", "--initial", "wheelset.y=5mm", "--record", path)
        self.assertEqual(done.returncode, 1)
        self.assertIn("as recorded", output("replay", path))

    def test_disk_full(self) -> None:
        self.fails(*RUN, "--time", "30", "--record", "/dev/full", says="No space left")
        self.fails(*RUN, "--time", "1", "--record", "/nowhere/a.klr", says="cannot write /nowhere/a.klr")


class Diff(Temporary):
    def test_no_difference(self) -> None:
        a, b = self.record("a.klr"), self.record("b.klr", "--record-every", "17")
        self.assertIn("3000 steps of 64 numbers, no difference\n", output("diff", a, b))

    def test_first_step_signal_and_size(self) -> None:
        """A step of the set-point at a known time; the states that can feel it first are speed, place and spin."""
        a = self.record("a.klr", run=("run", WAGON, "--speed", "20"), seconds=1)
        lines = a.read_text().splitlines()
        b = self.folder / "b.klr"
        body, crc = [], 0
        for line in lines[:lines.index("+ 1000")] + ["+ 400", "= 0 21", "+ 600", "end 1000 0000000000000000", "crc"]:
            if line.startswith("crc"):
                line, crc = f"crc {crc:08x}", 0
            else:
                crc = zlib.crc32(line.encode() + b"\n", crc)
            body.append(line)
        b.write_text("\n".join(body) + "\n")
        done = self.fails("diff", a, b, says="inputs      part in step 401: speed_m_s 20 against 21\n")
        self.assertIn("first difference in step 401 (0.401 s): ", done.stdout)
        signals = {line.split()[0]: line.split() for line in done.stdout.splitlines() if len(line.split()) == 7}
        # the model's limit is 1 m/s2: 0.001 m/s a step, 0.6 m/s and 0.18 m after 600 steps
        self.assertEqual(signals["speed"][1:4], ["m/s", "401", "1000"])
        self.assertAlmostEqual(float(signals["speed"][6]), 0.6, delta=1e-9)
        self.assertAlmostEqual(float(signals["s"][6]), 0.18, delta=1e-3)
        self.assertNotIn("front.y", signals)  # straight track: nothing goes aside
        done = self.fails("diff", a, b, "--tolerance", "0.3", says="first difference in step ")
        self.assertIn("does not give the recorded bits at the end", done.stdout)

    def test_tolerance_of_runs(self) -> None:
        a = self.record("a.klr")
        b = self.record("b.klr", "--initial", "rear.y=1e-9")
        self.fails("diff", a, b, says="rear.y")
        self.assertIn("no difference beyond the tolerance", output("diff", a, b, "--tolerance", "1"))

    def test_csv(self) -> None:
        one, other = self.folder / "a.csv", self.folder / "b.csv"
        one.write_text("# comment\nt_s,front_y_m\n0,0\n1,0.5\n2,0.25\n3,0\n")
        other.write_text("t_s,front_y_m\n0,0\n1,0.5\n2,0.26\n3,-0.5\n")
        done = self.fails("diff", one, other, says="first difference in row 3: front_y_m 0.25 against ")
        self.assertRegex(done.stdout, r"front_y_m +3 +4 +0 +-0\.5 +-0\.5")
        self.assertIn("no difference", output("diff", one, other, "--tolerance", "0.5"))
        self.assertIn("no difference", output("diff", one, one))
        self.fails("diff", one, other, "--relative", "0.1", says="first difference in row 4")
        other.write_text("t_s,front_y_m\n0,0\n")
        self.fails("diff", one, other, says=f"{other} ends after row 1, {one} goes on")
        other.write_text("t_s,rear_y_m\n0,0\n")
        self.fails("diff", one, other, says="column 2 is front_y_m in")
        other.write_text("t_s,front_y_m\n0,0\n1,x\n")
        self.fails("diff", one, other, says=f"{other}:3: column front_y_m: 'x' is no number")
        other.write_text("")
        self.fails("diff", one, other, says="no CSV file")
        self.fails("diff", one, self.record("a.klr"), says="is a recording and")

    def test_csv_of_runs(self) -> None:
        for name, speed in (("a.csv", "25"), ("b.csv", "25"), ("c.csv", "26")):
            output("run", WAGON, "--speed", speed, "--time", "1", "--csv", self.folder / name)
        self.assertIn("1001 rows", output("diff", self.folder / "a.csv", self.folder / "b.csv"))
        self.fails("diff", self.folder / "a.csv", self.folder / "c.csv", says="speed_m_s")


class Snapshot(Temporary):
    def test_continues_in_another_process(self) -> None:
        """At several steps, the first and the last among them; forces in the CSV as well."""
        whole = self.folder / "whole.csv"
        output(*RUN, "--time", "3", "--csv", whole)
        final = output(*RUN, "--time", "3", "--final-hash")
        snapshot, rest = self.folder / "s.snapshot", self.folder / "rest.csv"
        for at in (0, 0.001, 1.234, 2.999, 3):
            with self.subTest(at=at):
                output(*RUN, "--time", "3", "--snapshot", snapshot, "--snapshot-at", at)
                more = ("run", WAGON, DEMO, "--speed-to", "27", "--time", f"{3 - at:.3f}", "--from-snapshot", snapshot)
                self.assertEqual(output(*more, "--final-hash"), final)
                output(*more, "--csv", rest)
                self.assertEqual(rest.read_text().splitlines()[2:], whole.read_text().splitlines()[round(1000 * at) + 2:])

    def test_refusals(self) -> None:
        snapshot = self.folder / "s.snapshot"
        output(*RUN, "--time", "1", "--snapshot", snapshot)
        good = snapshot.read_bytes()
        more = ("run", WAGON, DEMO, "--time", "1", "--from-snapshot", snapshot)
        output(*more)
        self.fails("run", WAGON, CURVE, *more[3:], says="no snapshot of this model")
        for bad in (good[:-1], good + b"\0", good[:100] + b"\1" + good[101:], b"", b"x" * 100000):
            snapshot.write_bytes(bad)
            self.fails(*more, says="or a damaged one")
        self.fails(*more[:-1], self.folder / "none", says="No such file")

    @unittest.skipUnless(shutil.which("aarch64-linux-gnu-gcc") and shutil.which("qemu-aarch64"), "needs aarch64")
    def test_continues_on_another_target(self) -> None:
        snapshot, program = self.folder / "s.snapshot", self.folder / "go_on"
        output(*RUN, "--time", "1", "--snapshot", snapshot)
        output("build", WAGON, DEMO, "-o", self.folder / "model.c", "--name", "linked")
        core = [str(path) for path in sorted((ROOT / "core").glob("*.c"))]
        subprocess.run(["aarch64-linux-gnu-gcc", *STRICT, "-static", "-DMODEL=linked", f"-I{ROOT}/core", "-o", str(program),
                        str(ROOT / "tests/tools/fixtures/go_on.c"), str(self.folder / "model.c"), *core], check=True)
        done = subprocess.run(["qemu-aarch64", str(program), str(snapshot), "27", "2000"], capture_output=True, text=True,
                              check=True)
        self.assertEqual(done.stdout, output(*RUN, "--time", "3", "--final-hash"))


class Hil(Temporary):
    """Recorded on a bus: set-points, pause, reset, snapshot and restore, then done again without one."""

    def start(self, *arguments: object) -> subprocess.Popen:
        self.report, self.path = self.folder / "report.json", self.folder / "hil.klr"
        process = subprocess.Popen([str(KLINGEL), "hil", WAGON, DEMO, "--bus", "socketcand:0", "--priority", "0", "--record",
                                    str(self.path), "--report", str(self.report), "--policy", "catch-up",
                                    *map(str, arguments)], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        self.port = int(re.match(r"bus: socketcand on 127\.0\.0\.1:(\d+)$", process.stdout.readline()).group(1))
        return process

    def replayed(self) -> str:
        text = output("replay", self.path)
        told = json.loads(self.report.read_text())
        self.assertIn(f"state hash  {told['state_hash']}, as recorded", text)
        self.assertIn(f"{told['node']['steps']} steps of 1 ms, recorded by klingel hil", text)
        self.assertEqual(told["recording"]["lost"], 0)
        self.assertEqual(told["recording"]["steps"], told["node"]["steps"])
        return text

    def test_a_plain_session_is_a_run(self) -> None:
        process = self.start("--start", "--speed", "25", "--time", "1.5")
        text, _ = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0, text)
        self.assertIn("1500 steps, lost 0", text)
        self.replayed()
        run = self.folder / "run.klr"
        output("run", WAGON, DEMO, "--speed", "25", "--time", "1.5", "--record", run)
        self.assertIn("1500 steps of 64 numbers, no difference", output("diff", self.path, run))

    def test_commands_and_setpoints(self) -> None:
        process = self.start("--start", "--speed", "20", "--time", "3")
        script = ("0.2:speed=21.7", "0.5:snapshot", "0.7:pause", "0.8:step=5", "1.0:start", "1.2:reset", "1.3:start",
                  "1.5:speed=23.1", "1.7:restore", "1.8:restore", "2.0:speed=off")
        bench = [str(ROOT / "tools/bench.py"), "--bus", f"socketcand:127.0.0.1:{self.port}", "--model", WAGON, "--klingel",
                 str(KLINGEL), "--time", "2.2", "--interval", "0", "--json", str(self.folder / "bench.json")]
        done = subprocess.run(["/usr/bin/python3", "-B", *bench, *(word for at in script for word in ("--at", at))], cwd=ROOT,
                              capture_output=True, text=True, timeout=60, check=False)
        text, _ = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0, text + done.stderr)
        node = json.loads(self.report.read_text())["node"]
        self.assertEqual(node["run_commands"], 8, done.stdout + done.stderr)
        self.assertGreaterEqual(node["setpoints"], 10)
        found = re.search(r"state set +(\d+) times", self.replayed())
        self.assertEqual(int(found.group(1)), 3)  # reset, restore, restore

    def test_killed(self) -> None:
        process = self.start("--start", "--speed", "25")
        time.sleep(3.2)
        process.send_signal(signal.SIGKILL)
        process.wait(timeout=10)
        done = self.fails("replay", self.path, says="cut off here: it has no end; good up to step ")
        self.assertGreater(int(done.stderr.split()[-1]), 800)
        self.assertIn(", 0 differ", done.stdout)

    def test_a_file_that_takes_nothing_never_stops_the_loop(self) -> None:
        fifo = self.folder / "fifo"
        os.mkfifo(fifo)
        reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        process = self.start("--start", "--speed", "25", "--record", fifo, "--record-every", "1")
        time.sleep(2.5)
        process.send_signal(signal.SIGTERM)
        held = b""
        until = time.monotonic() + 20
        while process.poll() is None and time.monotonic() < until:
            try:
                held += os.read(reader, 1 << 20)
            except BlockingIOError:
                time.sleep(0.01)
        self.assertEqual(process.returncode, 0, process.stdout.read())
        told = json.loads(self.report.read_text())
        self.assertEqual(told["node"]["steps"], told["loop"]["ticks"])
        self.assertGreater(told["recording"]["memory_full_percent"], 30)


if __name__ == "__main__":
    unittest.main()
