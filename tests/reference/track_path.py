#!/usr/bin/python3
"""Curvature, heading and path of transition curves.

Method: curvature and its two integrals in closed form per ramp shape; the path X = int cos(heading) ds, Y = int
sin(heading) ds by adaptive Gauss-Kronrod quadrature (scipy.integrate.quad) over every metre, and for the clothoid that
starts the track also by Fresnel's integrals. The half-sine ramp is the cosine itself. Writes track_path.csv.

Shapes, with t from 0 to 1 over the ramp: linear t (clothoid), bloss 3 t^2 - 2 t^3, half_sine (1 - cos pi t) / 2.
heading = int kappa ds, offset = int int kappa ds ds, both from s = 0; X forward, Y to the right.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import refcsv
from scipy import integrate, special


@dataclasses.dataclass(frozen=True)
class Ramp:
    shape: str
    length: float
    to: float


# the value of the shape, its first and its second integral from 0 to t
SHAPES = {
    "constant": (lambda t: 0.0, lambda t: 0.0, lambda t: 0.0),
    "linear": (lambda t: t, lambda t: t**2 / 2, lambda t: t**3 / 6),
    "bloss": (lambda t: 3 * t**2 - 2 * t**3, lambda t: t**3 - t**4 / 2, lambda t: t**4 / 4 - t**5 / 10),
    "half_sine": (lambda t: (1 - math.cos(math.pi * t)) / 2,
                  lambda t: t / 2 - math.sin(math.pi * t) / (2 * math.pi),
                  lambda t: t**2 / 4 - (1 - math.cos(math.pi * t)) / (2 * math.pi**2)),
}

TRACKS = {
    "clothoid": [Ramp("linear", 80.0, 1 / 500)],
    "bloss": [Ramp("bloss", 80.0, 1 / 500)],
    "half_sine": [Ramp("half_sine", 80.0, 1 / 500)],
    "sharp_clothoid": [Ramp("linear", 200.0, -0.0195)],
    "curve": [Ramp("constant", 30.0, 0.0), Ramp("linear", 60.0, 1 / 400), Ramp("constant", 100.0, 0.0), Ramp("bloss", 60.0, 0.0)],
    "s_curve": [Ramp("constant", 20.0, 0.0), Ramp("half_sine", 50.0, 1 / 300), Ramp("constant", 40.0, 0.0), Ramp("linear", 60.0, -1 / 350),
                Ramp("constant", 50.0, 0.0), Ramp("bloss", 40.0, -1 / 800)],
}


def at(track: list[Ramp], s: float) -> tuple[float, float, float]:
    """Curvature, heading, offset; beyond the last ramp the curvature stays."""
    start, value, first, second = 0.0, 0.0, 0.0, 0.0
    for ramp in [*track, Ramp("constant", math.inf, 0.0)]:
        step = 0.0 if ramp.shape == "constant" else ramp.to - value
        x = min(s - start, ramp.length)
        f, f1, f2 = (shape(x / ramp.length) if step else 0.0 for shape in SHAPES[ramp.shape])
        scale = ramp.length if step else 0.0
        here = (value + step * f, first + value * x + step * scale * f1, second + first * x + value * x * x / 2 + step * scale**2 * f2)
        if s <= start + ramp.length:
            return here
        start += ramp.length
        value, first, second = here
    raise ArithmeticError("unreachable")


def clothoid_path(s: float, ramp: Ramp) -> tuple[float, float]:
    """Fresnel: heading = s^2 to / (2 L)."""
    rate = abs(ramp.to) / ramp.length
    scale = math.sqrt(math.pi / rate)
    sine, cosine = special.fresnel(s / scale)
    return scale * float(cosine), math.copysign(scale * float(sine), ramp.to)


def rows() -> list[list[float | str]]:
    table: list[list[float | str]] = []
    for name, track in TRACKS.items():
        end = sum(ramp.length for ramp in track) + 40.0
        x = y = 0.0
        for s in np.arange(0.0, end + 0.5):
            s = float(s)
            if s > 0:
                x += integrate.quad(lambda q: math.cos(at(track, q)[1]), s - 1, s, epsabs=1e-13, epsrel=1e-13)[0]
                y += integrate.quad(lambda q: math.sin(at(track, q)[1]), s - 1, s, epsabs=1e-13, epsrel=1e-13)[0]
            if track[0].shape == "linear" and s <= track[0].length:
                exact = clothoid_path(s, track[0])
                if math.hypot(x - exact[0], y - exact[1]) > 1e-11:
                    raise ArithmeticError(f"quadrature and Fresnel differ at {name}, s {s}")
            if s % 5 == 0:
                table.append([name, s, *at(track, s), x, y])
    return table


def describe(track: list[Ramp]) -> str:
    return "; ".join(f"{r.shape} {r.length:g} m" + ("" if r.shape == "constant" else f" to {r.to!r} 1/m") for r in track)


def generate() -> dict[str, refcsv.Table]:
    comments = ["tracks as lists of curvature ramps from s = 0, curvature 0 before the first; heading 0, X = Y = 0 at s = 0"]
    comments += [f"{name}: {describe(track)}" for name, track in TRACKS.items()]
    return {"track_path.csv": refcsv.Table(comments, ["track", "s_m", "kappa_1_m", "heading_rad", "offset_m", "X_m", "Y_m"], rows(),
                                           digits=15, rel=1e-12, abs_of_max=1e-12)}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
