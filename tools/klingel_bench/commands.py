"""Commands to the node: run control that waits for its acknowledge, cyclic set-points of speed and actuators, the script.

One run command is under way at a time; the next goes out when the one before is answered or given up. The set-points
run beside them. Call poll() often (every 20 ms or so); nothing here blocks.
"""

from __future__ import annotations

import collections
import dataclasses
import random
import re
from typing import Callable

from .database import Database, DatabaseError
from .protection import ALIVE_VALUES, seal

RUN_COMMANDS = ("start", "stop", "pause", "step", "reset", "snapshot", "restore", "none")
MAX_ARGUMENT = 65535


@dataclasses.dataclass(frozen=True)
class Value:
    """A set-point by its name in a command: the signal it is, and what that holds."""

    message: str  # # is the number in the name
    signal: str
    least: float
    most: float
    unit: str
    kept: bool = False  # stays as it was when the bench lets go of it


VALUES = {"speed": Value("SpeedSetpoint", "Speed", 0.0, 163.0, "m/s", kept=True),
          "actuator#": Value("Actuator#", "Force", -8_388_607.0, 8_388_607.0, "N"),
          "torque#": Value("Wheelset#Drive", "Torque", -838_860.7, 838_860.7, "N m"),
          "twist#": Value("Wheelset#Drive", "Twist", -163_835.0, 163_835.0, "N m"),
          "draw": Value("DrawForce", "Force", -83_886_070.0, 83_886_070.0, "N")}


def value_of(name: str) -> tuple[Value, str] | None:
    """What a command's name stands for, and the message with its number; None: it is no set-point."""
    parts = re.fullmatch(r"([a-z]+)([1-9]\d?|)", name)
    value = VALUES.get(parts[1] + ("#" if parts[2] else "")) if parts else None
    return None if value is None else (value, value.message.replace("#", parts[2]))


DONE = "Done"
REPEATED = "Repeated"


@dataclasses.dataclass(frozen=True)
class Command:
    """`at_s` after the bench has connected. `value`: steps, the speed in m/s, a force in N, a torque in N m; None: the set-point ends."""

    at_s: float
    name: str
    value: float | None = None

    @classmethod
    def parse(cls, text: str, at_s: float = 0.0) -> "Command":
        """`start`, `step=10`, `speed=25`, `speed=off`, `actuator1=-500`, `torque2=off`, `draw=2e4`. Raises ValueError."""
        name, given, value = text.strip().partition("=")
        setpoint = value_of(name)
        if setpoint is not None:
            if value == "off":
                return cls(at_s, name)
            what, number = setpoint[0], float(value or "nan")
            if not what.least <= number <= what.most:
                raise ValueError(f"'{text}': must be {what.least:.10g}..{what.most:.10g} {what.unit}, or off")
            return cls(at_s, name, number)
        if name not in RUN_COMMANDS or (given and name != "step"):
            names = ", ".join(word.replace("#", "K") + "=X" for word in VALUES)
            raise ValueError(f"'{text}' is no command: {', '.join(RUN_COMMANDS)}, step=N, {names} or =off")
        steps = int(value) if given else (1 if name == "step" else 0)
        if not 0 <= steps <= MAX_ARGUMENT:
            raise ValueError(f"'{text}': 1..{MAX_ARGUMENT} steps")
        return cls(at_s, name, steps)

    @classmethod
    def parse_timed(cls, text: str) -> "Command":
        """`2.5:speed=25`"""
        at, colon, rest = text.partition(":")
        at_s = float(at) if colon else -1.0
        if not 0.0 <= at_s < 1e9:
            raise ValueError(f"'{text}' is not SECONDS:COMMAND")
        return cls.parse(rest, at_s)

    @property
    def is_setpoint(self) -> bool:
        """Sent again and again, and never answered."""
        return self.name not in RUN_COMMANDS

    def __str__(self) -> str:
        if self.is_setpoint:
            return f"{self.name}=off" if self.value is None else f"{self.name}={self.value:g}"
        return f"step={self.value:g}" if self.name == "step" else self.name


@dataclasses.dataclass
class Outcome:
    command: Command
    result: str  # of the Ack, or "no answer", "not sent"
    round_trip_s: float = 0.0
    run_state: str = ""
    step: int = 0

    @property
    def done(self) -> bool:
        return self.result == DONE


class Sealer:
    """Numbers and seals one protected message. It starts anywhere: the node may remember another sender's count."""

    def __init__(self, database: Database, name: str):
        self.message = database.by_name[name]
        self._alive = random.randrange(ALIVE_VALUES)

    def frame(self, **values: float) -> bytes:
        data = seal(self.message.data_id or 0, self._alive, self.message.encode(values))
        self._alive = (self._alive + 1) % ALIVE_VALUES
        return data


