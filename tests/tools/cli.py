"""Shared by the tests of the klingel command: where it is, running it, reading its CSV."""

from __future__ import annotations

import csv
import io
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
KLINGEL = pathlib.Path(os.environ.get("KLINGEL", "build/klingel"))
KLINGEL = KLINGEL if KLINGEL.is_absolute() else ROOT / KLINGEL
WAGON, RESTRAINED, FREE = "models/two_axle_wagon.yaml", "models/restrained_wheelset.yaml", "models/free_wheelset.yaml"
ARCS, DEMO, CURVE = "models/wickens_arcs.yaml", "models/demo_track.yaml", "models/curve_r600.yaml"
LINEAR = "tests/tools/fixtures/linear_two_axle.yaml"
CREEP = "models/creep/contact.csv"
COMMANDS = ("geometry", "conicity", "creep", "run", "modes", "bench", "hil", "dbc", "signals", "build", "critical", "curve",
            "ride", "sketch")


class InFolder(unittest.TestCase):
    """Each test has a folder of its own."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="klingel-test")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


def klingel(*arguments: object, timeout: float = 60, **more) -> subprocess.CompletedProcess:
    """Runs it in the project's root; nothing is on a terminal."""
    return subprocess.run([str(KLINGEL), *map(str, arguments)], cwd=ROOT, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, timeout=timeout, check=False, errors="replace", **more)


def output(*arguments: object) -> str:
    """Standard output of a run that must succeed without a word of complaint."""
    done = klingel(*arguments)
    if done.returncode != 0 or done.stderr:
        raise AssertionError(f"klingel {' '.join(map(str, arguments))}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def rows(text: str) -> list[dict[str, str]]:
    """CSV text; comment lines begin with #."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return list(csv.DictReader(io.StringIO("\n".join(lines))))


def reference(name: str) -> list[dict[str, str]]:
    return rows((ROOT / "tests/reference" / name).read_text())
