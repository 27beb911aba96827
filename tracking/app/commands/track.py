"""`flockscope track`: runs a tracker over a sequence, or over every sequence of a dataset, and stores the tracks.

Its options and their help stand in tracking.app.command_options.
"""

from __future__ import annotations

import pickle
import time
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, WorkError, counted, printable
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_options import TrackOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.track_live import refuse_live_options, track_live
from tracking.app.group_tables import LASTING, groups_of, lasting
from tracking.app.progress import ProgressMeter, total_frames
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.app.stored_tracks import check_place, run_folders
from tracking.app.tracker_setup import TrackerSetup
from tracking.config import Config
from tracking.grouping.grouping_choice import grouping_of
from tracking.recordings.live_source import is_live
from tracking.running.detection_mode import BOTH, choose_mode
from tracking.running.policy import Policy
from tracking.running.prepare import params_in
from tracking.running.run import TrackingRun
from tracking.running.run_info import input_summary
from tracking.running.time_limit import TimeLimited
from tracking.running.tracker_registry import find

# What --json repeats of each run.json.
ROW_KEYS = (
    "sequence", "detections", "input", "sensor", "background", "causal", "causal_from", "plane", "boxes", "frames",
    "frames_per_second", "whole_frames_per_second",
)  # fmt: skip


KEPT = 10.0  # s that a run must have lasted to be kept when it ends early.


def track(options: TrackOptions) -> CommandResult:
    """Tracks every sequence of the source and stores the tracks; returns a line for each input."""
    from sim.store.atomic import lock_folder

    setup = _setup(options)
    if is_live(options.source, options.follow is not None):
        return track_live(setup, options)
    refuse_live_options(options)
    path, needs = Path(options.source), find(setup.tracker).needs
    seen = {BOTH} if options.boxes is not None else {"pixels", "stereo"}
    pictures = setup.detections in (None, "image", "both") and not seen.isdisjoint(needs)
    source = source_of(options, path, pictures)
    sequences = source.open()
    if options.boxes is not None and setup.detections is None:
        setup = replace(setup, detections="both" if pictures and sequences[0].has_images else "file")
    folders = run_folders(sequences, path, options.out)
    rows = list[dict[str, Any]]()
    with lock_folder(options.out):
        for folder in folders:
            check_place(folder, setup.tracker)
        _check_modes(setup, sequences, options.background)
        if min(options.workers, len(sequences)) > 1:
            given = pickle.dumps(options)  # a tracker class and its config cannot be pickled, their names can
            jobs = [(given, folder) for folder in folders]
            try:
                rows += list(over_sequences("track", _track_in_worker, sequences, jobs, source, options.workers))
            except WorkError as error:  # a process that has ended names no tracker
                raise (error if error.file else error.replaced(file=setup.tracker)) from error.__cause__
        else:
            with setup.limited or nullcontext(), ProgressMeter("track", total_frames(sequences)) as meter:
                for sequence, folder in zip(sequences, folders, strict=True):
                    rows.append(_track_sequence(setup, sequence, folder, partial(_step, meter, sequence.name)))
    return CommandResult({"tracker": setup.tracker, "runs": rows}, "\n".join(_lines(rows, options.out)))


def _step(meter: ProgressMeter, name: str, _: int) -> None:
    meter.step(name)


def _track_sequence(
    setup: TrackerSetup, sequence: Sequence, folder: Path, progress: Callable[[int], None] | None = None
) -> dict[str, Any]:
    from sim.store.seal import tracked_hash

    tracked_hash(sequence)  # labels that cannot be read are refused now, not after the last frame
    run = setup.run(sequence, progress, partial(_write_early, sequence, folder, time.monotonic()))
    run.write(folder, sequence)
    return _row(run, folder)


def _write_early(sequence: Sequence, folder: Path, begun: float, run: TrackingRun) -> None:
    """Stores a run that ended early, unless it can be made again within seconds."""
    if time.monotonic() - begun < KEPT:
        return
    run.write(folder, sequence)
    words = f"it ended early; the {counted(len(run), 'frame')} that were tracked are in {folder}"
    warnings.warn(f"{sequence.name}: {words}", UserWarning, stacklevel=2)


def _track_in_worker(sequence: Sequence, job: tuple[bytes, Path]) -> dict[str, Any]:
    return _track_sequence(_unpickled_setup(job[0]), sequence, job[1])


