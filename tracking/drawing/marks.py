"""What is to be drawn over a picture: boxes, ids, trails, ellipses, regions of groups and events of one side, in px."""

from __future__ import annotations

import math
from collections.abc import Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field

import numpy as np

from sim.geometry.polygons import convex_hull
from sim.io.store.truth_files import standing
from sim.io.store.upright_boxes import upright_boxes
from sim.types import Array, Bools, Camera, GroupEvent, Groups, Ints, Scene, Tracks, Truth

SURE = math.sqrt(5.991)
"""Standard deviations that hold 95 % of a plane's normal distribution."""

WIDE = math.sqrt(9.21)
"""The same for 99 %: d' E^-1 d <= 9.21 round a group of extent E."""

ROUND = np.stack([f(np.linspace(0, 2 * np.pi, 32, endpoint=False)) for f in (np.cos, np.sin)], axis=1)
AROUND = 5.0
"""px between a member's box and the edge of the region."""

HIDDEN = 0.2
"""The visible share of a body below which its box is broken."""

QUIET = ("enter", "leave")
"""Kinds that are told nowhere in the picture."""


NOWHERE = np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class Region:
    """A group in px: the polygon hull (V, 2), no vertex where none is known or it cannot be seen.

    Of one that is tracked as a whole also around (32, 2), where 99 % of it is by its extent; way (2, 2), its middle and
    where that is in 1 s; size, people, nan where unknown.
    """

    id: int
    hull: Array
    around: Array = field(default_factory=NOWHERE.copy)
    way: Array = field(default_factory=NOWHERE.copy)
    size: float = math.nan


@dataclass(frozen=True, eq=False)
class Marks:
    """One frame of one side, N rows: box (N, 4) ltwh and at (N, 2), where trails run, nan where unknown.

    ellipse (N, 32, 2): where the position is with 95 %, nan where unknown. hidden (N,): labelled, yet hardly to be
    seen. wholes: the rows are the regions, no people.
    """

    id: Ints
    box: Array
    at: Array
    ellipse: Array
    hidden: Bools
    regions: tuple[Region, ...] = ()
    wholes: bool = False

    @classmethod
    def none(cls) -> Marks:
        """Nobody."""
        two = np.zeros((0, 2))
        return cls(np.zeros(0, np.int64), np.zeros((0, 4)), two, np.zeros((0, 32, 2)), np.zeros(0, bool))


@dataclass(frozen=True, eq=False)
class Side:
    """The truth or a tracker's answers as marks by frame, and events by the frame in which they are known."""

    name: str
    prefix: str
    frames: dict[int, Marks]
    events: tuple[tuple[int, GroupEvent], ...] = field(default=())

    def at(self, index: int) -> Marks:
        """The marks of a frame."""
        return self.frames.get(index, Marks.none())

    def trails(self, index: int, past: int) -> Iterator[tuple[int, Array]]:
        """(id, (K, 2)) of everybody present: where they were in this and the last `past` frames, back to a gap."""
        tails: dict[int, list[Array]] = {}
        going = set(self.at(index).id.tolist())
        for k in range(index, max(index - past, 1) - 1, -1):
            here = self.at(k)
            now = dict(zip(here.id.tolist(), here.at, strict=True))
            going &= {i for i, at in now.items() if np.isfinite(at).all()}
            for i in going:
                tails.setdefault(i, []).append(now[i])
        return ((i, np.array(points)) for i, points in tails.items() if len(points) > 1)

    def told(self, index: int, for_frames: float) -> list[GroupEvent]:
        """Events that became known in this frame or the last few, the newest first."""
        now = [(known, e) for known, e in self.events if 0 <= index - known < for_frames and e.kind not in QUIET]
        return [event for _, event in sorted(now, key=lambda pair: -pair[0])]


def of_tracks(tracks: SequenceOf[Tracks], camera: Camera | None, scene: Scene | None) -> Side:
    """A tracker's answers; boxes that it does not know are those of upright people where there is a camera."""
    frames = {t.index: _of_answer(t, camera, scene) for t in tracks}
    events = [(e.start if e.emitted is None else e.emitted, e) for t in tracks for e in t.events]
    return Side("tracked", "T", frames, tuple(events))


def on_plan(tracks: SequenceOf[Tracks]) -> Side:
    """Answers on the ground as marks in metres, for a view of the ground."""
    events = [(e.start if e.emitted is None else e.emitted, e) for t in tracks for e in t.events]
    return Side("tracked", "T", {t.index: _flat(t) for t in tracks}, tuple(events))


def of_truth(truth: Truth) -> Side:
    """What is true; frames without a person have no marks."""
    frames = {}
    for index in range(1, truth.length + 1):
        now = truth.at(index)
        if now.box is None or not len(now.id):
            continue
        ellipse = np.full((len(now.id), 32, 2), np.nan)
        hidden = now.visibility < HIDDEN
        frames[index] = Marks(now.id, now.box, _feet(now.box), ellipse, hidden, _regions(now.group, now.box))
    return Side("true", "G", frames, tuple((e.start, e) for e in truth.events or ()))


