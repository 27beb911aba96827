"""`flockscope demo`: generates scenes, tracks them with every tracker, scores the tracks and writes pages to open."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from pathlib import Path

from scenarios.printable import printable
from sim.io.files.output_paths import output_path
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_options import DemoOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.demo_page import PixelScene, RankingTable, ResultSection, demo_page
from tracking.app.commands.score import summary
from tracking.app.commands.score_ranking import usual_key
from tracking.app.commands.score_tables import SHOWN, SequenceScores, number
from tracking.app.commands.track import TrackerSetup
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.video import PageVideo
from tracking.comparison import compare
from tracking.running import tracker_registry
from tracking.running.run import TrackingRun

SCENES = ("merge", "split", "cross", "pass-by", "queue", "side-by-side", "party", "mixed")
SEEDS = range(40_000, 40_003)
QUICK_SCENES, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
PIXEL_SCENE, PIXEL_SEED = "split", range(40_000, 40_001)  # The scene that is rendered and tracked from its pictures.

QUICK_PIXEL_SETTINGS = ("camera.fps=5",)  # What --quick changes in that scene.


def demo(options: DemoOptions) -> CommandResult:
    """Writes simulated scenes, tracks and pages into the folder --out; scenes that are already there are kept."""
    from sim.dataset.generate import generate
    from sim.io.files.atomic import write_file
    from sim.io.files.own_files import refuse_foreign_file
    from sim.io.source import open_source
    from sim.workers.start import WorkerOptions

    start, out, quick = time.monotonic(), options.out, options.quick
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
        runs = {name: _tracked(name, sequences, out, meter) for name in trackers}
    inputs = {name: _input_word(name) for name in trackers}
    words = sorted({*inputs.values()}, reverse=True)
    tables = [_table(word, sequences, {n: runs[n] for n in trackers if inputs[n] == word}) for word in words]
    sections = [_section(name, table, sequences, runs, out) for table in tables for name in table.compared.runs]
    page = out / "index.html"
    write_file(page, demo_page(out, scene, tables, sections).encode())
    text = [f"{len(sequences)} sequences in {folders[0].parent}", *(_line(s.title, s.rows) for s in sections)]
    alone = zip(scene.section.names, scene.section.rows, strict=True)
    text += [f"one sequence with pictures, {rendered}", *(_line(name, [row]) for name, row in alone)]
    text += [f"{time.monotonic() - start:.0f} s; open this page:", str(page.resolve())]
    data = {section.title: summary(section.rows) for section in sections}
    return CommandResult({"sequences": len(sequences), "scores": data, "page": page}, "\n".join(text))


def _table(word: str, sequences: list[Sequence], runs: Mapping[str, list[TrackingRun]]) -> RankingTable:
    compared = compare(sequences, runs)
    return RankingTable(f"Trackers from {word}", compared, usual_key(compared))


def _pixel_scene(sequence: Sequence, out: Path) -> PixelScene:
    from tracking.app.pictures.overlay import write_overlay
    from tracking.app.replay_page.video import page_video

    folder = out / "pages" / "pictures"
    video = page_video(sequence, output_path(folder, sequence.name, ".html"), "beside")
    names = [name for name in tracker_registry.names() if "pixels" in tracker_registry.find(name).needs]
    runs = {name: TrackerSetup(name, detections="image").run(sequence) for name in names}
    compared = compare([sequence], {name: [run] for name, run in runs.items()})
    section, overlays = ResultSection(f"{sequence.name}, from its pictures"), {}
    for tracker, run in runs.items():
        row, page = SequenceScores(sequence.name, compared.scores[tracker][0]), folder / f"{tracker}-image.html"
        run.write(output_path(out / "tracks" / f"{tracker}-image", sequence.name), sequence)
        _write_page(f"{tracker} from pixels", sequence, run, row, page, video)
        section.add(row, page, tracker)
        overlays[tracker] = write_overlay(sequence, run, folder / f"{tracker}.mp4", "over")
    frames = sequence.length or 0
    return PixelScene(section, overlays, frames, frames / sequence.fps)


def _input_word(tracker: str) -> str:
    return "boxes" if "boxes" in tracker_registry.find(tracker).needs else "points"


def _tracked(tracker: str, sequences: list[Sequence], out: Path, meter: ProgressMeter) -> list[TrackingRun]:
    runs = []
    for sequence in sequences:
        run = TrackerSetup(tracker, detections="file").run(sequence)
        run.write(output_path(out / "tracks" / tracker, sequence.name), sequence)
        runs.append(run)
        meter.step(f"{tracker} on {sequence.name}")
    return runs


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
    from tracking.app.replay_page.page import write_page

    write_page(sequence, run, page, row.scores, f"{name} on {sequence.name}", video)


def _line(title: str, rows: list[SequenceScores]) -> str:
    means = summary(rows)
    return f"{printable(title)}: " + ", ".join(
        f"{key} {number(key, means[key]['mean'], mean=True)}" for key in SHOWN if math.isfinite(means[key]["mean"])
    )
