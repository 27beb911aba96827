"""Compiled texture pages of clothing: which garment and which shade is where on a body and a head.

A point of a body or head is given by across (-1 left … 1 right), along (1 front, -1 back) and up (-1 … 1).
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.texture_kernels import lattice_value, value_noise
from sim.scene.body import BODY_PART

SHOES, TROUSERS, SHIRT, SECOND, SKIN, HAIR = range(6)  # rows of a person's colours (6, 3)
PLAIN, HOOPS, STRIPES, PATCHES, JACKET, DRESS = range(6)  # cuts
CUT, COUNT, HEM, HAIRLINE, LEG_GAP, ARM = range(6)  # slots of a person's style
ROUND, UP = 64, 64  # columns and rows of a page
FINE = 3  # samples each way per texel


@njit(cache=True)
def _head(across, along, up, style):  # type: ignore[no-untyped-def]
    """Returns the colour's row (HAIR or SKIN) and the shade at a point of a head."""
    if up > style[HAIRLINE] - 0.5 * max(along, 0.0) + 0.5 or (along < 0.15 and up > -0.75):
        return HAIR, 1.0
    eyes = along > 0.6 and abs(up - 0.1) < 0.12 and 0.15 < abs(across) < 0.6
    return SKIN, 0.6 if eyes else 0.75 if up < -0.75 else 1.0


@njit(cache=True)
def _body(across, along, up, round_, style, key):  # type: ignore[no-untyped-def]
    """Returns the colour's row (SHOES … SKIN) and the shade at a point of a body; round_: turn round it in [0, 4)."""
    cut, hem, count, arm = int(style[CUT]), style[HEM], style[COUNT], style[ARM]
    if up < -0.9:
        return SHOES, 1.0
    if up < hem:
        legs = min(max((-0.15 - up) * 4.0, 0.0), 1.0)
        shade = 1.0 - style[LEG_GAP] * legs * max(0.0, 1.0 - abs(across) / 0.22)  # dark between the legs
        return (SECOND if cut == DRESS and up > -0.45 else TROUSERS), shade
    if up > 0.93 or (up > 0.8 and along > 0.75):
        return SKIN, 0.85  # neck and collar
    sleeve = abs(across) > arm
    if sleeve and up < hem + 0.12:
        return SKIN, 0.95  # hands
    shade = 0.82 if abs(abs(across) - arm) < 0.05 and up < 0.75 else 1.0  # arms against the body
    hoop = cut == HOOPS and int(np.floor((up + 1.0) * count * 1.5)) % 2 == 1
    stripe = cut == STRIPES and int(np.floor(round_ * count * 1.5)) % 2 == 1
    patch = cut == PATCHES and lattice_value(int(round_ * count * 0.8), int((up + 1.0) * 2 * count), key) > 0.3
    if hoop or stripe or patch or (cut == JACKET and along > 0.5 and abs(across) < 0.22):
        return SECOND, shade
    return SHIRT, shade


@njit(cache=True)
def draw_page(style, key, colours, part, out):  # type: ignore[no-untyped-def]
    """Sets out (UP, ROUND, 3) to the colours of a body or head (`part`), not clipped to 255.

    style (6,): slots CUT …. colours (6, 3): rows SHOES …. key: of the random patterns. Columns turn from the right side
    over the front to the left side and the back.
    """
    out[:] = 0.0
    for j in range(UP * FINE):
        up = 2.0 * (j + 0.5) / (UP * FINE) - 1.0
        for i in range(ROUND * FINE):
            round_ = 4.0 * (i + 0.5) / (ROUND * FINE)
            x = 1.0 - round_ if round_ < 2.0 else round_ - 3.0  # across and along on |x| + |y| = 1, then on a circle
            y = 1.0 - abs(x) if round_ < 2.0 else abs(x) - 1.0
            size = np.hypot(x, y)
            row, shade = (
                _body(x / size, y / size, up, round_, style, key)
                if part == BODY_PART
                else _head(x / size, y / size, up, style)
            )
            folds = 0.14 * value_noise(3.0 * round_ + 0.6 * up, 3.0 * up, key) + 0.10 * value_noise(
                4.0 * round_, 14.0 * up, key + 1
            )
            cloth = shade * (1.0 + (folds if row != SKIN else 0.4 * folds))
            for k in range(3):
                out[j // FINE, i // FINE, k] += colours[row, k] * cloth / (FINE * FINE)
