"""Ids and events of trackers that track groups as wholes (`unit` "group"), whose events have no members."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Frame, GroupEvent, Groups, Plane, Tracks

NO_ID = -1  # Id of a tentative group.


class GroupIds:
    """Gives fresh group ids, counted from 1; no id is given twice. State: next, the id that is given next."""

    def __init__(self) -> None:
        self.next = 1

    def new(self) -> int:
        """Returns the next id, which was never returned before."""
        self.next += 1
        return self.next - 1


@dataclass(frozen=True)
class WholeGroupEvent:
    """A change of the set of confirmed groups."""

    kind: str  # "merge", "split", "enter" or "leave"
    onset: float  # time, s, when it began
    # before, after: ids (tuples) of the groups concerned before and after the change, sorted; () before an enter of one
    # group and after a leave
    before: tuple[int, ...]
    after: tuple[int, ...]
    pos: tuple[float, float]  # x, y in the tracker's own unit


def reported_event(event: WholeGroupEvent, index: int, t: float, fps: float, scale: float = 1.0) -> GroupEvent:
    """Returns the `GroupEvent` that is reported in frame `index` (from 1) at time t, s, for a change of groups. Its
    start is the frame of the onset; its position is multiplied by `scale`."""
    start = min(max(index - round((t - event.onset) * fps), 1), index)
    x, y = event.pos
    return GroupEvent(event.kind, start, index, index, event.before, event.after, (), (x * scale, y * scale))


def whole_group_tracks(
    frame: Frame, plane: Plane, fps: float, groups: Groups, cov: Array, events: Iterable[WholeGroupEvent],
    scale: float = 1.0,
) -> Tracks:  # fmt: skip
    """Returns the `Tracks` of one frame for G groups whose members are unknown, with their events. cov (G, 4, 4), or
    (G, 6, 6) in space: covariance of position and velocity. scale: factor on positions of events."""
    told = tuple(reported_event(e, frame.index, frame.t, fps, scale) for e in events)
    id = groups.id
    return Tracks(
        frame.index, frame.t, plane, "group", id, id.copy(), groups.pos.copy(), groups.vel.copy(), cov, None,
        np.ones(len(id)), groups, told,
    )  # fmt: skip
