"""What to draw over a picture or on a plan: a layer holds boxes or places, trails, ellipses, groups and events of truth
or of one tracker.

Layers are computed from `Truth` or `Tracks` here, over pictures in px, on plans in m; `layer_painting` draws them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from sim.geometry.hull_kernels import convex_hull
from sim.store.track_boxes import upright_boxes
from sim.store.truth_files import with_ground_height
from sim.types import Array, Bools, Camera, GroupEvent, Groups, Ints, Scene, Tracks, Truth
from tracking.drawing.canvas import box_corners

BOX_MARGIN = 5.0  # px between members' boxes and the outline of their group.

FOOTPRINT = 0.3  # m that a group's outline keeps from its members on a plan.

HIDDEN = 0.2  # A person whose visible share is below this gets a thin box.

NOT_CAPTIONED = ("enter", "leave")  # Kinds of events without a caption.

# Standard deviations: the ellipse at this distance holds 95 % of a normal distribution in the plane.
SIGMA_95 = math.sqrt(5.991)

# The same for 99 %: the points d from a group's centre with d' E^-1 d = 9.21 for its extent E.
SIGMA_99 = math.sqrt(9.21)

UNIT_CIRCLE = np.stack([f(np.linspace(0, 2 * np.pi, 32, endpoint=False)) for f in (np.cos, np.sin)], axis=1)
NO_POINTS = np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class GroupMark:
    """One group in one frame, in px or m.

    id: of the group. hull: (V, 2) polygon round the members. The other fields are known only of a group that is tracked
    as a whole. extent: (32, 2), points of the ellipse that holds 99 % of the group by the covariance of its members.
    size: number of people, estimated. Unknown or unseen arrays have no rows; an unknown size is nan.
    """

    id: int
    hull: Array
    extent: Array = field(default_factory=NO_POINTS.copy)
    size: float = math.nan


@dataclass(frozen=True, eq=False)
class FrameMarks:
    """What is drawn of one layer in one frame: N people, or N groups if `whole_groups`, in px or m.

    id: (N,) of people or groups. box: (N, 4) left, top, width, height. at: (N, 2) x, y, the point that trails follow.
    ellipse: (N, 32, 2), points of the ellipse that holds the position with 95 % probability. Rows of these three are
    nan where unknown, and all boxes on a plan. hidden: (N,) True for true people of whom less than 20 % is visible,
    never for tracks. groups: marks of the groups in the frame. whole_groups: True if the tracker tracks groups, not
    people.
    """

    id: Ints
    box: Array
    at: Array
    ellipse: Array
    hidden: Bools
    groups: tuple[GroupMark, ...] = ()
    whole_groups: bool = False


NOBODY = FrameMarks(np.zeros(0, np.int64), np.zeros((0, 4)), NO_POINTS, np.zeros((0, 32, 2)), np.zeros(0, bool))


@dataclass(frozen=True, eq=False)
class Layer:
    """What to draw of the truth or of one tracker's output over a sequence.

    name: "true" or "tracked". prefix: letter before group ids, "G" for the truth, "T" for tracks. frames: the marks by
    frame number, counted from 1; a frame may be missing. events: pairs (frame, event); the frame is that in which the
    event becomes known: for tracks that in which it was emitted (its first frame if that is unknown), for the truth its
    first frame. plain: True if thin white boxes are drawn only (rings for people without a box), no trails, ellipses,
    ids or groups; for the truth under tracks.
    """

    name: str
    prefix: str
    frames: dict[int, FrameMarks]
    events: tuple[tuple[int, GroupEvent], ...] = ()
    plain: bool = False

    def at(self, index: int) -> FrameMarks:
        """Returns the marks of frame `index`, from 1; none if the layer has no such frame."""
        return self.frames.get(index, NOBODY)

    def trails(self, index: int, past: int) -> Iterator[tuple[int, Array]]:
        """Returns (id, points (K, 2)) of each unbroken trail that ends in frame `index`, the newest point first."""
        trails: dict[int, list[Array]] = {}
        unbroken = set(self.at(index).id.tolist())
        for k in range(index, max(index - past, 1) - 1, -1):
            marks = self.at(k)
            points = dict(zip(marks.id.tolist(), marks.at, strict=True))
            unbroken &= {i for i, at in points.items() if np.isfinite(at).all()}
            for i in unbroken:
                trails.setdefault(i, []).append(points[i])
        return ((i, np.array(points)) for i, points in trails.items() if len(points) > 1)

    def recent_events(self, index: int, frames: float) -> list[GroupEvent]:
        """Returns the events known in frame `index` or less than `frames` frames before it, newest first."""
        recent = [(known, e) for known, e in self.events if 0 <= index - known < frames and e.kind not in NOT_CAPTIONED]
        return [event for _, event in sorted(recent, key=lambda pair: -pair[0])]


def layer_of_truth(truth: Truth, plan: bool = False) -> Layer:
    """Returns the layer of the truth over pictures, in px, or if `plan` is True on a plan, in m. It has no frames if
    boxes (for pictures) or positions (for a plan) are not labelled."""
    frames, known = {}, truth.pos if plan else truth.box
    for index in range(1, truth.length + 1) if known is not None else ():
        now = truth.at(index)
        nan = np.full((len(now.id), 4), np.nan)
        box, pos = (nan if plan or now.box is None else now.box), (nan[:, :2] if now.pos is None else now.pos)
        at, ellipse = pos if plan else _feet(box), np.full((len(now.id), len(UNIT_CIRCLE), 2), np.nan)
        hidden = now.visibility < HIDDEN
        frames[index] = FrameMarks(now.id, box, at, ellipse, hidden, _outlined(now.group, box, at))
    return Layer("true", "G", frames, tuple((e.start, e) for e in truth.events or ()))


def layer_of_tracks(
    tracks: SequenceOf[Tracks], camera: Camera | None, scene: Scene | None, plan: bool = False
) -> Layer:
    """Returns the layer of one tracker's output over pictures, in px, or on a plan, in m.

    Over pictures, positions on the ground are projected; on a plan they must be on the ground.
    """
    frames = {t.index: _marks(t, camera, scene, plan) for t in tracks}
    events = tuple((e.start if e.emitted is None else e.emitted, e) for t in tracks for e in t.events)
    return Layer("tracked", "T", frames, events)


def _marks(t: Tracks, camera: Camera | None, scene: Scene | None, plan: bool) -> FrameMarks:
    n, same = len(t.id), plan or t.plane == "image"
    to_drawing = _plane if same else partial(_in_picture, camera=camera, scene=scene)
    box, ellipses = np.full((n, 4), np.nan), np.full((n, len(UNIT_CIRCLE), 2), np.nan)
    if t.unit == "group":
        at = np.concatenate([NO_POINTS, *(_one(to_drawing(pos[None])) for pos in t.pos)])
        return FrameMarks(t.id, box, at, ellipses, np.zeros(n, bool), _whole_groups(t, to_drawing), whole_groups=True)
    if t.box is not None and not plan:
        box = t.box
    elif not same and camera is not None:
        box = upright_boxes(camera, with_ground_height(t.pos, scene))
    at = _feet(box)
    if same:
        at = np.where(np.isfinite(at), at, t.pos[:, :2])
    for k, cov in enumerate(t.cov[:, :2, :2]):
        if len(points := to_drawing(ellipse(t.pos[k, :2], cov, SIGMA_95))):
            ellipses[k] = points
    return FrameMarks(t.id, box, at, ellipses, np.zeros(n, bool), _outlined(t.group, box, at))


def _whole_groups(t: Tracks, to_drawing: Callable[[Array], Array]) -> tuple[GroupMark, ...]:
    groups = t.groups or Groups.none()
    rows = dict(zip(groups.id.tolist(), range(len(groups.id)), strict=True))

    def mark(k: int, name: int) -> GroupMark:
        if (row := rows.get(name)) is None:
            return GroupMark(name, NO_POINTS)
        hull = groups.hull[row] if groups.hull else NO_POINTS
        extent = ellipse(t.pos[k, :2], groups.extent[row], SIGMA_99)
        return GroupMark(name, to_drawing(hull), to_drawing(extent), float(groups.size[row]))

    return tuple(mark(k, name) for k, name in enumerate(t.id.tolist()))


def _one(point: Array) -> Array:
    return point if len(point) else np.full((1, 2), np.nan)


def _feet(box: Array) -> Array:
    return np.asarray(box[:, :2] + box[:, 2:] * np.array([0.5, 1.0]))


def _outlined(group: Ints, box: Array, at: Array) -> tuple[GroupMark, ...]:
    """Returns a mark for each group with two or more known boxes, or places if no box is known, by increasing id."""
    boxed = np.isfinite(box[:, 0])
    known = boxed if boxed.any() else np.isfinite(at[:, 0])
    outlines = box_corners(box + BOX_MARGIN * np.array([-1, -1, 2, 2]))
    if not boxed.any():
        outlines = at[:, None] + FOOTPRINT * UNIT_CIRCLE[::2]
    found = [(g, (group == g) & known) for g in np.unique(group[group >= 0]).tolist()]
    return tuple(GroupMark(g, convex_hull(outlines[own].reshape(-1, 2))) for g, own in found if own.sum() > 1)


def _plane(points: Array) -> Array:
    return points[:, :2]


def _in_picture(points: Array, camera: Camera | None, scene: Scene | None) -> Array:
    """Returns points (K, 2 or 3) on the ground or in space as (K, 2) px, or (0, 2) if one of them cannot be seen."""
    if camera is None or not len(points):
        return NO_POINTS
    from sim.scene.camera import project

    uv, depth = project(camera, with_ground_height(points, scene))
    return uv if (depth > 0).all() and np.isfinite(uv).all() else NO_POINTS


def ellipse(centre: Array, cov: Array, sigmas: float) -> Array:
    """Returns points (32, 2) of the ellipse at `sigmas` standard deviations round `centre` (2,), or (0, 2) if `cov` (2,
    2), the covariance, is not finite."""
    if not np.isfinite(cov).all():
        return np.zeros((0, 2))
    values, vectors = np.linalg.eigh(cov)
    return np.asarray(centre + sigmas * (UNIT_CIRCLE * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
