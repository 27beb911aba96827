"""What to draw over a picture: a layer holds boxes, trails, ellipses, groups and events of truth or of one
tracker.

Layers are computed from `Truth` or `Tracks` here, in px; `layer_painting` draws them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from sim.geometry.polygons import convex_hull
from sim.io.store.track_files import upright_boxes
from sim.io.store.truth_files import with_ground_height
from sim.types import Array, Bools, Camera, GroupEvent, Groups, Ints, Scene, Tracks, Truth
from tracking.drawing.canvas import box_corners

BOX_MARGIN = 5.0  # px between members' boxes and the outline of their group.

HIDDEN = 0.2  # A person whose visible share is below this gets a dashed box.

NOT_CAPTIONED = ("enter", "leave")  # Kinds of events without a caption.

# Standard deviations: the ellipse at this distance holds 95 % of a normal distribution in the plane.
SIGMA_95 = math.sqrt(5.991)

# The same for 99 %: the points d from a group's centre with d' E^-1 d = 9.21 for its extent E.
SIGMA_99 = math.sqrt(9.21)

UNIT_CIRCLE = np.stack([f(np.linspace(0, 2 * np.pi, 32, endpoint=False)) for f in (np.cos, np.sin)], axis=1)
NO_POINTS = np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class GroupMark:
    """One group in one frame, in px.

    id: of the group. hull: (V, 2) polygon round the members. The other fields are known only of a group that is tracked
    as a whole. extent: (32, 2), points of the ellipse that holds 99 % of the group by the covariance of its members.
    motion: its centre now and, if its velocity is known, in 1 s, (2, 2) or (1, 2). size: number of people, estimated.
    Unknown or unseen arrays have no rows; an unknown size is nan.
    """

    id: int
    hull: Array
    extent: Array = field(default_factory=NO_POINTS.copy)
    motion: Array = field(default_factory=NO_POINTS.copy)
    size: float = math.nan


@dataclass(frozen=True, eq=False)
class FrameMarks:
    """What is drawn of one layer in one frame: N people, or N groups if `whole_groups`, in px.

    id: (N,) of people or groups. box: (N, 4) left, top, width, height. at: (N, 2) x, y, the point that trails follow.
    ellipse: (N, 32, 2), points of the ellipse that holds the position with 95 % probability. Rows of these three are
    nan where unknown. hidden: (N,) True for true people of whom less than 20 % is visible, never for tracks. groups:
    marks of the groups in the frame. whole_groups: True if the tracker tracks groups, not people.
    """

    id: Ints
    box: Array
    at: Array
    ellipse: Array
    hidden: Bools
    groups: tuple[GroupMark, ...] = ()
    whole_groups: bool = False

    @classmethod
    def none(cls) -> FrameMarks:
        """Returns the marks of a frame without people and groups: zero rows."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 4)), NO_POINTS, np.zeros((0, 32, 2)), np.zeros(0, bool))


@dataclass(frozen=True, eq=False)
class Layer:
    """What to draw of the truth or of one tracker's output over a sequence.

    name: "true" or "tracked". prefix: letter before group ids, "G" for the truth, "T" for tracks. frames: the marks by
    frame number, counted from 1; a frame may be missing. events: pairs (frame, event); the frame is that in which the
    event becomes known: for tracks that in which it was emitted (its first frame if that is unknown), for the truth its
    first frame.
    """

    name: str
    prefix: str
    frames: dict[int, FrameMarks]
    events: tuple[tuple[int, GroupEvent], ...] = field(default=())

    def at(self, index: int) -> FrameMarks:
        """Returns the marks of frame `index`, from 1; none if the layer has no such frame."""
        return self.frames.get(index, FrameMarks.none())

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


def layer_of_truth(truth: Truth) -> Layer:
    """Returns the layer of the truth over pictures, in px."""
    frames = {}
    for index in range(1, truth.length + 1):
        now = truth.at(index)
        if now.box is None or not len(now.id):
            continue
        ellipse = np.full((len(now.id), 32, 2), np.nan)
        hidden = now.visibility < HIDDEN
        frames[index] = FrameMarks(now.id, now.box, _feet(now.box), ellipse, hidden, _box_hulls(now.group, now.box))
    return Layer("true", "G", frames, tuple((e.start, e) for e in truth.events or ()))


def layer_of_tracks(tracks: SequenceOf[Tracks], camera: Camera | None, scene: Scene | None) -> Layer:
    """Returns the layer of one tracker's output over pictures, in px; positions on the ground are projected."""
    frames = {t.index: _marks_in_picture(t, camera, scene) for t in tracks}
    return Layer("tracked", "T", frames, _emitted(tracks))


