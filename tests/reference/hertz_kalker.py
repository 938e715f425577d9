#!/usr/bin/python3
"""Hertz ellipses and Kalker's creep coefficients.

Method: the two equilibrium conditions of the Hertzian ellipse are written with Carlson's symmetric elliptic integral
R_D (scipy.special.elliprd), the ratio of the axes is found by Brent's method, the size from the load; no modulus, no
arithmetic-geometric mean. Every row is verified against direct quadrature of the defining integrals. Kalker's
coefficients are the table's figures, linear between its ratios and quadratic (Lagrange) in Poisson's ratio.
Writes hertz.csv and kalker.csv.
"""

from __future__ import annotations

import dataclasses
import math

import refcsv
from scipy import integrate, optimize, special

MIN_RATIO = 0.1  # the range of Kalker's table; beyond it the smaller of A and B is raised
SHEAR_MODULUS, POISSON = 82e9, 0.28

# J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, table E.3. g = smaller axis / larger axis;
# columns: C11, C22, C23 each for nu = 0, 1/4, 1/2, then C33 (tabulated for nu = 1/4 alone).
TABLE_A_BELOW_B = """
0.1 2.51 3.31 4.85 2.51 2.52 2.53 0.334 0.473 0.731 8.28
0.2 2.59 3.37 4.81 2.59 2.63 2.66 0.483 0.603 0.809 4.27
0.3 2.68 3.44 4.80 2.68 2.75 2.81 0.607 0.715 0.889 2.96
0.4 2.78 3.53 4.82 2.78 2.88 2.98 0.720 0.823 0.977 2.32
0.5 2.88 3.62 4.83 2.88 3.01 3.14 0.827 0.929 1.07 1.93
0.6 2.98 3.72 4.91 2.98 3.14 3.31 0.930 1.03 1.18 1.68
0.7 3.09 3.81 4.97 3.09 3.28 3.48 1.03 1.14 1.29 1.50
0.8 3.19 3.91 5.05 3.19 3.41 3.65 1.13 1.25 1.40 1.37
0.9 3.29 4.01 5.12 3.29 3.54 3.82 1.23 1.36 1.51 1.27
1.0 3.40 4.12 5.20 3.40 3.67 3.98 1.33 1.47 1.63 1.19
"""
TABLE_A_ABOVE_B = """
1.0 3.40 4.12 5.20 3.40 3.67 3.98 1.33 1.47 1.63 1.19
0.9 3.51 4.22 5.30 3.51 3.81 4.16 1.44 1.59 1.77 1.11
0.8 3.65 4.36 5.42 3.65 3.99 4.39 1.58 1.75 1.94 1.04
0.7 3.82 4.54 5.58 3.82 4.21 4.67 1.76 1.95 2.18 0.965
0.6 4.06 4.78 5.80 4.06 4.50 5.04 2.01 2.23 2.50 0.892
0.5 4.37 5.10 6.11 4.37 4.90 5.56 2.35 2.62 2.96 0.819
0.4 4.84 5.57 6.57 4.84 5.48 6.31 2.88 3.24 3.70 0.747
0.3 5.57 6.34 7.34 5.57 6.40 7.51 3.79 4.32 5.01 0.674
0.2 6.96 7.78 8.82 6.96 8.14 9.79 5.72 6.63 7.89 0.601
0.1 10.7 11.7 12.9 10.7 12.8 16.0 12.2 14.6 18.0 0.526
"""


def _rows(text: str) -> list[list[float]]:
    return sorted([float(v) for v in line.split()] for line in text.split("\n") if line)


ROWS_BELOW, ROWS_ABOVE = _rows(TABLE_A_BELOW_B), _rows(TABLE_A_ABOVE_B)


@dataclasses.dataclass
class Kalker:
    c11: float
    c22: float
    c23: float
    c33: float


