"""`flockscope replay`: people who were filmed, before our cameras, as a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scenarios.errors import InputError
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


@dataclass(frozen=True)
class Part:
    """Which recording, which part of it, and what the recording does not say itself."""

    source: Path
    start: float
    duration: float | None
    fps: float | None
    calibration: Path | None


def replay(
    part: Part, camera: Path | None, seeds: str, out: Path, settings: list[str], streams: str, images: str | None
) -> CommandResult:
    """Every recording of the source with every seed; settings: of camera, sensor, light and picture."""
    from scenarios.loading.resolve import load_observation
    from sim.dataset.replay import Cut
    from sim.dataset.replay_dataset import ReplayOptions, store_replays
    from sim.io.source import open_source

    option_parsing.folder(out)
    chosen, (wanted, kind) = option_parsing.seeds(seeds), option_parsing.pictures(streams, images)
    if part.duration is not None and part.duration <= 0:
        raise InputError(place="--duration", got=part.duration, expected="seconds above 0", remedy="correct it")
    view = load_observation(camera, settings)
    sources = open_source(part.source, fps=part.fps, images=False)
    how = ReplayOptions(view, Cut(part.start, part.duration), part.calibration, wanted, kind)
    with ProgressMeter("replay") as meter:
        folders = store_replays(sources, how, chosen, out, meter.update)
    text = f"{len(folders)} sequences in {folders[0].parent}"
    return CommandResult({"sequences": folders, "folder": folders[0].parent}, text)
