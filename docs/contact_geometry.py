#!/usr/bin/python3
"""Compares klingel's contact geometry with CONTACT and with EN 15302: prints the figures of docs/contact_geometry.md
and draws its pictures.

usage: docs/contact_geometry.py [--klingel build/klingel] [--output FOLDER]
       docs/contact_geometry.py --profiles FOLDER     only CONTACT, with the benchmark's own profiles, which are no part of
                                                      this project: MBench_S1002_v3.prw and MBench_UIC60_v3.prr
"""

from __future__ import annotations

import argparse
import csv
import io
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))

from klingel_plot import figure  # noqa: E402

MODEL = "models/two_axle_wagon.yaml"
RANGE_MM = 10.2  # CONTACT's displacements go to 10 mm, the model's table to 8
CASES = ("E1", "E3", "E5", "E7")


def read(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return list(csv.DictReader(io.StringIO("\n".join(lines))))


def reference(name: str) -> list[dict[str, str]]:
    return read((ROOT / "tests/reference" / name).read_text())


class Klingel:
    def __init__(self, program: pathlib.Path):
        self.program = program.resolve()

    def text(self, *arguments: str) -> str:
        return subprocess.run([str(self.program), *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def panel(row: int, column: int, title: str, x_label: str, y_label: str, items: list[dict]) -> dict:
    return {"row": row, "column": column, "rows": 1, "columns": 1, "title": title, "x_label": x_label, "y_label": y_label,
            "x_range": None, "y_range": None, "equal": False, "y_down": False, "items": items}


def line(x: list[float], y: list[float], label: str | None, colour: str, pen: str = "solid", thin: bool = False) -> dict:
    return {"kind": "line", "label": label, "colour": colour, "pen": pen, "thin": thin, "x": x, "y": y}


def mark(axis: str, at: float, text: str | None = None) -> dict:
    return {"kind": "mark", "label": None, "colour": "quiet", "pen": "dotted", "thin": False, "axis": axis, "at": at,
            "text": text}


def save(path: pathlib.Path, title: str, notes: str, panels: list[dict]) -> None:
    with path.open("wb") as file:
        figure.draw({"klingel_plot": 1, "format": "png", "title": title, "notes": notes, "panels": panels}, file)


# ---- CONTACT ----

def contact(klingel: Klingel, folder: pathlib.Path) -> None:
    rows = read(klingel.text("geometry", MODEL, "--set", f"pairs.s1002_uic60.range_m={RANGE_MM / 1e3}", "--csv"))
    u_y = [1e3 * float(row["u_y_m"]) for row in rows]
    ours = {round(y, 3): row for y, row in zip(u_y, rows)}
    differences: dict[str, list[tuple[float, float]]] = {"right": [], "left": [], "rrd": [], "angle": []}
    theirs: dict[str, list[tuple[float, float]]] = {"right": [], "left": [], "rrd": [], "angle": []}
    for row in reference("manchester_rigid.csv"):
        y, side = float(row["y_ws_mm"]), {"R": "right", "L": "left"}[row["wheel"]]
        ours_here = ours[round(y, 3)]
        place = float(row["ycp_wheel_mm"]) * (-1 if side == "right" else 1)  # y to the right, eta towards the flange
        theirs[side].append((y, place))
        differences[side].append((y, 1e3 * float(ours_here[f"eta_wheel_{side}_m"]) - place))
        if side == "right":
            rrd, angle = float(row["rrd_right_minus_left_mm"]), abs(float(row["contact_angle_tr_deg"]))
            theirs["rrd"].append((y, rrd))
            theirs["angle"].append((y, angle))
            differences["rrd"].append(
                (y, 1e3 * (float(ours_here["radius_right_m"]) - float(ours_here["radius_left_m"])) - rrd))
            differences["angle"].append((y, math.degrees(float(ours_here["delta_rail_right_rad"])) - angle))

    print("largest difference from CONTACT        0..4.5 mm   5..6 mm   7..10 mm")
    for key, name in (("right", "contact on the right wheel [mm]"), ("left", "contact on the left wheel [mm]"),
                      ("rrd", "rolling-radius difference [mm]"), ("angle", "right contact angle [deg]")):
        worst = [max(abs(d) for y, d in differences[key] if low <= y <= high) for low, high in ((0, 4.5), (5, 6), (7, 10))]
        print(f"{name:36s} {worst[0]:10.4f} {worst[1]:10.4f} {worst[2]:10.4f}")

    label = "lateral displacement u_y [mm]"
    half = [i for i, y in enumerate(u_y) if 0 <= y <= 10]

    def curve(values: list[float], name: str, colour: str) -> dict:
        xs, ys = [], []
        for i in half:
            if xs and xs[-1] is not None and abs(1e3 * float(rows[i]["eta_wheel_right_m"])
                                                 - 1e3 * float(rows[i - 1]["eta_wheel_right_m"])) > 1.5:
                xs.append(None)
                ys.append(None)
            xs.append(u_y[i])
            ys.append(values[i])
        return line(xs, ys, name, colour)

    def dots(key: str, colour: str, name: str | None = None) -> dict:
        return line([y for y, _ in theirs[key]], [v for _, v in theirs[key]], name, colour, "points")

    def difference(key: str, colour: str, name: str | None) -> list[dict]:
        return [line([y for y, _ in differences[key]], [d for _, d in differences[key]], name, colour, pen)
                for pen, name in (("solid", name), ("points", None))]

    eta = {side: [1e3 * float(row[f"eta_wheel_{side}_m"]) for row in rows] for side in ("right", "left")}
    rrd = [1e3 * (float(row["radius_right_m"]) - float(row["radius_left_m"])) for row in rows]
    save(folder / "contact_geometry_contact.png", "S1002 on UIC60, 1:40: klingel (lines) and CONTACT (points)",
         "gauge 1435 mm, flange backs 1360 mm, r0 460 mm at the tape circle, yaw 0; CONTACT: 50 N per wheel, benchmark profiles",
         [panel(0, 0, "Contact point on the wheel", label, "from the tape circle to the flange [mm]",
                [curve(eta["right"], "right", "first"), dots("right", "first"), curve(eta["left"], "left", "second"),
                 dots("left", "second")]),
          panel(0, 1, "Rolling-radius difference", label, "Δr [mm]", [curve(rrd, None, "ink"), dots("rrd", "ink")]),
          panel(1, 0, "Contact point: klingel – CONTACT", label, "[mm]",
                [mark("y", 0.0), *difference("right", "first", "right"), *difference("left", "second", "left")]),
          panel(1, 1, "Rolling-radius difference: klingel – CONTACT", label, "[mm]",
                [mark("y", 0.0), *difference("rrd", "ink", None)])])


def own_profiles(klingel: Klingel, folder: pathlib.Path) -> None:
    """The benchmark's points in place of the shipped ones, rigid and under CONTACT's load."""
    wheel, rail = (folder.resolve() / f"MBench_{name}" for name in ("S1002_v3.prw", "UIC60_v3.prr"))
    shown = (6.5, 7.0, 7.5, 8.0, 9.0, 10.0)
    print("                                       largest difference from CONTACT                rolling-radius difference [um]")
    print("                                  0..4.5 mm           7..10 mm            roll" + "".join(f"{y:7.1f}" for y in shown))
    for smoothing in (0, 0.001):
        text = (ROOT / MODEL).read_text()
        for key, points, file in (("deepest_mm: 27", "s1002", wheel), ("deepest_mm: 30", "uic60", rail)):
            text = text.replace(f"{{points: profiles/{points}.csv}}", f"{{file: {file}, {key}, smoothing_mm: {smoothing}}}")
        text = text.replace("      cant_1_in: 40\n", "")  # their rail lies canted already
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as model:
            model.write(text)
            model.flush()
            for load in (0, 50):
                places = [f"--solve={y / 2}mm" for y in range(21)]
                rows = read(klingel.text("geometry", model.name, "--set", f"pairs.s1002_uic60.range_m={RANGE_MM / 1e3}",
                                         f"--wheel-load={load}N", *places, "--csv"))
                own_differences(f"smoothing {smoothing} mm, {load:2d} N", {round(1e3 * float(r["u_y_m"]), 3): r for r in rows}, shown)


def own_differences(name: str, ours: dict[float, dict[str, str]], shown: tuple[float, ...]) -> None:
    places, radii, rolls = {}, {}, {}
    for row in reference("manchester_rigid.csv"):
        y, side = float(row["y_ws_mm"]), {"R": "right", "L": "left"}[row["wheel"]]
        here = ours[y]
        place = float(row["ycp_wheel_mm"]) * (-1 if side == "right" else 1)
        places[y] = max(places.get(y, 0.0), abs(1e3 * float(here[f"eta_wheel_{side}_m"]) - place))
        radii[y] = 1e3 * (float(here["radius_right_m"]) - float(here["radius_left_m"])) - float(row["rrd_right_minus_left_mm"])
        rolls[y] = 1e6 * float(here["phi_rad"]) - 1e3 * float(row["roll_mrad"])
    worst = [(max(places[y] for y in places if low <= y <= high), max(abs(radii[y]) for y in radii if low <= y <= high))
             for low, high in ((0, 4.5), (7, 10))]
    roll = max(abs(rolls[y]) for y in rolls if y >= 7)
    print(f"{name:26s}" + "".join(f" {place:7.4f} {radius:7.4f} mm" for place, radius in worst) + f" {roll:7.3f} urad"
          + "".join(f"{1e3 * radii[y]:7.1f}" for y in shown))


# ---- EN 15302 ----

def standard(klingel: Klingel, folder: pathlib.Path) -> None:
    expected = reference("en15302_conicity.csv")
    curves = reference("en15302_delta_r.csv")
    panels = []
    print("\ncase   amplitudes compared   largest difference   at 3 mm: EN 15302   klingel")
    for number, case in enumerate(CASES):
        with tempfile.NamedTemporaryFile("w", suffix=".csv") as table:
            table.write("y_mm,delta_r_mm\n")
            table.writelines(f"{row['y_mm']},{row['delta_r_mm']}\n" for row in curves if row["case"] == case)
            table.flush()
            rows = read(klingel.text("conicity", "--table", table.name, "--step", "0.1", "--csv"))
        found = {round(1e3 * float(row["amplitude_m"]), 3): float(row["conicity"]) for row in rows}
        pairs = [(float(row["amplitude_mm"]), float(row[case])) for row in expected]
        worst = max(abs(found[a] - value) for a, value in pairs if a in found)
        count = sum(a in found for a, _ in pairs)
        print(f"{case:6s} {count:10d} {worst:22.4f} {dict(pairs)[3.0]:16.3f} {found[3.0]:18.4f}")
        panels.append(panel(number // 2, number % 2, f"Case {case}", "amplitude [mm]", "tan γe [–]",
                            [mark("x", 3.0),
                             line([a for a, _ in pairs], [v for _, v in pairs], "EN 15302", "second", "points"),
                             line(list(found), list(found.values()), "klingel, from Δr of the standard", "first")]))
    save(folder / "contact_geometry_en15302.png", "Equivalent conicity: the reference cases of EN 15302",
         "Δr given every 0.1 mm to about ±6.8 mm; the lines end where the motion would leave it", panels)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--klingel", default="build/klingel", type=pathlib.Path, help="default: build/klingel")
    parser.add_argument("--output", default=ROOT / "docs", type=pathlib.Path, help="folder of the pictures; default: docs")
    parser.add_argument("--profiles", type=pathlib.Path, metavar="FOLDER", help="folder of the benchmark's profiles")
    arguments = parser.parse_args()
    klingel = Klingel(arguments.klingel)
    if arguments.profiles:
        own_profiles(klingel, arguments.profiles)
        return 0
    contact(klingel, arguments.output)
    standard(klingel, arguments.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
