#!/usr/bin/python3
"""Motion of one elastically restrained wheelset on the arcs of geometry_arcs.csv, and its steady state in a curve.

Method: the Newton-Euler equations of the wheelset as they stand. Unknown at every instant are the accelerations of all
five freedoms that occur (y, z, roll, yaw, spin) and the two normal forces; five equations of motion and the two contact
constraints, differentiated twice, form one linear 7 x 7 system. The creep forces depend on the normal forces; the system
is solved again until they agree. The contact geometry is solved afresh by Newton-Raphson at every evaluation (no
table). Time integration: DOP853, relative tolerance 1e-12. Writes wheelset_run.csv and wheelset_curve.csv.

Equations (x forward, y right, z down; r right, l left; delta the slope of the rail at the contact, arm = l - eta_wheel):
  m (y'' + kappa V^2 - g phi0) = -k_y y - N_r sin d_r + N_l sin d_l + T2_r cos d_r + T2_l cos d_l
  m z''                        = m g + load - N_r cos d_r - N_l cos d_l - T2_r sin d_r + T2_l sin d_l
  I_x phi'' + I_y Omega (psi' + kappa V) = sum over wheels of (side arm F_z - r F_y)
  I_z psi'' - I_y Omega phi'   = -k_psi psi - arm_r T1_r + arm_l T1_l + M3_r cos d_r + M3_l cos d_l
  -I_y Omega'                  = r_r T1_r + r_l T1_l
Creepages: gamma1 = (V (1 - s arm kappa) - s arm psi' - r Omega) / V, gamma2 = (y' - r phi' - V psi) / (V cos d),
omega3 = ((psi' + kappa V) cos d - s Omega sin d) / V.
Laws: "linear" has constant f11..f33 and no limit; "she" has G c^2 C11 .. G c^4 C33 from Hertz and Kalker at the actual normal
force, A = cos d / (2 r), B = (1/R_rail - 1/R_wheel) / 2, and the Shen-Hedrick-Elkins reduction of T1, T2 and M3 alike.
"""

from __future__ import annotations

import dataclasses
import math

import geometry_arcs
import hertz_kalker
import numpy as np
import refcsv
from scipy import integrate, optimize

R0, L, DELTA0 = float(geometry_arcs.R0), float(geometry_arcs.L), float(geometry_arcs.DELTA0)
R_WHEEL, R_RAIL = float(geometry_arcs.R_WHEEL), float(geometry_arcs.R_RAIL)
G = 9.81
MASS, I_ROLL, I_SPIN, I_YAW = 1250.0, 700.0, 100.0, 700.0
LOAD = 1e5 - MASS * G  # 50 kN per wheel
K_Y, K_PSI = 1e6, 1e6
MU = 0.3
CONSTANT = (7.44e6, 6.79e6, 13.7e3, 20.0)  # f11 N, f22 N, f23 N m, f33 N m^2
SPEED = 30.0
LAWS = ("linear", "she")


@dataclasses.dataclass
class Contact:
    """One side's contact."""

    s: float
    radius: float
    arm: float
    sine: float
    cosine: float
    unit: tuple[float, float, float, float]  # f11..f33 at 1 N


@dataclasses.dataclass
class Geometry:
    phi: float
    z: float
    phi_y: float
    z_y: float
    phi_yy: float
    z_yy: float
    contacts: tuple[Contact, Contact]


def geometry(y: float) -> Geometry:
    """Newton-Raphson on the four equations, then the implicit function theorem twice. The first guess of a solution
    does not matter for the result beyond rounding."""
    x = np.array([DELTA0 + 8.55 * y, DELTA0 - 8.55 * y, -0.0682 * y, -4.37 * y * y])
    for _ in range(30):
        value, jacobian, _ = _equations(y, x)
        step = np.linalg.solve(jacobian, -value)
        x = x + step
        if np.max(np.abs(step)) < 1e-15:
            break
    _, jacobian, hessian = _equations(y, x)
    first = np.linalg.solve(jacobian, [-1.0, 0.0, 1.0, 0.0])
    second = np.linalg.solve(jacobian, -np.array([first @ h @ first for h in hessian]))
    contacts = []
    for side, s in enumerate((1.0, -1.0)):
        slope_w = x[side]
        slope_r = slope_w - s * x[2]
        radius = R0 + R_WHEEL * (math.cos(DELTA0) - math.cos(slope_w))
        arm = L - R_WHEEL * (math.sin(slope_w) - math.sin(DELTA0))
        contacts.append(Contact(s, radius, arm, math.sin(slope_r), math.cos(slope_r), _unit_load(radius, slope_r)))
    return Geometry(x[2], x[3], first[2], first[3], second[2], second[3], (contacts[0], contacts[1]))


