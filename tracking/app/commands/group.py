"""`flockscope group`: groups and events of people whose ids are known, stored as a run.

Also here: tables for the terminal of what `flockscope group` found: groups, their sizes and durations, and events by
kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, printable, shortened
from sim.io.formats.mot_folder import frame_rate
from sim.io.formats.options import refuse_options
from sim.io.source import holds_sequences, open_source
from sim.io.store.seal import WHOLE, reject_foreign, run_folder
from sim.types import EVENT_KINDS, Sequence
from tracking.app import option_parsing
from tracking.app.command_options import GroupOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import new_table, with_title
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import StoredTracks, find_tracks, run_folders
from tracking.grouping.belief import Belief, pair_probabilities
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.grouping.plausibility import median_speed
from tracking.running import run as runs
from tracking.running.run import TrackingRun

LISTED = 20  # Most groups that are listed one by one.

LONGEST_LIST = 60  # Most characters of a list of members.

Row = dict[str, Any]


def group_row(run: TrackingRun, folder: Path) -> Row:
    """Returns what the command tells of one run, as a dictionary."""
    count = [len(t.id) for t in run]
    frame = np.repeat(np.array([t.index for t in run], np.int64), count)
    id, group = (np.concatenate([np.zeros(0, np.int64), *(getattr(t, name) for t in run)]) for name in ("id", "group"))
    inside = group >= 0
    order = np.lexsort((frame[inside], group[inside]))
    names, first = np.unique(group[inside][order], return_index=True)
    parts = (np.split(a[inside][order], first[1:]) for a in (frame, id))
    fps, found = run.info["fps"], []
    for name, when, who in zip(names.tolist(), *parts, strict=bool(len(names))):
        start, end, size = int(when[0]), int(when[-1]), int(np.unique(when, return_counts=True)[1].max())
        members, seconds = np.unique(who).tolist(), (end - start + 1) / fps
        found.append({"id": name, "members": members, "size": size, "start": start, "end": end, "seconds": seconds})
    events = Counter(e.kind for t in run for e in t.events)
    speed = median_speed(run, fps, run.info["px_per_m"] or 1.0)
    return {
        **{key: run.info[key] for key in ("sequence", "plane", "px_per_m", "px_per_m_frames", "fps", "frames")},
        "median_speed": None if np.isnan(speed) else speed,
        "people": len(np.unique(id)), "people_in_groups": len(np.unique(id[inside])),
        "groups": sorted(found, key=lambda g: (g["start"], g["id"])),
        "events": {kind: events[kind] for kind in EVENT_KINDS}, "folder": folder,
    }  # fmt: skip


def group_tables(rows: SequenceOf[Row]) -> Any:
    """Returns something rich can print: a table of groups and one of events, with a line for each run and their sum."""
    from rich.console import Group

    counts = _counts_table("groups", rows, _group_counts)
    events = _counts_table(
        "events", rows, lambda some: {kind: sum(r["events"][kind] for r in some) for kind in EVENT_KINDS}
    )
    if len(rows) > 1:
        return Group(counts, events, f"stored in {rows[0]['folder'].parent}")
    return Group(counts, *_longest(rows[0]), events, _place(rows[0]), f"stored in {rows[0]['folder']}")


def _counts_table(title: str, rows: SequenceOf[Row], cells: Callable[[SequenceOf[Row]], dict[str, object]]) -> Any:
    table = new_table(["sequence"], cells(rows))
    for row in rows:
        table.add_row(printable(row["sequence"]), *map(str, cells([row]).values()))
    if len(rows) > 1:
        table.add_row("all", *map(str, cells(rows).values()), style="bold")
    return with_title(title, table)


def _group_counts(rows: SequenceOf[Row]) -> dict[str, object]:
    groups = [g for row in rows for g in row["groups"]]
    sizes, seconds = Counter(min(g["size"], 4) for g in groups), [g["seconds"] for g in groups]
    return {
        "people": sum(row["people"] for row in rows),
        "in groups": sum(row["people_in_groups"] for row in rows),
        "groups": len(groups),
        "of 2": sizes[2],
        "of 3": sizes[3],
        "of 4 or more": sizes[4],
        "median, s": f"{np.median(seconds):.1f}" if groups else "–",
        "longest, s": f"{max(seconds):.1f}" if groups else "–",
    }


def _longest(row: Row) -> list[Any]:
    kept = sorted(row["groups"], key=lambda g: -g["seconds"])[:LISTED]
    table = new_table((), ["group", "from, s", "to, s", "most at a time"], ["members"])
    for g in (g for g in row["groups"] if g in kept):
        times = [f"{frame / row['fps']:.1f}" for frame in (g["start"] - 1, g["end"])]
        members = shortened(" ".join(map(str, g["members"])), LONGEST_LIST)
        table.add_row(str(g["id"]), *times, str(g["size"]), members)
    more = len(row["groups"]) - len(kept)
    title = f"the {LISTED} groups that last longest (--json lists all)" if more else "members"
    return [with_title(title, table)] if kept else []


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
STATED = "run.json states it"


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
    stated = [name for name, known in (("fps", "fps" in info), ("px_per_m", info.get("plane") != "image")) if known]
    refuse_options(vars(options), " ".join(("camera person_class box_scale", *stated)), folder, "a run", STATED)
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
