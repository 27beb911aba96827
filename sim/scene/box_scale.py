"""The scale of an image from the heights of people's boxes, when neither a camera nor the user states it.

There are two rules on purpose. A tracker gets the scale of the first boxes (`scale_of_first_boxes`), so that it needs
no later frame. The truth, which is read as a whole, takes that of all labelled boxes (`scale_of_all_boxes`). On
PETS09-S2L1, TUD-Campus and TownCentre the scale of the first 100 boxes is within 11 % of that of all boxes, on CAVIAR's
mwt1gt within 12 %.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Ints

BOXES = 100  # boxes that the first frames must hold together


def scale_of_first_boxes(frame: Ints, height: Array) -> tuple[float, int]:
    """Returns the image scale, px per m, by the first 100 boxes, and the last frame that it was taken from.

    frame, height (R,): of each box, in any order; height px.
    """
    known = np.isfinite(height)
    frame, height = frame[known], height[known]
    if not len(frame):
        return float("nan"), 0
    last = int(np.sort(frame)[min(BOXES, len(frame)) - 1])
    return float(np.median(height[frame <= last])) / PERSON_HEIGHT, last


def scale_of_all_boxes(height: Array) -> float:
    """Returns the image scale, px per m, by the heights (R,) px of all labelled boxes."""
    return float(np.median(height)) / PERSON_HEIGHT if len(height) else float("nan")
