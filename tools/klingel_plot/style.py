"""The house style: one place for the colours, fonts and sizes of every picture."""

from __future__ import annotations

# Told apart by people who see colours differently (Okabe and Ito); by role, so that the same thing looks the same
# in every panel.
COLOURS = {"first": "#0072B2", "second": "#D55E00", "third": "#009E73", "fourth": "#CC79A7", "fifth": "#E69F00",
           "sixth": "#56B4E9", "ink": "#222222", "quiet": "#8C8C8C"}
PENS = {"solid": "-", "dashed": (0, (5, 2.5)), "dotted": (0, (1, 1.8)), "points": "none"}

WIDTH_IN = 11.0  # of a picture, whatever its grid; CLI_PLOT_WIDTH_MM of cli_plot.h
ROW_IN = 2.9  # of one row of the grid
HEAD_IN = 0.75  # title and notes
DPI = 130
LINE, THIN = 1.6, 0.7
PALE = 0.10  # opacity of filled areas

SETTINGS = {
    "font.family": "DejaVu Sans", "font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left",
    "axes.titleweight": "bold", "axes.labelsize": 9, "legend.fontsize": 8, "legend.frameon": False,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#666666", "axes.linewidth": 0.8,
    "axes.grid": True, "grid.color": "#E3E3E3", "grid.linewidth": 0.6, "axes.axisbelow": True,
    "xtick.color": "#666666", "ytick.color": "#666666", "xtick.labelcolor": "#222222", "ytick.labelcolor": "#222222",
    "svg.hashsalt": "klingel", "svg.fonttype": "none", "pdf.fonttype": 42,
}
