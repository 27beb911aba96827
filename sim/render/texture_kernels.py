"""Compiled patterns of ground and walls: noise on integer lattices that repeat nowhere, at several scales.

A lattice point's value is a hash of its indices, so a pattern is a pure function of place: both cameras of a pair see
the same. Scales finer than twice a pixel's footprint are left out, or they would flicker and differ between the views.
"""

from __future__ import annotations

import numpy as np
from numba import njit

MASK = 0xFFFFFFFF
FINER = 0.45  # wavelength of one octave of grain over that of the one before
COS, SIN = np.cos(0.7), np.sin(0.7)  # each is turned against the one before


@njit(cache=True)
def lattice(i, j, key):  # type: ignore[no-untyped-def]
    """A number in [-1, 1) for each pair of integers: multiply-and-shift mixing of 32 bits."""
    h = (i * 0x9E3779B1 + j * 0x85EBCA77 + key * 0xC2B2AE3D) & MASK
    h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & MASK
    h = ((h ^ (h >> 12)) * 0x297A2D39) & MASK
    return (h ^ (h >> 15)) * (2.0 / 4294967296.0) - 1.0


@njit(cache=True)
def smooth(x, y, key):  # type: ignore[no-untyped-def]
    """Value noise of unit wavelength, continuous in value and slope; sd about 0.4."""
    i, j = int(np.floor(x)), int(np.floor(y))
    a, b = x - i, y - j
    a, b = a * a * (3 - 2 * a), b * b * (3 - 2 * b)
    low = lattice(i, j, key) * (1 - a) + lattice(i + 1, j, key) * a
    high = lattice(i, j + 1, key) * (1 - a) + lattice(i + 1, j + 1, key) * a
    return low * (1 - b) + high * b


@njit(cache=True)
def seen(wavelength, footprint):  # type: ignore[no-untyped-def]
    """How much of a pattern survives pixels of this footprint (m): none below two pixels a wave, all above five."""
    return min(max((wavelength / footprint - 2.0) / 3.0, 0.0), 1.0)


@njit(cache=True)
def grain(x, y, key, footprint, coarsest):  # type: ignore[no-untyped-def]
    """Noise with equal contrast at each scale from `coarsest` m down to the pixel's; sd about 0.5."""
    total, wavelength = 0.0, coarsest
    x, y = x / coarsest, y / coarsest
    for octave in range(9):
        share = seen(wavelength, footprint)
        if share == 0.0:
            break
        total += share * smooth(x, y, key + octave)
        wavelength *= FINER
        x, y = (COS * x - SIN * y) / FINER, (SIN * x + COS * y) / FINER
    return total * 0.7


@njit(cache=True)
def slabs(x, y, width, depth, joint, key, footprint):  # type: ignore[no-untyped-def]
    """Slabs in a running bond: each with its own brightness in [-1, 1], its joints dark (-1.5)."""
    row = np.floor(y / depth)
    shift = (int(row) % 2) * 0.5 * width
    column = np.floor((x - shift) / width)
    own = lattice(int(column), int(row), key) * seen(min(width, depth), footprint)
    u, v = x - shift - column * width, y - row * depth
    edge = min(min(u, width - u), min(v, depth - v))
    soft = max(joint, 0.7 * footprint)  # a joint narrower than a pixel is drawn wider and fainter
    dark = max(0.0, 1.0 - edge / soft) * min(joint / soft, 1.0) * seen(min(width, depth), footprint)
    return own * (1 - dark) - 1.5 * dark


@njit(cache=True)
def wild(x, y, size, key):  # type: ignore[no-untyped-def]
    """A pattern over the ground: plants grow where it is high, first outside the world of this size (m)."""
    outside = max(max(-x, x - size[0]), max(-y, y - size[1]))
    patches = smooth(0.4 * x, 0.4 * y, key) + 0.5 * smooth(1.1 * x, 1.1 * y, key + 1)
    return patches + min(max(outside, -1.0), 1.0)


@njit(cache=True)
def overgrown(x, y, size, key, level, footprint):  # type: ignore[no-untyped-def]
    """Share of a pixel of this footprint (m) that shows plants, which grow where `wild` is above `level`; leaves that
    are finer than pixels are not drawn."""
    near = min(max(2.0 * seen(0.3, footprint) - 0.5, 0.0), 1.0)
    return near * min(max((wild(x, y, size, key) - level) / 0.1 + 0.5, 0.0), 1.0)
