"""Detections of a whole sequence as rows, and how true ones and false alarms become the lists of single frames."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.types import Array, Detections, Ints, Plane, Truth


@dataclass(frozen=True)
class Readings:
    """R detections of a whole sequence, true ones or false alarms; rows need not be sorted by frame.

    frame (R,)    frame number, from 1 on
    pos (R, 2)    x, y in m on the ground; the box's centre in px where the truth has no positions
    box (R, 4)    left, top, width, height in px; None without boxes
    score (R,)    in [0, 1]
    order (R,)    random, above 0 and at most 1: the detections of a frame are listed in ascending order of it, so that
                  a place in the list tells nothing
    """

    frame: Ints
    pos: Array
    box: Array | None
    score: Array
    order: Array


def detections_by_frame(true: Readings, false: Readings, truth: Truth) -> list[Detections]:
    """Returns a list of truth.length Detections, for frames 1 on: true detections and false alarms mixed, in random
    order.

    A frame without any has empty Detections. The plane is "ground" (positions in m) if the truth has positions, else
    "image" (px). Boxes are None unless `true` and `false` both have boxes. Velocities are None. Readings outside frames
    1 to truth.length are dropped.
    """
    frame = np.concatenate([true.frame, false.frame])
    order = np.lexsort((np.concatenate([true.order, false.order]), frame))
    pos = np.concatenate([true.pos, false.pos])[order]
    score = np.concatenate([true.score, false.score])[order]
    box = None if true.box is None or false.box is None else np.concatenate([true.box, false.box])[order]
    plane: Plane = "image" if truth.pos is None else "ground"
    cuts = np.searchsorted(frame[order], np.arange(1, truth.length + 2))
    found = []
    for k, (a, b) in enumerate(pairwise(cuts)):
        here = None if box is None else box[a:b]
        found.append(Detections(k + 1, k / truth.fps, plane, pos[a:b], None, here, score[a:b]))
    return found
