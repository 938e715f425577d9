#!/usr/bin/python3
"""Lets a wheel climb its rail, and compares the creep laws in a wagon: prints the figures of docs/contact.md and draws
its pictures.

usage: docs/contact.py [--klingel build/klingel] [--output FOLDER]
"""

from __future__ import annotations

import argparse
import csv
import io
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))

from klingel_plot import figure  # noqa: E402

LAWS = ("she", "polach", "fastsim", "table")
COLOURS = ("first", "second", "third", "fourth")
RADII = (600, 550, 500, 450, 400, 350, 300)
FRICTION = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
OFFSETS = (0.0, 3.0)  # m ahead of the axle: where the push acts, which turns the axle outwards

# A wheelset on S1002/UIC60 under 120 kN. A weight that knows no other freedom hangs on it at the height of the rails and
# pushes it to the right while cant is run up; a stiff spring holds the yaw.
CLIMB = """
name: climb
step_ns: 1000000
gravity_m_s2: 9.81
acceleration_limit_m_s2: 1.0
bodies:
  - {{name: weight, mass_kg: 68000, inertia_roll_kgm2: 1, inertia_pitch_kgm2: 1, inertia_yaw_kgm2: 1, x_m: 0, height_m: 0,
     freedoms: [y]}}
wheelsets:
  - {{name: axle, mass_kg: 1400, inertia_roll_kgm2: 750, inertia_spin_kgm2: 100, inertia_yaw_kgm2: 750, x_m: 0,
     load_N: 106e3, pair: p, creep: {{law: she, friction: {friction}}}}}
pairs:
  - name: p
    wheel: {{profile: {{points: {root}/models/profiles/s1002.csv}}, radius_m: 0.46, half_spacing_m: 0.75}}
    rail: {{profile: {{points: {root}/models/profiles/uic60.csv}}, cant_1_in: 40, gauge_m: 1.435, gauge_depth_m: 0.014}}
    step_m: 0.0001
    range_m: 0.02
elements:
  - {{name: push, between: [weight, axle], at: {{x_m: {offset}, y_m: 0, height_m: 0}}, k_N_m: [0, 3e6, 0]}}
  - {{name: damp, between: [weight, axle], at: {{x_m: 0, y_m: 0, height_m: 0}}, c_Ns_m: [0, 3e5, 0]}}
  - {{name: hold, between: [axle, ground], at: {{x_m: 0, y_m: 0, height_m: 0}}, k_N_m: [0, 0, 0], c_Ns_m: [0, 2e5, 0],
     k_Nm_rad: [0, 0, 2e7], c_Nms_rad: [0, 0, 2e4]}}
"""
TRACK = """
name: rising_cant
segments:
  - {length_m: 20, shape: constant}
  - {length_m: 500, shape: linear, to_curvature_1_m: 0, to_cant_rad: 0.299}
"""


def panel(row: int, column: int, title: str, x_label: str, y_label: str, items: list[dict]) -> dict:
    return {"row": row, "column": column, "rows": 1, "columns": 1, "title": title, "x_label": x_label, "y_label": y_label,
            "x_range": None, "y_range": None, "equal": False, "y_down": False, "items": items}


def line(x: list[float], y: list[float], label: str | None, colour: str, pen: str = "solid") -> dict:
    return {"kind": "line", "label": label, "colour": colour, "pen": pen, "thin": False, "x": x, "y": y}


def save(path: pathlib.Path, title: str, notes: str, panels: list[dict]) -> None:
    with path.open("wb") as file:
        figure.draw({"klingel_plot": 1, "format": "png", "title": title, "notes": notes, "panels": panels}, file)


