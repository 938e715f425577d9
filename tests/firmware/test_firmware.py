#!/usr/bin/python3
"""The firmware in QEMU computes the bits of the host, whatever comes over its UART.

Starts build/firmware/wagon.elf on an emulated Cortex-M7 with its UART on a pty, lets it do a known number of steps
while garbage pours in, and then compares: the state, read out of the target's memory, by its hash; and the state
frames that the firmware publishes, byte by byte. The other side is tests/firmware/twin.c, the same model on the host.

Nothing here depends on how fast QEMU runs: steps are asked for by number (RunControl, Step).
"""

from __future__ import annotations

import json
import os
import pathlib
import random
import re
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
import tty
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / os.environ.get("BUILD", "build")
sys.path.insert(0, str(ROOT / "tools"))

from klingel_bench.commands import Sealer  # noqa: E402
from klingel_bench.database import Database  # noqa: E402

ELF = BUILD / "firmware" / "wagon.elf"
TWIN = BUILD / "tests" / "firmware" / "twin"
DIVIDER = 20  # KL_FIRMWARE_STATE_DIVIDER
SPEED_M_S = 20.0  # KL_FIRMWARE_SPEED_M_S, see port/mps2/Makefile.inc
STATUS_ID, ACK_ID, INFO_MODEL_ID = 0x030, 0x012, 0x681
PAINT = 0xC0DEC0DE  # startup.c
PATIENCE_S = 120.0  # QEMU on a busy machine


class Target:
    """QEMU with the firmware: its UART as bytes, its memory through QMP."""

    def __init__(self, folder: pathlib.Path):
        self._socket_path = folder / "qmp"
        self.process = subprocess.Popen(
            ["qemu-system-arm", "-machine", "mps2-an500", "-kernel", str(ELF), "-display", "none", "-monitor", "none",
             "-serial", "pty", "-qmp", f"unix:{self._socket_path},server=on,wait=off"],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"redirected to (/dev/\S+)", line)
        if found is None:
            raise RuntimeError(f"QEMU gave no pty: {line}")
        self.uart = os.open(found.group(1), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.uart)
        self._text = b""
        self._qmp = socket.socket(socket.AF_UNIX)
        self._qmp.connect(str(self._socket_path))
        self._answers = self._qmp.makefile()
        self._answers.readline()
        self.ask("qmp_capabilities")

    def ask(self, command: str, **arguments: object) -> dict:
        self._qmp.sendall(json.dumps({"execute": command, "arguments": arguments}).encode() + b"\n")
        while True:
            answer = json.loads(self._answers.readline())
            if "error" in answer:
                raise RuntimeError(f"{command}: {answer['error']}")
            if "return" in answer:
                return answer["return"]

    def memory(self, address: int, size: int) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "memory"
            self.ask("pmemsave", val=address, size=size, filename=str(path))
            return path.read_bytes()

    def write(self, data: bytes) -> None:
        while data:
            select.select([], [self.uart], [], 1.0)
            try:
                data = data[os.write(self.uart, data):]
            except BlockingIOError:
                continue

    def frames(self, wait_s: float = 0.05) -> list[tuple[int, bytes]]:
        """What has come since the last call, in whole lines."""
        if select.select([self.uart], [], [], wait_s)[0]:
            try:
                self._text += os.read(self.uart, 1 << 16)
            except BlockingIOError:
                pass
        *lines, self._text = re.split(rb"[\r\a]", self._text)
        found = (re.fullmatch(rb"t([0-9A-F]{3})([0-8])((?:[0-9A-F]{2})*)", line) for line in lines)
        return [(int(line[1], 16), bytes.fromhex(line[3].decode())) for line in found
                if line is not None and len(line[3]) == 2 * int(line[2])]

    def send(self, identifier: int, data: bytes) -> None:
        self.write(b"\r" + b"t%03X%d%s\r" % (identifier, len(data), data.hex().upper().encode()))

    def close(self) -> None:
        self._qmp.close()
        self._answers.close()
        os.close(self.uart)
        self.process.terminate()
        self.process.wait(10)
        self.process.stdout.close()


def symbols() -> dict[str, int]:
    text = subprocess.run(["arm-none-eabi-nm", str(ELF)], capture_output=True, text=True, check=True).stdout
    return {words[2]: int(words[0], 16) for words in (line.split() for line in text.splitlines()) if len(words) == 3}


def garbage(source: random.Random) -> bytes:
    """Anything, and things that look nearly right; no line that opens, closes or sets something."""
    kind = source.randrange(4)
    if kind == 0:
        return bytes(source.choice(b"\x00\x01\x07\x7f\x80\xfe\xff\n tTrRxX0123456789ABCDEF") for _ in range(60))
    if kind == 1:
        return b"t010800000000000000" + b"%02X" % source.randrange(256) + b"0\r"
    if kind == 2:  # right in form, wrong in CRC
        return b"\rt0118%016X\r" % source.getrandbits(64)
    return b"T" * source.randrange(1, 200) + b"\r"


