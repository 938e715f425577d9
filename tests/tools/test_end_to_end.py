#!/usr/bin/python3
"""End to end: `klingel hil` on a socketcand port of its own, judged by stock python-can and canmatrix.

usage: KLINGEL=build/klingel python3 tests/tools/test_end_to_end.py [-v]

The listener below uses nothing of the bench; the bench itself has its own session here too. Cycle times are not
judged: the machine that tests run on may be busy.
"""

from __future__ import annotations

import collections
import json
import logging
import os
import pathlib
import random
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import unittest

logging.disable(logging.CRITICAL)  # canmatrix tells which formats it lacks, python-can of every line TCP splits

import can  # noqa: E402
import canmatrix.formats  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/tools"))
from bench_fake import crc_bitwise  # noqa: E402

KLINGEL = pathlib.Path(os.environ.get("KLINGEL", ROOT / "build/klingel")).resolve()
BENCH = ROOT / "tools/bench.py"
WAGON = ROOT / "models/two_axle_wagon.yaml"
TRACK = ROOT / "models/demo_track.yaml"
# of models/two_axle_wagon.yaml
MASS_KG = 37200 + 2 * 1400
GRAVITY_M_S2 = 9.81
RADIUS_M = 0.46
FLANGE_Y_M = 0.010  # no wheelset gets farther on this track
SPEED_M_S = 20.0
SEED = 20260102

START, PAUSE, STEP, RESET, SNAPSHOT, RESTORE = 1, 3, 4, 5, 6, 7
DONE, WRONG_STATE, UNKNOWN_COMMAND, NO_SNAPSHOT, REPEATED = 0, 1, 2, 3, 4


class Hil:
    """A running `klingel hil` with its DBC and, once ended, its report."""

    def __init__(self, folder: str, *arguments: str, model: pathlib.Path = WAGON):
        self.dbc = str(pathlib.Path(folder) / "hil.dbc")
        self._report = pathlib.Path(folder) / "report.json"
        self.process = subprocess.Popen(
            [KLINGEL, "hil", model, TRACK, "--bus", "socketcand:0", "--dbc", self.dbc, "--report", self._report,
             "--time", "120", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"127\.0\.0\.1:(\d+)", line)
        if found is None:
            self.process.kill()
            raise AssertionError(f"klingel hil: {line}{self.process.stdout.read()}")
        self.port = int(found.group(1))
        self.network = canmatrix.formats.loadp_flat(self.dbc)

    def end(self, number: int = signal.SIGTERM) -> dict:
        """Ends it as its user would; returns the report."""
        self.process.send_signal(number)
        out, _ = self.process.communicate(timeout=20)
        if self.process.returncode != 0:
            raise AssertionError(f"klingel hil ended with {self.process.returncode}:\n{out}")
        return json.loads(self._report.read_text())

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate(timeout=20)


class Listener(threading.Thread):
    """Stock python-can, receiving until close()."""

    def __init__(self, port: int):
        super().__init__(daemon=True)
        self.bus = can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="vcan0")
        self.frames: list[tuple[int, bytes]] = []
        self._ended = threading.Event()
        self.start()

    def run(self) -> None:
        while not self._ended.is_set():
            message = self.bus.recv(timeout=0.1)
            if message is not None:
                self.frames.append((message.arbitration_id, bytes(message.data)))

    def close(self) -> None:
        if not self._ended.is_set():
            self._ended.set()
            self.join(5.0)
            self.bus.shutdown()

    def wait_for(self, identifier: int, since: int, seconds: float = 2.0) -> bytes | None:
        """The first frame of an identifier from position `since` on."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            for found, data in self.frames[since:]:
                if found == identifier:
                    return data
            time.sleep(0.005)
        return None


class EndToEnd(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not KLINGEL.exists() and "KLINGEL" not in os.environ:
            raise unittest.SkipTest(f"{KLINGEL} is not built: make all")

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="klingel-e2e")
        self.addCleanup(self._folder.cleanup)
        self.folder = self._folder.name

    def hil(self, *arguments: str, model: pathlib.Path = WAGON) -> Hil:
        running = Hil(self.folder, *arguments, model=model)
        self.addCleanup(running.kill)
        self.network = running.network
        self.frame = {frame.name: frame for frame in running.network.frames}
        self.identifier = {name: frame.arbitration_id.id for name, frame in self.frame.items()}
        return running

    def listen(self, running: Hil) -> Listener:
        listener = Listener(running.port)
        self.addCleanup(listener.close)
        self.assertIsNotNone(listener.wait_for(self.identifier["Status"], 0), "no frame at all")
        return listener

    def of(self, frames: list[tuple[int, bytes]], name: str, signal_name: str) -> list[float]:
        decode = self.frame[name].decode
        return [float(decode(data)[signal_name].phys_value) for found, data in frames
                if found == self.identifier[name]]

    def check_counters(self, frames: list[tuple[int, bytes]]) -> None:
        """Every cyclic message: each frame's counter one ahead of the frame before."""
        last: dict[int, int] = {}
        wrong = collections.Counter()
        cyclic = {frame.arbitration_id.id for frame in self.frame.values()
                  if "Klingel" in frame.transmitters and frame.signal_by_name("Counter")}
        for identifier, data in frames:
            if identifier in cyclic:
                self.assertEqual(len(data), 8)
                counter = int.from_bytes(data[:2], "little")
                wrong[identifier] += counter != (last.get(identifier, counter - 1) + 1) % 65536
                last[identifier] = counter
        self.assertEqual({hex(found): number for found, number in wrong.items() if number}, {}, "counter gaps")
        self.assertEqual(set(last), cyclic, "a message never came")