def rows_of(program: pathlib.Path, *arguments: str) -> list[dict[str, float]]:
    done = subprocess.run([str(program), *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1) or not done.stdout:  # 1: derailed, which is what the climb is for
        raise RuntimeError(f"{' '.join(arguments)}: {done.stderr}")
    lines = [text for text in done.stdout.splitlines() if not text.startswith("#")]
    keep = lambda text: float(text) if text.replace("-", "").replace("+", "").replace("e", "").replace(".", "").isdigit() else math.nan
    return [{key: keep(value) for key, value in row.items() if value is not None}
            | {key: value for key, value in row.items() if key == "wheelset"}
            for row in csv.DictReader(io.StringIO("\n".join(lines)))]


# ---- the wheel climbs ----

def climb(program: pathlib.Path, folder: pathlib.Path, friction: float, offset: float) -> list[dict[str, float]]:
    model, track = folder / "climb.yaml", folder / "track.yaml"
    model.write_text(CLIMB.format(root=ROOT, friction=friction, offset=offset))
    track.write_text(TRACK)
    return rows_of(program, "run", str(model), str(track), "--speed", "20", "--time", "26", "--every", "2", "--csv")


def smooth(values: list[float], count: int = 10) -> list[float]:
    mean, result = values[0], []
    for value in values:
        mean += (value - mean) / count
        result.append(mean)
    return result


def nadal(friction: float) -> float:
    tangent = math.tan(math.atan(2.747477419) + 0.0028)  # the roll adds 0.16 degrees where it climbs
    return (tangent - friction) / (1 + friction * tangent)


def climbs(program: pathlib.Path, output: pathlib.Path, folder: pathlib.Path) -> None:
    found: dict[float, list[tuple[float, float, float]]] = {offset: [] for offset in OFFSETS}
    shown: list[dict[str, float]] = []
    for offset in OFFSETS:
        for friction in FRICTION:
            rows = climb(program, folder, friction, offset)
            last = max((i for i, r in enumerate(rows) if r["axle_right_rise_m"] < 1e-3), default=0)  # from here on it climbs
            up = [r for r in rows[last:] if 1e-3 <= r["axle_right_rise_m"] <= 4e-3 and r["axle_right_rail_m"] > 0]
            ratio = sum(r["axle_right_Y_N"] for r in up) / max(sum(r["axle_right_Q_N"] for r in up), 1.0)
            found[offset].append((friction, ratio, 1e3 * rows[last]["axle_yaw_rad"]))
            if friction == 0.3 and offset == OFFSETS[-1]:
                shown = rows
    print("friction   Nadal   Y/Q, yaw: pushed at " + "    at ".join(f"{offset:g} m" for offset in OFFSETS))
    for i, friction in enumerate(FRICTION):
        print(f"{friction:8.2f} {nadal(friction):7.3f}   " + "   ".join(
            f"{found[offset][i][1]:5.3f} {found[offset][i][2]:6.1f} mrad" for offset in OFFSETS))
    end = next((i for i, r in enumerate(shown) if r["axle_right_rise_m"] > 0.02), len(shown))
    shown = shown[max(0, end - 5000):end]
    time = [r["time_s"] for r in shown]
    curve = [i / 100 for i in range(0, 56)]
    save(output / "contact_climb.png", "A wheel climbs its rail: S1002 on UIC60, 120 kN, 20 m/s",
         "side force at the height of the rails, growing slowly; forces, rail and Y/Q over time: friction 0.3, yaw 10 mrad",
         [panel(0, 0, "Forces of the climbing wheel", "time [s]", "[kN]",
                [line(time, [1e-3 * r["axle_right_Y_N"] for r in shown], "Y", "first"),
                 line(time, [1e-3 * r["axle_right_Q_N"] for r in shown], "Q", "second"),
                 line(time, [1e-3 * r["axle_right_flange_N"] for r in shown], "N of the flange", "third")]),
          panel(1, 0, "How far the rail gives way, rise of the tread", "time [s]", "[mm]",
                [line(time, [1e3 * r["axle_right_rail_m"] for r in shown], "rail", "first"),
                 line(time, [1e3 * r["axle_right_rise_m"] for r in shown], "rise", "second")]),
          panel(0, 1, "Y/Q", "time [s]", "Y/Q [–]",
                [line(time, smooth([r["axle_right_Y_N"] / max(r["axle_right_Q_N"], 1e3) for r in shown]), None, "ink")]),
          panel(1, 1, "Y/Q while it climbs by 1 to 4 mm, and Nadal's formula", "friction [–]", "Y/Q [–]",
                [line(curve, [nadal(mu) for mu in curve], "Nadal", "ink")]
                + [line([f for f, _, _ in found[o]], [r for _, r, _ in found[o]],
                        f"klingel, yaw {min(p for _, _, p in found[o]):.0f} to {max(p for _, _, p in found[o]):.0f} mrad", c, "points")
                   for o, c in zip(OFFSETS, COLOURS)])])


# ---- creep laws in a curve ----

def curves(program: pathlib.Path, output: pathlib.Path, folder: pathlib.Path) -> None:
    text = (ROOT / "models/two_axle_wagon.yaml").read_text().replace("profiles/", f"{ROOT}/models/profiles/")
    model = folder / "wagon.yaml"
    model.write_text(text + f"\ncreep_table: {{file: {ROOT}/models/creep/contact.csv}}\n")
    found = {}
    for law in LAWS:
        sets = [item for axle in ("front", "rear") for item in ("--set", f"wheelsets.{axle}.creep.law={law}")]
        rows = rows_of(program, "curve", str(model), "--radius", ",".join(map(str, RADII)), "--cant", "100mm",
                       "--cant-deficiency", "50mm", *sets, "--csv")
        found[law] = {round(r["radius_m"]): r for r in rows if r["wheelset"] == "front"}
    print("\nfront axle, cant 100 mm, deficiency 50 mm; the outer wheel is the left one")
    print("radius law      y mm   attack mrad  Y outer kN  Q outer kN   Y/Q   flange kN  T1 outer kN  T2 inner kN  sum Y kN")
    for radius in RADII:
        for law in LAWS:
            r = found[law].get(radius)
            if r is None:
                print(f"{radius:6d} {law:8s} no steady running")
                continue
            print(f"{radius:6d} {law:8s} {1e3 * r['y_m']:5.2f} {1e3 * r['attack_rad']:11.2f} {1e-3 * r['left_y_outward_N']:11.1f}"
                  f" {1e-3 * r['left_q_N']:11.1f} {r['left_y_q']:7.3f} {1e-3 * r['left_flange_normal_N']:10.1f}"
                  f" {1e-3 * r['left_t1_N']:11.1f} {1e-3 * r['right_t2_N']:12.1f} {1e-3 * r['sum_y_N']:9.1f}")

    def lines(key: str, scale: float) -> list[dict]:  # a line breaks where nothing was found
        return [line([float(radius) for radius in RADII], [scale * found[law].get(radius, {}).get(key, math.nan) for radius in RADII],
                     law, colour) for law, colour in zip(LAWS, COLOURS)]
    missing = ", ".join(f"{law} at {radius} m" for law in LAWS for radius in RADII if radius not in found[law])
    save(output / "contact_laws.png", "What the creep law changes: the two-axle wagon in steady curves",
         "front axle, cant 100 mm, cant deficiency 50 mm, friction 0.3" + (f"; no steady running: {missing}" if missing else ""),
         [panel(0, 0, "Guiding force Y of the outer wheel", "radius [m]", "[kN]", lines("left_y_outward_N", 1e-3)),
          panel(0, 1, "Angle of attack", "radius [m]", "[mrad]", lines("attack_rad", 1e3)),
          panel(1, 0, "Longitudinal creep force of the outer tread", "radius [m]", "[kN]", lines("left_t1_N", 1e-3)),
          panel(1, 1, "Normal force of the outer flange", "radius [m]", "[kN]", lines("left_flange_normal_N", 1e-3))])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--klingel", default="build/klingel", type=pathlib.Path, help="default: build/klingel")
    parser.add_argument("--output", default=ROOT / "docs", type=pathlib.Path, help="folder of the pictures; default: docs")
    arguments = parser.parse_args()
    program = arguments.klingel.resolve()
    with tempfile.TemporaryDirectory() as folder:
        climbs(program, arguments.output, pathlib.Path(folder))
        curves(program, arguments.output, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
