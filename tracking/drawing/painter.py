"""Drawing over pictures: boxes with ids, trails, ellipses and groups, captions of events."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sim.types import Array, GroupEvent, Image
from tracking.drawing.marks import Region, Side
from tracking.drawing.panel import FLOOR, INK, Colour, View, colour

TRAIL = 3.0
"""s of the past that is shown."""

TOLD = 2.5
"""s for which an event stands in the picture."""

MANY = 60
PAPER = (250, 250, 250)
KIND_COLOUR = {"merge": 0, "split": 1, "cross": 3, "queue": 2, "form": 4, "dissolve": 5, "enter": 7, "leave": 9}


@dataclass(frozen=True)
class Style:
    """How one side is drawn. plain: thin and white, without ids: the truth under tracks. rim: a light edge of boxes."""

    plain: bool = False
    rim: bool = True


def kind_colour(kind: str) -> Colour:
    """BGR of a kind of event."""
    return colour(KIND_COLOUR.get(kind, 6))


def event_words(event: GroupEvent, prefix: str = "G") -> str:
    """What happened to whom, in ASCII."""

    def listed(ids: tuple[int, ...]) -> str:
        alone = sum(i < 0 for i in ids)
        some = ["alone" if alone == 1 else f"{alone} alone"] if alone else []
        return "+".join([*some, *(f"{prefix}{i}" for i in ids if i >= 0)])

    if event.before == event.after:
        return f"{event.kind} {listed(event.before)}"
    return f"{event.kind} {listed(event.before)} -> {listed(event.after)}"


def paint(view: View, side: Side, index: int, fps: float, style: Style = Style()) -> None:
    """The marks of a side in a frame, over the picture that the view's canvas holds."""
    marks = side.at(index)
    regions = () if style.plain else marks.regions
    for region in regions:
        _region(view, region, colour(region.id))
    if not style.plain:
        for name, points in side.trails(index, round(TRAIL * fps)):
            view.line(points, colour(name), 2)
    for k, name in enumerate(marks.id.tolist()):
        ink = PAPER if style.plain else colour(name)
        if not style.plain and np.isfinite(marks.ellipse[k]).all():
            _ellipse(view, marks.ellipse[k], ink)
        if np.isfinite(marks.box[k]).all():
            _box(view, marks.box[k], ink, style, broken=bool(marks.hidden[k]))
        elif np.isfinite(marks.at[k]).all():
            view.disc(marks.at[k], 5, ink, 2)
    if not style.plain:
        _names(view, side, index)
        for region in regions[:MANY]:
            _group_name(view, side.prefix, region)


def _region(view: View, region: Region, ink: Colour) -> None:
    """The hull filled; dots round its extent; an arrow from the middle to where that is in 1 s."""
    if len(region.hull):
        view.wash(view.map(region.hull), ink, 0.18)
        view.line(region.hull, ink, 2, closed=True)
    if len(region.around):
        _dots(view, region.around, ink)
    if len(region.way):
        view.arrow(region.way, FLOOR, 4)
        view.arrow(region.way, ink, 2)


def _dots(view: View, ring: Array, ink: Colour) -> None:
    """A closed line of dots some 7 px apart, each with a light rim; none where it is larger than the picture."""
    ends = np.concatenate([ring, ring[:1]])
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(ends, axis=0).T))]
    if not (np.ptp(ring, axis=0) * view.scale < view.canvas.shape[1::-1]).all():
        return
    places = np.linspace(0.0, along[-1], max(int(along[-1] * view.scale / 7), 8), endpoint=False)
    dots = np.stack([np.interp(places, along, ends[:, axis]) for axis in (0, 1)], axis=1)
    for radius, tone in ((2.4, FLOOR), (1.5, ink)):
        for at in dots:
            view.disc(at, radius, tone)


def _corners(box: Array) -> Array:
    x, y, w, h = box
    return np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]])


