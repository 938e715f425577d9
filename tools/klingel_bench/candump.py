"""candump's log format: `(1700000000.123456) vcan0 123#1A2203`.

python-can's own writer adds a direction, which Wireshark does not read, so this one is our own.
"""

from __future__ import annotations

from typing import TextIO


def line(timestamp: float, channel: str, identifier: int, data: bytes, extended: bool = False) -> str:
    """One frame with the newline; 3 hexadecimal digits for standard identifiers, 8 for extended ones."""
    digits = f"{identifier:08X}" if extended else f"{identifier:03X}"
    return f"({timestamp:.6f}) {channel} {digits}#{data.hex().upper()}\n"


class Log:
    """Writes frames to a file; without one it does nothing."""

    def __init__(self, path: str | None, channel: str):
        self._file: TextIO | None = open(path, "w", encoding="ascii") if path else None
        self._channel = channel
        self.frames = 0

    def write(self, timestamp: float, identifier: int, data: bytes, extended: bool = False) -> None:
        if self._file is not None:
            self._file.write(line(timestamp, self._channel, identifier, data, extended))
            self.frames += 1

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
