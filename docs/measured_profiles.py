#!/usr/bin/python3
"""Measures S1002 and UIC60 with a scatter that is known, smooths the points, and compares contact, creep coefficients and
conicity with those of the profiles themselves: prints the figures of docs/contact_geometry.md.

usage: docs/measured_profiles.py [--klingel build/klingel] [--seeds 24] [--scatter 10] [--spacing 0.1,0.2,0.5]
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import io
import math
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
AMPLITUDE_MM = 3.0
MODEL = """
name: measured
step_ns: 1000000
gravity_m_s2: 9.81
acceleration_limit_m_s2: 1.0
bodies: []
wheelsets:
  - {{name: axle, mass_kg: 1400, inertia_roll_kgm2: 750, inertia_spin_kgm2: 100, inertia_yaw_kgm2: 750, x_m: 0, load_N: 106e3,
     pair: p, creep: {{law: she, friction: 0.3}}}}
pairs:
  - name: p
    contacts: rigid
    wheel: {{profile: {{file: wheel.txt, axes: inboard_down, units: mm, smoothing_mm: {smoothing}}}, radius_m: 0.46, flange_back_m: 1.36}}
    rail: {{profile: {{file: rail.txt, axes: inboard_down, units: mm, smoothing_mm: {smoothing}}}, cant_1_in: 40, gauge_m: 1.435}}
    step_m: 0.0001
    range_m: 0.006
"""
Points = list[tuple[float, float]]


def profiles(spacing_mm: float) -> tuple[Points, Points]:
    spec = importlib.util.spec_from_file_location("generate", ROOT / "models/profiles/generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    generate.SPACING_MM = spacing_mm
    return generate.s1002_points(), generate.uic60_points()


def measured(points: Points, scatter_mm: float, chance: random.Random) -> Points:
    """Every point moved along the normal."""
    result = []
    for i, (x, z) in enumerate(points):
        a, b = points[max(i - 1, 0)], points[min(i + 1, len(points) - 1)]
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        off = chance.gauss(0.0, scatter_mm)
        result.append((x - off * (b[1] - a[1]) / length, z + off * (b[0] - a[0]) / length))
    return result


def kalker() -> list[tuple[float, float, float]]:
    text = (ROOT / "tests/reference/kalker.csv").read_text()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return sorted((float(r["a_over_b"]), float(r["c11"]), float(r["c22"])) for r in rows
                  if r["kind"] == "line" and float(r["poisson"]) == 0.28)


def coefficients(table: list[tuple[float, float, float]], a: float, b: float) -> tuple[float, float]:
    """f11 and f22 over G, at 1 N; C11 and C22 linear in min(a/b, b/a) between the lines of Kalker's table."""
    bent = lambda ratio: ratio if ratio <= 1 else 2 - 1 / ratio
    at = bent(min(max(a / b, table[0][0]), table[-1][0]))
    k = next(i for i in range(1, len(table)) if at <= bent(table[i][0]) + 1e-12)
    low, high = bent(table[k - 1][0]), bent(table[k][0])
    t = (at - low) / (high - low)
    return tuple(a * b * (table[k - 1][i] + t * (table[k][i] - table[k - 1][i])) for i in (1, 2))


def solved(program: pathlib.Path, folder: pathlib.Path, wheel: Points, rail: Points, smoothing_mm: float):
    for name, points in (("wheel.txt", wheel), ("rail.txt", rail)):
        (folder / name).write_text("".join(f"{x:.6f} {z:.6f}\n" for x, z in points))
    model = folder / "model.yaml"
    model.write_text(MODEL.format(smoothing=smoothing_mm))

    def rows(*arguments: str) -> list[dict[str, str]]:
        done = subprocess.run([str(program), *arguments], capture_output=True, text=True, check=True)
        return list(csv.DictReader(line for line in io.StringIO(done.stdout) if not line.startswith("#")))
    geometry = [row for row in rows("geometry", str(model), "--csv") if 0.45e-3 < abs(float(row["u_y_m"])) < 4.55e-3]
    conicity = rows("conicity", str(model), "--from", str(AMPLITUDE_MM), "--to", str(AMPLITUDE_MM), "--csv")
    return geometry, float(conicity[-1]["conicity"])


def mean_square(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values))


def study(program: pathlib.Path, spacing: float, scatter_um: float, seeds: int) -> None:
    table = kalker()
    number = lambda row, key: float(row[key])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        exact, exact_conicity = solved(program, folder, *profiles(0.1), 0.0)
        wheel, rail = profiles(spacing)
        place, radius, f11, f22, conicity = [], [], [], [], []
        for seed in range(seeds):
            chance = random.Random(1000 + seed)
            found, tan_gamma = solved(program, folder, measured(wheel, 1e-3 * scatter_um, chance),
                                      measured(rail, 1e-3 * scatter_um, chance), 1.5e-3 * scatter_um)
            conicity.append(tan_gamma - exact_conicity)
            for got, want in zip(found, exact):
                place.append(1e3 * (number(got, "eta_wheel_right_m") - number(want, "eta_wheel_right_m")))
                radius.append(1e3 * ((number(got, "radius_right_m") - number(got, "radius_left_m"))
                                     - (number(want, "radius_right_m") - number(want, "radius_left_m"))))
                pair = [coefficients(table, number(r, "semi_a_at_1N_right_m"), number(r, "semi_b_at_1N_right_m")) for r in (got, want)]
                f11.append(pair[0][0] / pair[1][0] - 1)
                f22.append(pair[0][1] / pair[1][1] - 1)
    print(f"{spacing:7.1f} {mean_square(place):14.2f} {max(map(abs, place)):8.2f} {mean_square(radius):12.3f}"
          f" {100 * mean_square(f11):8.0f} {100 * mean_square(f22):6.0f} {mean_square(conicity):12.3f}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--klingel", default="build/klingel", type=pathlib.Path, help="default: build/klingel")
    parser.add_argument("--seeds", default=24, type=int, help="measurements of each kind; default: 24")
    parser.add_argument("--scatter", default=10.0, type=float, help="of the points, um; default: 10")
    parser.add_argument("--spacing", default="0.1,0.2,0.5", help="of the points, mm; default: 0.1,0.2,0.5")
    arguments = parser.parse_args()
    print(f"points scatter by {arguments.scatter:g} um; {arguments.seeds} measurements; errors for 0.5 to 4.5 mm to both sides")
    print("spacing   contact, mm: rms     max   radii, mm   f11, %  f22, %   conicity")
    for spacing in arguments.spacing.split(","):
        study(arguments.klingel.resolve(), float(spacing), arguments.scatter, arguments.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
