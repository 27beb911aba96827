"""The groups of a run, as `track` and `group` report them: rows for --json, and tables of groups and events by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import counted, shortened
from sim.types import EVENT_KINDS
from tracking.app.score_tables import table
from tracking.grouping.plausibility import median_speed
from tracking.grouping.short_groups import LeftOut, summed
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


def group_row(run: TrackingRun, folder: Path, left_out: LeftOut) -> Row:
    """Returns the command's result for one run, as a dictionary.

    folder: where the run is stored. left_out: short groups, which the run does not have.
    """
    fps = run.info["fps"]
    events = Counter(e.kind for t in run for e in t.events)
    speed = median_speed(run, fps, run.info["px_per_m"] or 1.0)
    return {
        **{key: run.info[key] for key in ("sequence", "plane", "px_per_m", "px_per_m_frames", "fps", "frames")},
        "median_speed": None if np.isnan(speed) else speed,
        "people": len({id for t in run for id in t.id.tolist()}),
        "people_in_groups": len({id for t in run for id in t.id[t.group >= 0].tolist()}),
        "groups": groups_of(run, fps), "left_out": left_out, "folder": folder,
        "events": {kind: events[kind] for kind in EVENT_KINDS},
    }  # fmt: skip


def group_tables(rows: SequenceOf[Row]) -> str:
    """Returns a table of groups and one of events, with a line for each run and their sum."""
    counts = _counts_table("groups", rows, _group_counts)
    events = _counts_table(
        "events", rows, lambda some: {kind: sum(r["events"][kind] for r in some) for kind in EVENT_KINDS}
    )
    if len(rows) > 1:
        return "\n".join([counts, events, *_left_out(rows), f"stored in {rows[0]['folder'].parent}"])
    place, stored = _place(rows[0]), f"stored in {rows[0]['folder']}"
    return "\n".join([counts, *_longest(rows[0]), events, *_left_out(rows), place, stored])


def _left_out(rows: SequenceOf[Row]) -> list[str]:
    """Returns a line about the short groups that are left out of all runs, none if groups of any duration are kept."""
    text = summed(row["left_out"] for row in rows).text()
    return [text] if text else []


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
