"""Random numbers of people: each person has streams of the own, so that nobody changes those of others.

A number depends on the seed, the role (what it is drawn for), the person's key, the frame and its place in the row. A
key is made of the frame and the place in which a person was detected first: it does not depend on who else is there,
nor on the order of detections. No number is stored, and streams need no state.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.rng import ROLE
from sim.types import Array
from tracking.filters import person_streams_kernels

Keys = NDArray[np.uint64]  # One number for each of K people, (K,).
PLACE = 1000.0  # 1/m: places are told apart to a millimetre.
NOBODY = np.zeros(1, np.uint64)  # The key of what belongs to all people together.


def birth_keys(points: Array, frame: int) -> Keys:
    """Returns the keys (M,) that identify the random numbers of people first detected at points (M, 2), m, in a frame.
    They depend on places, frame number and, for equal places, order only."""
    place = np.rint(points * PLACE).astype(np.int64)
    # people at one place, to a millimetre, are told apart by their order
    order = np.lexsort(place.T)
    first = np.ones(len(points), bool)
    first[1:] = (np.diff(place[order], axis=0) != 0).any(axis=1)
    begin = np.maximum.accumulate(np.where(first, np.arange(len(points)), 0))
    copy = np.empty(len(points), np.int64)
    copy[order] = np.arange(len(points)) - begin
    key = np.full(len(points), frame, np.uint64)
    for values in (place[:, 0], place[:, 1], copy):
        person_streams_kernels.mix_in(key, values.astype(np.uint64))
    return key


class PersonStreams:
    """Random numbers of a tracker that depend on the seed, the frame, the role and each person's key only. State:
    entropy, made of the seed; frame, the number of the current frame."""

    def __init__(self, seed: int) -> None:
        self.frame = 0
        entropy = np.random.SeedSequence(seed, spawn_key=(ROLE["tracker"],))
        self.entropy = np.asarray(entropy.generate_state(1, np.uint64), np.uint64)

    def uniforms(self, role: int, key: Keys, rows: int, columns: int) -> Array:
        """Returns uniform numbers in [0, 1), (rows, K, columns), for the current frame. role: number of the purpose;
        key (K,): of each person."""
        out = np.empty((rows, len(key), columns))
        person_streams_kernels.fill_uniforms(self._begin(role), key, out)
        return out

    def normals(self, role: int, key: Keys, rows: int, columns: int) -> Array:
        """Returns standard normal numbers, (rows, K, columns), for the current frame; role, key: as of `uniforms`."""
        uniforms = self.uniforms(role, key, rows, columns)
        out = np.empty_like(uniforms)
        person_streams_kernels.to_normals(uniforms.ravel(), out.ravel())
        return out

    def _begin(self, role: int) -> Keys:
        begin: Keys = self.entropy.copy()
        for number in (role, self.frame):
            person_streams_kernels.mix_in(begin, np.array([number], np.uint64))
        return begin
