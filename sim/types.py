"""The types that modules exchange: frames, detections, tracks, groups, events, cameras, truth, sequences.

Conventions (docs/reference/formats.md): on the ground m, x right, y away from the default camera, z up; in images px,
(0, 0) the upper left corner of the first pixel, u right, v down; frames from 1, t = (frame - 1) / fps in s; angles rad,
0 along +x, counter-clockwise on the ground. Arrays, all read-only: float64, ids int64, flags bool, images uint8."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np

from sim.arrays import Array as Array
from sim.arrays import Bools as Bools
from sim.arrays import Frozen
from sim.arrays import Image as Image
from sim.arrays import Ints as Ints
from sim.arrays import no_ids as no_ids
from sim.place import Box as Box
from sim.place import Camera as Camera
from sim.place import Looks as Looks
from sim.place import Scene as Scene
from sim.place import Stairs as Stairs
from sim.stuck import Immobile, NeverArrives

Plane = Literal["ground", "space", "image"]
Unit = Literal["person", "group"]
DetectionMode = Literal["image", "truth", "file", "both"]
BACKGROUNDS = 50  # empty frames that precede frame 1 of a simulated sequence
OWN_BACKGROUND = f"{BACKGROUNDS} empty frames before frame 1"
# m of a unit of length that the name of a column, as x_cm, may end with
LENGTH_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "km": 1000.0}
EVENT_KINDS = ("merge", "split", "cross", "queue", "form", "dissolve", "enter", "leave")


@dataclass(frozen=True, slots=True, eq=False)
class Detections(Frozen):
    """What a detector found in frame `index` (from 1) at time t (s): M detections, one row each. plane: "ground" (pos:
    x, y in m), "space" (pos: x, y, z in m) or "image" (pos: u, v of the box's centre in px). pos (M, D): D is 3 in
    space, else 2. vel (M, D): the plane's unit per s, None if unknown. box (M, 4): left, top, width, height in px, None
    from a detector of points. score (M,): in [0, 1]; empty if the detector gives none."""

    index: int
    t: float
    plane: Plane
    pos: Array
    vel: Array | None = None
    box: Array | None = None
    score: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class Frame(Frozen):
    """What the sensors deliver for frame `index` (from 1) at time t (s). image: of the left (or only) camera, right: of
    the right camera, each (H, W, 3) BGR uint8, None if missing. detections: of this frame, None without a detector."""

    index: int
    t: float
    image: Image | None = None
    right: Image | None = None
    detections: Detections | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Groups(Frozen):
    """The groups of one frame, one row for each of G groups. Plane and unit (m or px) are those of the Tracks or Truth
    around it. id (G,). members: person ids of each group, () if the method knows groups only. pos (G, D): the centre;
    vel (G, D): its velocity, unit per s. extent (G, 2, 2): covariance of the members' x and y (divided by their
    number), unit squared, nan if unknown. size (G,): number of people, nan if unknown. hull: a polygon (V, 2) for each
    group, x, y counter-clockwise; V = 0 if unknown, () if all are unknown. In the truth ids ascend,
    and pos and vel are means over the members."""

    id: Ints
    members: tuple[Ints, ...]
    pos: Array
    vel: Array
    extent: Array
    size: Array
    hull: tuple[Array, ...]

    @classmethod
    def none(cls) -> Groups:
        """Returns the Groups of a frame without groups."""
        two = np.zeros((0, 2))
        return cls(no_ids(), (), two, two, np.zeros((0, 2, 2)), np.zeros(0), ())


@dataclass(frozen=True, slots=True, eq=False)
class GroupEvent:
    """One event of groups, from frame `start` to frame `end` (from 1, both inclusive). kind: merge, split, cross,
    queue, form, dissolve, enter or leave. emitted: frame in which the tracker reported the event, which may be later
    than `start`; None in the truth. Where a tracker's `step` returns None as end or emitted, it means the frame of the
    step. before, after: sorted ids of the groups concerned before and after it; -1 stands for one person alone.
    members: ids of all people concerned, sorted, () if unknown. pos: the place (x, y) in the unit of the plane (m or
    px), nan if unknown."""

    kind: str
    start: int
    end: int
    emitted: int | None
    before: tuple[int, ...]
    after: tuple[int, ...]
    members: tuple[int, ...]
    pos: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Tracks(Frozen):
    """What one tracker reports for frame `index` (from 1) at time t (s): N people or groups, one row each.

    plane: "ground", "space" (m) or "image" (px). unit "person": rows are people, group (N,) is the id of each person's
    group, -1 for alone. unit "group": rows are groups, group == id. pos, vel (N, D): position in the unit of the plane,
    velocity in that unit per s; in the image, pos is the middle of a person's box. cov (N, 2D, 2D): covariance of x, y,
    (z), vx, vy, (vz). box (N, 4): left, top, width, height in px, or None. score (N,): in [0, 1], or empty. A tracker
    of people may return groups None and events (): the grouping then fills both in and sets `derived` True. own_events:
    kinds of events that the tracker reports itself, which the grouping does not add. seen (N,): False for a person who
    was only predicted in this frame, not measured; empty: all were measured."""

    index: int
    t: float
    plane: Plane
    unit: Unit
    id: Ints
    group: Ints
    pos: Array
    vel: Array
    cov: Array
    box: Array | None = None
    score: Array = field(default_factory=lambda: np.zeros(0))
    groups: Groups | None = None
    events: tuple[GroupEvent, ...] = ()
    derived: bool = False
    own_events: tuple[str, ...] = ()
    seen: Bools = field(default_factory=lambda: np.zeros(0, bool))

    @classmethod
    def of_boxes(cls, frame: Frame, id: Any, box: Any, score: Any = (), **more: Any) -> Tracks:
        """Returns the tracks of people with boxes in the image, in the frame.

        Velocities are unknown, covariances are the identity, and nobody has a group, unless `more` says otherwise.

        Args:
            frame: The frame that `step` was given.
            id: Ids (N,) of the people, not below 0 and never used for another person.
            box: Boxes (N, 4): left, top, width, height in px.
            score: Scores (N,) in [0, 1], or empty.
            **more: Further fields of `Tracks`, such as `group` or `seen`.

        Example:
            return Tracks.of_boxes(frame, [t.id for t in found], [t.ltwh for t in found])
        """
        box = _rows(box, 4)
        return cls.of_points(frame, id, box[..., :2] + box[..., 2:4] / 2, score, plane="image", box=box, **more)

    @classmethod
    def of_points(
        cls, frame: Frame, id: Any, pos: Any, score: Any = (), *, plane: Plane = "ground", **more: Any
    ) -> Tracks:
        """Returns the tracks of people at points, in the frame. The other fields are as of `of_boxes`.

        Args:
            frame: The frame that `step` was given.
            id: As for `of_boxes`.
            pos: Positions (N, 2): x, y in m on the ground, or in px in the image; (N, 3) in space, m.
            score: As for `of_boxes`.
            plane: In which `pos` lies: "ground", "image" or "space".
            **more: Further fields of `Tracks`, such as `vel` or `box`.
        """
        n, dims = np.size(id), 3 if plane == "space" else 2
        more = {"group": np.full(n, -1), "vel": np.full((n, dims), np.nan), **more}
        more = {"cov": np.tile(np.eye(2 * dims), (n, 1, 1)), "score": np.asarray(score, float), **more}
        ids, rows = np.asarray(id) if n else no_ids(), _rows(pos, dims)
        return cls(frame.index, frame.t, plane, "person", ids, pos=rows, **more)

    @property
    def measured(self) -> Bools:
        """Flags (N,), True for each row measured in this frame: `seen`, or all True if `seen` is empty."""
        return self.seen if len(self.seen) else np.ones(len(self.id), bool)


def _rows(values: Any, columns: int) -> Array:
    """Returns values as floats in the shape that they have; of no values, no rows."""
    rows = np.asarray(values, float)
    return rows if rows.size else np.zeros((0, columns))


@dataclass(frozen=True, slots=True, eq=False)
class Context(Frozen):
    """What a tracker may know before the first frame; None where unknown. fps: frames/s. px_per_m: image scale, for all
    of the image (of a pinhole camera, that of a person in the middle), nan if unknown. camera, scene: of the recording.
    image_size: (width, height) px. background: sample pictures (K, H, W, 3) BGR uint8 to train a background model."""

    fps: float
    px_per_m: float
    camera: Camera | None = None
    scene: Scene | None = None
    image_size: tuple[int, int] | None = None
    background: Image | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """One order of a scenario's script, as recorded in gt/script.json; measured events never depend on it. kind:
    "merge", "split" or "queue". fired: frame (from 1) in which it took effect, None if it never did. before, after:
    person ids of each group concerned, as the script plans them before and after the order. time: of firing, s, None if
    it never fired. event: index in the truth's events of the event that fulfilled it; None if unknown or none did."""

    id: str
    kind: str
    fired: int | None
    before: tuple[tuple[int, ...], ...]
    after: tuple[tuple[int, ...], ...]
    time: float | None = None
    event: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class States(Frozen):
    """The states of a crowd from which groups and events are measured: C ticks at `rate` per s from t = 0, P people.

    pos, vel (C, P, 2): m, m/s; heading (C, P): rad; present (C, P); intent (C, P): number of the group that the script
    assigns the person to. walls: (tick, walls (W, 2, 2) m since this tick) from tick 0 on, shut doors included; ():
    those of the scene. waiting (C, P): True for people on the way to a door that is shut; None: there is none. A
    simulated crowd has the ticks of its script, whatever the camera's frame rate."""

    rate: float
    pos: Array
    vel: Array
    heading: Array
    present: Bools
    intent: Ints
    walls: tuple[tuple[int, Array], ...] = ()
    waiting: Bools | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Motion(Frozen):
    """The motion of a whole crowd: T frames from frame 1, P people; person id = column + 1. seed: of the simulation.
    repeat: number of the suite entry's copy, or 0. fps: frames/s. pos (T, P, 2): x, y in m; vel (T, P, 2): m/s; heading
    (T, P): rad; nan while absent. present (T, P): True while in the scene. intent (T, P): number of the group that the
    script assigns the person to (a number of its own for a person alone, -1 while absent). subgroup (T, P): number of
    the sub-group of that group, -1 while absent or without; None: no group has any. height, width, depth (P,):
    of the body, m. free_speed (P,): walking speed alone, m/s. orders: of the script. measured: states from which the
    truth is measured; None: the frames themselves. never_arrive: groups that do not reach their goal. immobile:
    people who stood still on the way. unfired: id of each order that never fired, and the reason in words. clothes (P,
    2, 3): red, green, blue of upper garment and trousers, grey levels; nan where any; None: all nan. looks: None if
    everybody is body and head only, and there are no things."""

    name: str
    seed: int
    repeat: int
    fps: float
    pos: Array
    vel: Array
    heading: Array
    present: Bools
    intent: Ints
    height: Array
    width: Array
    depth: Array
    free_speed: Array
    scene: Scene
    orders: tuple[Order, ...] = ()
    measured: States | None = None
    never_arrive: tuple[NeverArrives, ...] = ()
    immobile: tuple[Immobile, ...] = ()
    unfired: tuple[tuple[str, str], ...] = ()
    clothes: Array | None = None
    looks: Looks | None = None
    subgroup: Ints | None = None

    def states(self) -> States:
        """Returns the states from which the truth is measured."""
        if self.measured is not None:
            return self.measured
        return States(self.fps, self.pos, self.vel, self.heading, self.present, self.intent)


