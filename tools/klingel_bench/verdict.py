"""What a session comes to: the counts, what the node says of itself, and whether that is clean."""

from __future__ import annotations

import dataclasses

from .commands import Commander
from .monitor import Monitor
from .transport import Link

KINDS = {"lost": "frames missing by their counters", "repeated": "frames with the counter of the one before",
         "crc": "protected frames with a wrong CRC", "malformed": "frames of a wrong length",
         "late": "frames later than their cycle and the slack allow", "missing": "cyclic messages that do not come",
         "step": "jumps of the model's step counter", "command": "commands not acknowledged or refused",
         "fault": "bits latched as faults of the model", "table": "signal table differs from the DBC's",
         "overflow": "frames that this bench itself was too slow for", "down": "times the interface was down",
         "peer": "the peer went away"}

CLEAN, NOT_CLEAN, USAGE, NO_PEER, INTERRUPTED, TERMINATED = 0, 1, 2, 3, 130, 143


def parse_tolerated(texts: list[str]) -> dict[str, float]:
    """`late=3,lost` to the numbers allowed. Raises ValueError."""
    allowed = {}
    for part in ",".join(texts).split(","):
        kind, given, number = part.strip().partition("=")
        if not part.strip():
            continue
        if kind not in KINDS:
            raise ValueError(f"'{kind}' is none of {', '.join(KINDS)}")
        allowed[kind] = float(int(number)) if given else float("inf")
    return allowed


@dataclasses.dataclass
class Verdict:
    ended: str  # why it is over
    elapsed_s: float
    counts: dict[str, int]
    failed: list[str]  # kinds beyond what is tolerated
    lines: list[str]
    exit_status: int

    def text(self) -> str:
        return "\n".join(self.lines)


def _first_data(monitor: Monitor, name: str) -> dict[str, float | str]:
    message = monitor.database.by_name.get(name)
    record = monitor.records[message.identifier] if message else None
    return record.message.decode(record.last_data) if record is not None and record.count else {}


def _table_differs(monitor: Monitor) -> bool:
    spoken = _first_data(monitor, "InfoSignals").get("SignalHash")
    try:
        ours = int(monitor.database.table_hash, 16) & ((1 << 48) - 1)
    except ValueError:
        return False
    return spoken is not None and int(spoken) != ours


def count(monitor: Monitor, commander: Commander, link: Link | None, peer_gone: bool) -> dict[str, int]:
    records = monitor.records.values()
    status = _first_data(monitor, "Status")
    return {"lost": sum(max(record.lost, record.gaps) for record in records),
            "repeated": sum(record.repeated for record in records),
            "crc": sum(record.bad_crc for record in records),
            "malformed": sum(record.malformed for record in records),
            "late": sum(record.late for record in records),
            "missing": len(monitor.absent()),
            "step": monitor.steps.jumps,
            "command": sum(not outcome.done for outcome in commander.outcomes),
            "fault": int(status.get("Faults", 0)).bit_count(),
            "table": int(_table_differs(monitor)),
            "overflow": link.overflow if link else 0,
            "down": link.times_down if link else 0,
            "peer": int(peer_gone)}


def _detail(kind: str, monitor: Monitor) -> str:
    """Who is worst in one kind."""
    records = monitor.records.values()
    if kind == "lost":
        worst = max(records, key=lambda record: record.lost)
        return f"in {sum(r.gaps for r in records)} gaps, most in {worst.message.name}"
    if kind == "late":
        worst = max(records, key=lambda record: record.worst_s - record.limit_s if record.late else -1e9)
        return (f"worst {worst.message.name}: {worst.worst_s * 1e3:.1f} ms"
                f" instead of {worst.message.cycle_s * 1e3:g} ms")
    if kind == "missing":
        return ", ".join(monitor.absent())
    return ""


def _node_lines(monitor: Monitor) -> list[str]:
    status, timing, bus = (_first_data(monitor, name) for name in ("Status", "StatusTiming", "StatusBus"))
    lines = []
    if status:
        lines.append(f"  node        run state {status['RunState']}, step {int(status['Step'])},"
                     f" fault bits {int(status['Faults'])}")
    if timing:
        lines.append(f"              overruns {int(timing['Overruns'])}, cycle at most {timing['ExecMax']:.1f} µs")
    if bus:
        lines.append(f"              frames not sent {int(bus['SendDropped'])}, bad frames received"
                     f" {int(bus['ReceiveBad'])}, set-points late {int(bus['CommandsLate'])}")
    return lines


def judge(monitor: Monitor, commander: Commander, link: Link | None, allowed: dict[str, float], ended: str,
          elapsed_s: float, exit_status: int = CLEAN) -> Verdict:
    """`exit_status` other than CLEAN stands whatever the counts say, but for a peer whose going is tolerated."""
    counts = count(monitor, commander, link, exit_status == NO_PEER)
    if exit_status == NO_PEER and "peer" in allowed:
        exit_status = CLEAN
    failed = [kind for kind, number in counts.items() if number > allowed.get(kind, 0)]
    seen = [record for record in monitor.records.values() if record.count]
    rate = monitor.frames / elapsed_s if elapsed_s > 0 else 0.0
    lines = [f"ended after {elapsed_s:.1f} s: {ended}",
             f"  frames      {monitor.frames} of {len(seen)} messages, {rate:.0f} per second"]
    for kind, number in counts.items():
        if number or kind in ("lost", "repeated", "crc", "late", "missing"):
            detail = _detail(kind, monitor) if number else ""
            mark = "" if not number else " - not tolerated" if kind in failed else " - tolerated"
            lines.append(f"  {kind:<11} {number}{f' ({detail})' if detail else ''}{mark}")
    if monitor.unknown:
        shown = ", ".join(f"{identifier:03X}" for identifier in sorted(monitor.unknown)[:8])
        lines.append(f"  foreign     {sum(monitor.unknown.values())} frames of identifiers not in the DBC: {shown}")
    for outcome in commander.outcomes:
        told = f" after {outcome.round_trip_s * 1e3:.0f} ms, then {outcome.run_state}" if outcome.run_state else ""
        lines.append(f"  {outcome.command!s:<11} {outcome.result}{told}")
    lines += _node_lines(monitor)
    if not seen and exit_status == CLEAN:
        failed.append("missing")
    if exit_status == CLEAN and failed:
        exit_status = NOT_CLEAN
    word = "clean" if not failed else f"NOT CLEAN ({', '.join(dict.fromkeys(failed))})"
    lines.append(f"verdict: {word}")
    return Verdict(ended, elapsed_s, counts, failed, lines, exit_status)
