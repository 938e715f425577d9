"""What every received frame is held against, by its bytes: length, counter, CRC, cycle time.

Nothing is decoded here; the live table decodes the last frame of a message when it draws, and the picture decodes
the kept samples at the end. That keeps ten frames a millisecond within a fraction of one core.
"""

from __future__ import annotations

import dataclasses
import math

from .database import Database, Message
from .protection import AliveCheck, Judgement
from .transport import Frame

SYNC_ID = 0x080
RUNNING = 1  # RunState
MAX_SAMPLES = 40_000  # per message; then every second one goes and the spacing doubles


class Samples:
    """Frames of one message kept for later, at least `spacing_s` apart, in bounded memory."""

    def __init__(self, spacing_s: float):
        self.spacing_s = spacing_s
        self.times: list[float] = []
        self.data: list[bytes] = []

    def add(self, timestamp: float, data: bytes) -> None:
        # Half a millisecond of grace: frames of 10 ms do not always come 10 ms apart.
        if self.times and timestamp - self.times[-1] < self.spacing_s - 0.0005:
            return
        self.times.append(timestamp)
        self.data.append(data)
        if len(self.times) > MAX_SAMPLES:
            del self.times[1::2], self.data[1::2]
            self.spacing_s *= 2


@dataclasses.dataclass
class Record:
    """Everything known about one message."""

    message: Message
    alive: AliveCheck | None
    limit_s: float  # an interval longer than this is late; 0: no cycle
    count: int = 0
    lost: int = 0  # frames missing by the counter
    gaps: int = 0  # events of these
    repeated: int = 0
    bad_crc: int = 0
    malformed: int = 0
    late: int = 0
    worst_s: float = 0.0  # longest interval without loss
    last_counter: int = -1
    last_time: float = math.nan
    first_time: float = math.nan
    last_data: bytes = b""
    intervals: int = 0
    interval_sum: float = 0.0
    interval_squares: float = 0.0  # of the deviation from the DBC's cycle
    samples: Samples | None = None

    def mean_s(self) -> float:
        return self.interval_sum / self.intervals if self.intervals else math.nan

    def jitter_s(self) -> float:
        """Standard deviation of the interval."""
        if self.intervals == 0:
            return math.nan
        bias = self.mean_s() - self.message.cycle_s
        return math.sqrt(max(0.0, self.interval_squares / self.intervals - bias * bias))


class StepCheck:
    """The model's step counter in Status: while it runs, it grows with the time between two frames.

    Commands that load another state (start after stop, reset, restore) move it; their Ack excuses the next interval.
    """

    def __init__(self, status: Message, step_s: float):
        self._run_state = status.field("RunState")
        self._step = status.field("Step")
        self._modulus = 1 << self._step.length
        self._per_frame = status.cycle_s / step_s
        self._before: int | None = None
        self.jumps = 0

    def excuse(self) -> None:
        self._before = None

    def feed(self, data: bytes, frames: int) -> None:
        """`frames`: how many the counter says have gone by since the last one, this one included."""
        if self._run_state.get(data) != RUNNING:
            self._before = None
            return
        step = self._step.get(data)
        if self._before is not None:
            expected = self._per_frame * frames
            grown = (step - self._before) % self._modulus
            # A busy bus sends the newest state a little later: half a frame's worth of steps is no jump.
            self.jumps += abs(grown - expected) > max(1.0, 0.5 * self._per_frame)
        self._before = step


class Monitor:
    def __init__(self, database: Database, slack_s: float):
        self.database = database
        self.slack_s = slack_s
        self.records = {identifier: self._record(message) for identifier, message in database.by_id.items()}
        self.frames = 0
        self.syncs = 0
        self.unknown: dict[int, int] = {}
        self.acks: list[bytes] = []  # for whoever waits for them
        self.first_time = math.nan
        self.last_time = math.nan
        self.steps = StepCheck(database.by_name["Status"], database.step_s)
        self._ack = database.by_name["Ack"].identifier
        self._status = database.by_name["Status"].identifier

    def _record(self, message: Message) -> Record:
        limit_s = message.cycle_s + max(0.5 * message.cycle_s, self.slack_s) if message.cycle_s else 0.0
        return Record(message, AliveCheck(message.data_id) if message.data_id else None, limit_s)

    def of(self, name: str) -> Record:
        return self.records[self.database.by_name[name].identifier]

    def keep(self, name: str, spacing_s: float) -> None:
        """Keeps samples of a message from now on."""
        self.of(name).samples = Samples(spacing_s)

    def feed(self, frame: Frame) -> None:
        self.frames += 1
        timestamp = frame.timestamp
        if self.frames == 1:
            self.first_time = timestamp
        self.last_time = timestamp
        record = self.records.get(frame.identifier) if frame.classic else None
        if record is None:
            self._foreign(frame)
            return
        data = frame.data
        if len(data) != record.message.length:
            record.malformed += 1
            return
        missing = self._missing(record, data)
        if missing is None:
            return
        record.count += 1
        self._time(record, timestamp, missing)
        record.last_data = data
        if record.samples is not None:
            record.samples.add(timestamp, data)
        if frame.identifier == self._status:
            self.steps.feed(data, missing + 1)
        elif frame.identifier == self._ack:
            self.acks.append(data)
            self.steps.excuse()

    def _foreign(self, frame: Frame) -> None:
        if frame.classic and frame.identifier == SYNC_ID:
            self.syncs += 1
        else:
            self.unknown[frame.identifier] = self.unknown.get(frame.identifier, 0) + 1

    def _missing(self, record: Record, data: bytes) -> int | None:
        """Frames lost before this one; None: it is a repetition or broken and takes no further part."""
        if record.alive is not None:
            judgement, missing = record.alive.judge(data)
            if judgement is Judgement.BAD_CRC:
                record.bad_crc += 1
                return None
        elif (counter := record.message.counter) is not None:
            value = (data[0] | data[1] << 8) if counter.start == 0 and counter.length == 16 else counter.get(data)
            before, record.last_counter = record.last_counter, value
            missing = (value - before - 1) % (1 << counter.length) if before >= 0 else 0
            judgement = Judgement.REPEATED if before == value else Judgement.OK
            if judgement is Judgement.OK and missing >= 1 << (counter.length - 1):  # backwards: a new sender
                record.gaps += 1
                return 0
        else:
            return 0
        if judgement is Judgement.REPEATED:
            record.repeated += 1
            return None
        if missing:
            record.lost += missing
            record.gaps += 1
        return missing

    @staticmethod
    def _time(record: Record, timestamp: float, missing: int) -> None:
        if record.count == 1:
            record.first_time = timestamp
        elif not missing:
            interval = timestamp - record.last_time
            deviation = interval - record.message.cycle_s
            record.intervals += 1
            record.interval_sum += interval
            record.interval_squares += deviation * deviation
            if interval > record.worst_s:
                record.worst_s = interval
            if record.limit_s and interval > record.limit_s:
                record.late += 1
        record.last_time = timestamp

    def absent(self) -> list[str]:
        """Cyclic messages of the node that should have come by now and never did, or have stopped coming."""
        names = []
        for record in self.records.values():
            if not record.message.from_node or not record.limit_s:
                continue
            since = record.last_time if record.count else self.first_time
            if self.last_time - since > record.limit_s:
                names.append(record.message.name)
        return names
