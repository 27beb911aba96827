"""What trackers of people from points share: detections from points or pictures, and the table of their people.

From a picture each foreground blob (tracking.detect.foreground) is one detection, so people who share a blob are missed
but for one, unless blobs are divided into pieces of a person's size (ours).

How many people a blob may hold follows from its area: with r times a person's area, from r + 1/4 to r + 3/4, rounded
down, and at least one. Within these limits it is the number of tracked people whose boxes are centred in the blob. A
blob of less than LEAST of a person's area is left out.

The pixels go to the nearest of as many centres, distances being in a person's width and height. The centres start at
the tracked people, and in places far from these, and become the means of their pixels (k-means).

People are reported with boxes in the image: a person keeps the size of the boxes that were measured, which follows them
slowly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from sim.types import Array, Bools, Context, Detections, Frame, Plane, Tracks
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.blobs import Blobs
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import PersonSize
from tracking.filters.person_streams import Keys
from tracking.running.image_scale import required

FILLED = math.pi / 4  # Share of a person's box that the person fills.
FEWEST, MOST = 0.25, 0.75  # A blob of r times a person's area holds from r + FEWEST to r + MOST people, rounded down.
LEAST = 0.3  # A blob with a smaller share of a person's area is left out: a part of a person, or noise.
ROUNDS = 5  # Rounds of k-means.


def divided(found: Blobs, people: Array, size: PersonSize) -> Array:
    """Returns the boxes (N, 4), left, top, width, height, px, of the people in the blobs of a frame; blobs of several
    people are divided. people (K, 4): boxes of the people reported last. Too small blobs are left out."""
    boxes = [np.zeros((0, 4))]
    centre = people[:, :2] + people[:, 2:] / 2
    foot = found.box[:, :2] + found.box[:, 2:] * np.array([0.5, 1.0])
    tall, wide = size.at(foot).T if len(found) else np.zeros((2, 0))
    for m, (box, area) in enumerate(zip(found.box, found.area.tolist(), strict=True)):
        inside = centre[((centre >= box[:2]) & (centre <= box[:2] + box[2:])).all(axis=1)]
        count = 1
        if np.isfinite(tall[m]):
            held = area / (FILLED * tall[m] * wide[m])
            if held < LEAST:
                continue
            count = min(max(len(inside), int(held + FEWEST), 1), max(int(held + MOST), 1))
        boxes.append(box[None] if count == 1 else _pieces(found, m, inside, count, np.array([wide[m], tall[m]])))
    return np.concatenate(boxes)


def _pieces(found: Blobs, row: int, known: Array, count: int, person: Array) -> Array:
    v, u = np.nonzero(found.label[found.window(row)] == row + 1)
    pixels = (np.stack([u, v], axis=1) + found.box[row, :2] + 0.5) / person
    centres = np.zeros((0, 2))
    for _ in range(count):
        choice = known / person if len(centres) < len(known) else pixels
        from_here = pixels.mean(axis=0)[None] if not len(centres) else centres
        centres = np.concatenate([centres, choice[_nearest(choice, from_here)[1].argmax()][None]])
    for _ in range(ROUNDS):
        owner = _nearest(pixels, centres)[0]
        owned = np.bincount(owner, minlength=len(centres))
        centres = centres[owned > 0]
        owner = (np.cumsum(owned > 0) - 1)[owner]
        sums = [np.bincount(owner, pixels[:, d]) for d in (0, 1)]
        centres = np.stack(sums, axis=1) / owned[owned > 0][:, None]
    owner = _nearest(pixels, centres)[0]
    places = [pixels[owner == k] * person for k in range(len(centres))]
    corners = [(p.min(axis=0) - 0.5, p.max(axis=0) + 0.5) for p in places if len(p)]
    return np.array([np.concatenate([low, high - low]) for low, high in corners])


def _nearest(points: Array, centres: Array) -> tuple[Array, Array]:
    squared = np.square(points[:, None] - centres).sum(axis=2)
    return squared.argmin(axis=1), squared.min(axis=1)


BOX_TIME = 0.5  # Time constant with which the size of a person's box follows measured boxes, s.


def ordered_points(detections: Detections, unit: float) -> tuple[Array, Array]:
    """Returns the positions (M, 2), m, of the detections sorted by x, then y, and width and height of their boxes (M,
    2), px, nan on the ground or without boxes. unit: units of the positions per m."""
    order = np.lexsort(detections.pos[:, 1::-1].T)
    box = detections.box if detections.plane == "image" else None
    sizes = np.full((len(order), 2), np.nan) if box is None else box[order, 2:]
    return np.ascontiguousarray(detections.pos[order, :2] / unit), sizes


def followed_sizes(old: Array, new: Array, dt: Array | float) -> Array:
    """Returns sizes of boxes (N, 2), px, that move from `old` towards the measured sizes `new` with a time constant. An
    unknown (nan) size takes the other's value. dt: time step, s."""
    followed = np.where(np.isnan(old), new, new + (old - new) * np.exp(-dt / BOX_TIME))
    return np.where(np.isnan(new), old, followed)


def boxes_at(pos: Array, size: Array) -> Array | None:
    """Returns boxes (N, 4) left, top, width, height in px with the centres pos (N, 2) px; None if a size is unknown."""
    return np.concatenate([pos - size / 2, size], axis=1) if np.isfinite(size).all() else None


