"""Writes a contact sheet: pictures and plans of chosen frames of a sequence, and a timeline of events, as one PNG.

The truth is drawn over both, or tracks in its place.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from scenarios.errors import InputError, counted
from sim.store.atomic import write_file
from sim.store.own_files import marked_png
from sim.types import Array, Image, Ints, Scene, Sequence, Tracks
from tracking.drawing.canvas import FLOOR, INK, QUIET, THING, TRAIL_SECONDS, Canvas, text, text_width
from tracking.drawing.layer_painting import KIND_COLOUR, event_words, kind_colour, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.drawing.plan_view import draw_scene, plan_area
from tracking.running.run import grouped

GREY = 128

# px before the sheet is shrunk to half its size: width of a panel; heights of the sheet's head and foot; gap between
# panels; height of a panel's title.
WIDTH, HEAD, FOOT, GAP, TITLE = 880, 76, 96, 20, 40

# Kinds of events that are shown, with their rank; events of rank 0 come first. Enter and leave are not shown.
SHOWN_KINDS = {"merge": 0, "split": 0, "cross": 1, "queue": 1, "form": 2, "dissolve": 2}

CLOSE_SECONDS = 1.0  # s: events that begin within this time share a picture.


@dataclass(frozen=True, eq=False)
class View:
    """A layer over the pictures of chosen frames, or on a plan."""

    layer: Layer
    low: Array  # (2,): smallest x and y that are shown
    high: Array  # (2,)
    plan: bool
    scene: Scene | None = None
    pictures: dict[int, Image | None] = field(default_factory=dict)  # by frame; None: a lost one

    def height(self) -> int:
        """Returns the height, px, of this view in a panel of the sheet."""
        ratio = (self.high - self.low)[1] / (self.high - self.low)[0]
        return round(WIDTH * float(ratio if self.pictures else np.clip(ratio, 0.4, 1.2)))

    def draw(self, area: Image, index: int, fps: float) -> None:
        """Fills `area` in place with frame `index` (from 1)."""
        picture = self.pictures.get(index)
        area[:] = GREY if index in self.pictures else FLOOR
        if picture is not None:
            area[:] = cv2.resize(picture, area.shape[1::-1], interpolation=cv2.INTER_AREA)
        canvas = Canvas.fit(area, self.low, self.high, upwards=self.plan)
        if self.plan:
            draw_scene(canvas, self.scene)
        paint_layer(canvas, self.layer, index, fps)


def write_sheet(sequence: Sequence, out: str | Path, frames: int = 8, tracks: SequenceOf[Tracks] | None = None) -> Path:
    """Writes the contact sheet as PNG and returns its path. The file is complete, or is not written at all. frames:
    number of frames to show. tracks: drawn instead of the truth. Raises InputError if there is nothing to draw."""
    layers = _layers(sequence, tracks)
    length = sequence.length or sum(1 for _ in sequence.without_pictures())
    chosen = choose_frames(layers[-1], length, sequence.fps, frames)
    if not chosen:
        raise InputError(file=sequence.name, got="no frame", expected="one or more", remedy="give a longer sequence")
    parts = views(sequence, layers, chosen)
    if not parts:
        got, expected = "no labelled people and no pictures", "a sequence with gt/ or pictures"
        raise InputError(file=sequence.name, got=got, expected=expected, remedy="name another")
    done, code = cv2.imencode(".png", _picture(sequence, parts, length, chosen))
    assert done, "PNG holds any 8-bit picture"
    path = Path(out)
    write_file(path, marked_png(code.tobytes()))
    return path


def frame_pictures(sequence: Sequence, runs: SequenceOf[SequenceOf[Tracks] | None], index: int) -> Image:
    """Returns frame `index` (from 1) as picture and plan, beside each other for each run; for None with the truth."""
    columns = []
    for tracks in runs:
        parts = views(sequence, _layers(sequence, tracks), [index])
        areas = [np.empty((part.height(), WIDTH, 3), np.uint8) for part in parts]
        for part, area in zip(parts, areas, strict=True):
            part.draw(area, index, sequence.fps)
        columns.append(np.concatenate(areas))
    height = min(map(len, columns))
    return np.concatenate([column[:height] for column in columns], axis=1)


def _layers(sequence: Sequence, tracks: SequenceOf[Tracks] | None) -> list[Layer]:
    """Returns what is drawn over pictures, and on a plan if places on the ground are known."""
    truth = sequence.truth
    if tracks is not None:
        tracks = grouped(tracks, sequence)
        on_ground = any(len(t.id) for t in tracks) and all(t.plane != "image" for t in tracks)
        ways = (False, True) if on_ground else (False,)
        return [layer_of_tracks(tracks, sequence.camera, sequence.scene, plan) for plan in ways]
    if truth is None:
        return [Layer("true", "G", {})]
    ways = (False,) if truth.pos is None else (False, True)
    return [layer_of_truth(truth, plan) for plan in ways]


def views(sequence: Sequence, layers: SequenceOf[Layer], chosen: SequenceOf[int]) -> list[View]:
    """Returns the views of a panel: pictures if there are any, and a plan if positions on the ground are known; without
    both, the boxes on a plain area. chosen: the frames that are shown, from 1."""
    found = []
    if sequence.has_images and sequence.image_size is not None:
        size = np.array(sequence.image_size, float)
        found.append(View(layers[0], np.zeros(2), size, False, pictures=_pictures(sequence, set(chosen))))
    places = [marks.at for layer in layers[1:] for marks in layer.frames.values() if len(marks.id)]
    if places and (area := plan_area(sequence.scene, np.concatenate(places))) is not None:
        found.append(View(layers[1], *area, True, sequence.scene))
    area = None if found else _image_area(sequence, layers[0])
    return found if area is None else [View(layers[0], *area, False)]


def _image_area(sequence: Sequence, layer: Layer) -> tuple[Array, Array] | None:
    marks = [m for m in layer.frames.values() if len(m.id)]
    corners = np.concatenate(
        [np.zeros((0, 2)), *(x for m in marks for x in (m.at, m.box[:, :2], m.box[:, :2] + m.box[:, 2:]))]
    )
    corners = corners[np.isfinite(corners).all(axis=1)]
    if not len(corners):
        return None
    size = sequence.image_size
    return (corners.min(axis=0) - 1, corners.max(axis=0) + 1) if size is None else (np.zeros(2), np.array(size, float))


def _pictures(sequence: Sequence, chosen: set[int]) -> dict[int, Image | None]:
    """Returns the left pictures of the chosen frames; reading stops after the last of them."""
    found: dict[int, Image | None] = dict.fromkeys(chosen)
    for frame in sequence:
        if frame.index in chosen:
            found[frame.index] = frame.image
        if frame.index >= max(chosen):
            break
    return found


def _picture(sequence: Sequence, parts: SequenceOf[View], length: int, chosen: list[int]) -> Image:
    """Returns the contact sheet as an (H, W, 3) BGR uint8 picture; its size follows from the panels."""
    heights = [part.height() for part in parts]
    height, columns = TITLE + sum(heights), min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    sheet = np.full((HEAD + rows * (height + GAP) + FOOT, GAP + columns * (WIDTH + GAP), 3), 255, np.uint8)
    for k, index in enumerate(chosen):
        top, left = HEAD + k // columns * (height + GAP), GAP + k % columns * (WIDTH + GAP)
        area = sheet[top : top + height, left : left + WIDTH]
        for part, end, own in zip(parts, np.cumsum(heights) + TITLE, heights, strict=True):
            part.draw(area[end - own : end], index, sequence.fps)
        _draw_title(area, parts[-1].layer, index, sequence.fps)
    _draw_head(sheet, sequence, parts[-1], length)
    _draw_foot(sheet[-FOOT:], parts[-1].layer, length, sequence.fps, chosen)
    return np.asarray(cv2.resize(sheet, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)


def _draw_title(area: Image, layer: Layer, index: int, fps: float) -> None:
    # events that become known at most 1 s before or after the frame, most important kinds first
    near = [e for known, e in layer.events if e.kind in SHOWN_KINDS and abs(known - index) <= CLOSE_SECONDS * fps]
    events = sorted(near, key=lambda event: SHOWN_KINDS[event.kind])
    words = f"{(index - 1) / fps:.1f} s" + "".join(f"   {event_words(event, layer.prefix)}" for event in events)
    ink = kind_colour(events[0].kind) if events else QUIET
    text(area, fitting_title(words), (2, TITLE - 12), 0.72, ink, 2 if events else 1)
    border = (ink, 5) if events else (THING, 2)
    cv2.rectangle(area, (0, TITLE), (area.shape[1] - 1, area.shape[0] - 1), *border)


def fitting_title(title: str) -> str:
    """Returns a title of at most 62 letters, with as many whole events as fit."""
    return title if len(title) <= 62 else f"{title[:59].rpartition('   ')[0]} ..."


def _draw_head(sheet: Image, sequence: Sequence, part: View, length: int) -> None:
    text(sheet, sequence.name, (GAP, 48), 1.3, INK, 3)
    size = sequence.scene.size if part.plan and sequence.scene is not None else part.high - part.low
    count = len({identity for marks in part.layer.frames.values() for identity in marks.id.tolist()})
    noun, unit = "tracks" if part.layer.name == "tracked" else "people", "m" if part.plan else "px"
    facts = [f"{count} {noun}"] * (count > 0) + [counted(length, "frame"), f"{sequence.fps:g}/s"]
    words = ", ".join([*facts, f"{size[0]:.4g} x {size[1]:.4g} {unit}; trails {TRAIL_SECONDS:g} s"])
    text(sheet, words, (GAP + text_width(sequence.name, 1.3, 3) + 30, 46), 0.75, QUIET)


def _draw_foot(area: Image, layer: Layer, length: int, fps: float, chosen: Iterable[int]) -> None:
    line, left, right = 34, GAP + 10, area.shape[1] - GAP - 60

    def x_of(index: int) -> int:
        return int(left + (index - 1) / max(length - 1, 1) * (right - left))

    cv2.line(area, (left, line), (right, line), THING, 3, cv2.LINE_AA)
    for index in chosen:
        cv2.line(area, (x_of(index), line - 13), (x_of(index), line + 13), INK, 3, cv2.LINE_AA)
    text(area, f"{(length - 1) / fps:.0f} s", (right + 12, line + 8), 0.7, QUIET)
    events = [(known, event.kind) for known, event in layer.events if 1 <= known <= length]
    for known, kind in events:
        cv2.circle(area, (x_of(known), line), 9, kind_colour(kind), -1, cv2.LINE_AA)
    x = left
    for kind in sorted({kind for _, kind in events}, key=[*KIND_COLOUR].index):
        cv2.circle(area, (x + 8, line + 42), 9, kind_colour(kind), -1, cv2.LINE_AA)
        text(area, kind, (x + 26, line + 49), 0.7, INK)
        x += 50 + text_width(kind, 0.7)
    text(area, "ticks: the pictures above", (x + 10, line + 49), 0.7, QUIET)


def choose_frames(layer: Layer, length: int, fps: float, count: int) -> list[int]:
    """Returns the numbers, from 1, of `count` frames in ascending order.

    Frames in which events become known are taken first, by rank of the kind, if they are more than 1 s apart; then any
    frames are added. Each frame is taken as far as possible from all frames chosen so far.
    """
    wanted, chosen = min(max(1, count), length), list[int]()
    for rank in sorted({*SHOWN_KINDS.values()}):
        pool = sorted({k for k, e in layer.events if SHOWN_KINDS.get(e.kind) == rank and 1 <= k <= length})
        while len(chosen) < wanted:
            pool = [k for k in pool if all(abs(k - one) > CLOSE_SECONDS * fps for one in chosen)]
            if not pool:
                break
            chosen.append(_farthest(np.array(pool), chosen, length))
    while len(chosen) < wanted:
        chosen.append(_farthest(np.arange(1, length + 1), chosen, length))
    return sorted(chosen)


def _farthest(pool: Ints, chosen: list[int], length: int) -> int:
    # The ends count as an eighth of the length further out, so that frames near them are chosen, too.
    marks = np.array([-(length // 8), length + 1 + length // 8, *chosen])
    return int(pool[np.abs(pool[:, None] - marks).min(axis=1).argmax()])
