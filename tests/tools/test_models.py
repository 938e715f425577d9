#!/usr/bin/python3
"""The vehicles of models/: what the textbook says of them, their loads, their steps, and what they did before.

usage: KLINGEL=build/klingel python3 tests/tools/test_models.py [-v]

Wickens is A. H. Wickens, Fundamentals of Rail Vehicle Dynamics (2003).
"""

from __future__ import annotations

import math
import pathlib
import re
import tempfile
import unittest

from cli import DEMO, LINEAR, ROOT, klingel, output, reference, rows

COACH, TRAIN = "models/manchester_vehicle1.yaml", "models/ten_coaches.yaml"
RADIAL = {"three_axle_linked": 60, "forced_steering": 60, "articulated_single_axle": 60}  # stable up to, m/s
BALANCED = ("--cant", "100mm", "--cant-deficiency", "0mm")

TRACK = """name: transitions
segments:
  - {{length_m: {straight}, shape: constant}}
  - {{length_m: {ramp}, shape: linear, to_radius_m: {radius}, to_cant_mm: 100}}
  - {{length_m: {ramp}, shape: constant}}
  - {{length_m: {ramp}, shape: bloss, to_curvature_1_m: 0, to_cant_mm: 0}}
"""
ROUGH = """irregularities:
  spectrum: {{level: {level}, seed: 1, waves: 300, shortest_m: 3, longest_m: 100, taper_m: 20, start_m: 0,
             length_m: {length}, step_m: 0.25}}
"""


def track(folder: str, speed: float, level: str | None) -> str:
    """Straight, clothoid, curve, Bloss, straight; 100 mm of cant and 80 mm of deficiency at that speed, R 300 m at least."""
    sizes = {"straight": 20 + speed, "ramp": max(30.0, 2 * speed), "radius": max(300.0, speed**2 / (9.81 * 0.18 / 1.5))}
    text = TRACK.format(**sizes)
    if level:
        text += ROUGH.format(level=level, length=round(200 + 10 * speed))
    path = pathlib.Path(folder, "track.yaml")
    path.write_text(text)
    return str(path)


def modes(model: str, speeds: str, *more: object) -> dict[float, list[complex]]:
    found: dict[float, list[complex]] = {}
    for row in rows(output("modes", model, "--speeds", speeds, "--csv", *more)):
        found.setdefault(float(row["speed_m_s"]), []).append(complex(float(row["real_1_s"]), float(row["imag_rad_s"])))
    return found


def critical(model: str, span: str, *more: object) -> float:
    return float(re.search(r"([\d.]+) m/s .*becomes unstable", output("modes", model, "--critical", span, *more)).group(1))


def curve(model: str, radius: float, *more: object) -> list[dict[str, float]]:
    """Its wheelsets in that curve, which is reached over a wider one."""
    wide = f"{math.copysign(1000, radius)}," if abs(radius) < 1000 else ""
    table = rows(output("curve", model, f"--radius={wide}{radius}", *(more or BALANCED), "--csv"))
    return [{k: float(v) for k, v in row.items() if k not in ("wheelset", "found")} for row in table
            if float(row["radius_m"]) == radius]


def bending(stiffness: float) -> list[str]:
    """The linear two-axle vehicle with other springs lengthwise: a bending stiffness, and no damping of it."""
    return [f"--set=elements.{e}.{k}[0]={v}" for e in ("front", "rear") for k, v in (("k_N_m", stiffness), ("c_Ns_m", 0))]


