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
from dataclasses import dataclass, field
from html import escape
from itertools import zip_longest
from pathlib import Path

from scenarios.errors import printable
from sim.io.files.own_files import GENERATOR, output_path
from sim.types import Array, DetectionMode, Sequence
from tracking.app import option_parsing
from tracking.app.command_options import DemoOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score import summary
from tracking.app.commands.score_ranking import rank_words, shown_columns, usual_key, verdict
from tracking.app.commands.score_tables import SHOWN, SIMILARITY, SequenceScores, arrow, number
from tracking.app.commands.track import TrackerSetup
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.video import PageVideo
from tracking.comparison import ComparedRuns, compare
from tracking.running import tracker_registry
from tracking.running.run import TrackingRun
from tracking.scoring.catalogue import CATALOGUE

EXTREMES = """<p>Best and worst scene of <code>{run}</code>: <a href="{best}">{best_name}</a> ({key} {most}) and
<a href="{worst}">{worst_name}</a> ({least}).</p>
"""
VIDEO = """<figure><video src="{address}#t={start:.1f}" controls muted loop playsinline preload="metadata"></video>
<figcaption>{caption}</figcaption></figure>"""
PEOPLE_CAPTION = "<code>{tracker}</code>: boxes of people with ids, hulls of their groups"
GROUPS_CAPTION = (
    "<code>{tracker}</code>: groups with hull, extent (dotted), arrow to where it is in 1 s, number of people (~)"
)
# The note on a tracker that reports groups only.
WITHOUT_PEOPLE = "<p>This tracker reports groups without people, so people cannot be scored.</p>"


@dataclass(frozen=True)
class ResultSection:
    """The scores under one heading; three lists of equal length that `add` extends."""

    title: str
    rows: list[SequenceScores] = field(default_factory=list)  # of one sequence each
    pages: list[Path] = field(default_factory=list)  # the replay page of each row
    names: list[str] = field(default_factory=list)  # texts that link to the pages

    def add(self, row: SequenceScores, page: Path, name: str) -> None:
        """Appends one row of scores with its page and name."""
        self.rows.append(row)
        self.pages.append(page)
        self.names.append(name)


@dataclass(frozen=True)
class PixelScene:
    """The scene that was tracked from its pictures."""

    section: ResultSection  # one row for each tracker and input; its names begin with the tracker's name
    videos: dict[str, Path]  # overlay videos by the tracker's name
    frames: int
    seconds: float  # duration of the scene


@dataclass(frozen=True)
class RankingTable:
    """A ranking of trackers that got the same input. key: the score that ranks."""

    title: str
    compared: ComparedRuns
    key: str


def demo_page(root: Path, scene: PixelScene, tables: list[RankingTable], sections: list[ResultSection]) -> str:
    """Returns the page as HTML: rankings, videos and scores of the scene with pictures, then, folded, each section."""
    parts = {
        "GENERATOR": GENERATOR, "FRAMES": str(scene.frames),
        "RANKINGS": "\n".join(_ranking(table, sections, root) for table in tables),
        "PIXELS": _videos(root, scene) + _score_table(scene.section, root),
        "SECTIONS": "\n".join(_section_html(section, root) for section in sections),
    }  # fmt: skip
    page = Path(__file__).with_name("demo_page.html").read_text(encoding="utf-8")
    return re.sub("@@([A-Z]+)@@", lambda found: parts[found[1]], page)


def _ranking(table: RankingTable, sections: list[ResultSection], root: Path) -> str:
    entries = table.compared.to_arrow(table.key).to_pylist()
    keys = shown_columns(entries, table.key)
    rows = []
    for e in entries:
        own = {"mean": e["mean"], "low": e["low"], "high": e["high"]}
        name = escape(e["run"])
        cells = [name if e["first"] else f"<em>{name}</em>", rank_words(e), _interval(table.key, own)]
        rows.append(_cells("td", [*cells, *(number(k, e[k], mean=True) for k in keys)]))
    head = "<tr><th>tracker</th><th>rank</th>" + "".join(map(_heading, [table.key, *keys])) + "</tr>"
    body = f'<div class="wide"><table><thead>{head}</thead><tbody>{"".join(rows)}</tbody></table></div>'
    compared = table.compared
    note = (
        f"{len(compared.sequences)} scenes, people compared by {SIMILARITY[compared.similarity]}; small: 95 % interval"
    )
    best = entries[len(compared.oracles)]["run"]
    words = "; ".join(verdict(compared, table.key))
    sure = f"<p><strong>Result:</strong> {escape(words)}.</p>" if words else ""
    return f"<h2>{escape(table.title)}</h2><p>{note}.</p>{sure}{body}{_extremes(table, best, sections, root)}"