def kalker(a_over_b: float, poisson: float) -> Kalker:
    """Linear in g = min(a/b, b/a) between the table's lines, quadratic in nu through 0, 1/4, 1/2."""
    ratio = min(max(a_over_b, 0.1), 10.0)
    nu = min(max(poisson, 0.0), 0.5)
    rows, g = (ROWS_BELOW, ratio) if ratio <= 1 else (ROWS_ABOVE, 1 / ratio)
    k = next(i for i in range(len(rows) - 1) if g <= rows[i + 1][0] + 1e-12)
    t = (g - rows[k][0]) / (rows[k + 1][0] - rows[k][0])
    line = [(1 - t) * p + t * q for p, q in zip(rows[k], rows[k + 1])]
    weights = (8 * (nu - 0.25) * (nu - 0.5), -16 * nu * (nu - 0.5), 8 * nu * (nu - 0.25))
    c11, c22, c23 = (sum(w * line[1 + 3 * j + i] for i, w in enumerate(weights)) for j in range(3))
    return Kalker(c11, c22, c23, line[10])


def _moment(own: float, other: float) -> float:
    """int_0^inf dt / ((own^2 + t)^1.5 (other^2 + t)^0.5 t^0.5) = 2/3 R_D(0, other^2, own^2): the curvature, along the
    axis `own`, of the potential of a Hertzian pressure, up to a common factor."""
    return 2 / 3 * float(special.elliprd(0.0, other**2, own**2))


def curvature_ratio(a_over_b: float) -> float:
    """A/B of an ellipse with the given a/b."""
    return _moment(a_over_b, 1.0) / _moment(1.0, a_over_b)


def hertz(A: float, B: float, modulus: float, poisson: float, least: float = MIN_RATIO) -> tuple[float, float]:
    """Semi-axes at 1 N, a along A's direction. Deflection of two equal half-spaces under p = p0 sqrt(1 - x^2/a^2 - y^2/b^2):
    u = (3 N / 4 pi E*) (M0 - M(a) x^2 - M(b) y^2), so A = 3 N M(a) / (4 pi E*), with E* = G / (1 - nu)."""
    lowest, highest = curvature_ratio(1 / least), curvature_ratio(least)
    A, B = max(A, B * lowest), max(B, A / highest)
    log_ratio = optimize.brentq(lambda q: math.log(curvature_ratio(math.exp(q)) * B / A),
                                math.log(least) - 1e-9, -math.log(least) + 1e-9, xtol=1e-15, rtol=1e-14)
    g = math.exp(log_ratio)
    e_star = modulus / (1 - poisson)
    b = (3 * _moment(g, 1.0) / (4 * math.pi * e_star * A)) ** (1 / 3)  # M scales with length^-3
    return g * b, b


def approach(A: float, B: float, modulus: float, poisson: float) -> float:
    """Of the two bodies at 1 N, for any ratio: 3 N M0 / (4 pi E*), M0 = 2 R_F(a^2, b^2, 0)."""
    a, b = hertz(A, B, modulus, poisson, least=1e-4)
    return 3 * (1 - poisson) / (4 * math.pi * modulus) * 2 * float(special.elliprf(a * a, b * b, 0))


def verify(A: float, B: float, a: float, b: float, modulus: float, poisson: float) -> float:
    """Largest relative error of the two Hertz conditions at 1 N, by quadrature over t = b^2 tan^2(theta)."""
    def integral(own: float, other: float) -> float:
        def f(theta: float) -> float:
            c, s = math.cos(theta), math.sin(theta)
            return 2 * c * c / ((own**2 * c * c + s * s) ** 1.5 * (other**2 * c * c + s * s) ** 0.5)
        return integrate.quad(f, 0, math.pi / 2, epsabs=0, epsrel=1e-12, limit=400)[0]
    factor = 3 * (1 - poisson) / (4 * math.pi * modulus)
    size = math.sqrt(a * b)
    p, q = a / size, b / size
    return max(abs(factor * integral(p, q) / size**3 / A - 1), abs(factor * integral(q, p) / size**3 / B - 1))


