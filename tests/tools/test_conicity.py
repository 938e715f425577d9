#!/usr/bin/python3
"""klingel conicity: its tables, files, refusals; the conicity of the shipped profiles against independent geometry.

usage: KLINGEL=build/klingel python3 tests/tools/test_conicity.py [-v]
"""

from __future__ import annotations

import json
import math
import pathlib
import unittest

from cli import ARCS, FREE, RESTRAINED, WAGON, InFolder, klingel, output, reference, rows


def conicity(*arguments: object) -> list[dict[str, float]]:
    return [{key: float(value) for key, value in row.items()} for row in rows(output("conicity", *arguments, "--csv"))]


class Conicity(InFolder):
    def table(self, text: str) -> pathlib.Path:
        path = self.folder / "delta_r.txt"
        path.write_text(text)
        return path

    def refuses(self, *arguments: object, says: str, status: int = 2) -> None:
        done = klingel("conicity", *arguments)
        with self.subTest(arguments=arguments):
            self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
            self.assertIn(says, done.stderr)


class Values(Conicity):
    def test_linear_wheelset_is_klingels(self) -> None:
        """Wickens' example, 2.3: conicity 0.1144, wavelength 2 pi sqrt(r0 l / lambda) = 10.757 m."""
        found = conicity(FREE, "--to", "8")
        self.assertEqual(len(found), 15)
        for row in found:
            self.assertAlmostEqual(row["conicity"], 0.1144, delta=1e-9)
            self.assertAlmostEqual(row["regression"], 0.1144, delta=1e-9)
            self.assertAlmostEqual(row["wavelength_m"], 10.757, delta=5e-4)

    def test_arcs_at_small_amplitude(self) -> None:
        """lambda0 of the arcs without roll: delta0 R_w / (R_w - R_r) for small angles (Wickens, eq. 16-34, phi = 0)."""
        wheel, rail, slope, base = 0.01795, 0.00989, 0.0493, 0.7452
        expected = slope * wheel / (wheel - rail)
        level = conicity(ARCS, "--from", "0.1", "--to", "0.1")[0]["conicity"]
        self.assertAlmostEqual(level / expected, 1.0, delta=0.005)
        # with roll: lambda0 = delta0 R_w (1 + R_r delta0/l) / ((R_w - R_r)(1 - r0 delta0/l)) = 0.11428
        rolling = conicity(ARCS, "--from", "0.1", "--to", "0.1", "--roll")[0]["conicity"]
        self.assertAlmostEqual(rolling, expected * (1 + rail) / (1 - 0.45 * slope / base), delta=2e-4)

    def test_delta_r_with_roll_is_contacts(self) -> None:
        """S1002 on UIC60, 1:40: rolling-radius difference against CONTACT away from the jumps."""
        points = [(float(row["y_m"]) * 1e3, float(row["delta_r_m"]) * 1e3)
                  for row in rows(output("conicity", WAGON, "--roll", "--delta-r"))]
        compared = 0
        for row in reference("manchester_rigid.csv"):
            y = float(row["y_ws_mm"])
            if row["wheel"] != "R" or 4.5 < y < 7 or y > 8:
                continue
            nearest = min(points, key=lambda point: abs(point[0] - y))
            self.assertAlmostEqual(nearest[0], y, delta=1e-6)
            self.assertAlmostEqual(nearest[1], float(row["rrd_right_minus_left_mm"]), delta=0.02)
            compared += 1
        self.assertGreaterEqual(compared, 12)

    def test_wavelength_against_runge_kutta(self) -> None:
        """The same differential equation, integrated step by step from the turning point."""
        path = self.folder / "curve.csv"
        output("conicity", WAGON, "--delta-r", path)
        curve = [(float(r["y_m"]), float(r["delta_r_m"])) for r in rows(path.read_text())]
        ys = [y for y, _ in curve]

        def delta_r(y: float) -> float:
            import bisect
            i = min(max(bisect.bisect_right(ys, y) - 1, 0), len(ys) - 2)
            (y0, r0), (y1, r1) = curve[i], curve[i + 1]
            return r0 + (r1 - r0) * (y - y0) / (y1 - y0)

        for row in conicity(WAGON, "--from", "2", "--to", "6", "--step", "2"):
            base_radius = row["wavelength_m"] ** 2 * row["conicity"] / (2 * math.pi ** 2)
            y, v, s, h = row["amplitude_m"], 0.0, 0.0, 5e-4
            while y > 0:  # a quarter of a wave, leapfrog
                v -= 0.5 * h * delta_r(y) / base_radius
                y, s = y + h * v, s + h
                v -= 0.5 * h * delta_r(y) / base_radius
            s += y / -v  # back to the zero
            self.assertAlmostEqual(4 * s / row["wavelength_m"], 1.0, delta=5e-4)

    def test_gauge(self) -> None:
        """A narrower gauge brings the contact to the gauge corner: conicity falls with the gauge."""
        sweep = conicity(WAGON, "--gauge", "1433:1437:2")
        self.assertEqual([round(row["gauge_m"], 6) for row in sweep], [1.433, 1.435, 1.437])
        self.assertGreater(sweep[0]["conicity"], sweep[1]["conicity"] + 0.01)
        self.assertGreater(sweep[1]["conicity"], sweep[2]["conicity"] + 0.01)
        here = conicity(WAGON, "--from", "3", "--to", "3")[0]["conicity"]
        self.assertAlmostEqual(sweep[1]["conicity"], here, delta=1e-12)

    def test_table_of_a_model_is_the_model(self) -> None:
        path = self.folder / "curve.csv"
        output("conicity", WAGON, "--delta-r", path)
        of_model, of_table = conicity(WAGON, "--to", "7"), conicity("--table", path, "--to", "7")
        for one, other in zip(of_model, of_table, strict=True):
            self.assertAlmostEqual(one["conicity"], other["conicity"], delta=1e-6)

    def test_en_15302_through_the_command(self) -> None:
        """Case E1 from its delta_r: 0.188 at 3 mm."""
        lines = [f"{row['y_mm']} {row['delta_r_mm']}" for row in reference("en15302_delta_r.csv") if row["case"] == "E1"]
        path = self.table("# case E1\n" + "\n".join(lines) + "\n")
        found = {round(row["amplitude_m"] * 1e3, 3): row["conicity"]
                 for row in conicity("--table", path, "--to", "6.8", "--step", "0.1")}
        expected = {float(row["amplitude_mm"]): float(row["E1"]) for row in reference("en15302_conicity.csv")}
        self.assertEqual(len(found), 59)
        for amplitude, value in found.items():
            self.assertAlmostEqual(value, expected[amplitude], delta=0.001)
        self.assertIn("tan gamma_e at 3 mm: 0.1879", output("conicity", "--table", path))