def _emitted(tracks: SequenceOf[Tracks]) -> tuple[tuple[int, GroupEvent], ...]:
    return tuple((e.start if e.emitted is None else e.emitted, e) for t in tracks for e in t.events)


def _marks_in_picture(t: Tracks, camera: Camera | None, scene: Scene | None) -> FrameMarks:
    n, to_picture = len(t.id), partial(_in_picture, plane=t.plane, camera=camera, scene=scene)
    if t.unit == "group":
        return _whole_groups_in_picture(t, to_picture)
    box = t.box if t.box is not None else np.full((n, 4), np.nan)
    if t.box is None and t.plane != "image" and camera is not None:
        box = upright_boxes(camera, with_ground_height(t.pos, scene))
    at = _feet(box)
    if t.plane == "image":
        at = np.where(np.isfinite(at), at, t.pos)
    return FrameMarks(t.id, box, at, _ellipses(t, to_picture), np.zeros(n, bool), _box_hulls(t.group, box))


def _whole_groups_in_picture(t: Tracks, to_picture: Callable[[Array], Array]) -> FrameMarks:
    n, groups = len(t.id), _whole_groups(t, to_picture)
    at = np.array([g.motion[0] if len(g.motion) else [np.nan, np.nan] for g in groups]).reshape(n, 2)
    no_box, no_ellipse = np.full((n, 4), np.nan), np.full((n, len(UNIT_CIRCLE), 2), np.nan)
    return FrameMarks(t.id, no_box, at, no_ellipse, np.zeros(n, bool), groups, whole_groups=True)


def _whole_groups(t: Tracks, to_drawing: Callable[[Array], Array]) -> tuple[GroupMark, ...]:
    groups = t.groups or Groups.none()
    rows = dict(zip(groups.id.tolist(), range(len(groups.id)), strict=True))

    def mark(k: int, name: int) -> GroupMark:
        ends = [t.pos[k], t.pos[k] + t.vel[k]][: 1 + np.isfinite(t.vel[k]).all()]
        row, motion = rows.get(name), to_drawing(np.stack(ends))
        if row is None:
            return GroupMark(name, NO_POINTS, motion=motion)
        hull = groups.hull[row] if groups.hull else NO_POINTS
        extent = ellipse(t.pos[k, :2], groups.extent[row], SIGMA_99)
        return GroupMark(name, to_drawing(hull), to_drawing(extent), motion, float(groups.size[row]))

    return tuple(mark(k, name) for k, name in enumerate(t.id.tolist()))


def _feet(box: Array) -> Array:
    return np.asarray(box[:, :2] + box[:, 2:] * np.array([0.5, 1.0]))


def _box_hulls(group: Ints, box: Array) -> tuple[GroupMark, ...]:
    """Returns a mark for each group with two or more known boxes, by increasing id."""
    names = np.unique(group[group >= 0])
    box = box + BOX_MARGIN * np.array([-1, -1, 2, 2])
    found = [(int(g), box[(group == g) & np.isfinite(box[:, 0])]) for g in names]
    return tuple(GroupMark(g, convex_hull(box_corners(own).reshape(-1, 2))) for g, own in found if len(own) > 1)


def _in_picture(points: Array, plane: str, camera: Camera | None, scene: Scene | None) -> Array:
    """Returns points (K, 2 or 3) of a tracker's plane as (K, 2) px, or (0, 2) if one of them cannot be seen."""
    if plane == "image" or not len(points):
        return points
    if camera is None:
        return NO_POINTS
    from sim.scene.camera import project

    uv, depth = project(camera, with_ground_height(points, scene))
    return uv if (depth > 0).all() and np.isfinite(uv).all() else NO_POINTS


def _ellipses(t: Tracks, to_drawing: Callable[[Array], Array]) -> Array:
    found = np.full((len(t.id), len(UNIT_CIRCLE), 2), np.nan)
    for k, cov in enumerate(t.cov[:, :2, :2]):
        points = to_drawing(ellipse(t.pos[k, :2], cov, SIGMA_95))
        if len(points):
            found[k] = points
    return found


def ellipse(centre: Array, cov: Array, sigmas: float) -> Array:
    """Returns points (32, 2) of the ellipse at `sigmas` deviations round `centre`, none if `cov` is not finite."""
    if not np.isfinite(cov).all():
        return np.zeros((0, 2))
    values, vectors = np.linalg.eigh(cov)
    return np.asarray(centre + sigmas * (UNIT_CIRCLE * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
