#!/usr/bin/python3
"""Unit tests of the bench; whole sessions of it are in test_bench_session.py.

usage: python3 tests/tools/test_bench.py [-v] [TestClass[.test_name]]
"""

from __future__ import annotations

import io
import math
import os
import pathlib
import re
import socket
import sys
import tempfile
import time
import unittest
import warnings

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests/tools")]

import bench_fake  # noqa: E402
from klingel_bench import candump, picture, table, transport, verdict  # noqa: E402
from klingel_bench.commands import Command, Commander  # noqa: E402
from klingel_bench.database import Database, DatabaseError  # noqa: E402
from klingel_bench.monitor import MAX_SAMPLES, Monitor, Samples  # noqa: E402
from klingel_bench.protection import AliveCheck, Judgement, crc8, frame_crc, seal  # noqa: E402
from klingel_bench.transport import Address, Frame  # noqa: E402


def setUpModule() -> None:
    global FOLDER, DBC, DATABASE
    FOLDER = tempfile.TemporaryDirectory(prefix="klingel-bench")
    DBC = str(pathlib.Path(FOLDER.name) / "fake.dbc")
    pathlib.Path(DBC).write_text(bench_fake.DBC, encoding="ascii")
    DATABASE = Database(DBC)


def tearDownModule() -> None:
    FOLDER.cleanup()


