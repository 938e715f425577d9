#!/usr/bin/python3
"""The scripts of docs/: what they print is what their pages state.

usage: KLINGEL=build/klingel python3 tests/tools/test_pages.py [-v]
"""

from __future__ import annotations

import subprocess
import unittest

from cli import KLINGEL, ROOT, InFolder


class CreepLaws(InFolder):
    def test_polach_and_spin(self) -> None:
        """docs/creep_laws.md states what docs/creep_spin.py prints, within one unit of the last digit."""
        done = subprocess.run(["/usr/bin/python3", "-B", "docs/creep_spin.py", "--klingel", str(KLINGEL)], cwd=ROOT,
                              capture_output=True, text=True, timeout=120, check=True)
        page = (ROOT / "docs/creep_laws.md").read_text().splitlines()
        for first, name, words in (("0 to 0.3", "0 to 0.3", 6), ("0.3 to 1", "0.3 to 1", 6), ("1 to 2", "1 to 2", 6),
                                   ("2 to 6", "2 to 6", 6), ("T1", "T1 kN", 4), ("T2", "T2 kN", 4)):
            with self.subTest(row=first):
                printed = next(line for line in done.stdout.splitlines() if line.startswith(first)).split()[-words:]
                stated = next(line for line in page if line.startswith(f"| {name} |")).split("|")[2:2 + words]
                for one, other in zip(printed, stated, strict=True):
                    digits = len(other.strip().partition(".")[2])
                    self.assertAlmostEqual(float(one), float(other), delta=1.001 * 10.0 ** -digits)


class ContactGeometry(InFolder):
    def test_figures_of_the_page(self) -> None:
        """docs/contact_geometry.md states what its script prints, within one unit of the last digit; pictures come out."""
        done = subprocess.run(["/usr/bin/python3", "-B", "docs/contact_geometry.py", "--klingel", str(KLINGEL), "--output",
                               str(self.folder)], cwd=ROOT, capture_output=True, text=True, timeout=120, check=True)
        page = (ROOT / "docs/contact_geometry.md").read_text()
        for first, words in (("contact on the right wheel", 3), ("contact on the left wheel", 3),
                             ("rolling-radius difference", 3), ("right contact angle", 3),
                             ("E1", 4), ("E3", 4), ("E5", 4), ("E7", 4)):
            with self.subTest(row=first):
                printed = next(line for line in done.stdout.splitlines() if line.startswith(first)).split()[-words:]
                stated = next(line for line in page.splitlines() if line.startswith(f"| {first}")).split("|")[2:2 + words]
                for one, other in zip(printed, stated, strict=True):
                    digits = len(other.strip().partition(".")[2])
                    self.assertAlmostEqual(float(one), float(other), delta=1.001 * 10.0 ** -digits)
        for name in ("contact_geometry_contact.png", "contact_geometry_en15302.png"):
            self.assertGreater((self.folder / name).stat().st_size, 50_000)

    def test_measured_profiles(self) -> None:
        """The same for what scatter of the points does to contact, creep coefficients and conicity."""
        done = subprocess.run(["/usr/bin/python3", "-B", "docs/measured_profiles.py", "--klingel", str(KLINGEL), "--spacing", "0.2"],
                              cwd=ROOT, capture_output=True, text=True, timeout=120, check=True)
        page = (ROOT / "docs/contact_geometry.md").read_text()
        printed = done.stdout.splitlines()[-1].split()[1:]
        stated = next(line for line in page.splitlines() if line.startswith("| 0.2 mm |")).split("|")[2:-1]
        for one, other in zip(printed, stated, strict=True):
            digits = len(other.split()[0].partition(".")[2])
            self.assertAlmostEqual(float(one), float(other.split()[0]), delta=1.001 * 10.0 ** -digits)


if __name__ == "__main__":
    unittest.main()
