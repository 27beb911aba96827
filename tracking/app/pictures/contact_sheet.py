"""A contact sheet: pictures and plans of a sequence over time, onsets of its events preferred, as one PNG."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.io.files.atomic import write_file
from sim.types import Array, GroupEvent, Image, Ints, Sequence, Truth
from tracking.app.pictures.panel_pictures import Pictures
from tracking.drawing.canvas import FLOOR, INK, QUIET, THING, TRAIL_SECONDS, Canvas, colour, text
from tracking.drawing.layer_painting import KIND_COLOUR, event_words, kind_colour
from tracking.drawing.plan_area import MARGIN, plan_area
from tracking.drawing.plan_view import draw_group_hulls, draw_people, draw_scene, draw_trails

# Merges and splits are what a scenario is about; entering and leaving come last.
RANK = {"merge": 0, "split": 0, "cross": 1, "queue": 1, "form": 2, "dissolve": 2}
WIDTH, HEAD, FOOT, GAP, TITLE = 880, 76, 96, 20, 40
"""px before shrinking: a panel's width; the sheet's head and foot; gaps; a panel's title."""

MANY = 40
SOON = 1.0
"""s: events that begin so close to one another share a picture."""


def sheet(sequence: Sequence, out: str | Path, frames: int = 8) -> Path:
    """Writes the PNG, whole or not at all, and returns its path.

    `frames` panels, four to a row, with a time line beneath: the pictures where there are any, and the plan where
    people's places are labelled. InputError where there are neither pictures nor labels.
    """
    truth = sequence.truth
    if (truth is None or not len(truth.frame)) and not sequence.has_images:
        raise InputError(
            file=sequence.name, got="no labelled people and no pictures", expected="a sequence with gt/ or pictures",
            remedy="name another",
        )  # fmt: skip
    picture = compose(sequence, _nobody(sequence) if truth is None else truth, frames)
    path = Path(out)
    done, code = cv2.imencode(".png", picture)
    assert done, "PNG holds any 8-bit picture"
    write_file(path, code.tobytes())
    return path


def _nobody(sequence: Sequence) -> Truth:
    """What stands for the truth of a sequence without labels."""
    length = sequence.length or sum(1 for _ in sequence.without_pictures())
    none, nan = np.zeros(0, np.int64), float("nan")
    return Truth(sequence.name, sequence.fps, length, nan, none, none, none, None, None, np.zeros((0, 4)), np.zeros(0))


@dataclass(frozen=True)
class Panel:
    """Heights (px) of one panel's parts from above: title, picture, small pictures, plan; 0 where there is none."""

    picture: int
    small: int
    plan: int

    @property
    def height(self) -> int:
        """px of the whole panel."""
        return TITLE + self.picture + self.small + self.plan


