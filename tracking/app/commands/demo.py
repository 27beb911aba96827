"""`flockscope demo`: generates scenes, tracks them, scores the tracks and writes pages to open.

The first page has videos of one scene, and tables of scores whose rows link to replays.
"""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from html import escape
from itertools import zip_longest
from pathlib import Path
from typing import Any, cast

from scenarios.errors import counted
from sim.io.files.own_files import GENERATOR, output_path
from sim.types import Array, DetectionMode, Sequence
from tracking.app import option_parsing
from tracking.app.command_options import DemoOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score import summary
from tracking.app.commands.score_ranking import COLUMNS, rank_words, shown_columns, usual_key, verdict
from tracking.app.commands.score_tables import SHOWN, SIMILARITY, arrow, number, table
from tracking.app.commands.track import TrackerSetup
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.video import PageVideo
from tracking.comparison import ComparedRuns, compare
from tracking.running import tracker_registry
from tracking.running.run import TrackingRun
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores

SCENES = ("merge", "split", "cross", "queue", "party", "mixed")
SEEDS = range(40_000, 40_002)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
QUICK_TRACKERS = ("blob", "group-pda")  # one that reports people, one that reports groups
PIXEL_SCENE, PIXEL_SEED = "split", range(40_000, 40_001)  # The scene that is rendered and tracked from its pictures.

QUICK_PIXEL_SETTINGS = ("camera.fps=5", "camera.image=[480,360]")  # What --quick changes in that scene.

VIDEO = """<figure><video src="{address}#t={start:.1f}" controls muted loop playsinline preload="metadata"></video>
<figcaption><code>{tracker}</code></figcaption></figure>"""


@dataclass(frozen=True, eq=False)
class _TrackJob:
    tracker: str
    detections: DetectionMode
    folders: list[Path]  # of sequences
    out: Path  # a run is written into the folder of this that has its sequence's name
    overlay: Path | None = None  # where to draw tracks over the last sequence's pictures


@dataclass(frozen=True)
class ShownRun:
    """The run of a tracker on a sequence, as a row of the page."""

    name: str  # what links to the replay
    page: Path  # the replay
    scores: Scores


Sections = dict[str, list[ShownRun]]  # By title.


