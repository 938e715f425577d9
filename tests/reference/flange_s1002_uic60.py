#!/usr/bin/python3
"""The flange of an S1002 wheel on the gauge face of a UIC60 rail canted 1:40, as the wheel rides up.

Profiles and track are those of geometry_s1002_uic60.py, from their definitions. The wheelset is a rigid body: displaced
by y, lowered by u_z and rolled by phi (all from the central posture) the point S of the right wheel is at
    p = y + arm cos(phi) - drop sin(phi),   z = u_z + u_0 + drop cos(phi) + arm sin(phi) - r0
with arm = 750 mm + S and drop = r0 + depth(S); the gap of a point is the rail's depth at p less z. The flange is the part
of the wheel that is within 10 degrees of its steepest (70 degrees), the tread all outboard of it; the ride height of a
wheel is H = u_z + l phi (right), u_z - l phi (left), l the arm of the central contact. Yaw is 0. Rows:
  touch  where the flange meets the rail while both wheels stand on their treads: three least gaps are 0, unknowns y,
         u_z and phi
  climb  the left wheel stays at its height of `touch`, the right one rides at H: the flange's least gap is 0, unknown y
Writes flange_s1002_uic60.csv.
"""

from __future__ import annotations

import math

import numpy as np
import refcsv
from geometry_s1002_uic60 import NOMINAL_RADIUS, TAPE_ARM, central, rail, wheel
from scipy import optimize

FLANGE_SLOPE = math.tan(math.atan(2.747477419) - 0.175)
HEIGHTS = (-1.2, -1.5, -2.0, -3.0, -4.0, -5.0, -6.0, -8.0, -10.0, -12.0, -14.0, -16.0, -18.0, -20.0, -22.0)  # mm

GRID = np.arange(-60.0, 55.0, 0.005)
DEPTH, SLOPE = wheel(GRID)
EDGE = float(GRID[np.flatnonzero(-SLOPE >= FLANGE_SLOPE)].max())  # where the flange begins
TREAD = np.flatnonzero(GRID > EDGE)
FLANGE = np.flatnonzero(GRID <= EDGE)
LEVER, RISE = central().p, central().height


def gap_at(s: np.ndarray, depth: np.ndarray, y: float, u_z: float, phi: float) -> np.ndarray:
    cosine, sine = math.cos(phi), math.sin(phi)
    arm, drop = TAPE_ARM + s, NOMINAL_RADIUS + depth
    p = y + arm * cosine - drop * sine
    return rail().at(p)[0] - (u_z + RISE + drop * cosine + arm * sine - NOMINAL_RADIUS)


def least_gap(part: np.ndarray, y: float, u_z: float, phi: float) -> tuple[float, float]:
    """Least gap of a part of the right wheel, and where."""
    gaps = gap_at(GRID[part], DEPTH[part], y, u_z, phi)
    k = int(np.argmin(gaps))
    low, high = GRID[part[max(k - 1, 0)]], GRID[part[min(k + 1, len(part) - 1)]]
    one = lambda s: float(gap_at(np.array(s), wheel(np.array(s))[0], y, u_z, phi))
    found = optimize.minimize_scalar(one, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
    return min((float(found.fun), float(found.x)), (float(gaps[k]), float(GRID[part[k]])))


def row(kind: str, y: float, u_z: float, phi: float) -> list[float | str]:
    _, s = least_gap(FLANGE, y, u_z, phi)
    arm, drop = TAPE_ARM + s, NOMINAL_RADIUS + float(wheel(np.array(s))[0])
    p = y + arm * math.cos(phi) - drop * math.sin(phi)
    angle = -math.atan(float(rail().at(np.array(p))[1]))
    return [kind, (u_z + LEVER * phi) / 1e3, (u_z - LEVER * phi) / 1e3, y / 1e3, phi, s / 1e3, angle, drop / 1e3]


def generate() -> dict[str, refcsv.Table]:
    def gaps(x: np.ndarray) -> list[float]:
        y, u_z, phi = float(x[0]), float(x[1]), float(x[2]) / LEVER
        return [least_gap(TREAD, y, u_z, phi)[0], least_gap(TREAD, -y, u_z, -phi)[0], least_gap(FLANGE, y, u_z, phi)[0]]
    found = optimize.root(gaps, [6.2, -0.5, -0.55], method="hybr", options={"xtol": 1e-10, "eps": 1e-5})
    if max(abs(g) for g in gaps(found.x)) > 1e-6:
        raise ArithmeticError(f"no touch: {found.x}, {gaps(found.x)}")
    y, u_z, phi = float(found.x[0]), float(found.x[1]), float(found.x[2]) / LEVER
    rows = [row("touch", y, u_z, phi)]
    across = u_z - LEVER * phi
    for height in HEIGHTS:
        u_z, phi = (height + across) / 2, (height - across) / (2 * LEVER)
        y = optimize.brentq(lambda q: least_gap(FLANGE, q, u_z, phi)[0], 5.0, 17.0, xtol=1e-10)
        rows.append(row("climb", y, u_z, phi))
    columns = ["kind", "height_right_m", "height_left_m", "y_m", "phi_rad", "s_wheel_m", "delta_rail_rad", "radius_m"]
    table = refcsv.Table(
        ["S1002 wheel, UIC60 rail 1:40, gauge 1435 mm at 14 mm, flange-back distance 1360 mm, r0 460 mm at 70 mm from the flange back",
         f"the flange begins at s_wheel {EDGE / 1e3:.6f} m (from the tape circle, outboard positive); l {LEVER / 1e3:.9f} m",
         "heights: positive down, 0 when central"],
        columns, rows, digits=9, rel=2e-5, abs_of_max=2e-6)
    return {"flange_s1002_uic60.csv": table}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