def _of_answer(t: Tracks, camera: Camera | None, scene: Scene | None) -> Marks:
    if t.unit == "group":
        return _of_groups(t, camera, scene)
    n = len(t.id)
    box = t.box if t.box is not None else np.full((n, 4), np.nan)
    if t.box is None and t.plane != "image" and camera is not None:
        box = upright_boxes(camera, standing(t.pos, scene))
    at = _feet(box)
    if t.plane == "image":
        at = np.where(np.isfinite(at), at, t.pos)
    return Marks(t.id, box, at, _ellipses(t, camera, scene), np.zeros(n, bool), _regions(t.group, box))


def _flat(t: Tracks) -> Marks:
    """One answer on the ground: places, and hulls of groups in metres."""
    n, groups, at = len(t.id), t.groups or Groups.none(), t.pos[:, :2]
    hulls = groups.hull or tuple(NOWHERE for _ in groups.id)
    regions = tuple(Region(g, hull) for g, hull in zip(groups.id.tolist(), hulls, strict=True))
    if t.unit == "group":
        own = dict(zip(groups.id.tolist(), range(len(groups.id)), strict=True))
        regions = tuple(_whole(t, k, groups, own.get(name), hulls) for k, name in enumerate(t.id.tolist()))
    rings = [ring(p, cov, SURE) for p, cov in zip(at, t.cov[:, :2, :2], strict=True)]
    ellipse = np.array([r if len(r) else np.full((len(ROUND), 2), np.nan) for r in rings]).reshape(n, len(ROUND), 2)
    return Marks(t.id, np.full((n, 4), np.nan), at, ellipse, np.zeros(n, bool), regions, t.unit == "group")


def _whole(t: Tracks, k: int, groups: Groups, row: int | None, hulls: tuple[Array, ...]) -> Region:
    """Row k of groups that are tracked as wholes, on the ground."""
    name, at = int(t.id[k]), t.pos[k, :2]
    way = np.stack([at, at + t.vel[k, :2]])
    if row is None:
        return Region(name, NOWHERE, way=way)
    return Region(name, hulls[row], ring(at, groups.extent[row], WIDE), way, float(groups.size[row]))


def _of_groups(t: Tracks, camera: Camera | None, scene: Scene | None) -> Marks:
    """Groups that are tracked as wholes: their regions, and trails of their middles."""
    n, groups = len(t.id), t.groups or Groups.none()
    rows = dict(zip(groups.id.tolist(), range(len(groups.id)), strict=True))

    def seen(points: Array) -> Array:
        return _seen(points, t.plane, camera, scene)

    def region(k: int, name: int) -> Region:
        row, way = rows.get(name), seen(np.stack([t.pos[k], t.pos[k] + t.vel[k]]))
        if row is None:
            return Region(name, NOWHERE, way=way)
        hull = groups.hull[row] if groups.hull else NOWHERE
        around = ring(t.pos[k, :2], groups.extent[row], WIDE)
        return Region(name, seen(hull), seen(around), way, float(groups.size[row]))

    regions = tuple(region(k, name) for k, name in enumerate(t.id.tolist()))
    at = np.array([r.way[0] if len(r.way) else [np.nan, np.nan] for r in regions]).reshape(n, 2)
    no_box, no_ellipse = np.full((n, 4), np.nan), np.full((n, len(ROUND), 2), np.nan)
    return Marks(t.id, no_box, at, no_ellipse, np.zeros(n, bool), regions, wholes=True)


def _feet(box: Array) -> Array:
    """(N, 2) middles of the lower edges."""
    return np.asarray(box[:, :2] + box[:, 2:] * np.array([0.5, 1.0]))


def _regions(group: Ints, box: Array) -> tuple[Region, ...]:
    """The hull of the boxes, a little wider, of each group of two or more."""
    names = np.unique(group[group >= 0])
    box = box + AROUND * np.array([-1, -1, 2, 2])
    found = [(int(g), box[(group == g) & np.isfinite(box[:, 0])]) for g in names]
    return tuple(Region(g, convex_hull(_corners(own))) for g, own in found if len(own) > 1)


def _corners(box: Array) -> Array:
    return np.concatenate([box[:, :2] + box[:, 2:] * np.array(c) for c in ((0, 0), (1, 0), (1, 1), (0, 1))])


def _seen(points: Array, plane: str, camera: Camera | None, scene: Scene | None) -> Array:
    """Points (K, 2 or 3) in a tracker's plane as px; none where they cannot all be seen."""
    if plane == "image" or not len(points):
        return points
    if camera is None:
        return NOWHERE
    from sim.scene.camera import project

    uv, depth = project(camera, standing(points, scene))
    return uv if (depth > 0).all() and np.isfinite(uv).all() else NOWHERE


def ring(at: Array, cov: Array, reach: float) -> Array:
    """(32, 2) points so many standard deviations of cov (2, 2) round a place; none where it is unknown."""
    if not np.isfinite(cov).all():
        return NOWHERE
    values, vectors = np.linalg.eigh(cov)
    return np.asarray(at + reach * (ROUND * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _ellipses(t: Tracks, camera: Camera | None, scene: Scene | None) -> Array:
    """(N, 32, 2) px, nan where the covariance or a view of the place is missing."""
    found = np.full((len(t.id), len(ROUND), 2), np.nan)
    for k, cov in enumerate(t.cov[:, :2, :2]):
        seen = _seen(ring(t.pos[k, :2], cov, SURE), t.plane, camera, scene)
        if len(seen):
            found[k] = seen
    return found