class Forms(Conicity):
    def test_text_says_what_was_done(self) -> None:
        text = output("conicity", WAGON, "--to", "4")
        for words in ("EN 15302", "Annex B", "Annex C", "axle level", "e           1506.473 mm", "r0          459.907 mm",
                      "y_em", "tan gamma_e at 3 mm:", "nonlinearity"):
            self.assertIn(words, text)
        self.assertIn("with roll", output("conicity", WAGON, "--to", "4", "--roll"))

    def test_json(self) -> None:
        read = json.loads(output("conicity", WAGON, "--to", "4", "--gauge", "1434:1435:1", "--json"))
        self.assertEqual((len(read["motions"]), len(read["gauges"])), (7, 2))
        self.assertAlmostEqual(read["rolling_line_m"], 0.0, delta=1e-7)
        self.assertAlmostEqual(read["base_m"], 1.506473, delta=1e-6)

    def test_wheelset_and_pair(self) -> None:
        first = output("conicity", WAGON, "--to", "2")
        self.assertEqual(first, output("conicity", WAGON, "--to", "2", "--wheelset", "2"))
        self.assertEqual(first, output("conicity", WAGON, "--to", "2", "--wheelset", "rear"))
        self.assertEqual(first, output("conicity", WAGON, "--to", "2", "--pair", "s1002_uic60"))
        self.refuses(WAGON, "--wheelset", "3", says="--wheelset 3: must be 1..2 or a name")
        self.refuses(WAGON, "--wheelset", "rer", says="did you mean rear")
        self.refuses(WAGON, "--pair", "s1002_uic6", says="did you mean s1002_uic60")
        self.refuses(WAGON, "--pair", "s1002_uic60", "--wheelset", "1", says="one of them is enough")

    def test_tables_of_all_kinds(self) -> None:
        plain = "-5 -1\n0 0\n5 1\n"
        for text in (plain, plain.replace(" ", ","), plain.replace(" ", ";\t"), "y_mm,delta_r_mm\n" + plain,
                     "# what\n\n" + plain.replace("\n", " # c\r\n"),
                     "y_m delta_r_mm\n-.005 -1\n0 0\n0.005 1\n"):
            with self.subTest(text=text):
                found = conicity("--table", self.table(text))
                self.assertEqual(len(found), 9)
                self.assertAlmostEqual(found[0]["conicity"], 0.1, delta=1e-12)
                self.assertAlmostEqual(found[0]["wavelength_m"], 2 * math.pi * math.sqrt(1.5 * 0.46 / 0.2), delta=1e-9)
        wide = conicity("--table", self.table(plain), "--base", "3m", "--radius", "920")
        self.assertAlmostEqual(wide[0]["wavelength_m"], 2 * math.pi * math.sqrt(3 * 0.92 / 0.2), delta=1e-9)


