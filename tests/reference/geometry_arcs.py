#!/usr/bin/python3
"""Wheel-rail geometry of circular arcs: the full solution of Wickens' tangency equations (2-11).

Method: the four contact slopes and the ten equations are reduced to four unknowns (slope of the right and of the left
wheel at its contact, roll, vertical displacement), solved by Newton-Raphson in 50-digit decimal arithmetic with its own
sine and cosine, so that every printed digit is exact. Derivatives with respect to u_y come from the implicit function
theorem on the same four equations. Writes geometry_arcs.csv and geometry_arcs_linear.csv.

For comparison the same wheelset turned as a rigid body, without the small-roll approximation of equations 2-11: the centre
of the wheel's circle stays at the distance R_wheel - R_rail from the centre of the rail's circle on both sides. Writes
geometry_arcs_rotated.csv.
"""

from __future__ import annotations

import decimal
import functools
import math
from decimal import Decimal as D

import refcsv

decimal.getcontext().prec = 50

R0 = D("0.4500")
L = D("0.7452")
DELTA0 = D("0.0493")
R_WHEEL = D("0.01795") * L / DELTA0
R_RAIL = D("0.00989") * L / DELTA0


def sin_cos(x: D) -> tuple[D, D]:
    """Taylor series; |x| is below 0.5 here."""
    sine, cosine, term, n = D(0), D(0), D(1), 0
    while abs(term) > D("1e-60") or n < 4:
        if n % 2 == 0:
            cosine += term if n % 4 == 0 else -term
        else:
            sine += term if n % 4 == 1 else -term
        n += 1
        term = term * x / n
    return sine, cosine


SIN0, COS0 = sin_cos(DELTA0)


