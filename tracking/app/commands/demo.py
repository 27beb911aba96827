"""`flockscope demo`: generates scenes, tracks them, scores the tracks and writes pages to open.

The first page has videos of one scene, and tables of scores that link to replays.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from html import escape
from itertools import zip_longest
from pathlib import Path

from scenarios.errors import counted
from sim.store.own_files import GENERATOR, address, output_path
from sim.types import DetectionMode, Sequence
from tracking.app.command_options import DemoOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.score_ranking import COLUMNS, interval, rank_words, shown_columns, usual_key, verdict
from tracking.app.score_tables import SIMILARITY, number, table
from tracking.app.tracker_setup import TrackerSetup
from tracking.comparison import ComparedRuns, compare
from tracking.running import tracker_registry
from tracking.running.run import TrackingRun
from tracking.scoring.catalogue import CATALOGUE

SCENES = ("merge", "split", "cross", "queue")
SEEDS = range(40_000, 40_002)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
QUICK_TRACKERS = ("blob", "group-pda")  # one that reports people, one that reports groups
PIXEL_SCENE, PIXEL_SEED = "split", range(40_000, 40_001)  # The scene that is rendered and tracked from its pictures.

PIXEL_SETTINGS = ("duration=12",)  # The group has split by then.
QUICK_PIXEL_SETTINGS = ("camera.fps=5", "camera.image=[480,360]")

VIDEO = """<figure><video src="{video}#t={start:.1f}" controls muted loop playsinline preload="metadata"></video>
<figcaption><a href="{page}"><code>{tracker}</code></a></figcaption></figure>"""

Runs = Mapping[str, list[TrackingRun]]  # By tracker, the run of each sequence.


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
    from sim.store.atomic import write_file
    from sim.store.own_files import refuse_foreign_file
    from tracking.app.replay_page.page import theme
    from tracking.recordings.source import open_source

    start, out, quick = time.monotonic(), options.out, options.quick
    page = out / "index.html"
    refuse_foreign_file(page)
    names, seeds = (QUICK_SCENES, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    settings = QUICK_PIXEL_SETTINGS if quick else PIXEL_SETTINGS
    with _compiled_ahead() as compiled:
        with ProgressMeter("generate") as meter:
            folders = generate(names, seeds, out / "data", progress=meter.update, streams=())
            (rendered,) = generate(
                [PIXEL_SCENE], PIXEL_SEED, out / "pictures", set=settings, streams=("left",), images="mp4"
            )  # fmt: skip
        trackers = QUICK_TRACKERS if quick else tracker_registry.names()
        jobs = _jobs(out, trackers, folders, rendered, quick)
        runs = _runs(compiled(jobs), len(jobs), 1 if quick else os.cpu_count() or 1)
    sequences, scenes = [open_source(folder)[0] for folder in folders], open_source(rendered)
    given: dict[str, dict[str, list[TrackingRun]]] = {"points": {}, "boxes": {}, "pixels": {}}
    for job in sorted(runs, key=lambda job: trackers.index(job.tracker)):
        of_boxes = "points" not in tracker_registry.find(job.tracker).needs
        given["pixels" if job.overlay else "boxes" if of_boxes else "points"][job.tracker] = runs[job]
    parts, cells = list[str](), list[list[str]]()
    for word, found in given.items():
        of = scenes if word == "pixels" else sequences
        compared = compare(of, found)
        key = usual_key(compared)
        pages = _replays(of, found, out / "pages" / word)
        parts += [f"<h2>Trackers from {word}</h2>", _ranking(compared, key), _scenes(compared, key, pages, out)]
        rows = (row for row in compared.to_arrow(key).to_pylist() if row["first"] is not None)
        cells += [[f"{row['run']}, from {word}", *(number(k, row[k]) for k in COLUMNS)] for row in rows]
    frames = scenes[0].length or 0
    films = "".join(
        VIDEO.format(
            video=escape(f"pages/pixels/{name}.mp4"), start=0.4 * frames / scenes[0].fps, tracker=name,
            page=address(page.relative_to(out)),
        ) for name, (page,) in pages.items()
    )  # fmt: skip
    text = Path(__file__).with_name("demo_page.html").read_text(encoding="utf-8")
    words = {"GENERATOR": GENERATOR, "STYLE": theme(), "FRAMES": str(frames), "PARTS": "\n".join(parts), "FILMS": films}
    words["MEANINGS"] = "".join(f"<dt>{k}</dt><dd>{escape(CATALOGUE[k].meaning)}</dd>" for k in ("objective", *COLUMNS))
    write_file(page, re.sub("@@([A-Z]+)@@", lambda found: words[found[1]], text).encode())
    lines = [table("", ["tracker"], COLUMNS, cells)]
    lines += [f"{counted(len(sequences), 'sequence')} in {folders[0].parent}; one with pictures, {rendered}"]
    lines += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    return CommandResult({"sequences": len(sequences), "page": page}, "\n".join(lines))


def _jobs(out: Path, trackers: Iterable[str], folders: list[Path], rendered: Path, quick: bool) -> list[_TrackJob]:
    names, pictures, tracks = [*trackers], out / "pages" / "pixels", out / "tracks"
    of_pixels = names[:1] if quick else [name for name in names if "pixels" in tracker_registry.find(name).needs]
    image_jobs = [
        _TrackJob(name, "image", [rendered], tracks / f"{name}-image", pictures / f"{name}.mp4") for name in of_pixels
    ]
    file_jobs = [_TrackJob(name, "file", folders, tracks / name) for name in reversed(names)]
    # Neighbours are of different trackers: two that run at once need not compile the same.
    return [job for two in zip_longest(image_jobs, file_jobs) for job in two if job is not None]


def _runs(jobs: Iterable[_TrackJob], count: int, workers: int) -> dict[_TrackJob, list[TrackingRun]]:
    from sim.workers.start import start_workers

    runs = {}
    with ProgressMeter("track", count) as meter, start_workers(workers) as run:
        for job, found in run(_tracked, jobs):
            runs[job] = found
            meter.step(f"{job.tracker}{' from pixels' if job.overlay else ''}")
    return runs


def _tracked(job: _TrackJob) -> list[TrackingRun]:
    from tracking.app.pictures.overlay import write_overlay
    from tracking.recordings.source import open_source

    runs = []
    for folder in job.folders:
        (sequence,) = open_source(folder)
        runs.append(TrackerSetup(job.tracker, detections=job.detections).run(sequence))
        runs[-1].write(output_path(job.out, sequence.name), sequence)
    if job.overlay is not None:
        write_overlay(sequence, runs[-1], job.overlay, "over")
    return runs


@contextmanager
def _compiled_ahead() -> Iterator[Callable[[Iterable[_TrackJob]], Iterator[_TrackJob]]]:
    """Compiles the kernels of QUICK_TRACKERS in another process; yields a function that yields jobs, each when those
    that it needs are compiled."""
    from concurrent.futures import wait

    from sim.workers.pool import WorkerProcess

    # With one processor it would only take longer, as the process imports everything again.
    ahead = QUICK_TRACKERS if (os.cpu_count() or 1) > 1 else ()

    def compiled(jobs: Iterable[_TrackJob]) -> Iterator[_TrackJob]:
        for job in jobs:
            wait(compiling.get(job.tracker, ()))
            yield job

    with closing(WorkerProcess()) as worker:
        compiling = {tracker: [worker.submit(_compile, tracker)] for tracker in ahead}
        yield compiled


def _compile(tracker: str) -> None:
    pixels = "pixels" in tracker_registry.find(tracker).needs
    TrackerSetup(tracker, detections="image" if pixels else "file").run(_made_up_people())


def _made_up_people() -> Sequence:
    """Returns pictures of people, and points of two people side by side and one apart, all that a tracker needs to call
    its kernels, with the types of simulated sequences."""
    import numpy as np

    from sim.scene.camera import camera_rotation, px_per_m_at_centre
    from sim.types import Camera, Detections, Frame, Image

    wide, high, fps, r = 320, 240, 5.0, np.random.default_rng(0)
    pose = np.array([0.0, -10.0, 6.0]), camera_rotation(0.6, 0.0)
    camera = Camera("pinhole", (wide, high), (250.0, 250.0), (wide / 2, high / 2), *pose)
    ground = r.integers(90, 170, (high, wide, 1))

    def picture(*lefts: int) -> Image:
        image = ground + r.normal(0.0, 2.0, (high, wide, 3))
        for left in lefts:
            image[80:118, left : left + 10] = 20, 20, 150
        made: Image = image.clip(0, 255).astype(np.uint8)
        made.setflags(write=False)
        return made

    def frames() -> Iterator[Frame]:
        for k in range(16):
            pos = np.array([[k / 3 - 3.0, 0.0], [k / 3 - 2.75, 0.0], [3.0 - k / 3, 2.0]])
            lefts = 90 + 7 * k, 230 - 7 * k, *(20, 30, 40) * (k > 7)  # the last three touch: new people in one blob
            yield Frame(k + 1, k / fps, picture(*lefts), None, Detections(k + 1, k / fps, "ground", pos))

    return Sequence(
        "made-up", fps, 16, frames, image_size=camera.image, camera=camera, has_images=True, has_detections=True,
        px_per_m=px_per_m_at_centre(camera), load_background=lambda: np.stack([picture() for _ in range(12)]),
    )  # fmt: skip


def _replays(sequences: list[Sequence], runs: Runs, folder: Path) -> dict[str, list[Path]]:
    """Writes a replay page for each run; pages of one sequence share the video beside them."""
    from tracking.app.replay_page.page import Run, write_page
    from tracking.app.replay_page.video import page_video

    videos = [page_video(one, output_path(folder, one.name, ".html"), "beside") for one in sequences]
    pages = {}
    for name, found in runs.items():
        each = zip(sequences, found, videos, strict=True)
        pages[name] = [write_page(one, [Run(run)], folder / f"{name}-{one.name}.html", film) for one, run, film in each]
    return pages


def _ranking(compared: ComparedRuns, key: str) -> str:
    entries = compared.to_arrow(key).to_pylist()
    keys = shown_columns(entries, key)
    rows = []
    for e in entries:
        name, mean = escape(e["run"]), f"{number(key, e['mean'], mean=True)}<br><small>{interval(key, e)}</small>"
        rows.append([name if e["first"] else f"<em>{name}</em>", rank_words(e), mean])
        rows[-1] += [number(k, e[k], mean=True) for k in keys]
    words = "; ".join(verdict(compared, key))
    sure = f"<p><strong>Result:</strong> {escape(words)}.</p>" if words else ""
    by = f"people compared by {SIMILARITY[compared.similarity]}; small: 95 % interval"
    note = f"<p>{counted(len(compared.sequences), 'scene')}, {by}.</p>"
    return note + sure + _table(["<th>tracker</th>", "<th>rank</th>", *(f"<th>{k}</th>" for k in (key, *keys))], rows)


def _scenes(compared: ComparedRuns, key: str, pages: Mapping[str, list[Path]], root: Path) -> str:
    """Returns a table of the scores of all runs, which link to their replays."""
    rows = [[escape(name)] for name in compared.sequences]
    for name, own in pages.items():
        for row, page, scores in zip(rows, own, compared.scores[name], strict=True):
            row.append(f'<a href="{address(page.relative_to(root))}">{number(key, scores[key])}</a>')
    head = ["<th>sequence</th>", *(f"<th>{escape(name)}</th>" for name in pages)]
    return f"<details><summary>Replays, by {key}</summary>{_table(head, rows)}</details>"


def _table(head: list[str], rows: list[list[str]]) -> str:
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{"".join(head)}</tr></thead><tbody>{body}</tbody></table></div>'
