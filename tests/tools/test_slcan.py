#!/usr/bin/python3
"""`klingel hil --bus slcan:PATH`: stock python-can, the bench, and whatever else may hold a serial port's other end."""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))

from cli import DEMO, KLINGEL, ROOT, WAGON, klingel  # noqa: E402
from klingel_bench.transport import Address  # noqa: E402

DIVIDER = "20"  # python-can's slcan reads a byte per system call: some 1000 frames a second are enough for it


class Hil:
    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name) / "bus"
        self.report = pathlib.Path(self.folder.name) / "report.json"
        self.process = subprocess.Popen(
            [KLINGEL, "hil", WAGON, DEMO, "--bus", f"slcan:{self.path}", "--state-divider", DIVIDER, "--speed", "20",
             "--priority", "0", "--report", self.report], cwd=ROOT, stdout=subprocess.PIPE, text=True)
        self.said = self.process.stdout.readline() + self.process.stdout.readline()

    def end(self) -> dict:
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=20)
        return json.loads(self.report.read_text())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()
        self.process.stdout.close()
        self.folder.cleanup()


def collect(bus: can.BusABC, seconds: float) -> list[can.Message]:
    frames, until = [], time.monotonic() + seconds
    while time.monotonic() < until:
        if (message := bus.recv(0.1)) is not None:
            frames.append(message)
    return frames


class Slcan(unittest.TestCase):
    def test_stock_python_can_reads_the_states(self):
        with Hil() as hil:
            self.assertRegex(hil.said, r"slcan on /dev/pts/\d+, linked from " + re.escape(str(hil.path)))
            with can.Bus(interface="slcan", channel=str(hil.path), bitrate=500000, sleep_after_open=0) as bus:
                self.assertEqual(bus.get_version(2.0), (1, 1))
                self.assertEqual(bus.get_serial_number(2.0), "KL01")
                frames = collect(bus, 2.0)
            identifiers = {frame.arbitration_id for frame in frames}
            self.assertTrue({0x020, 0x030, 0x100, 0x101, 0x140, 0x200} <= identifiers, identifiers)
            counters = [int.from_bytes(frame.data[:2], "little") for frame in frames if frame.arbitration_id == 0x020]
            self.assertEqual([b - a for a, b in zip(counters, counters[1:])], [1] * (len(counters) - 1))
            bus = hil.end()["bus"]
            self.assertEqual((bus["kind"], bus["send_dropped"]), ("slcan", 0))

    def test_clients_come_and_go_and_talk_nonsense(self):
        with Hil() as hil:
            for k in range(3):
                port = os.open(hil.path, os.O_RDWR | os.O_NOCTTY)
                os.write(port, b"\rhello\rt12\x00\xff\r" + os.urandom(300) + b"\rO\rt12")
                time.sleep(0.1 * (k + 1))
                os.close(port)
                time.sleep(0.05)
            with can.Bus(interface="slcan", channel=str(hil.path), sleep_after_open=0) as bus:
                frames = collect(bus, 1.0)
            self.assertGreater(len(frames), 300)
            report = hil.end()
            self.assertGreaterEqual(report["bus"]["spoilt"], 3)

    def test_the_bench_commands_and_judges(self):
        with Hil() as hil:
            done = subprocess.run(
                [sys.executable, "tools/bench.py", "--bus", f"slcan:{hil.path}", "--model", WAGON, "--klingel", KLINGEL,
                 "--dbc-option=--state-divider", f"--dbc-option={DIVIDER}", "--start", "--speed", "25", "--tolerate",
                 "late", "--time", "3", "--interval", "0"], cwd=ROOT, capture_output=True, text=True, timeout=60,
                check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("verdict: clean", done.stdout)
            self.assertIn("run state Running", done.stdout)

    def test_addresses(self):
        address = Address.parse("slcan:/dev/ttyUSB0")
        self.assertEqual((address.device, str(address)), ("/dev/ttyUSB0", "slcan /dev/ttyUSB0"))
        with self.assertRaises(ValueError):
            Address.parse("slcan:")

    def test_wrong_names_are_told(self):
        self.assertEqual(klingel("hil", WAGON, "--bus", "slcan:").returncode, 2)
        done = klingel("hil", WAGON, "--bus", "slcan:/nowhere/at/all")
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/at/all", done.stderr)


if __name__ == "__main__":
    unittest.main()
