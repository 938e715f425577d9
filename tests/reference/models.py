#!/usr/bin/python3
"""What the models of models/ did when they were added: a regression, computed by klingel itself.

usage: KLINGEL=build/klingel python3 tests/reference/models.py > tests/reference/models.csv

For every model the linear critical speed on straight track,
    klingel modes models/MODEL.yaml --critical 1:120
and for every wheelset in a steady curve with 100 mm of cant that balance the centrifugal force
    klingel curve models/MODEL.yaml --radius [1000,]R --cant 100mm --cant-deficiency 0mm --csv
its lateral displacement, angle of attack, track shifting force, and of its outer wheel, the left one, Q and Y/Q. Curves below 1000 m are reached over one of 1000 m.
"""

from __future__ import annotations

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
from cli import output, rows  # noqa: E402

RADII = {"two_axle_wagon": 1000, "manchester_vehicle1": 600, "three_axle": 1000, "three_axle_linked": 300, "cross_braced": 1000,
         "cross_braced_rigid": 2000, "forced_steering": 300, "unsymmetric": 2000, "unsymmetric_reversed": 2000,
         "articulated_train": 600, "articulated_single_axle": 300}


def main() -> None:
    print("# Written by tests/reference/models.py, which says what it is; not a reference from elsewhere.")
    print("model,critical_m_s,radius_m,wheelset,y_m,attack_rad,sum_y_N,outer_q_N,outer_y_q")
    for model, radius in RADII.items():
        file = f"models/{model}.yaml"
        critical = re.search(r"^ +([\d.]+) m/s .*becomes unstable", output("modes", file, "--critical", "1:120"), re.M)
        start = "1000," if radius < 1000 else ""
        curve = output("curve", file, f"--radius={start}{radius}", "--cant", "100mm", "--cant-deficiency", "0mm", "--csv")
        for row in (r for r in rows(curve) if float(r["radius_m"]) == radius):
            print(f"{model},{critical.group(1)},{radius},{row['wheelset']},{float(row['y_m']):.6e},"
                  f"{float(row['attack_rad']):.5e},{float(row['sum_y_N']):.1f},{float(row['left_q_N']):.1f},"
                  f"{float(row['left_y_q']):.5f}")


if __name__ == "__main__":
    main()