@cache
def _unpickled_setup(options: bytes) -> TrackerSetup:
    return _setup(pickle.loads(options))


def _setup(options: TrackOptions) -> TrackerSetup:
    found = [
        *option_parsing.settings(option_parsing.sensor_settings(options.sensor), "tracker", ("sensor",)),
        *option_parsing.settings(options.settings, "tracker", ("tracker", "sensor")),
    ]
    own = [text for subject, text in found if subject == "tracker"]
    sensor = option_parsing.toml_values(text for subject, text in found if subject == "sensor")
    rule = None if options.grouping is None else grouping_of(options.grouping)
    config = _config(options.tracker, options.params, own)
    limited = None if options.step_timeout is None else TimeLimited(options.tracker, options.step_timeout)
    if options.boxes is not None and options.detections not in (None, "file", "both"):
        got, remedy = f"--detections {options.detections}", "leave --boxes or --detections out"
        raise InputError(place="--boxes", got=got, expected="--detections file or both", remedy=remedy)
    return TrackerSetup(options.tracker, config, options.detections, sensor, options.seed, rule, limited, options.mask)


def _config(tracker: str, params: str | None, settings: list[str]) -> Config | Policy | None:
    kind: type[Config] | None = getattr(find(tracker), "config_class", None)
    if kind is not None:
        found = kind() if params is None else params_in(kind, params)
        if isinstance(found, Policy):
            return replace(found, base=found.base.with_set(*settings))
        return found.with_set(*settings)
    if params is None and not settings:
        return None
    place, remedy = "--params" if params else f"--set {settings[0]}", "leave it out, or give the class a config_class"
    raise InputError(place=place, got=tracker, expected="a tracker with parameters", remedy=remedy)


def _check_modes(setup: TrackerSetup, sequences: list[Sequence], background: str | None) -> None:
    modes = [choose_mode(find(setup.tracker).needs, sequence, setup.detections) for sequence in sequences]
    if background is not None and {"image", "both"}.isdisjoint(modes):
        got, expected = f"--detections {modes[0]}", "a tracker that works on pictures"
        raise InputError(place="--background", got=got, expected=expected, remedy="leave --background out")
    if setup.tracker == "stereo" and modes[0] != "image":
        text = "stereo is made for stereo pairs; on points, group-pda finds groups better (docs/trackers/stereo.md)"
        warnings.warn(text, UserWarning, stacklevel=2)


def _row(run: TrackingRun, folder: Path) -> dict[str, Any]:
    groups = groups_of(run, run.info["fps"])
    tracks = len({id for t in run for id in t.id.tolist()})
    count = {"tracks": tracks, "groups": len(groups), "lasting_groups": lasting(groups)}
    return {**{key: run.info[key] for key in ROW_KEYS}, **count, "folder": folder}


def _lines(rows: list[dict[str, Any]], out: str | Path) -> list[str]:
    """Returns a line of text for all runs with the same input."""
    by_input = dict[str, list[dict[str, Any]]]()
    for row in rows:
        by_input.setdefault(input_summary(row), []).append(row)
    return [_line(alike[0] if len(alike) == 1 else _together(alike, out)) for alike in by_input.values()]


def _together(rows: list[dict[str, Any]], out: str | Path) -> dict[str, Any]:
    """Returns runs with the same input as one row: their sums, and their mean speed by frame."""
    sums = {key: sum(row[key] for row in rows) for key in ("frames", "tracks", "groups", "lasting_groups")}
    for key in ("frames_per_second", "whole_frames_per_second"):
        seconds = sum(row["frames"] / row[key] for row in rows if row[key])
        sums[key] = sums["frames"] / seconds if seconds else 0.0
    return {**rows[0], **sums, "sequence": counted(len(rows), "sequence"), "folder": out}


def _line(row: dict[str, Any]) -> str:
    speed = f"{row['frames_per_second']:.0f} frames/s ({row['whole_frames_per_second']:.0f} with reading)"
    counts = ", ".join(counted(row[f"{name}s"], name) for name in ("frame", "track", "group"))
    counts += f" ({row['lasting_groups']} of {LASTING:g} s or longer)" if row["groups"] else ""
    return printable(f"{row['sequence']}: {counts}, detections {input_summary(row)}, {speed} → {row['folder']}")
