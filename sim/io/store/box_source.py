"""Where the boxes of stored tracks come from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from sim.types import Camera, Tracks


def box_source(tracks: Sequence[Tracks], camera: Camera | None) -> Literal["measured", "projected", "none"]:
    """measured: the tracker gave some. projected: it gave none, and follows people on the ground whom a camera sees:
    upright ones stand for them. none: there is nothing to project (a group is no upright person), or it says itself
    that it knows no boxes in the image."""
    if any(t.box is not None and len(t.id) for t in tracks):
        return "measured"
    upright = not any(t.plane == "image" or t.unit == "group" for t in tracks)
    return "projected" if camera is not None and upright else "none"
