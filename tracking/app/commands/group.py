"""`flockscope group`: groups and events of people whose ids are known, stored as a run.

Also here: tables for the terminal of what `flockscope group` found: groups, their sizes and durations, and events by
kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, shortened
from sim.types import EVENT_KINDS, Sequence
from tracking.app.command_options import GroupOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.score_tables import table
from tracking.app.sequence_workers import source_of
from tracking.app.stored_tracks import STATED, StoredTracks, check_place, find_tracks, holds_tracks, run_folders
from tracking.grouping.belief import Belief, pair_probabilities
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.grouping.plausibility import median_speed
from tracking.recordings.options import refuse_options
from tracking.running import run as runs
from tracking.running.run import TrackingRun

LISTED = 20  # Most groups that are listed one by one.

LONGEST_LIST = 60  # Most characters of a list of members.

LASTING = 2.0  # s: groups that last as long are counted apart.

Row = dict[str, Any]


def groups_of(run: TrackingRun, fps: float) -> list[Row]:
    """Returns a dict for each group, by first frame: id, members (all ids), size (greatest), start, end (frames),
    seconds."""
    found: dict[int, Row] = {}
    for t in run:
        for name in np.unique(t.group[t.group >= 0]).tolist():
            who = t.id[t.group == name].tolist()
            group = found.setdefault(name, {"id": name, "members": set(), "size": 0, "start": t.index})
            group["members"].update(who)
            group |= {"size": max(group["size"], len(who)), "end": t.index}
    return [
        {**g, "members": sorted(g["members"]), "seconds": (g["end"] - g["start"] + 1) / fps} for g in found.values()
    ]


def lasting(groups: Iterable[Row]) -> int:
    """Returns the number of groups of `groups_of` that last for LASTING seconds or longer."""
    return sum(group["seconds"] >= LASTING for group in groups)


def group_row(run: TrackingRun, folder: Path) -> Row:
    """Returns the command's result for one run, as a dictionary; folder: where the run is stored."""
    fps = run.info["fps"]
    events = Counter(e.kind for t in run for e in t.events)
    speed = median_speed(run, fps, run.info["px_per_m"] or 1.0)
    return {
        **{key: run.info[key] for key in ("sequence", "plane", "px_per_m", "px_per_m_frames", "fps", "frames")},
        "median_speed": None if np.isnan(speed) else speed,
        "people": len({id for t in run for id in t.id.tolist()}),
        "people_in_groups": len({id for t in run for id in t.id[t.group >= 0].tolist()}),
        "groups": groups_of(run, fps), "events": {kind: events[kind] for kind in EVENT_KINDS}, "folder": folder,
    }  # fmt: skip


def group_tables(rows: SequenceOf[Row]) -> str:
    """Returns a table of groups and one of events, with a line for each run and their sum."""
    counts = _counts_table("groups", rows, _group_counts)
    events = _counts_table(
        "events", rows, lambda some: {kind: sum(r["events"][kind] for r in some) for kind in EVENT_KINDS}
    )
    if len(rows) > 1:
        return "\n".join([counts, events, f"stored in {rows[0]['folder'].parent}"])
    return "\n".join([counts, *_longest(rows[0]), events, _place(rows[0]), f"stored in {rows[0]['folder']}"])


def _counts_table(title: str, rows: SequenceOf[Row], cells: Callable[[SequenceOf[Row]], dict[str, object]]) -> str:
    parts = [(row["sequence"], [row]) for row in rows] + [("all", [*rows])] * (len(rows) > 1)
    shown = [[name, *map(str, cells(part).values())] for name, part in parts]
    return table(title, ["sequence"], cells(rows), shown)


def _group_counts(rows: SequenceOf[Row]) -> dict[str, object]:
    groups = [g for row in rows for g in row["groups"]]
    sizes, seconds = Counter(min(g["size"], 4) for g in groups), [g["seconds"] for g in groups]
    return {
        "people": sum(row["people"] for row in rows),
        "in groups": sum(row["people_in_groups"] for row in rows),
        "groups": len(groups), f"{LASTING:g} s or longer": lasting(groups),
        "of 2": sizes[2], "of 3": sizes[3], "of 4 or more": sizes[4],
        "median, s": f"{np.median(seconds):.1f}" if groups else "–",
        "longest, s": f"{max(seconds):.1f}" if groups else "–",
    }  # fmt: skip