class Setpoint:
    """The values of one message, sent in its cycle for as long as one of them is set; the others are 0."""

    def __init__(self, database: Database, message: str, kept: bool):
        if message not in database.by_name:
            raise DatabaseError(f"{message}: this vehicle has no such message")
        self.sealer = Sealer(database, message)
        self.kept = kept
        self.values: dict[str, float] = {}
        self.next_s = 0.0

    def due(self, now_s: float) -> bool:
        if not self.values or now_s < self.next_s:
            return False
        self.next_s = max(self.next_s + (self.sealer.message.cycle_s or 0.1), now_s)
        return True


class Commander:
    def __init__(self, database: Database, script: list[Command], send: Callable[[int, bytes], bool],
                 timeout_s: float = 1.0):
        self.outcomes: list[Outcome] = []
        self.sent = 0
        self._send = send
        self._timeout_s = timeout_s
        self._script = collections.deque(sorted(script, key=lambda command: command.at_s))
        self._ready: collections.deque[Command] = collections.deque()
        self._pending: Command | None = None
        self._pending_since = 0.0
        self._pending_again = False
        self._request = random.randrange(256)
        self._control = Sealer(database, "RunControl")
        names = sorted({command.name for command in script if command.is_setpoint})
        self._setpoints = {message: Setpoint(database, message, value.kept) for value, message in map(value_of, names)}
        self._ack = database.by_name["Ack"]
        self._numbers = {text.lower(): int(raw) for raw, text
                         in self._control.message.frame.signal_by_name("Command").values.items()}

    @property
    def idle(self) -> bool:
        """Nothing is under way or still to come; the set-point may go on."""
        return not self._script and not self._ready and self._pending is None

    def poll(self, now_s: float) -> None:
        """Does what is due; `now_s` counts from the connection on."""
        while self._script and self._script[0].at_s <= now_s:
            command = self._script.popleft()
            if command.is_setpoint:
                self._set(command, now_s)
            else:
                self._ready.append(command)
        if self._pending is not None and now_s - self._pending_since > self._timeout_s:
            self._finish(Outcome(self._pending, "no answer"))
        if self._pending is None and self._ready:
            self._start(self._ready.popleft(), now_s)
        for setpoint in self._setpoints.values():
            if setpoint.due(now_s):
                self._put(setpoint.sealer, Control=1, **setpoint.values)

    def acknowledge(self, data: bytes, now_s: float) -> None:
        """Takes an Ack frame; those for other clients' requests are left alone."""
        answer = self._ack.decode(data)
        pending = self._pending
        if pending is None or answer["RequestId"] != self._request:
            return
        if str(answer["Command"]).lower() != pending.name:
            return
        if answer["Result"] == REPEATED and not self._pending_again:
            self._pending_again = True  # our first count was the node's last by chance; the next one is not
            self._transmit(now_s)
            return
        self._finish(Outcome(pending, str(answer["Result"]), now_s - self._pending_since,
                             str(answer["RunState"]), int(answer["Step"])))

    def release(self) -> None:
        """Hands the values over for good, so that the node does not brake because the bench has gone."""
        for setpoint in self._setpoints.values():
            self._let_go(setpoint, list(setpoint.values))

    def give_up(self) -> None:
        """Whatever is not answered by now never will be; what had not come due yet is not counted."""
        if self._pending is not None:
            self._finish(Outcome(self._pending, "no answer"))
        while self._ready:
            self._finish(Outcome(self._ready.popleft(), "not sent"))

    def _let_go(self, setpoint: Setpoint, signals: list[str]) -> None:
        """The speed stays as it was; a force ends, and with the last one of a message its supervision."""
        last = {signal: setpoint.values.pop(signal) for signal in signals if signal in setpoint.values}
        if last and not setpoint.values:
            self._put(setpoint.sealer, Control=0, **(last if setpoint.kept else dict.fromkeys(last, 0.0)))

    def _set(self, command: Command, now_s: float) -> None:
        value, message = value_of(command.name)
        setpoint = self._setpoints[message]
        if command.value is None:
            self._let_go(setpoint, [value.signal])
            return
        if not setpoint.values:
            setpoint.next_s = now_s
        setpoint.values[value.signal] = command.value

    def _start(self, command: Command, now_s: float) -> None:
        self._pending = command
        self._pending_again = False
        self._request = (self._request + 1) % 256
        self._transmit(now_s)

    def _transmit(self, now_s: float) -> None:
        assert self._pending is not None
        self._pending_since = now_s
        if not self._put(self._control, Command=self._numbers[self._pending.name], RequestId=self._request,
                         Argument=int(self._pending.value or 0)):
            self._finish(Outcome(self._pending, "not sent"))

    def _put(self, sealer: Sealer, **values: float) -> bool:
        sent = self._send(sealer.message.identifier, sealer.frame(**values))
        self.sent += sent
        return sent

    def _finish(self, outcome: Outcome) -> None:
        self.outcomes.append(outcome)
        self._pending = None