def _extremes(table: RankingTable, run: str, sections: list[ResultSection], root: Path) -> str:
    section = next(s for s in sections if s.title.startswith(f"{run},"))
    known = [k for k, row in enumerate(section.rows) if math.isfinite(row.scores[table.key])]
    if len(known) < 2:
        return ""
    best, worst = (pick(known, key=lambda k: section.rows[k].scores[table.key]) for pick in (max, min))
    most, least = (number(table.key, section.rows[k].scores[table.key]) for k in (best, worst))
    links = {
        f"{name}{part}": escape(text)
        for name, k in (("best", best), ("worst", worst))
        for part, text in (("", _link(section.pages[k], root)), ("_name", section.names[k]))
    }
    return EXTREMES.format(run=escape(run), key=escape(table.key), most=most, least=least, **links)


def _videos(root: Path, scene: PixelScene) -> str:
    section = scene.section
    with_people = {name.split()[0] for name, row in zip(section.names, section.rows, strict=True) if _has_people(row)}
    shown = []
    for tracker, path in scene.videos.items():
        caption = (PEOPLE_CAPTION if tracker in with_people else GROUPS_CAPTION).format(tracker=escape(tracker))
        shown.append(VIDEO.format(address=escape(_link(path, root)), start=0.4 * scene.seconds, caption=caption))
    return f'<div class="films">{"".join(shown)}</div>'


def _section_html(section: ResultSection, root: Path) -> str:
    note = "" if any(map(_has_people, section.rows)) else WITHOUT_PEOPLE
    return f"<details><summary>{escape(section.title)}</summary>{note}{_score_table(section, root)}</details>"


def _has_people(row: SequenceScores) -> bool:
    return math.isfinite(row.scores["HOTA"])


