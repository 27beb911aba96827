"""`flockscope demo`: the main job from start to finish: scenes, tracks of every tracker, scores, pages to open."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from html import escape
from pathlib import Path

from sim.types import Sequence
from tracking import protocol
from tracking.app import options
from tracking.app.answer import Answer
from tracking.app.meter import Meter
from tracking.app.score_command import Row, score_run, summary
from tracking.app.score_tables import SHOWN, number
from tracking.app.track_command import Job
from tracking.run import Run
from tracking.scoring.catalogue import CATALOGUE

SCENES = ("merge", "split", "cross", "pass-by", "queue", "side-by-side", "party", "mixed")
SEEDS = range(40_000, 40_003)
QUICK, QUICK_SEEDS = ("quick",), range(40_000, 40_001)

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; color: #1b1f24 }
table { border-collapse: collapse; margin: 0 0 2rem } th, td { padding: .25rem .8rem; text-align: right }
th:first-child, td:first-child { text-align: left; white-space: nowrap }
th[title] { text-decoration: underline dotted #8a8f98; cursor: help } thead th { border-bottom: 2px solid #1b1f24 }
tfoot td { border-top: 1px solid #8a8f98; font-weight: 600 } small { color: #57606a; font-weight: 400 }
"""


@dataclass(frozen=True)
class Part:
    """One tracker's results: a row of scores and a page for each sequence."""

    tracker: str
    rows: list[Row]
    pages: list[Path]


def demo(out: Path, *, quick: bool) -> Answer:
    """Everything into `out`; the answer ends with the path of the page to open."""
    from sim.generate import generate
    from sim.io.source import open_source

    start = time.monotonic()
    options.folder(out)
    names, seeds = (QUICK, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    with Meter("generate") as meter:
        workers = 1 if quick else os.cpu_count() or 1
        folders = generate(names, seeds, out / "data", workers=workers, progress=meter.update)
    sequences = [open_source(folder)[0] for folder in folders]
    with Meter("track, score, draw", len(sequences) * len(protocol.names())) as meter:
        parts = [_part(tracker, sequences, out, meter) for tracker in protocol.names()]
    page = _page(out / "index.html", parts)
    text = [f"{len(sequences)} sequences in {folders[0].parent}", *(_line(part) for part in parts)]
    text += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    data = {part.tracker: summary(part.rows) for part in parts}
    return Answer({"sequences": len(sequences), "scores": data, "page": page}, "\n".join(text))


def _part(tracker: str, sequences: list[Sequence], out: Path, meter: Meter) -> Part:
    rows, pages = [], []
    for sequence in sequences:
        run = Job(tracker).run(sequence)
        row = score_run(sequence, run)
        rows.append(row)
        pages.append(_store(tracker, sequence, run, row, out))
        meter.step(f"{tracker} on {sequence.name}")
    return Part(tracker, rows, pages)


def _store(tracker: str, sequence: Sequence, run: Run, row: Row, out: Path) -> Path:
    """The tracks as files and as a page."""
    from sim.io.tracks import write_tracks
    from tracking.app.view import view

    folder = out / "tracks" / tracker / sequence.name
    write_tracks(folder, run, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene, info=run.info)
    path = out / "pages" / tracker / f"{sequence.name}.html"
    return view(sequence, run, path, row.scores, f"{tracker} on {sequence.name}")


def _line(part: Part) -> str:
    means = summary(part.rows)
    return f"{part.tracker}: " + ", ".join(
        f"{key} {number(key, means[key]['mean'], mean=True)}" for key in SHOWN if key in means
    )


def _page(path: Path, parts: list[Part]) -> Path:
    """A table for each tracker, each sequence linked to its replay."""
    from sim.io.atomic import write_file

    body = "\n".join(_table(part, path.parent) for part in parts)
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>flockscope demo</title><style>{STYLE}</style>'
    intro = (
        "<h1>flockscope demo</h1><p>Scenes made, tracked and scored. Each name opens a replay: tracks beside truth.</p>"
    )
    write_file(path, f"{head}{intro}{body}</html>\n".encode())
    return path


def _table(part: Part, root: Path) -> str:
    keys = [key for key in SHOWN if key in part.rows[0].scores]
    rows = []
    for row, page in zip(part.rows, part.pages, strict=True):
        link = f'<a href="{escape(page.relative_to(root).as_posix())}">{escape(row.sequence)}</a>'
        rows.append(_cells("td", [link, *(number(key, row.scores[key]) for key in keys)]))
    means = summary(part.rows)
    ends = [_interval(key, means[key]) for key in keys]
    foot = _cells("td", ["mean<br><small>95 % interval</small>", *ends])
    head = "<tr><th>sequence</th>" + "".join(map(_heading, keys)) + "</tr>"
    return (
        f"<h2>{escape(part.tracker)}</h2><table><thead>{head}</thead><tbody>{''.join(rows)}</tbody>"
        f"<tfoot>{foot}</tfoot></table>"
    )


def _heading(key: str) -> str:
    about = CATALOGUE[key]
    unit = f" [{about.unit}]" if about.unit not in ("1", "count") else ""
    return f'<th title="{escape(about.meaning)}">{escape(key)}{unit}</th>'


def _interval(key: str, mean: dict[str, float]) -> str:
    low, high = number(key, mean["low"], mean=True), number(key, mean["high"], mean=True)
    return f"{number(key, mean['mean'], mean=True)}<br><small>{low} to {high}</small>"


def _cells(tag: str, cells: list[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{cell}</{tag}>" for cell in cells) + "</tr>"