def compose(sequence: Sequence, truth: Truth, frames: int = 8) -> Image:
    """The sheet as an (H, W, 3) picture."""
    chosen = choose(truth, frames)
    pictures = Pictures(sequence, truth, chosen)
    low, high = _bounds(sequence, truth)
    plan = round(WIDTH * float(np.clip((high - low)[1] / (high - low)[0], 0.4, 1.2)))
    part = Panel(*pictures.heights(WIDTH), plan if truth.pos is not None or not pictures.frames else 0)
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    total = (HEAD + rows * (part.height + GAP) + FOOT, GAP + columns * (WIDTH + GAP))
    canvas = np.full((*total, 3), 255, np.uint8)
    for k, index in enumerate(chosen):
        top, left = HEAD + k // columns * (part.height + GAP), GAP + k % columns * (WIDTH + GAP)
        area = canvas[top : top + part.height, left : left + WIDTH]
        y = TITLE + part.picture
        if part.picture:
            pictures.large(area[TITLE:y], index)
        if part.small:
            pictures.small(area[y : y + part.small], index)
        if part.plan:
            _plan(area[y + part.small :], sequence, truth, index, low, high)
        _title(area, truth, index)
    _head(canvas, sequence, truth)
    _foot(canvas[-FOOT:], truth, chosen)
    return np.asarray(cv2.resize(canvas, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)


def choose(truth: Truth, frames: int) -> list[int]:
    """Which frames to show: onsets by rank, spread over time where there are too many; then the widest gaps halved."""
    frames = max(1, min(frames, truth.length))
    chosen: list[int] = []
    events = [event for event in truth.events or () if 1 <= event.start <= truth.length and event.kind in RANK]
    for rank in sorted(set(RANK.values())):
        onsets = _apart({event.start for event in events if RANK[event.kind] == rank}, chosen, SOON * truth.fps)
        room = frames - len(chosen)
        chosen += onsets if len(onsets) <= room else [onsets[k] for k in _spread(len(onsets), room)]
    people = np.bincount(truth.frame, minlength=truth.length + 1)[1 : truth.length + 1]
    while len(chosen) < frames:
        chosen.append(_widest(chosen, people))
    return sorted(chosen)


def _apart(onsets: set[int], chosen: list[int], least: float) -> list[int]:
    """Those further than `least` frames from what is chosen and from one another, the earlier first."""
    found: list[int] = []
    for onset in sorted(onsets):
        if all(abs(onset - other) > least for other in (*chosen, *found)):
            found.append(onset)
    return found


def _spread(n: int, k: int) -> list[int]:
    """k of n places, evenly apart."""
    return [round(place) for place in np.linspace(0, n - 1, k)] if k > 1 else [0][:k]


def _widest(chosen: list[int], people: Ints) -> int:
    """The fullest frame of the middle of the widest gap (the one nearest the middle where several are).

    The ends of the sequence count as an eighth of it further out, so that neither is left out.
    """
    length = len(people)
    marks = np.array([1 - length // 8, *sorted(chosen), length + length // 8])
    for k in np.argsort(-np.diff(marks), kind="stable"):
        low, high = marks[k], marks[k + 1]
        quarter = (high - low) // 4
        inner = np.arange(max(low + quarter, low + 1, 1), min(high - quarter, high - 1, length) + 1)
        if len(inner):
            order = np.lexsort((np.abs(inner - (low + high) / 2), -people[inner - 1]))
            return int(inner[order[0]])
    return next(index for index in range(1, length + 1) if index not in chosen)


def _places(truth: Truth) -> Array:
    """Where everybody is drawn: on the ground, else the middle of the boxes."""
    if truth.pos is not None:
        return truth.pos
    assert truth.box is not None, "labels have positions or boxes"
    return truth.box[:, :2] + truth.box[:, 2:] / 2


def _bounds(sequence: Sequence, truth: Truth) -> tuple[Array, Array]:
    if truth.pos is None and sequence.image_size is not None:
        return np.zeros(2), np.array(sequence.image_size, float)
    if truth.pos is not None:
        return plan_area(sequence.scene, truth.pos) or (np.zeros(2), np.ones(2))
    assert truth.box is not None, "labels have positions or boxes"
    corners = np.concatenate([truth.box[:, :2], truth.box[:, :2] + truth.box[:, 2:]])
    corners = corners[np.isfinite(corners).all(axis=1)]
    return (corners.min(axis=0), corners.max(axis=0) + 1e-3) if len(corners) else (np.zeros(2), np.ones(2))


def _plan(area: Image, sequence: Sequence, truth: Truth, index: int, low: Array, high: Array) -> None:
    """People from above, or the boxes of a recording without pictures."""
    plan = truth.pos is not None
    view = Canvas.fit(area, low, high, upwards=plan)
    places, boxes = _places(truth), None if plan else truth.box
    view.image[:] = FLOOR
    if plan:
        draw_scene(view, sequence.scene)
    draw_trails(view, truth, index, places)
    draw_group_hulls(view, truth, index, places, boxes)
    rows = truth.rows(index)
    draw_people(view, truth, index, places, boxes, ids=rows.stop - rows.start <= MANY)
    for event in _now(truth, index) if plan else []:
        at, radius = _around(event, truth.id[rows], places[rows])
        view.disc(at, radius * view.scale, kind_colour(event.kind), 3)


def _title(area: Image, truth: Truth, index: int) -> None:
    """When, and what happens; a frame round the panel in the colour of that."""
    now = _now(truth, index)
    words = f"{(index - 1) / truth.fps:.1f} s" + "".join(f"   {event_words(event)}" for event in now)
    ink = kind_colour(now[0].kind) if now else QUIET
    text(area, words[:62], (2, TITLE - 12), 0.72, ink, 2 if now else 1)
    cv2.rectangle(area, (0, TITLE), (area.shape[1] - 1, area.shape[0] - 1), ink if now else THING, 5 if now else 2)


def _now(truth: Truth, index: int) -> list[GroupEvent]:
    """Events that begin about then, those first that a scenario is about."""
    near = [event for event in truth.events or () if abs(event.start - index) <= SOON * truth.fps]
    return sorted((event for event in near if event.kind in RANK), key=lambda event: RANK[event.kind])


def _around(event: GroupEvent, ids: Ints, places: Array) -> tuple[Array, float]:
    """Centre and radius (m) of a ring round all whom an event concerns."""
    members = places[np.isin(ids, event.members)]
    if not len(members):
        return np.array(event.pos), MARGIN
    centre = members.mean(axis=0)
    return centre, float(np.linalg.norm(members - centre, axis=1).max()) + 0.7


def _head(canvas: Image, sequence: Sequence, truth: Truth) -> None:
    text(canvas, sequence.name, (GAP, 48), 1.3, INK, 3)
    width = cv2.getTextSize(sequence.name, cv2.FONT_HERSHEY_SIMPLEX, 1.3, 3)[0][0]
    unit = "m" if truth.pos is not None else "px"
    low, high = _bounds(sequence, truth)
    if truth.pos is not None and sequence.scene is not None:
        low, high = np.zeros(2), sequence.scene.size
    people = f"{len(np.unique(truth.id))} people, " if len(truth.id) else ""
    facts = f"{people}{truth.length} frames, {truth.fps:g}/s, "
    facts += f"{high[0] - low[0]:.4g} x {high[1] - low[1]:.4g} {unit}; trails {TRAIL_SECONDS:g} s"
    text(canvas, facts, (GAP + width + 30, 46), 0.75, QUIET)


def _foot(area: Image, truth: Truth, chosen: list[int]) -> None:
    """A time line: the shown frames as ticks, events as dots, and which colour is which kind."""
    width, line = area.shape[1], 34
    left, right = GAP + 10, width - GAP - 60
    last = max(truth.length - 1, 1)

    def at(index: int) -> int:
        return int(left + (index - 1) / last * (right - left))

    cv2.line(area, (left, line), (right, line), THING, 3, cv2.LINE_AA)
    for index in chosen:
        cv2.line(area, (at(index), line - 13), (at(index), line + 13), INK, 3, cv2.LINE_AA)
    text(area, f"{(truth.length - 1) / truth.fps:.0f} s", (right + 12, line + 8), 0.7, QUIET)
    events = [event for event in truth.events or () if 1 <= event.start <= truth.length]
    for event in events:
        cv2.circle(area, (at(event.start), line), 9, kind_colour(event.kind), -1, cv2.LINE_AA)
    x = left
    for kind in sorted({event.kind for event in events}, key=lambda kind: list(KIND_COLOUR).index(kind)):
        cv2.circle(area, (x + 8, line + 42), 9, colour(KIND_COLOUR[kind]), -1, cv2.LINE_AA)
        text(area, kind, (x + 26, line + 49), 0.7, INK)
        x += 50 + cv2.getTextSize(kind, cv2.FONT_HERSHEY_SIMPLEX, 0.7, 1)[0][0]
    text(area, "ticks: the pictures above", (x + 10, line + 49), 0.7, QUIET)
