"""How the people of a truth and of a tracker are compared: by boxes, or by positions on the ground or in the image."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from sim.types import Array, Tracks, Truth
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.group_and_event_scores import ComparedSides
from tracking.scoring.people_and_groups import PersonRows, Surface
from tracking.scoring.position_errors import REACH

# How two people are compared: IoU of boxes, or distance of positions on the ground or in the image.
Similarity = Literal["boxes", "ground", "image"]


class IncomparableError(ValueError):
    """Raised if the truth or the tracks have people but lack the boxes or positions that are to be compared."""


def plane_of(truth: Truth, tracks: Sequence[Tracks]) -> str:
    """Returns the plane of one tracker's positions, or the truth's without tracks: "ground", "space" or "image"."""
    own = "image" if truth.pos is None else "ground"
    return next((t.plane for t in tracks if len(t.id)), tracks[0].plane if tracks else own)


def people_pairs(sides: ComparedSides, similarity: Similarity) -> Pairs:
    """Returns the candidate pairs of true and tracked people of one frame. Raises IncomparableError if data lack."""
    true, est = sides.true, sides.est
    if similarity == "boxes":
        if true.box is None or est.box is None:
            raise IncomparableError("no boxes to compare: score on the ground")
        return box_pairs(true.rows, est.rows, true.box, est.box)
    scale = sides.truth.px_per_m if similarity == "image" else 1.0
    if not 0 < scale < np.inf:
        if len(true.rows) and len(est.rows):
            raise IncomparableError(f"no image scale to compare positions by, px_per_m is {scale:g}: state it")
        scale = 1.0
    true_pos, est_pos = _positions(true, similarity, "ground"), _positions(est, similarity, sides.plane)
    return point_pairs(true.rows, est.rows, true_pos, est_pos, REACH * scale)


def _positions(people: PersonRows, surface: Surface, plane: str) -> Array:
    positions = people.positions_on(surface, plane)
    if positions is None and len(people.rows):
        where, other = {
            "ground": ("on the ground", "boxes or in the image"),
            "image": ("in the image", "on the ground"),
        }[surface]
        raise IncomparableError(f"no positions {where} to compare: score {other}")
    return np.zeros((0, 2)) if positions is None else positions
