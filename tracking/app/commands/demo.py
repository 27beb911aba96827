"""`flockscope demo`: the main job from start to finish: scenes, tracks of every tracker, scores, pages to open."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

from sim.types import DetectionMode, Sequence
from tracking import tracker_registry
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.commands.demo_page import Part, Seen, page
from tracking.app.commands.score import Row, score_run, summary
from tracking.app.commands.score_tables import SHOWN, number
from tracking.app.commands.track import Job
from tracking.app.progress import ProgressMeter
from tracking.app.replay_page.video import Film
from tracking.run import TrackingRun

SCENES = ("merge", "split", "cross", "pass-by", "queue", "side-by-side", "party", "mixed")
SEEDS = range(40_000, 40_003)
QUICK, QUICK_SEEDS = ("quick",), range(40_000, 40_001)
SEEN, SEEN_SEED = "split", range(40_000, 40_001)
SEEN_QUICKLY = ("camera.fps=5",)
"""The scene that is drawn, and what --quick changes of it."""

MODES: tuple[DetectionMode, ...] = ("image", "file")


def demo(out: Path, *, quick: bool) -> CommandResult:
    """Everything into `out`; the answer ends with the path of the page to open."""
    from sim.dataset.generate import generate
    from sim.io.files.atomic import write_file
    from sim.io.source import open_source
    from sim.workers.start import WorkerOptions

    start = time.monotonic()
    option_parsing.folder(out)
    names, seeds = (QUICK, QUICK_SEEDS) if quick else (SCENES, SEEDS)
    with ProgressMeter("generate") as meter:
        workers = WorkerOptions(1 if quick else os.cpu_count() or 1)
        folders = generate(names, seeds, out / "data", workers=workers, progress=meter.update, streams=())
        how = SEEN_QUICKLY if quick else ()
        (drawn,) = generate([SEEN], SEEN_SEED, out / "pictures", set=how, streams=("left",), images="mp4")
    sequences = [open_source(folder)[0] for folder in folders]
    with ProgressMeter("track, score, draw", len(sequences) * len(tracker_registry.names())) as meter:
        seen = _seen(open_source(drawn)[0], out)
        parts = [_part(tracker, sequences, out, meter) for tracker in tracker_registry.names()]
    write_file(out / "index.html", page(out, seen, parts).encode())
    text = [f"{len(sequences)} sequences in {folders[0].parent}", *(_line(part.title, part.rows) for part in parts)]
    alone = zip(seen.part.names, seen.part.rows, strict=True)
    text += [f"one drawn, {drawn}", *(_line(name, [row]) for name, row in alone)]
    text += [f"{time.monotonic() - start:.0f} s; open this page:", str((out / "index.html").resolve())]
    data = {part.title: summary(part.rows) for part in parts}
    return CommandResult({"sequences": len(sequences), "scores": data, "page": out / "index.html"}, "\n".join(text))


def _seen(sequence: Sequence, out: Path) -> Seen:
    """One scene from its pixels and from what a detector found, replays over one and the same video, and overlays."""
    from tracking.app.pictures.overlay import overlay
    from tracking.app.replay_page.video import film

    folder = out / "pages" / "pictures"
    video = film(sequence, folder / f"{sequence.name}.html", "beside")
    part, films = Part(f"{sequence.name}, from its pictures", [], [], []), {}
    for tracker in [name for name in tracker_registry.names() if "pixels" in tracker_registry.find(name).needs]:
        for mode in MODES:
            run = Job(tracker, detections=mode).run(sequence)
            row, name = score_run(sequence, run), f"{tracker} from {_input(tracker, mode)}"
            place = folder / f"{tracker}-{mode}.html"
            _store(name, sequence, run, row, out / "tracks" / f"{tracker}-{mode}", place, video)
            part.rows.append(row)
            part.pages.append(place)
            part.names.append(name)
            if mode == "image":
                films[tracker] = overlay(sequence, run, folder / f"{tracker}.mp4", "over")
    frames = sequence.length or 0
    return Seen(part, films, frames, frames / sequence.fps)


def _input(tracker: str, mode: DetectionMode) -> str:
    """What it is given, in a word."""
    return "pixels" if mode == "image" else "boxes" if "boxes" in tracker_registry.find(tracker).needs else "points"


def _part(tracker: str, sequences: list[Sequence], out: Path, meter: ProgressMeter) -> Part:
    part = Part(f"{tracker}, from {_input(tracker, 'file')}", [], [], [])
    for sequence in sequences:
        run = Job(tracker).run(sequence)
        row = score_run(sequence, run)
        place = out / "pages" / tracker / f"{sequence.name}.html"
        _store(tracker, sequence, run, row, out / "tracks" / tracker, place, None)
        part.rows.append(row)
        part.pages.append(place)
        part.names.append(sequence.name)
        meter.step(f"{tracker} on {sequence.name}")
    return part


def _store(
    who: str, sequence: Sequence, run: TrackingRun, row: Row, tracks: Path, place: Path, video: Film | None
) -> None:
    """The tracks as files and as a page."""
    from sim.io.store.track_files import write_tracks
    from tracking.app.replay_page.page import view

    folder = tracks / sequence.name
    write_tracks(folder, run, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene, info=run.info)
    view(sequence, run, place, row.scores, f"{who} on {sequence.name}", video)


def _line(title: str, rows: list[Row]) -> str:
    means = summary(rows)
    return f"{title}: " + ", ".join(
        f"{key} {number(key, means[key]['mean'], mean=True)}" for key in SHOWN if math.isfinite(means[key]["mean"])
    )
