"""Finds trackers whose answers are in another unit than they say: px as metres, metres as px, corners as sizes.

Such answers are hardly ever near what the tracker was given. So each row of the first answers is compared with the
detections of its frame, and its box with its position. It fails if hardly any of the first rows fits. As soon as a few
rows, and half of all, fit, only positions on the ground are looked at, in every tenth frame: it fails if all lie far
from the detections on the ground, and at the px of detections in the image. A tracker that loses its way is no fault.

A row fits if
- its position lies on the ground near one of the last detections (GROUND, LAST), or in the image at most a person's
  height from a detection; without a camera, positions on the ground are not the px of detections,
- its box overlaps that of a detection, if both have boxes,
- its box is of a person at its position, if a camera is known; in the image, its position lies in its box,
- its position is in the picture or near it, if a tracker of pictures is on the ground before a camera.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenarios.errors import WorkError
from sim.geometry.boxes import box_iou
from sim.scene.body import PERSON_HEIGHT, person_boxes
from sim.scene.camera import project
from sim.scene.standing import standing_points
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Context, Detections, Tracks

FITTING, COMPARED = 3, 12  # rows that end the check, and rows of which hardly any may be wrong
AGAIN = 10  # frames between looks at later positions
SHARE = 0.2  # of the rows compared that must fit
GROUND = 5.0  # m: how far from the nearest detection a person may be
LAST = 200  # detections on the ground that are kept
OVERLAP = 0.05  # least IoU of a box and the box of a body at the position
GIVEN = 0.25  # least IoU of a box and a detection; .14 if a middle is taken for a corner
VIEW = 1.0  # widths and heights of the picture by which a person may be outside it


@dataclass
class PlaneCheck:
    """The comparison of a tracker's first answers with its input in one sequence.

    State: compared, fitting, numbers of rows; points (K, 2): the last detections on the ground, m; off, True if nothing
    is compared, as parameters were changed meanwhile: with bad ones a tracker may be far from everybody from the start.
    """

    compared: int = 0
    fitting: int = 0
    points: Array = field(default_factory=lambda: np.zeros((0, 2)))
    off: bool = False

    def clear(self) -> None:
        """Forgets everything, for the start of another sequence."""
        self.compared = self.fitting = 0
        self.points, self.off = np.zeros((0, 2)), False

    def check(self, t: Tracks, given: Detections | None, context: Context, tracker: str, sequence: str) -> None:
        """Compares the answer of a frame. Raises WorkError if the answers so far lie elsewhere than they say."""
        if self.off:
            return
        later = self.fitting >= max(FITTING, self.compared / 2)
        if later and (t.index % AGAIN or given is None or t.plane != "ground" or not len(self.points)):
            return
        fits = None if not len(t.id) else self._near(t, given, context) if later else self._fits(t, given, context)
        if fits is None:
            return
        if not later:
            self.compared += len(fits)
            self.fitting += int(fits.sum())
            wrong = self.compared >= COMPARED and self.fitting < SHARE * self.compared
        else:
            px = None if given is None or fits.any() or len(fits) < FITTING else _at_centres(t, given, context)
            wrong = px is not None and bool(px.all())
        if wrong:
            place, got = f"{sequence}, frame {t.index}", _words(t, int(np.argmin(fits)))
            remedy = (
                "report what is tracked in px by Tracks.of_boxes (left, top, width, height) or with "
                'plane="image", and what is tracked in m with plane="ground", x and y as the detections have them'
            )
            raise WorkError(file=tracker, place=place, got=got, expected=self._expected(t, given), remedy=remedy)

    def _fits(self, t: Tracks, given: Detections | None, context: Context) -> Bools | None:
        every = [self._near(t, given, context), _as_given(t, given), _of_a_person(t, context)]
        known = [fits for fits in every if fits is not None]
        return np.logical_and.reduce(known) if known else None

    def _near(self, t: Tracks, given: Detections | None, context: Context) -> Bools | None:
        if given is None:
            return None if t.plane == "image" else _in_view(t, context)
        if t.plane == "image":
            return _at_centres(t, given, context)
        points = given.pos[:, :2]
        if given.plane == "image":
            if context.camera is None:  # the tracker may know the ground, but px are none of it
                copied = _at_centres(t, given, context)
                return None if copied is None else ~copied
            if given.box is None:
                return None
            points = standing_points(given.box, context.camera, context.scene)
        points = points[np.isfinite(points).all(axis=1)]
        self.points = np.vstack([self.points, points])[-LAST:]
        if not len(self.points):
            return None
        return np.asarray(np.abs(t.pos[:, None, :2] - self.points).max(axis=2).min(axis=1) < GROUND)

    def _expected(self, t: Tracks, given: Detections | None) -> str:
        if t.plane != "image" and len(self.points):
            (x, y), (far_x, far_y) = self.points.min(axis=0), self.points.max(axis=0)
            return f"people in m near the detections, which lie at x {x:.1f} to {far_x:.1f}, y {y:.1f} to {far_y:.1f}"
        if given is not None and given.box is not None and len(given.box):
            return (
                f"boxes like the detections', such as {_box(given.box[0])}, and positions in m or px as the plane says"
            )
        return "people where the camera sees them, boxes and positions that agree"


def _at_centres(t: Tracks, given: Detections, context: Context) -> Bools | None:
    """Returns which rows lie at most a person's height, px, from the middle of a detection in the image."""
    tall = context.px_per_m * PERSON_HEIGHT
    if given.box is not None:
        centre, tall = given.box[:, :2] + given.box[:, 2:] / 2, float(given.box[:, 2:].max(initial=0.0))
    elif given.plane == "image":
        centre = given.pos
    elif context.camera is not None:
        points = given.pos[:, :2]
        centre, _ = project(context.camera, np.column_stack([points, np.full(len(points), PERSON_HEIGHT / 2)]))
        centre = centre[np.isfinite(centre).all(axis=1)]
    else:
        return None
    if not len(centre) or np.isnan(tall):
        return None
    return np.asarray(np.abs(t.pos[:, None, :2] - centre).max(axis=2).min(axis=1) <= tall)


