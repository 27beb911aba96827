"""Finds out from boxes alone whether the camera moves, and by how much in each frame (ours).

The boxes of two frames show the movement as one difference that most of them share: that which most boxes of the first
frame have to a box of about their height in the second one, and then the median of what they have near it. It contains
the mean movement of people, which changes slowly. So the camera moves if the difference changes from frame to frame by
more than people can accelerate together, or is larger than people can walk, and than its own standard error. From
LEAST_SIGNS such frames within MEMORY on, all tracks are shifted before boxes are associated: by what most confirmed
tracks differ from boxes near their predicted places, which people's movements are no part of, or, while too few are
confirmed, by what the boxes of two frames share.

A slow and steady turn is not told from people who walk, and needs no compensation: filters predict it.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array

LEAST_BOXES, LEAST_SHARE = 5, 0.6  # boxes that share a difference, in number and as a share of those with any
REACH = 1.2  # heights: boxes so near each other are compared
ALIKE = 0.25  # largest difference of the logarithms of their heights
SHARED = 0.12  # heights within which differences are shared
ACCELERATION, SPEED = 5.0, 5.0  # m/s² and m/s that people do not reach together
ERRORS = 4.0  # standard errors beyond which a difference is not by chance
LEAST_SIGNS, MEMORY = 5, 3.0  # frames that show a movement, within s


class BoxMotion:
    """The movement of a camera, from the boxes of each frame.

    State: moves, True from the frame on in which the camera was found to move; signs, times (s) of frames that showed a
    movement; the boxes of the last frame, and the difference and its standard error that were found in it, px.
    """

    def __init__(self, fps: float) -> None:
        self.moves, self.signs, self._fps = False, list[float](), fps
        self._boxes, self._last = np.zeros((0, 4)), (np.zeros(2), np.inf)

    def shift(self, boxes: Array, predicted: Array, px_per_m: float, t: float) -> Array | None:
        """Returns the movement (2,) px of the picture to this frame, at t s; None if there is none.

        boxes (N, 4), predicted (K, 4), of confirmed tracks: centre x, y, height, width, px.
        """
        found = shared_difference(self._boxes, boxes)
        self._boxes, (before, error) = boxes, self._last
        self._last = (np.zeros(2), np.inf) if found is None else found
        if not self.moves and found is not None:
            both = float(np.hypot(error, found[1]))
            jump, size = float(np.linalg.norm(found[0] - before)), float(np.linalg.norm(found[0]))
            jumps = jump > max(ACCELERATION / self._fps**2 * px_per_m, ERRORS * both)
            if jumps or size > max(SPEED / self._fps * px_per_m, ERRORS * found[1]):
                self.signs = [s for s in self.signs if t - s <= MEMORY] + [t]
            self.moves = len(self.signs) >= LEAST_SIGNS
        if not self.moves:
            return None
        shared = shared_difference(predicted, boxes) or found
        return None if shared is None else shared[0]


def shared_difference(first: Array, second: Array) -> tuple[Array, float] | None:
    """Returns the difference (2,) px between boxes of two frames that most of them share, and its standard error, px.

    None if too few share one. first (N, 4), second (M, 4): centre x, y, height, width, px.
    """
    if min(len(first), len(second)) < LEAST_BOXES:
        return None
    away = second[None, :, :2] - first[:, None, :2]
    with np.errstate(invalid="ignore", divide="ignore"):  # a predicted box of no height is like no other
        alike = np.abs(np.log(second[None, :, 2] / first[:, None, 2])) <= ALIKE
    rows, columns = np.nonzero(alike & (np.abs(away).max(axis=2) <= REACH * first[:, 2, None]))
    compared = len(np.unique(rows))
    if compared < LEAST_BOXES:
        return None
    differences, within = away[rows, columns], SHARED * first[rows, 2]
    # For each candidate the boxes with another one at that difference; of equally many the smallest difference counts.
    close = np.abs(differences[None] - differences[:, None]).max(axis=2) <= within[None]
    votes = np.array([len(np.unique(rows[one])) for one in close])
    best = int(np.lexsort((np.square(differences).sum(axis=1), -votes))[0])
    if votes[best] < max(LEAST_BOXES, LEAST_SHARE * compared):
        return None
    chosen = differences[close[best]]
    move = np.median(chosen, axis=0)
    # of a median, whose standard error is 1.25 times that of a mean
    return move, 1.25 * float(np.sqrt(np.square(chosen - move).sum(axis=1).mean() / len(chosen)))