class Textbook(unittest.TestCase):
    def test_no_bending_stiffness(self) -> None:
        """Wickens: a two-axle vehicle without bending stiffness steers radially, and is unstable at all speeds."""
        for row in curve(LINEAR, 1000, *BALANCED, "--set", "gravity_m_s2=9.81", *bending(0)):
            self.assertAlmostEqual(row["attack_rad"], 0.0, delta=1e-6)
            rolling = -0.7452 * 0.45 / (0.1144 * 1000)  # Redtenbacher: y = -l r0 / (lambda R)
            self.assertAlmostEqual(row["y_m"] / rolling, 1.0, delta=1e-3)
        for speed, values in modes(LINEAR, "0.5:150:6.5", *bending(0)).items():
            self.assertGreater(max(v.real for v in values), 1e-6, speed)

    def test_independent_wheels_neither_hunt_nor_steer(self) -> None:
        """Wickens: without the couple of longitudinal creep there is no hunting, and none of its steering in a curve."""
        car = "models/independent_wheels.yaml"
        for speed, values in modes(car, "2:100:14").items():
            swinging = [v for v in values if abs(v.imag) > 1e-3]
            self.assertLess(max(v.real for v in swinging), 0.0, speed)
        for row in rows(output("curve", car, "--radius=1000", *BALANCED, "--csv")):
            for side in ("right", "left"):
                self.assertAlmostEqual(float(row[f"{side}_t1_N"]), 0.0, delta=1.0)

    def test_bending_stiffness_trades_steering_for_stability(self) -> None:
        attack, speed = [], []
        for k in (0.3e6, 0.6e6, 1e6):
            attack.append(curve(LINEAR, 1500, *BALANCED, "--set", "gravity_m_s2=9.81", *bending(k))[0]["attack_rad"])
            speed.append(critical(LINEAR, "40:100", *bending(k)))
        self.assertEqual(attack, sorted(attack))
        self.assertEqual(speed, sorted(speed))
        self.assertGreater(attack[2], 3 * attack[0])
        self.assertGreater(speed[2], 1.3 * speed[0])

    def test_radial_and_stable(self) -> None:
        """Wickens: three axles with direct linkages, or forced steering, can be radial and stable: pure rolling and no creep."""
        for model, limit in RADIAL.items():
            file = f"models/{model}.yaml"
            for row in curve(file, 300):
                self.assertAlmostEqual(row["y_m"] / (-0.75 * 0.46 / (0.15 * 300)), 1.0, delta=0.005)
                self.assertLess(abs(row["attack_rad"]), 2e-5)
                self.assertLess(abs(row["sum_y_N"]), 100)
            for speed, values in modes(file, f"2:{limit}:14.5").items():
                moving = [v for v in values if abs(v) > 1e-3]
                self.assertLess(max(v.real for v in moving), 0.0, (model, speed))

    def test_linkages_against_none(self) -> None:
        """The same wagon without linkages: lower critical speed, ten times the angle of attack at least."""
        bare, linked = curve("models/three_axle.yaml", 1000), curve("models/three_axle_linked.yaml", 1000)
        self.assertGreater(max(abs(r["attack_rad"]) for r in bare), 10 * max(abs(r["attack_rad"]) for r in linked))
        self.assertLess(critical("models/three_axle.yaml", "30:45"), 45)

    def test_cross_bracing(self) -> None:
        """Bracing raises the critical speed. Rigid, with any bending stiffness, it makes the wheelsets parallel: without
        a net lateral force yaw1 + yaw2 = 0, hence y1 = y2 and no steering moment bends; attack +-a/R."""
        without = [f"--set=linkages.cross_bracing_{e}.k_N_m=1" for e in ("front", "rear")]
        self.assertLess(critical("models/cross_braced.yaml", "25:34", *without), 34)
        self.assertGreater(critical("models/cross_braced.yaml", "34:45"), 36)
        first, second = curve("models/cross_braced_rigid.yaml", 2000)[:2]
        for row, sign in ((first, 1), (second, -1)):
            self.assertAlmostEqual(row["attack_rad"] * 2000 / 1.28, sign, delta=0.08)
        self.assertAlmostEqual(first["y_m"], second["y_m"], delta=5e-5)
        # the rods, by whose ends the wheelsets move by millimetres, do not give: attack is minus yaw
        rods = first["y_m"] - second["y_m"] + 1.28 * (first["attack_rad"] + second["attack_rad"])
        self.assertLess(abs(rods), 1e-7)

    def test_unsymmetric_vehicle(self) -> None:
        """Wickens: its critical speeds differ in its two directions."""
        ahead, back = (critical(f"models/unsymmetric{x}.yaml", "40:47") for x in ("", "_reversed"))
        self.assertGreater(abs(ahead - back), 1.0)

    def test_articulated_train_has_more_modes(self) -> None:
        """Three bodies and four bogies: more hunting modes than the coach of one body and two; counted by what turns."""
        count = [sum(1 for v in modes(m, "30:30:1")[30.0] if 1.0 < abs(v.imag) < 30.0)
                 for m in (COACH, "models/articulated_train.yaml")]
        self.assertGreaterEqual(count[1], count[0] + 4)


