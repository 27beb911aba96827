"""All types that cross a module's border: what sensors deliver, what trackers answer, what is true.

Conventions (docs/formats.md): metres on the ground, x right, y away from the default camera, z up; px in the image,
(0, 0) the upper left corner, u right, v down; frames are 1-based, t = (frame - 1) / fps; seconds; radians.
Arrays are float64 except ids (int64), flags (bool) and images (uint8); every array of these types is read-only.
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
BACKGROUNDS = 50  # empty frames before the first, of a sequence of ours
OWN_BACKGROUND = f"{BACKGROUNDS} empty frames before frame 1"
EVENT_KINDS = ("merge", "split", "cross", "queue", "form", "dissolve", "enter", "leave")


@dataclass(frozen=True, slots=True, eq=False)
class Detections(Frozen):
    """What a detector found in one frame, M rows.

    plane says what `pos` is in: "ground" (x, y in m), "space" (x, y, z in m) or "image" (px, the box's centre).
    box (M, 4) left, top, width, height in px; a detector that delivers points only has None. score in [0, 1].
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
    """What the sensors deliver at one instant, nothing else; `image`, `right` are (H, W, 3) BGR uint8."""

    index: int
    t: float
    image: Image | None = None
    right: Image | None = None
    detections: Detections | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Groups(Frozen):
    """Groups of one frame, G rows, in the plane of the Tracks or Truth that holds them.

    members: person ids of each (empty for a method that knows groups only); hull: (V, 2) polygons, counter-clockwise
    in (x, y); extent: 2x2 covariance of the members' places, nan if unknown; size: people, nan if unknown.
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
        """No groups."""
        two = np.zeros((0, 2))
        return cls(no_ids(), (), two, two, np.zeros((0, 2, 2)), np.zeros(0), ())


@dataclass(frozen=True, slots=True, eq=False)
class GroupEvent:
    """One event of groups. Frames are 1-based, both ends inclusive.

    kind: one of EVENT_KINDS. start may be back-dated to the onset; emitted is the frame in which a tracker said so
    (None in the truth). before, after: sorted group ids, -1 once for each person alone. members: all people concerned,
    sorted (empty when unknown). pos: where, in the plane's unit.
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
    """A tracker's answer to one frame, N rows.

    unit "person": group is the id of the person's group, -1 alone. unit "group": id == group.
    cov (N, 2D, 2D) ordered x, y, (z), vx, vy, (vz). box (N, 4) ltwh px or None. groups and events may be left empty:
    they are then derived by the baseline rule (tracking.grouping.grouped_tracks). derived: this has been done, nothing
    is left to do.
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
    """A ramp of steps: z rises from 0 at the edge whose middle is `foot` to `rise` at that of `head`, over `width`
    across the axis; beyond the head the plateau of `landing` metres keeps z = rise."""

    foot: Array
    head: Array
    width: float
    rise: float
    steps: int
    landing: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Scene(Frozen):
    """What stands still: size (2,) m; walls (W, 2, 2) segments; pillars (P, 3) x, y, radius; doors (D, 2, 2) openings
    in walls; service (S, 2) service points. wall_height and pillar_height in m."""

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
    """A camera; see sim.scene.camera for what it sees.

    kind "pinhole": x_cam = rotation (X - position), u = fx x/z + cx, v = fy y/z + cy, (cx, cy) the image's middle
    unless given. kind "top": orthographic, px_per_m, looking straight down on `position`.
    baseline (m): the right camera is at +baseline along camera x; 0 = none. image: (width, height) px.
    radial: Tsai's distortion of a pinhole's image, x_ideal = x (1 + radial |x|²) for x = ((u - cx)/fx, (v - cy)/fy).
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
    """What a tracker may know before the first frame. background: K frames (K, H, W, 3), or None."""

    fps: float
    px_per_m: float
    camera: Camera | None = None
    scene: Scene | None = None
    image_size: tuple[int, int] | None = None
    background: Image | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """One order of the script and when it fired: for the record (gt/script.json), never for the measurement.

    before, after: people (ids) of each group concerned, as the script wants them before and after.
    """

    id: str
    kind: str
    fired: int | None
    before: tuple[tuple[int, ...], ...]
    after: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Motion(Frozen):
    """A whole simulated crowd before a pixel is drawn: T frames, P people; person id = column + 1.

    pos, vel (T, P, 2), heading (T, P): nan while absent. present (T, P). intent (T, P): number of the group that the
    script wants this person in (unique where alone; -1 absent). height, width, depth (P,) m: the body.
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
    """Hard negatives: strangers who satisfy the merge rule without belonging together (gt/near.csv), K rows."""

    start: Ints
    end: Ints
    a: Ints
    b: Ints

    @classmethod
    def none(cls) -> Near:
        """No hard negatives."""
        return cls(no_ids(), no_ids(), no_ids(), no_ids())


@dataclass(frozen=True, slots=True, eq=False)
class FrameTruth(Frozen):
    """What is true in one frame, N people; never reaches a tracker. Fields as in Truth."""

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
    """What is true of one frame's pixels, N people in the order of FrameTruth's rows.

    ids (H, W) int64: person id, -2 walls and pillars, 0 all else (ground, stairs, sky). disparity (H, W) px, nan
    where the right camera does not see the point; None without a right camera. visible_px, amodal_px (N,): px that
    show the person, and would if nobody and nothing were in the way (inside the image); box (N, 4) ltwh px of what
    shows, nan where nothing does. blob (N,): people with the same number show in one connected region, -1 hidden.
    """

    ids: Ints
    disparity: Array | None
    visible_px: Array
    amodal_px: Array
    box: Array
    blob: Ints

    @property
    def visibility(self) -> Array:
        """(N,) visible share of each silhouette by pixels; 0 where it has none."""
        return np.asarray(self.visible_px / np.maximum(self.amodal_px, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Truth(Frozen):
    """What is true in a sequence: R rows sorted by (frame, id), one per person and frame.

    frame, id, group (-1 alone). pos, vel (R, 2) on the ground in m, m/s, None if unknown; z (R,) ground height.
    box (R, 4) amodal, unclipped, px, None without camera; visibility (R,) geometric share in [0, 1];
    truncation (R,); visible_box (R, 4): box of the visible part, nan where hidden. heading, height (R,).
    groups / groups_px: one Groups per frame on the ground / in the image, None where groups are not labelled.
    labelled (T,): frames whose groups are labelled. events, near: measured from the motion.
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
        """Rows of frame `index`."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        return slice(int(low), int(high))

    def at(self, index: int) -> FrameTruth:
        """The truth of frame `index` (1-based)."""
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
    """A sequence of frames, simulated, stored or real: re-iterable, and all a command needs to know.

    frames(): a new iterator over Frame, `detections` being the file's (or the simulated sensor's), if any.
    truth: a function, called once when first asked for, or None. background: a function giving (K, H, W, 3) or None.
    planes: what the detections' `pos` is in, "ground" or "image"; px_per_m nan = to be found from boxes.
    load_people: a function giving the ids of the people of each group that the script names, or None without a script.
    bare: frames without their pictures, where making those takes time. load_pixels: a function giving the exact pixels
    of a frame by its index, or None.
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
        """A new iterator over the frames for those who need detections only."""
        return self.frames() if self.bare is None else self.bare()

    def frame_truth(self, index: int) -> FrameTruth | None:
        """What is true in frame `index`, its pixels included where they are known."""
        if self.truth is None:
            return None
        here = self.truth.at(index)
        return here if self.load_pixels is None else here.replace(pixels=self.load_pixels(index))

    @property
    def truth(self) -> Truth | None:
        """What is true, or None where nothing is labelled; loaded once."""
        if self.load_truth is None:
            return None
        cached: Truth | None = self.__dict__.get("_truth")
        if cached is None:
            cached = self.load_truth()
            self.__dict__["_truth"] = cached
        return cached

    def background(self) -> Image | None:
        """A sample of frames for training a background model, or None."""
        return None if self.load_background is None else self.load_background()


class Tracker(Protocol):
    """What any tracker is. needs: alternatives out of "pixels", "stereo", "boxes", "points"."""

    needs: tuple[str, ...]

    def reset(self, context: Context, seed: int) -> None:
        """Forget everything and get ready for a sequence."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Answer one frame, never looking ahead."""
        ...