class TestStates(EndToEnd):
    def test_states(self):
        running = self.hil("--speed", str(SPEED_M_S), "--start")
        listener = self.listen(running)
        time.sleep(5.0)
        listener.close()
        frames = listener.frames
        self.check_counters(frames)
        self.check_rates(frames)
        self.check_motion(frames)
        self.check_forces(frames)
        report = running.end()
        self.assertEqual((report["node"]["dropped"], report["node"]["not_finite"], report["node"]["saturated"]),
                         (0, 0, 0))
        self.assertEqual((report["bus"]["client_lost"], report["bus"]["send_dropped"], report["model_faults"]),
                         (0, 0, 0))

    def check_rates(self, frames):
        """As many frames of each message as its cycle says, measured by the model's own time."""
        times = self.of(frames, "StatusTime", "Time")
        span_s = times[-1] - times[0]
        self.assertGreater(span_s, 2.0)
        count = collections.Counter(found for found, _ in frames)
        for name, frame in self.frame.items():
            cycle_s = 1e-6 * int(frame.attribute("CycleTime_us", self.network))
            if cycle_s and "Klingel" in frame.transmitters:
                expected = span_s / cycle_s
                self.assertAlmostEqual(count[self.identifier[name]], expected, delta=2.0 + 0.02 / cycle_s, msg=name)

    def check_motion(self, frames):
        speeds = self.of(frames, "VehicleMotion", "Speed")
        self.assertLess(max(abs(speed - SPEED_M_S) for speed in speeds), 0.01)
        places = self.of(frames, "VehicleMotion", "Distance")
        steps = [after - before for before, after in zip(places, places[1:])]
        self.assertAlmostEqual(statistics.mean(steps), SPEED_M_S * 0.001, delta=1e-5)
        self.assertLess(max(steps) - min(steps), 0.0021)  # to the resolution of 1 mm
        for name in ("Wheelset1Motion", "Wheelset2Motion"):
            self.assertLess(max(map(abs, self.of(frames, name, "Y"))), FLANGE_Y_M)
        spins = self.of(frames, "Wheelset1Spin", "Spin")
        self.assertAlmostEqual(statistics.mean(spins), SPEED_M_S / RADIUS_M, delta=0.2)
        model_steps = self.of(frames, "Status", "Step")
        times = self.of(frames, "StatusTime", "Time")
        self.assertAlmostEqual((model_steps[-1] - model_steps[0]) * 0.001, times[-1] - times[0], delta=0.0101)

    def check_forces(self, frames):
        wheels = [f"Wheel{number}{side}" for number in (1, 2) for side in "RL"]
        loads = [statistics.mean(self.of(frames, f"{wheel}Forces", "Q")) for wheel in wheels]
        self.assertAlmostEqual(sum(loads), MASS_KG * GRAVITY_M_S2, delta=0.01 * MASS_KG * GRAVITY_M_S2)
        for wheel in wheels:
            self.assertLess(max(self.of(frames, f"{wheel}Creep", "Adhesion")), 0.35)  # friction is 0.3
            radii = self.of(frames, f"{wheel}Contact", "Radius")
            self.assertLess(max(abs(radius - RADIUS_M) for radius in radii), 0.015)


