"""Writes the replay page: one HTML file with data, style and scripts, and at most a video beside it.

The page loads nothing from the network. Its data is one JSON object: sequence, scene, camera, truth, tracks, detections
and scores. Rows of people are encoded column by column (`page_rows`); decode.js decodes them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from sim.store.atomic import write_file
from sim.store.tables import plain
from sim.store.truth_files import spans
from sim.types import Array, GroupEvent, Sequence, Tracks
from tracking.app.replay_page.page_rows import SCALE, Json, PageRows, deltas, encode_rows, rows_of_tracks, rows_of_truth
from tracking.app.replay_page.pair_columns import pair_columns
from tracking.app.replay_page.video import PageVideo
from tracking.drawing.plan_view import plan_area
from tracking.errors.found import FoundError
from tracking.grouping.belief import Belief
from tracking.running.run import TrackingRun, grouped

HERE = Path(__file__).parent
EVER = 10**9  # after the last frame
UNNAMED = "the tracker"
SIDES = ("tracks", "other")  # names in the page's data of the first run, and of a second one beside it

# The scripts of the page, in the order in which they run.
SCRIPTS = (
    "decode.js", "pairs.js", "draw.js", "whole_groups.js", "plan.js", "camera_view.js", "image.js", "timeline.js",
    "video.js", "pair_panel.js", "questions.js", "page.js",
)  # fmt: skip


@dataclass(frozen=True)
class Run:
    """Tracks of a tracker on a page, and their errors."""

    tracks: SequenceOf[Tracks]
    errors: SequenceOf[FoundError] = ()
    name: str = ""  # "": of the tracker

    @property
    def info(self) -> Json:
        """The content of run.json, as far as it is known."""
        return dict(getattr(self.tracks, "info", {}))

    @property
    def tracker(self) -> str:
        """The name that the page shows."""
        return self.name or str(self.info.get("tracker", UNNAMED))


def write_page(
    sequence: Sequence, runs: SequenceOf[Run], out: str | Path, video: PageVideo | None = None, start: int = 1,
    belief: Belief | None = None,
) -> Path:  # fmt: skip
    """Writes the replay page, one HTML file, and returns its path. The file is complete, or is not written at all.

    runs: none, one, or two that are shown beside each other. start: the frame that is shown first, from 1. belief:
    whose evidence about pairs of people is shown; None: the default.
    """
    shown = page_data(sequence, runs, start=start)
    shown |= {"video": None if video is None else video.facts(), "pairs": _pairs(sequence, runs, belief)}
    film = "" if video is None else video.content
    text = page_html(sequence.name, script_json(shown), film)
    path = Path(out)
    write_file(path, text.encode("utf-8", "replace"))  # a title from a file's name may hold lone surrogates
    return path


def page_html(title: str, data: str, film: str = "", still: str = "") -> str:
    """Returns the page as HTML. data: from `script_json`, what the page shows; film: the video in base64, or "".

    still: address of a picture for browsers without JavaScript, or "".
    """
    parts = {
        "TITLE": escape(title),
        "STYLE": theme() + (HERE / "page.css").read_text(encoding="utf-8"),
        "DATA": data,
        "FILM": film,
        "STILL": still and f'<img src="{still}" alt="A frame of the replay: {escape(title)}">',
        "SCRIPT": "\n".join((HERE / script).read_text(encoding="utf-8") for script in SCRIPTS),
    }
    pieces = (HERE / "page.html").read_text(encoding="utf-8").split("@@")
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def theme() -> str:
    """Returns the colours of our pages, light and dark, as CSS variables."""
    return (HERE / "theme.css").read_text(encoding="utf-8")


def script_json(value: Json) -> str:
    """Returns a JSON object as text in which no character can end the script element that it is put into."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def page_data(sequence: Sequence, runs: SequenceOf[Run], span: tuple[int, int] | None = None, start: int = 1) -> Json:
    """Returns all that the page shows except the video, as a JSON object.

    runs: as of `write_page`. span: first and last frame that are shown; start: the frame that is shown first.
    """
    truth, (low, high) = sequence.truth, span or (1, EVER)

    def side(rows: PageRows, events: Iterable[GroupEvent]) -> tuple[PageRows, Json]:
        rows = rows.ordered(np.flatnonzero((rows.frame >= low) & (rows.frame <= high)))
        return rows, encode_rows(rows, [e for e in events if e.start <= high and e.end >= low])

    sides = {} if truth is None else {"truth": side(rows_of_truth(truth), truth.events or ())}
    for name, run in zip(SIDES, runs, strict=False):
        complete = grouped(run.tracks, sequence)
        sides[name] = side(rows_of_tracks(complete), [e for t in complete for e in t.events])
    encoded = {name: found for name, (_, found) in sides.items()}
    detections = _detections(sequence, low, high)
    both = [rows for rows, _ in sides.values()]
    length = _length(sequence, both, detections)
    on_ground = [points for rows in both if rows.plane == "ground" for points in _points(rows)]
    area = plan_area(sequence.scene, np.concatenate([np.zeros((0, 2)), *on_ground]))
    return {
        "name": sequence.name,
        "tracker": runs[0].tracker if runs else UNNAMED,
        "fps": sequence.fps,
        "length": length,
        "from": low,
        "to": length if span is None else high,
        "start": start,
        "zoomed": span is not None,
        "image": sequence.image_size or _image_size(both),
        "bounds": None if area is None else np.concatenate(area).round(2).tolist(),
        "scene": plain(sequence.scene),
        "camera": plain(sequence.camera),
        "truth": encoded.get("truth"),
        "tracks": encoded.get("tracks"),
        "other": {"tracker": runs[1].tracker, "tracks": encoded["other"]} if len(runs) > 1 else None,
        "detections": detections,
        "background": None,
        "unlabelled": [] if truth is None or truth.labelled is None else spans(~truth.labelled),
        "errors": [
            {**one.facts(sequence.fps), "side": side}
            for side, run in zip(SIDES, runs, strict=False)
            for one in run.errors
            if one.error.start <= high and one.error.end >= low
        ],
    }


