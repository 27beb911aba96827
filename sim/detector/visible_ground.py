"""Where people could stand in an image: the range of u, v in px that shows ground, and a person's height in px there.

Both come from the camera, or from the labelled boxes if the camera is unknown. False alarms are drawn by them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.elementary import length
from sim.scene.body import PERSON_HEIGHT, person_boxes
from sim.scene.camera import project, to_ground
from sim.scene.camera_motion import MovingCamera, View, camera_at
from sim.types import Array, Camera, Ints, Truth

SMALLEST = 0.25  # ground ends where people are smaller than this share of a person in the middle of the image


class VisibleGround:
    """The part of an image that shows ground, and the height of people there: by the camera, else by the labels.

    Made from truth, camera and size.

        truth, camera   as given; camera is None if unknown
        low, high (2,)  upper left and lower right corner of that part, u, v in px; zeros without camera and boxes
        line (2,)       a, b of a person's height a + b v (px) at row v of the feet; used without a camera only
        limits          least and greatest height in px, used without a camera only: half the least and 1.5 times the
                        greatest labelled height; (1, 1) without boxes

    size: width, height of the image in px, None if unknown; ignored with a camera. The part ends at the top where
    people have SMALLEST (0.25) of the height in the middle of the image; seen from above (kind "top") it is the whole
    image. Without a camera and without an image size, it is the rectangle round the labelled feet.
    """

    def __init__(self, truth: Truth, camera: Camera | None, size: Array | None) -> None:
        self.truth, self.camera = truth, camera
        self.low, self.high = np.zeros(2), np.zeros(2)
        self.line, self.limits = np.array([1.0, 0.0]), (1.0, 1.0)
        if camera is not None:
            self.high = np.array(camera.image, dtype=float)
            self.low[1] = 0.0 if camera.kind == "top" else furthest_row(camera)
        elif truth.box is not None and len(truth.box):
            foot = truth.box[:, :2] + truth.box[:, 2:] * [0.5, 1.0]
            self.line = height_line(foot[:, 1], truth.box[:, 3])
            self.limits = 0.5 * float(truth.box[:, 3].min()), 1.5 * float(truth.box[:, 3].max())
            self.low, self.high = foot.min(axis=0), foot.max(axis=0)
            if size is not None:
                # The row at which people have SMALLEST of the height of people at the middle row of the image.
                (a, b), rows = self.line, float(size[1])
                top = np.clip((SMALLEST * (a + b * rows / 2) - a) / b, 0.0, rows / 2) if b > 1e-6 else 0.0
                self.low, self.high = np.array([0.0, top]), np.array(size)

    def image_point(self, x: float, y: float) -> tuple[float, float]:
        """Returns the image point (u, v) px at share x of the width and share y of the height of the ground part.

        Shares run from 0 to 1, (0, 0) is the upper left corner. Other shares give points outside the part.
        """
        u, v = self.low + np.array([x, y]) * (self.high - self.low)
        return float(u), float(v)

    def usual_height(self, u: float, v: float) -> float:
        """Returns the height in px of the box of a standard person (1.7 m) whose feet are at image point (u, v) px.

        With a camera it is that of the person's projection. Where the camera gives no box, as right under it or where
        no ground is seen, it is 1.7 m at a depth that equals the camera's height, at least 1 m. Without a camera it is
        estimated from the labelled boxes, within half the least and 1.5 times the greatest labelled height; 1 px
        without boxes.
        """
        if self.camera is None:
            return float(np.clip(self.line[0] + self.line[1] * v, *self.limits))
        pos = to_ground(self.camera, np.array([[u, v]]))
        height = np.full(1, PERSON_HEIGHT)
        tall = person_boxes(self.camera, np.column_stack([pos, [0.0]]), np.zeros(1), height)[0, 3]
        if not np.isfinite(tall):  # right under the camera
            tall = PERSON_HEIGHT * self.camera.focal_px[1] / max(float(self.camera.position[2]), 1.0)
        return float(tall)

    def ground_points(self, u: Array, v: Array, otherwise: Array) -> Array:
        """Returns the ground points (L, 2), x and y in m, seen at image points u, v (L,) px.

        Walls and stairs are ignored. Where no ground is seen, the point is that of the same row of `otherwise` (L, 2).
        `otherwise` itself is returned if there is no camera. Image points above the ground part are first moved down to
        its upper edge, except for a camera of kind "top", which has ground everywhere.
        """
        if self.camera is None:
            return otherwise
        top = -np.inf if self.camera.kind == "top" else self.low[1]
        pos = to_ground(self.camera, np.stack([u, np.maximum(v, top)], axis=1))
        return np.where(np.isfinite(pos), pos, otherwise)


class GroundInView:
    """The `VisibleGround` of each frame: one for all frames, unless the camera moves.

    State: the truth, whether the camera moves, and the grounds made so far, by frame.
    """

    def __init__(self, truth: Truth, view: View | None, size: Array | None) -> None:
        self.truth, self.moves = truth, isinstance(view, MovingCamera)
        self._view, self._size, self._made = view, size, dict[int, VisibleGround]()

    def in_frame(self, frame: int) -> VisibleGround:
        """Returns the ground of a frame, from 1."""
        k = frame if self.moves else 1
        if k not in self._made:
            camera = None if self._view is None else camera_at(self._view, (k - 1) / self.truth.fps)
            self._made[k] = VisibleGround(self.truth, camera, self._size)
        return self._made[k]

    def by_frame(self, frame: Ints) -> Iterator[tuple[VisibleGround, slice]]:
        """Yields the ground of each of the frames (L,) and its row; all rows at once unless the camera moves."""
        if not self.moves or not len(frame):
            yield self.in_frame(1), slice(None)
            return
        for k, one in enumerate(frame.tolist()):
            yield self.in_frame(one), slice(k, k + 1)

    def carried(self, frame: Ints, box: Array, pos: Array) -> Array:
        """Returns boxes (L, 4) px of things that stand on the ground, as a moving camera sees them in the frames (L,).

        box: as the camera of the first frame sees them. pos (L, 2): where they stand, m. A box whose ground is unknown,
        or behind the camera, becomes empty.
        """
        first = self.in_frame(int(frame[0]))
        out = np.zeros_like(box)
        for k, one in enumerate(frame.tolist()):
            here = self.in_frame(one)
            assert here.camera is not None
            (u, v) = project(here.camera, np.array([[*pos[k], 0.0]]))[0][0].tolist()
            if np.isfinite([u, v]).all():
                foot = box[k, 0] + box[k, 2] / 2, box[k, 1] + box[k, 3]
                w, h = (box[k, 2:] * (here.usual_height(u, v) / first.usual_height(*foot))).tolist()
                out[k] = u - w / 2, v - h, w, h
        return out


def labelled_points(truth: Truth, shares: Array) -> Array:
    """Returns the points (N, 2) in m at shares (N, 2), 0 to 1, of the rectangle round all labelled positions.

    (0, 0) is the corner of least x and y. Without labelled positions the result is zeros; if a labelled position is
    nan, it is nan.
    """
    if truth.pos is None or not len(truth.pos):
        return np.zeros_like(shares)
    low, high = truth.pos.min(axis=0), truth.pos.max(axis=0)
    return np.asarray(low + shares * (high - low))


def furthest_row(camera: Camera) -> float:
    """Returns the uppermost image row, px from the top, where people are 0.25 as tall as in the middle row, or taller.

    For pinhole cameras. A person is 1.7 m tall; heights in the image are compared, in px. 241 rows from the top to the
    bottom are tested, along the column through the image centre. If the middle row shows no ground, heights are
    compared with the greatest height at any row. 0 if no row shows ground or no row qualifies.
    """
    v = np.linspace(0.0, camera.image[1], 241)
    ground = to_ground(camera, np.column_stack([np.full_like(v, camera.centre_px[0]), v]))
    foot = np.column_stack([ground, np.zeros(len(v))])
    head = foot + np.array([0.0, 0.0, PERSON_HEIGHT])
    size = length(project(camera, head)[0] - project(camera, foot)[0])
    at_middle = size[len(v) // 2] if np.isfinite(size[len(v) // 2]) else np.nanmax(size, initial=0.0)
    enough = np.flatnonzero(np.nan_to_num(size) >= SMALLEST * at_middle)
    return float(v[enough[0]]) if len(enough) else 0.0


def height_line(foot: Array, height: Array) -> Array:
    """Returns (a, b) of the least-squares line height = a + b foot.

    foot (N,): image rows of the feet, px. height (N,): box heights, px.

    If all feet are in one row, b is 0 and a the mean height. Without boxes (N = 0) the result is (nan, 0), with a numpy
    warning.
    """
    spread = foot - foot.mean()
    square = float(np.sum(spread * spread))
    b = float(np.sum(spread * height)) / square if square > 1e-9 * len(foot) else 0.0
    return np.array([height.mean() - b * foot.mean(), b])


def clip_boxes(box: Array, image_size: tuple[int, int]) -> Array:
    """Returns the parts (N, 4) of boxes (N, 4) that lie in the image, both left, top, width, height in px.

    image_size: width, height in px. A box outside the image gets width or height 0. A nan box stays nan.
    """
    limit = np.array(image_size, dtype=float)
    low, high = np.clip(box[:, :2], 0, limit), np.clip(box[:, :2] + box[:, 2:], 0, limit)
    return np.concatenate([low, high - low], axis=1)
