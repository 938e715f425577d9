"""What the golden suite runs of the model files: every vehicle and every track in models/, and every creep law.

`klingel build` makes each into C, which is linked with tests/golden/golden.c: the same tables on every target, while the
scenarios in golden.c build theirs on the target itself. A new file in models/ comes in by itself, with the defaults below.
"""

from __future__ import annotations

import dataclasses
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODELS = ROOT / "models"
WAGON, DEMO = "models/two_axle_wagon.yaml", "models/demo_track.yaml"


@dataclasses.dataclass(frozen=True)
class Scenario:
    name: str
    vehicle: str
    track: str = DEMO
    from_m: float = 130.0  # where the curve of the demo track begins soon
    speed_m_s: float = 25.0
    to_m_s: float = 26.0  # set-point, reached with the model's acceleration limit
    y_mm: float = 1.0  # of the first wheelset at the start
    steps: int = 4000


# Where the defaults would show little.
VEHICLES = {
    "free_wheelset": {"speed_m_s": 10.0, "to_m_s": 9.0},
    "restrained_wheelset": {"track": "models/s_curve.yaml", "from_m": 30.0, "speed_m_s": 60.0, "to_m_s": 60.0},
    "cooperrider_bogie": {"track": "models/straight.yaml", "speed_m_s": 60.0, "to_m_s": 60.0, "y_mm": 3.0},
}
TRACKS = {
    "straight": {"from_m": 0.0, "speed_m_s": 0.0, "to_m_s": 5.0},  # from a stand
    "curve_r600": {"from_m": 60.0},
    "s_curve": {"from_m": 150.0, "speed_m_s": 20.0, "to_m_s": 20.0},
}
LAWS = [
    Scenario("laws_linear_she_polach_table", "tests/golden/creep_laws.yaml", "models/curve_r600.yaml", 60.0, 20.0, 22.0, 2.0),
    Scenario("laws_fastsim", "tests/golden/creep_fastsim.yaml", "models/curve_r600.yaml", 60.0, 20.0, 22.0, 2.0, 2000),
]


def files(folder: pathlib.Path) -> tuple[list[pathlib.Path], list[pathlib.Path]]:
    """Vehicles and tracks, by what they hold; trains of vehicles count as vehicles."""
    vehicles, tracks = [], []
    for path in sorted(folder.glob("*.yaml")):
        keys = {line.split(":")[0] for line in path.read_text().splitlines() if line[:1].isalpha()}
        (vehicles if keys & {"wheelsets", "vehicles", "train"} else tracks).append(path)
    return vehicles, tracks


def all_scenarios(folder: pathlib.Path = MODELS) -> list[Scenario]:
    vehicles, tracks = files(folder)
    found = [Scenario(**{"name": path.stem, "vehicle": f"models/{path.name}", **VEHICLES.get(path.stem, {})})
             for path in vehicles]
    found += [Scenario(**{"name": f"wagon_on_{path.stem}", "vehicle": WAGON, "track": f"models/{path.name}",
                          **TRACKS.get(path.stem, {})}) for path in tracks]
    return found + LAWS
