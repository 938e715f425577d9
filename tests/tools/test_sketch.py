#!/usr/bin/python3
"""klingel sketch: what it draws of a file, and that the sketches beside models/README.md are those of the files.

usage: KLINGEL=build/klingel python3 tests/tools/test_sketch.py [-v]
"""

from __future__ import annotations

import json
import os
import pathlib
import re
import struct
import sys
import tempfile
import unittest
import zlib

from cli import ROOT, WAGON, klingel

sys.path.insert(0, str(ROOT / "tools"))
from klingel_plot.figure import fingerprint  # noqa: E402

COACH = "models/manchester_vehicle1.yaml"
VEHICLES = sorted(p for p in (ROOT / "models").glob("*.yaml")
                  if re.search(r"^(wheelsets|vehicles):", p.read_text(), re.M))
ECHO = "import shutil, sys\nshutil.copyfileobj(sys.stdin.buffer, sys.stdout.buffer)\n"


def description(model: object) -> dict:
    """What klingel asks to be drawn; a program that gives it back stands in for the one that draws."""
    with tempfile.TemporaryDirectory(prefix="klingel-sketch") as folder:
        echo, picture = pathlib.Path(folder, "echo.py"), pathlib.Path(folder, "sketch.png")
        echo.write_text(ECHO)
        done = klingel("sketch", model, "-o", picture, env={**os.environ, "KLINGEL_PLOT": str(echo)})
        if done.returncode != 0 or done.stderr:
            raise AssertionError(f"{model}: {done.stderr}")
        return json.loads(picture.read_text())


def items(drawn: dict, kind: str) -> list[dict]:
    return [item for item in drawn["panels"][0]["items"] if item["kind"] == kind]


def words(drawn: dict, boxed: bool = False) -> list[str]:
    return [item["text"] for item in items(drawn, "word") if item["boxed"] == boxed]


def png_texts(path: pathlib.Path) -> dict[str, str]:
    """The text chunks of a PNG file, whose check sums must be right."""
    data, at, texts = path.read_bytes(), 8, {}
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if zlib.crc32(kind + body) != struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0]:
            raise AssertionError(f"{path}: damaged")
        if kind == b"tEXt":
            key, text = body.split(b"\0", 1)
            texts[key.decode()] = text.decode()
        at += 12 + size
    return texts


class Sketches(unittest.TestCase):
    def test_those_of_the_models_are_up_to_date(self) -> None:
        """By what they show, not by their bytes, which change with the version of Matplotlib."""
        readme = (ROOT / "models/README.md").read_text()
        for model in VEHICLES:
            picture = ROOT / "models/sketches" / f"{model.stem}.png"
            self.assertTrue(picture.exists(), f"{picture} is missing: make sketches")
            self.assertEqual(png_texts(picture)["Description"], fingerprint(description(model)),
                             f"{model.name} has changed: make sketches")
            self.assertTrue(f"sketches/{model.stem}.png" in readme, f"models/README.md does not show {model.stem}")
        drawn = {p.stem for p in (ROOT / "models/sketches").glob("*.png")}
        self.assertEqual(drawn, {p.stem for p in VEHICLES})

    def test_coach(self) -> None:
        drawn = description(COACH)
        text = words(drawn)
        for distance in ("2.56 m", "16.44 m", "21.56 m", "1.5 m"):  # Iwnicki 1998: 19 m between pivots, 2.56 m
            self.assertIn(distance, text)
        for line in ("body: 32 t, centre at h 1.8 m; I 56.8, 1970, 1970 t m²",
                     "primary_w1 .. primary_w4 (8): at y ±1, h 0.46 m; k 31.391, 3.884, 1.22 MN/m; c 15, 2, 4 kN s/m",
                     "bump_stop_front (2): at y 0, h 0.65 m; along y; stop to 230 kN at 65 mm"):
            self.assertIn(line, text)
        # 44482 kg * 9.81 m/s2 / 4
        self.assertIn("w1 .. w4 (4): 1.813 t; I 1.12, 0.112, 1.12 t m²; radius 0.46 m, s1002_uic60; axle load 109.09 kN", text)
        numbers = words(drawn, boxed=True)
        for number in "1234":  # in the list and in a view at least
            self.assertGreaterEqual(numbers.count(number), 2)
        self.assertNotIn("5", numbers)

    def test_bodies_are_boxes_of_their_inertia(self) -> None:
        """The wagon's inertias are those of a box of 14 x 2.5 x 2.2 m (its file says so), its wheels stand 9 m apart."""
        drawn = description(WAGON)
        boxes = [(max(i["x"]) - min(i["x"]), max(i["y"]) - min(i["y"])) for i in items(drawn, "fill")]
        wide, high = max(boxes[:12])
        scale = wide / 14
        self.assertAlmostEqual(high / scale, 2.2, delta=0.02)
        plan = max(b for b in boxes if abs(b[1] / scale - 2.5) < 0.03)
        self.assertAlmostEqual(plan[0] / scale, 14, delta=0.01)

    def test_everything_has_a_symbol(self) -> None:
        drawn = description("tests/tools/good/elements.yaml")
        for name in ("spring", "damper", "stop", "spring and damper in series", "friction", "actuator", "linkage"):
            self.assertIn(name, words(drawn))
        colours = {i["colour"] for i in items(drawn, "line")}
        self.assertLessEqual({"first", "second", "third", "fourth", "fifth", "ink", "quiet"}, colours)
        numbers = words(drawn, boxed=True)
        for n in range(1, 14):
            self.assertGreaterEqual(numbers.count(str(n)), 2, n)
        width, height = drawn["panels"][0]["sheet_mm"]
        for item in items(drawn, "line"):  # on the sheet
            self.assertTrue(all(x is None or 0 <= x <= width for x in item["x"]))
            self.assertTrue(all(y is None or 0 <= y <= height for y in item["y"]))

    def test_every_number_of_the_list_stands_in_a_view(self) -> None:
        for model in VEHICLES:
            numbers = words(description(model), boxed=True)
            for number in set(numbers):
                self.assertGreaterEqual(numbers.count(number), 2, (model.name, number))

    def test_long_train_is_cut(self) -> None:
        text = words(description("models/ten_coaches.yaml"))
        self.assertIn("side view, the leading end; forward is to the right", text)
        self.assertTrue(any(line.startswith("coupling_1 .. coupling_9 (9): ") for line in text))

    def test_refusals(self) -> None:
        for arguments, reason in ((("-o", "a.gif"), "must end in .png, .pdf or .svg"), ((), "-o PICTURE is missing")):
            done = klingel("sketch", WAGON, *arguments)
            self.assertEqual(done.returncode, 2)
            self.assertIn(reason, done.stderr)


if __name__ == "__main__":
    unittest.main()
