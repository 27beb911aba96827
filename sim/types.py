"""The types that modules exchange: frames, detections, tracks, groups, events, cameras, truth, sequences.

Conventions (docs/reference/formats.md): on the ground metres, x right, y away from the default camera, z up; in images
px, (0, 0) the upper left corner, u right, v down; frames are 1-based, t = (frame - 1) / fps in s; angles in radians.
Arrays are float64 except ids (int64), flags (bool) and images (uint8); every array of these types is read-only. "ltwh"
is left, top, width, height.
"""

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

Plane = Literal["ground", "space", "image"]
Unit = Literal["person", "group"]
DetectionMode = Literal["image", "truth", "file"]
BACKGROUNDS = 50  # empty frames that precede frame 1 of a simulated sequence
OWN_BACKGROUND = f"{BACKGROUNDS} empty frames before frame 1"
EVENT_KINDS = ("merge", "split", "cross", "queue", "form", "dissolve", "enter", "leave")


@dataclass(frozen=True, slots=True, eq=False)
class Detections(Frozen):
    """What a detector found in one frame, M rows.

    plane is the plane of `pos` (M, D): "ground" (x, y in m), "space" (x, y, z in m) or "image" (px, the box's centre).
    vel (M, D) in the plane's unit per s, None if unknown. box (M, 4) ltwh px, None from a detector of points. score
    (M,) in [0, 1]; empty if the detector gives none.
    """

    index: int
    t: float
    plane: Plane
    pos: Array
    vel: Array | None = None
    box: Array | None = None
    score: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class Frame(Frozen):
    """What the sensors deliver for one frame; image (left camera) and right are (H, W, 3) BGR uint8, None if missing;
    detections are None without a detector."""

    index: int
    t: float
    image: Image | None = None
    right: Image | None = None
    detections: Detections | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Groups(Frozen):
    """Groups of one frame, G rows, in the plane and unit of the Tracks or Truth that holds them.

    id (G,). members: ids of each group's people, empty if the method knows groups only. pos, vel (G, D): of the centre.
    extent (G, 2, 2): covariance of the members' positions, nan if unknown. size (G,): people, nan if unknown. hull: a
    polygon (V, 2) for each group, counter-clockwise in (x, y).
    """

    id: Ints
    members: tuple[Ints, ...]
    pos: Array
    vel: Array
    extent: Array
    size: Array
    hull: tuple[Array, ...]

    @classmethod
    def none(cls) -> Groups:
        """Return the Groups of a frame without groups."""
        two = np.zeros((0, 2))
        return cls(no_ids(), (), two, two, np.zeros((0, 2, 2)), np.zeros(0), ())


@dataclass(frozen=True, slots=True, eq=False)
class GroupEvent:
    """One event of groups, from frame `start` to frame `end`, both inclusive.

    kind: one of EVENT_KINDS. start: the onset, which may be earlier than emitted, the frame in which the tracker
    reported the event (None in the truth). before, after: sorted group ids, with -1 once for each person alone.
    members: ids of all people concerned, sorted, empty if unknown. pos: the place, in the plane's unit.
    """

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
    """What a tracker reports for one frame, N rows.

    unit "person": group (N,) is the id of the person's group, -1 for alone. unit "group": rows are groups, group == id.
    pos, vel (N, D) in the plane's unit (per s). cov (N, 2D, 2D): covariance of x, y, (z), vx, vy, (vz). box (N, 4) ltwh
    px or None. score (N,) in [0, 1] or empty. A tracker may leave groups and events empty: they are then derived from
    the tracks. derived: True once that is done.
    """

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


@dataclass(frozen=True, slots=True, eq=False)
class Stairs(Frozen):
    """Stairs: z rises in `steps` steps from 0 at the edge with midpoint foot (2,) to `rise` at the edge with midpoint
    head (2,), `width` wide; behind the head a plateau of length `landing` has z = rise. All lengths in m."""

    foot: Array
    head: Array
    width: float
    rise: float
    steps: int
    landing: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Scene(Frozen):
    """The static world, in m: size (2,); walls (W, 2, 2) segments; pillars (P, 3) x, y, radius; doors (D, 2, 2),
    segments that are openings in walls; service (S, 2) service points; stairs; heights of walls and pillars."""

    size: Array
    walls: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    pillars: Array = field(default_factory=lambda: np.zeros((0, 3)))
    doors: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    service: Array = field(default_factory=lambda: np.zeros((0, 2)))
    stairs: tuple[Stairs, ...] = ()
    wall_height: float = 2.5
    pillar_height: float = 2.5


@dataclass(frozen=True, slots=True, eq=False)
class Camera(Frozen):
    """A camera; sim.scene.camera projects with it.

    kind "pinhole": x_cam = rotation (X - position), u = fx x/z + cx, v = fy y/z + cy with focal_px (fx, fy), centre_px
    (cx, cy). kind "top": orthographic with scale px_per_m, looking straight down on `position`. image: (width, height)
    px. position (3,) m. rotation (3, 3), world to camera. baseline in m: the right camera is at +baseline along camera
    x; 0 without one. radial: Tsai's distortion, x_ideal = x (1 + radial |x|²) for x = ((u - cx)/fx, (v - cy)/fy).
    """

    kind: Literal["pinhole", "top"]
    image: tuple[int, int]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    position: Array
    rotation: Array
    baseline: float = 0.0
    px_per_m: float = float("nan")
    radial: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Context(Frozen):
    """What a tracker may know before the first frame, None where unknown. px_per_m: image scale. image_size: (width,
    height) px. background: sample pictures (K, H, W, 3) BGR uint8."""

    fps: float
    px_per_m: float
    camera: Camera | None = None
    scene: Scene | None = None
    image_size: tuple[int, int] | None = None
    background: Image | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """One order of the script, as recorded in gt/script.json; measured events never depend on it.

    fired: frame in which it took effect, None if it never did. before, after: ids of the people of each group
    concerned, as the script plans them before and after.
    """

    id: str
    kind: str
    fired: int | None
    before: tuple[tuple[int, ...], ...]
    after: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Motion(Frozen):
    """The motion of a whole crowd: T frames, P people; person id = column + 1.

    pos (T, P, 2) m, vel (T, P, 2) m/s, heading (T, P) rad: nan while absent. present (T, P). intent (T, P): number of
    the group that the script assigns the person to (a number of its own for a person alone, -1 while absent). height,
    width, depth (P,) m of the body. free_speed (P,) m/s. repeat: further random key, as in sim.rng.
    """

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


