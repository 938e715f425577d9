#!/usr/bin/python3
"""The DBC, judged by canmatrix: it loads, is complete, and means what our codec does.

usage: BUILD=build tests/tools/test_dbc.py      (builds tests/port/dbc_peer itself)
"""
import decimal
import io
import logging
import os
import pathlib
import random
import re
import subprocess
import unittest
from decimal import Decimal

logging.disable(logging.CRITICAL)  # canmatrix tells about optional formats it was built without
import canmatrix.formats  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("BUILD", "build"))
PEER = ROOT / BUILD / "tests/port/dbc_peer"
BODIES, WHEELSETS, ACTUATORS = "3", "4", "2"  # four axles of independent wheels, active suspension, a free speed
BENCH = ("RunControl", "SpeedSetpoint", "Actuator1", "Actuator2", "Wheelset1Drive", "Wheelset2Drive", "Wheelset3Drive",
         "Wheelset4Drive", "DrawForce")
SEED = 20260102


def peer(what: str, *more: str, text: str = "") -> str:
    """Runs our codec."""
    return subprocess.run([PEER, what, BODIES, WHEELSETS, ACTUATORS, *more], input=text, check=True,
                          capture_output=True, text=True).stdout


def load(text: str):
    """The one network of a DBC text, as canmatrix sees it."""
    networks = canmatrix.formats.load(io.BytesIO(text.encode("ascii")), "dbc")
    (network,) = networks.values()
    return network


class TestDbc(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        subprocess.run(["make", "-s", f"BUILD={BUILD}", f"{BUILD}/tests/port/dbc_peer"], cwd=ROOT,
                       check=True)
        cls.text = peer("dbc")
        cls.network = load(cls.text)
        cls.frames = {frame.arbitration_id.id: frame for frame in cls.network.frames}

    def test_loads_without_errors_and_is_complete(self) -> None:
        self.assertEqual(self.network.load_errors, [])
        self.assertEqual(len(self.network.frames), 14 + 3 * 3 + 4 * 4 + 5 * 8 + 2)
        self.assertEqual({ecu.name for ecu in self.network.ecus}, {"Klingel", "Bench"})
        names = [frame.name for frame in self.network.frames]
        self.assertEqual(len(names), len(set(names)))
        for name in ("RunControl", "Wheelset4Motion", "Body3Rates", "Wheel1LContact", "Wheel4RFlange", "Actuator2", "Wheelset4Drive",
                     "DrawForce", "Wheel4LSpin"):
            self.assertIn(name, names)

    def test_every_frame_is_described(self) -> None:
        for frame in self.network.frames:
            with self.subTest(frame=frame.name):
                self.assertFalse(frame.arbitration_id.extended)
                self.assertTrue(frame.comment)
                self.assertEqual(frame.size, 8)
                bench = frame.name in BENCH
                self.assertEqual(frame.transmitters, ["Bench" if bench else "Klingel"])
                event = frame.name in ("RunControl", "Ack")
                send_type = frame.attribute("GenMsgSendType", db=self.network)
                self.assertEqual(send_type, "Event" if event else "Cyclic")
                self.assertEqual(frame.cycle_time == 0, event)
                protected = frame.attribute("E2EDataId", db=self.network)
                self.assertEqual(int(protected) != 0, bench)

    def test_every_signal_is_described(self) -> None:
        for frame in self.network.frames:
            bench = frame.name in BENCH
            for signal in frame.signals:
                with self.subTest(frame=frame.name, signal=signal.name):
                    self.assertTrue(signal.is_little_endian)
                    self.assertTrue(signal.comment)
                    self.assertEqual(signal.receivers, ["Klingel" if bench else "Bench"])
                    self.assertEqual(signal.initial_value, 0)
                    self.check_range(signal)

    def check_range(self, signal) -> None:
        """Minimum and maximum are the raw range, less the one value that stands for Invalid."""
        bits = signal.size
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signal.is_signed else (0, (1 << bits) - 1)
        if "Invalid" in signal.values.values():
            (invalid,) = (raw for raw, name in signal.values.items() if name == "Invalid")
            self.assertEqual(invalid, low if signal.is_signed else high)
            low, high = (low + 1, high) if signal.is_signed else (low, high - 1)
        self.assertEqual(signal.min, low * signal.factor + signal.offset)
        self.assertEqual(signal.max, high * signal.factor + signal.offset)

    def test_cycle_times_and_enumerations(self) -> None:
        cycle = {frame.name: frame.cycle_time for frame in self.network.frames}
        self.assertEqual(cycle["Wheelset1Motion"], 1)
        self.assertEqual(cycle["Status"], 10)
        self.assertEqual(cycle["SpeedSetpoint"], 100)
        self.assertEqual(cycle["Actuator1"], 10)
        self.assertEqual((cycle["Wheelset3Drive"], cycle["DrawForce"], cycle["Wheel2LSpin"]), (10, 100, 1))
        identity = {frame.attribute("E2EDataId", db=self.network) for frame in self.network.frames if frame.name in BENCH}
        self.assertEqual(len(identity), len(BENCH))  # each its own: no command can be taken for another
        self.assertEqual(cycle["InfoModel"], 1000)
        state = self.network.frame_by_name("Status").signal_by_name("RunState")
        self.assertEqual(state.values, {0: "Init", 1: "Running", 2: "Paused", 3: "Stopped", 4: "Fault"})
        self.assertEqual(self.network.frame_by_name("Wheel2RForces").signal_by_name("Q").unit, "N")
        table_hash = re.search(r'BA_ "SignalTableHash" "([0-9a-f]{16})";', self.text)
        self.assertIsNotNone(table_hash)

    def test_canmatrix_decodes_and_encodes_what_our_codec_does(self) -> None:
        lines = peer("frames", "40").splitlines()
        self.assertGreater(len(lines), 2000)
        for line in lines:
            number, hexadecimal, *rest = line.split()
            frame = self.frames[int(number)]
            data = bytes.fromhex(hexadecimal)
            decoded = frame.decode(data)
            values = {}
            self.assertEqual(len(rest), 3 * len(decoded), line)
            for name, raw, physical in zip(rest[0::3], rest[1::3], rest[2::3]):
                self.assertEqual(decoded[name].raw_value, int(raw), line)
                self.assertEqual(float(decoded[name].phys_value), float(physical), line)
                # Frame.encode of 0.9.5 takes raw values; the way from physical ones is phys2raw
                values[name] = decoded[name].signal.phys2raw(decoded[name].phys_value)
            self.assertEqual(frame.encode(values), data, line)

    def test_our_codec_rounds_to_the_nearest_raw_value(self) -> None:
        """Against decimal arithmetic, for values in and around the range of each signal."""
        rng = random.Random(SEED)
        asked, expected = [], []
        for number, frame in self.frames.items():
            for signal in frame.signals:
                for _ in range(20):
                    low, high = float(signal.min), float(signal.max)
                    value = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low))
                    exact = (Decimal(value) - signal.offset) / signal.factor
                    raw = int(exact.quantize(Decimal(1), rounding=decimal.ROUND_HALF_UP))
                    least = int((signal.min - signal.offset) / signal.factor)
                    most = int((signal.max - signal.offset) / signal.factor)
                    asked.append(f"{number} {signal.name} {value!r}")
                    expected.append(min(max(raw, least), most))
        answers = [int(line) for line in peer("quantise", text="\n".join(asked)).split()]
        self.assertEqual(answers, expected, f"seed {SEED}")


if __name__ == "__main__":
    unittest.main()
