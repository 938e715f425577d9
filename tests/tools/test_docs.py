#!/usr/bin/python3
"""Every command and program in the documentation is run or compiled."""
import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = os.environ.get("BUILD", "build")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(language: str) -> list[tuple[pathlib.Path, str]]:
    pattern = re.compile(rf"^```{language}\n(.*?)^```", re.M | re.S)
    return [(page, block) for page in PAGES for block in pattern.findall(page.read_text())]


class Documentation(unittest.TestCase):
    def test_commands_run(self):
        commands = [(page, line) for page, block in blocks("sh") for line in block.splitlines() if line]
        self.assertGreaterEqual(len(commands), 8)
        for page, line in commands:
            with self.subTest(page=page.name, command=line):
                words = shlex.split(line.replace("build/", f"{BUILD}/"))
                done = subprocess.run(words, cwd=ROOT, capture_output=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, done.stderr.decode())

    def test_programs_compile(self):
        programs = blocks("c")
        self.assertGreaterEqual(len(programs), 1)
        for page, source in programs:
            with self.subTest(page=page.name), tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "sample.c"
                path.write_text(source)
                done = subprocess.run(["gcc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Icore",
                                       "-c", str(path), "-o", f"{folder}/sample.o"], cwd=ROOT,
                                      capture_output=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr.decode())

    def test_links_lead_somewhere(self):
        for page in [*PAGES, ROOT / "models" / "README.md"]:
            for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
                if not target.startswith("http"):
                    self.assertTrue((page.parent / target).exists(), f"{page.name}: {target}")


if __name__ == "__main__":
    unittest.main()
