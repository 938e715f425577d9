#!/usr/bin/python3
"""Eigenvalues of a linear two-axle vehicle and critical speeds of a single restrained wheelset.

Method: the antisymmetric equations of motion are written out by hand, coordinate by coordinate, as in the textbooks
(A. H. Wickens, Fundamentals of Rail Vehicle Dynamics, chapters 3 to 5), and their companion matrix goes to numpy's
eigenvalue routine. Critical speeds are the zeros of the largest real part by Brent's method; the single wheelset's
are compared with the closed formula. Writes two_axle_modes.csv and critical_speeds.csv.

Coordinates: body y, roll, yaw; leading wheelset y, yaw; trailing wheelset y, yaw. The wheelsets are the classic linear
ones (level contact: no roll, no gravitational stiffness, no spin creep): per wheelset
  m y'' + 2 f22 (y'/V - psi) = F_y,   I psi'' + 2 f11 (l^2 psi'/V + l lambda y / r0) = M_z.
Four identical corner elements (springs and dampers in x, y, z) join body and wheelsets at x = +-a, y = +-b, h below the
body's centre of mass. With u = y - h phi +- a psi the body's lateral displacement at the element (roll positive right side
down, centre of mass above the elements), each corner element gives
  lateral       -k_y (u - y_wheelset)            on the body at the element, hence also roll + h and yaw +- a times it
  longitudinal  -k_x b^2 (psi - psi_wheelset)     yaw moment on the body
  vertical      -k_z b^2 phi                      roll moment on the body
and the opposite on the wheelset; dampers likewise.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import refcsv
from scipy import optimize


@dataclasses.dataclass(frozen=True)
class TwoAxle:
    body_mass: float = 22000.0
    body_roll: float = 30000.0
    body_yaw: float = 240000.0
    wheelset_mass: float = 1250.0
    wheelset_yaw: float = 700.0
    half_wheelbase: float = 4.5  # a
    half_spacing: float = 1.0  # b, of the elements
    height: float = 0.9  # h, centre of mass above the elements
    k: tuple[float, float, float] = (1.0e6, 0.4e6, 1.2e6)  # x, y, z per corner, N/m
    c: tuple[float, float, float] = (8e3, 12e3, 25e3)  # N s/m
    f11: float = 7.44e6
    f22: float = 6.79e6
    l: float = 0.7452
    r0: float = 0.45
    conicity: float = 0.1144


@dataclasses.dataclass(frozen=True)
class Single:
    k_y: float
    k_psi: float
    mass: float = 1250.0
    inertia: float = 700.0
    f11: float = 7.44e6
    f22: float = 6.79e6
    l: float = 0.7452
    r0: float = 0.45
    conicity: float = 0.1144


def companion(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    n = len(mass)
    inverse = np.linalg.inv(mass)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])


def suspension(p: TwoAxle, x: float, y: float, z: float) -> np.ndarray:
    """The 7 x 7 matrix of the four corner elements with constants x, y, z each; written out, row by row."""
    a, b, h = p.half_wheelbase, p.half_spacing, p.height
    return np.array([
        # body y  body roll                 body yaw                      y1        yaw1          y2        yaw2
        [4 * y, -4 * y * h, 0, -2 * y, 0, -2 * y, 0],
        [-4 * y * h, 4 * y * h * h + 4 * z * b * b, 0, 2 * y * h, 0, 2 * y * h, 0],
        [0, 0, 4 * y * a * a + 4 * x * b * b, -2 * y * a, -2 * x * b * b, 2 * y * a, -2 * x * b * b],
        [-2 * y, 2 * y * h, -2 * y * a, 2 * y, 0, 0, 0],
        [0, 0, -2 * x * b * b, 0, 2 * x * b * b, 0, 0],
        [-2 * y, 2 * y * h, 2 * y * a, 0, 0, 2 * y, 0],
        [0, 0, -2 * x * b * b, 0, 0, 0, 2 * x * b * b]], dtype=float)


def two_axle_matrix(p: TwoAxle, speed: float) -> np.ndarray:
    mass = np.diag([p.body_mass, p.body_roll, p.body_yaw, p.wheelset_mass, p.wheelset_yaw, p.wheelset_mass, p.wheelset_yaw])
    stiffness, damping = suspension(p, *p.k), suspension(p, *p.c)
    for y in (3, 5):
        yaw = y + 1
        damping[y, y] += 2 * p.f22 / speed
        damping[yaw, yaw] += 2 * p.f11 * p.l**2 / speed
        stiffness[y, yaw] -= 2 * p.f22
        stiffness[yaw, y] += 2 * p.f11 * p.l * p.conicity / p.r0
    return companion(mass, damping, stiffness)


def single_matrix(p: Single, speed: float) -> np.ndarray:
    mass = np.diag([p.mass, p.inertia])
    damping = np.diag([2 * p.f22 / speed, 2 * p.f11 * p.l**2 / speed])
    stiffness = np.array([[p.k_y, -2 * p.f22], [2 * p.f11 * p.l * p.conicity / p.r0, p.k_psi]])
    return companion(mass, damping, stiffness)


def formula(p: Single) -> float:
    """Critical speed of the restrained wheelset in closed form."""
    square = (p.f22 * p.k_psi + p.f11 * p.l**2 * p.k_y) / (p.mass * p.f11 * p.l**2 + p.inertia * p.f22)
    total = (p.k_y * p.k_psi + 4 * p.f11 * p.f22 * p.conicity * p.l / p.r0) / square
    return math.sqrt(4 * p.f11 * p.f22 * p.l**2 / (total + p.mass * p.inertia * square - p.mass * p.k_psi - p.inertia * p.k_y))


def largest_real(matrix: np.ndarray) -> float:
    return float(np.max(np.linalg.eigvals(matrix).real))


def crossings(matrix_at, lowest: float, highest: float) -> list[float]:
    """Speeds at which the largest real part changes sign."""
    grid = np.arange(lowest, highest + 0.25, 0.5)
    values = [largest_real(matrix_at(v)) for v in grid]
    return [float(optimize.brentq(lambda v: largest_real(matrix_at(v)), grid[i], grid[i + 1], xtol=1e-12, rtol=1e-14))
            for i in range(len(grid) - 1) if (values[i] < 0) != (values[i + 1] < 0)]


def frequency_at(matrix: np.ndarray) -> float:
    values = np.linalg.eigvals(matrix)
    return abs(float(values[np.argmax(values.real)].imag)) / (2 * math.pi)


SPEEDS = (5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0)
VARIANTS = {"damped": TwoAxle(), "undamped": TwoAxle(c=(0.0, 0.0, 0.0))}
SINGLES = (Single(0.23e6, 2.5e6), Single(1e6, 1e6), Single(5e6, 0.0), Single(0.0, 5e6))


def mode_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = []
    for name, p in VARIANTS.items():
        for speed in SPEEDS:
            values = sorted(np.linalg.eigvals(two_axle_matrix(p, speed)), key=lambda v: (abs(v), v.imag))
            if len(values) != 14:
                raise ArithmeticError("14 eigenvalues expected")
            for v in values:
                if v.imag >= 0:
                    rows.append([name, speed, float(v.real), float(v.imag), abs(float(v.imag)) / (2 * math.pi), -float(v.real) / abs(v)])
    return rows


def critical_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = []
    for p in SINGLES:
        found = crossings(lambda v: single_matrix(p, v), 1.0, 200.0)
        if len(found) != 1 or abs(found[0] / formula(p) - 1) > 1e-9:
            raise ArithmeticError(f"eigenvalues and formula differ: {found}, {formula(p)}")
        rows.append([f"single wheelset k_y {p.k_y:g} k_psi {p.k_psi:g}", found[0], frequency_at(single_matrix(p, found[0])), formula(p)])
    for name, p in VARIANTS.items():
        for speed in crossings(lambda v: two_axle_matrix(p, v), 1.0, 150.0):
            rows.append([f"two-axle {name}", speed, frequency_at(two_axle_matrix(p, speed)), ""])
    return rows


def generate() -> dict[str, refcsv.Table]:
    p = VARIANTS["damped"]
    given = [
        f"body m {p.body_mass} kg, I_x {p.body_roll}, I_z {p.body_yaw} kg m2; wheelsets m {p.wheelset_mass} kg, I_z {p.wheelset_yaw} kg m2",
        f"wheelsets at x +-{p.half_wheelbase} m; elements at y +-{p.half_spacing} m, {p.height} m below the body's centre of mass",
        "each of the 4 elements: k x y z " + " ".join(f"{v}" for v in p.k) + " N/m; damped: c x y z " + " ".join(f"{v}" for v in p.c) + " N s/m",
        f"linear pair: r0 {p.r0} m, l {p.l} m, conicity {p.conicity}; f11 {p.f11} N, f22 {p.f22} N, f23 = f33 = 0; no gravity",
    ]
    modes = refcsv.Table(
        given + ["eigenvalues with imaginary part >= 0, all of the antisymmetric motion (spin of the axles left out)"],
        ["vehicle", "speed_m_s", "real_1_s", "imag_rad_s", "frequency_Hz", "damping_ratio"], mode_rows(), digits=12, rel=1e-8, abs_of_max=1e-10)
    critical = refcsv.Table(
        given + ["single wheelset: m 1250 kg, I_z 700 kg m2, same pair; formula: the closed form of its critical speed",
                 "two-axle: every speed from 1 to 150 m/s at which the largest real part changes its sign"],
        ["vehicle", "critical_speed_m_s", "frequency_Hz", "formula_m_s"], critical_rows(), digits=12, rel=1e-8, abs_of_max=1e-10)
    return {"two_axle_modes.csv": modes, "critical_speeds.csv": critical}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
