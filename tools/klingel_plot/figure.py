"""From the description of a picture to Matplotlib.

The description is one JSON object, `?` marks what may be null:

  {"klingel_plot": 1, "format": "png" | "pdf" | "svg", "title": TEXT, "notes": TEXT?, "panels": [PANEL, ...]}

PANEL is a rectangle of cells in a grid whose columns are equally wide:
  {"row": 0, "column": 0, "rows": 1, "columns": 1, "title": TEXT?, "x_label": TEXT?, "y_label": TEXT?,
   "x_range": [low, high]?, "y_range": [low, high]?, "equal": false, "y_down": false, "x_log": false, "y_log": false,
   "items": [ITEM, ...]}
A panel with "sheet_mm": [width, height] has no axes: it is a sheet of paper, drawn on in mm from its lower left corner, as
wide as every picture; then it is the only panel.
`equal`: the same scale on both axes. `x_log`, `y_log`: logarithmic; may be left out. Labels carry the unit in brackets; numbers are in that unit.

ITEM is drawn in the order given; colours and pens are the names in style.py:
  {"kind": "line", STYLE, "x": [...], "y": [...]}                     null in x or y: a gap
  {"kind": "rays", STYLE, "x0": [...], "y0": [...], "x1": [...], "y1": [...]}   separate straight lines
  {"kind": "mark", STYLE, "axis": "x" | "y", "at": NUMBER, "text": TEXT?}        a line across the panel
  {"kind": "text", STYLE, "at": [x, y], "text": TEXT}                 centred there
  {"kind": "fill", STYLE, "x": [...], "y": [...]}                     a polygon in a pale tone, without an edge
  {"kind": "word", STYLE, "at": [x, y], "text": TEXT, "points": SIZE, "align": "l" | "c" | "r", "boxed": BOOL}
STYLE: "colour": NAME, "pen": NAME, "thin": BOOL, "label": TEXT?      label: its name in the legend
"""

from __future__ import annotations

import hashlib
import io
import json
import math
from typing import Any, BinaryIO

from . import style

VERSION = 1


class DescriptionError(ValueError):
    """What was read is no description of a picture."""


def _numbers(values: list[float | None]) -> list[float]:
    return [math.nan if value is None else float(value) for value in values]


def _pen(item: dict[str, Any]) -> dict[str, Any]:
    pen = {"color": style.COLOURS[item["colour"]], "linewidth": style.THIN if item["thin"] else style.LINE,
           "linestyle": style.PENS[item["pen"]]}
    if item["pen"] == "points":
        pen |= {"marker": "o", "markersize": 2.5 if item["thin"] else 4.0, "markeredgewidth": 0.0}
    return pen


def _draw_line(axes, item: dict[str, Any]) -> None:
    axes.plot(_numbers(item["x"]), _numbers(item["y"]), label=item["label"], zorder=3, **_pen(item))


def _draw_rays(axes, item: dict[str, Any]) -> None:
    x: list[float] = []
    y: list[float] = []
    ends = (item["x0"], item["y0"], item["x1"], item["y1"])
    for x0, y0, x1, y1 in zip(*map(_numbers, ends), strict=True):
        x += [x0, x1, math.nan]
        y += [y0, y1, math.nan]
    axes.plot(x, y, label=item["label"], zorder=2.5, **_pen(item))


