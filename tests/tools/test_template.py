#!/usr/bin/python3
"""port/template compiles and links as it is: what is to be copied is whole."""
import os
import pathlib
import subprocess
import tempfile
import unittest

from cli import DEMO, ROOT, WAGON, output

BUILD = os.environ.get("BUILD", "build")
FLAGS = ("-std=c11 -O2 -ffreestanding -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wvla "
         "-Werror -Icore -Iport -Iport/template -DKL_FIRMWARE_MODEL=wagon").split()


class Template(unittest.TestCase):
    def test_it_is_whole(self):
        for compiler in ("gcc", "clang"):
            with self.subTest(compiler=compiler), tempfile.TemporaryDirectory() as name:
                folder = pathlib.Path(name)
                output("build", WAGON, DEMO, "--name", "wagon", "-o", folder / "wagon.c")
                done = subprocess.run([compiler, *FLAGS, "port/template/main.c", "port/template/board.c",
                                       folder / "wagon.c", f"{BUILD}/libklingel_port.a", f"{BUILD}/libklingel_core.a",
                                       "-o", folder / "firmware"], cwd=ROOT, capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
