"""A replay in the browser: one HTML file, at most a video beside it; nothing fetched, nothing run elsewhere."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from sim.io.files.atomic import write_file
from sim.types import Array, Sequence, Tracks, Truth
from tracking.app.replay_page import person_rows
from tracking.app.replay_page.person_rows import Json, Rows
from tracking.app.replay_page.video import Film
from tracking.drawing.plan_area import plan_area
from tracking.run import grouped

HERE = Path(__file__).parent
SCRIPTS = (
    "decode.js", "draw.js", "whole_groups.js", "plan.js", "camera_view.js", "image.js", "timeline.js",
    "video.js", "page.js",
)  # fmt: skip


def view(
    sequence: Sequence,
    tracks: SequenceOf[Tracks] | None,
    out: str | Path,
    scores: Mapping[str, float] | None = None,
    title: str | None = None,
    film: Film | None = None,
) -> Path:
    """Writes the page, whole or not at all, and returns its path; `tracks` and `scores` are shown where they are given.

    Groups and events that a tracker left out are derived by the baseline rule. film: what is played under the boxes.
    """
    name = title or sequence.name
    shown = payload(sequence, tracks, scores) | {"video": None if film is None else film.facts()}
    data = json.dumps(shown, separators=(",", ":"), allow_nan=False)
    page = (HERE / "page.html").read_text(encoding="utf-8")
    parts = {
        "TITLE": escape(name),
        "STYLE": (HERE / "page.css").read_text(encoding="utf-8"),
        "DATA": data.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"),
        "FILM": "" if film is None else film.inside,
        "SCRIPT": "\n".join((HERE / script).read_text(encoding="utf-8") for script in SCRIPTS),
    }
    pieces = page.split("@@")
    text = "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))
    path = Path(out)
    write_file(path, text.encode())
    return path


def payload(sequence: Sequence, tracks: SequenceOf[Tracks] | None, scores: Mapping[str, float] | None = None) -> Json:
    """All that the page shows, ready for JSON."""
    truth = sequence.truth
    answers = None if tracks is None else grouped(tracks, sequence)
    true = None if truth is None else person_rows.truth_rows(truth)
    tracked = None if answers is None else person_rows.track_rows(answers)
    found = person_rows.detections(sequence)
    sides = [rows for rows in (true, tracked) if rows is not None]
    return {
        "name": sequence.name,
        "tracker": _tracker(tracks),
        "fps": sequence.fps,
        "length": _length(sequence, sides, found),
        "image": sequence.image_size or _image_size(sides),
        "bounds": _bounds(sequence, sides),
        "scene": person_rows.scene_json(sequence.scene),
        "camera": person_rows.camera_json(sequence.camera),
        "truth": None if true is None or truth is None else person_rows.side(true, truth.events or ()),
        "tracks": None
        if tracked is None or answers is None
        else person_rows.side(tracked, [e for t in answers for e in t.events]),
        "detections": found,
        "unlabelled": _unlabelled(truth),
        "near": _near(truth),
        "scores": _scores(scores or {}),
    }


def _scores(scores: Mapping[str, float]) -> list[list[str]]:
    """[key, value, meaning, family] of every score of the catalogue that is known; before them, with the family "",
    the few that stand for all."""
    from tracking.app.commands.score_tables import SHOWN, number
    from tracking.scoring.catalogue import CATALOGUE

    known = {key: number(key, scores[key]) for key in CATALOGUE if math.isfinite(scores.get(key, math.nan))}
    few = [[key, known[key], CATALOGUE[key].meaning, ""] for key in SHOWN if key in known]
    return few + [[key, text, CATALOGUE[key].meaning, CATALOGUE[key].family] for key, text in known.items()]


def _tracker(tracks: SequenceOf[Tracks] | None) -> str:
    info: Mapping[str, Any] = getattr(tracks, "info", {})
    return str(info.get("tracker", "the tracker"))


def _length(sequence: Sequence, sides: list[Rows], found: Json | None) -> int:
    if sequence.length is not None:
        return max(sequence.length, 1)
    last = [int(rows.frame.max()) for rows in sides if len(rows.frame)]
    detected = [int(found["frames"][-1][0])] if found else []
    return max([1, *last, *detected])


def _image_size(sides: list[Rows]) -> list[int] | None:
    """A picture that holds all boxes, and all that was tracked in it, where nothing says how large it is."""
    corners = [rows.box[:, :2] + rows.box[:, 2:] for rows in sides]
    corners += [points for rows in sides if rows.plane == "image" for points in _places(rows)]
    known = np.concatenate([np.zeros((0, 2)), *corners])
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return None
    width, height = known.max(axis=0)
    return [max(math.ceil(width), 16), max(math.ceil(height), 16)]


def _bounds(sequence: Sequence, sides: list[Rows]) -> list[float] | None:
    """x0, y0, x1, y1 of the plan in m: what people and things need; None without ground."""
    points = [part for rows in sides if rows.plane == "ground" for part in _places(rows)]
    area = plan_area(sequence.scene, np.concatenate([np.zeros((0, 2)), *points]))
    return None if area is None else [round(float(v), 2) for corner in area for v in corner]


def _places(rows: Rows) -> list[Array]:
    """Where rows are, and the corners of their hulls where they are groups."""
    return [rows.pos, *(rows.wholes.hull if rows.wholes is not None else ())]


def _unlabelled(truth: Truth | None) -> list[list[int]]:
    """[first, last] frames without group labels."""
    if truth is None or truth.labelled is None or truth.labelled.all():
        return []
    edge = np.flatnonzero(np.diff(np.r_[True, truth.labelled, True].astype(int)))
    return [[int(a) + 1, int(b)] for a, b in edge.reshape(-1, 2)]


def _near(truth: Truth | None) -> list[list[int]]:
    """[first, last, a, b] of strangers who walk as if they belonged together."""
    if truth is None or truth.near is None:
        return []
    near = truth.near
    listed: list[list[int]] = np.stack([near.start, near.end, near.a, near.b], axis=1).tolist()
    return listed
