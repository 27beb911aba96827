"""Where the boxes of stored tracks come from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from sim.types import Camera, Tracks


def box_source(tracks: Sequence[Tracks], camera: Camera | None) -> Literal["measured", "projected", "none"]:
    """measured: the tracker gave some. projected: it gave none, and follows on the ground what a camera sees: upright
    people stand for them. none: there is nothing to project, or it says itself that it knows no boxes in the image."""
    if any(t.box is not None and len(t.id) for t in tracks):
        return "measured"
    return "projected" if camera is not None and not any(t.plane == "image" for t in tracks) else "none"
