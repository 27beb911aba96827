"""`flockscope demo`: generates scenes, tracks them with every tracker, scores the tracks and writes pages to open."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

from scenarios.printable import printable
from sim.io.files.output_paths import output_path
from sim.types import DetectionMode, Sequence
from tracking import tracker_registry
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.commands.demo_page import PixelScene, ResultSection, demo_page
from tracking.app.commands.score import score_run, summary
from tracking.app.commands.score_tables import SHOWN, SequenceScores, number
from tracking.app.commands.track import TrackerSetup
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.video import PageVideo
from tracking.run import TrackingRun

SCENES = ("merge", "split", "cross", "pass-by", "queue", "side-by-side", "party", "mixed")
SEEDS = range(40_000, 40_003)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
PIXEL_SCENE, PIXEL_SEED = "split", range(40_000, 40_001)
"""The scene that is rendered and tracked from its pictures."""

QUICK_PIXEL_SETTINGS = ("camera.fps=5",)
"""What --quick changes in that scene."""

MODES: tuple[DetectionMode, ...] = ("image", "file")


def demo(out: Path, *, quick: bool) -> CommandResult:
    """Writes simulated scenes, tracks and pages into the folder `out`; scenes that are already there are kept.

    quick: one short scene and one seed, else eight scenes and three seeds. One scene more is rendered and tracked from
    its pictures. The result's data: "sequences" (number, without the rendered one), "scores" (mean scores with
    intervals, by tracker and input) and "page", the path of the page to open.

    Raises InputError if `out` is a file, cannot be written or holds sequences of other scenarios or files of others
    that would be replaced; WorkError if the disk is full.
    """
    from sim.dataset.generate import generate
    from sim.io.files.atomic import write_file
    from sim.io.files.own_files import refuse_foreign_file
    from sim.io.source import open_source
    from sim.workers.start import WorkerOptions

    start = time.monotonic()
    refuse_foreign_file(option_parsing.output_folder(out) / "index.html")
    names, seeds = (QUICK_SCENES, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    with ProgressMeter("generate") as meter:
        workers = WorkerOptions(1 if quick else os.cpu_count() or 1)
        folders = generate(names, seeds, out / "data", workers=workers, progress=meter.update, streams=())
        settings = QUICK_PIXEL_SETTINGS if quick else ()
        (rendered,) = generate(
            [PIXEL_SCENE], PIXEL_SEED, out / "pictures", set=settings, streams=("left",), images="mp4"
        )  # fmt: skip
    sequences = [open_source(folder)[0] for folder in folders]
    trackers = tracker_registry.names()
    with ProgressMeter("track, score, draw", len(sequences) * len(trackers)) as meter:
        scene = _pixel_scene(open_source(rendered)[0], out)
        sections = [_section(tracker, sequences, out, meter) for tracker in trackers]
    page = out / "index.html"
    write_file(page, demo_page(out, scene, sections).encode())
    text = [f"{len(sequences)} sequences in {folders[0].parent}", *(_line(s.title, s.rows) for s in sections)]
    alone = zip(scene.section.names, scene.section.rows, strict=True)
    text += [f"one sequence with pictures, {rendered}", *(_line(name, [row]) for name, row in alone)]
    text += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    data = {section.title: summary(section.rows) for section in sections}
    return CommandResult({"sequences": len(sequences), "scores": data, "page": page}, "\n".join(text))


def _pixel_scene(sequence: Sequence, out: Path) -> PixelScene:
    """Tracks one sequence from its pictures and from its stored detections; returns scores, pages and videos.

    Every tracker that takes pixels runs in both ways. Tracks, replay pages and overlay videos of the tracks from
    pictures are written into `out`. All replays share one video file. Raises InputError if a file cannot be read or
    written, WorkError if the disk is full.
    """
    from tracking.app.pictures.overlay import write_overlay
    from tracking.app.replay_page.video import page_video

    folder = out / "pages" / "pictures"
    video = page_video(sequence, output_path(folder, sequence.name, ".html"), "beside")
    section, overlays = ResultSection(f"{sequence.name}, from its pictures"), {}
    for tracker in [name for name in tracker_registry.names() if "pixels" in tracker_registry.find(name).needs]:
        for mode in MODES:
            run = TrackerSetup(tracker, detections=mode).run(sequence)
            row, name = score_run(sequence, run), f"{tracker} from {_input_word(tracker, mode)}"
            page = folder / f"{tracker}-{mode}.html"
            run.write(output_path(out / "tracks" / f"{tracker}-{mode}", sequence.name), sequence)
            _write_page(name, sequence, run, row, page, video)
            section.add(row, page, name)
            if mode == "image":
                overlays[tracker] = write_overlay(sequence, run, folder / f"{tracker}.mp4", "over")
    frames = sequence.length or 0
    return PixelScene(section, overlays, frames, frames / sequence.fps)


def _input_word(tracker: str, mode: DetectionMode) -> str:
    """Returns what the tracker gets in this mode: "pixels" in mode "image", else "boxes" if it takes boxes, else
    "points".

    tracker: name; InputError if unknown.
    """
    return "pixels" if mode == "image" else "boxes" if "boxes" in tracker_registry.find(tracker).needs else "points"


def _section(tracker: str, sequences: list[Sequence], out: Path, meter: ProgressMeter) -> ResultSection:
    """Tracks all sequences with one tracker from the detections that it takes by default; returns scores and pages.

    Writes tracks and replay pages into `out`. meter: advanced by one for each sequence. The title names stored
    detections. Raises InputError if a file cannot be read or written, WorkError if the disk is full.
    """
    section = ResultSection(f"{tracker}, from {_input_word(tracker, 'file')}")
    for sequence in sequences:
        run = TrackerSetup(tracker).run(sequence)
        row = score_run(sequence, run)
        page = output_path(out / "pages" / tracker, sequence.name, ".html")
        run.write(output_path(out / "tracks" / tracker, sequence.name), sequence)
        _write_page(tracker, sequence, run, row, page, None)
        section.add(row, page, sequence.name)
        meter.step(f"{tracker} on {sequence.name}")
    return section


def _write_page(
    name: str, sequence: Sequence, run: TrackingRun, row: SequenceScores, page: Path, video: PageVideo | None
) -> None:
    from tracking.app.replay_page.page import write_page

    write_page(sequence, run, page, row.scores, f"{name} on {sequence.name}", video)


def _line(title: str, rows: list[SequenceScores]) -> str:
    """Returns "title: " and the means over `rows` of the SHOWN scores that are known, in one line. rows: at
    least one."""
    means = summary(rows)
    return f"{printable(title)}: " + ", ".join(
        f"{key} {number(key, means[key]['mean'], mean=True)}" for key in SHOWN if math.isfinite(means[key]["mean"])
    )
