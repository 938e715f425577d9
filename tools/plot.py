#!/usr/bin/python3
"""Draws what klingel describes: see klingel_plot/figure.py and `plot.py --help`."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from klingel_plot.app import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
