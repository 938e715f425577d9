"""Protection of command frames, after AUTOSAR end-to-end profile 11, variant A.

Byte 0 is the CRC, the low nibble of byte 1 an alive counter 0..14 (15 is never sent). The CRC is CRC-8 SAE J1850
(polynomial 0x1D) over the data ID, low byte first, and the frame from byte 1 on; in this use register and result are
not inverted. Written from that description, not from the C code, so that the two judge each other.
"""

from __future__ import annotations

import enum

POLYNOMIAL = 0x1D
ALIVE_VALUES = 15


def _table() -> bytes:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = (byte << 1) ^ (POLYNOMIAL if byte & 0x80 else 0)
        table.append(byte & 0xFF)
    return bytes(table)


_TABLE = _table()


def crc8(data: bytes, start: int = 0xFF, invert: int = 0xFF) -> int:
    """CRC-8 SAE J1850; 0x4B over b"123456789" as it stands in the catalogue."""
    crc = start
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc ^ invert


def frame_crc(data_id: int, data: bytes) -> int:
    """What byte 0 of a protected frame must be."""
    return crc8(data_id.to_bytes(2, "little") + bytes(data[1:]), start=0, invert=0)


def seal(data_id: int, alive: int, data: bytes) -> bytes:
    """The frame with alive counter and CRC put in; the high nibble of byte 1 is kept."""
    if len(data) < 2:
        raise ValueError("a protected frame has at least two bytes")
    sealed = bytearray(data)
    sealed[1] = (sealed[1] & 0xF0) | alive % ALIVE_VALUES
    sealed[0] = frame_crc(data_id, sealed)
    return bytes(sealed)


class Judgement(enum.Enum):
    OK = "ok"
    REPEATED = "repeated"
    GAP = "gap"
    BAD_CRC = "bad CRC"


class AliveCheck:
    """The receiver's side. The first good frame sets the counter; a bad one leaves it alone."""

    def __init__(self, data_id: int):
        self.data_id = data_id
        self.last: int | None = None

    def judge(self, data: bytes) -> tuple[Judgement, int]:
        """What a frame is worth, and how many are missing before it (known modulo 15 only)."""
        alive = data[1] & 0x0F if len(data) >= 2 else ALIVE_VALUES
        if alive == ALIVE_VALUES or frame_crc(self.data_id, data) != data[0]:
            return Judgement.BAD_CRC, 0
        before, self.last = self.last, alive
        if before is None:
            return Judgement.OK, 0
        step = (alive - before) % ALIVE_VALUES
        if step == 0:
            return Judgement.REPEATED, 0
        return (Judgement.OK if step == 1 else Judgement.GAP), step - 1
