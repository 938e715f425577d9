#!/usr/bin/python3
"""klingel build: the C source of a model, compiled as firmware would, steps to the same bits.

usage: KLINGEL=build/klingel python3 tests/tools/test_cli_build.py [-v]
"""

from __future__ import annotations

import pathlib
import shutil
import subprocess
import tempfile
import unittest

from cli import CURVE, DEMO, KLINGEL, LINEAR, RESTRAINED, ROOT, WAGON, output

STRICT = ("-std=c11 -ffp-contract=off -O2 -ffreestanding -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow "
          "-Wundef -Wvla -Werror").split()


class Build(unittest.TestCase):
    def run_built(self, compiler: str, folder: pathlib.Path, *arguments: str) -> None:
        source = folder / "model.c"
        vehicle, speed = arguments[0], "25"
        said = output("build", *arguments, "-o", source, "--name", "bench_model")
        self.assertIn("const struct kl_model bench_model", said)
        made = subprocess.run([compiler, *STRICT, f"-I{ROOT}/core", "-c", str(source), "-o", str(folder / "model.o")],
                              capture_output=True, text=True, check=False)
        self.assertEqual((made.returncode, made.stderr), (0, ""))
        program = folder / "run_built"
        subprocess.run([compiler, *STRICT[:3], "-DMODEL=bench_model", f"-I{ROOT}/core",
                        str(ROOT / "tests/tools/fixtures/run_built.c"), str(folder / "model.o"),
                        str(KLINGEL.parent / "libklingel_core.a"), "-o", str(program)], check=True)
        stepped = subprocess.run([str(program), speed, "3000"], capture_output=True, text=True, check=False)
        self.assertEqual(stepped.returncode, 0, "kl_model_check refused the built model")
        self.assertEqual(stepped.stdout, output("run", vehicle, *arguments[1:], "--speed", speed, "--time", "3", "--final-hash"))

    def test_built_models_are_the_same(self) -> None:
        for compiler in filter(shutil.which, ("gcc", "clang")):
            for arguments in ((WAGON, DEMO), (WAGON, CURVE), (WAGON,), (LINEAR,), (RESTRAINED, "models/s_curve.yaml"),
                              ("models/cross_braced_rigid.yaml",), ("tests/tools/good/elements.yaml",),
                              ("tests/tools/good/train.yaml",)):
                with self.subTest(compiler=compiler, arguments=arguments), tempfile.TemporaryDirectory() as folder:
                    self.run_built(compiler, pathlib.Path(folder), *arguments)

    def test_wrong_real_type_is_refused(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "model.c"
            output("build", RESTRAINED, "-o", source)
            made = subprocess.run(["gcc", *STRICT, "-DKL_REAL_FLOAT", f"-I{ROOT}/core", "-c", str(source), "-o", "/dev/null"],
                                  capture_output=True, text=True, check=False)
            self.assertNotEqual(made.returncode, 0)
            self.assertIn("built for another real type", made.stderr)


if __name__ == "__main__":
    unittest.main()
