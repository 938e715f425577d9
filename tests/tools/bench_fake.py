"""A small node behind a socketcand port, for tests of the bench: it can lose, repeat, garble, stall and vanish.

Written from the protocol's description and the signal table's documentation; nothing of the bench is used here.
"""

from __future__ import annotations

import re
import socket
import struct
import threading
import time

DBC = """VERSION ""

NS_ :
BS_:
BU_: Klingel Bench

BO_ 16 RunControl: 8 Bench
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" Klingel
 SG_ Alive : 8|4@1+ (1,0) [0|15] "" Klingel
 SG_ Command : 16|8@1+ (1,0) [0|255] "" Klingel
 SG_ RequestId : 24|8@1+ (1,0) [0|255] "" Klingel
 SG_ Argument : 32|16@1+ (1,0) [0|65535] "" Klingel

BO_ 17 SpeedSetpoint: 8 Bench
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" Klingel
 SG_ Alive : 8|4@1+ (1,0) [0|15] "" Klingel
 SG_ Control : 16|8@1+ (1,0) [0|255] "" Klingel
 SG_ Speed : 32|16@1+ (0.0025,0) [0|163.835] "m/s" Klingel

BO_ 64 Actuator1: 8 Bench
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" Klingel
 SG_ Alive : 8|4@1+ (1,0) [0|15] "" Klingel
 SG_ Control : 16|8@1+ (1,0) [0|255] "" Klingel
 SG_ Force : 32|24@1- (1,0) [-8388607|8388607] "N" Klingel

BO_ 96 Wheelset1Drive: 8 Bench
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" Klingel
 SG_ Alive : 8|4@1+ (1,0) [0|15] "" Klingel
 SG_ Control : 16|8@1+ (1,0) [0|255] "" Klingel
 SG_ Torque : 24|24@1- (0.1,0) [-838860.7|838860.7] "Nm" Klingel
 SG_ Twist : 48|16@1- (5,0) [-163835|163835] "Nm" Klingel

BO_ 18 Ack: 8 Klingel
 SG_ RequestId : 0|8@1+ (1,0) [0|255] "" Bench
 SG_ Command : 8|8@1+ (1,0) [0|255] "" Bench
 SG_ Result : 16|8@1+ (1,0) [0|255] "" Bench
 SG_ RunState : 24|8@1+ (1,0) [0|255] "" Bench
 SG_ Step : 32|32@1+ (1,0) [0|4294967295] "" Bench

BO_ 32 VehicleMotion: 8 Klingel
 SG_ Counter : 0|16@1+ (1,0) [0|65535] "" Bench
 SG_ Speed : 16|16@1+ (0.0025,0) [0|163.835] "m/s" Bench
 SG_ Distance : 32|32@1- (0.001,0) [-2147483.647|2147483.647] "m" Bench

BO_ 48 Status: 8 Klingel
 SG_ Counter : 0|16@1+ (1,0) [0|65535] "" Bench
 SG_ RunState : 16|8@1+ (1,0) [0|255] "" Bench
 SG_ Faults : 24|8@1+ (1,0) [0|255] "" Bench
 SG_ Step : 32|32@1+ (1,0) [0|4294967295] "" Bench

BO_ 256 Wheelset1Motion: 8 Klingel
 SG_ Counter : 0|16@1+ (1,0) [0|65535] "" Bench
 SG_ Y : 16|16@1- (0.000001,0) [-0.032767|0.032767] "m" Bench
 SG_ Yaw : 32|16@1- (0.000001,0) [-0.032767|0.032767] "rad" Bench

BA_DEF_ "SignalTableHash" STRING ;
BA_DEF_ "StepTime_us" INT 0 1000000;
BA_DEF_ BO_ "CycleTime_us" INT 0 2000000000;
BA_DEF_ BO_ "E2EDataId" INT 0 65535;
BA_DEF_DEF_ "SignalTableHash" "";
BA_DEF_DEF_ "StepTime_us" 1000;
BA_DEF_DEF_ "CycleTime_us" 0;
BA_DEF_DEF_ "E2EDataId" 0;
BA_ "CycleTime_us" BO_ 17 100000;
BA_ "CycleTime_us" BO_ 64 10000;
BA_ "CycleTime_us" BO_ 96 10000;
BA_ "CycleTime_us" BO_ 32 10000;
BA_ "CycleTime_us" BO_ 48 10000;
BA_ "CycleTime_us" BO_ 256 10000;
BA_ "E2EDataId" BO_ 16 4112;
BA_ "E2EDataId" BO_ 17 4113;
BA_ "E2EDataId" BO_ 64 4160;
BA_ "E2EDataId" BO_ 96 4192;
VAL_ 16 Command 0 "None" 1 "Start" 2 "Stop" 3 "Pause" 4 "Step" 5 "Reset" 6 "Snapshot" 7 "Restore" ;
VAL_ 18 Command 0 "None" 1 "Start" 2 "Stop" 3 "Pause" 4 "Step" 5 "Reset" 6 "Snapshot" 7 "Restore" ;
VAL_ 18 Result 0 "Done" 1 "WrongState" 2 "UnknownCommand" 3 "NoSnapshot" 4 "Repeated" 5 "NoModelState" ;
VAL_ 18 RunState 0 "Init" 1 "Running" 2 "Paused" 3 "Stopped" 4 "Fault" ;
VAL_ 48 RunState 0 "Init" 1 "Running" 2 "Paused" 3 "Stopped" 4 "Fault" ;
VAL_ 256 Y -32768 "Invalid" ;
"""

