"""The DBC as the bench needs it: canmatrix decodes and encodes, and the checks get plain numbers per message."""

from __future__ import annotations

import dataclasses
import decimal
import logging
import math
import pathlib
import subprocess
import tempfile

logging.getLogger("canmatrix").setLevel(logging.ERROR)  # it tells on import which formats it lacks

import canmatrix  # noqa: E402
import canmatrix.formats  # noqa: E402


class DatabaseError(Exception):
    """The DBC cannot be had or used."""


@dataclasses.dataclass(frozen=True)
class Field:
    """Where an unsigned little-endian signal lies in a frame."""

    start: int
    length: int

    def get(self, data: bytes) -> int:
        return (int.from_bytes(data, "little") >> self.start) & ((1 << self.length) - 1)


@dataclasses.dataclass(frozen=True)
class Signal:
    """How to show a signal: in units that suit its range."""

    name: str
    unit: str
    scale: float
    decimals: int
    comment: str


@dataclasses.dataclass(frozen=True)
class Message:
    name: str
    identifier: int
    length: int
    cycle_s: float  # 0: sent on event
    from_node: bool
    counter: Field | None
    data_id: int | None  # protected messages
    signals: dict[str, Signal]
    frame: canmatrix.Frame

    def field(self, name: str) -> Field:
        signal = self.frame.signal_by_name(name)
        if signal is None or not signal.is_little_endian or signal.is_signed:
            raise DatabaseError(f"message {self.name} has no unsigned little-endian signal {name}")
        return Field(signal.start_bit, signal.size)

    def decode(self, data: bytes) -> dict[str, float | str]:
        """Physical values in the DBC's units; names of values where it has them; NaN for "Invalid"."""
        values: dict[str, float | str] = {}
        for name, decoded in self.frame.decode(data).items():
            text = decoded.signal.values.get(decoded.raw_value)
            if text == "Invalid":
                values[name] = math.nan
            else:
                values[name] = text if text is not None else float(decoded.phys_value)
        return values

    def encode(self, values: dict[str, float]) -> bytes:
        """Physical values to the nearest raw ones; signals not named are 0."""
        return bytes(self.frame.encode({name: self._raw(name, value) for name, value in values.items()}))

    def _raw(self, name: str, value: float) -> int:
        signal = self.frame.signal_by_name(name)  # its own phys2raw cuts off instead of rounding
        return round((decimal.Decimal(str(value)) - signal.offset) / signal.factor)


# unit in the DBC: unit shown, factor, and up to which largest value it is used
_SHOWN_AS = {"m": ("mm", 1e3, 10.0), "rad": ("mrad", 1e3, 1.0), "N": ("kN", 1e-3, math.inf),
             "us": ("µs", 1.0, math.inf), "m/s2": ("m/s²", 1.0, math.inf), "1/m": ("1/km", 1e3, math.inf)}


def _signal(signal: canmatrix.Signal) -> Signal:
    unit, scale = signal.unit or "", 1.0
    if unit in _SHOWN_AS:
        shown, factor, largest = _SHOWN_AS[unit]
        if abs(float(signal.max)) <= largest:
            unit, scale = shown, factor
    step = float(signal.factor) * scale
    decimals = min(4, max(0, math.ceil(-math.log10(step) - 1e-9)))
    return Signal(signal.name, unit, scale, decimals, signal.comment or "")


class Database:
    def __init__(self, path: str):
        try:
            self.matrix = canmatrix.formats.loadp_flat(path)
        except Exception as error:  # canmatrix raises whatever its parser stumbles over
            raise DatabaseError(f"{path}: {error or type(error).__name__}") from error
        self.by_id: dict[int, Message] = {}
        self.by_name: dict[str, Message] = {}
        for frame in self.matrix.frames:
            message = self._message(frame)
            self.by_id[message.identifier] = message
            self.by_name[message.name] = message
        for name in ("RunControl", "SpeedSetpoint", "Ack", "Status"):
            if name not in self.by_name:
                raise DatabaseError(f"{path}: message {name} is missing; is it a DBC of Klingel?")
        self.table_hash = str(self.matrix.attribute("SignalTableHash") or "")

    def _message(self, frame: canmatrix.Frame) -> Message:
        def number(attribute: str) -> int:
            return int(frame.attribute(attribute, self.matrix) or 0)

        counter = frame.signal_by_name("Counter")
        cycle_us = number("CycleTime_us") or 1000 * int(frame.cycle_time or 0)
        return Message(name=frame.name, identifier=frame.arbitration_id.id, length=frame.size,
                       cycle_s=cycle_us * 1e-6, from_node="Klingel" in frame.transmitters,
                       counter=Field(counter.start_bit, counter.size) if counter else None,
                       data_id=number("E2EDataId") or None,
                       signals={signal.name: _signal(signal) for signal in frame.signals}, frame=frame)

    @property
    def step_s(self) -> float:
        """Length of a model step."""
        return float(self.matrix.attribute("StepTime_us") or 1000) * 1e-6


def from_model(program: str, model: str, extra: list[str]) -> Database:
    """Asks `klingel dbc` for the DBC of a vehicle file."""
    try:
        done = subprocess.run([program, "dbc", model, *extra], capture_output=True, text=True, check=False, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DatabaseError(f"{program}: {error}") from error
    if done.returncode != 0:
        raise DatabaseError(f"{program} dbc {model}: {done.stderr.strip() or f'exit status {done.returncode}'}")
    with tempfile.TemporaryDirectory(prefix="klingel") as folder:
        path = pathlib.Path(folder) / f"{pathlib.Path(model).stem}.dbc"
        path.write_text(done.stdout, encoding="utf-8")
        return Database(str(path))
