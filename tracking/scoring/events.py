"""Scores of events and of lineage: a tracker's events matched one to one to the true ones, kind by kind.

Two events match if their kind is equal, their starts are at most 1 s apart and their people agree: the Jaccard index of
the members is at least 0.5. If a tracker names no people, the positions must be at most 1.5 m apart instead. `form`
counts as merge and `dissolve` as split. Lineage: a matched merge or split is right if its parents and its children are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array

KINDS = ("merge", "split", "cross", "queue", "enter", "leave")
COUNTS_AS = {"form": "merge", "dissolve": "split"}
HEADLINE = ("merge", "split")
LATE = 1.0  # s: greatest difference of the starts
ALIKE = 0.5  # least Jaccard index of the members
NEAR = 1.5  # m: greatest distance if no members are named
SAME_PART = 0.5  # two parts are the same if their Jaccard index exceeds this; then no other part can be the same

PersonIds = frozenset[int]


@dataclass(frozen=True, slots=True)
class EventMembers:
    """The members of an event, or of one group before or after it, as true people."""

    people: PersonIds  # ids of true people
    unmatched: int = 0  # number of further members that are mapped to no true person, or to one already in `people`

    def jaccard(self, other: EventMembers) -> float:
        """Returns the number of common people / the number of all members of both, 0 if both are empty. Each unmatched
        member counts in the denominator only."""
        common = len(self.people & other.people)
        whole = len(self.people | other.people) + self.unmatched + other.unmatched
        return common / whole if whole else 0.0


@dataclass(frozen=True, slots=True)
class ComparableEvent:
    """An event whose members are true people, so that a true and a tracker's event can be compared."""

    kind: str  # "merge", "split", "cross", "queue", "enter", "leave", "form" or "dissolve"
    start: int  # frame number from 1 in which the event begins
    emitted: int | None  # frame number of the `Tracks` that report it; None in the truth
    members: EventMembers | None  # the people concerned; None if the tracker names no people
    pos: tuple[float, float]  # x, y, in m on the ground or px in the image; nan unknown
    # parents, children: one `EventMembers` per group (or single person) before and after the event; None if unknown
    parents: tuple[EventMembers, ...] | None = None
    children: tuple[EventMembers, ...] | None = None

    @property
    def has_lineage(self) -> bool:
        """True if parents and children are known."""
        return self.parents is not None and self.children is not None


@dataclass(frozen=True, slots=True)
class MatchedEvents:
    """All events of one kind in a sequence, of the truth and of a tracker, and which of them match."""

    # "merge", "split", "cross", "queue", "enter" or "leave"; "form" is among the merges, "dissolve" among the splits
    kind: str
    # true, est: the true events and the tracker's events of this kind, matched or not
    true: Sequence[ComparableEvent]
    est: Sequence[ComparableEvent]
    # the matched events, each (true event, tracker's event); an event is in one pair at most
    pairs: Sequence[tuple[ComparableEvent, ComparableEvent]]


def match_events(
    true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], fps: float, scale: float
) -> list[MatchedEvents]:
    """Returns one `MatchedEvents` per kind, in the order of `KINDS`, also for kinds without events. scale: units of
    `pos` per metre. Of several matchings, one with the most pairs is taken, then the most similar."""
    found = []
    for kind in KINDS:
        a, b = ([e for e in side if COUNTS_AS.get(e.kind, e.kind) == kind] for side in (true, est))
        found.append(MatchedEvents(kind, a, b, _one_to_one(a, b, _similarity(a, b, fps, scale))))
    return found


def _similarity(true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], fps: float, scale: float) -> Array:
    """Returns the similarity (N, M) of true and estimated events, 0 if they cannot be matched."""
    starts = [np.array([e.start for e in side], float) for side in (true, est)]
    late = np.abs(starts[0][:, None] - starts[1][None]) / fps
    similarity = np.zeros(late.shape)
    for i, j in np.argwhere(late <= LATE + 1e-9).tolist():
        a, b = true[i], est[j]
        if a.members is not None and b.members is not None:
            s = a.members.jaccard(b.members)
            similarity[i, j] = s if s >= ALIKE - 1e-12 else 0.0
        else:
            d = float(np.hypot(a.pos[0] - b.pos[0], a.pos[1] - b.pos[1])) / scale
            similarity[i, j] = 1 - d / (2 * NEAR) if d <= NEAR + 1e-9 else 0.0
    # Between equally similar events the one with the nearer start wins.
    return np.where(similarity > 0, similarity + (LATE - late) * 1e-3, 0.0)


def _one_to_one(
    true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], similarity: Array
) -> list[tuple[ComparableEvent, ComparableEvent]]:
    if not similarity.any():
        return []
    from scipy.optimize import linear_sum_assignment

    one_more = 2.0 * min(similarity.shape)  # outweighs the total similarity of all pairs
    rows, columns = linear_sum_assignment(np.where(similarity > 0, one_more + similarity, 0.0), maximize=True)
    return [(true[i], est[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if similarity[i, j] > 0]


def same_lineage(true: ComparableEvent, est: ComparableEvent) -> bool:
    """Returns True if both events have equally many parents and equally many children, and these agree. They agree if
    each true part has an estimated part with a Jaccard index above 0.5. False if any lineage is unknown."""
    if true.parents is None or true.children is None or est.parents is None or est.children is None:
        return False
    return _same_parts(true.parents, est.parents) and _same_parts(true.children, est.children)


def _same_parts(true: Sequence[EventMembers], est: Sequence[EventMembers]) -> bool:
    return len(true) == len(est) and all(any(a.jaccard(b) > SAME_PART for b in est) for a in true)