def _draw_mark(axes, item: dict[str, Any]) -> None:
    """The word stands inside the panel at its upper or right end, on white."""
    box = {"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    pen = _pen(item) | {"linewidth": 1.0}
    if item["axis"] == "x":
        axes.axvline(item["at"], zorder=2, label=item["label"], **pen)
        if item["text"]:
            axes.annotate(item["text"], (item["at"], 0.99), xycoords=("data", "axes fraction"), ha="right", va="top",
                          rotation=90, fontsize=7.5, color=pen["color"], bbox=box, xytext=(-1.5, 0),
                          textcoords="offset points", zorder=2.2)
    else:
        axes.axhline(item["at"], zorder=2, label=item["label"], **pen)
        if item["text"]:
            axes.annotate(item["text"], (0.995, item["at"]), xycoords=("axes fraction", "data"), ha="right",
                          va="bottom", fontsize=7.5, color=pen["color"], bbox=box, zorder=2.2)


def _draw_text(axes, item: dict[str, Any]) -> None:
    axes.text(*item["at"], item["text"], color=style.COLOURS[item["colour"]], ha="center", va="center", fontsize=7.5,
              zorder=4, clip_on=True)


def _draw_fill(axes, item: dict[str, Any]) -> None:
    axes.fill(_numbers(item["x"]), _numbers(item["y"]), color=style.COLOURS[item["colour"]], alpha=style.PALE, linewidth=0,
              zorder=1)


def _draw_word(axes, item: dict[str, Any]) -> None:
    colour = style.COLOURS[item["colour"]]
    rim = {"boxstyle": "circle,pad=0.22", "facecolor": "white", "edgecolor": colour, "linewidth": 0.7}
    axes.text(*item["at"], item["text"], color=colour, ha={"l": "left", "c": "center", "r": "right"}[item["align"]],
              va="center_baseline" if item["boxed"] else "center", fontsize=item["points"], zorder=5,
              bbox=rim if item["boxed"] else None)


_DRAW = {"line": _draw_line, "rays": _draw_rays, "mark": _draw_mark, "text": _draw_text, "fill": _draw_fill,
         "word": _draw_word}


def _draw_panel(axes, panel: dict[str, Any]) -> None:
    for item in panel["items"]:
        _DRAW[item["kind"]](axes, item)
    axes.set_xscale("log" if panel.get("x_log") else "linear")
    axes.set_yscale("log" if panel.get("y_log") else "linear")
    axes.set_title(panel["title"] or "")
    axes.set_xlabel(panel["x_label"] or "")
    axes.set_ylabel(panel["y_label"] or "")
    axes.margins(x=0.0 if not panel["equal"] else 0.02, y=0.06)
    if panel["equal"]:
        axes.set_aspect("equal", adjustable="box" if panel["x_range"] and panel["y_range"] else "datalim")
    if panel["x_range"]:
        axes.set_xlim(panel["x_range"])
    if panel["y_range"]:
        axes.set_ylim(panel["y_range"])
    if panel["y_down"]:
        axes.invert_yaxis()
    if any(item["label"] for item in panel["items"]):
        axes.legend(loc="best", handlelength=2.2)


def _draw_sheet(axes, panel: dict[str, Any]) -> None:
    width, height = panel["sheet_mm"]
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    for item in panel["items"]:
        _DRAW[item["kind"]](axes, item)


def _draw_head(figure, title: str, notes: str | None) -> None:
    """Title and notes in a strip of their own, whatever the figure's height."""
    height = figure.get_figheight()
    if figure.get_layout_engine():
        figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, 1.0 - style.HEAD_IN / height))
    figure.text(0.012, 1.0 - 0.12 / height, title, ha="left", va="top", fontsize=12.5, fontweight="bold")
    if notes:
        figure.text(0.012, 1.0 - 0.39 / height, notes, ha="left", va="top", fontsize=8.5, color="#444444")


def _draw_grid(plt, panels: list[dict[str, Any]]):
    rows = max(panel["row"] + panel["rows"] for panel in panels)
    columns = max(panel["column"] + panel["columns"] for panel in panels)
    figure = plt.figure(figsize=(style.WIDTH_IN, style.HEAD_IN + style.ROW_IN * rows), layout="constrained")
    grid = figure.add_gridspec(rows, columns)
    for panel in panels:
        cells = grid[panel["row"]:panel["row"] + panel["rows"], panel["column"]:panel["column"] + panel["columns"]]
        _draw_panel(figure.add_subplot(cells), panel)
    return figure


def _save_few_colours(figure, file: BinaryIO, metadata: dict[str, str]) -> None:
    """A drawing of lines needs a third of the bytes so."""
    import PIL.Image
    import PIL.PngImagePlugin

    full = io.BytesIO()
    figure.savefig(full, format="png", dpi=style.DPI)
    texts = PIL.PngImagePlugin.PngInfo()
    for key, text in metadata.items():
        texts.add_text(key, text)
    few = PIL.Image.open(full).convert("RGB").quantize(64, dither=PIL.Image.Dither.NONE)
    few.save(file, format="png", optimize=True, dpi=(style.DPI, style.DPI), pnginfo=texts)


def fingerprint(description: dict[str, Any]) -> str:
    """Of what a picture shows, whatever version of Matplotlib draws it; PNG files carry it as their Description."""
    content = json.dumps({key: value for key, value in description.items() if key != "format"}, sort_keys=True)
    return "klingel_plot " + hashlib.sha256(content.encode()).hexdigest()[:32]


def draw(description: dict[str, Any], file: BinaryIO) -> None:
    """Writes the picture. DescriptionError: not such a description. ImportError: no Matplotlib."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    try:
        if description["klingel_plot"] != VERSION:
            raise DescriptionError(f"version {description['klingel_plot']}: this program knows {VERSION}")
        panels = description["panels"]
        with plt.rc_context(style.SETTINGS):
            if "sheet_mm" in panels[0]:
                body = panels[0]["sheet_mm"][1] / 25.4
                figure = plt.figure(figsize=(style.WIDTH_IN, style.HEAD_IN + body))
                _draw_sheet(figure.add_axes((0.0, 0.0, 1.0, body / (style.HEAD_IN + body))), panels[0])
            else:
                figure = _draw_grid(plt, panels)
            _draw_head(figure, description["title"], description["notes"])
            # the same description gives the same file: no date in it, but what it was drawn from
            metadata = {"png": {"Description": fingerprint(description)}, "pdf": {"CreationDate": None},
                        "svg": {"Date": None}}[description["format"]]
            if description["format"] == "png" and "sheet_mm" in panels[0]:
                _save_few_colours(figure, file, metadata)
            else:
                figure.savefig(file, format=description["format"], dpi=style.DPI, metadata=metadata)
            plt.close(figure)
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise DescriptionError(f"{type(error).__name__}: {error}") from error