class TestCommands(EndToEnd):
    def setUp(self):
        super().setUp()
        self.running = self.hil()
        self.listener = self.listen(self.running)
        self.alive = 0
        self.request = 40

    def send(self, name: str, data_id: int, spoil: int = 0, **raw: int) -> int:
        """Seals and sends; returns the position in what is heard."""
        data = bytearray(self.frame[name].encode(raw))
        data[1] = self.alive
        data[0] = crc_bitwise(data_id, bytes(data)) ^ spoil
        position = len(self.listener.frames)
        self.listener.bus.send(can.Message(arbitration_id=self.identifier[name], data=data, is_extended_id=False))
        return position

    def command(self, number: int, argument: int = 0, repeat: bool = False, spoil: int = 0):
        """Result, run state and step of the acknowledge; None: there is none."""
        self.request = (self.request + 1) % 256
        self.alive = self.alive if repeat else (self.alive + 1) % 15
        position = self.send("RunControl", 0x1010, spoil, Command=number, RequestId=self.request, Argument=argument)
        data = self.listener.wait_for(self.identifier["Ack"], position, 0.3 if spoil else 2.0)
        if data is None:
            return None
        ack = {name: value.raw_value for name, value in self.frame["Ack"].decode(data).items()}
        self.assertEqual((ack["RequestId"], ack["Command"]), (self.request, number))
        return ack["Result"], ack["RunState"], ack["Step"]

    def step_now(self) -> int:
        position = len(self.listener.frames)
        data = self.listener.wait_for(self.identifier["Status"], position)
        return int(self.frame["Status"].decode(data)["Step"].raw_value)

    def test_run_control(self):
        init, running, paused = 0, 1, 2
        self.assertEqual(self.step_now(), 0)
        self.assertEqual(self.command(RESTORE)[:2], (NO_SNAPSHOT, init))
        self.assertEqual(self.command(STEP, 50)[:2], (DONE, paused))
        time.sleep(0.5)
        self.assertEqual(self.step_now(), 50)
        self.assertEqual(self.command(SNAPSHOT), (DONE, paused, 50))
        self.assertEqual(self.command(START)[:2], (DONE, running))
        self.assertEqual(self.command(STEP, 5)[0], WRONG_STATE)
        self.assertEqual(self.command(99)[0], UNKNOWN_COMMAND)
        time.sleep(0.3)
        self.assertEqual(self.command(PAUSE)[:2], (DONE, paused))
        self.assertGreater(self.step_now(), 150)
        self.assertEqual(self.command(RESTORE), (DONE, paused, 50))
        self.assertEqual(self.step_now(), 50)
        self.assertEqual(self.command(RESET), (DONE, init, 0))
        self.assertEqual(self.command(START, repeat=True)[0], REPEATED)
        self.assertIsNone(self.command(START, spoil=0x40))
        self.assertEqual(self.step_now(), 0)
        self.listener.close()
        self.check_counters_of_what_came()
        node = self.running.end()["node"]
        self.assertEqual((node["protection"], node["run_commands"], node["run_refused"]), (2, 6, 4))

    def check_counters_of_what_came(self):
        last: dict[int, int] = {}
        for identifier, data in self.listener.frames:
            if identifier != self.identifier["Ack"]:
                counter = int.from_bytes(data[:2], "little")
                self.assertEqual(counter, (last.get(identifier, counter - 1) + 1) % 65536, hex(identifier))
                last[identifier] = counter

    def test_speed_setpoint_and_its_loss(self):
        """Supervised: the wagon accelerates by its limit of 1 m/s2, and brakes when the set-point stays out."""
        self.assertEqual(self.command(START)[0], DONE)
        began = len(self.listener.frames)
        for _ in range(15):
            self.alive = (self.alive + 1) % 15
            self.send("SpeedSetpoint", 0x1011, Control=1, Speed=round(2.0 / 0.0025))
            time.sleep(0.1)
        reached = self.of(self.listener.frames[began:], "VehicleMotion", "Speed")[-1]
        self.assertGreater(reached, 1.0)
        time.sleep(1.2)
        frames = self.listener.frames[began:]
        bus = [self.frame["StatusBus"].decode(data) for found, data in frames
               if found == self.identifier["StatusBus"]]
        self.assertEqual((bus[-1]["SpeedLate"].raw_value, bus[-1]["CommandsLate"].raw_value), (1, 1))
        self.assertLess(self.of(frames, "VehicleMotion", "Speed")[-1], reached)
        self.assertGreater(min(self.of(frames, "VehicleTrack", "Acceleration")), -1.01)


