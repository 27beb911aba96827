"""Compiled patterns of ground, walls and plants: value noise on integer lattices, at several scales, without
repetition.

The value of a lattice point is a hash of its indices. A pattern is therefore a pure function of place, and both cameras
of a pair see the same pattern. Scales finer than twice a pixel's footprint are left out: they would flicker and differ
between the views. A footprint is the size of a pixel on the surface, in m, or of a sample if a pixel has several.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.materials import BACKDROPS

HEDGE, HOUSES = BACKDROPS.index("hedge"), BACKDROPS.index("houses")
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


@njit(cache=True)
def _covered(inside, footprint):  # type: ignore[no-untyped-def]
    """Returns the share of a pixel that lies inside an edge, whose middle is `inside` m away from it."""
    return min(max(inside / max(footprint, 0.01) + 0.5, 0.0), 1.0)


@njit(cache=True)
def paint_lines(x, y, key, footprint):  # type: ignore[no-untyped-def]
    """Returns the share of paint, 0 to 1, at (x, y) m: worn lines, whole or dashed, and here and there a zebra."""
    turn = 1.6 * lattice_value(0, 0, key)
    c, s, gap = np.cos(turn), np.sin(turn), 4.0 + 2.0 * lattice_value(0, 1, key)
    along, across = c * x + s * y, c * y - s * x
    line = np.floor(across / gap)
    off = abs(across - (line + 0.5) * gap)
    dashed = lattice_value(int(line), 0, key + 1) > 0.0 and int(np.floor(along / 2.0)) % 3 == 0
    paint = 0.0 if dashed else _covered(0.06 - off, footprint)
    i = np.floor(along / 18.0)
    if lattice_value(int(i), 1, key + 2) > 0.2:
        middle = (i + 0.5) * 18.0
        stripe = 0.25 - abs(across - (np.floor(across) + 0.5))
        paint = max(paint, _covered(min(stripe, 1.6 - abs(along - middle)), footprint))
    wear = value_noise(1.3 * x, 1.3 * y, key + 3) + 0.7 * value_noise(9.0 * x, 9.0 * y, key + 4)
    return paint * min(max(0.85 + 0.4 * wear, 0.2), 1.0)


@njit(cache=True)
def stain(x, y, key, footprint):  # type: ignore[no-untyped-def]
    """Returns the change of brightness at (x, y) m by stains, cracks, litter and manholes, -0.8 to 0.5."""
    blotch = value_noise(0.6 * x, 0.6 * y, key) + 0.5 * value_noise(1.9 * x, 1.9 * y, key + 1)
    change = -0.3 * min(max((blotch - 0.35) / 0.3, 0.0), 1.0)
    crack = abs(value_noise(0.5 * x, 0.5 * y, key + 2) + 0.3 * value_noise(2.3 * x, 2.3 * y, key + 3))
    change -= 0.35 * max(0.0, 1.0 - crack / 0.02) * contrast_kept(0.1, footprint)
    for kind in range(2):  # litter, manholes
        cell = 1.1 if kind == 0 else 7.0
        i, j = int(np.floor(x / cell)), int(np.floor(y / cell))
        if lattice_value(i, j, key + 4 + kind) > 0.6:
            radius = 0.33 if kind else 0.07 + 0.05 * lattice_value(j, i, key + 6)
            u = x - (i + 0.5 + 0.25 * lattice_value(i, j, key + 7)) * cell
            v = y - (j + 0.5 + 0.25 * lattice_value(i, j, key + 8)) * cell
            light = -0.35 if kind else 0.5 * lattice_value(i, j, key + 9)
            change += light * _covered(radius - np.sqrt(u * u + v * v), footprint)
    return change


@njit(cache=True)
def facade(along, z, key, footprint):  # type: ignore[no-untyped-def]
    """Returns the change of brightness at a place (along, z) m of a wall with storeys of windows, and doors below."""
    wide, high = 2.6 + lattice_value(0, 3, key), 3.1 + 0.4 * lattice_value(1, 3, key)
    half_wide = wide * (0.27 + 0.12 * lattice_value(2, 3, key))
    half_high = high * (0.26 + 0.1 * lattice_value(3, 3, key))
    i, j = np.floor(along / wide), np.floor(z / high)
    u, v = abs(along - (i + 0.5) * wide), z - (j + 0.55) * high
    door = j == 0 and lattice_value(int(i), 1, key + 1) > 0.5
    edge = min(half_wide - u, half_high - (v if door else abs(v)))  # m inside a window
    kept = contrast_kept(half_wide, footprint)
    if edge > 0.08 and u > 0.03:
        return kept * (-0.5 + 0.35 * lattice_value(int(i), int(j), key))
    if edge > 0.0:
        return 0.35 * kept
    if u > 0.5 * wide - 0.06 and lattice_value(int(np.floor(along / wide + 0.5)), 2, key + 1) > 0.3:
        return 0.45 * lattice_value(4, 3, key) - 0.15  # downpipe
    return -0.12 * kept if z - j * high < 0.12 else 0.0


@njit(cache=True)
def poster(along, z, key):  # type: ignore[no-untyped-def]
    """Returns whether a place (along, z) m of a wall is a door or poster, and its changes of brightness and warmth."""
    i = np.floor(along / 4.1)
    kind = lattice_value(int(i), 0, key)
    off = abs(along - (i + 0.5) * 4.1 - lattice_value(int(i), 1, key))
    low, top = (0.0, 2.05) if kind > 0.5 else (0.9, 1.6 + 0.6 * lattice_value(int(i), 4, key))
    inside = min(0.45 + 0.2 * kind - off, top - z)  # m inside the frame's outer edge
    shown, light = kind > -0.1 and inside > 0.0 and z >= low, 0.6 * lattice_value(int(i), 2, key)
    return shown, -0.4 * light if inside < 0.07 else light, 0.35 * lattice_value(int(i), 3, key)


@njit(cache=True)
def skyline(kind, along, key):  # type: ignore[no-untyped-def]
    """Returns the height, m, of a backdrop (index in `materials.BACKDROPS`) at `along` m on it."""
    if kind == HOUSES:
        return 9.0 + 4.0 * lattice_value(int(np.floor(along / 11.0)), 0, key)
    ragged = value_noise(0.15 * along, 0.0, key) + 0.4 * value_noise(1.3 * along, 0.0, key + 1)
    return 1.7 + 0.15 * ragged if kind == HEDGE else 6.0 + 2.5 * ragged


@njit(cache=True)
def parked_car(along, z, key):  # type: ignore[no-untyped-def]
    """Returns the grey level of a parked car seen from the side at a place (along, z) m, and its warmth; -1: no car."""
    i = np.floor(along / 6.0)
    own = lattice_value(int(i), 0, key)
    if own < 0.3:
        return -1.0, 0.0
    u, high = along - (i + 0.5) * 6.0, 1.35 if own < 0.75 else 1.95  # cars, vans
    wheel = min((abs(u) - 1.3) ** 2 + (z - 0.3) ** 2, 1.0)
    if wheel < 0.09:
        return 30.0, 0.0
    if abs(u) > 2.1 or z < 0.22 or z > high or (z > 0.85 and abs(u + 0.2) > 1.5 - 0.6 * (z - 0.85)):
        return -1.0, 0.0
    if 0.9 < z < high - 0.1 and abs(abs(u + 0.2) - 0.65) < 0.55 - 0.4 * (z - 0.9):
        return 45.0, -0.1  # windows
    return 125.0 + 95.0 * lattice_value(int(i), 1, key), 0.5 * lattice_value(int(i), 2, key) ** 3