def demo(options: DemoOptions) -> CommandResult:
    """Writes simulated scenes, tracks and pages into the folder --out; scenes that are already there are kept."""
    from sim.dataset.generate import generate
    from sim.io.files.atomic import write_file
    from sim.io.files.own_files import refuse_foreign_file
    from sim.io.source import open_source
    from sim.workers.pool import WorkerOptions

    start, out, quick = time.monotonic(), options.out, options.quick
    page = option_parsing.output_folder(out) / "index.html"
    refuse_foreign_file(page)
    names, seeds = (QUICK_SCENES, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    workers = 1 if quick else os.cpu_count() or 1
    with _compiled_ahead() if quick else nullcontext(_tracked) as tracked:
        with ProgressMeter("generate") as meter:
            count = WorkerOptions(workers)
            folders = generate(names, seeds, out / "data", workers=count, progress=meter.update, streams=())
            settings = QUICK_PIXEL_SETTINGS if quick else ()
            (rendered,) = generate(
                [PIXEL_SCENE], PIXEL_SEED, out / "pictures", set=settings, streams=("left",), images="mp4"
            )  # fmt: skip
        trackers = QUICK_TRACKERS if quick else tracker_registry.names()
        runs = _runs(_jobs(out, trackers, folders, rendered, quick), workers, tracked)
    sequences, (scene,) = [open_source(folder)[0] for folder in folders], open_source(rendered)
    from_points, from_pixels = ({j.tracker: r for j, r in runs.items() if j.detections == m} for m in ("file", "image"))
    inputs = {name: "boxes" if "boxes" in tracker_registry.find(name).needs else "points" for name in trackers}
    tables: dict[str, ComparedRuns] = {}
    sections: Sections = {}
    for word in sorted({*inputs.values()}, reverse=True):
        alike = {name: from_points[name] for name in trackers if inputs[name] == word}
        compared = tables[f"from {word}"] = compare(sequences, alike)
        for name, scores in compared.scores.items():
            pages = out / "pages" / name
            sections[f"{name}, from {word}"] = [
                _shown(name, one.name, one, run, own, output_path(pages, one.name, ".html"))
                for one, run, own in zip(sequences, from_points[name], scores, strict=True)
            ]
    pixels = _shown_pixels(scene, from_pixels, out / "pages" / "pictures")
    write_file(page, _page(out, tables, sections, scene, pixels).encode())
    means = {title: summary([row.scores for row in rows]) for title, rows in sections.items()}
    shown = means | {f"{row.name}, from pixels": summary([row.scores]) for row in pixels}
    cells = [[title, *(number(key, each[key]["mean"]) for key in COLUMNS)] for title, each in shown.items()]
    lines = [table("", ["tracker"], COLUMNS, cells)]
    lines += [f"{counted(len(sequences), 'sequence')} in {folders[0].parent}; one with pictures, {rendered}"]
    lines += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    return CommandResult({"sequences": len(sequences), "scores": means, "page": page}, "\n".join(lines))


def _jobs(out: Path, trackers: Iterable[str], folders: list[Path], rendered: Path, quick: bool) -> list[_TrackJob]:
    names, pictures, tracks = [*trackers], out / "pages" / "pictures", out / "tracks"
    of_pixels = names[:1] if quick else [name for name in names if "pixels" in tracker_registry.find(name).needs]
    image_jobs = [
        _TrackJob(name, "image", [rendered], tracks / f"{name}-image", pictures / f"{name}.mp4") for name in of_pixels
    ]
    half = len(names) // 2
    file_jobs = [_TrackJob(name, "file", folders, tracks / name) for name in (*names[half:], *names[:half])]
    # Neighbours are of different trackers: two that run at once need not compile the same.
    return [job for two in zip_longest(image_jobs, file_jobs) for job in two if job is not None]


def _runs(
    jobs: list[_TrackJob], workers: int, tracked: Callable[[_TrackJob], list[TrackingRun]]
) -> dict[_TrackJob, list[TrackingRun]]:
    from sim.workers.pool import results_in_order, start_workers

    runs = {}
    with ProgressMeter("track", len(jobs)) as meter, start_workers(workers) as run:
        for job, found in zip(jobs, results_in_order(run, tracked, jobs), strict=True):
            runs[job] = found
            meter.step(f"{job.tracker}{' from pixels' if job.overlay else ''}")
    return runs


def _tracked(job: _TrackJob) -> list[TrackingRun]:
    from sim.io.source import open_source
    from tracking.app.pictures.overlay import write_overlay

    runs = []
    for folder in job.folders:
        (sequence,) = open_source(folder)
        runs.append(TrackerSetup(job.tracker, detections=job.detections).run(sequence))
        runs[-1].write(output_path(job.out, sequence.name), sequence)
    if job.overlay is not None:
        write_overlay(sequence, runs[-1], job.overlay, "over")
    return runs


@contextmanager
def _compiled_ahead() -> Iterator[Callable[[_TrackJob], list[TrackingRun]]]:
    """Compiles the kernels of QUICK_TRACKERS in another process; yields `_tracked`, which waits for those that it
    needs."""
    from sim.scene.visibility_kernels import sample_visibility
    from sim.workers.pool import WorkerProcess

    worker, kernel = WorkerProcess(), cast("Any", sample_visibility)
    # With one processor it would only take longer, as the process imports everything again; without a cache it is lost.
    useful = (os.cpu_count() or 1) > 1 and kernel.stats.cache_path is not None
    compiling = list(QUICK_TRACKERS) if useful else []

    def tracked(job: _TrackJob) -> list[TrackingRun]:
        while job.tracker in compiling:
            del compiling[0]
            worker.receive()
        return _tracked(job)

    try:
        for tracker in compiling:
            worker.send(_compile, tracker)
        yield tracked
    finally:
        worker.terminate()
        worker.join()


def _compile(tracker: str) -> None:
    pixels = "pixels" in tracker_registry.find(tracker).needs
    TrackerSetup(tracker, detections="image" if pixels else "file").run(_made_up_people())


def _made_up_people() -> Sequence:
    """Returns pictures and points of two people side by side and one apart, all that a tracker needs to call its
    kernels, with the types of simulated sequences."""
    import numpy as np

    from sim.scene.camera import camera_rotation, project, px_per_m_at_centre
    from sim.types import Camera, Detections, Frame, Image

    wide, high, fps = 320, 240, 5.0
    position, rotation = np.array([0.0, -10.0, 6.0]), camera_rotation(0.6, 0.0)
    camera = Camera("pinhole", (wide, high), (250.0, 250.0), (wide / 2, high / 2), position, rotation)
    r = np.random.default_rng(0)
    ground = r.integers(90, 170, (high, wide, 1))
    walks = [np.array([[x - 3.0, 0.0], [x - 2.75, 0.0], [3.0 - x, 2.0]]) for x in np.linspace(0.0, 5.0, 16)]

    def picture(people: Iterable[Array] = ()) -> Image:
        image = ground + r.normal(0.0, 2.0, (high, wide, 3))
        for x, y in people:
            (u, foot), (_, head) = project(camera, np.array([[x, y, 0.0], [x, y, 1.75]]))[0]
            half = 0.13 * (foot - head)
            image[int(head) : int(foot), int(u - half) : int(u + half)] = 20, 20, 150
        made: Image = image.clip(0, 255).astype(np.uint8)
        made.setflags(write=False)
        return made

    def frames() -> Iterator[Frame]:
        for k, pos in enumerate(walks):
            yield Frame(k + 1, k / fps, picture(pos), None, Detections(k + 1, k / fps, "ground", pos))

    return Sequence(
        "made-up", fps, len(walks), frames, image_size=camera.image, camera=camera, has_images=True,
        has_detections=True, px_per_m=px_per_m_at_centre(camera),
        load_background=lambda: np.stack([picture() for _ in range(12)]),
    )  # fmt: skip


def _shown_pixels(scene: Sequence, runs: Mapping[str, list[TrackingRun]], folder: Path) -> list[ShownRun]:
    from tracking.app.replay_page.video import page_video

    video = page_video(scene, output_path(folder, scene.name, ".html"), "beside")
    scores = compare([scene], runs).scores
    return [
        _shown(f"{name} from pixels", name, scene, run, scores[name][0], folder / f"{name}-image.html", video)
        for name, (run,) in runs.items()
    ]


def _shown(
    title: str,
    name: str,
    sequence: Sequence,
    run: TrackingRun,
    scores: Scores,
    page: Path,
    video: PageVideo | None = None,
) -> ShownRun:
    """Writes the replay page of a run, and returns its row."""
    from tracking.app.replay_page.page import Run, write_page

    write_page(sequence, Run(run), page, scores, f"{title} on {sequence.name}", video)
    return ShownRun(name, page, scores)


def _page(
    root: Path, tables: Mapping[str, ComparedRuns], sections: Sections, scene: Sequence, pixels: list[ShownRun]
) -> str:
    """Returns the page as HTML: rankings, videos and scores of the scene with pictures, then, folded, each section."""
    frames = scene.length or 0
    videos = [
        VIDEO.format(address=escape(f"pages/pictures/{run.name}.mp4"), start=0.4 * frames / scene.fps, tracker=run.name)
        for run in pixels
    ]
    parts = {
        "GENERATOR": GENERATOR, "FRAMES": str(frames),
        "RANKINGS": "\n".join(_ranking(f"Trackers {word}", compared) for word, compared in tables.items()),
        "PIXELS": f'<div class="films">{"".join(videos)}</div>{_score_table(pixels, root)}',
        "SECTIONS": "\n".join(
            f"<details><summary>{escape(title)}</summary>{_score_table(rows, root, summed=True)}</details>"
            for title, rows in sections.items()
        ),
    }  # fmt: skip
    page = Path(__file__).with_name("demo_page.html").read_text(encoding="utf-8")
    return re.sub("@@([A-Z]+)@@", lambda found: parts[found[1]], page)


def _ranking(title: str, compared: ComparedRuns) -> str:
    key = usual_key(compared)
    entries = compared.to_arrow(key).to_pylist()
    keys = shown_columns(entries, key)
    rows = []
    for e in entries:
        name = escape(e["run"])
        cells = [name if e["first"] else f"<em>{name}</em>", rank_words(e), _interval(key, e)]
        rows.append([*cells, *(number(k, e[k], mean=True) for k in keys)])
    words = "; ".join(verdict(compared, key))
    sure = f"<p><strong>Result:</strong> {escape(words)}.</p>" if words else ""
    by = f"people compared by {SIMILARITY[compared.similarity]}; small: 95 % interval"
    note = f"<p>{counted(len(compared.sequences), 'scene')}, {by}.</p>"
    head = ["<th>tracker</th>", "<th>rank</th>", *map(_heading, [key, *keys])]
    return f"<h2>{escape(title)}</h2>{note}{sure}{_table(head, rows)}"


def _score_table(runs: list[ShownRun], root: Path, summed: bool = False) -> str:
    keys = [key for key in SHOWN if any(math.isfinite(run.scores[key]) for run in runs)]
    rows = [
        [f'<a href="{escape(run.page.relative_to(root).as_posix())}">{escape(run.name)}</a>',
         *(number(key, run.scores[key]) for key in keys)]
        for run in runs
    ]  # fmt: skip
    foot: list[str] = []
    if summed and len(runs) > 1:
        means = summary([run.scores for run in runs])
        foot = ["mean<br><small>95 % interval</small>", *(_interval(key, means[key]) for key in keys)]
    return _table(["<th>sequence</th>", *map(_heading, keys)], rows, foot)


def _table(head: list[str], rows: list[list[str]], foot: Iterable[str] = ()) -> str:
    body, last = ("".join(map(_row, part)) for part in (rows, [foot] if foot else []))
    head_row = f"<tr>{''.join(head)}</tr>"
    table = f"<table><thead>{head_row}</thead><tbody>{body}</tbody><tfoot>{last}</tfoot></table>"
    return f'<div class="wide">{table}</div>'


def _row(cells: Iterable[str]) -> str:
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _heading(key: str) -> str:
    score = CATALOGUE[key]
    unit = f" [{score.unit}]" if score.unit not in ("1", "count") else ""
    return f'<th title="{escape(score.meaning)}">{escape(arrow(key))}{unit}</th>'


def _interval(key: str, mean: Mapping[str, Any]) -> str:
    low, high = number(key, mean["low"], mean=True), number(key, mean["high"], mean=True)
    return f"{number(key, mean['mean'], mean=True)}<br><small>{low} to {high}</small>"
