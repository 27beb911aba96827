"""What decides a score besides the tracks: the scorer, its settings, and the truth.

Only scores where all of it is equal are compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.hashing import canonical_hash
from sim.types import Sequence
from tracking.scoring.catalogue import SCORER

# The keys of a sequence's scores that are no scores, but decide them.
CONDITIONS = (
    "scorer", "similarity", "surface", "group_match", "given", "detections", "frames_scored", "label_step", "px_per_m",
    "camera", "unscored", "truth",
)  # fmt: skip
DIGITS = 9  # Decimals that count of a camera, whose last bits depend on the processor.


def conditions(sequence: Sequence) -> dict[str, Any]:
    """Returns the scorer's number, and what options of the source change in the truth; large parts as hashes."""
    truth, camera = sequence.truth, sequence.camera
    assert truth is not None
    view = None
    if camera is not None:
        numbers = (camera.focal_px, camera.centre_px, camera.position, camera.rotation.ravel(), camera.radial)
        view = (camera.kind, camera.image, np.round(np.hstack(numbers), DIGITS) + 0.0, sequence.scene)
    rules = (truth.labelled, truth.unscored, truth.visibility, truth.truncation)
    return {
        "scorer": SCORER, "px_per_m": round(truth.px_per_m, DIGITS), "camera": view and canonical_hash(view)[:16],
        "unscored": canonical_hash(rules)[:16],
    }  # fmt: skip
