"""The live table: redrawn in place on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import os
from typing import TextIO

from .database import Message, Signal
from .monitor import Monitor, Record

HIDDEN = ("Counter", "Crc", "Alive")
PLAIN_MESSAGES = ("Status", "VehicleMotion", "Wheelset1Motion", "Wheel1RForces")  # in the lines without a terminal
CLEAR_LINE = "\x1b[K"
CLEAR_BELOW = "\x1b[J"


def value_text(value: float | str, signal: Signal) -> str:
    if isinstance(value, str):
        return value
    if math.isnan(value):
        return "invalid"
    if signal.name.endswith("Hash"):
        return f"{int(value):012x}"
    text = f"{value * signal.scale:.{signal.decimals}f}"
    return f"{text} {signal.unit}" if signal.unit else text


def signals_text(message: Message, data: bytes) -> str:
    values = message.decode(data)
    return "  ".join(f"{name} {value_text(values[name], signal)}" for name, signal in message.signals.items()
                     if name not in HIDDEN)


def _ms(seconds: float, width: int, decimals: int) -> str:
    return "-".rjust(width) if math.isnan(seconds) or seconds == 0 else f"{seconds * 1e3:{width}.{decimals}f}"


def row(record: Record) -> str:
    message = record.message
    bad = record.gaps + record.repeated + record.bad_crc + record.malformed
    return (f"{message.identifier:03X} {message.name:<17} {record.count:>8} {_ms(message.cycle_s, 5, 0)}"
            f" {_ms(record.mean_s(), 9, 3)} {_ms(record.jitter_s(), 7, 3)} {_ms(record.worst_s, 8, 2)}"
            f" {record.lost:>5} {bad:>4} {record.late:>5}  "
            f"{signals_text(message, record.last_data) if record.count else ''}")


HEADER = (f"{'ID':<3} {'message':<17} {'frames':>8} {'cycle':>5} {'measured':>9} {'jitter':>7} {'worst/ms':>8}"
          f" {'lost':>5} {'bad':>4} {'late':>5}  signals")


def summary_line(monitor: Monitor, elapsed_s: float) -> str:
    records = monitor.records.values()
    rate = monitor.frames / elapsed_s if elapsed_s > 0 else 0.0
    return (f"{elapsed_s:7.1f} s  {monitor.frames} frames  {rate:.0f}/s  lost {sum(r.lost for r in records)}"
            f"  CRC errors {sum(r.bad_crc for r in records)}  late {sum(r.late for r in records)}")


class LiveTable:
    """Draws at most every `interval_s`."""

    def __init__(self, stream: TextIO, title: str, interval_s: float | None):
        self._stream = stream
        self._title = title
        self._terminal = stream.isatty()
        self._interval_s = interval_s if interval_s is not None else (0.25 if self._terminal else 1.0)
        self._next_s = self._interval_s
        self._lines_drawn = 0

    def poll(self, monitor: Monitor, elapsed_s: float, note: str = "") -> None:
        if self._interval_s > 0 and elapsed_s >= self._next_s:
            self._next_s = elapsed_s + self._interval_s
            self.draw(monitor, elapsed_s, note)

    def draw(self, monitor: Monitor, elapsed_s: float, note: str = "") -> None:
        if self._terminal:
            self._draw_in_place(monitor, elapsed_s, note)
        else:
            self._draw_line(monitor, elapsed_s, note)

    def _draw_in_place(self, monitor: Monitor, elapsed_s: float, note: str) -> None:
        try:
            width, height = os.get_terminal_size(self._stream.fileno())
        except OSError:
            width, height = 80, 24
        width, height = width or 80, height or 24
        rows = [row(record) for record in monitor.records.values() if record.count or record.message.from_node]
        room = max(1, height - 5)
        if len(rows) > room:
            rows = rows[:room - 1] + [f"... and {len(rows) - room + 1} more messages"]
        lines = [self._title, summary_line(monitor, elapsed_s), HEADER, *rows, note]
        home = f"\x1b[{self._lines_drawn}A\r" if self._lines_drawn else ""
        body = "".join(f"{line[:width - 1]}{CLEAR_LINE}\n" for line in lines)
        self._stream.write(f"{home}{body}{CLEAR_BELOW}")
        self._stream.flush()
        self._lines_drawn = len(lines)

    def _draw_line(self, monitor: Monitor, elapsed_s: float, note: str) -> None:
        parts = [summary_line(monitor, elapsed_s)]
        for name in PLAIN_MESSAGES:
            message = monitor.database.by_name.get(name)
            record = monitor.records[message.identifier] if message else None
            if record is not None and record.count:
                parts.append(f"{name}: {signals_text(record.message, record.last_data)}")
        self._stream.write(" | ".join(parts + ([note] if note else [])) + "\n")
        self._stream.flush()
