#!/usr/bin/python3
"""klingel ride against SciPy: the samples that it writes, filtered and counted by another program.

usage: KLINGEL=build/klingel python3 tests/tools/test_ride.py [-v]

Band filters are scipy.signal.butter's and percentiles NumPy's. The comfort weightings are taken in the frequency domain, from
the analogue transfer functions of EN 12299 (UIC 513) as they are printed, without any digital filter; Sperling's from Welch's
spectrum. --series has seven digits.
"""

from __future__ import annotations

import pathlib
import tempfile
import unittest

import numpy as np
from scipy import signal

from cli import output, rows
from test_models import COACH

SPEED, FROM, RATE = 30.0, 300.0, 1000.0
BANDS = {"6 Hz": (0.0, 6.0), "10 Hz": (0.0, 10.0), "0.4..4 Hz": (0.4, 4.0), "0.4..10 Hz": (0.4, 10.0), "20 Hz": (0.0, 20.0)}


def filtered(x: np.ndarray, low: float, high: float) -> np.ndarray:
    """Order 4 at each corner, as if the first value had always been there."""
    if low == 0.0:
        return signal.sosfilt(signal.butter(4, high, fs=RATE, output="sos"), x - x[0]) + x[0]
    x = signal.sosfilt(signal.butter(4, low, "highpass", fs=RATE, output="sos"), x - x[0])
    return signal.sosfilt(signal.butter(4, high, fs=RATE, output="sos"), x)


def mean_of_2_m(x: np.ndarray) -> np.ndarray:
    """Centred; of what there is at the ends."""
    half = round(0.5 * 2.0 / SPEED * RATE)
    window = np.ones(2 * half + 1)
    return np.convolve(x, window, "same") / np.convolve(np.ones_like(x), window, "same")


def weight(f: np.ndarray, vertical: bool) -> np.ndarray:
    """EN 12299, the amplitude of W_b and W_d."""
    s = 2j * np.pi * f
    w1, w2 = 2 * np.pi * 0.4, 2 * np.pi * 100
    h = s**2 / (s**2 + s * w1 * np.sqrt(2) + w1**2) * w2**2 / (s**2 + s * w2 * np.sqrt(2) + w2**2)
    w3 = w4 = 2 * np.pi * (16.0 if vertical else 2.0)
    h = h * (1 + s / w3) / (1 + s / (0.63 * w4) + (s / w4) ** 2)
    if vertical:
        w5, w6 = 2 * np.pi * 2.5, 2 * np.pi * 4.0
        h = h * 0.4 * (1 + s / (0.8 * w5) + (s / w5) ** 2) / (1 + s / (0.8 * w6) + (s / w6) ** 2)
    return np.abs(h)


def sperling(x: np.ndarray, lateral: bool) -> float:
    """Wz = (sum of (B a)^2)^0.15, amplitudes a in cm/s2, of harmonics of which each stands for a line of Welch's spectrum."""
    f, density = signal.welch(x, RATE, "hann", nperseg=8000, noverlap=4000, detrend="constant")
    use = (f >= 0.2) & (f <= 100.0)
    f, density = f[use], density[use]
    b = 0.588 * np.sqrt((1.911 * f**2 + (0.25 * f**2) ** 2) / ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2))
    a2 = 2e4 * density * (f[1] - f[0])
    return float(((b * (1.25 if lateral else 1.0)) ** 2 * a2).sum() ** 0.15)


class Ride(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "series.csv")
            text = output("ride", COACH, "models/straight_erri_high.yaml", "--speed", SPEED, "--to", 1800, "--assess-from", FROM, "--csv", "--series", file)
            cls.found = {(r["where"], r["quantity"]): r for r in rows(text)}
            head = file.read_text().split("\n", 1)[0].split(",")
            values = np.loadtxt(file, delimiter=",", skiprows=1)
        cls.series = dict(zip(head, values.T, strict=True))
        cls.first = int(np.searchsorted(cls.series["s_m"], FROM - 1e-6))

    def compare(self, row: dict[str, str], x: np.ndarray, places: float) -> None:
        """Percentiles and root of the mean square, against the latter."""
        x = x[self.first:]
        size = np.sqrt((x**2).mean())
        what = (row["where"], row["quantity"], row["filter"])
        self.assertAlmostEqual(float(row["rms"]) / size, 1.0, delta=places, msg=what)
        for key, q in (("p0_15", 0.0015), ("p50", 0.5), ("p99_85", 0.9985)):
            self.assertAlmostEqual(float(row[key]) / size, np.quantile(x, q) / size, delta=3 * places, msg=(what, key))

    def test_accelerations(self) -> None:
        compared = 0
        for (where, quantity), row in self.found.items():
            if quantity[:3] in ("y''", "z''") and row["filter"] in BANDS:
                x = self.series[f"{where} {'lateral' if quantity[0] == 'y' else 'vertical'}_m_s2"]
                self.compare(row, filtered(x, *BANDS[row["filter"]]), 1e-4)
                compared += 1
        self.assertEqual(compared, 3 * 4 + 2)

    def test_forces(self) -> None:
        for wheelset in ("w1", "w2", "w3", "w4"):
            self.compare(self.found[wheelset, "sum of Y"], mean_of_2_m(filtered(self.series[f"{wheelset} sum_y_N"], 0.0, 20.0)), 1e-4)
            for side in ("right", "left"):
                q = filtered(self.series[f"{wheelset} {side}_q_N"], 0.0, 20.0)
                y = filtered(self.series[f"{wheelset} {side}_y_N"], 0.0, 20.0)
                self.compare(self.found[f"{wheelset} {side}", "Q"], q, 1e-5)
                self.compare(self.found[f"{wheelset} {side}", "Y/Q"], mean_of_2_m(y / q), 1e-4)

    def test_comfort(self) -> None:
        """The weighted root of the mean square, with weightings of no phase; Sperling's index."""
        for place in ("body front", "body middle", "body rear"):
            for quantity, vertical in (("y'' comfort", False), ("z'' comfort", True)):
                x = self.series[f"{place} {'vertical' if vertical else 'lateral'}_m_s2"]
                spectrum = np.fft.rfft(x - x.mean())
                f = np.fft.rfftfreq(len(x), 1 / RATE)
                weighted = np.fft.irfft(spectrum * weight(f, vertical), len(x))[self.first:]
                row = self.found[place, quantity]
                self.assertAlmostEqual(float(row["rms"]) / np.sqrt((weighted**2).mean()), 1.0, delta=3e-3, msg=(place, quantity))
            for name, lateral in (("lateral", True), ("vertical", False)):
                wz = float(self.found[place, f"Wz {name}"]["rms"])
                self.assertAlmostEqual(wz / sperling(self.series[f"{place} {name}_m_s2"][self.first:], lateral), 1.0, delta=5e-3, msg=(place, name))


if __name__ == "__main__":
    unittest.main()
