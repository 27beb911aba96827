"""Tables for the terminal of what `flockscope group` found: groups, their sizes and durations, and events by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.printable import counted, printable, shortened
from sim.types import EVENT_KINDS
from tracking.app.commands.score_tables import empty_table, with_title
from tracking.grouping.plausibility import median_speed
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


def group_tables(rows: Sequence[Row]) -> Any:
    """Returns something rich can print: a table of groups and one of events, with a line for each run and their sum."""
    from rich.console import Group

    counts = _table("groups", rows, _group_counts)
    events = _table("events", rows, lambda some: {kind: sum(r["events"][kind] for r in some) for kind in EVENT_KINDS})
    if len(rows) > 1:
        return Group(counts, events, f"stored in {rows[0]['folder'].parent}")
    return Group(counts, *_longest(rows[0]), events, _place(rows[0]), f"stored in {rows[0]['folder']}")


def _table(title: str, rows: Sequence[Row], cells: Callable[[Sequence[Row]], dict[str, object]]) -> Any:
    table = empty_table()
    table.add_column("sequence", overflow="fold")
    for name in cells(rows):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(printable(row["sequence"]), *map(str, cells([row]).values()))
    if len(rows) > 1:
        table.add_row("all", *map(str, cells(rows).values()), style="bold")
    return with_title(title, table)


def _group_counts(rows: Sequence[Row]) -> dict[str, object]:
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
    table = empty_table()
    for name in ("group", "from, s", "to, s", "most at a time"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("members", overflow="fold")
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
