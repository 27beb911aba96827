"""`flockscope group`: groups and events of people whose ids are known, stored as a run."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

from scenarios.errors import InputError
from sim.types import Sequence
from tracking.app.command_options import GroupOptions
from tracking.app.command_result import CommandResult
from tracking.app.fit_options import FitGroupingOptions
from tracking.app.group_tables import group_row, group_tables
from tracking.app.progress import ProgressMeter
from tracking.app.sequence_workers import source_of
from tracking.app.stored_tracks import STATED, StoredTracks, check_place, find_tracks, holds_tracks, run_folders
from tracking.export.table_options import seconds_of
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import default_grouping, grouping_of
from tracking.grouping.pair_beliefs import pair_probabilities
from tracking.grouping.short_groups import LeftOut, without_short_groups
from tracking.recordings.calibration import read_calibration
from tracking.recordings.options import refuse_options
from tracking.running import run as runs
from tracking.running.explained_people import people_at_places
from tracking.running.run import TrackingRun

Peopled = GroupOptions | FitGroupingOptions

# Kind of a source whose rows are anybody's tracks: the run may be scored with the labels of any sequence.
TEXT = "mot text"


def group(options: GroupOptions) -> CommandResult:
    """Groups the people of every sequence or stored run, stores each as a run, and returns tables of groups."""
    grouping = None if options.grouping is None else grouping_of(options.grouping)
    belief = grouping or default_grouping()
    if options.probabilities and not isinstance(belief, Belief):
        expected, remedy = "a grouping with probabilities", "leave --grouping out, or name a file of `fit grouping`"
        raise InputError(place="--probabilities", got="the baseline rule", expected=expected, remedy=remedy)
    least = seconds_of(options.min_duration, "--min-duration")
    sequences, stored = opened_people(options, options.source)
    folders = run_folders(sequences, options.source, options.out)
    for folder, tracks in zip(folders, stored, strict=True):
        if tracks is not None and folder.resolve() in (tracks.path.resolve(), tracks.path.resolve().parent):
            got, remedy = "the folder of the tracks themselves", "choose another --out"
            raise InputError(file=folder, place="--out", got=got, expected="another folder", remedy=remedy)
        check_place(folder, "group" if tracks is None else tracks.info.get("tracker") or "group")
    rows = []
    with ProgressMeter("group", len(sequences)) as meter:
        for sequence, tracks, folder in zip(sequences, stored, folders, strict=True):
            found = runs.group(sequence, None if tracks is None else tracks.read(sequence), grouping=grouping)
            run, left_out = _without_short_groups(found, least)
            pairs = None
            if options.probabilities and isinstance(belief, Belief):
                pairs = pair_probabilities(people_at_places(sequence, found), sequence.fps, belief)
            labelled = replace(sequence, load_truth=None) if sequence.source["kind"] == TEXT else sequence
            run.write(folder, labelled, pairs)
            row = group_row(run, folder, left_out)
            rows.append({**row, "pairs": None if pairs is None else len(pairs.frame)})
            meter.step(sequence.name)
    return CommandResult({"runs": rows}, group_tables(rows))


def _without_short_groups(run: TrackingRun, least: float) -> tuple[TrackingRun, LeftOut]:
    """Returns the run without groups that exist for less than `least` seconds in all, and what is left out."""
    kept, left_out = without_short_groups(run.tracks, run.info["fps"], least)
    # Whether a group lasts is known later only.
    more = {"min_duration": least, "causal_from": None, "causal": False} if least else {}
    return replace(run, tracks=kept, info={**run.info, **more}), left_out


def opened_people(options: Peopled, source: Path) -> tuple[list[Sequence], list[StoredTracks | None]]:
    """Returns the sequences of a source, and for each its run if the source is stored tracks of ours, else None."""
    if not holds_tracks(source):
        sequences = _open(source, options)
        return sequences, [None] * len(sequences)
    sequences, found = [], find_tracks(source)
    for tracks in found:
        if tracks.info:
            sequences.append(_of_run(tracks, options))
        else:
            text = tracks.path / "tracks.txt" if tracks.path.is_dir() else tracks.path
            sequences.append(replace(_open(text, options)[0], name=tracks.name or text.stem))
    return sequences, [tracks if tracks.info else None for tracks in found]


def _open(path: Path, options: Peopled) -> list[Sequence]:
    sequences = source_of(options, path).open()
    if options.box_scale is not None and any(s.source["kind"] != TEXT for s in sequences):
        got, remedy = "a recording, whose labels are not scaled", "leave it out, or give the text itself"
        raise InputError(file=path, place="--box-scale", got=got, expected="a text with ids", remedy=remedy)
    return sequences


def _of_run(tracks: StoredTracks, options: Peopled) -> Sequence:
    """Returns the sequence of a run. A run in the image does not hold its camera, which is that of `options`."""
    known = "" if tracks.info.get("plane") == "image" else "camera px_per_m"
    refuse_options(vars(options), f"person_class box_scale {known}", tracks.folder, "a run", STATED)
    sequence = tracks.sequence(options.fps)
    if options.camera is not None:
        sequence = replace(sequence, camera=read_calibration(options.camera))
    elif tracks.info.get("ground") == "camera":
        text = "its groups were derived with a camera, which the run does not hold; give it with --camera"
        warnings.warn(f"{tracks.folder}: {text}", UserWarning, stacklevel=2)
    if options.px_per_m is None:
        return sequence
    return replace(sequence, px_per_m=options.px_per_m, source={**sequence.source, "px_per_m_frames": 0})