def _box(view: View, box: Array, ink: Colour, style: Style, broken: bool) -> None:
    corners = _corners(box)
    if broken:
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            _dashes(view, a, b, ink)
        return
    if style.rim and not style.plain:
        view.line(corners, FLOOR, 4, closed=True)
    view.line(corners, ink, 1 if style.plain else 2, closed=True)


def _dashes(view: View, a: Array, b: Array, ink: Colour) -> None:
    """A broken line with strokes of 4 px."""
    count = max(int(np.hypot(*(b - a)) * view.scale / 8), 1)
    for k in range(count):
        ends = a + (b - a) * np.array([[k / count], [(k + 0.5) / count]])
        view.line(ends, ink, 1)


def _ellipse(view: View, ring: Array, ink: Colour) -> None:
    """Left out where it is larger than the picture: nothing is known then."""
    span = (ring.max(axis=0) - ring.min(axis=0)) * view.scale
    if (span < view.canvas.shape[1::-1]).all():
        view.line(ring, ink, 1, closed=True)


def _names(view: View, side: Side, index: int) -> None:
    marks = side.at(index)
    if len(marks.id) > MANY or marks.wholes:
        return
    top = np.where(np.isfinite(marks.box[:, :2]), marks.box[:, :2], marks.at)
    size = letter(view)
    for name, at in zip(marks.id.tolist(), view.map(top), strict=True):
        if np.isfinite(at).all():
            chip(view.canvas, str(name), (at[0] - 1, at[1] - 1), size, colour(name))


def _group_name(view: View, prefix: str, region: Region) -> None:
    """Its id, and its estimated size where it is tracked as a whole, under its lowest corner."""
    points = view.map(
        next(points for points in (region.hull, region.around, region.way, np.zeros((1, 2))) if len(points))
    )
    x, y = points[points[:, 1].argmax()]
    words = f"{prefix}{region.id}" + (f" ~{round(region.size, 1):g}" if np.isfinite(region.size) else "")
    size = letter(view)
    chip(view.canvas, words, (x - 14 * size, y + 38 * size), size * 1.1, colour(region.id))


def letter(view: View) -> float:
    """A size of letters that suits the canvas."""
    return float(np.clip(view.canvas.shape[0] / 1200, 0.42, 0.9))


def chip(canvas: Image, words: str, at: tuple[float, float], size: float, ink: Colour) -> int:
    """White words on colour, `at` its lower left corner, kept inside the canvas; its height."""
    words = words.encode("ascii", "replace").decode()
    (wide, high), below = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    x = int(np.clip(at[0], 0, max(canvas.shape[1] - wide - 5, 0)))
    y = int(np.clip(at[1], high + below + 2, canvas.shape[0] - 1))
    cv2.rectangle(canvas, (x, y - high - below - 1), (x + wide + 4, y), ink, -1)
    cv2.putText(canvas, words, (x + 2, y - below), cv2.FONT_HERSHEY_SIMPLEX, size, FLOOR, 1, cv2.LINE_AA)
    return high + below + 2


def captions(canvas: Image, side: Side, index: int, fps: float, size: float) -> None:
    """Events that have just become known, one above the other from the lower left corner."""
    y = float(canvas.shape[0] - 6)
    for event in side.told(index, TOLD * fps)[:6]:
        y -= chip(canvas, event_words(event, side.prefix), (6, y), size * 1.25, kind_colour(event.kind)) + 3


def banner(canvas: Image, words: str, marks: list[str], size: float) -> None:
    """A line of facts on a light strip (the whole canvas), marks on red at its right."""
    canvas[:] = FLOOR
    y = canvas.shape[0] * 0.5 + 9 * size
    cv2.putText(canvas, words, (6, round(y)), cv2.FONT_HERSHEY_SIMPLEX, size, INK, 1, cv2.LINE_AA)
    x = float(canvas.shape[1] - 4)
    for mark in marks:
        (wide, _), _ = cv2.getTextSize(mark, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
        x -= wide + 10
        chip(canvas, mark, (x, y + 6), size, colour(6))
