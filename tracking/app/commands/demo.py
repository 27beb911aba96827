"""`flockscope demo`: generates scenes, tracks them, scores the tracks and writes a page to open.

The page opens with a replay of the best and the worst tracker on a scene with pictures; the report on all runs follows.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from collections.abc import Sequence as SequenceOf
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

import cv2
import numpy as np

from scenarios.errors import counted
from sim.store.own_files import output_path
from sim.types import DetectionMode, Sequence
from sim.workers.calls import RunItems
from tracking.app.command_options import DemoOptions
from tracking.app.command_result import CommandResult
from tracking.app.pictures.contact_sheet import frame_pictures
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.page import Run, page_data, page_html, script_json, write_page
from tracking.app.replay_page.video import page_video
from tracking.app.report.content import Curves, HeatCell, Json, Opening
from tracking.app.report.moments import data_address, dearest_error
from tracking.app.report.of_runs import JudgedRuns, judge, report_of_runs
from tracking.app.score_ranking import COLUMNS
from tracking.app.score_tables import number, table
from tracking.app.scored_sequence import read_runs, scoring_jobs
from tracking.app.tracker_setup import TrackerSetup
from tracking.running import tracker_registry
from tracking.stats import mean_of_finite

REPLAY = "replay.html"
SCENES = ("merge", "split", "cross", "queue")
SEEDS = range(40_000, 40_002)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
QUICK_TRACKERS = ("blob", "group-pda")  # one that reports people, one that reports groups
SWEEP_VALUES, SWEEP_SETTINGS = 4, ("camera.fps=5", "duration=12")

# The scene that is drawn, and tracked from its pictures, too: light ground, varied clothes, people who come near.
PIXEL_SCENE, PIXEL_SEED = "merge", range(40_017, 40_018)
NEAR = ("duration=10", "camera.tilt_deg=18", "picture.texture=0.3", "sensor.detect_prob=0.8")
PIXEL_SETTINGS = (*NEAR, "camera.image=[640,360]")
QUICK_PIXEL_SETTINGS = (*NEAR, "camera.image=[480,270]", "camera.fps=5")
PIXELS = f"{PIXEL_SCENE} from pixels"

DRAWING, TRACKING = 6, 4  # times as long as another step
BEFORE = 2.5  # s from the start of the replay to the dearest error
STILL_WIDTH = 1200  # px

ABOUT = (
    "Scenes in which groups merge, split, cross and queue were simulated, tracked and scored. Trackers that share a "
    "rank have no sure difference. The oracle has true ids on the same input; it fills no gaps, so trackers that do "
    "may score more. A dash: nothing to score, as people of a tracker that reports groups."
)


@dataclass(frozen=True, eq=False)
class _TrackJob:
    tracker: str
    detections: DetectionMode
    folders: list[Path]  # of sequences
    out: Path  # a run is written into the folder of this that has its sequence's name


def demo(options: DemoOptions) -> CommandResult:
    """Writes simulated scenes, tracks and pages into the folder --out; scenes that are already there are kept."""
    from sim.dataset.generate import generate
    from sim.store.own_files import refuse_foreign_file
    from sim.workers.start import results_in_order, start_workers
    from tracking.app.report.page import check_packages, write_report
    from tracking.recordings.source import open_source

    start, out, quick = time.monotonic(), options.out, options.quick
    page = out / "index.html"
    check_packages()
    for file in (page, out / REPLAY):
        refuse_foreign_file(file)
    trackers = list(QUICK_TRACKERS if quick else tracker_registry.names())
    of_pixels = [name for name in trackers if "pixels" in tracker_registry.find(name).needs][: 1 if quick else 3]
    scenes, seeds = (QUICK_SCENES, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    settings = QUICK_PIXEL_SETTINGS if quick else PIXEL_SETTINGS
    with (
        _compiled_ahead() as compiled, start_workers(1 if quick else os.cpu_count() or 1) as run,
        ProgressMeter("demo") as meter,
    ):  # fmt: skip
        count = len(SCENES) * len(seeds)
        meter.total = count * 2 + DRAWING + 2 + TRACKING * (len(trackers) + len(of_pixels))
        meter.total += SWEEP_VALUES * len(SEEDS) * len(trackers)
        folders = generate(scenes, seeds, out / "data", progress=lambda *_: meter.step("simulate"), streams=())
        folders += generate(
            [PIXEL_SCENE], PIXEL_SEED, out / "pictures", set=settings, streams=("left",), images="mp4"
        )  # fmt: skip
        meter.step("draw", DRAWING)
        for job, _ in run(_tracked, compiled(_jobs(out, trackers, of_pixels, folders))):
            meter.step(f"track {job.tracker}", TRACKING)
        tasks = [(folder, [out / "tracks" / name for name in trackers]) for folder in folders]
        tasks.append((folders[-1], [out / "tracks" / f"{name}-image" for name in of_pixels]))
        found = list[JudgedRuns]()
        for judged in results_in_order(run, _judged, tasks):
            found.append(judged)
            meter.step("score")
        sequences = [open_source(folder)[0] for folder in folders]
        report = report_of_runs(trackers, sequences, found[:-1], None, {})
        curves = _curves(trackers, report.by, run, out, meter.step)
    seen = replace(sequences[-1], name=f"{PIXELS}-s{PIXEL_SEED[0]}")
    pixels = report_of_runs(of_pixels, [seen], found[-1:], report.by, {})
    assert report.heat is not None
    columns, rows = report.heat.columns, report.heat.rows
    rows = {"all scenes": _cells(report.ranking, columns), **rows, PIXELS: _cells(pixels.ranking, columns)}
    ends = _best_and_worst(sequences[-1], found[-2], trackers, report.by)
    shown = replace(
        report, title=f"flockscope demo: {report.title}", about=ABOUT, heat=replace(report.heat, rows=rows),
        curves=curves, moments=[*report.moments, *pixels.moments], opening=_opening(sequences[-1], *ends, out),
    )  # fmt: skip
    write_report(shown, page)
    every = [row for row in (*report.ranking, *pixels.ranking) if row["first"] is not None]
    cells = [[f"{r['run']}, from {r['input'].split()[0]}", *(number(k, r[k]) for k in COLUMNS)] for r in every]
    lines = [table("", ["tracker"], COLUMNS, cells)]
    lines += [f"{counted(len(sequences), 'sequence')} in {folders[0].parent} and, with pictures, {folders[-1]}"]
    lines += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    return CommandResult({"sequences": len(sequences), "page": page}, "\n".join(lines))


def _jobs(out: Path, trackers: SequenceOf[str], of_pixels: Iterable[str], folders: list[Path]) -> list[_TrackJob]:
    tracks = out / "tracks"
    image_jobs = [_TrackJob(name, "image", folders[-1:], tracks / f"{name}-image") for name in of_pixels]
    file_jobs = [_TrackJob(name, "file", folders, tracks / name) for name in reversed(trackers)]
    # Neighbours are of different trackers: two that run at once need not compile the same.
    return [job for two in zip_longest(image_jobs, file_jobs) for job in two if job is not None]


def _tracked(job: _TrackJob) -> None:
    from tracking.recordings.source import open_source

    for folder in job.folders:
        (sequence,) = open_source(folder)
        run = TrackerSetup(job.tracker, detections=job.detections).run(sequence)
        run.write(output_path(job.out, sequence.name), sequence)


def _judged(task: tuple[Path, list[Path]]) -> JudgedRuns:
    """Returns the scores and errors on the sequence in a folder of the runs in other folders."""
    from tracking.recordings.source import open_source

    folder, runs = task
    (sequence,) = open_source(folder)
    (job,) = scoring_jobs(map(str, runs), [sequence], oracles=True)
    return judge(sequence, job)


def _curves(trackers: Iterable[str], by: str, run: RunItems, out: Path, step: Callable[[str], None]) -> Curves:
    """Plays the trackers with fewer and fewer detections and returns their mean scores."""
    from sim.workers.start import results_in_order
    from tracking.stress.axes import parse_axis
    from tracking.stress.scene_player import Store, contender, play_scene
    from tracking.stress.sweep import Plan, Sweep

    axis, unknown = parse_axis("detection"), [None] * SWEEP_VALUES
    plan = Plan((PIXEL_SCENE,), (axis,), tuple(SEEDS), len(SEEDS), by, 0.8, "file", SWEEP_SETTINGS)
    sweep = Sweep(
        plan, {name: contender(name) for name in trackers}, lambda scenes: results_in_order(run, play_scene, scenes),
        Store(out / "episodes.jsonl", fresh=True), step,
    )  # fmt: skip
    sweep.values, sweep.seeds = [(value,) for value in axis.spread(SWEEP_VALUES)], len(SEEDS)
    sweep.play_values()
    means = {name: [mean_of_finite(at) for at in sweep.scores(name).T] for name in (*trackers, sweep.oracle_names[0])}
    curves = {name: {"mean": mean, "low": unknown, "high": unknown, "break": None} for name, mean in means.items()}
    words = [f"Mean of {counted(len(SEEDS), 'scene')} of {PIXEL_SCENE}; so few give no interval."]
    return Curves(axis.name, axis.about, [value for (value,) in sweep.values], curves, {}, words)


def _cells(ranking: SequenceOf[Json], columns: Iterable[str]) -> list[HeatCell]:
    """Returns a row of the heat map, with the mean scores of a ranking."""
    best = {row["input"]: row["mean"] for row in ranking if row["first"] is None}
    cells = {row["run"]: HeatCell(row["mean"], best.get(row["input"], math.nan)) for row in ranking}
    return [cells.get(name, HeatCell(math.nan, math.nan, "not run")) for name in columns]


def _best_and_worst(
    sequence: Sequence, judged: JudgedRuns, trackers: SequenceOf[str], by: str
) -> tuple[list[Run], str, list[float]]:
    """Returns the runs with the highest and the lowest score on a sequence, the key of the score, and their scores. The
    score is HOTA if two or more runs have it, else `by`."""
    for key in ("HOTA", by):
        found = {k: s[key] for k, s in enumerate(judged.scored.scores) if math.isfinite(s[key])}
        if len(found) > 1:
            break
    ends = dict.fromkeys([max(found, key=found.__getitem__), min(found, key=found.__getitem__)])
    tracks = read_runs(sequence, replace(judged.job, sources=tuple(judged.job.sources[k] for k in ends)))
    runs = [Run(tracked, judged.errors[k].errors, trackers[k]) for k, tracked in zip(ends, tracks, strict=True)]
    return runs, key, [found[k] for k in ends]


def _opening(sequence: Sequence, runs: list[Run], key: str, scores: list[float], out: Path) -> Opening:
    """Writes the replay of a sequence with pictures, and returns it as the report's opening."""
    page = out / REPLAY
    video = page_video(sequence, page, "inside")
    assert video is not None
    write_page(sequence, runs, page, video)
    early = round(BEFORE * sequence.fps)
    dearest = dearest_error([error for error in runs[-1].errors if error.error.start > early])
    first = early + 1 if dearest is None else dearest.error.start
    data = page_data(sequence, runs, start=first - early)
    moment = min(first + round(sequence.fps), data["length"])
    picture = frame_pictures(sequence, [None, *(run.tracks for run in runs)], moment)
    size = STILL_WIDTH, round(len(picture) * STILL_WIDTH / picture.shape[1])
    still = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    title = f"Truth, {', '.join(run.tracker for run in runs)}"
    shown = script_json(data | {"video": video.facts(), "opening": True})
    html = page_html(title, shown, video.content, data_address(still))
    words = (
        f"{' and '.join(f'{run.tracker} ({key} {score:.2f})' for run, score in zip(runs, scores, strict=True))} follow "
        "two groups that merge. Solid: the truth. Dashed: the tracker. Red: an error, named below."
    )
    return Opening(words, html, page.name)


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
