"""`flockscope track`: a tracker over a sequence, or over every sequence of a dataset, its answers stored."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Sequence
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.config import Config
from tracking.grouping.link_rule import LinkRule
from tracking.run import TrackingRun
from tracking.run_info import input_summary


@dataclass(frozen=True)
class Job:
    """How a tracker is to be run: tracker as `tracking.track` takes it; config None: its own default, if it has one."""

    tracker: str
    config: Config | None = None
    detections: DetectionMode | None = None
    sensor: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    grouping: LinkRule | None = None

    def run(self, sequence: Sequence, progress: Callable[[int], None] | None = None) -> TrackingRun:
        """The tracker's answers."""
        from tracking.run import track

        return track(
            self.tracker, sequence, params=self.config, detections=self.detections, sensor=self.sensor, seed=self.seed,
            grouping=self.grouping, progress=progress,
        )  # fmt: skip


def job(
    tracker: str,
    params: Path | None,
    settings: Iterable[str],
    detections: DetectionMode | None,
    seed: int,
    detector: Path | None = None,
    grouping: Path | None = None,
) -> Job:
    """The options of the command as a Job; InputError for settings that the tracker does not know."""
    found = option_parsing.settings([*option_parsing.sensor(detector), *settings], "tracker", ("tracker", "sensor"))
    own = [text for subject, text in found if subject == "tracker"]
    sensor = option_parsing.values(text for subject, text in found if subject == "sensor")
    rule = None if grouping is None else LinkRule.from_toml(grouping)
    return Job(tracker, _config(tracker, params, own), detections, sensor, seed, rule)


def _config(tracker: str, params: Path | None, settings: list[str]) -> Config | None:
    from tracking.tracker_registry import find

    kind: type[Config] | None = getattr(find(tracker), "config_class", None)
    if kind is not None:
        config = kind() if params is None else kind.from_toml(params)
        return config.with_set(*settings)
    if params is None and not settings:
        return None
    raise InputError(
        place="--params" if params else f"--set {settings[0]}",
        got=tracker,
        expected="a tracker with parameters",
        remedy="leave it out, or give the class a config_class (docs/trackers.md)",
    )


def track(
    job: Job,
    source: Path,
    out: Path,
    *,
    fps: float | None,
    px_per_m: float | None,
    camera: Path | None,
    background: str | None,
) -> CommandResult:
    """Run the job on every sequence of the source and store the answers: in `out`, or in a folder of it for each.

    InputError before the first frame is read where the job cannot be done on one of them.
    """
    from sim.io.source import open_source
    from sim.io.store.track_files import write_tracks
    from tracking.tracker_registry import find

    option_parsing.folder(out)
    needs = find(job.tracker).needs
    pictures = job.detections in (None, "image") and not {"pixels", "stereo"}.isdisjoint(needs)
    sequences = open_source(source, fps=fps, px_per_m=px_per_m, camera=camera, images=pictures, background=background)
    chosen = places(sequences, source, out)
    _check(job, needs, sequences, background)
    rows = []
    with ProgressMeter("track", _frames(sequences)) as meter:
        for sequence, folder in chosen:
            run = job.run(sequence, lambda index, name=sequence.name: meter.step(name))  # type: ignore[misc]
            write_tracks(folder, run, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene, info=run.info)
            rows.append(_row(run, folder))
    return CommandResult({"tracker": job.tracker, "runs": rows}, "\n".join(map(_line, rows)))


def _check(job: Job, needs: tuple[str, ...], sequences: list[Sequence], background: str | None) -> None:
    from tracking.detection_mode import choose_mode

    modes = [choose_mode(needs, sequence, job.detections) for sequence in sequences]
    if background is not None and "image" not in modes:
        got, expected = f"--detections {modes[0]}", "a tracker that works on pictures"
        raise InputError(place="--background", got=got, expected=expected, remedy="leave --background out")


def _frames(sequences: list[Sequence]) -> int | None:
    """Frames of all, None where that is not known."""
    lengths = [sequence.length for sequence in sequences]
    return None if None in lengths else sum(length or 0 for length in lengths)


def places(sequences: list[Sequence], source: Path, out: Path) -> list[tuple[Sequence, Path]]:
    """Where each sequence's results go: `out` itself for a source that is one sequence, else a folder by its name."""
    own = Path(sequences[0].source.get("path", source))
    if len(sequences) == 1 and (own == source or source.is_file() or own.is_file()):
        return [(sequences[0], out)]
    names = [sequence.name for sequence in sequences]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise InputError(
                file=source, got=f"two sequences named {name}", expected="unique names", remedy="give one at a time"
            )
    return [(sequence, out / sequence.name) for sequence in sequences]


def _row(run: TrackingRun, folder: Path) -> dict[str, Any]:
    shown = ["sequence", "detections", "sensor", "background", "causal", "causal_from", "plane", "boxes", "frames"]
    shown += ["frames_per_second", "whole_frames_per_second"]
    ids = {int(id) for tracks in run for id in tracks.id}
    return {**{key: run.info[key] for key in shown}, "tracks": len(ids), "folder": folder}


def _line(row: dict[str, Any]) -> str:
    speed = f"{row['frames_per_second']:.0f} frames/s ({row['whole_frames_per_second']:.0f} with reading)"
    counts = f"{row['frames']} frames, {row['tracks']} tracks, detections {input_summary(row)}, {speed}"
    return f"{row['sequence']}: {counts} → {row['folder']}"
