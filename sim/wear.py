"""What people wear: colours and patterns, drawn for each person from a stream of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.rng import rng
from sim.types import Array, Ints

SKINS = np.array([[120, 150, 195], [105, 135, 180], [80, 110, 150], [55, 75, 105]], float)  # BGR
HAIRS = np.array([[30, 32, 36], [35, 45, 60], [60, 85, 110], [120, 125, 128]], float)
TROUSERS = np.array([[48, 40, 38], [95, 68, 52], [70, 72, 74], [80, 100, 118], [32, 30, 30]], float)
SHIRTS = np.array(
    [[30, 30, 32], [55, 45, 42], [95, 60, 40], [50, 45, 130], [70, 105, 70], [185, 185, 188], [150, 140, 120],
     [80, 150, 190], [90, 90, 95], [40, 60, 90]], float,
)  # fmt: skip
LEVEL_SD, TINT_SD = 0.18, 0.06  # by which a garment's brightness and hue differ from the palette, relative


@dataclass(frozen=True)
class Wear:
    """P people: keys (P,) of their patterns; styles (P, 4) pattern, count, hem, hair line; colours (P, 6, 3) BGR."""

    keys: Ints
    styles: Array
    colours: Array


def wear(people: int, seed: int, repeat: int = 0) -> Wear:
    """Clothes of people 1 … `people`; one person more changes nobody else."""
    keys, styles, colours = np.zeros(people, np.int64), np.zeros((people, 4)), np.zeros((people, 6, 3))
    for k in range(people):
        source = rng(seed, "texture", k + 1, repeat=repeat)
        keys[k] = source.integers(1 << 20)
        styles[k] = [
            source.choice(5, p=[0.4, 0.1, 0.1, 0.15, 0.25]),
            source.integers(2, 6),
            *source.uniform([0.42, 0.955], [0.54, 0.985]),
        ]
        first, second = source.choice(len(SHIRTS), 2, replace=False)
        chosen = [
            np.array([35.0, 36.0, 38.0]), TROUSERS[source.integers(len(TROUSERS))], SHIRTS[first], SHIRTS[second],
            SKINS[source.integers(len(SKINS))], HAIRS[source.integers(len(HAIRS))],
        ]  # fmt: skip
        level = np.exp(LEVEL_SD * source.normal(size=(6, 1))) * np.exp(TINT_SD * source.normal(size=(6, 3)))
        colours[k] = np.clip(np.array(chosen) * level, 12, 240)
    return Wear(keys, styles, colours)
