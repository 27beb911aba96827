"""Warnings for people with ids whose frame numbers, frame rate or unit of length cannot be right.

A wrong rate or unit gives no error, only other groups or none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sim.truth.velocities import chords
from sim.types import Tracks
from tracking.recordings.labelled_truth import RUN


def implausible(name: str, people: Sequence[Tracks], fps: float, px_per_m: float) -> Iterator[str]:
    """Yields a warning (text) if people occur only in every n-th frame, and one if half move faster than 3 m/s in the
    image; readers warn of positions on the ground. name: of the sequence; px_per_m: image scale."""
    present = [t for t in people if len(t.id)]
    step = math.gcd(*np.diff([t.index for t in present]).astype(int).tolist())
    if step > 1:
        yield (
            f"{name}: people only in every {step}th frame, so groups may not last. Number these frames 1, 2, 3, … and "
            f"give their own rate: --fps {fps:g} if the labels have this rate, --fps {fps / step:g} if the video has it"
        )
    median = median_speed(people, fps, px_per_m)
    if median > RUN and present[0].plane == "image":
        yield f"{name}: median speed {median:.3g} m/s. Check --fps, here {fps:g}, and --px-per-m, here {px_per_m:.4g}"


def median_speed(people: Sequence[Tracks], fps: float, px_per_m: float) -> float:
    """Returns the median, over all people and frames, of the speed over the last 0.5 s, m/s; nan if none is known."""
    present = [t for t in people if len(t.id)]
    if not present:
        return math.nan
    frame = np.repeat([t.index for t in present], [len(t.id) for t in present])
    id, pos = np.concatenate([t.id for t in present]), np.concatenate([t.pos[:, :2] for t in present])
    speed = np.hypot(*chords(frame, id, pos, fps).T) / (px_per_m if present[0].plane == "image" else 1.0)
    return float(np.median(speed[np.isfinite(speed)])) if np.isfinite(speed).any() else math.nan
