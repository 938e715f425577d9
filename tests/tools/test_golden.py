#!/usr/bin/python3
"""The golden suite's own rules: what it runs, what it says of a difference, when it asks for another model version.

usage: KLINGEL=build/klingel python3 tests/tools/test_golden.py [-v]
"""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import io
import pathlib
import re
import sys
import tempfile
import unittest
from unittest import mock

from cli import ROOT

sys.path.insert(0, str(ROOT / "tests/golden"))
import golden  # noqa: E402
import scenarios  # noqa: E402

LAWS = ("linear", "she", "polach", "fastsim", "fastsim_elliptic", "table")  # models/README.md, core/kl_creep.h


class Coverage(unittest.TestCase):
    def test_every_model_and_track(self) -> None:
        ran = scenarios.all_scenarios()
        self.assertEqual(len({s.name for s in ran}), len(ran))
        for path in (ROOT / "models").glob("*.yaml"):
            self.assertIn(f"models/{path.name}", {s.vehicle for s in ran} | {s.track for s in ran})

    def test_every_law(self) -> None:
        text = "".join((ROOT / s.vehicle).read_text() for s in scenarios.LAWS)
        self.assertEqual(set(re.findall(r"creep: \{law: (\w+)", text)), set(LAWS))
        names = re.findall(r"KL_CREEP_(\w+)", (ROOT / "core/kl_contact.h").read_text().split("enum kl_creep_law {")[1].split("}")[0])
        self.assertEqual({n.lower() for n in names if n != "LAWS"}, set(LAWS))

    def test_a_new_file_comes_in_by_itself(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            (pathlib.Path(name) / "tram.yaml").write_text("name: tram\nwheelsets:\n  - name: a\n")
            (pathlib.Path(name) / "loop.yaml").write_text("name: loop\nsegments: []\n")
            found = {s.name: s for s in scenarios.all_scenarios(pathlib.Path(name))}
        self.assertEqual(found["tram"].vehicle, "models/tram.yaml")
        self.assertEqual((found["wagon_on_loop"].vehicle, found["wagon_on_loop"].track), (scenarios.WAGON, "models/loop.yaml"))

    def test_models_are_spread_over_programs(self) -> None:
        models = [golden.Model(None, None, str(i), 1000 * size, False) for i, size in enumerate((900, 900, 900, 3000, 100))]
        groups = golden.groups_of(models, golden.FLASH)
        self.assertEqual([[m.symbol for m in group] for group in groups], [["0", "1"], ["2"], ["3"], ["4"]])
        self.assertEqual(len(golden.groups_of(models, 1 << 40)), 1)


def result(y_mm: float = 1.0, state: str = "aa", inputs: str = "files") -> golden.Result:
    return golden.Result({"model": "11", "state": state, "output": "bb"}, 0, [[0.5, "a0", "b0", 0.5], [1.0, state, "b1", y_mm]],
                         1000, ["t_s", "state", "output", "front.y_mm"], inputs)


class Rules(unittest.TestCase):
    """golden.py with builds that are told what to compute."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="klingel-golden")
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "golden.json"
        self.now = {"wagon": result()}
        self.version = 7
        self.enterContext(mock.patch.object(golden, "perform", lambda build, out: golden.Outcome(build, copy.deepcopy(self.now), 0.1)))
        self.enterContext(mock.patch.object(golden, "model_version", lambda: self.version))

    def call(self, *arguments: str) -> tuple[str, str]:
        """What it prints, and what it ends with; "": well."""
        out = io.StringIO()
        words = ["golden.py", "--golden", str(self.path), "--only", "x86-64 gcc -O0 double", *arguments]
        with contextlib.redirect_stdout(out), mock.patch.object(sys, "argv", words):
            try:
                golden.main()
            except SystemExit as end:
                return out.getvalue(), str(end.code)
        return out.getvalue(), ""

    def test_record_then_check(self) -> None:
        out, end = self.call("--record")
        self.assertEqual(end, "")
        self.assertIn("changed, double: scenario wagon is new", out)
        out, end = self.call()
        self.assertEqual(end, "")
        self.assertIn("model version 7", out)
        self.assertEqual(golden.load(self.path).reals["double"], self.now)

    def test_a_difference_is_told_in_units(self) -> None:
        self.call("--record")
        self.now = {"wagon": result(1.25, "cc")}
        out, end = self.call()
        self.assertIn("wagon: state differ; streams part before 1 s; front.y_mm by up to 0.25 (1 -> 1.25 at 1 s)", out)
        self.assertIn("the bits moved; to accept", end)
        out, end = self.call("--record")
        self.assertEqual(end, "")
        self.assertIn("changed, double: wagon: state differ; streams part before 1 s; front.y_mm by up to 0.25", out)

    def test_a_released_version_must_be_raised(self) -> None:
        self.call("--record")
        self.assertIn("version 7 is released", self.call("--release")[0])
        before = self.path.read_text()
        self.now = {"wagon": result(1.25, "cc")}
        self.assertIn("numerics changed, raise KL_MODEL_VERSION and re-record", self.call()[1])
        self.assertIn("raise KL_MODEL_VERSION in core/kl_vehicle.h, then record again. Nothing was written", self.call("--record")[1])
        self.assertEqual(self.path.read_text(), before)
        self.version = 8
        self.assertIn("KL_MODEL_VERSION is 8, and recorded is 7", self.call()[1])
        self.assertEqual(self.call("--record")[1], "")
        self.assertEqual(self.call()[1], "")
        again = golden.load(self.path)
        self.assertEqual((again.version, again.released), (8, False))

    def test_a_changed_model_file_is_no_change_of_numerics(self) -> None:
        self.call("--record")
        self.call("--release")
        self.now = {"wagon": result(1.25, "cc", "other files"), "tram": result()}
        out, end = self.call("--record")
        self.assertEqual(end, "")
        self.assertIn("(its files changed)", out)
        self.assertTrue(golden.load(self.path).released)

    def test_release_needs_a_recording_of_this_version(self) -> None:
        self.call("--record")
        self.version = 8
        self.assertIn("--record first", self.call("--release")[1])

    def test_shorter_runs_are_compared_as_far_as_they_went(self) -> None:
        self.call("--record")
        short = result()
        self.now = {"wagon": dataclasses.replace(short, steps=500, trace=short.trace[:1], hashes=short.hashes | {"state": "zz"})}
        self.assertEqual(self.call()[1], "")
        self.now["wagon"].trace[0][1] = "a1"
        self.assertIn("streams part before 0.5 s; by less than the trace shows", self.call()[0])


if __name__ == "__main__":
    unittest.main()
