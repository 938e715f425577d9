"""The command line of tools/bench.py and its loop."""

from __future__ import annotations

import argparse
import json
import pathlib
import signal
import sys
import threading
import time

from . import picture, verdict
from .candump import Log
from .commands import RUN_COMMANDS, Command, Commander
from .database import Database, DatabaseError, from_model
from .monitor import Monitor
from .table import LiveTable
from .transport import Address, Link, TransportError, open_bus

PAUSE_S = 0.01  # between two looks at what has come
QUIET_S = 0.5  # commands wait for the first frame, at most so long: a server may answer before it sends to us

DESCRIPTION = """\
Listens to a Klingel node on a CAN bus, checks what it says, commands it, logs it and draws it.

  bench.py --dbc wagon.dbc --time 30 --speed 25 --start --plot run.png
  bench.py --bus vcan0 --model models/two_axle_wagon.yaml --at 2:speed=25 --at 10:pause
"""

EPILOG = f"""\
checks that decide about the exit status, and what --tolerate can let pass:
{chr(10).join(f'  {kind:<10} {text}' for kind, text in verdict.KINDS.items())}

exit status: 0 clean; 1 not clean; 2 wrong usage or no DBC; 3 the bus cannot be reached, or the peer went away;
130 ended by Ctrl-C, 143 by SIGTERM (with the summary, whatever it says)
"""


class _Script(argparse.Action):
    """Collects --start, --step N, --speed V and their like in the order they are written in."""

    def __call__(self, parser, namespace, values, option_string=None):
        name = (option_string or "").lstrip("-")
        text = name if values in (None, []) else f"{name}={values}"
        try:
            command = Command.parse_timed(values) if name == "at" else Command.parse(text)
        except ValueError as error:
            parser.error(f"{option_string}: {error}")
        namespace.script = (namespace.script or []) + [command]


def _positive(text: str) -> float:
    value = float(text)
    if not 0 <= value < 1e9:
        raise argparse.ArgumentTypeError("must be 0 or more")
    return value


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(prog="bench.py", description=DESCRIPTION, epilog=EPILOG,
                                   formatter_class=argparse.RawDescriptionHelpFormatter)
    bus = made.add_argument_group("bus")
    bus.add_argument("--bus", default="socketcand", metavar="NAME",
                     help="vcan0 or another CAN interface, socketcand[:HOST:PORT], or slcan:DEVICE, an adapter or"
                          " firmware on a serial port or pty (default: %(default)s)")
    bus.add_argument("--channel", default="vcan0", metavar="NAME",
                     help="what to open at the socketcand server, and the name in the log (default: %(default)s)")
    bus.add_argument("--wait", type=_positive, default=5.0, metavar="SECONDS",
                     help="keep trying to connect for so long (default: %(default)g)")
    bus.add_argument("--silence", type=_positive, default=3.0, metavar="SECONDS",
                     help="no frame for so long: the peer is gone; 0: never (default: %(default)g)")
    table = made.add_argument_group("signals")
    table.add_argument("--dbc", metavar="FILE", help="the DBC of the bus")
    table.add_argument("--model", metavar="FILE", help="a vehicle file; its DBC is asked of `klingel dbc`")
    table.add_argument("--dbc-option", action="append", default=[], metavar="OPTION",
                       help="handed on to `klingel dbc`; repeatable")
    table.add_argument("--klingel", default="build/klingel", metavar="PROGRAM", help="default: %(default)s")
    session = made.add_argument_group("session")
    session.add_argument("--time", type=_positive, default=0.0, metavar="SECONDS", help="end after so long; 0: do not")
    session.add_argument("--interval", type=_positive, metavar="SECONDS",
                         help="between two tables (default: 0.25 on a terminal, else 1); 0: none")
    session.add_argument("--slack", type=_positive, default=10.0, metavar="MS",
                         help="a frame is late when its interval exceeds the cycle by the larger of this and half a"
                              " cycle (default: %(default)g)")
    session.add_argument("--tolerate", action="append", default=[], metavar="KIND[=N]",
                         help="let up to N (all) events of a kind pass; repeatable")
    session.add_argument("--log", metavar="FILE", help="all frames, received and sent, in candump's format")
    session.add_argument("--plot", metavar="FILE", help="a picture of signals over time (PNG, SVG, PDF)")
    session.add_argument("--signals", action="append", metavar="PATTERN[,PATTERN]",
                         help="what to plot, one panel per option: 'Wheelset*Motion.Y'")
    session.add_argument("--plot-rate", type=_positive, default=100.0, metavar="HZ",
                         help="samples kept per second and message (default: %(default)g)")
    session.add_argument("--json", metavar="FILE", help="the verdict for programs")
    commands = made.add_argument_group("commands", "carried out in this order, each when the one before is answered")
    for name in RUN_COMMANDS:
        if name == "step":
            commands.add_argument("--step", action=_Script, dest="script", metavar="N", help="N steps, then pause")
        elif name != "none":
            commands.add_argument(f"--{name}", action=_Script, dest="script", nargs=0)
    commands.add_argument("--speed", action=_Script, dest="script", metavar="V",
                          help="set-point in m/s, sent cyclically and supervised; released when the bench ends")
    commands.add_argument("--at", action=_Script, dest="script", metavar="SECONDS:COMMAND",
                          help="one of the above at a time: 2.0:speed=25, 5:speed=off, 6:step=10, 7:actuator1=500, "
                               "8:torque1=2e3, 8:twist1=300, 9:draw=2e4; repeatable")
    commands.add_argument("--ack-timeout", type=_positive, default=1.0, metavar="SECONDS", help="default: %(default)g")
    return made


