"""Compiled: the pages of an atlas of clothes: what is where on a body and a head."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.render.texture_kernels import lattice, smooth

SHOES, TROUSERS, SHIRT, SECOND, SKIN, HAIR = range(6)  # rows of a person's colours
PLAIN, HOOPS, STRIPES, PATCHES, JACKET, DRESS = range(6)  # how it is cut
ROUND, UP = 64, 64  # columns and rows of a page
FINE = 3  # samples each way per texel


@njit(cache=True)
def _head(across, along, up, style):  # type: ignore[no-untyped-def]
    """Row and shade: hair on top and behind, down to a line; a face with darker eyes and mouth."""
    if up > style[3] - 0.5 * max(along, 0.0) + 0.5 or (along < 0.15 and up > -0.75):
        return HAIR, 1.0
    eyes = along > 0.6 and abs(up - 0.1) < 0.12 and 0.15 < abs(across) < 0.6
    return SKIN, 0.6 if eyes else 0.75 if up < -0.75 else 1.0


@njit(cache=True)
def _body(across, along, up, round_, style, key):  # type: ignore[no-untyped-def]
    """Row and shade. up: -1 at the ground, 1 at the neck; style: cut, its count, hem, hair line, leg gap, arm."""
    cut, hem = int(style[0]), style[2]
    if up < -0.9:
        return SHOES, 1.0
    if up < hem:
        legs = min(max((-0.15 - up) * 4.0, 0.0), 1.0)
        shade = 1.0 - style[4] * legs * max(0.0, 1.0 - abs(across) / 0.22)  # dark between the legs
        return (SECOND if cut == DRESS and up > -0.45 else TROUSERS), shade
    if up > 0.93 or (up > 0.8 and along > 0.75):
        return SKIN, 0.85  # neck and collar
    sleeve = abs(across) > style[5]
    if sleeve and up < hem + 0.12:
        return SKIN, 0.95  # hands
    shade = 0.82 if abs(abs(across) - style[5]) < 0.05 and up < 0.75 else 1.0  # arms against the body
    hoop = cut == HOOPS and int(np.floor((up + 1.0) * style[1] * 1.5)) % 2 == 1
    stripe = cut == STRIPES and int(np.floor(round_ * style[1] * 1.5)) % 2 == 1
    patch = cut == PATCHES and lattice(int(round_ * style[1] * 0.8), int((up + 1.0) * 2 * style[1]), key) > 0.3
    if hoop or stripe or patch or (cut == JACKET and along > 0.5 and abs(across) < 0.22):
        return SECOND, shade
    return SHIRT, shade


@njit(cache=True)
def page(style, key, colours, part, out):  # type: ignore[no-untyped-def]
    """out (UP, ROUND, 3): colours of a body (part 0) or a head, round_ in [0, 4) along rows, up in [-1, 1] upwards."""
    out[:] = 0.0
    for j in range(UP * FINE):
        up = 2.0 * (j + 0.5) / (UP * FINE) - 1.0
        for i in range(ROUND * FINE):
            round_ = 4.0 * (i + 0.5) / (ROUND * FINE)
            x = 1.0 - round_ if round_ < 2.0 else round_ - 3.0  # across and along on |x| + |y| = 1, then on a circle
            y = 1.0 - abs(x) if round_ < 2.0 else abs(x) - 1.0
            size = np.hypot(x, y)
            row, shade = (
                _body(x / size, y / size, up, round_, style, key) if part == 0 else _head(x / size, y / size, up, style)
            )
            folds = 0.14 * smooth(3.0 * round_ + 0.6 * up, 3.0 * up, key) + 0.10 * smooth(
                4.0 * round_, 14.0 * up, key + 1
            )
            cloth = shade * (1.0 + (folds if row != SKIN else 0.4 * folds))
            for k in range(3):
                out[j // FINE, i // FINE, k] += colours[row, k] * cloth / (FINE * FINE)