class Refusals(Conicity):
    def test_tables(self) -> None:
        for text, says in (("", "needs 3 to"), ("1 2\n2 3\n", "needs 3 to"),
                           ("0 nan\n1 1\n2 2\n", ":1: delta_r must be a number"), ("0 0\n1 1\ninf 2\n", ":3: y must be a number"), ("0 0\n1 1\n0.5 2\n", ":3: y must rise"),
                           ("0 0\n1 1\n1 2\n1 3\n", ":4: y must rise"), ("0 0 0\n", ":1: must be two numbers"),
                           ("0\n", ":1: must be two numbers"), ("y_mm dr_mm\n0 0\n", ":1: y must be a number, not y_mm"),
                           ("0 0\n1 2000\n", "within 1 m"), ("-1 1\n0 0\n1 -1\n", "no rolling line"),
                           ("0 1\n1 2\n2 3\n", "no rolling line"), ("0 0\n0x1 1\n", "must be a number")):
            self.refuses("--table", self.table(text), says=says, status=1)
        self.refuses("--table", self.folder / "none.txt", says="No such file", status=1)
        self.refuses("--table", self.folder, says="cannot read", status=1)

    def test_amplitudes(self) -> None:
        self.refuses(WAGON, "--to", "16", says="--to 16 mm: delta_r carries amplitudes up to 15 mm only")
        self.refuses(WAGON, "--from", "16", says="--from 16 mm: delta_r carries amplitudes up to 15 mm only")
        self.refuses(WAGON, "--from", "3", "--to", "2", says="--to: must not be below --from")
        self.refuses(WAGON, "--step", "0.001", "--to", "90", says="more than 10000 amplitudes")
        self.assertIn("tan gamma_e at 20 mm: none, delta_r does not reach so far", output("conicity", WAGON, "--at", "20"))

    def test_what_does_not_go_together(self) -> None:
        table = self.table("-5 -1\n0 0\n5 1\n")
        self.refuses(says="an argument is missing: expected MODEL | --table FILE")
        self.refuses(WAGON, "--table", table, says="not from both")
        for option in (("--pair", "x"), ("--wheelset", "1"), ("--roll",), ("--gauge", "1430:1440:1"), ("--set", "a=1")):
            self.refuses("--table", table, *option, says="go with MODEL, not with --table")
        self.refuses(WAGON, "--base", "1500", says="--base and --radius go with --table")
        self.refuses(WAGON, "--csv", "-", "--json", "-", says="only one of")

    def test_gauges(self) -> None:
        for text in ("1435", "1430:1440", "1430:1440:", "1430:1440:1:1", "1430:nan:1", "a:b:c"):
            self.refuses(WAGON, "--gauge", text, says="LOW:HIGH:STEP")
        for text in ("1440:1430:1", "1430:1440:0", "1430:1440:-1", "1:2:1", "1430:9000:1"):
            self.refuses(WAGON, "--gauge", text, says="rising within 300..3000 mm")
        self.refuses(WAGON, "--gauge", "1430:1440:0.01", says="more than 200 gauges")
        self.refuses(RESTRAINED, "--gauge", "1430:1440:1", says="not placed by gauge_m")


if __name__ == "__main__":
    unittest.main()
