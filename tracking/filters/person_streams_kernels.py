"""Kernels of tracking.filters.person_streams: numbers by counters, with SplitMix64 (Steele, Lea & Flood 2014).

Number n of a stream that begins at b is mixed(b + (n + 1) GOLDEN): it needs no state. Normal numbers are quantiles of
uniform ones (Wichura 1988, AS 241), with the coefficients of sim.elementary.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.compiler import njit
from sim.elementary import CENTRE_BELOW, CENTRE_TOP, FAR_BELOW, FAR_TOP, TAIL_BELOW, TAIL_TOP
from sim.types import Array

GOLDEN: Any = np.uint64(0x9E3779B97F4A7C15)
FIRST, SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
SHIFTS = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(12)
STEP = 2.0**-52  # Of the uniform numbers, which have 52 random bits.
HALF_STEP = 2.0**-53


@njit(cache=True)
def mixed(z: Any) -> Any:
    """Returns the 64 bits of a number, mixed; z: uint64."""
    z = (z ^ (z >> SHIFTS[0])) * FIRST
    z = (z ^ (z >> SHIFTS[1])) * SECOND
    return z ^ (z >> SHIFTS[2])


@njit(cache=True)
def mix_in(key: Any, values: Any) -> None:
    """Mix values (K,) into keys (K,), both uint64; keys are changed."""
    for k in range(len(key)):
        key[k] = mixed(key[k] + GOLDEN) ^ values[k]
        key[k] = mixed(key[k])


@njit(cache=True)
def fill_uniforms(begin: Any, key: Any, out: Array) -> None:
    """Writes uniform numbers in [0, 1) into out (A, K, C); begin (1,): uint64, of all; key (K,): uint64, of each."""
    rows, people, columns = out.shape
    at = np.empty(people, np.uint64)
    for k in range(people):
        at[k] = mixed(begin[0] ^ key[k])
    for a in range(rows):  # in the order in which numbers lie in memory
        for k in range(people):
            for c in range(columns):
                bits = mixed(at[k] + np.uint64(a * columns + c + 1) * GOLDEN) >> SHIFTS[3]
                out[a, k, c] = np.int64(bits) * STEP


@njit(cache=True)
def to_normals(uniforms: Array, normals: Array) -> None:
    """Writes into normals (N,) the standard normal numbers whose quantiles are the uniform numbers (N,) of a stream."""
    for n in range(len(uniforms)):  # no branch, so that it is computed for several numbers at once
        centred = (uniforms[n] - 0.5) + HALF_STEP
        normals[n] = centred * _ratio(CENTRE_TOP, CENTRE_BELOW, 0.180625 - centred * centred)
    for n in range(len(uniforms)):
        centred = (uniforms[n] - 0.5) + HALF_STEP
        if abs(centred) > 0.425:
            normals[n] = _tail(centred)


@njit(cache=True)
def _tail(centred):  # type: ignore[no-untyped-def]
    # the quantile is odd, so that only one tail needs coefficients
    r = math.sqrt(-math.log(0.5 - abs(centred)))
    value = _ratio(TAIL_TOP, TAIL_BELOW, r - 1.6) if r <= 5.0 else _ratio(FAR_TOP, FAR_BELOW, r - 5.0)
    return value if centred > 0.0 else -value


@njit(cache=True)
def _ratio(top, below, x):  # type: ignore[no-untyped-def]
    p, q = top[0], below[0]
    for k in range(1, 8):
        p, q = p * x + top[k], q * x + below[k]
    return p / q
