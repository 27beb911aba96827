"""Compiled patterns of ground, walls and plants: value noise on integer lattices, at several scales, without
repetition.

The value of a lattice point is a hash of its indices. A pattern is therefore a pure function of place, and both cameras
of a pair see the same pattern. Scales finer than twice a pixel's footprint are left out: they would flicker and differ
between the views. A footprint is the size of a pixel on the surface, in m, or of a sample if a pixel has several.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit

MASK = 0xFFFFFFFF
FINER = 0.45  # wavelength of an octave of grain over that of the octave before
COS, SIN = np.cos(0.7), np.sin(0.7)  # each octave is turned against the one before


@njit(cache=True)
def lattice_value(i, j, key):  # type: ignore[no-untyped-def]
    """Returns a number in [-1, 1) that depends on the integers i, j and key only, by multiply-and-shift hashing."""
    h = (i * 0x9E3779B1 + j * 0x85EBCA77 + key * 0xC2B2AE3D) & MASK
    h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & MASK
    h = ((h ^ (h >> 12)) * 0x297A2D39) & MASK
    return (h ^ (h >> 15)) * (2.0 / 4294967296.0) - 1.0


@njit(cache=True)
def value_noise(x, y, key):  # type: ignore[no-untyped-def]
    """Returns value noise at (x, y), given in wavelengths: in [-1, 1), continuous in value and slope."""
    i, j = int(np.floor(x)), int(np.floor(y))
    a, b = x - i, y - j
    a, b = a * a * (3 - 2 * a), b * b * (3 - 2 * b)
    low = lattice_value(i, j, key) * (1 - a) + lattice_value(i + 1, j, key) * a
    high = lattice_value(i, j + 1, key) * (1 - a) + lattice_value(i + 1, j + 1, key) * a
    return low * (1 - b) + high * b


@njit(cache=True)
def contrast_kept(wavelength, footprint):  # type: ignore[no-untyped-def]
    """Returns the share, 0 to 1, of a pattern's contrast that pixels of this footprint keep."""
    return min(max((wavelength / footprint - 2.0) / 3.0, 0.0), 1.0)


@njit(cache=True)
def grain(x, y, key, footprint, coarsest):  # type: ignore[no-untyped-def]
    """Returns noise at (x, y) m, of standard deviation about 0.5 where no scale is lost."""
    total, wavelength = 0.0, coarsest
    x, y = x / coarsest, y / coarsest
    for octave in range(9):
        share = contrast_kept(wavelength, footprint)
        if share == 0.0:
            break
        total += share * value_noise(x, y, key + octave)
        wavelength *= FINER
        x, y = (COS * x - SIN * y) / FINER, (SIN * x + COS * y) / FINER
    return total * 0.7


@njit(cache=True)
def slabs(x, y, width, depth, joint, key, footprint):  # type: ignore[no-untyped-def]
    """Returns the brightness at (x, y) m of slabs in a running bond: in [-1, 1] by slab, down to -1.5 in the joints.

    width, depth, joint, footprint: m.
    """
    row = np.floor(y / depth)
    shift = (int(row) % 2) * 0.5 * width
    column = np.floor((x - shift) / width)
    own = lattice_value(int(column), int(row), key) * contrast_kept(min(width, depth), footprint)
    u, v = x - shift - column * width, y - row * depth
    edge = min(min(u, width - u), min(v, depth - v))
    soft = max(joint, 0.7 * footprint)  # a joint narrower than a pixel is drawn wider and fainter
    dark = max(0.0, 1.0 - edge / soft) * min(joint / soft, 1.0) * contrast_kept(min(width, depth), footprint)
    return own * (1 - dark) - 1.5 * dark


@njit(cache=True)
def plant_pattern(x, y, size, key):  # type: ignore[no-untyped-def]
    """Returns the pattern at (x, y) m: plants grow where it is above a level, first outside the world."""
    outside = max(max(-x, x - size[0]), max(-y, y - size[1]))
    patches = value_noise(0.4 * x, 0.4 * y, key) + 0.5 * value_noise(1.1 * x, 1.1 * y, key + 1)
    return patches + min(max(outside, -1.0), 1.0)


@njit(cache=True)
def plant_cover(x, y, size, key, level, footprint):  # type: ignore[no-untyped-def]
    """Returns the share of a pixel at (x, y) m that shows plants; 0 where leaves are finer than pixels."""
    near = min(max(2.0 * contrast_kept(0.3, footprint) - 0.5, 0.0), 1.0)
    return near * min(max((plant_pattern(x, y, size, key) - level) / 0.1 + 0.5, 0.0), 1.0)
