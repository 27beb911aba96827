"""The rectangle of the ground that a plan shows: all people and objects of the scene, with a margin."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Scene

MARGIN = 1.0  # m: the least margin of a plan round people and objects.


def plan_area(scene: Scene | None, places: Array) -> tuple[Array, Array] | None:
    """Returns the lower left and upper right corner (2,), m, of the ground to show; None if nothing is known."""
    places = _finite(places)
    if scene is not None:
        return _scene_area(scene, places)
    if not len(places):
        return None
    return places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN


def _scene_area(scene: Scene, places: Array) -> tuple[Array, Array]:
    objects = [places, scene.pillars[:, :2], scene.doors.reshape(-1, 2), scene.service]
    objects += [end[None] for flight in scene.stairs for end in (flight.foot, flight.head)]
    points = _finite(np.concatenate([np.asarray(each).reshape(-1, 2) for each in objects]))
    if not len(points):
        return np.zeros(2), scene.size
    low, high = points.min(axis=0) - 2 * MARGIN, points.max(axis=0) + 2 * MARGIN
    return np.maximum(low, np.minimum(0, low + MARGIN)), np.minimum(high, np.maximum(scene.size, high - MARGIN))


def _finite(points: Array) -> Array:
    return points[np.isfinite(points).all(axis=1)]