class Session:
    """One connection from beginning to end."""

    def __init__(self, options: argparse.Namespace, database: Database, link: Link, log: Log):
        self.link = link
        self.monitor = Monitor(database, options.slack * 1e-3)
        self.commander = Commander(database, options.script or [], self._send, options.ack_timeout)
        self.interrupted = 0  # the signal's number
        self._options = options
        self._log = log
        self._table = LiveTable(sys.stdout, f"Klingel bench on {link.address}", options.interval)
        self._began = time.monotonic()
        self._heard_s = 0.0

    def elapsed_s(self) -> float:
        return time.monotonic() - self._began

    def _send(self, identifier: int, data: bytes) -> bool:
        sent = self.link.send(identifier, data)
        if sent:
            self._log.write(time.time(), identifier, data)
        return sent

    def _take(self, now_s: float) -> None:
        frames = self.link.take()
        if frames:
            self._heard_s = now_s
        for frame in frames:
            self.monitor.feed(frame)
            self._log.write(frame.timestamp, frame.identifier, frame.data, frame.identifier > 0x7FF)
        while self.monitor.acks:
            self.commander.acknowledge(self.monitor.acks.pop(0), now_s)

    def _end(self, now_s: float) -> tuple[str, int] | None:
        options = self._options
        if self.interrupted:
            word = "Ctrl-C" if self.interrupted == signal.SIGINT else "SIGTERM"
            return word, 128 + self.interrupted
        if self.link.lost:
            return self.link.lost, verdict.NO_PEER
        if options.silence and now_s - self._heard_s > options.silence:
            return f"no frame for {options.silence:g} s", verdict.NO_PEER
        if options.time and now_s >= options.time:
            return "time over", verdict.CLEAN
        return None

    def _note(self) -> str:
        if self.commander.outcomes:
            last = self.commander.outcomes[-1]
            return f"last command: {last.command}: {last.result}"
        return ""

    def run(self) -> verdict.Verdict:
        while True:
            now_s = self.elapsed_s()
            self._take(now_s)
            if self.monitor.frames or now_s > QUIET_S:
                self.commander.poll(now_s)
            ended = self._end(now_s)
            if ended is not None:
                break
            self._table.poll(self.monitor, now_s, self._note())
            time.sleep(PAUSE_S)
        if not self.link.lost:
            self.commander.release()
        self.link.close()
        self._take(self.elapsed_s())
        self.commander.give_up()
        allowed = verdict.parse_tolerated(self._options.tolerate)
        return verdict.judge(self.monitor, self.commander, self.link, allowed, ended[0], now_s, ended[1])


