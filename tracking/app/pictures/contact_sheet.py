"""Writes a contact sheet: pictures and plans of chosen frames of a sequence, and a timeline of events, as one PNG.

Over the pictures the truth is drawn, or tracks in its place.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from pathlib import Path

import cv2
import numpy as np

from scenarios.errors import InputError, counted
from sim.io.files.atomic import write_file
from sim.io.files.own_files import marked_png
from sim.types import Array, Frame, GroupEvent, Image, Ints, Sequence, Tracks, Truth
from tracking.drawing.canvas import FLOOR, INK, QUIET, THING, TRAIL_SECONDS, Canvas, colour, text, text_width
from tracking.drawing.layer_painting import KIND_COLOUR, LayerStyle, event_words, kind_colour, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.drawing.plan_view import MARGIN, draw_group_hulls, draw_people, draw_scene, draw_trails, plan_area
from tracking.running.run import grouped

GREY = 128


class PanelPictures:
    """Draws the pictures of chosen frames for a contact sheet's panels; they are read at construction."""

    def __init__(self, sequence: Sequence, truth: Truth, chosen: Iterable[int], layer: Layer | None = None) -> None:
        self.size, self.fps = sequence.image_size, truth.fps
        self.frames = _frames(sequence, set(chosen)) if sequence.has_images and self.size is not None else {}
        self.layer = layer or (layer_of_truth(truth) if self.frames else Layer("true", "G", {}))

    def height(self, width: int) -> int:
        """Returns the height in px of a picture at this width; 0 without pictures."""
        return round(width * self.size[1] / self.size[0]) if self.size is not None and self.frames else 0

    def draw(self, area: Image, index: int) -> None:
        """Fills `area` in place with the left picture of frame `index` (from 1) and draws the truth over it."""
        assert self.size is not None
        picture = self.frames[index].image if index in self.frames else None
        area[:] = GREY if picture is None else cv2.resize(picture, area.shape[1::-1], interpolation=cv2.INTER_AREA)
        canvas = Canvas.fit(area, np.zeros(2), np.array(self.size, float), upwards=False)
        paint_layer(canvas, self.layer, index, self.fps, LayerStyle(rim=False))


def _frames(sequence: Sequence, chosen: set[int]) -> dict[int, Frame]:
    """Returns the chosen frames by number from 1; reading stops after the last of them."""
    found = {}
    for frame in sequence:
        if frame.index in chosen:
            found[frame.index] = frame
        if len(found) == len(chosen):
            break
    return found


# px before the sheet is shrunk to half its size: width of a panel; heights of the sheet's head and foot; gap between
# panels; height of a panel's title.
WIDTH, HEAD, FOOT, GAP, TITLE = 880, 76, 96, 20, 40

MANY = 40  # Ids are left out of plans with more people than this.

RING_MARGIN = 0.7  # m between an event's ring and the outermost of its members.


# Kinds of events that are shown, with their rank; events of rank 0 come first. Enter and leave are not shown.
SHOWN_KINDS = {"merge": 0, "split": 0, "cross": 1, "queue": 1, "form": 2, "dissolve": 2}

CLOSE_SECONDS = 1.0  # s: events that begin within this time share a picture.


def write_sheet(sequence: Sequence, out: str | Path, frames: int = 8, tracks: SequenceOf[Tracks] | None = None) -> Path:
    """Writes the contact sheet as PNG and returns its path. The file is complete, or is not written at all.

    tracks: are shown in place of the truth.
    """
    layer, truth = None, sequence.truth
    if tracks is not None:
        tracks = grouped(tracks, sequence)
        layer, truth = layer_of_tracks(tracks, sequence.camera, sequence.scene), as_labels(tracks, sequence)
    if (truth is None or not len(truth.frame)) and not sequence.has_images:
        raise InputError(
            file=sequence.name, got="no labelled people and no pictures", expected="a sequence with gt/ or pictures",
            remedy="name another",
        )  # fmt: skip
    picture = sheet_picture(sequence, empty_truth(sequence) if truth is None else truth, frames, layer)
    path = Path(out)
    done, code = cv2.imencode(".png", picture)
    assert done, "PNG holds any 8-bit picture"
    write_file(path, marked_png(code.tobytes()))
    return path


def empty_truth(sequence: Sequence) -> Truth:
    """Returns a truth without people, of the sequence's length, for a sequence without labels."""
    length = sequence.length or sum(1 for _ in sequence.without_pictures())
    none, nan = np.zeros(0, np.int64), float("nan")
    return Truth(sequence.name, sequence.fps, length, nan, none, none, none, None, None, np.zeros((0, 4)), np.zeros(0))


