"""Which part of a world is worth a picture: where people are, with what stands still there."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Scene

MARGIN = 1.0
"""m beyond a world's border, where people reach it; twice that round people elsewhere."""


def peopled(scene: Scene, pos: Array) -> tuple[Array, Array]:
    """Lower left and upper right corner (2,) of what holds all positions (N, 2) and all of the scene but its walls."""
    things = [pos, scene.pillars[:, :2], scene.doors.reshape(-1, 2), scene.service]
    things += [end[None] for flight in scene.stairs for end in (flight.foot, flight.head)]
    places = np.concatenate([np.asarray(thing).reshape(-1, 2) for thing in things])
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return np.zeros(2), scene.size
    low, high = places.min(axis=0) - 2 * MARGIN, places.max(axis=0) + 2 * MARGIN
    return np.maximum(low, np.minimum(0, low + MARGIN)), np.minimum(high, np.maximum(scene.size, high - MARGIN))