def solve_linear(matrix: list[list[D]], right: list[D]) -> list[D]:
    """Gauss with partial pivoting."""
    n = len(right)
    rows = [row[:] + [value] for row, value in zip(matrix, right)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(n):
            if i != k:
                factor = rows[i][k] / rows[k][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


def residual(u_y: D, x: list[D]) -> tuple[list[D], list[list[D]]]:
    """Lateral and vertical equation of the right and of the left side, and their Jacobian.
    x = wheel slope right, wheel slope left, phi, u_z."""
    values, jacobian = [], []
    for side, s in enumerate((D(1), D(-1))):
        slope_w, phi_s, u_z = x[side], s * x[2], x[3]
        sin_w, cos_w = sin_cos(slope_w)
        sin_r, cos_r = sin_cos(slope_w - phi_s)
        eta_w, zeta_w = R_WHEEL * (sin_w - SIN0), R_WHEEL * (COS0 - cos_w)
        eta_r, zeta_r = R_RAIL * (sin_r - SIN0), R_RAIL * (COS0 - cos_r)
        values += [s * u_y - R0 * phi_s - eta_w + eta_r, u_z + L * phi_s + zeta_w - zeta_r]
        lateral, vertical = [D(0)] * 4, [D(0)] * 4
        lateral[side] = -R_WHEEL * cos_w + R_RAIL * cos_r
        lateral[2] = s * (-R0 - R_RAIL * cos_r)
        vertical[side] = R_WHEEL * sin_w - R_RAIL * sin_r
        vertical[2] = s * (L + R_RAIL * sin_r)
        vertical[3] = D(1)
        jacobian += [lateral, vertical]
    return values, jacobian


@functools.lru_cache(maxsize=None)
def solve(u_y: D) -> tuple[D, ...]:
    x = [DELTA0, DELTA0, D(0), D(0)]
    for _ in range(60):
        values, jacobian = residual(u_y, x)
        step = solve_linear(jacobian, [-v for v in values])
        x = [a + b for a, b in zip(x, step)]
        if max(map(abs, step)) < D("1e-45"):
            return tuple(x)
    raise ArithmeticError(f"no convergence at u_y = {u_y} m")


def first_derivative(u_y: D) -> list[D]:
    """d/du_y of the four unknowns."""
    _, jacobian = residual(u_y, list(solve(u_y)))
    return solve_linear(jacobian, [D(-1), D(0), D(1), D(0)])


def second_derivative(u_y: D) -> list[D]:
    """Central difference of the first derivative, extrapolated once; exact to about 25 digits here."""
    def difference(h: D) -> list[D]:
        return [(a - b) / (2 * h) for a, b in zip(first_derivative(u_y + h), first_derivative(u_y - h))]
    coarse, fine = difference(D("2e-8")), difference(D("1e-8"))
    return [(4 * b - a) / 3 for a, b in zip(coarse, fine)]


def row(u_y: D) -> list[float]:
    x = solve(u_y)
    first, second = first_derivative(u_y), second_derivative(u_y)
    cells = [u_y, x[3], x[2], first[2], first[3], second[2], second[3]]
    for side, s in enumerate((D(1), D(-1))):
        slope_w, slope_r = x[side], x[side] - s * x[2]
        sin_w, cos_w = sin_cos(slope_w)
        sin_r, cos_r = sin_cos(slope_r)
        eta_w, zeta_w = R_WHEEL * (sin_w - SIN0), R_WHEEL * (COS0 - cos_w)
        eta_r, zeta_r = R_RAIL * (sin_r - SIN0), R_RAIL * (COS0 - cos_r)
        cells += [slope_w, slope_r, eta_w, eta_r, zeta_w, zeta_r, R0 + zeta_w, L - eta_w]
    return [float(c) for c in cells]


def linear_rows() -> list[tuple[str, float, str]]:
    """The small-displacement formulas (eq. 16-34), and the same by differentiating the full solution."""
    bracket = 1 - R0 * DELTA0 / L
    difference = (R_WHEEL - R_RAIL) * bracket
    epsilon = L * (1 + R_WHEEL * DELTA0 / L) / difference
    epsilon_star = L * (1 + R_RAIL * DELTA0 / L) / difference
    conicity = DELTA0 * R_WHEEL * (1 + R_RAIL * DELTA0 / L) / difference
    first, second = first_derivative(D(0)), second_derivative(D(0))
    exact_epsilon_star = L * (first[0] - first[1]) / 2
    exact_epsilon = L * ((first[0] - first[2]) - (first[1] + first[2])) / 2
    exact_conicity = R_WHEEL * SIN0 * (first[0] - first[1]) / 2
    rows = [
        ("R_wheel_m", R_WHEEL, "given"),
        ("R_rail_m", R_RAIL, "given"),
        ("epsilon_rail", epsilon, "formula"),
        ("epsilon_wheel", epsilon_star, "formula"),
        ("conicity", conicity, "formula"),
        ("phi_y_rad_m", -DELTA0 / L / bracket, "formula"),
        ("z_yy_1_m", -(R_WHEEL - R_RAIL) * epsilon**2 / L**2, "formula that takes epsilon_wheel for epsilon_rail"),
        ("z_yy_1_m", -(R_WHEEL * epsilon_star**2 - R_RAIL * epsilon**2) / L**2, "formula without that step"),
        ("epsilon_rail", exact_epsilon, "derivative of the full solution"),
        ("epsilon_wheel", exact_epsilon_star, "derivative of the full solution"),
        ("conicity", exact_conicity, "derivative of the full solution"),
        ("phi_y_rad_m", first[2], "derivative of the full solution"),
        ("z_yy_1_m", second[3], "derivative of the full solution"),
        ("sigma", -L * first[2] * bracket, "derivative of the full solution"),
    ]
    return [(name, float(value), origin) for name, value, origin in rows]


def rotated_constraints(u_y: D, u_z: D, phi: D) -> list[tuple[D, tuple[D, D, D], D]]:
    """Per side: squared distance of the circles' centres minus its due, the gradient (u_y, u_z, phi), sin of the rail's slope."""
    sine, cosine = sin_cos(phi)
    gap, sides = R_WHEEL - R_RAIL, []
    for s in (D(1), D(-1)):
        arm, drop = s * (L + R_WHEEL * SIN0), R0 + R_WHEEL * COS0
        y, z = u_y + cosine * arm - sine * drop, u_z + sine * arm + cosine * drop
        dy, dz = y - s * (L + R_RAIL * SIN0), z - (R0 + R_RAIL * COS0)
        turn = dy * (-sine * arm - cosine * drop) + dz * (cosine * arm - sine * drop)
        sides.append((dy * dy + dz * dz - gap * gap, (2 * dy, 2 * dz, 2 * turn), s * dy / gap))
    return sides


def rotated_row(u_y: D) -> list[float]:
    u_z, phi = D("-4.5") * u_y * u_y, D("-0.068") * u_y
    for _ in range(60):
        sides = rotated_constraints(u_y, u_z, phi)
        step = solve_linear([[g[1], g[2]] for _, g, _ in sides], [-f for f, _, _ in sides])
        u_z, phi = u_z + step[0], phi + step[1]
        if max(map(abs, step)) < D("1e-45"):
            break
    sides = rotated_constraints(u_y, u_z, phi)
    z_y, phi_y = solve_linear([[g[1], g[2]] for _, g, _ in sides], [-g[0] for _, g, _ in sides])
    cells = [float(v) for v in (u_y, u_z, phi, phi_y, z_y)]
    for s, (_, _, sine_rail) in zip((1, -1), sides):
        slope_rail = math.asin(float(sine_rail))
        slope_wheel = slope_rail + s * float(phi)
        cells += [slope_wheel, slope_rail, float(R0) + float(R_WHEEL) * (math.cos(float(DELTA0)) - math.cos(slope_wheel))]
    return cells


def generate() -> dict[str, refcsv.Table]:
    given = f"arcs: r0 {R0} m, l {L} m, delta0 {DELTA0} rad, R_wheel 0.01795 l/delta0, R_rail 0.00989 l/delta0"
    columns = ["u_y_m", "u_z_m", "phi_rad", "phi_y_rad_m", "z_y", "phi_yy_rad_m2", "z_yy_1_m"]
    for side in ("right", "left"):
        columns += [f"{q}_{side}{unit}" for q, unit in (
            ("delta_wheel", "_rad"), ("delta_rail", "_rad"), ("eta_wheel", "_m"), ("eta_rail", "_m"),
            ("zeta_wheel", "_m"), ("zeta_rail", "_m"), ("radius", "_m"), ("arm", "_m"))]
    steps = [D(k) / 4 for k in range(-32, 33)]
    full = refcsv.Table(
        [given, "full solution of the tangency equations; per side eta inboard, zeta down; arm = l - eta_wheel"],
        columns, [row(u / 1000) for u in steps], digits=16, rel=1e-14, abs_of_max=0.0)
    linear = refcsv.Table([given, "small-displacement parameters"], ["name", "value", "origin"], linear_rows(),
                          digits=16, rel=1e-14, abs_of_max=0.0)
    columns = ["u_y_m", "u_z_m", "phi_rad", "phi_y_rad_m", "z_y"]
    columns += [f"{q}_{side}{unit}" for side in ("right", "left") for q, unit in (("delta_wheel", "_rad"), ("delta_rail", "_rad"), ("radius", "_m"))]
    rotated = refcsv.Table([given, "the same contact with the wheelset turned as a rigid body (no small-roll approximation)"],
                           columns, [rotated_row(D(k) / 1000) for k in range(-8, 9)], digits=13, rel=1e-11, abs_of_max=1e-14)
    return {"geometry_arcs.csv": full, "geometry_arcs_linear.csv": linear, "geometry_arcs_rotated.csv": rotated}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
