#!/usr/bin/python3
"""What tells of time: klingel bench by stage and by model, klingel hil beside cyclictest.

usage: KLINGEL=build/klingel python3 tests/tools/test_timing.py [-v]
"""

from __future__ import annotations

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import matplotlib.image

from cli import DEMO, KLINGEL, RESTRAINED, ROOT, WAGON, klingel, output

sys.path.insert(0, str(ROOT / "tools"))
import cyclictest  # noqa: E402

STAGES = ("track", "placing", "suspension", "contact", "motion", "inputs_outputs", "other")
SCRIPT = ROOT / "tools/cyclictest.py"


class Temporary(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="klingel-timing")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Bench(Temporary):
    @unittest.skipUnless(shutil.which("valgrind"), "needs valgrind")
    def test_instructions_do_not_depend_on_the_input(self) -> None:
        told = json.loads(output("bench", WAGON, DEMO, "--steps", "1000", "--json", "-", "--instructions"))
        counts = [told[case]["instructions"] for case in ("straight", "track")]
        self.assertTrue(all(1000 < c < 50000 for c in counts), counts)
        self.assertLess(max(counts) / min(counts), 1.1)

    @unittest.skipUnless(shutil.which("valgrind") and shutil.which("addr2line"), "needs valgrind and addr2line")
    def test_stages(self) -> None:
        """They add up to the step; the wagon has springs, a restrained wheelset hardly any; irregularities cost the track
        stage and no other (the step does the same whatever its input)."""
        told = json.loads(output("bench", WAGON, DEMO, "--steps", "1000", "--stages", "--json"))
        counted = json.loads(output("bench", WAGON, DEMO, "--steps", "1000", "--instructions", "--json"))
        for case in ("straight", "track"):
            stages = told[case]["stages"]
            self.assertEqual(tuple(stages), STAGES)
            self.assertAlmostEqual(sum(stages.values()), counted[case]["instructions"], delta=20)
            self.assertTrue(all(n > 0 for n in stages.values()), stages)
            self.assertLess(stages["other"], 0.05 * sum(stages.values()), "functions of the core without a stage")
        straight, track = told["straight"]["stages"], told["track"]["stages"]
        self.assertGreater(track["track"], straight["track"])
        for stage in ("placing", "suspension", "motion"):
            self.assertAlmostEqual(track[stage] / straight[stage], 1.0, delta=0.02)
        text = output("bench", RESTRAINED, "--steps", "1000", "--stages")
        self.assertRegex(text, r"stage +instructions +share +about ns\n +track ")
        one = float(re.search(r" suspension +(\d+) ", text).group(1))
        self.assertLess(one, 0.5 * track["suspension"])

    def test_all_models(self) -> None:
        for name in ("two_axle_wagon.yaml", "restrained_wheelset.yaml", "straight.yaml"):
            (self.folder / name).write_text((ROOT / "models" / name).read_text().replace("profiles/", f"{ROOT}/models/profiles/"))
        (self.folder / "notes.txt").write_text("wheelsets:\n")
        text = output("bench", "--all", self.folder, DEMO, "--steps", "1000")
        self.assertEqual([line.split()[0] for line in text.splitlines()[2::2]], ["restrained_wheelset", "two_axle_wagon"])
        told = json.loads(output("bench", "--all", f"{self.folder}/", "--steps", "1000", "--json", "-"))["models"]
        self.assertEqual([(m["model"], m["states"]) for m in told], [("restrained_wheelset", 5), ("two_axle_wagon", 24)])
        for model in told:
            for case in ("straight", "track"):
                t = model[case]
                self.assertTrue(0 < t["min_ns"] <= t["median_ns"] and t["p99_ns"] <= t["p99_9_ns"] <= t["max_ns"])
                self.assertAlmostEqual(t["median_of_kernel"], t["median_ns"] / model["calibration_ns"], delta=1e-3)

    def test_refusals(self) -> None:
        for arguments, says, status in ((("--all", "/nowhere"), "--all /nowhere: No such file", 1),
                                        (("--all", self.folder), "no vehicle file", 1),
                                        (("--all", "models", WAGON, DEMO), "takes one argument", 2),
                                        (("--all", "models", "--set", "a=1"), "no --set", 2),
                                        ((), "an argument is missing: expected MODEL [TRACK]", 2)):
            done = klingel("bench", *arguments)
            with self.subTest(arguments=arguments):
                self.assertEqual((done.returncode, done.stdout), (status, ""))
                self.assertIn(says, done.stderr)


class Histograms(unittest.TestCase):
    def test_figures(self) -> None:
        h = cyclictest.Histogram()
        h.add({"3": 90, "10": 9}, 1, 3.2, 5000.0, 4.0)
        self.assertEqual((h.count, h.quantile_us(0.5), h.quantile_us(0.99), h.quantile_us(0.999)), (100, 4.0, 11.0, 5000.0))
        x, y = h.later_than()
        self.assertEqual((x[3], y[3]), (4.0, 0.1))
        self.assertEqual((x[-1], y[-1]), (11.0, 0.01))
        h.add({"3": 100}, 0, 3.0, 3.9, 3.5)
        self.assertEqual((h.told()["count"], h.told()["min_us"], h.told()["max_us"]), (200, 3.0, 5000.0))
        self.assertAlmostEqual(h.told()["avg_us"], 3.75)


@unittest.skipUnless(shutil.which("cyclictest"), "needs cyclictest (rt-tests)")
class Cyclictest(Temporary):
    def run_it(self, *arguments: object) -> subprocess.CompletedProcess:
        return subprocess.run(["/usr/bin/python3", "-B", str(SCRIPT), *map(str, arguments)], cwd=ROOT, capture_output=True,
                              text=True, timeout=120, check=False, env={**os.environ, "KLINGEL": str(KLINGEL)})

    def test_both_histograms(self) -> None:
        picture, report = self.folder / "late.png", self.folder / "late.json"
        done = self.run_it(WAGON, DEMO, "--time", 2, "--rounds", 2, "--priority", 0, "--plot", picture, "--json", report)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"cyclictest +\d+ .*\nklingel hil +\d+ .*\n2 s each in 2 turns, every 1000 us")
        told = json.loads(report.read_text())
        for name in ("cyclictest", "klingel hil"):
            self.assertTrue(1000 < told[name]["count"] <= 2000, told[name]["count"])
            self.assertEqual(sum(told[name]["histogram"].values()) + told[name]["overflow"], told[name]["count"])
            self.assertLessEqual(told[name]["p50_us"], told[name]["p99_us"])
        self.assertEqual(matplotlib.image.imread(picture).shape[1], 1430)

    def test_refusals(self) -> None:
        self.assertEqual(self.run_it("--help").returncode, 0)
        for arguments, says, status in (((WAGON, "--priority", 100), "--priority must be within 0..99", 2),
                                        ((WAGON, "--rounds", 0), "--rounds within", 2), ((WAGON, "--plot", "x.gif"), "must end in", 2),
                                        (("none.yaml", "--time", 1), "none.yaml", 1),
                                        ((WAGON, "--klingel", "/nowhere"), "/nowhere", 1)):
            done = self.run_it(*arguments)
            with self.subTest(arguments=arguments):
                self.assertEqual(done.returncode, status)
                self.assertIn(says, done.stderr)
                self.assertNotIn("Traceback", done.stderr)


if __name__ == "__main__":
    unittest.main()
