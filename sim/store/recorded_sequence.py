"""The Sequence of a recording or a stored sequence, put together from its parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import repeat
from typing import Any

from sim.types import Detections, Frame, Image, Sequence

Pictures = Callable[[], Iterator[Image | None]]  # a new iterator over one camera's picture of each frame


def recorded_sequence(
    source: dict[str, Any], name: str, fps: float, length: int, *, times: list[float] | None = None,
    detections: Callable[[int], Detections] | None = None, left: Pictures | None = None, right: Pictures | None = None,
    **known: Any,
) -> Sequence:  # fmt: skip
    """Returns the Sequence whose frames are put together from detections and pictures; None for what it has not.

    times: of each frame, s; None: evenly spaced. detections: gives those of a frame (from 1). known: further fields.
    """

    def bare() -> Iterator[Frame]:
        for k in range(1, length + 1):
            t = (k - 1) / fps if times is None else times[k - 1]
            yield Frame(k, t, detections=None if detections is None else detections(k))

    def frames() -> Iterator[Frame]:
        both = (repeat(None, length) if pictures is None else pictures() for pictures in (left, right))
        for frame, image, beside in zip(bare(), *both, strict=True):
            yield frame.replace(image=image, right=beside)

    pictured = left is not None or right is not None
    return Sequence(
        name=name, fps=fps, length=length, frames=frames if pictured else bare, bare=bare if pictured else None,
        source=source, has_images=left is not None, has_right=right is not None,
        has_detections=detections is not None, **known,
    )  # fmt: skip