class TestBench(EndToEnd):
    def bench(self, running: Hil, *arguments: str) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, BENCH, "--bus", f"socketcand:{running.port}", "--dbc", running.dbc,
                                 "--tolerate", "late", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                text=True)

    def test_actuator(self):
        """3 kN of side wind through the second input of a vehicle on 320 kN/m of airsprings; then the bench falls silent."""
        running = self.hil("--speed", "10", "--start", model=ROOT / "tests/tools/good/elements.yaml")
        listener = self.listen(running)
        bench = self.bench(running, "--time", "60", "--at", "0.2:actuator2=3000")
        self.assertIsNotNone(listener.wait_for(self.identifier["Body1Position"], 0))
        began = time.monotonic()
        while time.monotonic() < began + 20 and self.of(listener.frames[-400:], "Body1Position", "Y")[-1] < 0.009:
            time.sleep(0.1)
        self.assertGreaterEqual(self.of(listener.frames[-400:], "Body1Position", "Y")[-1], 0.009)  # 9.4 mm, and roll
        controlled = self.of(listener.frames[-400:], "StatusBus", "ActuatorControl")[-1]
        bench.kill()
        bench.communicate()
        time.sleep(0.5)
        listener.close()
        last = listener.frames[-400:]
        self.assertEqual((controlled, self.of(last, "StatusBus", "ActuatorLate")[-1]), (1, 1))
        self.check_counters(listener.frames)

    def test_draw_force_and_torque(self):
        """40 t and what rolls of them, drawn by 20 kN and driven by 4.6 kN m on an axle of 0.46 m: 30 kN, 0.73 m/s2."""
        running = self.hil("--speed", "10", "--start", model=ROOT / "models/coasting_wagon.yaml")
        listener = self.listen(running)
        bench = self.bench(running, "--time", "60", "--at", "0.2:draw=20000", "--at", "0.2:torque1=4600")
        self.assertIsNotNone(listener.wait_for(self.identifier["VehicleTrack"], 0))
        began = time.monotonic()
        while time.monotonic() < began + 20 and self.of(listener.frames[-400:], "VehicleTrack", "Acceleration")[-1] < 0.65:
            time.sleep(0.1)
        driven = self.of(listener.frames[-400:], "VehicleTrack", "Acceleration")[-1]
        for slow in ("InfoVersion", "InfoModel", "InfoSignals"):  # once a second
            self.assertIsNotNone(listener.wait_for(self.identifier[slow], 0))
        bench.kill()
        bench.communicate()
        listener.close()
        self.assertTrue(0.65 < driven < 0.76, driven)
        self.check_counters(listener.frames)

    def test_session(self):
        running = self.hil()
        told, log, plot = (pathlib.Path(self.folder) / name for name in ("told.json", "run.log", "run.png"))
        bench = self.bench(running, "--time", "5", "--speed", "25", "--start", "--at", "1.5:snapshot",
                           "--at", "2.5:restore", "--at", "3:pause", "--at", "3.2:step=50", "--at", "4:start",
                           "--at", "4.4:stop", "--log", str(log), "--plot", str(plot), "--json", str(told))
        out, _ = bench.communicate(timeout=60)
        self.assertEqual(bench.returncode, 0, out)
        verdict = json.loads(told.read_text())
        self.assertEqual([one["result"] for one in verdict["commands"]], ["Done"] * 7)
        self.assertEqual([one["run_state"] for one in verdict["commands"]],
                         ["Running", "Running", "Running", "Paused", "Paused", "Running", "Stopped"])
        for kind in ("lost", "repeated", "crc", "malformed", "missing", "step", "table", "fault"):
            self.assertEqual(verdict["counts"][kind], 0, out)
        self.assertGreater(verdict["frames"], 20_000)
        self.assertGreater(plot.stat().st_size, 30_000)
        with can.CanutilsLogReader(str(log)) as reader:
            self.assertEqual(sum(1 for message in reader if message.arbitration_id > 0x012),
                             sum(one["frames"] for name, one in verdict["messages"].items() if name != "Ack"))
        node = running.end()["node"]
        self.assertEqual((node["malformed"], node["unknown"]), (0, 0))
        self.assertLessEqual(node["protection"], 1)  # one chance in 15 that our first count was taken
        self.assertGreater(node["setpoints"], 30)

    def test_the_same_dbc_from_the_model(self):
        running = self.hil("--start", "--speed", "10")
        done = subprocess.run([sys.executable, BENCH, "--bus", f"socketcand:{running.port}", "--model", WAGON,
                               "--klingel", KLINGEL, "--time", "1.5", "--tolerate", "late"], capture_output=True,
                              text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_the_node_ends_first(self):
        running = self.hil("--start", "--speed", "10")
        bench = self.bench(running)
        time.sleep(2.5)
        running.end(signal.SIGINT)
        out, _ = bench.communicate(timeout=20)
        self.assertEqual(bench.returncode, 3, out)
        self.assertIn("the server closed the connection", out)
        self.assertNotIn("Traceback", out)


class TestBadClients(EndToEnd):
    def test_the_model_keeps_its_step(self):
        """A client that is killed, one that talks garbage, one that never reads: a good one loses nothing."""
        running = self.hil("--start", "--speed", str(SPEED_M_S))
        good = self.listen(running)
        self.killed_bench(running)
        mute = self.never_reads(running)
        garbled = self.garbage(running)
        time.sleep(2.0)
        again = self.listen(running)  # the port still takes clients
        time.sleep(0.5)
        for connection in (mute, *garbled):
            connection.close()
        time.sleep(0.3)
        again.close()
        good.close()
        self.check_counters(good.frames)
        steps = self.of(good.frames, "Status", "Step")
        self.assertEqual({after - before for before, after in zip(steps, steps[1:])}, {10.0})
        report = running.end()
        self.assertGreater(report["bus"]["refused"], 100)
        self.assertEqual((report["node"]["dropped"], report["model_faults"]), (0, 0))
        self.assertEqual(report["node"]["cycles"], report["node"]["steps"])

    def killed_bench(self, running: Hil) -> None:
        bench = subprocess.Popen([sys.executable, BENCH, "--bus", f"socketcand:{running.port}", "--dbc", running.dbc,
                                  "--speed", str(SPEED_M_S)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(2.5)
        self.assertIsNone(bench.poll())
        bench.kill()
        bench.wait(10)

    def connect(self, running: Hil) -> socket.socket:
        connection = socket.create_connection(("127.0.0.1", running.port), timeout=5.0)
        self.addCleanup(connection.close)
        return connection

    def stream(self, running: Hil) -> socket.socket:
        """A client up to raw mode."""
        connection = self.connect(running)
        for question in (b"< open vcan0 >", b"< rawmode >"):
            connection.recv(100)
            connection.sendall(question)
        connection.recv(100)
        return connection

    def never_reads(self, running: Hil) -> socket.socket:
        connection = self.stream(running)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        return connection

    def garbage(self, running: Hil) -> list[socket.socket]:
        dice = random.Random(SEED)
        early, late = self.connect(running), self.stream(running)
        early.sendall(dice.randbytes(20_000))
        words = [b"< send >", b"< send 10 8 1 2 >", b"< send 10 9 1 2 3 4 5 6 7 8 9 >", b"< send zz 1 1 >",
                 b"< send 7ff 8 " + b"f" * 5000 + b" >", b"<<<>>>", b"< send 10 8 0 0 0 0 0 0 0 0 >", b"> < send 11"]
        for _ in range(50):
            late.sendall(dice.choice(words))
        late.sendall(dice.randbytes(20_000))
        return [early, late]


if __name__ == "__main__":
    unittest.main()