class Coach(unittest.TestCase):
    def test_static_wheel_loads(self) -> None:
        """(32000 + 2*2615 + 4*1813) kg * 9.81 m/s2 / 8; at standstill with rails 0.5 um off (docs/contact.md). Under way: spin creep of the inclined contacts
        draws the rails inboard by 1.1 kN/43 MN/m = 25 um, the treads follow them down by 25 um * 0.025, and the primary
        springs of 1.22 MN/m, which rest as at standstill, feel 0.8 N of 54.5 kN."""
        wanted = 44482 * 9.81 / 8
        for model, prefixes in ((COACH, ("",)), (TRAIN, ("c1_", "c10_"))):
            for speed, bound in ((0, 1e-6), (20, 2e-5)):
                row = rows(output("run", model, "--speed", speed, "--time", "0.01", "--csv"))[-1]
                for p in prefixes:
                    for wheel in (f"{p}w{i}_{s}_Q_N" for i in (1, 2, 3, 4) for s in ("right", "left")):
                        # coupled ends are at the same height at rest, so that couplings carry nothing
                        self.assertAlmostEqual(float(row[wheel]) / wanted, 1.0, delta=bound)

    def test_curves_balance(self) -> None:
        weight = 44482 * 9.81
        for radius in (500, 600, 1000):
            for deficiency in (80, -80):
                for r in curve(COACH, radius, "--cant", "100mm", f"--cant-deficiency={deficiency}mm"):
                    self.assertLess(abs(r["lateral_N"]) / weight, 1e-6)
                    self.assertLess(abs(r["vertical_N"]) / weight, 1e-6)
        tight = rows(output("curve", COACH, "--radius=1000,600,450,300", "--cant=100mm", "--cant-deficiency=80mm", "--csv"))
        self.assertEqual(len(tight), 16)
        for row in tight:
            self.assertLess(max(abs(float(row["lateral_N"])), abs(float(row["vertical_N"]))) / weight, 1e-6)

    def test_described_in_another_way(self) -> None:
        """Every spring in two halves, all x 5 m ahead: the same motion on straight track, to 1e-9 of its size."""
        text = (ROOT / COACH).read_text().replace("profiles/", f"{ROOT}/models/profiles/")
        head, elements = text.split("\nelements:\n")
        halves = ""
        for block in re.findall(r"  - name: .*\n(?:    .*\n)+", elements):
            if "stop:" in block:
                halves += block
                continue
            block = re.sub(r"(k_N_m|c_Ns_m|k_Nm_rad): \[(.*)\]", lambda m: m.group(1) + ": [" + ", ".join(
                repr(float(v) / 2) for v in m.group(2).split(",")) + "]", block)
            halves += block + block.replace("name: ", "name: half_")
        moved = re.sub(r"x_m: ([-\d.]+)", lambda m: f"x_m: {float(m.group(1)) + 5!r}", f"{head}\nelements:\n{halves}")
        with tempfile.TemporaryDirectory() as folder:
            other = pathlib.Path(folder, "other.yaml")
            other.write_text(moved)
            common = ("--speed", 30, "--time", 4, "--initial", "w1.y=3mm", "--initial", "body.y=10mm", "--csv", "--every", 40)
            one, two = (rows(output("run", model, *common)) for model in (COACH, other))
        for column in (f"w{i}_{q}" for i in (1, 2, 3, 4) for q in ("y_m", "yaw_rad", "left_Q_N")):
            size = max(abs(float(r[column])) for r in one)
            for a, b in zip(one, two, strict=True):
                self.assertLess(abs(float(a[column]) - float(b[column])), 1e-9 * size, (column, a["time_s"]))

    def test_left_curve_mirrors_right(self) -> None:
        for right, left in zip(curve(COACH, 500), curve(COACH, -500), strict=True):
            self.assertAlmostEqual(right["y_m"], -left["y_m"], delta=1e-7)
            self.assertAlmostEqual(right["right_q_N"] / left["left_q_N"], 1.0, delta=1e-6)

    def test_every_speed(self) -> None:
        """From 0.5 to 100 m/s, straight, transitions, curve; ERRI B176 high up to 35 m/s, where no wheel lifts, and
        beyond that without derailing. Above 78 m/s the coach hunts when disturbed, so there only derailment counts."""
        with tempfile.TemporaryDirectory() as folder:
            for speed in (0.5, 2, 10, 25, 35, 50, 70, 85, 100):
                for level in (None, "erri_low", "erri_high"):
                    done = klingel("run", COACH, track(folder, speed, level), "--speed", speed, "--time", 9)
                    self.assertEqual(done.returncode, 0, (speed, level, done.stdout[-400:]))
                    if speed <= (35 if level else 70):
                        self.assertIn("faults\n  none", done.stdout, (speed, level))