class TestProtection(unittest.TestCase):
    def test_crc_of_the_catalogue(self):
        """Check values of AUTOSAR's SWS CRC Library, table for CRC8."""
        for text, crc in (("00000000", 0x59), ("F20183", 0x37), ("0FAA0055", 0x79), ("00FF5511", 0xB8),
                          ("332255AABBCCDDEEFF", 0xCB), ("926B55", 0x8C), ("FFFFFFFF", 0x74)):
            self.assertEqual(crc8(bytes.fromhex(text)), crc, text)
        self.assertEqual(crc8(b"123456789"), 0x4B)

    def test_frame_of_the_profile(self):
        """AUTOSAR PRS E2E, profile 11, both bytes of data ID 0x123, eight zero bytes."""
        self.assertEqual(seal(0x123, 0, bytes(8)).hex(), "cc00000000000000")
        self.assertEqual(seal(0x123, 1, bytes(8)).hex(), "9101000000000000")

    def test_table_against_long_division(self):
        for k in range(1, 200):
            data = bytes((k * 37 + i * 101) & 0xFF for i in range(8))
            self.assertEqual(frame_crc(k * 331 & 0xFFFF, data), bench_fake.crc_bitwise(k * 331 & 0xFFFF, data))

    def test_every_corrupt_bit_shows(self):
        good = seal(0x1010, 7, bytes(range(8)))
        for bit in range(64):
            bad = bytearray(good)
            bad[bit // 8] ^= 1 << bit % 8
            self.assertEqual(AliveCheck(0x1010).judge(bytes(bad))[0], Judgement.BAD_CRC, f"bit {bit}")
        self.assertEqual(AliveCheck(0x1011).judge(good)[0], Judgement.BAD_CRC)

    def test_seal_keeps_the_high_nibble_and_wraps(self):
        self.assertEqual(seal(1, 14, b"\x00\xA0\x00")[1], 0xAE)
        self.assertEqual(seal(1, 15, b"\x00\xA0\x00")[1], 0xA0)
        with self.assertRaises(ValueError):
            seal(1, 0, b"\x00")

    def test_counter(self):
        check = AliveCheck(0x1010)

        def judge(alive):
            return check.judge(seal(0x1010, alive, bytes(8)))

        self.assertEqual(judge(13), (Judgement.OK, 0))
        self.assertEqual(judge(14), (Judgement.OK, 0))
        self.assertEqual(judge(0), (Judgement.OK, 0))
        self.assertEqual(judge(0), (Judgement.REPEATED, 0))
        self.assertEqual(judge(3), (Judgement.GAP, 2))
        self.assertEqual(check.judge(b"\x00")[0], Judgement.BAD_CRC)
        fifteen = bytearray(8)
        fifteen[1] = 15
        fifteen[0] = bench_fake.crc_bitwise(0x1010, bytes(fifteen))
        self.assertEqual(check.judge(bytes(fifteen))[0], Judgement.BAD_CRC)
        self.assertEqual(judge(4), (Judgement.OK, 0))


class TestCandump(unittest.TestCase):
    def test_lines(self):
        self.assertEqual(candump.line(1700000000.123456, "vcan0", 0x123, b"\x1a\x22\x03"),
                         "(1700000000.123456) vcan0 123#1A2203\n")
        self.assertEqual(candump.line(1.5, "can1", 0x10, b""), "(1.500000) can1 010#\n")
        self.assertEqual(candump.line(0.0, "can1", 0x1ABCDEF0, b"\x00", extended=True),
                         "(0.000000) can1 1ABCDEF0#00\n")

    def test_python_can_reads_it(self):
        import can

        path = str(pathlib.Path(FOLDER.name) / "some.log")
        log = candump.Log(path, "vcan0")
        log.write(1700000000.25, 0x7FF, bytes(range(8)))
        log.write(1700000001.5, 0x800, b"", extended=True)
        log.close()
        first, second = can.CanutilsLogReader(path)
        self.assertEqual((first.arbitration_id, first.is_extended_id, bytes(first.data), first.timestamp),
                         (0x7FF, False, bytes(range(8)), 1700000000.25))
        self.assertEqual((second.arbitration_id, second.is_extended_id, bytes(second.data)), (0x800, True, b""))

    def test_without_a_file(self):
        log = candump.Log(None, "vcan0")
        log.write(0.0, 1, b"")
        log.close()
        self.assertEqual(log.frames, 0)


def status(time_s: float, counter: int, step: int, run_state: int = 1) -> Frame:
    data = bytes([counter & 255, counter >> 8 & 255, run_state, 0]) + step.to_bytes(4, "little")
    return Frame(1000.0 + time_s, bench_fake.STATUS, data, True)


def motion(time_s: float, counter: int) -> Frame:
    return Frame(1000.0 + time_s, bench_fake.VEHICLE_MOTION, (counter & 0xFFFF).to_bytes(2, "little") + bytes(6), True)


class TestMonitor(unittest.TestCase):
    def setUp(self):
        self.monitor = Monitor(DATABASE, slack_s=0.01)

    def test_steady(self):
        for k in range(1000):
            self.monitor.feed(status(0.01 * k, 65000 + k, 10 * k))
        record = self.monitor.of("Status")
        self.assertEqual((record.count, record.lost, record.gaps, record.repeated, record.late), (1000, 0, 0, 0, 0))
        self.assertAlmostEqual(record.mean_s(), 0.01, places=9)
        self.assertLess(record.jitter_s(), 1e-6)
        self.assertEqual(self.monitor.steps.jumps, 0)

    def test_jitter_is_the_standard_deviation(self):
        times = [0.0]
        for k in range(200):
            times.append(times[-1] + (0.008 if k % 2 else 0.014))
        for k, time_s in enumerate(times):
            self.monitor.feed(motion(time_s, k))
        record = self.monitor.of("VehicleMotion")
        self.assertAlmostEqual(record.mean_s(), 0.011, places=9)
        self.assertAlmostEqual(record.jitter_s(), 0.003, places=6)
        self.assertAlmostEqual(record.worst_s, 0.014, places=6)

    def test_gaps_and_repetitions(self):
        for k in (0, 1, 2, 5, 6, 6, 7, 65535):
            self.monitor.feed(motion(0.01 * k, k))
        record = self.monitor.of("VehicleMotion")
        self.assertEqual((record.count, record.repeated), (7, 1))
        self.assertEqual((record.lost, record.gaps), (2, 2))  # 3 and 4; and one jump backwards, of unknown length

    def test_a_gap_is_lost_and_not_late(self):
        for k in (0, 1, 9, 10):
            self.monitor.feed(motion(0.01 * k, k))
        record = self.monitor.of("VehicleMotion")
        self.assertEqual((record.lost, record.gaps, record.late), (7, 1, 0))

    def test_late(self):
        for time_s, counter in ((0.0, 0), (0.0199, 1), (0.0401, 2), (0.05, 3)):
            self.monitor.feed(motion(time_s, counter))
        self.assertEqual(self.monitor.of("VehicleMotion").late, 1)

    def test_step_counter(self):
        step = 0
        for k in range(10):
            step += 10 if k != 5 else 20
            self.monitor.feed(status(0.01 * k, k, step))
        self.assertEqual(self.monitor.steps.jumps, 1)

    def test_step_counter_over_a_gap(self):
        for k in (0, 1, 4, 5):
            self.monitor.feed(status(0.01 * k, k, 10 * k))
        self.assertEqual(self.monitor.steps.jumps, 0)
        self.assertEqual(self.monitor.of("Status").lost, 2)

    def test_step_counter_stands_while_paused(self):
        for k in range(6):
            self.monitor.feed(status(0.01 * k, k, 77 if k > 2 else 10 * k, run_state=2 if k > 2 else 1))
        self.assertEqual(self.monitor.steps.jumps, 0)

    def test_step_counter_after_a_command(self):
        self.monitor.feed(status(0.0, 0, 500))
        self.monitor.feed(Frame(1000.005, bench_fake.ACK, bytes([1, 7, 0, 1, 0, 0, 0, 0]), True))
        self.monitor.feed(status(0.01, 1, 3))
        self.assertEqual(self.monitor.steps.jumps, 0)
        self.assertEqual(len(self.monitor.acks), 1)

    def test_step_counter_wraps(self):
        for k in range(4):
            self.monitor.feed(status(0.01 * k, k, (0xFFFFFFF6 + 10 * k) & 0xFFFFFFFF))
        self.assertEqual(self.monitor.steps.jumps, 0)

    def test_malformed_foreign_and_sync(self):
        self.monitor.feed(motion(0.0, 0)._replace(data=bytes(7)))
        self.monitor.feed(motion(0.0, 0)._replace(classic=False))
        self.monitor.feed(Frame(1000.0, 0x7E0, b"", True))
        self.monitor.feed(Frame(1000.0, 0x080, b"", True))
        self.assertEqual(self.monitor.of("VehicleMotion").malformed, 1)
        self.assertEqual(self.monitor.of("VehicleMotion").count, 0)
        self.assertEqual(self.monitor.unknown, {0x020: 1, 0x7E0: 1})
        self.assertEqual(self.monitor.syncs, 1)

    def test_commands_of_others_are_checked(self):
        good = seal(0x1010, 3, bytes(8))
        self.monitor.feed(Frame(1000.0, bench_fake.RUN_CONTROL, good, True))
        self.monitor.feed(Frame(1000.1, bench_fake.RUN_CONTROL, good[:7] + b"\x01", True))
        self.monitor.feed(Frame(1000.2, bench_fake.RUN_CONTROL, seal(0x1010, 6, bytes(8)), True))
        record = self.monitor.of("RunControl")
        self.assertEqual((record.count, record.bad_crc, record.lost), (2, 1, 2))

    def test_absent(self):
        for k in range(10):
            self.monitor.feed(motion(0.01 * k, k))
            if k < 3:
                self.monitor.feed(status(0.01 * k, k, 10 * k))
        self.assertEqual(self.monitor.absent(), ["Status", "Wheelset1Motion"])

    def test_samples_are_bounded(self):
        samples = Samples(0.01)
        for k in range(3 * MAX_SAMPLES):
            samples.add(0.005 * k, b"")
        self.assertLessEqual(len(samples.times), MAX_SAMPLES)
        self.assertEqual(len(samples.times), len(samples.data))
        self.assertGreater(samples.times[-1], 0.99 * 0.005 * 3 * MAX_SAMPLES)
        self.assertEqual(samples.times, sorted(samples.times))


class TestDatabase(unittest.TestCase):
    def test_decode(self):
        message = DATABASE.by_name["Wheelset1Motion"]
        values = message.decode(bytes([1, 0, 0x18, 0xFC, 0x00, 0x80, 0, 0]))
        self.assertEqual(values, {"Counter": 1.0, "Y": -0.001, "Yaw": -0.032768})
        self.assertTrue(math.isnan(message.decode(bytes([0, 0, 0, 0x80, 0, 0, 0, 0]))["Y"]))
        self.assertEqual(DATABASE.by_name["Ack"].decode(bytes(8))["Result"], "Done")

    def test_encode_rounds_physical_values(self):
        message = DATABASE.by_name["SpeedSetpoint"]
        for speed, raw in ((25.0, 10000), (0.0012, 0), (0.0013, 1), (41.6667, 16667)):
            self.assertEqual(message.encode({"Control": 1, "Speed": speed})[2:6],
                             bytes([1, 0]) + raw.to_bytes(2, "little"))

    def test_not_a_dbc_of_ours(self):
        path = pathlib.Path(FOLDER.name) / "other.dbc"
        path.write_text(bench_fake.DBC.replace("Status", "Something"), encoding="ascii")
        with self.assertRaisesRegex(DatabaseError, "Status is missing"):
            Database(str(path))
        with self.assertRaises(DatabaseError):
            Database(str(path) + ".none")


class TestCommands(unittest.TestCase):
    def setUp(self):
        self.sent = []

    def commander(self, *script: str) -> Commander:
        return Commander(DATABASE, [Command.parse_timed(text) for text in script],
                         lambda identifier, data: self.sent.append((identifier, data)) or True, timeout_s=0.5)

    def answer(self, commander: Commander, now_s: float, result: int = 0) -> None:
        request = self.sent[-1][1]
        commander.acknowledge(bytes([request[3], request[2], result, 1, 9, 0, 0, 0]), now_s)

    def test_parse(self):
        self.assertEqual(Command.parse("start"), Command(0.0, "start", 0))
        self.assertEqual(Command.parse("step"), Command(0.0, "step", 1))
        self.assertEqual(Command.parse_timed("2.5:step=300"), Command(2.5, "step", 300))
        self.assertEqual(Command.parse_timed("1:speed=25"), Command(1.0, "speed", 25.0))
        self.assertEqual(Command.parse("speed=off"), Command(0.0, "speed", None))
        self.assertEqual(Command.parse("actuator12=-500"), Command(0.0, "actuator12", -500.0))
        self.assertEqual(str(Command.parse("actuator1=off")), "actuator1=off")
        self.assertEqual(Command.parse("torque3=-2.5e4"), Command(0.0, "torque3", -25000.0))
        self.assertEqual(Command.parse("draw=off"), Command(0.0, "draw"))
        for bad in ("fly", "start=1", "step=x", "step=70000", "step=-1", "speed=", "speed=-1", "speed=1000",
                    "speed=nan", "speed", "actuator=1", "actuator0=1", "actuator1", "actuator1=9e6", "actuator100=1",
                    "torque=1", "torque1=9e5", "twist1=2e5", "draw1=1", "draw=1e8", "speed1=3"):
            with self.assertRaises(ValueError, msg=bad):
                Command.parse(bad)
        for bad in ("start", "x:start", "-1:start", "nan:start", ":start"):
            with self.assertRaises(ValueError, msg=bad):
                Command.parse_timed(bad)

    def test_one_after_the_other(self):
        commander = self.commander("0:start", "0:step=300", "5:stop")
        commander.poll(0.0)
        commander.poll(0.1)
        self.assertEqual([data[2] for _, data in self.sent], [1])
        self.answer(commander, 0.2)
        commander.poll(0.2)
        self.assertEqual([data[2] for _, data in self.sent], [1, 4])
        self.assertEqual(self.sent[-1][1][4:6], (300).to_bytes(2, "little"))
        self.answer(commander, 0.3, result=1)
        commander.poll(4.9)
        self.assertFalse(commander.idle)
        self.assertEqual(len(self.sent), 2)
        commander.poll(5.0)
        self.assertEqual([(o.command.name, o.result) for o in commander.outcomes],
                         [("start", "Done"), ("step", "WrongState")])
        self.assertAlmostEqual(commander.outcomes[0].round_trip_s, 0.2)
        self.assertEqual((commander.outcomes[0].run_state, commander.outcomes[0].step), ("Running", 9))

    def test_frames_are_sealed_and_counted(self):
        commander = self.commander(*(["0:none"] * 20))
        for k in range(20):
            commander.poll(0.01 * k)
            self.answer(commander, 0.01 * k)
        alive = [data[1] for _, data in self.sent]
        self.assertEqual(alive, [(alive[0] + k) % 15 for k in range(20)])
        self.assertEqual(len({data[3] for _, data in self.sent}), 20)
        for identifier, data in self.sent:
            self.assertEqual(identifier, bench_fake.RUN_CONTROL)
            self.assertEqual(data[0], bench_fake.crc_bitwise(0x1010, data))

    def test_no_answer(self):
        commander = self.commander("0:start", "0:stop")
        commander.poll(0.0)
        foreign = bytearray(self.sent[-1][1][3:4] + self.sent[-1][1][2:3] + bytes(6))
        foreign[0] ^= 1
        commander.acknowledge(bytes(foreign), 0.1)
        commander.poll(0.49)
        self.assertEqual(commander.outcomes, [])
        commander.poll(0.51)
        self.assertEqual(commander.outcomes[0].result, "no answer")
        commander.give_up()
        self.assertEqual([o.result for o in commander.outcomes], ["no answer", "no answer"])

    def test_a_repeated_count_is_tried_again_once(self):
        commander = self.commander("0:start")
        commander.poll(0.0)
        self.answer(commander, 0.1, result=4)
        self.assertEqual(len(self.sent), 2)
        self.assertEqual(self.sent[0][1][3], self.sent[1][1][3])
        self.assertNotEqual(self.sent[0][1][1], self.sent[1][1][1])
        self.answer(commander, 0.2, result=4)
        self.assertEqual([o.result for o in commander.outcomes], ["Repeated"])

    def test_setpoint_is_cyclic(self):
        commander = self.commander("1:speed=20", "2:speed=30", "3:speed=off")
        for k in range(400):
            commander.poll(0.01 * k)
        speeds = [(data[2], int.from_bytes(data[4:6], "little") * 0.0025) for _, data in self.sent]
        self.assertIn(speeds.count((1, 20.0)), (10, 11))
        self.assertIn(speeds.count((1, 30.0)), (9, 10, 11))
        self.assertEqual(speeds[-1], (0, 30.0))
        self.assertEqual(speeds.count((0, 30.0)), 1)
        for before, after in zip(self.sent, self.sent[1:]):
            self.assertEqual(after[1][1], (before[1][1] + 1) % 15)
            self.assertEqual(after[1][0], bench_fake.crc_bitwise(0x1011, after[1]))


    def test_forces_have_setpoints_of_their_own(self):
        commander = self.commander("0:actuator1=-300", "0:speed=20", "1:actuator1=off")
        for k in range(150):
            commander.poll(0.01 * k)
        forces = [data for identifier, data in self.sent if identifier == bench_fake.ACTUATOR_1]
        values = [(data[2], int.from_bytes(data[4:7], "little", signed=True)) for data in forces]
        self.assertIn(values.count((1, -300)), range(90, 111))  # every 10 ms for a second
        self.assertEqual(values[-1], (0, 0))  # a force ends with its command
        self.assertEqual(values.count((0, 0)), 1)
        for data in forces:
            self.assertEqual(data[0], bench_fake.crc_bitwise(0x1040, data))
        with self.assertRaisesRegex(DatabaseError, "Actuator2: this vehicle has no such message"):
            self.commander("0:actuator2=1")

    def test_torque_and_twist_share_a_message(self):
        commander = self.commander("0:torque1=-1234.5", "0.5:twist1=300", "1:torque1=off", "1.2:twist1=off")
        for k in range(150):
            commander.poll(0.01 * k)
        frames = [data for identifier, data in self.sent if identifier == bench_fake.WHEELSET_1_DRIVE]
        values = [(data[2], int.from_bytes(data[3:6], "little", signed=True), int.from_bytes(data[6:8], "little", signed=True))
                  for data in frames]
        order = [value for k, value in enumerate(values) if k == 0 or value != values[k - 1]]
        self.assertEqual(order, [(1, -12345, 0), (1, -12345, 60), (1, 0, 60), (0, 0, 0)])
        self.assertIn(len(values), range(110, 132))  # every 10 ms for 1.2 s
        with self.assertRaisesRegex(DatabaseError, "DrawForce: this vehicle has no such message"):
            self.commander("0:draw=1")


class TestAddress(unittest.TestCase):
    def test_parse(self):
        self.assertEqual(Address.parse("vcan1"), Address("vcan1"))
        self.assertEqual(Address.parse("socketcand"), Address("vcan0", "127.0.0.1", 29536))
        self.assertEqual(Address.parse("socketcand:7"), Address("vcan0", "127.0.0.1", 7))
        self.assertEqual(Address.parse("socketcand:bench.example:30000", "can3"),
                         Address("can3", "bench.example", 30000))
        self.assertEqual(Address.parse("socketcand:[::1]:30000").host, "::1")
        for bad in ("", "tcp:1.2.3.4:5", "socketcand:host:", "socketcand:host:70000", "socketcand:host:x",
                    "a_name_that_is_too_long"):
            with self.assertRaises(ValueError, msg=bad):
                Address.parse(bad)

    def test_refused_is_tried_again_until_it_works(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        told = []
        began = time.monotonic()
        with self.assertRaisesRegex(transport.TransportError, "refused"):
            transport.open_bus(Address("vcan0", "127.0.0.1", port), 0.5, told.append)
        self.assertLess(time.monotonic() - began, 2.0)
        self.assertEqual(len(told), 1)

    def test_a_server_that_says_nothing(self):
        before, transport.HANDSHAKE_S = transport.HANDSHAKE_S, 0.2
        try:
            with socket.create_server(("127.0.0.1", 0)) as mute:
                with self.assertRaisesRegex(transport.TransportError, "timed out|no answer"), \
                        warnings.catch_warnings():
                    warnings.simplefilter("ignore", ResourceWarning)  # python-can leaves its socket to the collector
                    transport.open_bus(Address("vcan0", "127.0.0.1", mute.getsockname()[1]), 0.0, print)
        finally:
            transport.HANDSHAKE_S = before
        self.assertIsNone(socket.getdefaulttimeout())


class TestVerdict(unittest.TestCase):
    def judge(self, allowed: str, exit_status: int = 0, lost: int = 0) -> verdict.Verdict:
        monitor = Monitor(DATABASE, 0.01)
        for k in range(100):
            if not 0 < k <= lost:
                monitor.feed(motion(0.01 * k, k))
                monitor.feed(status(0.01 * k, k, 10 * k))
                monitor.feed(Frame(1000 + 0.01 * k, bench_fake.WHEELSET_MOTION, bytes([k]) + bytes(7), True))
        commander = Commander(DATABASE, [], lambda identifier, data: True)
        return verdict.judge(monitor, commander, None, verdict.parse_tolerated([allowed]), "over", 1.0, exit_status)

    def test_clean(self):
        self.assertEqual(self.judge("").exit_status, 0)
        self.assertIn("verdict: clean", self.judge("").text())

    def test_tolerance(self):
        self.assertEqual(self.judge("", lost=2).exit_status, 1)
        self.assertEqual(self.judge("", lost=2).failed, ["lost"])
        self.assertEqual(self.judge("lost=5", lost=2).exit_status, 1)  # two frames of each of three messages
        self.assertEqual(self.judge("lost=6", lost=2).exit_status, 0)
        self.assertEqual(self.judge("late,lost", lost=50).exit_status, 0)

    def test_how_it_ended(self):
        self.assertEqual(self.judge("", exit_status=130).exit_status, 130)
        self.assertEqual(self.judge("lost", exit_status=3).exit_status, 3)
        self.assertEqual(self.judge("peer", exit_status=3).exit_status, 0)
        self.assertEqual(self.judge("peer", exit_status=3, lost=2).exit_status, 1)

    def test_nothing_heard_is_not_clean(self):
        monitor = Monitor(DATABASE, 0.01)
        commander = Commander(DATABASE, [], lambda identifier, data: True)
        self.assertEqual(verdict.judge(monitor, commander, None, {}, "over", 1.0).exit_status, 1)

    def test_bad_tolerance(self):
        for bad in ("nonsense", "late=x"):
            with self.assertRaises(ValueError):
                verdict.parse_tolerated([bad])


class TestTable(unittest.TestCase):
    def test_rows_show_units(self):
        monitor = Monitor(DATABASE, 0.01)
        monitor.feed(Frame(1000.0, bench_fake.WHEELSET_MOTION, bytes([1, 0, 0x18, 0xFC, 0, 0x80, 0, 0]), True))
        text = table.row(monitor.of("Wheelset1Motion"))
        self.assertIn("Y -1.000 mm", text)
        self.assertIn("Yaw -32.768 mrad", text)
        self.assertNotIn("Counter", text)
        invalid = table.signals_text(DATABASE.by_name["Wheelset1Motion"], bytes([0, 0, 0, 0x80, 0, 0, 0, 0]))
        self.assertIn("Y invalid", invalid)

    def test_plain_lines(self):
        monitor = Monitor(DATABASE, 0.01)
        stream = io.StringIO()
        live = table.LiveTable(stream, "title", 1.0)
        for k in range(300):
            monitor.feed(motion(0.01 * k, k))
            live.poll(monitor, 0.01 * k)
        lines = stream.getvalue().splitlines()
        self.assertEqual(len(lines), 2)
        self.assertNotIn("\x1b", stream.getvalue())
        self.assertIn("lost 0", lines[0])

    def test_in_place_on_a_terminal(self):
        """A pseudo-terminal of 12 lines: every drawing fits, goes back up as far as it went down, and is cut."""
        import fcntl
        import pty
        import select
        import struct
        import termios

        master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 12, 60, 0, 0))
        monitor = Monitor(DATABASE, 0.01)
        monitor.feed(motion(0.0, 0))
        with os.fdopen(slave, "w") as stream:
            live = table.LiveTable(stream, "title", 0.1)
            live.draw(monitor, 1.0)
            live.draw(monitor, 2.0)
            text = ""
            while select.select([master], [], [], 0.2)[0]:  # it comes in pieces
                text += os.read(master, 65536).decode()
        os.close(master)
        up = [int(number) for number in re.findall(r"\x1b\[(\d+)A", text)]
        self.assertEqual(up, [text.count("\n") // 2])
        self.assertLess(up[0], 12)
        plain = re.sub(r"\x1b\[\d*[A-Z]", "", text).replace("\r", "")
        self.assertLessEqual(max(len(line) for line in plain.splitlines()), 60)


class TestPicture(unittest.TestCase):
    def test_choose(self):
        panels = picture.choose(DATABASE, ["Wheelset*Motion.Y,VehicleMotion.Speed", "Wheelset1Motion.Yaw"])
        self.assertEqual([[curve.label for curve in panel.curves] for panel in panels],
                         [["wheelset 1", "VehicleMotion Speed"], ["wheelset 1"]])
        with self.assertRaisesRegex(ValueError, "Nothing"):
            picture.choose(DATABASE, ["Nothing.Y"])
        self.assertEqual(len(picture.choose(DATABASE, None)), 2)  # this DBC has no wheel forces

    def test_labels(self):
        self.assertEqual(picture._label("Wheel12LForces", "Q"), "wheelset 12 left")
        self.assertEqual(picture._label("Wheel1RCreep", "T1"), "wheelset 1 right")
        self.assertEqual(picture._label("Body1Position", "Y"), "body 1")


if __name__ == "__main__":
    unittest.main()
