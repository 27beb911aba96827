"""Events of both sides in terms of true people, so that they can be compared: who was concerned, who came from whom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from sim.types import Array, Bools, GroupEvent, Ints, Tracks
from tracking.scoring.events import COUNTS_AS, HEADLINE, KINDS, LATE, Part, Told
from tracking.scoring.row_lookup import Lives
from tracking.scoring.rows import Crowd, People
from tracking.scoring.similarity import Rows

HULLS = 2.0  # s before and after an event in which hulls tell who is in a group: the time of the merge rule
CHANGES = frozenset(HEADLINE) | {kind for kind, as_ in COUNTS_AS.items() if as_ in HEADLINE}


def true_events(
    events: Iterable[GroupEvent], people: Rows, group: Ints, places: Array | None, frames: Bools
) -> list[Told]:
    """The truth's events that start in frames f with frames[f]; group (R,) of people.

    places (R, 2): where people are in the plane compared, if that is not the events' own.
    """
    lives, label = Lives(people), _labels(group)

    def tell(event: GroupEvent) -> Told:
        before = _by_label(event.members, lambda m: label[lives.last(m, event.start - 1, 0)])
        after = _by_label(event.members, lambda m: label[lives.next(m, event.start, 0)])
        pos = event.pos if places is None else _middle(event, lives, places)
        members = Part(frozenset(event.members))
        before, after = _by_kind(event, before, after)
        if event.kind not in CHANGES or sorted(before) == sorted(after):  # the labels tell nothing
            return Told(event.kind, event.start, None, members, pos)
        parents, children = (tuple(Part(frozenset(part)) for part in parts) for parts in (before, after))
        return Told(event.kind, event.start, None, members, pos, parents, children)

    return [tell(event) for event in events if _counts(event, frames)]


def _counts(event: GroupEvent, frames: Bools) -> bool:
    known = event.kind in KINDS or event.kind in COUNTS_AS
    return known and 0 <= event.start < len(frames) and bool(frames[event.start])


def _labels(group: Ints) -> list[int]:
    """The group of each row, and -1 for the row -1, which is nobody's."""
    return [*group.tolist(), -1]


def _by_label(members: Sequence[int], label: Callable[[int], int]) -> list[list[int]]:
    """Members by their group; who has none is alone."""
    parts: dict[tuple[int, int], list[int]] = {}
    for m in members:
        g = label(m)
        parts.setdefault((g, -1) if g >= 0 else (-1, m), []).append(m)
    return list(parts.values())


def _by_kind(
    event: GroupEvent, before: list[list[int]], after: list[list[int]]
) -> tuple[list[list[int]], list[list[int]]]:
    """Parents and children. Labels for life are the same before and after: form and dissolve speak for themselves."""
    if sorted(before) != sorted(after):
        return before, after
    one, alone = [list(event.members)], [[m] for m in event.members]
    return {"form": (alone, one), "dissolve": (one, alone)}.get(event.kind, (before, after))


def _middle(event: GroupEvent, lives: Lives, places: Array) -> tuple[float, float]:
    rows = [row for m in event.members if (row := lives.nearest(m, event.start, 0)) >= 0]
    if not rows:
        return float("nan"), float("nan")
    x, y = places[rows].mean(axis=0)
    return float(x), float(y)


def told_events(
    answers: Sequence[Tracks], people: People, stands_for: Ints, true: Rows, frames: Bools, fps: float
) -> list[Told]:
    """A tracker's events of people that start in frames f with frames[f]. stands_for (R,): the row of `true` that each
    of `people` is mapped to, -1 nobody.

    A member is who they are mapped to at the event's start, or in the nearest frame within 1 s of it. Parents are the
    groups of the frame before the one in which the tracker said so, children those of that frame; where they are the
    same (it changed its groups first and said so later), parents are those of the frame before the start.
    """
    reach = round(LATE * fps)
    identified, lives, label = Lives(people.rows, stands_for >= 0), Lives(people.rows), _labels(people.group)
    person = np.append(true.id, -1)[stands_for].tolist()

    def until(event: GroupEvent, frame: int) -> list[list[int]]:
        return _by_label(event.members, lambda m: label[lives.last(m, frame, reach)])

    def tell(event: GroupEvent, said: int) -> Told:
        after = _by_label(event.members, lambda m: label[lives.next(m, said, reach)])
        before = until(event, said - 1)
        before = until(event, event.start - 1) if sorted(before) == sorted(after) else before
        before, after = _by_kind(event, before, after)
        rows = {m: identified.nearest(m, event.start, reach) for m in event.members}
        known = {m: person[row] for m, row in rows.items() if row >= 0}
        parents, children = (tuple(_part(p, known) for p in parts) for parts in (before, after))
        return Told(event.kind, event.start, said, _part(event.members, known), event.pos, parents, children)

    return [tell(event, said) for event, said in _said(answers, frames) if event.members]


def _part(members: Sequence[int], known: Mapping[int, int]) -> Part:
    """These tracks as the people they are known to be."""
    who = frozenset(known[m] for m in members if m in known)
    return Part(who, len(members) - len(who))


def told_without_people(
    answers: Sequence[Tracks], groups: Crowd, true: Rows, frames: Bools, fps: float, people: bool
) -> list[Told]:
    """The events of a method that names no members: compared by their places, their parents and children by who is in
    the hulls. groups: with rows of `true` for members. people: whether the method does name some elsewhere.

    Parents are whom the hulls held in the 2 s before the event's start (before it was said, if one of them is younger),
    children in the 2 s from when it was said.
    """
    span, who = round(HULLS * fps), true.id[groups.who]

    def tell(event: GroupEvent, said: int) -> Told:
        end = event.start if _youngest(groups.rows, event.before) < event.start else said
        parents = _held(groups, who, event.before, range(end - span, end))
        children = _held(groups, who, event.after, range(said, said + span))
        return Told(event.kind, event.start, said, None, event.pos, parents, children)

    return [tell(event, said) for event, said in _said(answers, frames) if not (people and event.members)]


def _youngest(rows: Rows, ids: Sequence[int]) -> int:
    """The first frame of the one that came last, 0 if none ever came; rows sorted by frame."""
    frames = [rows.frame[rows.id == id] for id in ids]
    return max((int(own[0]) for own in frames if len(own)), default=0)


def _held(groups: Crowd, who: Ints, names: Sequence[int], span: range) -> tuple[Part, ...]:
    """Whom each of these groups held in these frames; who (K,): the true id of each member.

    One picture does not tell: hulls of people who stand behind each other overlap in it. Everybody is in one group at
    most, the one that held him in most frames (of two the lower id), if that was in more than half of its own.
    """
    rows, now = groups.rows, (groups.rows.frame >= span.start) & (groups.rows.frame < span.stop)
    told = Counter(rows.id[now].tolist())
    held = now[groups.of]
    pairs, times = np.unique(np.stack([who[held], rows.id[groups.of[held]]]), axis=1, return_counts=True)
    holder: dict[int, tuple[int, int]] = {}  # of each person: in how many frames, and less its id
    for person, group, n in zip(*pairs.tolist(), times.tolist(), strict=True):
        holder[person] = max(holder.get(person, (0, 0)), (n, -group))
    return tuple(
        Part(frozenset(p for p, (n, less) in holder.items() if -less == name and 2 * n > told[name])) for name in names
    )


def _said(answers: Sequence[Tracks], frames: Bools) -> list[tuple[GroupEvent, int]]:
    """A tracker's events and the frame in which each was said: that of the answer it stands in, whatever it claims."""
    return [(event, t.index) for t in answers for event in t.events if _counts(event, frames)]