def _equations(y: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    value, jacobian, hessian = np.zeros(4), np.zeros((4, 4)), [np.zeros((4, 4)) for _ in range(4)]
    for side, s in enumerate((1.0, -1.0)):
        w, phi_s = x[side], s * x[2]
        r = w - phi_s
        value[2 * side] = s * y - R0 * phi_s - R_WHEEL * (math.sin(w) - math.sin(DELTA0)) + R_RAIL * (math.sin(r) - math.sin(DELTA0))
        value[2 * side + 1] = x[3] + L * phi_s + R_WHEEL * (math.cos(DELTA0) - math.cos(w)) - R_RAIL * (math.cos(DELTA0) - math.cos(r))
        to_r = np.zeros(4)  # gradient of the rail's slope
        to_r[side], to_r[2] = 1.0, -s
        to_w = np.zeros(4)
        to_w[side] = 1.0
        jacobian[2 * side] = -R_WHEEL * math.cos(w) * to_w + R_RAIL * math.cos(r) * to_r
        jacobian[2 * side, 2] += -R0 * s
        jacobian[2 * side + 1] = R_WHEEL * math.sin(w) * to_w - R_RAIL * math.sin(r) * to_r
        jacobian[2 * side + 1, 2] += L * s
        jacobian[2 * side + 1, 3] += 1.0
        hessian[2 * side] = R_WHEEL * math.sin(w) * np.outer(to_w, to_w) - R_RAIL * math.sin(r) * np.outer(to_r, to_r)
        hessian[2 * side + 1] = R_WHEEL * math.cos(w) * np.outer(to_w, to_w) - R_RAIL * math.cos(r) * np.outer(to_r, to_r)
    return value, jacobian, hessian


def _unit_load(radius: float, slope: float) -> tuple[float, float, float, float]:
    A, B = math.cos(slope) / (2 * radius), (1 / R_RAIL - 1 / R_WHEEL) / 2
    a, b = hertz_kalker.hertz(A, B, hertz_kalker.SHEAR_MODULUS, hertz_kalker.POISSON)
    c = hertz_kalker.kalker(a / b, hertz_kalker.POISSON)
    gcc, size = hertz_kalker.SHEAR_MODULUS * a * b, math.sqrt(a * b)
    return gcc * c.c11, gcc * c.c22, gcc * size * c.c23, gcc * size**2 * c.c33


def creep_force(law: str, contact: Contact, normal: float, gamma: tuple[float, float, float]) -> tuple[float, float, float]:
    """T1, T2, M3 on the wheel."""
    if law == "linear":
        f11, f22, f23, f33 = CONSTANT
    else:
        n = max(normal, 0.0)
        f11, f22 = contact.unit[0] * n ** (2 / 3), contact.unit[1] * n ** (2 / 3)
        f23, f33 = contact.unit[2] * n, contact.unit[3] * n ** (4 / 3)
    t1, t2 = -f11 * gamma[0], -f22 * gamma[1] - f23 * gamma[2]
    m3 = f23 * gamma[1] - f33 * gamma[2]
    if law == "linear":
        return t1, t2, m3
    limit, demand = MU * max(normal, 0.0), math.hypot(t1, t2)
    if demand == 0.0:
        return t1, t2, m3
    u = demand / limit
    reached = limit * (u - u * u / 3 + u**3 / 27) if u < 3 else limit
    return t1 * reached / demand, t2 * reached / demand, m3 * reached / demand


@dataclasses.dataclass
class Instant:
    """Accelerations and forces at one instant; lists are right, left."""

    y_acc: float
    psi_acc: float
    spin_acc: float
    normal: list[float]
    t1: list[float]
    t2: list[float]
    m3: list[float]
    geometry: Geometry


def instant(state: np.ndarray, law: str, kappa: float = 0.0, cant: float = 0.0, arm_with_roll: bool = False) -> Instant:
    y, y_rate, psi, psi_rate, spin = state
    g = geometry(y)
    phi_rate = g.phi_y * y_rate
    creepages = []
    for c in g.contacts:
        gamma1 = (SPEED * (1 - c.s * c.arm * kappa) - c.s * c.arm * psi_rate - c.radius * spin) / SPEED
        gamma2 = (y_rate - c.radius * phi_rate - SPEED * psi) / (SPEED * c.cosine)
        omega3 = ((psi_rate + kappa * SPEED) * c.cosine - c.s * spin * c.sine) / SPEED
        creepages.append((gamma1, gamma2, omega3))
    # unknowns: y'', z'', phi'', psi'', Omega', N_r, N_l
    matrix = np.zeros((7, 7))
    matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[3, 3], matrix[4, 4] = MASS, MASS, I_ROLL, I_YAW, -I_SPIN
    matrix[5, 0], matrix[5, 1] = -g.z_y, 1.0
    matrix[6, 0], matrix[6, 2] = -g.phi_y, 1.0
    arms = [c.arm - (c.s * c.radius * g.phi if arm_with_roll else 0.0) for c in g.contacts]
    for k, c in enumerate(g.contacts):
        f_y, f_z = -c.s * c.sine, -c.cosine
        matrix[0, 5 + k], matrix[1, 5 + k] = -f_y, -f_z
        matrix[2, 5 + k] = -(c.s * arms[k] * f_z - c.radius * f_y)
    normal = [LOAD / 2 + MASS * G / 2] * 2
    for _ in range(200):
        right = np.array([
            -K_Y * y - MASS * (kappa * SPEED**2 - G * cant),
            MASS * G + LOAD,
            -I_SPIN * spin * (psi_rate + kappa * SPEED),
            -K_PSI * psi + I_SPIN * spin * phi_rate,
            0.0,
            g.z_yy * y_rate**2,
            g.phi_yy * y_rate**2])
        forces = [creep_force(law, c, n, gamma) for c, n, gamma in zip(g.contacts, normal, creepages)]
        for k, (c, (t1, t2, m3)) in enumerate(zip(g.contacts, forces)):
            right[0] += t2 * c.cosine
            right[1] += -c.s * t2 * c.sine
            right[2] += -arms[k] * t2 * c.sine - c.radius * t2 * c.cosine
            right[3] += -c.s * c.arm * t1 + m3 * c.cosine
            right[4] += c.radius * t1
        solution = np.linalg.solve(matrix, right)
        change = max(abs(solution[5] - normal[0]), abs(solution[6] - normal[1]))
        normal = [float(solution[5]), float(solution[6])]
        if change < 1e-7:  # N
            break
    else:
        raise ArithmeticError("normal and creep forces do not agree")
    t1s, t2s, m3s = ([f[i] for f in forces] for i in range(3))
    return Instant(solution[0], solution[3], solution[4], normal, t1s, t2s, m3s, g)


def rates(_: float, state: np.ndarray, law: str, kappa: float, cant: float) -> np.ndarray:
    i = instant(state, law, kappa, cant)
    return np.array([state[1], i.y_acc, state[3], i.psi_acc, i.spin_acc])


def run(law: str, times: np.ndarray, tolerance: float = 1e-12) -> np.ndarray:
    start = np.array([3e-3, 0.0, 0.0, 0.0, SPEED / R0])
    # a bound per freedom: y, y', psi, psi', Omega
    absolute = tolerance * np.array([1e-3, 0.1, 1e-3, 0.1, 60.0])
    result = integrate.solve_ivp(rates, (times[0], times[-1]), start, "DOP853", times, args=(law, 0.0, 0.0),
                                 rtol=tolerance, atol=absolute, max_step=1e-3)
    if not result.success:
        raise ArithmeticError(result.message)
    return result.y.T


def output_row(state: np.ndarray, i: Instant) -> list[float]:
    return [float(v) for v in (state[0], state[2], state[1], state[3], state[4], *i.normal, *i.t1, *i.t2)]


def run_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = []
    times = np.arange(0, 1001) / 1000.0
    for law in LAWS:
        for t, state in zip(times, run(law, times)):
            rows.append([law, float(t), *output_row(state, instant(state, law))])
    return rows


CURVES = [(1 / 500, 0.1), (1 / 500, 0.0), (-1 / 500, -0.1), (0.0, 0.02), (0.0, 0.0)]


def steady(law: str, kappa: float, cant: float) -> np.ndarray:
    """y, psi, Omega at which all accelerations are zero, by Powell's hybrid method from a scaled start."""
    scale = np.array([1e-3, 1e-3, 1e-2])

    def residual(q: np.ndarray) -> np.ndarray:
        y, psi, slip = q * scale
        i = instant(np.array([y, 0.0, psi, 0.0, SPEED / R0 * (1 + slip)]), law, kappa, cant)
        return np.array([i.y_acc * MASS, i.psi_acc * I_YAW, i.spin_acc * I_SPIN]) / 1e3
    result = optimize.root(residual, np.array([-kappa * 500.0, 0.0, 0.0]), method="hybr", options={"xtol": 1e-14})
    if np.max(np.abs(residual(result.x))) > 1e-8:
        raise ArithmeticError(f"no steady state for {law}, kappa {kappa}")
    y, psi, slip = result.x * scale
    return np.array([y, 0.0, psi, 0.0, SPEED / R0 * (1 + slip)])


def curve_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = []
    for law in LAWS:
        for kappa, cant in CURVES:
            state = steady(law, kappa, cant)
            i = instant(state, law, kappa, cant)
            rows.append([law, kappa, cant, *(output_row(state, i)[k] for k in (0, 1, 4)), i.geometry.z, i.geometry.phi,
                         *i.normal, *i.t1, *i.t2, *i.m3])
    return rows


def generate() -> dict[str, refcsv.Table]:
    f11, f22, f23, f33 = CONSTANT
    given = [
        f"arcs of geometry_arcs.csv; m {MASS} kg, I_roll {I_ROLL}, I_spin {I_SPIN}, I_yaw {I_YAW} kg m2, dead load {LOAD} N, g {G} m/s2",
        f"ground springs at the axle: k_y {K_Y} N/m, k_psi {K_PSI} N m/rad (none in z and roll, no dampers); V {SPEED} m/s, no torque",
        f"linear: f11 {f11} N, f22 {f22} N, f23 {f23} N m, f33 {f33} N m2, constant, no limit",
        f"she: Hertz and Kalker (G {hertz_kalker.SHEAR_MODULUS} Pa, nu {hertz_kalker.POISSON}), mu {MU}, Shen-Hedrick-Elkins",
    ]
    state = ["y_m", "psi_rad", "y_rate_m_s", "psi_rate_rad_s", "spin_rad_s"]
    forces = ["N_right_N", "N_left_N", "T1_right_N", "T1_left_N", "T2_right_N", "T2_left_N"]
    runs = refcsv.Table(given + ["straight track, start y 3 mm, Omega V/r0, all else 0"], ["law", "t_s"] + state + forces,
                        run_rows(), digits=10, rel=1e-8, abs_of_max=1e-9)
    curves = refcsv.Table(
        given + ["steady state in a curve, all rates and accelerations 0; kappa > 0 right-hand, cant > 0 right rail lower"],
        ["law", "kappa_1_m", "cant_rad", "y_m", "psi_rad", "spin_rad_s", "z_m", "phi_rad"] + forces + ["M3_right_Nm", "M3_left_Nm"],
        curve_rows(), digits=10, rel=1e-8, abs_of_max=1e-9)
    return {"wheelset_run.csv": runs, "wheelset_curve.csv": curves}


if __name__ == "__main__":
    refcsv.main(__doc__, generate)