def _pairs(sequence: Sequence, runs: SequenceOf[Run], belief: Belief | None) -> Json:
    """Returns the evidence about pairs of people by side, of those sides that have it."""
    people: dict[str, TrackingRun | None] = {} if sequence.truth is None else {"truth": None}
    people |= {side: TrackingRun(tuple(run.tracks), run.info) for side, run in zip(SIDES, runs, strict=False)}
    found = {side: pair_columns(sequence, run, belief) for side, run in people.items()}
    return {side: columns for side, columns in found.items() if columns is not None}


def _length(sequence: Sequence, both: list[PageRows], detections: Json | None) -> int:
    if sequence.length is not None:
        return max(sequence.length, 1)
    last = [int(rows.frame.max()) for rows in both if len(rows.frame)]
    detected = [int(detections["frames"][-1][0])] if detections else []
    return max([1, *last, *detected])


def _image_size(both: list[PageRows]) -> list[int] | None:
    corners = [rows.box[:, :2] + rows.box[:, 2:] for rows in both]
    corners += [points for rows in both if rows.plane == "image" for points in _points(rows)]
    known = np.concatenate([np.zeros((0, 2)), *corners])
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return None
    width, height = known.max(axis=0)
    return [max(math.ceil(width), 16), max(math.ceil(height), 16)]


def _points(rows: PageRows) -> list[Array]:
    return [rows.pos, *(() if rows.hull is None else rows.hull)]


def _detections(sequence: Sequence, low: int, high: int) -> Json | None:
    if not sequence.has_detections:
        return None
    found = [
        (f.index, f.detections)
        for f in sequence.without_pictures()
        if f.detections is not None and len(f.detections.pos) and low <= f.index <= high
    ]
    if not found:
        return None
    plane = found[0][1].plane
    pos = np.concatenate([d.pos[:, :2] for _, d in found]) * SCALE[plane]
    boxes = [d.box for _, d in found if d.box is not None]
    box = np.concatenate(boxes) if len(boxes) == len(found) else None
    return {
        "plane": plane,
        "scale": SCALE[plane],
        "frames": [[index, len(d.pos)] for index, d in found],
        "x": deltas(pos[:, 0]),
        "y": deltas(pos[:, 1]),
        "box": [] if box is None else [deltas(box[:, k]) for k in range(4)],
    }
