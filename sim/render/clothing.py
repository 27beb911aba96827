"""What people wear: colours and patterns, painted on one texture page (uint8, BGR) for the body and one for the head.

Each person draws from random streams of their own, so one person more changes nobody else's clothes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.rng import rng

# Palettes in BGR, grey levels.
SKINS = np.array([[120, 150, 195], [105, 135, 180], [80, 110, 150], [55, 75, 105]], float)
HAIRS = np.array([[30, 32, 36], [35, 45, 60], [60, 85, 110], [120, 125, 128]], float)
TROUSERS = np.array([[42, 35, 33], [98, 70, 50], [66, 68, 70], [84, 106, 126], [28, 26, 26], [36, 32, 32]], float)
SHIRTS = np.array(
    [[28, 28, 30], [30, 26, 26], [52, 42, 38], [96, 60, 38], [50, 45, 135], [72, 100, 68], [205, 206, 208],
     [160, 150, 128], [90, 165, 205], [92, 92, 96], [36, 52, 78]], float,
)  # fmt: skip
SHOES = np.array([35.0, 36.0, 38.0])
LEVEL_SD, TINT_SD = 0.28, 0.06  # sd of the logarithm of a garment's brightness, and of each colour, against the palette
CUT_SHARES = (0.45, 0.06, 0.05, 0.1, 0.24, 0.1)  # of the cuts PLAIN … DRESS in sim.render.clothing_kernels


def clothing_atlas(people: int, seed: int, repeat: int = 0) -> NDArray[np.uint8]:
    """Returns the texture pages (P, 2, texels) of people 1 … P: body, head.

    A page has UP rows from the ground upwards, ROUND + 1 columns round the body (the first repeated), and B, G, R.
    """
    from sim.render.clothing_kernels import ROUND, UP, draw_page

    pages, drawn = np.empty((people, 2, UP, ROUND + 1, 3), np.uint8), np.empty((UP, ROUND, 3))
    for k in range(people):
        source = rng(seed, "texture", k + 1, repeat=repeat)
        key = int(source.integers(1 << 20))
        cut, count = source.choice(len(CUT_SHARES), p=CUT_SHARES), source.integers(2, 5)
        # In the order of the slots CUT, COUNT, HEM, HAIRLINE, LEG_GAP, ARM.
        style = np.array([cut, count, *source.uniform([-0.05, -0.3, 0.5, 0.62], [0.2, 0.35, 0.8, 0.8])])
        first, second = source.choice(len(SHIRTS), 2, replace=False)
        chosen = [
            SHOES, TROUSERS[source.integers(len(TROUSERS))], SHIRTS[first], SHIRTS[second],
            SKINS[source.integers(len(SKINS))], HAIRS[source.integers(len(HAIRS))],
        ]  # fmt: skip
        level = np.exp(LEVEL_SD * source.normal(size=(6, 1))) * np.exp(TINT_SD * source.normal(size=(6, 3)))
        colours = np.clip(np.array(chosen) * level, 12, 240)
        for part in range(2):
            draw_page(style, key, colours, part, drawn)
            pages[k, part, :, :ROUND] = np.clip(drawn + 0.5, 0, 255)
    pages[..., ROUND, :] = pages[..., 0, :]
    return pages.reshape(people, 2, UP * (ROUND + 1) * 3)