def _as_given(t: Tracks, given: Detections | None) -> Bools | None:
    if t.box is None or t.unit == "group" or given is None or given.box is None or not len(given.box):
        return None
    return np.asarray(box_iou(t.box[:, None], given.box).max(axis=1) >= GIVEN)


def _of_a_person(t: Tracks, context: Context) -> Bools | None:
    if t.box is None or t.unit == "group":
        return None
    if t.plane == "image":
        away = np.abs(t.pos - t.box[:, :2] - t.box[:, 2:] / 2)
        return np.asarray((away <= np.maximum(t.box[:, 2:], 1)).all(axis=1))
    camera, n = context.camera, len(t.id)
    if camera is None:
        return None
    xy = t.pos[:, :2]
    z = np.zeros(n) if context.scene is None else height_at(context.scene, xy)
    body = person_boxes(camera, np.column_stack([xy, z]), np.zeros(n), np.full(n, PERSON_HEIGHT))
    return np.asarray(box_iou(t.box, body) >= OVERLAP)


def _in_view(t: Tracks, context: Context) -> Bools | None:
    if context.camera is None:
        return None
    z = t.pos[:, 2] if t.plane == "space" else np.zeros(len(t.id))
    uv, _ = project(context.camera, np.column_stack([t.pos[:, :2], z]))
    size = np.array(context.camera.image)
    with np.errstate(invalid="ignore"):
        return np.asarray(((uv >= -VIEW * size) & (uv <= (1 + VIEW) * size)).all(axis=1))


def _words(t: Tracks, row: int) -> str:
    unit = "px" if t.plane == "image" else "m"
    at = ", ".join(f"{v:.1f}" for v in t.pos[row])
    box = "" if t.box is None else f" with the box {_box(t.box[row])}"
    return f'plane "{t.plane}", {t.unit} {t.id[row]} at {at} {unit}{box}; so nearly all {t.unit}s'


def _box(box: Array) -> str:
    return ", ".join(f"{v:.4g}" for v in box)