class ForegroundBlobs:
    """Foreground blobs as detections in the image.

    State: settings; foreground, the pipeline with its background model; size: of a person at each place, from the
    camera or learned from lone people in the background sample, if blobs are divided, else None. scale: px per metre,
    the context's, or, if that is nan, learned from lone people.

    The context must have a background sample (else AssertionError). Raises InputError if the scale is neither known nor
    learned, if it is zero or negative, or if the sample cannot be used.
    """

    def __init__(self, settings: BackgroundSettings, context: Context, divide: bool = False) -> None:
        """Trains the background model; divide: blobs of several people are divided."""
        assert context.background is not None
        self.settings = settings
        self.foreground = Foreground(context, settings)
        self.size: PersonSize | None = None
        if divide or np.isnan(context.px_per_m):
            size = PersonSize(context)
            self.foreground.learn_person_size(size, context.background)
            self.size = size if divide else None
        self.scale = required(self.foreground.px_per_m)

    def follow(self, settings: BackgroundSettings) -> None:
        """Replaces the settings of the background model; what the model learned and the scale stay."""
        self.settings = settings
        self.foreground.follow(settings)

    def detections(self, frame: Frame, people: Array) -> Detections | None:
        """Returns the blobs of the frame's picture as detections; None without a picture, or if too much of it is
        foreground. people (K, 4): boxes of the people reported last, where the background does not adapt."""
        if frame.image is None:
            return None
        seen = self.foreground.segment(frame.image)
        corners = [box[:2] + box[2:] * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) for box in people]
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, corners))
        if not seen.plausible:
            return None
        found = self.foreground.person_blobs(seen.mask)
        box = found.box if self.size is None else divided(found, people, self.size)
        centre = box[:, :2] + box[:, 2:] / 2
        return Detections(frame.index, frame.t, "image", centre, None, box, np.ones(len(box)))


class PointTracker:
    """Base class of the trackers that follow people from points, or from pixels by their foreground blobs.

    State: config, which may be replaced between two frames; context; pixels: detector of blobs, None from points;
    plane, "ground" or "image". All but config exist after `begin` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "points", "boxes")
    config: Any

    def begin(self, context: Context, divide: bool) -> None:
        """Starts a sequence: from pixels if the context has a background sample, else from points.

        divide: blobs of several people are divided. Until the first detections `plane` is "image" from pixels, or with
        a scale but no camera, else "ground". If pixels are tracked, raises InputError if the scale px_per_m is zero or
        negative, or neither known nor learned from the sample, or if the sample cannot be used."""
        self.pixels = None if context.background is None else ForegroundBlobs(self.config, context, divide)
        self.context = context if self.pixels is None else context.replace(px_per_m=self.pixels.scale)
        flat = self.pixels is not None or (context.camera is None and context.px_per_m > 0)
        self.plane: Plane = "image" if flat else "ground"
        self.dt = 1.0 / context.fps

    def detected(self, frame: Frame, detections: Detections | None, boxes: Array | None) -> Detections | None:
        """Returns the frame's detections: those given, or from pixels the blobs; None if there was no measurement.
        boxes (K, 4): of the people reported last, None for nobody."""
        if self.pixels is None:
            return detections
        if self.pixels.settings is not self.config:
            self.pixels.follow(self.config)
        return self.pixels.detections(frame, np.zeros((0, 4)) if boxes is None else boxes)

    def in_picture(self, tracks: Tracks) -> Tracks:
        """Returns the tracks of a frame as they are in its picture: from pixels, a camera that moves is compensated."""
        return tracks if self.pixels is None else self.pixels.foreground.in_picture(tracks)

    def points(self, detections: Detections) -> tuple[Array, Array]:
        """Sets `plane` to that of the detections, and returns their positions and box sizes as `ordered_points`."""
        self.plane = "image" if detections.plane == "image" else "ground"
        return ordered_points(detections, self.unit)

    @property
    def px_per_m(self) -> float:
        """Scale of the image in px per metre: the context's, or, from pixels, learned from its background sample; nan
        if unknown."""
        return self.context.px_per_m

    @property
    def noise(self) -> float:
        """Standard deviation of a measured position, per axis, m."""
        return float(self.config.point_noise if self.pixels is None else self.config.pixel_noise)

    @property
    def unit(self) -> float:
        """Length of a metre in the unit of the points: 1 on the ground, px per m in the image."""
        return required(self.context.px_per_m) if self.plane == "image" else 1.0


@dataclass
class PersonTable:
    """The tracked people of a `PointTracker`, one row each; a subclass adds columns.

    size (K, 2): width, height of the box, px, nan if unknown. key (K,): of the random streams, made of the first
    measurement."""

    size: Array = field(default_factory=lambda: np.zeros((0, 2)))
    key: Keys = field(default_factory=lambda: np.zeros(0, np.uint64))

    def keep(self, rows: Bools) -> None:
        """Removes all people except those where `rows` (K,) is True."""
        for name, column in vars(self).items():
            if isinstance(column, np.ndarray):
                setattr(self, name, column[:, rows] if column.ndim == 3 else column[rows])

    def extend(self, **columns: Any) -> None:
        """Adds people with their values in all columns."""
        for name, new in columns.items():
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old, new], axis=1 if old.ndim == 3 else 0))
