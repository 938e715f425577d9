#!/usr/bin/python3
"""Every example in the help of every command of klingel runs as it stands there.

usage: KLINGEL=build/klingel python3 tests/tools/test_cli_examples.py [-v]
"""

from __future__ import annotations

import subprocess
import unittest

from cli import COMMANDS, KLINGEL, ROOT, InFolder, output


class Examples(InFolder):
    def test_examples_run(self) -> None:
        for command in COMMANDS:
            if command == "hil":
                continue  # runs on until Ctrl-C
            examples = output(command, "--help").split("example:\n")[1].replace("\\\n", " ")
            for line in examples.strip().splitlines():
                words = [str(ROOT / w) if w.startswith(("models/", "tests/")) else w for w in line.split()]
                with self.subTest(example=line):
                    done = subprocess.run([str(KLINGEL), *words[1:]], cwd=self.folder, capture_output=True, text=True,
                                          timeout=120, check=False)
                    self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