@dataclass(frozen=True, slots=True, eq=False)
class Near(Frozen):
    """Hard negatives (gt/near.csv), K rows: people a and b satisfy the merge rule from frame start to end, but are
    strangers (not in one group). a, b are person ids; all fields (K,)."""

    start: Ints
    end: Ints
    a: Ints
    b: Ints

    @classmethod
    def none(cls) -> Near:
        """Return a Near without rows."""
        return cls(no_ids(), no_ids(), no_ids(), no_ids())


@dataclass(frozen=True, slots=True, eq=False)
class FrameTruth(Frozen):
    """The truth of one frame, N people; fields as in Truth. It never reaches a tracker."""

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
    """The truth of one frame's pixels, N people in the order of FrameTruth's rows.

    ids (H, W) int64: person id, -2 for walls and pillars, 0 elsewhere. disparity (H, W) px, nan where the right camera
    does not see the point; None if it was not computed. visible_px (N,): pixels that show the person; amodal_px (N,):
    pixels inside the image that would without any occlusion. box (N, 4) ltwh px of the visible pixels, nan without any.
    blob (N,): number of the connected region of people that shows the person, -1 if hidden.
    """

    ids: Ints
    disparity: Array | None
    visible_px: Array
    amodal_px: Array
    box: Array
    blob: Ints

    @property
    def visibility(self) -> Array:
        """Return visible_px / amodal_px, shape (N,); 0 for a person without amodal pixels."""
        return np.asarray(self.visible_px / np.maximum(self.amodal_px, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Truth(Frozen):
    """The truth of a sequence of `length` frames: R rows sorted by (frame, id), one per person and frame.

    frame, id, group (R,), group -1 for alone. pos (R, 2) m, vel (R, 2) m/s on the ground. z (R,) m, height of the
    ground. box (R, 4) ltwh px, amodal and unclipped. visible_box (R, 4): of the visible part, nan if hidden.
    visibility, truncation (R,): visible share, share outside the image. heading (R,) rad, height (R,) m of the person.
    groups, groups_px: one Groups per frame, on the ground and in the image. labelled (T,): frames with group labels.
    events, near: measured from the motion. orders: of the script. Optional fields are None if unknown.
    """

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

    def rows(self, index: int) -> slice:
        """Return the slice of the rows of frame `index` (1-based)."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        return slice(int(low), int(high))

    def at(self, index: int) -> FrameTruth:
        """Return the truth of frame `index` (1-based), without its pixels."""
        r = self.rows(index)

        def cut(a: Array | None) -> Array | None:
            return None if a is None else a[r]

        return FrameTruth(
            index,
            (index - 1) / self.fps,
            self.id[r],
            self.group[r],
            cut(self.pos),
            cut(self.vel),
            cut(self.box),
            self.visibility[r],
            None if self.groups is None else self.groups[index - 1],
            None if self.groups_px is None else self.groups_px[index - 1],
        )


@dataclass(frozen=True)
class Sequence:
    """A sequence of frames, simulated, stored or recorded; it can be iterated any number of times.

    frames(): a new iterator over Frame, with the file's or simulated sensor's detections. bare(): the same without
    pictures, None if that is not quicker. length: None if unknown before reading. px_per_m: nan if unknown.
    Each load_ field is a function, or None if there is nothing to load: load_truth() the Truth; load_background()
    sample pictures (K, H, W, 3); load_people() the ids of the people of each group that the script names;
    load_pixels(index) the PixelTruth of a frame. source: where the sequence comes from ("kind", "path", "seed", …).
    """

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
    source: dict[str, Any] = field(default_factory=dict)
    bare: Callable[[], Iterator[Frame]] | None = None
    load_pixels: Callable[[int], PixelTruth] | None = None

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def without_pictures(self) -> Iterator[Frame]:
        """Return a new iterator over the frames; their pictures are left out where that saves time."""
        return self.frames() if self.bare is None else self.bare()

    def frame_truth(self, index: int) -> FrameTruth | None:
        """Return the truth of frame `index` with its pixels if they are known; None without truth."""
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
            cached = self.load_truth()
            self.__dict__["_truth"] = cached
        return cached

    def background(self) -> Image | None:
        """Return sample pictures (K, H, W, 3) BGR uint8 to train a background model on, or None."""
        return None if self.load_background is None else self.load_background()


class Tracker(Protocol):
    """The interface of a tracker. needs: the inputs it accepts, out of "pixels", "stereo", "boxes", "points"."""

    needs: tuple[str, ...]

    def reset(self, context: Context, seed: int) -> None:
        """Forget all state and start a new sequence."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Return the tracks of this frame, computed from this and earlier frames only."""
        ...