def _longest(row: Row) -> list[str]:
    kept = sorted(row["groups"], key=lambda g: -g["seconds"])[:LISTED]
    shown = [
        [str(g["id"]), f"{(g['start'] - 1) / row['fps']:.1f}", f"{g['end'] / row['fps']:.1f}", str(g["size"]),
         shortened(" ".join(map(str, g["members"])), LONGEST_LIST)]
        for g in row["groups"] if g in kept
    ]  # fmt: skip
    title = (
        "members" if len(kept) == len(row["groups"]) else f"the {LISTED} groups that last longest (--json lists all)"
    )
    return [table(title, (), ["group", "from, s", "to, s", "most at a time"], shown, ["members"])] if kept else []


def _place(row: Row) -> str:
    if row["plane"] != "image":
        speed = row["median_speed"]
        return "positions in metres" + (
            "" if speed is None else f"; half of the people walk at {speed:.2g} m/s or less"
        )
    if row["px_per_m"] is None:
        return "nobody is there"
    origin = f"from the boxes of the first {counted(row['px_per_m_frames'], 'frame')}; --px-per-m gives another"
    return f"positions in the image, {row['px_per_m']:.4g} px per m{', ' + origin if row['px_per_m_frames'] else ''}"


# Kind of a source whose rows are anybody's tracks: the run may be scored with the labels of any sequence.
TEXT = "mot text"


def group(options: GroupOptions) -> CommandResult:
    """Groups the people of every sequence or stored run, stores each as a run, and returns tables of groups."""
    grouping = None if options.grouping is None else grouping_of(options.grouping)
    belief = _belief(grouping or default_grouping()) if options.probabilities else None
    sequences, stored = _opened(options)
    folders = run_folders(sequences, options.source, options.out)
    for folder, tracks in zip(folders, stored, strict=True):
        _refuse_own(folder, tracks)
        check_place(folder, "group" if tracks is None else tracks.info.get("tracker") or "group")
    rows = []
    with ProgressMeter("group", len(sequences)) as meter:
        for sequence, tracks, folder in zip(sequences, stored, folders, strict=True):
            run = runs.group(sequence, None if tracks is None else tracks.read(sequence), grouping=grouping)
            pairs = (
                None if belief is None else pair_probabilities(run, sequence.fps, run.info["px_per_m"] or 1.0, belief)
            )
            labelled = replace(sequence, load_truth=None) if sequence.source["kind"] == TEXT else sequence
            run.write(folder, labelled, pairs)
            rows.append({**group_row(run, folder), "pairs": None if pairs is None else len(pairs.frame)})
            meter.step(sequence.name)
    return CommandResult({"runs": rows}, group_tables(rows))


def _opened(options: GroupOptions) -> tuple[list[Sequence], list[StoredTracks | None]]:
    """Returns the sequences of the source, and for each its run if the source is stored tracks of ours, else None."""
    if not holds_tracks(options.source):
        sequences = _open(options.source, options)
        return sequences, [None] * len(sequences)
    sequences, found = [], find_tracks(options.source)
    for tracks in found:
        if tracks.info:
            sequences.append(_of_run(tracks, options))
        else:
            text = tracks.path / "tracks.txt" if tracks.path.is_dir() else tracks.path
            sequences.append(replace(_open(text, options)[0], name=tracks.name or text.stem))
    return sequences, [tracks if tracks.info else None for tracks in found]


def _open(path: Path, options: GroupOptions) -> list[Sequence]:
    sequences = source_of(options, path).open()
    if options.box_scale is not None and any(s.source["kind"] != TEXT for s in sequences):
        got, remedy = "a recording, whose labels are not scaled", "leave it out, or give the text itself"
        raise InputError(file=path, place="--box-scale", got=got, expected="a text with ids", remedy=remedy)
    return sequences


def _of_run(tracks: StoredTracks, options: GroupOptions) -> Sequence:
    known = "px_per_m" if tracks.info.get("plane") != "image" else ""
    refuse_options(vars(options), f"camera person_class box_scale {known}", tracks.folder, "a run", STATED)
    sequence = tracks.sequence(options.fps)
    if options.px_per_m is None:
        return sequence
    return replace(sequence, px_per_m=options.px_per_m, source={**sequence.source, "px_per_m_frames": 0})


def _belief(grouping: Grouping) -> Belief:
    if isinstance(grouping, Belief):
        return grouping
    expected, remedy = "a grouping with probabilities", "leave --grouping out, or name a file of `fit grouping`"
    raise InputError(place="--probabilities", got="the baseline rule", expected=expected, remedy=remedy)


def _refuse_own(folder: Path, tracks: StoredTracks | None) -> None:
    if tracks is not None and folder.resolve() in (tracks.path.resolve(), tracks.path.resolve().parent):
        got, remedy = "the folder of the tracks themselves", "choose another --out"
        raise InputError(file=folder, place="--out", got=got, expected="another folder", remedy=remedy)