@dataclass(frozen=True, slots=True, eq=False)
class Unscored(Frozen):
    """L labelled rows that are not scored, sorted by frame. frame (L,). box (L, 4): left, top, width, height in px.
    distractor (L,): True if a track on this box is left out of the scores. region (L,): True for a region in which
    tracks on nobody are left out; None without regions. min_height: px; tracks on nobody of at most this height are
    left out."""

    frame: Ints
    box: Array
    distractor: Bools
    region: Bools | None = None
    min_height: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Near(Frozen):
    """Hard negatives (gt/near.csv), K rows: persons with ids a and b satisfy the merge rule (nearer than 1.5 m,
    velocities within 0.5 m/s, for 2 s) from frame start to end (from 1, both inclusive), but are not in one group. All
    fields (K,), int64."""

    start: Ints
    end: Ints
    a: Ints
    b: Ints


@dataclass(frozen=True, slots=True, eq=False)
class FrameTruth(Frozen):
    """The truth of frame `index` (from 1) at time t (s), one row for each of N people. It never reaches a tracker. id
    (N,): persons. group (N,): id of the person's group, -1 for alone. pos (N, 2): x, y in m. vel (N, 2): m/s. box (N,
    4): left, top, width, height in px, of the whole body, unclipped. visibility (N,): visible share of the whole body,
    0 to 1. groups: on the ground, in m; groups_px: in the image, in px. pixels: who is in
    each pixel. A field that is None is unknown."""

    index: int
    t: float
    id: Ints
    group: Ints
    pos: Array | None
    vel: Array | None
    box: Array | None
    visibility: Array
    groups: Groups | None
    groups_px: Groups | None
    pixels: PixelTruth | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PixelTruth(Frozen):
    """The truth of one frame's pixels; its N people are the frame's people, sorted by id. ids (H, W): person id (from
    1), -2 for walls, pillars and things, 0 elsewhere. disparity (H, W): px, nan where the right camera does not see the
    point; None if not computed. visible_px (N,): number of pixels that show the person; amodal_px (N,): number of
    pixels inside the image that would show the person without occlusion. box (N, 4): left, top, width, height in px of
    the visible pixels, nan without any. blob (N,): number, from 0, of the region of people who touch each other in the
    image, -1 if hidden."""

    ids: Ints
    disparity: Array | None
    visible_px: Array
    amodal_px: Array
    box: Array
    blob: Ints

    @property
    def visibility(self) -> Array:
        """The share (N,) of each person's pixels that is not occluded: visible_px / amodal_px.

        Parts outside the image do not count. 0 for a person without pixels in the image.
        """
        return np.asarray(self.visible_px / np.maximum(self.amodal_px, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Truth(Frozen):
    """The truth of a sequence of T = `length` frames from frame 1: R rows sorted by (frame, id), one per person and
    frame. frame, id (R,). group (R,): id of the person's group, -1 for alone. subgroup (R,): number of the sub-group of
    that group, such as a pair of a class, from 1, -1 for alone or without; None: no group has any. pos (R, 2): x, y on
    the ground, m. vel (R, 2): m/s. box (R, 4): left, top, width, height in px, of the whole body, unclipped.
    visible_box (R, 4): of the visible part, nan if hidden. visibility, truncation (R,): shares of the whole body that
    are visible (1 if unknown), and outside the image. z (R,): height of the ground, m. heading (R,): rad. height (R,):
    of the person, m. groups, groups_px: T Groups, on the ground (m) and in the image (px). labelled (T,): True for
    frames with group labels. events, near (strangers who walk like a group): measured from the motion. orders: of the
    script, () without. px_per_m: image scale, nan if unknown. fps: frames/s. unscored: labelled rows that are not
    scored; None without such labels. camera, scene: of the sequence, by which boxes are compared on the ground. Fields
    that may be None are None if unknown."""

    name: str
    fps: float
    length: int
    px_per_m: float
    frame: Ints
    id: Ints
    group: Ints
    pos: Array | None
    vel: Array | None
    box: Array | None
    visibility: Array
    z: Array | None = None
    heading: Array | None = None
    height: Array | None = None
    truncation: Array | None = None
    visible_box: Array | None = None
    groups: tuple[Groups, ...] | None = None
    groups_px: tuple[Groups, ...] | None = None
    labelled: Bools | None = None
    events: tuple[GroupEvent, ...] | None = None
    near: Near | None = None
    orders: tuple[Order, ...] = ()
    unscored: Unscored | None = None
    camera: Camera | None = None
    scene: Scene | None = None
    subgroup: Ints | None = None

    def rows(self, index: int) -> slice:
        """Returns the slice of the rows of frame `index` (from 1)."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        return slice(int(low), int(high))

    def at(self, index: int) -> FrameTruth:
        """Returns the truth of frame `index`, 1 to `length`, without pixels."""
        r = self.rows(index)

        def cut(a: Array | None) -> Array | None:
            return None if a is None else a[r]

        return FrameTruth(
            index, (index - 1) / self.fps, self.id[r], self.group[r], cut(self.pos), cut(self.vel), cut(self.box),
            self.visibility[r], None if self.groups is None else self.groups[index - 1],
            None if self.groups_px is None else self.groups_px[index - 1],
        )  # fmt: skip


@dataclass(frozen=True)
class Sequence:
    """A sequence of frames, simulated, stored or recorded; it can be iterated any number of times, from frame 1. fps:
    frames/s. length: number of frames, None if unknown before reading. frames(): a new iterator over Frame, with the
    detections. bare(): a new iterator over the same frames without pictures; bare is None if this would not be
    quicker. has_images, has_right, has_detections: what the frames hold. image_size: (width, height) px. image_size,
    camera and scene are None if unknown, px_per_m is nan.
    Fields that load are functions, or None if there is nothing to load: load_truth() gives the Truth; load_background()
    pictures (K, H, W, 3) of a scene to train a background model; load_people() the person ids of each group that the
    script names; load_owners() for each frame the ids (M,) of the people whom its detections show, -1 for false alarms;
    load_pixels(index) the PixelTruth of frame `index`; load_light() the factor of brightness of each frame, (length,),
    without clouds; load_cameras() the Camera of each frame if it moves, as `camera` is None then. source: where it
    comes from ("kind", "path", "seed", …). never_arrive: groups of a simulated crowd that do not reach their goal."""

    name: str
    fps: float
    length: int | None
    frames: Callable[[], Iterator[Frame]]
    load_truth: Callable[[], Truth] | None = None
    image_size: tuple[int, int] | None = None
    camera: Camera | None = None
    scene: Scene | None = None
    px_per_m: float = float("nan")
    has_images: bool = False
    has_right: bool = False
    has_detections: bool = False
    load_background: Callable[[], Image] | None = None
    load_people: Callable[[], Mapping[str, tuple[int, ...]]] | None = None
    load_owners: Callable[[], list[Ints]] | None = None
    source: dict[str, Any] = field(default_factory=dict)
    bare: Callable[[], Iterator[Frame]] | None = None
    load_pixels: Callable[[int], PixelTruth] | None = None
    load_light: Callable[[], Array] | None = None
    load_cameras: Callable[[], tuple[Camera, ...]] | None = None
    never_arrive: tuple[NeverArrives, ...] = ()
    immobile: tuple[Immobile, ...] = ()

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def without_pictures(self) -> Iterator[Frame]:
        """Returns a new iterator over the frames: without pictures if `bare` is given, else the same as `frames()`."""
        return self.frames() if self.bare is None else self.bare()

    def frame_truth(self, index: int) -> FrameTruth | None:
        """Returns the truth of frame `index` (from 1), None if the sequence has no truth.

        Its `pixels` are given if the sequence has `load_pixels`.
        """
        if self.truth is None:
            return None
        here = self.truth.at(index)
        return here if self.load_pixels is None else here.replace(pixels=self.load_pixels(index))

    @property
    def truth(self) -> Truth | None:
        """The truth, loaded on first use and then kept; None if nothing is labelled."""
        if self.load_truth is None:
            return None
        cached: Truth | None = self.__dict__.get("_truth")
        if cached is None:
            cached = self.load_truth().replace(camera=self.camera, scene=self.scene)
            self.__dict__["_truth"] = cached
        return cached

    def background(self) -> Image | None:
        """Returns sample pictures (K, H, W, 3) to train a background model on; None if there are none."""
        return None if self.load_background is None else self.load_background()


class Tracker(Protocol):
    """The interface of a tracker. needs: one or more of "pixels" (pictures), "stereo" (left and right pictures),
    "boxes", "points" (detections) and "pixels and boxes". The tracker can work with each of these inputs alone."""

    needs: Any  # tuple[str, ...]; Any, so that a class need not say so

    def reset(self, context: Context, seed: int) -> None:
        """Forgets all state and prepares for a new sequence. seed: for the tracker's random numbers."""

    # Any: a tracker that needs detections always gets them, and may say so.
    def step(self, frame: Frame, detections: Any) -> Tracks:
        """Returns this tracker's tracks of `frame`, from this and earlier frames only. detections: those of the frame,
        possibly with zero rows (Detections); None if the tracker is given pictures only. A tracker that
        needs "pixels and boxes" may get both, and any picture alone."""
        ...
