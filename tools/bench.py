#!/usr/bin/python3
"""The CAN bench: see klingel_bench/ and `bench.py --help`."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from klingel_bench.app import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