def _link(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def _score_table(section: ResultSection, root: Path) -> str:
    keys = [key for key in SHOWN if any(math.isfinite(row.scores[key]) for row in section.rows)]
    rows = []
    for row, page, name in zip(section.rows, section.pages, section.names, strict=True):
        link = f'<a href="{escape(_link(page, root))}">{escape(name)}</a>'
        rows.append(_cells("td", [link, *(number(key, row.scores[key]) for key in keys)]))
    head = "<tr><th>sequence</th>" + "".join(map(_heading, keys)) + "</tr>"
    foot = ""
    if len({row.sequence for row in section.rows}) > 1:
        means = summary(section.rows)
        ends = [_interval(key, means[key]) for key in keys]
        foot = f"<tfoot>{_cells('td', ['mean<br><small>95 % interval</small>', *ends])}</tfoot>"
    table = f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody>{foot}</table>"
    return f'<div class="wide">{table}</div>'


def _heading(key: str) -> str:
    score = CATALOGUE[key]
    unit = f" [{score.unit}]" if score.unit not in ("1", "count") else ""
    return f'<th title="{escape(score.meaning)}">{escape(arrow(key))}{unit}</th>'


def _interval(key: str, mean: dict[str, float]) -> str:
    low, high = number(key, mean["low"], mean=True), number(key, mean["high"], mean=True)
    return f"{number(key, mean['mean'], mean=True)}<br><small>{low} to {high}</small>"


def _cells(tag: str, cells: list[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{cell}</{tag}>" for cell in cells) + "</tr>"


SCENES = ("merge", "split", "cross", "queue", "party", "mixed")
SEEDS = range(40_000, 40_002)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
QUICK_TRACKERS = ("blob", "group-pda")  # one that reports people, one that reports groups
PIXEL_SCENE, PIXEL_SEED = "split", range(40_000, 40_001)  # The scene that is rendered and tracked from its pictures.

QUICK_PIXEL_SETTINGS = ("camera.fps=5", "camera.image=[480,360]")  # What --quick changes in that scene.


@dataclass(frozen=True, eq=False)
class _TrackJob:
    tracker: str
    detections: DetectionMode
    folders: list[Path]  # of sequences
    out: Path  # a run is written into the folder of this that has its sequence's name
    overlay: Path | None = None  # where to draw tracks over the last sequence's pictures


def demo(options: DemoOptions) -> CommandResult:
    """Writes simulated scenes, tracks and pages into the folder --out; scenes that are already there are kept."""
    from sim.dataset.generate import generate
    from sim.io.files.atomic import write_file
    from sim.io.files.own_files import refuse_foreign_file
    from sim.io.source import open_source
    from sim.workers.pool import WorkerOptions

    start, out, quick = time.monotonic(), options.out, options.quick
    refuse_foreign_file(option_parsing.output_folder(out) / "index.html")
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
        sequences = [open_source(folder)[0] for folder in folders]
        trackers = QUICK_TRACKERS if quick else tracker_registry.names()
        of_pixels = QUICK_TRACKERS[:1] if quick else [n for n in trackers if "pixels" in tracker_registry.find(n).needs]
        image_jobs = [
            _TrackJob(name, "image", [rendered], out / "tracks" / f"{name}-image", _pictures(out) / f"{name}.mp4")
            for name in of_pixels
        ]
        half = len(trackers) // 2
        file_jobs = [
            _TrackJob(name, "file", folders, out / "tracks" / name) for name in (*trackers[half:], *trackers[:half])
        ]
        # Neighbours are of different trackers: two that run at once need not compile the same.
        jobs = [job for two in zip_longest(image_jobs, file_jobs) for job in two if job is not None]
        runs = _run(jobs, workers, tracked)
    from_points, from_pixels = (
        {j.tracker: runs[j] for j in jobs if j.detections == mode} for mode in ("file", "image")
    )
    scene = _pixel_scene(open_source(rendered)[0], from_pixels, out)
    inputs = {name: _input_word(name) for name in trackers}
    words = sorted({*inputs.values()}, reverse=True)
    tables = [_table(word, sequences, {n: from_points[n] for n in trackers if inputs[n] == word}) for word in words]
    sections = [_section(name, table, sequences, from_points, out) for table in tables for name in table.compared.runs]
    page = out / "index.html"
    write_file(page, demo_page(out, scene, tables, sections).encode())
    text = [f"{len(sequences)} sequences in {folders[0].parent}", *(_line(s.title, s.rows) for s in sections)]
    alone = zip(scene.section.names, scene.section.rows, strict=True)
    text += [f"one sequence with pictures, {rendered}", *(_line(name, [row]) for name, row in alone)]
    text += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    data = {section.title: summary(section.rows) for section in sections}
    return CommandResult({"sequences": len(sequences), "scores": data, "page": page}, "\n".join(text))


@contextmanager
def _compiled_ahead() -> Iterator[Callable[[_TrackJob], list[TrackingRun]]]:
    """Compiles the kernels of QUICK_TRACKERS in another process; yields `_tracked`, which waits for those that it
    needs."""
    from sim.workers.pool import WorkerProcess

    worker = WorkerProcess()
    # With one processor it would only take longer: the process imports everything again.
    compiling = list(QUICK_TRACKERS) if (os.cpu_count() or 1) > 1 else []

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


def _run(
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


def _table(word: str, sequences: list[Sequence], runs: Mapping[str, list[TrackingRun]]) -> RankingTable:
    compared = compare(sequences, runs)
    return RankingTable(f"Trackers from {word}", compared, usual_key(compared))


def _pictures(out: Path) -> Path:
    return out / "pages" / "pictures"


def _pixel_scene(sequence: Sequence, runs: Mapping[str, list[TrackingRun]], out: Path) -> PixelScene:
    from tracking.app.replay_page.video import page_video

    folder = _pictures(out)
    video = page_video(sequence, output_path(folder, sequence.name, ".html"), "beside")
    compared = compare([sequence], runs)
    section = ResultSection(f"{sequence.name}, from its pictures")
    for tracker, (run,) in runs.items():
        row, page = SequenceScores(sequence.name, compared.scores[tracker][0]), folder / f"{tracker}-image.html"
        _write_page(f"{tracker} from pixels", sequence, run, row, page, video)
        section.add(row, page, tracker)
    frames = sequence.length or 0
    return PixelScene(section, {name: folder / f"{name}.mp4" for name in runs}, frames, frames / sequence.fps)


def _input_word(tracker: str) -> str:
    return "boxes" if "boxes" in tracker_registry.find(tracker).needs else "points"


def _section(
    tracker: str, table: RankingTable, sequences: list[Sequence], runs: Mapping[str, list[TrackingRun]], out: Path
) -> ResultSection:
    section = ResultSection(f"{tracker}, from {_input_word(tracker)}")
    for sequence, run, scores in zip(sequences, runs[tracker], table.compared.scores[tracker], strict=True):
        row, page = SequenceScores(sequence.name, scores), output_path(out / "pages" / tracker, sequence.name, ".html")
        _write_page(tracker, sequence, run, row, page, None)
        section.add(row, page, sequence.name)
    return section


def _write_page(
    name: str, sequence: Sequence, run: TrackingRun, row: SequenceScores, page: Path, video: PageVideo | None
) -> None:
    from tracking.app.replay_page.page import Run, write_page

    write_page(sequence, Run(run), page, row.scores, f"{name} on {sequence.name}", video)


def _line(title: str, rows: list[SequenceScores]) -> str:
    means = summary(rows)
    return f"{printable(title)}: " + ", ".join(
        f"{key} {number(key, means[key]['mean'], mean=True)}" for key in SHOWN if math.isfinite(means[key]["mean"])
    )
