#!/usr/bin/python3
"""klingel creep: curves, the comparison, the table as C source, and what it refuses."""

import pathlib
import subprocess
import tempfile
import unittest

from cli import CREEP, ROOT, klingel, output, rows

POINTS = "tests/reference/creep_check_points.csv"


class Curves(unittest.TestCase):
    def test_every_law_saturates_at_mu_n(self):
        table = rows(output("creep", CREEP, "--csv", "--to", "0.05", "--friction", "0.4", "--load", "50000"))
        self.assertEqual({row["law"] for row in table},
                         {"linear", "she", "polach", "fastsim", "fastsim_elliptic", "table"})
        for row in table:
            if row["law"] != "linear":
                self.assertLessEqual(abs(float(row["t1_N"])), 20000 * (1 + 1e-12))
        last = [row for row in table if float(row["gamma1"]) == 0.05 and row["law"] not in ("linear", "polach")]
        for row in last:
            self.assertAlmostEqual(float(row["t1_N"]), -20000, delta=20, msg=row["law"])

    def test_lateral_sweep_with_spin(self):
        table = rows(output("creep", CREEP, "--csv", "--law", "table", "--sweep", "across", "--spin", "0.5", "--rows", "3"))
        self.assertEqual(len(table), 3)
        self.assertLess(float(table[0]["t2_N"]), 0)  # spin alone pushes to the left

    def test_refusals(self):
        for words in ([CREEP, "--a", "60"], [CREEP, "--k-a", "0.2", "--k-s", "0.5"], [CREEP, "--set", "x=1"], [POINTS],
                      [CREEP, "--source", "-", "--name", "1x"], [CREEP, "--check", CREEP]):
            done = klingel("creep", *words)
            self.assertNotEqual(done.returncode, 0, words)
            self.assertTrue(done.stderr, words)


class Comparison(unittest.TestCase):
    def test_table_is_the_best(self):
        lines = [line.split() for line in output("creep", CREEP, "--check", POINTS).splitlines()]
        mean = {words[0]: float(words[1]) for words in lines if len(words) == 8 and words[0] != "law"}
        self.assertEqual(set(mean), {"she", "polach", "fastsim", "fastsim_elliptic", "table"})
        self.assertLess(mean["table"], 0.002)
        self.assertTrue(all(mean["table"] < 0.05 * mean[law] for law in mean if law != "table"))


class Source(unittest.TestCase):
    def test_compiles_and_is_what_it_says(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "table.c"
            said = output("creep", CREEP, "--compact", "--source", path, "--name", "wet_table")
            self.assertIn("const struct kl_creep_table wet_table", said)
            subprocess.run(["gcc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-Icore", "-c",
                            str(path), "-o", f"{folder}/table.o"], cwd=ROOT, check=True)


if __name__ == "__main__":
    unittest.main()