def hertz_rows() -> list[list[float | str]]:
    cases = [("check 8 x 4 mm", 0.8464, 2.406, SHEAR_MODULUS, POISSON)]
    cases += [("spread", 1.0, curvature, SHEAR_MODULUS, POISSON) for curvature in
              (0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0, 1.1, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0)]
    cases += [("size", 1.1, 1.5, SHEAR_MODULUS, POISSON), ("size", 11.0, 15.0, SHEAR_MODULUS, POISSON),
              ("size", 1.1, 200e-3, SHEAR_MODULUS, POISSON)]
    cases += [("material", 1.1, 1.5, 70e9, 0.25), ("material", 1.1, 1.5, 82e9, 0.0), ("material", 1.1, 1.5, 82e9, 0.5)]
    cases += [("limited", 1.0, 1e-3, SHEAR_MODULUS, POISSON), ("limited", 1.0, 1e3, SHEAR_MODULUS, POISSON)]
    rows: list[list[float | str]] = []
    for kind, A, B, modulus, nu in cases:
        a, b = hertz(A, B, modulus, nu)
        if kind != "limited" and verify(A, B, a, b, modulus, nu) > 1e-9:
            raise ArithmeticError(f"Hertz conditions not met for A {A}, B {B}")
        c = kalker(a / b, nu)
        gcc = modulus * a * b
        load = 82e3 ** (1 / 3)
        rows.append([kind, A, B, modulus, nu, a, b, a / b, a * load, b * load, gcc * c.c11, gcc * c.c22,
                     gcc * math.sqrt(a * b) * c.c23, gcc * a * b * c.c33, approach(A, B, modulus, nu)])
    return rows


def kalker_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = []
    points = [("line", g / 10) for g in range(1, 11)] + [("middle", g / 10 + 0.05) for g in range(1, 10)]
    ratios = [(kind, g) for kind, g in points] + [(kind, 1 / g) for kind, g in points if g < 1]
    ratios += [("limited", 0.03), ("limited", 30.0)]
    for kind, ratio in sorted(ratios, key=lambda p: p[1]):
        for nu in (0.0, 0.1, 0.25, 0.28, 0.3, 0.5):
            c = kalker(ratio, nu)
            rows.append([kind, ratio, nu, c.c11, c.c22, c.c23, c.c33])
    return rows


def generate() -> dict[str, refcsv.Table]:
    hertz_table = refcsv.Table(
        ["Hertz: A, B half the relative curvature along and across the rolling direction, a, b the semi-axes",
         "f11_1..f33_1: G c^2 C11, G c^2 C22, G c^3 C23, G c^4 C33 with c = sqrt(a b), at a normal force of 1 N",
         "approach_m_at_1N: of the bodies along the normal, for the curvatures as they are, also where the ellipse is limited"],
        ["kind", "A_1_m", "B_1_m", "shear_modulus_Pa", "poisson", "semi_a_m_at_1N", "semi_b_m_at_1N", "a_over_b",
         "semi_a_m_at_82kN", "semi_b_m_at_82kN", "f11_1", "f22_1", "f23_1", "f33_1", "approach_m_at_1N"],
        hertz_rows(), rel=1e-10, abs_of_max=0.0)
    kalker_table = refcsv.Table(
        ["Kalker's creep coefficients, table E.3 of Kalker 1990; linear in min(a/b, b/a), quadratic in nu; C33 at nu 0.25",
         "kind: line = a line of the table, middle = between two, limited = outside 0.1..10"],
        ["kind", "a_over_b", "poisson", "c11", "c22", "c23", "c33"], kalker_rows(), rel=1e-12, abs_of_max=0.0)
    return {"hertz.csv": hertz_table, "kalker.csv": kalker_table}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