def as_labels(tracks: SequenceOf[Tracks], sequence: Sequence) -> Truth:
    """Returns tracks in the form of labels; what a tracker of whole groups tracks stands for people."""
    people = [t for t in tracks if len(t.id)]
    none = empty_truth(sequence)
    if not people:
        return none
    frame = np.repeat([t.index for t in people], [len(t.id) for t in people])
    id, group, pos = (np.concatenate([getattr(t, name) for t in people]) for name in ("id", "group", "pos"))
    box = np.concatenate(
        [np.column_stack([t.pos[:, :2], 0 * t.pos[:, :2]]) if t.box is None else t.box for t in people]
    )
    order, ground = np.lexsort((id, frame)), people[0].plane != "image"
    return none.replace(
        length=max(none.length, int(frame.max())), frame=frame[order], id=id[order], group=group[order],
        pos=pos[order, :2] if ground else None, box=box[order], visibility=np.ones(len(id)),
        events=tuple(event for t in tracks for event in t.events),
    )  # fmt: skip


def sheet_picture(sequence: Sequence, truth: Truth, frames: int = 8, layer: Layer | None = None) -> Image:
    """Returns the contact sheet as an (H, W, 3) BGR uint8 picture; its size follows from the panels.

    layer: is drawn over the pictures in place of the truth.
    """
    chosen = choose_frames(truth, frames)
    if not chosen:
        raise InputError(file=sequence.name, got="no frame", expected="one or more", remedy="give a longer sequence")
    pictures, prefix = PanelPictures(sequence, truth, chosen, layer), "G" if layer is None else layer.prefix
    low, high = sheet_area(sequence, truth)
    large = pictures.height(WIDTH)
    plan = round(WIDTH * float(np.clip((high - low)[1] / (high - low)[0], 0.4, 1.2)))
    plan = plan if truth.pos is not None or not pictures.frames else 0
    height = TITLE + large + plan
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    total = (HEAD + rows * (height + GAP) + FOOT, GAP + columns * (WIDTH + GAP))
    sheet = np.full((*total, 3), 255, np.uint8)
    for k, index in enumerate(chosen):
        top, left = HEAD + k // columns * (height + GAP), GAP + k % columns * (WIDTH + GAP)
        area = sheet[top : top + height, left : left + WIDTH]
        y = TITLE + large
        if large:
            pictures.draw(area[TITLE:y], index)
        if plan:
            canvas = Canvas.fit(area[y:], low, high, truth.pos is not None)
            _draw_plan(canvas, sequence, truth, index, prefix)
        _draw_title(area, truth, index, prefix)
    _draw_head(sheet, sequence, truth, "people" if layer is None else "tracks")
    _draw_foot(sheet[-FOOT:], truth, chosen)
    return np.asarray(cv2.resize(sheet, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)


def _places(truth: Truth) -> Array:
    """Returns (R, 2) where people are drawn, by row of the truth."""
    if truth.pos is not None:
        return truth.pos
    assert truth.box is not None, "labels have positions or boxes"
    return truth.box[:, :2] + truth.box[:, 2:] / 2


def sheet_area(sequence: Sequence, truth: Truth) -> tuple[Array, Array]:
    """Returns the smallest and the largest x and y, (2,) each, of a panel's plan."""
    if truth.pos is None and sequence.image_size is not None:
        return np.zeros(2), np.array(sequence.image_size, float)
    if truth.pos is not None:
        return plan_area(sequence.scene, truth.pos) or (np.zeros(2), np.ones(2))
    assert truth.box is not None, "labels have positions or boxes"
    corners = np.concatenate([truth.box[:, :2], truth.box[:, :2] + truth.box[:, 2:]])
    corners = corners[np.isfinite(corners).all(axis=1)]
    return (corners.min(axis=0), corners.max(axis=0) + 1e-3) if len(corners) else (np.zeros(2), np.ones(2))


def _draw_plan(canvas: Canvas, sequence: Sequence, truth: Truth, index: int, prefix: str) -> None:
    on_ground = canvas.upwards
    places, boxes = _places(truth), None if on_ground else truth.box
    canvas.image[:] = FLOOR
    if on_ground:
        draw_scene(canvas, sequence.scene)
    draw_trails(canvas, truth, index, places)
    draw_group_hulls(canvas, truth, index, places, boxes, prefix)
    rows = truth.rows(index)
    draw_people(canvas, truth, index, places, boxes, ids=rows.stop - rows.start <= MANY)
    for event in _events_near(truth, index) if on_ground else []:
        at, radius = event_ring(event, truth.id[rows], places[rows])
        canvas.disc(at, radius * canvas.scale, kind_colour(event.kind), 3)


def _draw_title(area: Image, truth: Truth, index: int, prefix: str) -> None:
    events = _events_near(truth, index)
    words = f"{(index - 1) / truth.fps:.1f} s" + "".join(f"   {event_words(event, prefix)}" for event in events)
    ink = kind_colour(events[0].kind) if events else QUIET
    text(area, words[:62], (2, TITLE - 12), 0.72, ink, 2 if events else 1)
    border = (ink, 5) if events else (THING, 2)
    cv2.rectangle(area, (0, TITLE), (area.shape[1] - 1, area.shape[0] - 1), *border)


def _events_near(truth: Truth, index: int) -> list[GroupEvent]:
    near = [event for event in truth.events or () if is_close(event.start, index, truth.fps)]
    return sorted((event for event in near if event.kind in SHOWN_KINDS), key=lambda event: SHOWN_KINDS[event.kind])


def event_ring(event: GroupEvent, ids: Ints, places: Array) -> tuple[Array, float]:
    """Returns centre (2,) and radius (m) of a ring round the event's members, with 0.7 m to spare."""
    members = places[np.isin(ids, event.members)]
    if not len(members):
        return np.array(event.pos), MARGIN
    centre = members.mean(axis=0)
    return centre, float(np.linalg.norm(members - centre, axis=1).max()) + RING_MARGIN


def _draw_head(sheet: Image, sequence: Sequence, truth: Truth, noun: str) -> None:
    text(sheet, sequence.name, (GAP, 48), 1.3, INK, 3)
    width = text_width(sequence.name, 1.3, 3)
    unit = "m" if truth.pos is not None else "px"
    low, high = sheet_area(sequence, truth)
    if truth.pos is not None and sequence.scene is not None:
        low, high = np.zeros(2), sequence.scene.size
    people = f"{len(np.unique(truth.id))} {noun}, " if len(truth.id) else ""
    facts = f"{people}{counted(truth.length, 'frame')}, {truth.fps:g}/s, "
    facts += f"{high[0] - low[0]:.4g} x {high[1] - low[1]:.4g} {unit}; trails {TRAIL_SECONDS:g} s"
    text(sheet, facts, (GAP + width + 30, 46), 0.75, QUIET)


def _draw_foot(area: Image, truth: Truth, chosen: list[int]) -> None:
    width, line = area.shape[1], 34
    left, right = GAP + 10, width - GAP - 60
    last = max(truth.length - 1, 1)

    def x_of(index: int) -> int:
        return int(left + (index - 1) / last * (right - left))

    cv2.line(area, (left, line), (right, line), THING, 3, cv2.LINE_AA)
    for index in chosen:
        cv2.line(area, (x_of(index), line - 13), (x_of(index), line + 13), INK, 3, cv2.LINE_AA)
    text(area, f"{(truth.length - 1) / truth.fps:.0f} s", (right + 12, line + 8), 0.7, QUIET)
    events = [event for event in truth.events or () if 1 <= event.start <= truth.length]
    for event in events:
        cv2.circle(area, (x_of(event.start), line), 9, kind_colour(event.kind), -1, cv2.LINE_AA)
    x = left
    for kind in sorted({event.kind for event in events}, key=lambda kind: list(KIND_COLOUR).index(kind)):
        cv2.circle(area, (x + 8, line + 42), 9, colour(KIND_COLOUR[kind]), -1, cv2.LINE_AA)
        text(area, kind, (x + 26, line + 49), 0.7, INK)
        x += 50 + text_width(kind, 0.7)
    text(area, "ticks: the pictures above", (x + 10, line + 49), 0.7, QUIET)


def is_close(frame: int, other: int, fps: float) -> bool:
    """Returns True if two frames, given by number, are at most one second apart. fps: frames per second."""
    return abs(frame - other) <= CLOSE_SECONDS * fps


def choose_frames(truth: Truth, count: int) -> list[int]:
    """Returns the numbers, from 1, of `count` frames in ascending order."""
    count = min(max(1, count), truth.length)
    chosen: list[int] = []
    events = [event for event in truth.events or () if 1 <= event.start <= truth.length and event.kind in SHOWN_KINDS]
    for rank in sorted(set(SHOWN_KINDS.values())):
        starts = _apart({event.start for event in events if SHOWN_KINDS[event.kind] == rank}, chosen, truth.fps)
        room = count - len(chosen)
        chosen += starts if len(starts) <= room else [starts[k] for k in _evenly(len(starts), room)]
    people = np.bincount(truth.frame, minlength=truth.length + 1)[1 : truth.length + 1]
    while len(chosen) < count:
        chosen.append(_in_widest_gap(chosen, people))
    return sorted(chosen)


def _apart(starts: set[int], chosen: list[int], fps: float) -> list[int]:
    kept: list[int] = []
    for start in sorted(starts):
        if not any(is_close(start, other, fps) for other in (*chosen, *kept)):
            kept.append(start)
    return kept


def _evenly(n: int, k: int) -> list[int]:
    return [round(place) for place in np.linspace(0, n - 1, k)] if k > 1 else [0][:k]


def _in_widest_gap(chosen: list[int], people: Ints) -> int:
    length = len(people)
    # The ends count as an eighth of the length further out, so that frames near them are chosen, too.
    marks = np.array([1 - length // 8, *sorted(chosen), length + length // 8])
    for k in np.argsort(-np.diff(marks), kind="stable"):
        low, high = marks[k], marks[k + 1]
        quarter = (high - low) // 4
        inner = np.arange(max(low + quarter, low + 1, 1), min(high - quarter, high - 1, length) + 1)
        if len(inner):
            order = np.lexsort((np.abs(inner - (low + high) / 2), -people[inner - 1]))
            return int(inner[order[0]])
    return next(index for index in range(1, length + 1) if index not in chosen)
