"""`flockscope group`: groups and events of people whose ids are known, stored as a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from scenarios.errors import InputError
from sim.io.formats.mot_folder import frame_rate
from sim.io.source import RecordingOptions, holds_sequences, open_source
from sim.io.store.run_seal import WHOLE, reject_foreign, run_folder
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_options import GroupOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.group_tables import group_row, group_tables
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import StoredTracks, find_tracks, run_folders
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.grouping.pair_probabilities import pair_probabilities
from tracking.running import run as runs
from tracking.running.run import TrackingRun

# Kind of a source whose rows are anybody's tracks: the run may be scored with the labels of any sequence.
TEXT = "mot text"


def group(options: GroupOptions) -> CommandResult:
    """Groups the people of every sequence or stored run, stores each as a run, and returns tables of groups."""
    option_parsing.output_folder(options.out)
    grouping = None if options.grouping is None else grouping_of(options.grouping)
    belief = _belief(grouping or default_grouping()) if options.probabilities else None
    sequences, stored = _opened(options)
    folders = run_folders(sequences, options.source, options.out)
    for folder, tracks in zip(folders, stored, strict=True):
        _refuse(folder, tracks)
    rows = []
    with ProgressMeter("group", len(sequences)) as meter:
        for sequence, tracks, folder in zip(sequences, stored, folders, strict=True):
            run = runs.group(sequence, None if tracks is None else tracks.read(sequence), grouping=grouping)
            pairs = None if belief is None else pair_probabilities(run, sequence.fps, _scale(run), belief)
            labelled = replace(sequence, load_truth=None) if sequence.source["kind"] == TEXT else sequence
            run.write(folder, labelled, pairs)
            rows.append({**group_row(run, folder), "pairs": None if pairs is None else len(pairs.frame)})
            meter.step(sequence.name)
    return CommandResult({"runs": rows}, group_tables(rows))


def _opened(options: GroupOptions) -> tuple[list[Sequence], list[StoredTracks | None]]:
    """Returns the sequences of the source, and for each its run if the source is stored tracks of ours, else None."""
    path = options.source
    own = run_folder(path) is not None and (path.is_dir() or path.name in WHOLE)
    if not own and (not path.is_dir() or holds_sequences(path)):
        sequences = _open(path, options)
        return sequences, [None] * len(sequences)
    sequences, found = [], find_tracks(path)
    for tracks in found:
        if tracks.info:
            sequences.append(_of_run(tracks, options))
        else:
            text = tracks.path / "tracks.txt" if tracks.path.is_dir() else tracks.path
            sequences.append(replace(_open(text, options)[0], name=tracks.name or text.stem))
    return sequences, [tracks if tracks.info else None for tracks in found]


def _open(path: Path, options: GroupOptions) -> list[Sequence]:
    sequences = open_source(
        path, fps=options.fps, px_per_m=options.px_per_m, camera=options.camera, images=False,
        person_class=options.person_class, box_scale=options.box_scale,
    )  # fmt: skip
    if options.box_scale is not None and any(s.source["kind"] != TEXT for s in sequences):
        raise InputError(
            file=path, place="--box-scale", got="a recording, whose labels are not scaled", expected="a text with ids",
            remedy="leave it out, or give the text itself",
        )  # fmt: skip
    return sequences


def _of_run(tracks: StoredTracks, options: GroupOptions) -> Sequence:
    tracks.check()
    info, folder = tracks.info, tracks.path if tracks.path.is_dir() else tracks.path.parent
    o = options
    given = RecordingOptions(o.fps, o.px_per_m, o.camera, True, None, o.person_class, o.box_scale)  # type: ignore[arg-type]
    stated = [name for name, known in (("fps", "fps" in info), ("px_per_m", info.get("plane") != "image")) if known]
    given.reject(folder, "a run", "run.json states it", " ".join(("camera person_class box_scale", *stated)))
    scale, frames = info.get("px_per_m"), int(info.get("px_per_m_frames") or 0)
    if options.px_per_m is not None:
        scale, frames = options.px_per_m, 0
    return Sequence(
        name=info.get("sequence", folder.name), fps=frame_rate(options.fps, info.get("fps")), length=info.get("frames"),
        frames=lambda: iter(()), px_per_m=float("nan") if scale is None else scale,
        source={"kind": "run", "path": str(folder), "truth_hash": info.get("truth_hash"), "px_per_m_frames": frames},
    )  # fmt: skip


def _belief(grouping: Grouping) -> Belief:
    if isinstance(grouping, Belief):
        return grouping
    raise InputError(
        place="--probabilities", got="the baseline rule, which has none", expected="a grouping with probabilities",
        remedy="leave --grouping out, or name a file of `fit grouping`",
    )  # fmt: skip


def _scale(run: TrackingRun) -> float:
    return run.info["px_per_m"] or 1.0


def _refuse(folder: Path, tracks: StoredTracks | None) -> None:
    if tracks is not None and folder.resolve() in (tracks.path.resolve(), tracks.path.resolve().parent):
        raise InputError(
            file=folder, place="--out", got="the folder of the tracks themselves", expected="another folder",
            remedy="choose another --out",
        )  # fmt: skip
    reject_foreign(folder)
