#!/usr/bin/python3
"""The mistakes that users make, made in every vehicle of models/: each is refused with file, line and reason.

usage: KLINGEL=build/klingel python3 tests/tools/test_model_mistakes.py [-v]

tests/tools/test_model_errors.c has one file for every message; here the files are those that people copy and change.
"""

from __future__ import annotations

import pathlib
import re
import shutil
import unittest

from cli import ROOT, InFolder, klingel

VEHICLES = sorted(p for p in (ROOT / "models").glob("*.yaml") if re.search(r"^wheelsets:", p.read_text(), re.M))
LOST = """  - name: lost
    mass_kg: 1000
    inertia_roll_kgm2: 1e3
    inertia_pitch_kgm2: 1e3
    inertia_yaw_kgm2: 1e3
    x_m: 0
    height_m: 1
    freedoms: [y, z, roll, pitch, yaw]
"""


class Mistakes(InFolder):
    def setUp(self) -> None:
        super().setUp()
        shutil.copytree(ROOT / "models/profiles", self.folder / "profiles")

    def refused(self, source: pathlib.Path, lines: list[str], number: int, reason: str) -> None:
        """Line `number`, from 1, is named, with that reason; nothing is built."""
        path = self.folder / source.name
        path.write_text("".join(lines))
        done = klingel("run", path, "--speed", "1", "--time", "0.001")
        with self.subTest(model=source.name, reason=reason):
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            told = [line for line in done.stderr.splitlines() if line.startswith(f"{path}:{number}: ")]
            self.assertTrue(told and reason in told[0], done.stderr)

    def each(self, pattern: str, replacement: str, reason: str) -> None:
        """The mistake in the first line that has that pattern, and in the last one."""
        for source in VEHICLES:
            lines = source.read_text().splitlines(keepends=True)
            at = [i for i, line in enumerate(lines) if re.search(pattern, line)]
            for i in {at[0], at[-1]} if at else ():
                changed = re.sub(pattern, replacement, lines[i], count=1)
                self.refused(source, [*lines[:i], changed, *lines[i + 1:]], i + 1, reason)

    def test_typing_errors(self) -> None:
        self.each(r"^    inertia_yaw_kgm2", "    inertia_yav_kgm2", "did you mean inertia_yaw_kgm2?")
        self.each(r"law: (she|linear)", "law: shee", "must be one of")
        self.each(r"^    pair: \w+", "    pair: nothing", "no such pair")
        self.each(r"between: \[\w+,", "between: [nobody,", "no such body or wheelset")
        self.each(r"\{of: \w+,", "{of: nobody,", "no such body or wheelset")
        self.each(r"mass_kg: [\d.e]+", "mass_kg: 12OO", "must be a finite number")

    def test_missing_units(self) -> None:
        self.each(r"mass_kg:", "mass:", "the unit is missing: mass_kg")
        self.each(r"^    x_m:", "    x:", "the unit is missing: x_m")
        self.each(r"k_N_m: \[", "k: [", "the unit is missing")

    def test_negative_and_zero_masses(self) -> None:
        for wrong in ("-1000", "0", "-1e-9"):
            self.each(r"^    mass_kg: [\d.e]+", f"    mass_kg: {wrong}", "must be > 0")
        self.each(r"inertia_roll_kgm2: [\d.e]+", "inertia_roll_kgm2: -7", "must be > 0")

    def test_disconnected_bodies(self) -> None:
        """A body that somebody added and tied to nothing; it stands behind all others."""
        for source in VEHICLES:
            lines = source.read_text().splitlines(keepends=True)
            if "bodies:\n" in lines:
                end = lines.index("wheelsets:\n")
                while not lines[end - 1].strip() or lines[end - 1].startswith("#"):
                    end -= 1
                self.refused(source, [*lines[:end], *LOST.splitlines(keepends=True), *lines[end:]], end + 1, "nothing ties it")

    def test_singular_mass_matrices(self) -> None:
        """An inertia that some exponent made nothing: the springs would turn it faster than any step can follow."""
        for source in VEHICLES:
            lines = source.read_text().splitlines(keepends=True)
            for i, line in enumerate(lines):
                if "name: body" in line or "name: lead" in line or "name: frame" in line:
                    yaw = next(k for k in range(i, len(lines)) if "inertia_yaw_kgm2" in lines[k])
                    changed = [*lines[:yaw], "    inertia_yaw_kgm2: 1e-9\n", *lines[yaw + 1:]]
                    self.refused(source, changed, i + 1, "mass or inertia too small")

    def test_loops_of_linkages(self) -> None:
        """The same two wheelsets tied rigidly twice, the second time with all factors doubled."""
        for source in VEHICLES:
            text = source.read_text()
            if "\nlinkages:\n" not in text:
                continue
            head, linkages = text.split("\nlinkages:\n")
            terms = re.match(r"  - name: \w+\n    terms:\n((?:      - .*\n)+)", linkages).group(1)
            twice = re.sub(r"factor: ([-\d.]+)", lambda m: f"factor: {2 * float(m.group(1))}", terms)
            loop = "".join(f"  - name: {name}\n    terms:\n{part}    rigid: true\n" for name, part in (("one", terms), ("two", twice)))
            lines = f"{head}\nlinkages:\n{loop}".splitlines(keepends=True)
            self.refused(source, lines, lines.index("  - name: two\n") + 1, "loop")


if __name__ == "__main__":
    unittest.main()
