"""NEES, NIS and whiteness: by hand, and of a filter that is right and two that are wrong."""

from __future__ import annotations

import numpy as np

from tracking.scoring.consistency import mean_band, normalised, normalised_square, whiteness, whiteness_band


def run(r: np.random.Generator, frames: int, runs: int, believed: float, lasting: float = 0.0):
    """Scalar random walks (q = 0.1, r = 1) seen through noise that lasts from frame to frame, filtered with the
    believed r: errors, variances, innovations, their variances, (runs, frames) each."""
    x, p = np.zeros(runs), np.ones(runs)
    true, noise = r.normal(size=runs), r.normal(size=runs)
    out = []
    for _ in range(frames):
        true = true + r.normal(0, np.sqrt(0.1), runs)
        noise = lasting * noise + np.sqrt(1 - lasting**2) * r.normal(size=runs)
        p = p + 0.1
        v, s = true + noise - x, p + believed
        x, p = x + p / s * v, p * believed / s
        out.append((x - true, p, v, s))
    return np.moveaxis(np.array(out), 0, 2)


def nees_and_nis(error, p, v, s) -> tuple[float, float]:
    nees = normalised_square(error[:, -1:], p[:, -1, None, None]).mean()
    nis = normalised_square(v[:, -1:], s[:, -1, None, None]).mean()
    return float(nees), float(nis)


def test_a_right_filter_is_in_its_bands_and_wrong_ones_are_not() -> None:
    low, high = mean_band(1000, 1, level=0.999)
    nees, nis = nees_and_nis(*run(np.random.default_rng(0), 50, 1000, believed=1.0))
    assert low < nees < high
    assert low < nis < high
    nees, nis = nees_and_nis(*run(np.random.default_rng(0), 50, 1000, believed=4.0))
    assert nees < low
    assert nis < low


def test_lasting_noise_shows_in_the_autocorrelation() -> None:
    frames, r = 2000, np.random.default_rng(1)
    for lasting, white in ((0.0, True), (0.6, False)):
        _, _, v, s = run(r, frames, 1, believed=1.0, lasting=lasting)
        found = whiteness(normalised(v.T[20:], s.T[20:, :, None]))
        assert (abs(found[0]) < whiteness_band(frames - 20, 1, level=0.999)) == white
