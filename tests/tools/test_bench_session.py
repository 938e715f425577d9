#!/usr/bin/python3
"""Whole sessions of the bench, as a program, with a small fake node that does what a node should not.

usage: python3 tests/tools/test_bench_session.py [-v] [TestSession.test_name]
"""

from __future__ import annotations

import json
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/tools"))

import bench_fake  # noqa: E402
from bench_fake import FakeNode  # noqa: E402

BENCH = ROOT / "tools/bench.py"


def setUpModule() -> None:
    global FOLDER, DBC
    FOLDER = tempfile.TemporaryDirectory(prefix="klingel-bench")
    DBC = str(pathlib.Path(FOLDER.name) / "fake.dbc")
    pathlib.Path(DBC).write_text(bench_fake.DBC, encoding="ascii")


def tearDownModule() -> None:
    FOLDER.cleanup()


class TestSession(unittest.TestCase):
    """The whole program against the fake node."""

    def setUp(self):
        self.node = FakeNode()
        self.addCleanup(self.node.stop)

    def start(self, *arguments: str, wait: str = "5") -> subprocess.Popen:
        return subprocess.Popen([sys.executable, BENCH, "--bus", f"socketcand:{self.node.port}", "--dbc", DBC,
                                 "--wait", wait, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def bench(self, *arguments: str, status: int | None = 0) -> dict:
        """Runs it with wide limits on lateness (the machine may be busy) and returns the JSON verdict."""
        if not self.node.is_alive():
            self.node.start()
        path = pathlib.Path(FOLDER.name) / f"{self.id()}.json"
        out, errors = self.start("--slack", "500", "--json", str(path), *arguments).communicate(timeout=60)
        self.errors = errors
        told = json.loads(path.read_text())
        if status is not None:
            self.assertEqual(told["exit_status"], status, out + errors)
        self.assertNotIn("Traceback", errors)
        return told

    def test_clean_session_with_commands_log_and_picture(self):
        log, plot = (str(pathlib.Path(FOLDER.name) / name) for name in ("session.log", "session.png"))
        told = self.bench("--time", "2.5", "--snapshot", "--step", "20", "--speed", "25", "--at", "1:speed=12.5",
                          "--at", "1.2:start", "--log", log, "--plot", plot)
        self.assertEqual([(one["command"], one["result"]) for one in told["commands"]],
                         [("snapshot", "Done"), ("step=20", "Done"), ("start", "Done")])
        self.assertEqual([command for command, _, _ in self.node.commands], [6, 4, 1])
        self.assertEqual(self.node.commands[1][2], 20)
        self.assertEqual((self.node.crc_errors, self.node.lines_misunderstood), (0, 0))
        speeds = [(control, speed) for _, _, control, speed in self.node.setpoints]
        self.assertEqual(set(speeds), {(1, 25.0), (1, 12.5), (0, 12.5)})
        self.assertEqual(speeds[-1], (0, 12.5))
        alive = [count for _, count, _, _ in self.node.setpoints]
        self.assertEqual(alive, [(alive[0] + k) % 15 for k in range(len(alive))])
        gaps = [b[0] - a[0] for a, b in zip(self.node.setpoints[:-1], self.node.setpoints[1:-1])]
        self.assertLess(max(gaps), 0.45)  # the node waits for 0.5 s
        self.check_log(log, told["frames"] + len(self.node.commands) + len(self.node.setpoints))
        self.assertEqual(pathlib.Path(plot).read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(pathlib.Path(plot).stat().st_size, 20_000)

    def check_log(self, path: str, frames: int) -> None:
        lines = pathlib.Path(path).read_text().splitlines()
        self.assertEqual(len(lines), frames)
        pattern = re.compile(r"\(\d{10}\.\d{6}\) vcan0 [0-9A-F]{3}#([0-9A-F]{2}){8}")
        for line in lines:
            self.assertRegex(line, pattern)

    def test_every_counted_fault_of_the_bus(self):
        self.node.skip_at, self.node.repeat_at, self.node.short_at = {30, 31, 50}, {60}, {70}
        self.node.step_jump_at = 80
        told = self.bench("--time", "1.5", status=1)
        counts = told["counts"]
        self.assertEqual((counts["lost"], counts["repeated"], counts["malformed"], counts["step"]), (4, 1, 1, 1))
        self.assertEqual(set(told["failed"]), {"lost", "repeated", "malformed", "step"})

    def test_the_same_tolerated(self):
        self.node.skip_at, self.node.repeat_at = {30, 31}, {60}
        self.bench("--time", "1.2", "--tolerate", "lost=2", "--tolerate", "repeated=1")

    def test_late_frames(self):
        self.node.stall_at = {40: 1.0}
        told = self.bench("--time", "2", status=1)
        self.assertEqual(told["failed"], ["late"])
        self.assertGreaterEqual(told["messages"]["Status"]["worst_s"], 0.9)

    def test_no_acknowledge(self):
        self.node.answer = False
        told = self.bench("--time", "1.5", "--start", "--ack-timeout", "0.3", status=1)
        self.assertEqual(told["failed"], ["command"])
        self.assertEqual(told["commands"][0]["result"], "no answer")

    def test_alive_counter_taken_by_another(self):
        self.node.answer_repeated = 1
        self.bench("--time", "1", "--start")
        self.assertEqual([command for command, _, _ in self.node.commands], [1, 1])

    def test_frames_split_by_tcp(self):
        self.node.piecewise = True
        told = self.bench("--time", "2")
        self.assertGreater(told["frames"], 150)

    def test_peer_vanishes(self):
        for reset in (False, True):
            with self.subTest(reset=reset):
                self.node.vanish_after_s, self.node.reset_connection = 0.6, reset
                began = time.monotonic()
                told = self.bench("--speed", "20", status=3)
                self.assertLess(time.monotonic() - began, 6.0)
                self.assertGreater(told["frames"], 50)
                self.assertEqual(told["counts"]["lost"], 0)

    def test_peer_that_was_to_end_first(self):
        self.node.vanish_after_s = 0.6
        self.bench("--tolerate", "peer")

    def test_peer_falls_silent(self):
        self.node.mute_after_s = 0.4
        told = self.bench("--silence", "0.7", status=3)
        self.assertIn("no frame for 0.7 s", told["ended"])

    def test_garbage_from_the_server(self):
        self.node.garbage_after_s = 0.5
        told = self.bench("--time", "5", status=3)
        self.assertIn("cannot receive", told["ended"])

    def test_not_a_socketcand_server(self):
        self.node.greeting = b"SSH-2.0-OpenSSH_9.2\r\n"
        self.node.start()
        bench = self.start("--time", "5", wait="0")
        _, errors = bench.communicate(timeout=30)
        self.assertEqual(bench.returncode, 3)
        self.assertNotIn("Traceback", errors)

    def test_signals_end_it_with_the_summary(self):
        self.node.start()
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(signal=number):
                before = self.node.tick
                bench = self.start("--speed", "20")
                while self.node.tick < before + 50:
                    time.sleep(0.01)
                bench.send_signal(number)
                out, errors = bench.communicate(timeout=20)
                self.assertEqual(bench.returncode, status, errors)
                self.assertIn("verdict:", out)
                self.assertEqual(self.node.setpoints[-1][2], 0)  # released
                self.assertEqual(errors, "")

    def test_waits_for_the_server(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.node.port = free.getsockname()[1]
        bench = self.start("--time", "0.5", "--slack", "500", wait="20")
        time.sleep(1.5)
        late = FakeNode(self.node.port)
        self.addCleanup(late.stop)
        late.start()
        out, errors = bench.communicate(timeout=30)
        self.assertEqual(bench.returncode, 0, out + errors)
        self.assertEqual(errors.count("refused; trying again"), 1)

    def test_nobody_there(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        done = subprocess.run([sys.executable, BENCH, "--bus", f"socketcand:{port}", "--dbc", DBC, "--wait", "0.5"],
                              capture_output=True, text=True, timeout=30, check=False)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, r"socketcand 127\.0\.0\.1:\d+: connection refused; trying again")

    def test_wrong_usage(self):
        for arguments in ([], ["--dbc", DBC, "--model", "x.yaml"], ["--dbc", DBC, "--at", "1:fly"],
                          ["--dbc", DBC, "--step", "x"], ["--dbc", DBC, "--tolerate", "all"],
                          ["--dbc", DBC, "--bus", "socketcand:x:y"], ["--dbc", DBC + ".none"],
                          ["--model", "x.yaml", "--klingel", "/nonexistent"],
                          ["--dbc", DBC, "--plot", "x.png", "--signals", "Nothing.At.All"]):
            with self.subTest(arguments=arguments):
                done = subprocess.run([sys.executable, BENCH, *arguments], capture_output=True, text=True, timeout=30,
                                      check=False)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertNotIn("Traceback", done.stderr)


if __name__ == "__main__":
    unittest.main()