class Wheelsets(unittest.TestCase):
    """At a walking pace a wheelset follows the kinematic wave; gravity and inertia count for nothing."""

    def wavelength(self, model: str) -> float:
        return 2 * math.pi / max(v.imag for v in modes(f"models/{model}.yaml", "1:1:1")[1.0])

    def linear(self, model: str) -> dict[str, float]:
        text = output("geometry", f"models/{model}.yaml")
        return {key: float(value) for key, value in re.findall(r"^  (\S+) +([-\d.]+) ", text, re.M)}

    def test_klingel(self) -> None:
        """Klingel 1883: 2 pi sqrt(r0 l/lambda)."""
        self.assertAlmostEqual(self.wavelength("free_wheelset") / 10.757, 1.0, delta=2e-4)

    def test_cones(self) -> None:
        """Wickens 2.3: 2 pi sqrt(r0 l/(lambda (1 - r0 delta0/l))) with delta0 = 0.05, and 0.052639 for lambda = dr/du_y."""
        self.assertAlmostEqual(self.linear("free_wheelset_cones")["lambda0"], 0.052639, delta=2e-6)
        formula = 2 * math.pi * math.sqrt(0.45 * 0.7452 / (0.052639 * (1 - 0.45 * 0.05 / 0.7452)))
        self.assertAlmostEqual(self.wavelength("free_wheelset_cones") / formula, 1.0, delta=1e-3)

    def test_arcs(self) -> None:
        """Wickens 2.3 prints lambda0 = 0.1144, epsilon0 = 6.42 for his worn profiles."""
        for model in ("free_wheelset_arcs", "wickens_arcs"):
            self.assertAlmostEqual(self.linear(model)["lambda0"], 0.1144, delta=1e-4)
            self.assertAlmostEqual(self.linear(model)["epsilon0"], 6.42, delta=0.01)
        self.assertAlmostEqual(critical("models/free_wheelset_arcs.yaml", "15:16"), 15.57, delta=0.01)


class Regression(unittest.TestCase):
    def test_readme_says_the_same(self) -> None:
        """The figures of models/README.md are those of tests/reference/models.csv, rounded."""
        table = (ROOT / "models/README.md").read_text()
        leading: dict[str, dict[str, str]] = {}
        for row in reference("models.csv"):
            if row["wheelset"] == "turned_rear":  # leads, after the other in the file
                leading[row["model"]] = row
            leading.setdefault(row["model"], row)
        for model, row in leading.items():
            said = re.search(rf"`{model}\.yaml` \|.*\|.*\| (.*) \|$", table, re.M).group(1)
            self.assertIn(f"critical speed {float(row['critical_m_s']):.2f} m/s", said, model)
            self.assertIn(f"R {row['radius_m']} m: ", said, model)
            self.assertIn(f"{1e3 * float(row['y_m']):.2f} mm", said, model)
            self.assertIn(f"{1e3 * float(row['attack_rad']):.2f} mrad", said, model)
            if "Y/Q" in said:
                self.assertAlmostEqual(float(re.search(r"Y/Q ([\d.]+)", said).group(1)), float(row["outer_y_q"]), delta=5.1e-4)

    def test_every_model(self) -> None:
        """tests/reference/models.csv; critical speeds to 0.02 %, places to 0.01 mm, forces to 50 N, Y/Q to 0.001."""
        table: dict[str, list[dict[str, str]]] = {}
        for row in reference("models.csv"):
            table.setdefault(row["model"], []).append(row)
        for model, wanted in table.items():
            file, speed = f"models/{model}.yaml", float(wanted[0]["critical_m_s"])
            found = critical(file, f"{speed - 0.4:.3f}:{speed + 0.4:.3f}")
            self.assertAlmostEqual(found / speed, 1.0, delta=2e-4, msg=model)
            for new, old in zip(curve(file, float(wanted[0]["radius_m"])), wanted, strict=True):
                self.assertAlmostEqual(new["y_m"], float(old["y_m"]), delta=1e-5, msg=(model, old["wheelset"]))
                self.assertAlmostEqual(new["attack_rad"], float(old["attack_rad"]), delta=1e-5, msg=model)
                self.assertAlmostEqual(new["sum_y_N"], float(old["sum_y_N"]), delta=50, msg=model)
                self.assertAlmostEqual(new["left_q_N"], float(old["outer_q_N"]), delta=50, msg=model)
                self.assertAlmostEqual(new["left_y_q"], float(old["outer_y_q"]), delta=1e-3, msg=model)

    def test_train_runs_like_its_coach(self) -> None:
        """Each coach of the train on smooth track as the coach alone: its couplings are soft; first wheelset within 0.3 mm."""
        with tempfile.TemporaryDirectory() as folder:
            way = track(folder, 20, None)
            common = ("--speed", 20, "--time", 6, "--csv", "--every", 100)
            alone, train = (rows(output("run", m, way, *common)) for m in (COACH, TRAIN))
            for a, b in zip(alone, train, strict=True):
                self.assertAlmostEqual(float(a["w1_y_m"]), float(b["c1_w1_y_m"]), delta=3e-4)
        done = klingel("run", TRAIN, DEMO, "--speed", 27, "--time", 10)
        self.assertIn("faults\n  none", done.stdout)


if __name__ == "__main__":
    unittest.main()