class Firmware(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        dbc = pathlib.Path(cls.folder.name) / "wagon.dbc"
        subprocess.run([BUILD / "klingel", "dbc", ROOT / "models/two_axle_wagon.yaml", "--state-divider", str(DIVIDER),
                        "-o", dbc], check=True, stdout=subprocess.DEVNULL)
        cls.database = Database(str(dbc))
        cls.target = Target(pathlib.Path(cls.folder.name))
        cls.symbols = symbols()
        cls.request = 0
        cls.control = Sealer(cls.database, "RunControl")
        cls.random = random.Random(51)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.target.close()
        cls.folder.cleanup()

    def command(self, number: int, argument: int = 0) -> dict:
        """Sends a run command until it is answered; a frame that garbage spoiled is sent again."""
        Firmware.request = (self.request + 1) % 256
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            self.target.send(0x010, self.control.frame(Command=number, RequestId=self.request, Argument=argument))
            again = time.monotonic() + 5.0
            while time.monotonic() < again:
                for identifier, data in self.target.frames():
                    if identifier == ACK_ID and data[0] == self.request and data[2] != 4:  # 4: repeated
                        return {"result": data[2], "step": int.from_bytes(data[4:8], "little")}
        self.fail("no acknowledge")

    def status_step(self, frames: list[tuple[int, bytes]]) -> int | None:
        steps = [self.database.by_name["Status"].decode(data) for identifier, data in frames if identifier == STATUS_ID]
        return int(steps[-1]["Step"]) if steps else None

    def run_to(self, step: int, noise: bool) -> int:
        """Waits for a step number; returns the bytes of garbage sent meanwhile."""
        sent = 0
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            if noise:
                data = garbage(self.random)
                self.target.write(data)
                sent += len(data)
            now = self.status_step(self.target.frames(0.002))
            if now is not None and now >= step:
                self.assertEqual(now, step)
                return sent
        self.fail(f"step {step} was not reached")

    def set_speed(self, speed_m_s: float) -> None:
        sealer = Sealer(self.database, "SpeedSetpoint")
        for _ in range(3):  # the first may repeat the alive counter of a sender before
            self.target.send(0x011, sealer.frame(Control=0, Speed=speed_m_s))
            time.sleep(0.05)

    def twin(self, *arguments: object) -> list[list[str]]:
        done = subprocess.run([TWIN, *map(str, arguments)], capture_output=True, text=True, check=True)
        return [line.split() for line in done.stdout.splitlines()]

    def state_hash(self, size: int) -> str:
        """Of the state in the target's memory: the first field of `firmware`, see port/template/main.c."""
        path = pathlib.Path(self.folder.name) / "state"
        path.write_bytes(self.target.memory(self.symbols["firmware"], size))
        return self.twin("--state", path)[0][1]

    def published(self) -> dict[int, bytes]:
        """The newest frame of every identifier, over at least one whole turn of the slowest (InfoModel, 1 s)."""
        newest: dict[int, bytes] = {}
        seconds = 0
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until and seconds < 2:
            for identifier, data in self.target.frames():
                newest[identifier] = data
                seconds += identifier == INFO_MODEL_ID
        return newest

    def assert_same_as_twin(self, *script: object) -> None:
        lines = self.twin(*script)
        self.assertEqual(self.state_hash(int(lines[0][3])), lines[0][1], "the state differs from the host's")
        self.target.frames()
        newest = self.published()
        compared = 0
        for _, identifier, data, mask in (line for line in lines if line[0] == "frame"):
            with self.subTest(identifier=identifier):
                bits = int(mask, 16)
                self.assertIn(int(identifier, 16), newest.keys())
                self.assertEqual(int.from_bytes(newest[int(identifier, 16)], "big") & bits, int(data, 16) & bits)
                compared += 1
        self.assertGreater(compared, 20)

    def test_the_bits_of_the_host_under_garbage(self) -> None:
        self.target.write(bytes(self.random.randrange(256) for _ in range(600)) + b"\rC\rO\r")
        self.assertEqual(self.command(5)["result"], 0)  # reset
        self.assertEqual(self.command(4, 3000), {"result": 0, "step": 0})
        sent = self.run_to(3000, noise=True)
        self.assertGreater(sent, 10000)
        self.target.write(b"\rO\r")
        self.set_speed(27.0)
        self.assertEqual(self.command(4, 2000), {"result": 0, "step": 3000})
        self.run_to(5000, noise=False)
        self.assert_same_as_twin(SPEED_M_S, 3000, 27, 2000)

    def test_the_stack_has_room(self) -> None:
        low, high = self.symbols["mps2_stack_bottom"], self.symbols["mps2_stack_top"]
        words = struct.unpack(f"<{(high - low) // 4}I", self.target.memory(low, high - low))
        untouched = next(i for i, word in enumerate(words) if word != PAINT)
        used = high - low - 4 * untouched
        print(f"stack used: {used} of {high - low} bytes", file=sys.stderr)
        self.assertGreater(used, 256)
        self.assertGreater(untouched, 256)


if __name__ == "__main__":
    unittest.main(verbosity=2)