ACTUATOR_1 = 0x040
WHEELSET_1_DRIVE = 0x060
RUN_CONTROL, SPEED_SETPOINT, ACK, VEHICLE_MOTION, STATUS, WHEELSET_MOTION = 0x010, 0x011, 0x012, 0x020, 0x030, 0x100
RUNNING = 1


def crc_bitwise(data_id: int, data: bytes) -> int:
    """CRC-8 with polynomial x^8+x^4+x^3+x^2+1 by long division over data ID and data, first byte left out."""
    bits = int.from_bytes(data_id.to_bytes(2, "little") + data[1:], "big") << 8
    for bit in range(bits.bit_length() - 1, 7, -1):
        if bits >> bit & 1:
            bits ^= 0x11D << bit - 8
    return bits


class FakeNode(threading.Thread):
    """Takes one client after the other. Change the attributes before start() or while it runs."""

    def __init__(self, port: int = 0) -> None:
        super().__init__(daemon=True)
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.settimeout(0.05)
        self.port: int = self._listener.getsockname()[1]
        self.greeting = b"< hi >"
        self.vanish_after_s = 0.0  # 0: stay
        self.reset_connection = False  # vanish with a reset instead of an orderly end
        self.garbage_after_s = 0.0
        self.mute_after_s = 0.0  # connected, but nothing more is sent
        self.piecewise = False  # every line comes in two writes
        self.skip_at: set[int] = set()  # these ticks' Status frames are counted but not sent
        self.repeat_at: set[int] = set()  # these come twice
        self.short_at: set[int] = set()  # these have seven bytes
        self.stall_at: dict[int, float] = {}  # pause of so many seconds before a tick
        self.step_jump_at = -1
        self.answer = True  # run commands are acknowledged
        self.answer_repeated = 0  # so many are called repeated first
        self.ended = threading.Event()
        self.tick = 0
        self.step = 0
        self.commands: list[tuple[int, int, int]] = []  # command, request, argument
        self.setpoints: list[tuple[float, int, int, float]] = []  # when, alive, control, m/s
        self.crc_errors = 0
        self.lines_misunderstood = 0

    def stop(self) -> None:
        self.ended.set()
        if self.is_alive():
            self.join(5.0)
        self._listener.close()

    def run(self) -> None:
        while not self.ended.is_set():
            try:
                client, _ = self._listener.accept()
            except TimeoutError:
                continue
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            try:
                self._serve(client)
            except OSError:
                pass  # the client went
            client.close()
        self._listener.close()

    def _serve(self, client: socket.socket) -> None:
        client.sendall(self.greeting)
        for _ in ("open", "rawmode"):
            if not client.recv(256):
                return
            client.sendall(b"< ok >")
        time.sleep(0.03)
        client.setblocking(True)
        client.settimeout(0.0005)
        began = due = time.monotonic()
        heard = ""
        while not self.ended.is_set():
            due += 0.01 + self.stall_at.pop(self.tick, 0.0)
            while (now := time.monotonic()) < due:
                heard = self._listen(client, heard)
                time.sleep(0.001)
            if self.vanish_after_s and now - began > self.vanish_after_s:
                if self.reset_connection:
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                return
            if self.garbage_after_s and now - began > self.garbage_after_s:
                client.sendall(b"\n< frame zz nonsense >\xff\xfe\x00<<<>>")
            if not (self.mute_after_s and now - began > self.mute_after_s):
                self._send_tick(client)

    def _listen(self, client: socket.socket, heard: str) -> str:
        try:
            got = client.recv(4096)
        except TimeoutError:
            return heard
        if not got:
            raise ConnectionError
        heard += got.decode("ascii")
        while match := re.search(r"<([^>]*)>", heard):
            heard = heard[match.end():]
            self._take(client, match.group(1).split())
        return heard

    def _take(self, client: socket.socket, words: list[str]) -> None:
        data = bytes(int(word, 16) for word in words[3:])
        if words[0] != "send" or len(data) != int(words[2]) or len(data) != 8:
            self.lines_misunderstood += 1
            return
        identifier = int(words[1], 16)
        data_id = {RUN_CONTROL: 0x1010, SPEED_SETPOINT: 0x1011}.get(identifier)
        if data_id is None or crc_bitwise(data_id, data) != data[0] or data[1] & 15 == 15:
            self.crc_errors += 1
        elif identifier == SPEED_SETPOINT:
            speed = int.from_bytes(data[4:6], "little") * 0.0025
            self.setpoints.append((time.monotonic(), data[1] & 15, data[2], speed))
        else:
            self._command(client, data)

    def _command(self, client: socket.socket, data: bytes) -> None:
        self.commands.append((data[2], data[3], int.from_bytes(data[4:6], "little")))
        if self.answer:
            result = 4 if self.answer_repeated > 0 else 0
            self.answer_repeated -= 1
            self._send(client, ACK, struct.pack("<BBBBI", data[3], data[2], result, RUNNING, self.step))

    def _send(self, client: socket.socket, identifier: int, data: bytes) -> None:
        line = f"\n< frame {identifier:03X} {time.time():.6f} {data.hex().upper()} >".encode("ascii")
        cut = len(line) - (1 + identifier % 20) if self.piecewise else 0
        client.sendall(line[:cut] if cut else line)
        if cut:
            time.sleep(0.0005)
            client.sendall(line[cut:])

    def _send_tick(self, client: socket.socket) -> None:
        tick = self.tick
        self.step += 10 if tick != self.step_jump_at else 1000
        status = struct.pack("<HBBI", tick & 0xFFFF, RUNNING, 0, self.step)
        if tick not in self.skip_at:
            self._send(client, STATUS, status[:7] if tick in self.short_at else status)
        if tick in self.repeat_at:
            self._send(client, STATUS, status)
        self._send(client, VEHICLE_MOTION, struct.pack("<HHi", tick & 0xFFFF, 10_000, tick * 250))
        self._send(client, WHEELSET_MOTION, struct.pack("<HhhH", tick & 0xFFFF, tick % 200 * 10 - 1000, -500, 0))
        self.tick += 1
