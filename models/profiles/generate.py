#!/usr/bin/env python3
"""Writes the wheel and rail profiles of this folder from their definitions.

s1002.csv  S1002 wheel, EN 13715: polynomials and arcs over the distance S from the tape line
           (70 mm from the flange back), height positive towards the flange tip.
uic60.csv  UIC60 (60E1) rail head, UIC 861-3 / EN 13674-1: tangent arcs of 300, 80 and 13 mm.

Coordinates written: eta_mm grows inboard (towards flange and gauge corner), zeta_mm grows down.
"""
import argparse
import bisect
import math
import pathlib
import sys

SPACING_MM = 0.25  # of neighbouring points along the curve

# ---- S1002: (S from, S to, height(S)), from the field side to the flange ----

_TREAD = (0.0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8,
          -1.562379023e-8, 5.309217349e-15, -5.957839843e-12, 2.646656573e-13)
_THROAT = (-4.320221063e3, -1.038384026e3, -1.065501873e2, -6.051367875, -2.054332446e-1,
           -4.169739389e-3, -4.687195829e-5, -2.252755540e-7)


def _polynomial(coefficients):
    def height(s):
        value = 0.0
        for c in reversed(coefficients):
            value = value * s + c
        return value
    return height


S1002 = [
    (60.0, 32.15796, _polynomial((1.364323640, -0.066666667))),
    (32.15796, -26.0, _polynomial(_TREAD)),
    (-26.0, -35.0, _polynomial(_THROAT)),
    (-35.0, -38.426669071, lambda s: 16.446 - math.sqrt(13.0**2 - (s + 26.210665)**2)),
    (-38.426669071, -39.764473993, lambda s: -93.576667419 - 2.747477419 * s),
    (-39.764473993, -49.662510381, lambda s: 8.834924130 + math.sqrt(20.0**2 - (s + 58.558326413)**2)),
]
S1002_END = -49.662510381  # end of the flange arc: beyond it the contact would be on the tip

# ---- UIC60: arcs (radius, centre y, centre height below the top, from y, to y), one half ----

UIC60_JOINS = (10.52, 25.98)
UIC60_RADII = (300.0, 80.0, 13.0)
UIC60_END = math.radians(84.0)  # the slope may still grow by a cant of 1:20 and stay below 87 degrees


def uic60_arcs():
    """Each arc touches the one before: its centre lies on the normal at the join."""
    arcs = []
    y_centre, z_centre, start = 0.0, UIC60_RADII[0], 0.0
    for i, radius in enumerate(UIC60_RADII):
        if i < len(UIC60_JOINS):
            end = UIC60_JOINS[i]
        else:
            end = y_centre + radius * math.sin(UIC60_END)
        arcs.append((radius, y_centre, z_centre, start, end))
        if i + 1 < len(UIC60_RADII):
            sine = (end - y_centre) / radius
            step = radius - UIC60_RADII[i + 1]
            y_centre += step * sine
            z_centre -= step * math.sqrt(1.0 - sine * sine)
            start = end
    return arcs


# ---- points at equal distances along the curve ----

def _walk(height, start, end):
    """Points of one piece, both ends included, at most SPACING_MM apart along the curve."""
    fine = 4000
    at = [start + (end - start) * i / fine for i in range(fine + 1)]
    z = [height(x) for x in at]
    length = [0.0]
    for i in range(fine):
        length.append(length[-1] + math.hypot(at[i + 1] - at[i], z[i + 1] - z[i]))
    n = max(1, math.ceil(length[-1] / SPACING_MM - 1e-6))
    points = []
    for k in range(n + 1):
        want = length[-1] * k / n
        i = min(max(bisect.bisect_left(length, want), 1), fine)
        share = (want - length[i - 1]) / (length[i] - length[i - 1])
        x = at[i - 1] + share * (at[i] - at[i - 1])
        if k in (0, n):
            x = (start, end)[k > 0]
        x = round(x, 6)  # the height is exact for the printed place
        points.append((x, height(x)))
    return points


def s1002_points():
    points = []
    for start, end, height in S1002:
        piece = _walk(height, start, max(end, S1002_END))
        points += piece if not points else piece[1:]
    return [(-s, z) for s, z in points]


def uic60_points():
    half = []
    for radius, y0, z0, start, end in uic60_arcs():
        def depth(y, radius=radius, y0=y0, z0=z0):
            return z0 - math.sqrt(radius**2 - (y - y0)**2)
        piece = _walk(depth, start, end)
        half += piece if not half else piece[1:]
    return [(-y, z) for y, z in reversed(half[1:])] + half


# ---- self-check of the definitions ----

def joins():
    """(name, step of the value in mm, step of the slope) at every join, by one-sided differences."""
    result = []
    for (_, s, left), (_, _, right) in zip(S1002, S1002[1:]):
        h = 1e-4
        slope_left = (-3.0 * left(s) + 4.0 * left(s + h) - left(s + 2.0 * h)) / (2.0 * h)
        slope_right = (3.0 * right(s) - 4.0 * right(s - h) + right(s - 2.0 * h)) / (2.0 * h)
        result.append((f"S1002 S = {s}", right(s) - left(s), slope_right - slope_left))
    arcs = uic60_arcs()
    for (ra, ya, za, _, y), (rb, yb, zb, _, _) in zip(arcs, arcs[1:]):
        depth = [z - math.sqrt(r * r - (y - c)**2) for r, c, z in ((ra, ya, za), (rb, yb, zb))]
        slope = [(y - c) / math.sqrt(r * r - (y - c)**2) for r, c in ((ra, ya), (rb, yb))]
        result.append((f"UIC60 y = {y}", depth[1] - depth[0], slope[1] - slope[0]))
    return result


HEADS = {
    "s1002.csv": (s1002_points, """\
# S1002 wheel, from the definition in EN 13715; written by generate.py, do not edit.
# eta = 0 is the tape line, 70 mm from the flange back; inboard (towards the flange) positive.
# zeta is positive down (towards the flange tip).
"""),
    "uic60.csv": (uic60_points, """\
# UIC60 (60E1) rail head, from the arcs in UIC 861-3 / EN 13674-1; written by generate.py, do not edit.
# Upright rail: the cant (1:40, 1:20) is applied by whoever uses the profile.
# eta = 0 is the middle of the head; inboard (towards the gauge corner) positive. zeta is positive down.
"""),
}


def render(name):
    points, head = HEADS[name]
    rows = "".join(f"{eta + 0.0:.6f},{zeta + 0.0:.9f}\n" for eta, zeta in points())
    return head + "eta_mm,zeta_mm\n" + rows


def main() -> int:
    parser = argparse.ArgumentParser(description="Write the profiles from their definitions.")
    parser.add_argument("--check", action="store_true",
                        help="write nothing; fail if a file differs or a join is not smooth")
    arguments = parser.parse_args()
    folder = pathlib.Path(__file__).resolve().parent
    bad = 0
    for name, value, slope in joins():
        smooth = abs(value) < 2e-4 and abs(slope) < 2e-5  # what the printed digits of EN 13715 allow
        bad += not smooth
        if not smooth or arguments.check:
            print(f"{name}: step {value:+.1e} mm, slope {slope:+.1e}{'' if smooth else '  NOT SMOOTH'}")
    for name in HEADS:
        text = render(name)
        path = folder / name
        if not arguments.check:
            path.write_text(text, encoding="ascii")
        elif not path.exists() or path.read_text(encoding="ascii") != text:
            print(f"{name}: differs from what generate.py writes")
            bad += 1
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
