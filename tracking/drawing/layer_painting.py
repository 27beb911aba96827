"""Draws a layer on a canvas: boxes or discs with ids, trails, ellipses, groups; captions of events and a banner."""

from __future__ import annotations

import numpy as np

from sim.types import Array, GroupEvent, Image
from tracking.drawing.canvas import (
    FLOOR,
    TRAIL_SECONDS,
    Canvas,
    Colour,
    box_corners,
    colour,
    draw_label,
    text,
    text_width,
)
from tracking.drawing.layers import NO_POINTS, FrameMarks, GroupMark, Layer

CAPTION_SECONDS = 2.5  # s for which an event's caption is shown.

CAPTIONS = 6  # Captions in a picture at most.

MANY = 60  # Ids of people are left out of frames with more people than this; of more groups only the first are named.

FOOT = 0.22  # m: radius of the disc of somebody without a box.

LEAST_RADIUS = 5.0  # px

PLAIN_INK = (250, 250, 250)
ALARM = 6  # The id whose colour marks what a frame lacks, and events of unknown kind.

# The id whose colour an event's kind has.
KIND_COLOUR = {"merge": 0, "split": 1, "cross": 3, "queue": 2, "form": 4, "dissolve": 5, "enter": 7, "leave": 9}


def kind_colour(kind: str) -> Colour:
    """Returns the BGR colour of a kind of event; red for an unknown kind."""
    return colour(KIND_COLOUR.get(kind, ALARM))


def event_words(event: GroupEvent, prefix: str = "G") -> str:
    """Returns an event in words, such as "merge G1+G2 -> G1"; people alone (negative ids) are only counted. prefix:
    letter before the ids of groups."""

    def listed(ids: tuple[int, ...]) -> str:
        alone = sum(i < 0 for i in ids)
        some = ["alone" if alone == 1 else f"{alone} alone"] if alone else []
        return "+".join([*some, *(f"{prefix}{i}" for i in ids if i >= 0)])

    if event.before == event.after:
        return f"{event.kind} {listed(event.before)}"
    return f"{event.kind} {listed(event.before)} -> {listed(event.after)}"


def paint_layer(canvas: Canvas, layer: Layer, index: int, fps: float) -> None:
    """Draws frame `index` (from 1) of a layer on a canvas, in place; unknown (nan) marks are skipped."""
    marks = layer.at(index)
    groups = () if layer.plain else marks.groups
    for group in groups:
        _paint_group(canvas, group, colour(group.id))
    if not layer.plain:
        for identity, points in layer.trails(index, round(TRAIL_SECONDS * fps)):
            canvas.line(points, colour(identity), 2)
    radius = max(FOOT * canvas.scale, LEAST_RADIUS)
    for k, identity in enumerate(marks.id.tolist()):
        ink = PLAIN_INK if layer.plain else colour(identity)
        if not layer.plain:
            _paint_ring(canvas, marks.ellipse[k], ink)
        if np.isfinite(marks.box[k]).all():
            corners, thin = box_corners(marks.box[k]), layer.plain or bool(marks.hidden[k])
            if not thin:
                canvas.line(corners, FLOOR, 4, closed=True)
            canvas.line(corners, ink, 1 if thin else 2, closed=True)
        elif np.isfinite(marks.at[k]).all():
            canvas.disc(marks.at[k], radius, ink, 2 if layer.plain else -1)
    for k, group in enumerate(groups[:MANY]):
        _paint_group_id(canvas, layer.prefix, group, marks.at[k : k + 1] if marks.whole_groups else NO_POINTS)
    if not layer.plain and len(marks.id) <= MANY and not marks.whole_groups:
        _paint_ids(canvas, marks, radius)


def _paint_group(canvas: Canvas, group: GroupMark, ink: Colour) -> None:
    if len(group.hull):
        canvas.fill(canvas.map(group.hull), ink, 0.18)
        canvas.line(group.hull, ink, 2, closed=True)
    _paint_ring(canvas, group.extent, ink)


def _paint_ids(canvas: Canvas, marks: FrameMarks, radius: float) -> None:
    size, at = letter_size(canvas), canvas.map(marks.at)
    apart = np.nan_to_num(np.hypot(*(at[:, None] - at).transpose(2, 0, 1)), nan=np.inf)
    np.fill_diagonal(apart, np.inf)
    nearest = at[apart.argmin(axis=1)] if len(at) else at
    places = zip(marks.id.tolist(), canvas.map(marks.box[:, :2]), at, nearest, strict=True)
    for identity, corner, (x, y), other in places:
        words, ink = str(identity), colour(identity)
        if np.isfinite(corner).all():
            draw_label(canvas.image, words, corner - 1, size, ink)
        elif np.isfinite(x + y):  # on the side where nobody is near
            left = x + radius + 3 if other[0] <= x else x - radius - 3 - text_width(words, 0.66, 2)
            text(canvas.image, words, (left, y + 7), 0.66, ink, 2)


def _paint_ring(canvas: Canvas, ring: Array, ink: Colour) -> None:
    # a ring as large as the image says that the place is as good as unknown
    known = len(ring) > 0 and np.isfinite(ring).all()
    if known and (np.ptp(ring, axis=0) * canvas.scale < canvas.image.shape[1::-1]).all():
        canvas.line(ring, ink, 1, closed=True)


def _paint_group_id(canvas: Canvas, prefix: str, group: GroupMark, centre: Array) -> None:
    known = [part for part in (group.hull, group.extent, centre) if len(part) and np.isfinite(part).all()]
    for points in map(canvas.map, known[:1]):
        x, y = points[points[:, 1].argmax()]
        words = f"{prefix}{group.id}" + (f" ~{round(group.size, 1):g}" if np.isfinite(group.size) else "")
        size = letter_size(canvas)
        draw_label(canvas.image, words, (x - 14 * size, y + 38 * size), size * 1.1, colour(group.id))


def letter_size(canvas: Canvas) -> float:
    """Returns cv2's font scale that suits the canvas."""
    return float(np.clip(canvas.image.shape[1] / 1600, 0.42, 0.9))


def draw_captions(image: Image, layer: Layer, index: int, fps: float, size: float) -> None:
    """Writes the captions of recent events onto the image, upwards from the lower left corner, the newest at the
    bottom. index: the frame, from 1; size: cv2's font scale."""
    y = float(image.shape[0] - 6)
    for event in layer.recent_events(index, CAPTION_SECONDS * fps)[:CAPTIONS]:
        y -= draw_label(image, event_words(event, layer.prefix), (6, y), size * 1.25, kind_colour(event.kind)) + 3
