"""How far off people's places are, beside how like they are: RMSE of who is found, GOSPA of everybody."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.errors import people_errors
from tracking.scoring.gospa import gospa
from tracking.scoring.rows import People, Surface
from tracking.scoring.similarity import point_pairs

REACH = 2.0  # m: places this far apart have similarity 0; GOSPA's cut-off


def place_scores(
    true: People, est: People, stands_for: Ints, surface: Surface, plane: str, scale: float, frames: int
) -> dict[str, float]:
    """Errors by key, in the surface's unit; none where one side has no places on it.

    stands_for: the true row of each estimated one, or -1; plane: of the tracks' pos; scale: units per metre; frames:
    how many are scored. Velocities are compared on the ground.
    """
    ours, theirs = true.places(surface, "ground"), est.places(surface, plane)
    if ours is None or theirs is None or not np.isfinite(scale):
        return {}
    vel: tuple[Array | None, Array | None] = (true.vel, est.vel) if surface == "ground" else (None, None)
    pairs = point_pairs(true.rows, est.rows, ours, theirs, REACH * scale)
    return people_errors(stands_for, ours, theirs, *vel) | gospa(pairs, REACH * scale, frames)
