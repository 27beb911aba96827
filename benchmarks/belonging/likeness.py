"""Mode `likeness` of `benchmarks.belonging`: distributions of the features of pairs, and their distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import ks_2samp

from benchmarks.belonging.pair_features import NAMES
from benchmarks.belonging.sources import Source, read
from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import number, table
from sim.types import Array

QUANTILES = (0.1, 0.5, 0.9)
DRAWN = ("velocity difference, 2 s", "first distance", "arrival gap")
WHO = {True: "mates", False: "strangers"}


def values(source: Source, column: int, mates: bool) -> Array:
    """Returns the known values of one feature of the drawn rows of mates, or of strangers."""
    x = source.features[source.drawn & (source.mates == mates), column]
    return np.asarray(x[np.isfinite(x)])


def distance(one: Array, other: Array) -> float:
    """Returns the Kolmogorov-Smirnov distance of two samples, 0 to 1; nan if one is empty."""
    return float(ks_2samp(one, other).statistic) if len(one) and len(other) else float("nan")


def likeness(folder: Path, scenes: Sequence[str], recordings: Sequence[str], chart: Path | None) -> None:
    sources = {name: read(folder, name) for name in (*recordings, *scenes)}
    first, second = recordings
    compared = [(first, second), *((scene, real) for scene in scenes for real in recordings)]
    for mates, who in WHO.items():
        quantiles, distances = {}, {}
        for k, feature in enumerate(NAMES):
            x = {name: values(source, k, mates) for name, source in sources.items()}
            quantiles[feature] = [_quantiles(one) for one in x.values()]
            distances[feature] = [number(distance(x[a], x[b]), 2) for a, b in compared]
        table(f"{who}: 10, 50 and 90 %", "feature", list(sources), quantiles)
        table(f"{who}: Kolmogorov-Smirnov distance", "feature", [f"{a} / {b}" for a, b in compared], distances)
    if chart is not None:
        print(f"written: {draw(sources, chart)}")


def _quantiles(x: Array) -> str:
    return ", ".join(f"{q:.2f}" for q in np.quantile(x, QUANTILES)) if len(x) else "–"


def draw(sources: Mapping[str, Source], path: Path) -> Path:
    """Draws the distributions of three features, of mates and of strangers, and returns the path."""
    panels = []
    for feature in DRAWN:
        for mates, who in WHO.items():
            x = {name: values(source, NAMES.index(feature), mates) for name, source in sources.items()}
            x = {name: one for name, one in x.items() if len(one)}
            grid = np.linspace(0, max(float(np.quantile(one, 0.95)) for one in x.values()), 60)
            below = {name: np.searchsorted(np.sort(one), grid, side="right") / len(one) for name, one in x.items()}
            panels.append(Panel(f"{who}: {feature}", grid.tolist(), below, feature, "share below", y_range=(0, 1)))
    return lines(panels, path)
