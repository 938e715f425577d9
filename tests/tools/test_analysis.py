#!/usr/bin/python3
"""klingel modes, critical, curve and ride against published and independently derived results.

usage: KLINGEL=build/klingel python3 tests/tools/test_analysis.py [-v]

Expected values come from closed formulas written out here, or from where the tests say.
"""

from __future__ import annotations

import math
import pathlib
import re
import tempfile
import unittest

import matplotlib.image
import numpy

from cli import CURVE, DEMO, FREE, LINEAR, RESTRAINED, WAGON, klingel, output, rows

BOGIE = "models/cooperrider_bogie.yaml"
COACH, UNSYMMETRIC = "models/manchester_vehicle1.yaml", "models/unsymmetric.yaml"


class Critical(unittest.TestCase):
    def cycles(self, *arguments: object) -> tuple[list[float], tuple[float, float] | None, dict[float, dict[str, str]]]:
        """Linear critical speeds, the two speeds between which hunting ends, stable cycles by speed."""
        text = output("critical", *arguments, "--csv")
        linear = [float(x) for x in re.findall(r"([\d.]+) \(unstable", text)]
        fold = re.search(r"hunting ends between m/s: ([\d.]+) ([\d.]+)", text)
        stable = {float(r["speed_m_s"]): r for r in rows(text) if r["cycle"] == "stable"}
        return linear, (float(fold.group(1)), float(fold.group(2))) if fold else None, stable

    def check_bogie(self, *arguments: object) -> None:
        linear, fold, stable = self.cycles(BOGIE, "--speeds", "60:75:5", *arguments)
        # Kaas-Petersen 1986: 68.66 m/s; 68.644 with the rounded SI values
        self.assertEqual(len(linear), 1)
        self.assertGreater(linear[0], 68.64)
        self.assertLess(linear[0], 68.66)
        # the published equations by RK4, h = 0.05 ms, in another program: fold, amplitude, frequency
        self.assertAlmostEqual(fold[1], 66.656, delta=0.1)
        self.assertLess(fold[1] - fold[0], 0.0051)
        for speed, amplitude, frequency in ((70.0, 10.194e-3, 3.984), (75.0, 11.165e-3, 4.181)):
            self.assertAlmostEqual(float(stable[speed]["amplitude_m"]) / amplitude, 1.0, delta=0.005)
            self.assertAlmostEqual(float(stable[speed]["frequency_Hz"]) / frequency, 1.0, delta=0.005)

    def test_cooperrider_bogie(self) -> None:
        self.check_bogie()

    def test_cooperrider_bogie_at_one_millisecond(self) -> None:
        self.check_bogie("--step", "1ms")

    def test_hopf_frequency(self) -> None:
        """25.1216 rad/s, from the published equations."""
        text = output("critical", BOGIE, "--linear", "--csv")
        hertz = float(re.search(r"unstable, ([\d.]+) Hz", text).group(1))
        self.assertAlmostEqual(hertz, 25.1216 / (2 * math.pi), delta=1e-4)

    def test_threshold_between_rest_and_hunting(self) -> None:
        """From the fold to nothing at the linear critical speed, where it falls as the root of the distance."""
        text = output("critical", BOGIE, "--speeds", "67:70:0.5", "--threshold", "--csv")
        unstable = {float(r["speed_m_s"]): float(r["amplitude_m"]) for r in rows(text) if r["cycle"] == "unstable"}
        self.assertEqual(sorted(unstable), [67.0, 67.5, 68.0, 68.5])
        falling = [unstable[v] for v in sorted(unstable)]
        self.assertEqual(falling, sorted(falling, reverse=True))
        self.assertLess(falling[0], 9.36e-3)
        far, near = (unstable[v] ** 2 / (68.644 - v) for v in (68.0, 68.5))
        self.assertAlmostEqual(near / far, 1.0, delta=0.6)
        self.assertLess(unstable[68.5], 0.4 * unstable[68.0])

    def test_closed_formula(self) -> None:
        """Elastically restrained wheelset (Wickens): 75.294193 m/s, and no TRACK changes that if it is straight."""
        for track in ((), ("models/straight.yaml",)):
            linear, _, _ = self.cycles(RESTRAINED, *track, "--linear")
            self.assertEqual(len(linear), 1)
            self.assertAlmostEqual(linear[0], 75.294193, delta=1e-5)

    def test_hard_and_unbounded_and_soft(self) -> None:
        """Cooperrider's bogie loses stability hard (Kaas-Petersen 1986); what is linear grows without a bound; with creep
        that saturates as the only nonlinearity the unsymmetric vehicle loses it softly: amplitude squared over distance is
        a constant, the normal form of a supercritical Hopf bifurcation."""
        kind = {m: re.search(r"loss of stability: (.*)", output("critical", m, "--speeds", span, "--csv")).group(1)
                for m, span in ((BOGIE, "60:75:5"), (RESTRAINED, "60:80:5"), (UNSYMMETRIC, "40:44:0.5"))}
        self.assertEqual(list(kind.values()), ["subcritical", "unbounded", "supercritical"])
        linear, end, stable = self.cycles(UNSYMMETRIC, "--speeds", "43.3:44.5:0.4")
        squares = [float(r["amplitude_m"]) ** 2 / (v - linear[0]) for v, r in stable.items()]
        self.assertGreaterEqual(len(squares), 3)
        for square in squares:
            self.assertAlmostEqual(square / squares[0], 1.0, delta=0.5)

    def test_small_cycles_of_the_wagon(self) -> None:
        """At 45 m/s the wagon hunts with 0.4 mm, found in runs without this command; at 40 m/s it comes to rest."""
        linear, end, stable = self.cycles(WAGON, "--speeds", "38:50:1")
        self.assertGreater(linear[0], 100.0)
        self.assertTrue(40.0 < end[0] < end[1] < 45.0)
        self.assertAlmostEqual(float(stable[45.0]["amplitude_m"]), self.amplitude_of_run(45), delta=2e-5)
        self.assertLess(self.amplitude_of_run(40), 1e-5)

    @staticmethod
    def amplitude_of_run(speed: float) -> float:
        """Half of the way that the leading wheelset swings at the end of a minute, disturbed by 5 mm."""
        done = rows(output("run", WAGON, "--speed", speed, "--time", 60, "--initial", "front.y=5mm", "--initial", "rear.y=5mm",
                           "--csv"))
        y = [float(r["front_y_m"]) for r in done[-2000:]]
        return (max(y) - min(y)) / 2

    def test_coach_has_one_story(self) -> None:
        """Disturbed strongly the coach hunts from above its linear critical speed down to far below it, without a gap; what
        does not settle into a cycle is called irregular, with its range, and nothing else is claimed."""
        text = output("critical", COACH, "--speeds", "36:92:4", "--csv")
        linear = float(re.search(r"([\d.]+) \(unstable", text).group(1))
        end = float(re.search(r"hunting ends between m/s: ([\d.]+)", text).group(1))
        self.assertLess(end, 0.6 * linear)
        hunting = [r for r in rows(text) if r["branch"] == "1" and r["cycle"] in ("stable", "irregular")]
        speeds = [float(r["speed_m_s"]) for r in hunting]
        self.assertEqual(speeds, [92.0 - 4 * i for i in range(len(speeds))])
        self.assertLess(speeds[-1], end + 4)
        for row in hunting:
            self.assertLessEqual(float(row["least_m"]), float(row["amplitude_m"]) * (1 + 1e-9))
            self.assertGreaterEqual(float(row["most_m"]), float(row["amplitude_m"]) * (1 - 1e-9))

    def test_refusals(self) -> None:
        for arguments, says in ((("--speeds", "70:60"), "must rise"), (("--speeds", "60:70:0"), "step must be positive"),
                                (("--wheelset", "frnt"), "did you mean front?"), (("--step", "20ms"), "within")):
            done = klingel("critical", BOGIE, *arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(says, done.stderr)


class Modes(unittest.TestCase):
    def test_bounce_is_followed(self) -> None:
        """The bounce of the wagon's body: k 4.4 MN/m, c 80 kN s/m, m 37.2 t, whatever the speed."""
        track = [r for r in rows(output("modes", WAGON, "--speeds", "5:45:5", "--csv")) if r["name"] == "body bounce"]
        self.assertEqual([float(r["speed_m_s"]) for r in track], [5.0 * i for i in range(1, 10)])
        self.assertEqual(len({r["track"] for r in track}), 1)
        natural, ratio = math.sqrt(4.4e6 / 37200), 80e3 / (2 * math.sqrt(4.4e6 * 37200))
        for row in track:
            self.assertAlmostEqual(float(row["damping_ratio"]) / ratio, 1.0, delta=2e-5)  # rails give way
            self.assertAlmostEqual(float(row["imag_rad_s"]) / (natural * math.sqrt(1 - ratio**2)), 1.0, delta=2e-5)

    def test_tracks_do_not_jump(self) -> None:
        """Neighbours on a track are neighbours in the plane; every mode has a track, and each track one mode a speed."""
        table = rows(output("modes", LINEAR, "--speeds", "5:80:1", "--csv"))
        last: dict[str, tuple[float, complex]] = {}
        for row in table:
            speed, value = float(row["speed_m_s"]), complex(float(row["real_1_s"]), float(row["imag_rad_s"]))
            before = last.get(row["track"])
            if before is not None:
                self.assertEqual(before[0], speed - 1.0)
                self.assertLess(abs(value - before[1]), 0.35 * abs(before[1]) + 1.0, row)
            last[row["track"]] = (speed, value)
        self.assertEqual(len(table), sum(1 for r in table if r["name"]))

    def test_shape_of_bounce(self) -> None:
        text = output("modes", WAGON, "--speed", "20", "--shapes", "12")
        shape = text.split("shape of body bounce")[1].split("shape of")[0]
        amplitudes = dict(re.findall(r"^ +(\S+) +([\d.]+) (?:m|rad)", shape, re.M))
        self.assertEqual(amplitudes.pop("body.z"), "1.0000")
        self.assertEqual(set(amplitudes.values()), {"0.0000"})

    def test_shape_of_klingels_motion(self) -> None:
        """A free wheelset at low speed: y' = V psi, so psi is 2 pi/10.757 m of y, a quarter of a period ahead."""
        text = output("modes", FREE, "--speed", "1", "--shapes", "1")
        y = re.search(r"wheelset\.y +1\.0000 m +\+?(-?\d+) deg", text)
        yaw = re.search(r"wheelset\.yaw +([\d.]+) rad +\+?(-?\d+) deg", text)
        self.assertAlmostEqual(float(yaw.group(1)), 2 * math.pi / 10.757, delta=2e-3)
        self.assertAlmostEqual(int(yaw.group(2)) - int(y.group(1)), 90, delta=1)


class Curve(unittest.TestCase):
    def test_free_wheelset_rolls_outwards(self) -> None:
        """y = -r0 l kappa/lambda (Klingel), in balance of cant and speed."""
        for radius in (1000.0, 400.0, -700.0):
            row, = rows(output("curve", FREE, f"--radius={radius}", "--cant-deficiency", "0", "--csv"))
            self.assertAlmostEqual(float(row["y_m"]) / (-0.45 * 0.7452 / (radius * 0.1144)), 1.0, delta=1e-4)

    def test_two_axle_vehicle(self) -> None:
        """Linear creep: the six equations of equilibrium, written down here and solved by NumPy."""
        f11, f22, l, r0, conicity, h = 7.44e6, 6.79e6, 0.7452, 0.45, 0.1144, 4.5
        ky, kyaw, kroll, below = 0.8e6, 2.0e6, 4 * 1.2e6, 0.9
        m, body = 1250.0, 22000.0
        for radius, speed in ((800.0, 10.0), (800.0, 30.0), (-1500.0, 50.0)):
            kappa = 1 / radius
            matrix, right = numpy.zeros((7, 7)), numpy.zeros(7)  # y1, psi1, y2, psi2, yb, psib, phib
            for i, x in ((0, h), (1, -h)):
                y, psi = 2 * i, 2 * i + 1
                spring = numpy.zeros(7)  # lateral displacement of the axle against the body; offset kappa h^2/2
                spring[[y, 4, 5, 6]] = 1, -1, -x, below
                offset = kappa * h * h / 2
                turn = numpy.zeros(7)
                turn[[psi, 5]] = 1, -1
                # axle: 2 f22 psi - ky s = m kappa V^2; -2 f11 l (lambda y/r0 + l kappa) - kyaw t = 0
                matrix[y] = -ky * spring
                matrix[y, psi] += 2 * f22
                right[y] = m * kappa * speed**2 + ky * offset
                matrix[psi] = -kyaw * turn
                matrix[psi, y] += -2 * f11 * l * conicity / r0
                right[psi] = 2 * f11 * l * l * kappa + kyaw * kappa * x
                # body: y, yaw, roll
                matrix[4] += ky * spring
                right[4] -= ky * offset
                matrix[5] += ky * x * spring + kyaw * turn
                right[5] -= ky * x * offset + kyaw * kappa * x
                matrix[6] += -below * ky * spring
                right[6] += below * ky * offset
            right[4] += body * kappa * speed**2
            matrix[6, 6] -= kroll
            wanted = numpy.linalg.solve(matrix, right)
            got = rows(output("curve", LINEAR, f"--radius={radius}", "--speed", speed, "--cant", "0", "--csv"))
            for i, row in enumerate(got):
                self.assertAlmostEqual(float(row["y_m"]) / wanted[2 * i], 1.0, delta=2e-3)
                self.assertAlmostEqual(float(row["yaw_rad"]), wanted[2 * i + 1], delta=2e-3 * abs(wanted).max())
                self.assertEqual(float(row["attack_rad"]), -math.copysign(1, radius) * float(row["yaw_rad"]))

    def test_forces_balance(self) -> None:
        """Sum of Y against M (V^2/R - g cant/base), sum of Q against the weight: 1e-6 of it, from 1000 to 300 m."""
        mass = 37200 + 2 * 1400
        table = rows(output("curve", WAGON, "--radius", "1000:300:-100", "--cant", "100mm", "--cant-deficiency", "80mm",
                            "--csv"))
        self.assertEqual(len(table), 16)
        for front, rear in zip(table[::2], table[1::2]):
            speed, radius = float(front["speed_m_s"]), float(front["radius_m"])
            self.assertAlmostEqual(speed**2, 9.81 * radius * 0.18 / 1.5, delta=1e-9 * speed**2)
            y = sum(float(r[f"{s}_y_outward_N"]) * sign for r in (front, rear) for s, sign in (("right", 1), ("left", -1)))
            q = sum(float(r[f"{s}_q_N"]) for r in (front, rear) for s in ("right", "left"))
            self.assertAlmostEqual(y, -mass * (speed**2 / radius - 9.81 * 0.1 / 1.5), delta=1e-6 * mass * 9.81)
            self.assertAlmostEqual(q, mass * 9.81, delta=1e-6 * mass * 9.81)
            self.assertAlmostEqual(float(front["sum_y_N"]) + float(rear["sum_y_N"]), y, delta=1e-3)

    def test_left_and_right_are_mirrored(self) -> None:
        for model, radius in ((WAGON, 500), (WAGON, 250), (COACH, 300), ("models/articulated_train.yaml", 250)):
            right, left = (rows(output("curve", model, "--radius", r, "--speed", "20", "--csv")) for r in (radius, -radius))
            for a, b in zip(right, left, strict=True):
                self.assertAlmostEqual(float(a["y_m"]), -float(b["y_m"]), delta=1e-9)
                self.assertAlmostEqual(float(a["attack_rad"]), float(b["attack_rad"]), delta=1e-9)
                for column in ("q_N", "y_outward_N", "flange_normal_N"):
                    for here, there in (("right", "left"), ("left", "right")):
                        self.assertAlmostEqual(float(a[f"{here}_{column}"]), float(b[f"{there}_{column}"]), delta=0.01)

    def test_tight_curves_are_reached(self) -> None:
        """R 250 to 300 m with cant deficiency and excess, at once, and over other curves: the same place, all balanced."""
        models = (WAGON, COACH, "models/three_axle_linked.yaml", "models/forced_steering.yaml",
                  "models/articulated_single_axle.yaml", "models/articulated_train.yaml")
        for model in models:
            for radius in (250, 300):
                for deficiency in ("100mm", "-60mm"):
                    common = ("--cant", "100mm", "--cant-deficiency", deficiency, "--csv")
                    once = rows(output("curve", model, "--radius", radius, *common))
                    over = [r for r in rows(output("curve", model, f"--radius=1000,400,{radius}", *common))
                            if float(r["radius_m"]) == radius]
                    weight = sum(float(r[f"{s}_q_N"]) for r in once for s in ("right", "left"))
                    with self.subTest(model=model, radius=radius, deficiency=deficiency):
                        for a, b in zip(once, over, strict=True):
                            self.assertEqual(a["found"], "newton")
                            self.assertLess(abs(float(a["lateral_N"])), 1e-6 * weight)
                            self.assertLess(abs(float(a["vertical_N"])), 1e-6 * weight)
                            self.assertAlmostEqual(float(a["y_m"]), float(b["y_m"]), delta=1e-4)  # jumps: more than one

    def test_where_there_is_none(self) -> None:
        """Without flanges a stiff vehicle slides off its tread: said with the reason, exit status 1, others kept."""
        done = klingel("curve", "models/three_axle.yaml", "--radius", "1500,250", "--cant-deficiency", "100mm")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no steady running in 1 of 2 curves", done.stderr)
        self.assertRegex(done.stdout, r"followed from straight track to R = \d+ m, beyond which front leaves its contact table")
        done = klingel("curve", "models/three_axle.yaml", "--radius", "1500,250", "--cant-deficiency", "100mm", "--csv")
        self.assertEqual((done.returncode, len(rows(done.stdout))), (1, 3))
        self.assertIn("R = 250 m: no steady running", done.stderr)

    def test_unstable_state_is_said(self) -> None:
        """Slower than its critical speed of 75.29 m/s (Wickens) the restrained wheelset stays, faster it does not."""
        for speed, says in ((75, False), (75.6, True)):
            text = output("curve", RESTRAINED, "--radius", 20000, "--speed", speed, "--cant", 0)
            self.assertEqual("UNSTABLE" in text, says)

    def test_agrees_with_a_run(self) -> None:
        """Simulated through a transition into the curve until it is steady: the same place, the same forces."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.csv"
            track = pathlib.Path(folder) / "track.yaml"
            track.write_text("name: long\nsegments:\n  - {length_m: 50, shape: constant}\n"
                             "  - {length_m: 100, shape: linear, to_radius_m: 800, to_cant_mm: 100}\n"
                             "  - {length_m: 1500, shape: constant}\n")
            output("run", WAGON, track, "--speed", "25", "--time", "60", "--csv", path, "--every", "1000")
            last = rows(path.read_text())[-1]
        table = rows(output("curve", WAGON, "--radius", "800", "--speed", "25", "--cant", "0.1", "--csv"))
        for row in table:
            name = row["wheelset"]
            self.assertAlmostEqual(float(row["y_m"]), float(last[f"{name}_y_m"]), delta=2e-6)
            self.assertAlmostEqual(float(row["right_q_N"]), float(last[f"{name}_right_Q_N"]), delta=20.0)

    def test_refusals(self) -> None:
        for arguments, says in (((), "--radius is missing"), (("--radius", "500"), "one of --speed and --cant-deficiency"),
                                (("--radius", "5", "--speed", "10"), "radii must be within"),
                                (("--radius", "500:400", "--speed", "10"), "must be A:B:STEP"),
                                (("--radius", "500x", "--speed", "10"), "500x"),
                                (("--radius", "500", "--speed", "10", "--cant", "0.1", "--cant-deficiency", "0"), "third")):
            done = klingel("curve", WAGON, *arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(says, done.stderr)


class Ride(unittest.TestCase):
    MASS, STIFFNESS, DAMPING = 37200.0, 4.4e6, 80e3
    AMPLITUDE, LENGTH, SPEED = 2e-3, 9.0, 27.0  # both axles of the wagon in phase: bounce alone

    def test_bounce_over_a_sine(self) -> None:
        """One mass on spring and damper: its transfer function, and every filter and weighting by its formula."""
        with tempfile.TemporaryDirectory() as folder:
            series = "".join(f"{i * 0.25},{1e3 * self.AMPLITUDE * math.sin(2 * math.pi * i * 0.25 / self.LENGTH)}\n"
                             for i in range(8001))
            (pathlib.Path(folder) / "sine.csv").write_text("s_m,vertical_mm\n" + series)
            track = pathlib.Path(folder) / "sine.yaml"
            track.write_text("name: sine\nsegments:\n  - {length_m: 2000, shape: constant}\n"
                             "irregularities: {samples: sine.csv}\n")
            table = rows(output("ride", WAGON, track, "--speed", self.SPEED, "--assess-from", "800", "--csv"))
        f = self.SPEED / self.LENGTH
        w = 2 * math.pi * f
        spring = self.STIFFNESS + 1j * w * self.DAMPING
        amplitude = w * w * self.AMPLITUDE * abs(spring / (spring - self.MASS * w * w))
        band = amplitude / math.sqrt((1 + (f / 10) ** 8) * (1 + (0.4 / f) ** 8))
        narrow = amplitude / math.sqrt((1 + (f / 4) ** 8) * (1 + (0.4 / f) ** 8))
        got = {(r["where"], r["quantity"], r["filter"]): r for r in table}
        for where in ("body front", "body middle", "body rear"):
            with self.subTest(where=where):
                ride = got[where, "z'' ride", "0.4..10 Hz"]
                self.assertAlmostEqual(float(ride["rms"]) * math.sqrt(2) / band, 1.0, delta=0.01)
                self.assertAlmostEqual(float(ride["p99_85"]) / band, 1.0, delta=0.01)
                self.assertAlmostEqual(float(ride["p0_15"]) / -band, 1.0, delta=0.01)
                safety = got[where, "z'' safety", "0.4..4 Hz"]
                self.assertAlmostEqual(float(safety["rms"]) * math.sqrt(2) / narrow, 1.0, delta=0.01)
                self.assertAlmostEqual(float(got[where, "Wz vertical", "Sperling"]["rms"]) /
                                       (100 * amplitude * self.sperling(f)) ** 0.3, 1.0, delta=0.01)
                self.assertAlmostEqual(float(got[where, "z'' comfort", "W_b"]["rms"]) * math.sqrt(2) /
                                       (amplitude * self.w_b(f)), 1.0, delta=0.01)
                self.assertLess(float(got[where, "y'' ride", "0.4..10 Hz"]["rms"]), 1e-6)

    @staticmethod
    def sperling(f: float) -> float:
        """Garg and Dukkipati 1984, vertical."""
        return 0.588 * math.sqrt((1.911 * f**2 + (0.25 * f**2) ** 2) /
                                 ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2))

    @staticmethod
    def w_b(f: float) -> float:
        """EN 12299: W_b, at s = j 2 pi f."""
        def corner(at: float, q: float) -> complex:
            return 1 + 1j * f / (q * at) - (f / at) ** 2

        band = (f / 0.4) ** 2 / (corner(0.4, math.sqrt(0.5)) * corner(100, math.sqrt(0.5)))
        return abs(band * (1 + 1j * f / 16) / corner(16, 0.63) * 0.4 * corner(2.5, 0.8) / corner(4, 0.8))

    def test_steady_curve(self) -> None:
        """In a steady curve every percentile of Y and Q is what klingel curve says."""
        with tempfile.TemporaryDirectory() as folder:
            track = pathlib.Path(folder) / "curve.yaml"
            track.write_text("name: c\nstart: {curvature_1_m: 0.00125, cant_mm: 100}\n"
                             "segments:\n  - {length_m: 3000, shape: constant}\n")
            table = rows(output("ride", WAGON, track, "--speed", "25", "--assess-from", "2000", "--csv"))
        steady = {r["wheelset"]: r for r in rows(output("curve", WAGON, "--radius", "800", "--speed", "25", "--cant", "0.1",
                                                        "--csv"))}
        for row in table:
            name = row["where"].split()[0]
            if row["quantity"] == "sum of Y":
                self.assertAlmostEqual(float(row["p50"]), float(steady[name]["sum_y_N"]), delta=20.0)
                self.assertAlmostEqual(float(row["limit"]), 10e3 + 40000 * 9.81 / 2 / 3, delta=1e-3)
            elif row["quantity"] == "Q":
                side = row["where"].split()[1]
                self.assertAlmostEqual(float(row["p99_85"]), float(steady[name][f"{side}_q_N"]), delta=30.0)
            elif row["quantity"] == "Y/Q":
                side = row["where"].split()[1]
                self.assertAlmostEqual(float(row["p50"]), float(steady[name][f"{side}_y_q"]), delta=5e-4)

    def test_sections_show_the_worst(self) -> None:
        whole, parts = ({(r["where"], r["quantity"], r["filter"]): r
                         for r in rows(output("ride", WAGON, DEMO, "--speed", "27", "--csv", *more))}
                        for more in ((), ("--section", "100")))
        for key, row in whole.items():
            if row["p99_85"]:
                self.assertGreaterEqual(float(parts[key]["p99_85"]) + 1e-9, float(row["p99_85"]))
                self.assertLessEqual(float(parts[key]["p0_15"]) - 1e-9, float(row["p0_15"]))
                self.assertEqual(parts[key]["rms"], row["rms"])

    def test_refusals(self) -> None:
        for arguments, says in (((WAGON, "--speed", "20"), "TRACK is missing"), ((WAGON, DEMO), "--speed V is missing"),
                                ((WAGON, DEMO, "--speed", "20", "--to", "10"), "nothing to assess"),
                                ((WAGON, CURVE, "--speed", "20", "--csv", "--series", "-"), "only one of")):
            done = klingel("ride", *arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(says, done.stderr)


class Pictures(unittest.TestCase):
    def test_every_picture_is_drawn(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            for number, arguments in enumerate((("modes", WAGON, "--speeds", "5:60:5"), ("modes", WAGON, "--speed", "20"),
                                                ("critical", BOGIE, "--speeds", "60:75:5"),
                                                ("curve", WAGON, "--radius", "1000:500:-250", "--speed", "20"),
                                                ("ride", WAGON, DEMO, "--speed", "27", "--to", "300"))):
                path = pathlib.Path(folder) / f"{number}.png"
                output(*arguments, "--plot", path)
                image = matplotlib.image.imread(path, format="png")[:, :, :3]
                with self.subTest(command=arguments[0]):
                    self.assertEqual(image.shape[1], 1430)
                    self.assertGreater((image.min(axis=2) < 0.9).mean(), 0.02)


if __name__ == "__main__":
    unittest.main()
