"""Groups that exist for a short time in all: which they are, and groups and events without them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from scenarios.errors import counted
from sim.arrays import joined
from sim.types import GroupEvent, Groups, Ints, Tracks


@dataclass(frozen=True)
class LeftOut:
    """What is left out with short groups: `groups` of `all_groups`, and `events` of `all_events`."""

    seconds: float
    groups: int = 0
    all_groups: int = 0
    events: int = 0
    all_events: int = 0

    def text(self) -> str:
        """Returns a line about it, "" if groups of any duration are kept."""
        if not self.seconds:
            return ""
        groups, events = counted(self.all_groups, "group"), counted(self.all_events, "event")
        return f"left out: {self.groups} of {groups}, under {self.seconds:g} s in all, and {self.events} of {events}"


def summed(some: Iterable[LeftOut]) -> LeftOut:
    """Returns what is left out of several runs together; all have the same `seconds`."""
    every = [vars(one) for one in some]
    seconds = max(one["seconds"] for one in every)
    return LeftOut(seconds, *(sum(one[f.name] for one in every) for f in fields(LeftOut)[1:]))


def lasting_groups(groups: Iterable[Groups], fps: float, seconds: float) -> tuple[Ints, int]:
    """Returns the sorted ids of the groups that exist for `seconds` or longer, and the number of all groups.

    groups: the groups of each frame. The time of a group is the number of frames in which it exists / fps.
    """
    ids, frames = np.unique(joined((g.id for g in groups), kind=np.int64), return_counts=True)
    return ids[frames >= seconds * fps * (1 - 1e-9)], len(ids)


def only(groups: Groups, kept: Ints) -> Groups:
    """Returns the groups of a frame without those whose ids are not in `kept`."""
    rows = np.flatnonzero(np.isin(groups.id, kept))
    if len(rows) == len(groups.id):
        return groups
    ragged = {name: getattr(groups, name) for name in ("members", "hull")}
    return Groups(
        id=groups.id[rows], pos=groups.pos[rows], vel=groups.vel[rows], extent=groups.extent[rows],
        size=groups.size[rows], **{name: tuple(v[k] for k in rows) if v else () for name, v in ragged.items()},
    )  # fmt: skip


def only_ids(group: Ints, kept: Ints) -> Ints:
    """Returns the group (N,) of each person, -1 if it is not in `kept`."""
    return np.where(np.isin(group, kept), group, -1)


def concerns(event: GroupEvent, kept: set[int]) -> bool:
    """Returns True if an event concerns a group in `kept`, or no group at all."""
    names = {name for name in (*event.before, *event.after) if name >= 0}
    return not names or bool(names & kept)


def without_short_groups(tracks: Sequence[Tracks], fps: float, seconds: float) -> tuple[tuple[Tracks, ...], LeftOut]:
    """Returns the tracks of people without groups that exist for less than `seconds` in all, and what is left out.

    Members of such groups are alone. Events that concern only such groups are left out, too.
    """
    if not seconds:
        return tuple(tracks), LeftOut(seconds)
    kept, number = lasting_groups((t.groups for t in tracks if t.groups is not None), fps, seconds)
    names, found = set(kept.tolist()), []
    for t in tracks:
        events = tuple(e for e in t.events if concerns(e, names))
        groups = None if t.groups is None else only(t.groups, kept)
        found.append(t.replace(group=only_ids(t.group, kept), groups=groups, events=events))
    after, before = (sum(len(t.events) for t in some) for some in (found, tracks))
    return tuple(found), LeftOut(seconds, number - len(kept), number, before - after, before)
