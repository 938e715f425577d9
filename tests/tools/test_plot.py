#!/usr/bin/python3
"""Pictures: klingel ... --plot, and tools/plot.py by itself.

usage: KLINGEL=build/klingel python3 tests/tools/test_plot.py [-v]
"""

from __future__ import annotations

import io
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import matplotlib.image

from cli import FREE, KLINGEL, ROOT, WAGON, klingel, output

PLOT = ROOT / "tools/plot.py"
PANEL = {"row": 0, "column": 0, "rows": 1, "columns": 1, "title": "t", "x_label": "x [m]", "y_label": None, "x_range": None,
         "y_range": None, "equal": False, "y_down": False, "items": []}
STYLE = {"colour": "first", "pen": "solid", "thin": False, "label": None}


def draw(text: str) -> subprocess.CompletedProcess:
    return subprocess.run(["/usr/bin/python3", "-B", str(PLOT)], input=text.encode(), capture_output=True, timeout=60,
                          check=False)


def described(*items: dict, **changes: object) -> str:
    panel = PANEL | {"items": [STYLE | item for item in items]}
    return json.dumps({"klingel_plot": 1, "format": "png", "title": "T", "notes": None, "panels": [panel]} | changes)


class Pictures(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="klingel-plot")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_drawn(self, picture, width: int = 1430, least: float = 0.02) -> None:
        """As wide as every picture is, and not blank: so much of it is not white, in many colours."""
        image = matplotlib.image.imread(picture, format="png")[:, :, :3]
        self.assertEqual(image.shape[1], width)
        self.assertGreater((image.min(axis=2) < 0.9).mean(), least)
        self.assertGreater(len({tuple(pixel) for pixel in (image[::2, ::2].reshape(-1, 3) * 8).round()}), 12)

    def test_geometry(self) -> None:
        path = self.folder / "geometry.png"
        text = output("geometry", WAGON, "--plot", path)
        self.assertEqual(text.splitlines()[-6:], output("geometry", WAGON).splitlines()[-6:])
        self.assert_drawn(path)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["geometry.png"])

    def test_geometry_without_profiles(self) -> None:
        path = self.folder / "linear.png"
        output("geometry", FREE, "--plot", path)
        self.assert_drawn(path, least=0.01)

    def test_conicity(self) -> None:
        path = self.folder / "conicity.png"
        output("conicity", WAGON, "--to", "7", "--gauge", "1434:1436:1", "--plot", path)
        self.assert_drawn(path, least=0.015)

    def test_other_formats_and_standard_output(self) -> None:
        for name, begins in (("c.pdf", b"%PDF"), ("c.svg", b"<?xml")):
            output("conicity", FREE, "--plot", self.folder / name)
            first = (self.folder / name).read_bytes()
            self.assertTrue(first.startswith(begins))
            output("conicity", FREE, "--plot", self.folder / name)
            self.assertEqual(first, (self.folder / name).read_bytes(), "the same twice")
        done = subprocess.run([str(KLINGEL), "conicity", FREE, "--plot", "-"], cwd=ROOT, capture_output=True, check=True,
                              timeout=60)
        self.assert_drawn(io.BytesIO(done.stdout), least=0.01)

    def refuses(self, *arguments: object, says: str, status: int, **environment: str) -> None:
        done = klingel(*arguments, env={**os.environ, **environment})
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertIn(says, done.stderr)

    def test_names(self) -> None:
        for name in ("picture", "picture.jpg", "models/two_axle_wagon.yaml"):
            self.refuses("conicity", FREE, "--plot", name, says="must end in .png, .pdf or .svg", status=2)
        self.refuses("conicity", FREE, "--plot", self.folder / "no/where.png", says="cannot write", status=1)

    def test_no_matplotlib(self) -> None:
        (self.folder / "matplotlib.py").write_text("raise ModuleNotFoundError('no', name='matplotlib')\n")
        path = self.folder / "p.png"
        self.refuses("conicity", FREE, "--plot", path, says="no picture: the Python module matplotlib is missing "
                     "(Debian package python3-matplotlib)", status=1, PYTHONPATH=str(self.folder))
        self.assertFalse(path.exists())

    def test_no_program(self) -> None:
        path = self.folder / "p.png"
        path.write_bytes(b"old")
        self.refuses("conicity", FREE, "--plot", path, says="no picture: ", status=1, KLINGEL_PLOT="/nowhere/plot.py")
        self.assertEqual(path.read_bytes(), b"old")


class Program(unittest.TestCase):
    def test_help(self) -> None:
        done = subprocess.run([str(PLOT), "--help"], capture_output=True, text=True, timeout=60, check=True)
        self.assertIn('"kind": "rays"', done.stdout)

    def test_every_item(self) -> None:
        done = draw(described({"kind": "line", "x": [0, 1, None, 2], "y": [0, 1, None, 3], "label": "l"},
                              {"kind": "line", "x": [0, 1], "y": [0, 1], "pen": "points"},
                              {"kind": "rays", "x0": [0], "y0": [0], "x1": [1], "y1": [1]},
                              {"kind": "mark", "axis": "x", "at": 0.5, "text": "here"},
                              {"kind": "mark", "axis": "y", "at": 0.5, "text": "there"},
                              {"kind": "text", "at": [1, 1], "text": "word"}, notes="n"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout.startswith(b"\x89PNG"))

    def test_bad_descriptions(self) -> None:
        line = {"kind": "line", "x": [0], "y": [0]}
        for text in ("", "{", "[]", "null", described(klingel_plot=2), described(panels=[]), described(format="exe"),
                     described(panels=[{}]), described({"kind": "circle"}), described(line | {"colour": "pink"}),
                     described(line | {"y": [0, 1]}), described(line | {"x": ["a"]}), described({"kind": "text", "at": []})):
            with self.subTest(text=text):
                done = draw(text)
                self.assertEqual((done.returncode, done.stdout), (1, b""))
                self.assertEqual(done.stderr.count(b"\n"), 1, done.stderr.decode())


if __name__ == "__main__":
    unittest.main()
