"""Writes the replay page: one HTML file with data, style and scripts, and at most a video beside it.

The page loads nothing from the network.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from html import escape
from pathlib import Path

from sim.io.files.atomic import write_file
from sim.types import Sequence, Tracks
from tracking.app.replay_page.page_data import page_data
from tracking.app.replay_page.video import PageVideo

HERE = Path(__file__).parent
SCRIPTS = (
    "decode.js", "draw.js", "whole_groups.js", "plan.js", "camera_view.js", "image.js", "timeline.js", "video.js",
    "page.js",
)  # fmt: skip
"""The scripts of the page, in the order in which they run."""


def write_page(
    sequence: Sequence,
    tracks: SequenceOf[Tracks] | None,
    out: str | Path,
    scores: Mapping[str, float] | None = None,
    title: str | None = None,
    video: PageVideo | None = None,
) -> Path:
    """Writes the replay page, one HTML file, and returns its path. The file is complete, or is not written at all."""
    shown = page_data(sequence, tracks, scores) | {"video": None if video is None else video.facts()}
    data = json.dumps(shown, separators=(",", ":"), allow_nan=False)
    page = (HERE / "page.html").read_text(encoding="utf-8")
    parts = {
        "TITLE": escape(title or sequence.name),
        "STYLE": (HERE / "page.css").read_text(encoding="utf-8"),
        "DATA": data.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"),
        "FILM": "" if video is None else video.content,
        "SCRIPT": "\n".join((HERE / script).read_text(encoding="utf-8") for script in SCRIPTS),
    }
    pieces = page.split("@@")
    text = "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))
    path = Path(out)
    write_file(path, text.encode("utf-8", "replace"))  # a title from a file's name may hold lone surrogates
    return path