def _say(text: str) -> None:
    print(f"bench.py: {text}", file=sys.stderr, flush=True)


def _database(options: argparse.Namespace) -> Database:
    if options.dbc:
        return Database(options.dbc)
    return from_model(options.klingel, options.model, options.dbc_option)


def _write_json(path: str, told: verdict.Verdict, session: Session) -> None:
    outcomes = [{"command": str(outcome.command), "result": outcome.result, "round_trip_s": outcome.round_trip_s,
                 "run_state": outcome.run_state, "step": outcome.step} for outcome in session.commander.outcomes]
    messages = {record.message.name: {"frames": record.count, "cycle_s": record.message.cycle_s,
                                      "mean_s": record.mean_s() if record.intervals else None,
                                      "jitter_s": record.jitter_s() if record.intervals else None,
                                      "worst_s": record.worst_s, "lost": record.lost, "late": record.late}
                for record in session.monitor.records.values() if record.count}
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"ended": told.ended, "elapsed_s": told.elapsed_s, "frames": session.monitor.frames,
                   "counts": told.counts, "failed": told.failed, "exit_status": told.exit_status,
                   "commands": outcomes, "messages": messages}, file, indent=1)


def _leave_files(options: argparse.Namespace, told: verdict.Verdict, session: Session,
                 panels: list[picture.Panel]) -> int:
    """Picture and JSON; a file that cannot be written is not a clean end."""
    status = told.exit_status
    try:
        if options.json:
            _write_json(options.json, told, session)
        if panels and session.monitor.frames:
            vehicle = pathlib.Path(options.model or options.dbc).stem
            picture.draw(session.monitor, panels, options.plot, f"Klingel: {vehicle} on {session.link.address}")
            print(f"picture: {options.plot}")
    except (OSError, ValueError) as error:
        _say(str(error))
        status = status or verdict.NOT_CLEAN
    return status


def _check(made: argparse.ArgumentParser, options: argparse.Namespace) -> Address:
    if bool(options.dbc) == bool(options.model):
        made.error("give either --dbc or --model")
    if options.plot and options.plot_rate <= 0:
        made.error("--plot-rate must be above 0")
    try:
        verdict.parse_tolerated(options.tolerate)
        return Address.parse(options.bus, options.channel)
    except ValueError as error:
        made.error(str(error))


def main(arguments: list[str] | None = None) -> int:
    made = parser()
    options = made.parse_args(arguments)
    address = _check(made, options)
    stop = threading.Event()
    signals: list[int] = []

    def on_signal(number: int, _frame: object) -> None:
        signals.append(number)
        stop.set()
        if session is not None:
            session.interrupted = number
        if len(signals) > 2:  # somebody means it
            sys.exit(128 + number)

    session: Session | None = None
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    try:
        database = _database(options)
        panels = picture.choose(database, options.signals) if options.plot else []
        log = Log(options.log, address.channel)
    except (DatabaseError, ValueError, OSError) as error:
        _say(str(error))
        return verdict.USAGE
    try:
        link = Link(address, open_bus(address, options.wait, _say, stop))
    except TransportError as error:
        _say(str(error))
        log.close()
        return 128 + signals[0] if signals else verdict.NO_PEER
    session = Session(options, database, link, log)
    session.interrupted = signals[0] if signals else 0
    if panels:
        picture.keep_samples(session.monitor, panels, 1.0 / options.plot_rate)
    try:
        told = session.run()
    finally:
        log.close()
    print(told.text(), flush=True)
    return _leave_files(options, told, session, panels)
