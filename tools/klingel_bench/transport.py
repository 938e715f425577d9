"""The bus through stock python-can: SocketCAN, the socketcand port, or slcan on a serial port.

One thread receives and does nothing else, so that no frame waits while the rest of the bench decodes, draws or
writes. python-can 4.1 neither notices that a socketcand server has gone nor gives up a port that is closed for less
than ten seconds; both are looked after here.
"""

from __future__ import annotations

import collections
import dataclasses
import errno
import logging
import socket
import threading
import time
from typing import Callable, NamedTuple

import can

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 29536
MAX_WAITING = 500_000  # frames between the receiving thread and the rest
POLL_S = 0.05
HANDSHAKE_S = 5.0
SERIAL_BAUD = 921600  # of a real serial port
RECEIVE_BUFFER_BYTES = 4 << 20  # SocketCAN's default holds some 280 frames

# A closed or misbehaving peer makes python-can write a line per read; the bench says it once, in its own words.
logging.getLogger("can").setLevel(logging.CRITICAL)


class Frame(NamedTuple):
    timestamp: float  # s since 1970, of whoever put the frame on the bus
    identifier: int
    data: bytes
    classic: bool  # a data frame with a standard identifier


class TransportError(Exception):
    """There is no such bus, or it cannot be reached."""


@dataclasses.dataclass(frozen=True)
class Address:
    """`vcan0`, `socketcand[:HOST:PORT]`, or `slcan:DEVICE`."""

    channel: str
    host: str | None = None  # None: SocketCAN or slcan
    port: int = 0
    device: str | None = None  # slcan's serial port

    @classmethod
    def parse(cls, text: str, channel: str = "vcan0") -> "Address":
        kind, _, rest = text.partition(":")
        if kind == "slcan":
            if not rest:
                raise ValueError(f"'{text}': slcan needs a serial port, as in slcan:/dev/ttyUSB0")
            return cls(channel=channel, device=rest)
        if kind != "socketcand":
            if not text or ":" in text or len(text) > 15:
                raise ValueError(f"'{text}' is neither the name of a CAN interface, nor socketcand[:HOST:PORT],"
                                 " nor slcan:DEVICE")
            return cls(channel=text)
        host, _, port = rest.rpartition(":")
        try:
            number = int(port) if rest else DEFAULT_PORT
        except ValueError:
            number = 0
        if not 0 < number < 65536:
            raise ValueError(f"'{text}': the port must be 1..65535")
        return cls(channel=channel, host=host.strip("[]") or DEFAULT_HOST, port=number)

    def __str__(self) -> str:
        if self.device is not None:
            return f"slcan {self.device}"
        return self.channel if self.host is None else f"socketcand {self.host}:{self.port}"


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    if isinstance(error, TimeoutError):
        return "no answer"
    return str(error).partition("\n")[0].partition(" [Error Code")[0] or type(error).__name__


def _knock(address: Address) -> None:
    """Fails at once where python-can would try for ten seconds without a pause."""
    socket.create_connection((address.host, address.port), timeout=HANDSHAKE_S).close()


def _open_once(address: Address) -> can.BusABC:
    if address.device is not None:
        return can.Bus(interface="slcan", channel=address.device, ttyBaudrate=SERIAL_BAUD, sleep_after_open=0)
    if address.host is None:
        bus = can.Bus(interface="socketcan", channel=address.channel)
        for option in ("SO_RCVBUFFORCE", "SO_RCVBUF"):  # the first needs privileges and goes beyond the limit
            try:
                bus.socket.setsockopt(socket.SOL_SOCKET, getattr(socket, option, 33), RECEIVE_BUFFER_BYTES)
                break
            except OSError:
                continue
        return bus
    _knock(address)
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(HANDSHAKE_S)  # python-can sets none, and a silent server would hold us for ever
    try:
        return can.Bus(interface="socketcand", host=address.host, port=address.port, channel=address.channel)
    finally:
        socket.setdefaulttimeout(before)


def open_bus(address: Address, wait_s: float, say: Callable[[str], None],
             stop: threading.Event | None = None) -> can.BusABC:
    """Connects; tries again until `wait_s` are over or `stop` is set. Raises TransportError."""
    until = time.monotonic() + wait_s
    told = False
    while True:
        try:
            return _open_once(address)
        except (OSError, can.CanError, ValueError) as error:
            reason = _reason(error)
        left = until - time.monotonic()
        if left <= 0 or (stop is not None and stop.is_set()):
            raise TransportError(f"{address}: {reason}")
        if not told:
            say(f"{address}: {reason}; trying again for {left:.0f} s")
            told = True
        time.sleep(min(0.2, left))


class Link:
    """An open bus with its receiving thread. `lost` says why nothing will come any more; "" while all is well."""

    def __init__(self, address: Address, bus: can.BusABC):
        self.address = address
        self.lost = ""
        self.overflow = 0  # frames that found no room here
        self.times_down = 0  # SocketCAN: the interface was taken down
        self._bus = bus
        # The stream of the socketcand server, kept private by python-can: its end is seen nowhere else.
        self._stream: socket.socket | None = getattr(bus, "_SocketCanDaemonBus__socket", None)
        self._waiting: collections.deque[can.Message] = collections.deque()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._receive, name="receive", daemon=True)
        self._thread.start()

    def _stream_ended(self) -> bool:
        if self._stream is None:
            return False
        try:
            return self._stream.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
        except BlockingIOError:
            return False
        except OSError:
            return True

    def _receive(self) -> None:
        receive, waiting = self._bus.recv, self._waiting
        while not self._ending.is_set():
            try:
                message = receive(POLL_S)
            except (can.CanError, OSError, ValueError) as error:
                if not self._goes_on_after(error):
                    return
                continue
            if message is not None:
                if len(waiting) < MAX_WAITING:
                    waiting.append(message)
                else:
                    self.overflow += 1
            elif self._stream_ended():
                self.lost = "the server closed the connection"
                return

    def _goes_on_after(self, error: Exception) -> bool:
        """An interface that is down may come up again; everything else is the end."""
        code = getattr(error, "error_code", None)
        if self.address.host is None and self.address.device is None and code == errno.ENETDOWN:
            self.times_down += 1
            return not self._ending.wait(POLL_S)
        if not self._ending.is_set():
            self.lost = "the connection broke" if isinstance(error, OSError) else f"cannot receive: {_reason(error)}"
        return False

    def take(self) -> list[Frame]:
        """All frames that have come since the last call, oldest first."""
        waiting = self._waiting
        # python-can marks every frame of a socketcand server as extended: only there the flag means nothing.
        no_flag = self._stream is not None
        frames = []
        for _ in range(len(waiting)):
            message = waiting.popleft()
            standard = message.arbitration_id <= 0x7FF if no_flag else not message.is_extended_id
            classic = standard and not (message.is_remote_frame or message.is_error_frame or message.is_fd)
            frames.append(Frame(message.timestamp, message.arbitration_id, bytes(message.data), classic))
        return frames

    def send(self, identifier: int, data: bytes) -> bool:
        """Hands one frame over; False if the bus did not take it."""
        try:
            self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        except (can.CanError, OSError) as error:
            if (self._stream is not None or self.address.device is not None) and not self.lost:
                self.lost = f"cannot send: {_reason(error)}"
            return False
        return True

    def close(self) -> None:
        self._ending.set()
        self._thread.join(timeout=2.0)
        try:
            self._bus.shutdown()
        except (can.CanError, OSError):
            pass  # it went before we did
