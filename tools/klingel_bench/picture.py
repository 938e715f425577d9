"""The picture: chosen signals over time, one panel per group, the curve shaded behind them."""

from __future__ import annotations

import dataclasses
import fnmatch
import math

from .database import Database
from .monitor import Monitor

CURVATURE = ("VehicleTrack", "Curvature")
DEFAULT_GROUPS = (("Speed", "VehicleMotion.Speed"), ("Wheelset, lateral displacement", "Wheelset*Motion.Y"),
                  ("Wheel load Q", "Wheel*Forces.Q"), ("Lateral force Y of the wheel on the rail", "Wheel*Forces.Y"))
# Told apart by people who see colours differently (Okabe and Ito); left wheels are a paler shade of the right ones.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999933")
PALE = 0.5
# What stands at the axis; other signals show their own name.
QUANTITIES = {"Speed": "speed", "Curvature": "curvature", "Y": "y", "Q": "Q"}


@dataclasses.dataclass
class Curve:
    message: str
    signal: str
    label: str
    unit: str
    scale: float


@dataclasses.dataclass
class Panel:
    title: str
    curves: list[Curve]


def _label(message: str, signal: str) -> str:
    """`Wheel1RForces.Q` reads `wheelset 1 right`."""
    head = message
    for tail in ("Motion", "Forces", "Creep", "Contact", "Spin", "Posture", "Position", "Rates"):
        head = head.removesuffix(tail)
    for kind, text in (("Wheelset", "wheelset"), ("Wheel", "wheelset"), ("Body", "body")):
        number = head.removeprefix(kind)
        if head.startswith(kind) and number[:1].isdigit():
            side = {"R": " right", "L": " left"}.get(number[-1], "")
            return f"{text} {number.rstrip('RL')}{side}"
    return f"{message} {signal}"


def choose(database: Database, groups: list[str] | None) -> list[Panel]:
    """Panels from patterns such as `Wheel*Forces.Q,VehicleMotion.Speed`. ValueError: a pattern that fits nothing."""
    wanted = [(None, text) for text in groups] if groups else list(DEFAULT_GROUPS)
    panels = []
    for title, text in wanted:
        curves = []
        for pattern in text.split(","):
            found = [Curve(message.name, signal.name, _label(message.name, signal.name), signal.unit, signal.scale)
                     for message in database.by_id.values() for signal in message.signals.values()
                     if fnmatch.fnmatchcase(f"{message.name}.{signal.name}", pattern.strip())]
            if not found and groups:
                raise ValueError(f"no signal is called '{pattern.strip()}'")
            curves += found
        if curves:
            names = list(dict.fromkeys(curve.signal for curve in curves))
            panels.append(Panel(title or ", ".join(names), curves))
    return panels


def keep_samples(monitor: Monitor, panels: list[Panel], spacing_s: float) -> None:
    names = {curve.message for panel in panels for curve in panel.curves}
    if CURVATURE[0] in monitor.database.by_name:
        names.add(CURVATURE[0])
    for name in names:
        monitor.keep(name, spacing_s)


class _Series:
    """Decodes each message's samples once."""

    def __init__(self, monitor: Monitor):
        self._monitor = monitor
        self._decoded: dict[str, tuple[list[float], list[dict[str, float | str]]]] = {}

    def get(self, message: str, signal: str, scale: float) -> tuple[list[float], list[float]]:
        if message not in self._decoded:
            record = self._monitor.of(message)
            samples = record.samples
            times = [time - self._monitor.first_time for time in samples.times] if samples else []
            self._decoded[message] = (times, [record.message.decode(data) for data in samples.data] if samples else [])
        times, rows = self._decoded[message]
        values = [row[signal] for row in rows]
        return times, [value * scale if isinstance(value, float) else math.nan for value in values]


def _shade(axes, times: list[float], curvature: list[float]) -> None:
    """Grey behind the panel, as dark as the curve is tight."""
    import numpy as np

    strength = np.nan_to_num(np.abs(np.asarray(curvature)))
    if len(times) < 2 or strength.max() < 1e-6:
        return
    grid = np.linspace(times[0], times[-1], 1000)
    image = np.interp(grid, times, strength / strength.max())[np.newaxis, :]
    low, high = axes.get_ylim()
    axes.imshow(image, extent=(times[0], times[-1], low, high), aspect="auto", cmap="Greys", vmin=0, vmax=6,
                interpolation="bilinear", zorder=0)
    axes.set_ylim(low, high)


def _pale(colour: str) -> tuple[float, ...]:
    return tuple(PALE + (1 - PALE) * int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5))


def _axis_label(panel: Panel) -> str:
    def unique(items):
        return ", ".join(dict.fromkeys(item for item in items if item))

    units = unique(curve.unit for curve in panel.curves)
    force = units == "kN"  # Y is a displacement or a force: capital letters are forces
    names = unique(curve.signal if force else QUANTITIES.get(curve.signal, curve.signal) for curve in panel.curves)
    return f"{names} [{units}]" if units else names


def _draw_panel(axes, panel: Panel, series: _Series) -> None:
    colours: dict[str, str] = {}
    for curve in panel.curves:
        stem = curve.label.removesuffix(" right").removesuffix(" left")
        colour = colours.setdefault(stem, COLOURS[len(colours) % len(COLOURS)])
        times, values = series.get(curve.message, curve.signal, curve.scale)
        left = curve.label.endswith(" left")
        axes.plot(times, values, label=curve.label, color=_pale(colour) if left else colour,
                  linewidth=1.0, zorder=2 if left else 3)
    axes.set_ylabel(_axis_label(panel))
    axes.set_title(panel.title, loc="left", fontsize=10)
    axes.grid(True, color="#DDDDDD", linewidth=0.6, zorder=1)
    axes.margins(x=0, y=0.08)
    low, high = axes.get_ylim()
    if high - low < 1e-3 * max(abs(low), abs(high)):  # a constant is a straight line, not its last digit blown up
        axes.set_ylim(min(0.0, 1.15 * low), max(0.0, 1.15 * high))
    if len(panel.curves) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.005, 1.0), fontsize=8, frameon=False, borderaxespad=0.0)


def _draw_curvature(axes, times: list[float], curvature: list[float]) -> None:
    right = axes.twinx()
    right.plot(times, [1e3 * value for value in curvature], color="#777777", linewidth=1.0)
    right.set_ylabel("curvature [1/km]", color="#555555")
    right.tick_params(axis="y", colors="#555555")
    right.margins(x=0, y=0.25)
    right.spines["top"].set_visible(False)


def draw(monitor: Monitor, panels: list[Panel], path: str, title: str) -> None:
    """Writes the file. Raises OSError or ValueError where matplotlib cannot."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    series = _Series(monitor)
    figure, rows = plt.subplots(len(panels), 1, sharex=True, squeeze=False, layout="constrained",
                                figsize=(11, 1.2 + 2.1 * len(panels)))
    times, curvature = series.get(*CURVATURE, 1.0) if CURVATURE[0] in monitor.database.by_name else ([], [])
    for number, (axes, panel) in enumerate(zip(rows[:, 0], panels)):
        _draw_panel(axes, panel, series)
        axes.spines[["top", "right"]].set_visible(False)
        _shade(axes, times, curvature)
        if number == 0 and any(value for value in curvature if not math.isnan(value)):
            _draw_curvature(axes, times, curvature)
            axes.set_title(f"{panel.title}, and curvature of the track (grey: in the curve)", loc="left", fontsize=10)
    rows[-1, 0].set_xlabel("time [s]")
    rows[-1, 0].set_xlim(left=0.0)
    figure.suptitle(title, x=0.01, ha="left", fontsize=12)
    try:
        figure.savefig(path, dpi=130)
    finally:
        plt.close(figure)
