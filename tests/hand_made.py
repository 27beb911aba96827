"""Small truths and tracks written down by hand: people on a line or a plane, groups with rectangles for hulls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sim.types import GroupEvent, Groups, Tracks, Truth

FPS = 10.0

# Id → place, m.
People = Mapping[int, tuple[float, float]]

# x0, y0, x1, y1.
Rectangle = tuple[float, float, float, float]


class Scene:
    """One frame: people, and groups as id → (members, rectangle or None for one of 1 m round each member's place)."""

    def __init__(self, people: People, groups: Mapping[int, tuple[Sequence[int], Rectangle | None]] | None = None):
        self.people = dict(people)
        self.given = dict(groups or {})

    @property
    def id(self) -> np.ndarray:
        return np.array(sorted(self.people), np.int64)

    @property
    def pos(self) -> np.ndarray:
        return np.array([self.people[p] for p in sorted(self.people)], float).reshape(-1, 2)

    @property
    def group(self) -> np.ndarray:
        of = {p: g for g, (members, _) in self.given.items() for p in members}
        return np.array([of.get(p, -1) for p in sorted(self.people)], np.int64)

    def groups(self, named: bool = True) -> Groups:
        """Middles of the rectangles; extent: of the members' places; without names, members and sizes are unknown."""
        n = len(self.given)
        rectangles = [r or self._round(members) for members, r in self.given.values()]
        hulls = tuple(np.array([(a, b), (c, b), (c, d), (a, d)], float) for a, b, c, d in rectangles)
        places = [np.array([self.people[p] for p in m if p in self.people]) for m, _ in self.given.values()]
        extent = [np.cov(p.T, bias=True) if len(p) else np.full((2, 2), np.nan) for p in places]
        members = [np.array(sorted(m) if named else [], np.int64) for m, _ in self.given.values()]
        return Groups(
            np.array(list(self.given), np.int64), tuple(members),
            np.array([h.mean(axis=0) for h in hulls]).reshape(-1, 2), np.zeros((n, 2)),
            np.array(extent).reshape(-1, 2, 2), np.array([float(len(m)) if named else np.nan for m in members]), hulls,
        )  # fmt: skip

    def _round(self, members: Sequence[int]) -> Rectangle:
        x, y = np.array([self.people[p] for p in members]).T
        return x.min() - 0.5, y.min() - 0.5, x.max() + 0.5, y.max() + 0.5


def truth(scenes: Sequence[Scene], events: Sequence[GroupEvent] | None = (), **changes) -> Truth:
    """The truth of some frames from 1 on."""
    frame = np.concatenate([np.full(len(s.id), k) for k, s in enumerate(scenes, 1)]).astype(np.int64)
    id, group, pos = (np.concatenate([getattr(s, name) for s in scenes]) for name in ("id", "group", "pos"))
    made = Truth(
        "hand-made", FPS, len(scenes), 40.0, frame, id, group, pos, np.zeros_like(pos), None, np.ones(len(id)),
        groups=tuple(s.groups() for s in scenes), labelled=np.ones(len(scenes), bool),
        events=None if events is None else tuple(events),
    )  # fmt: skip
    return made.replace(**changes)


def with_rows(true: Truth, kept: np.ndarray, **changes) -> Truth:
    """A truth with these rows of it only."""
    names = ("frame", "id", "group", "pos", "vel", "box", "visibility", "visible_box", "z", "heading", "height")
    columns = {name: getattr(true, name) for name in (*names, "truncation")}
    rows = {name: None if values is None else values[kept] for name, values in columns.items()}
    return true.replace(**{**rows, **changes})


def tracks(scenes: Sequence[Scene], events: Sequence[GroupEvent] = (), *, unit: str = "person", plane: str = "ground"):
    """A tracker's answers from frame 1 on; an event is told in the frame in which it was `emitted`."""
    found = []
    for index, s in enumerate(scenes, 1):
        groups = s.groups(named=unit == "person")
        id, group, pos = (s.id, s.group, s.pos) if unit == "person" else (groups.id, groups.id, groups.pos)
        n, told = len(id), tuple(e for e in events if e.emitted == index)
        zero, cov = np.zeros((n, 2)), np.zeros((n, 4, 4))
        now = (index - 1) / FPS
        found.append(Tracks(index, now, plane, unit, id, group, pos, zero, cov, None, np.ones(n), groups, told))
    return found


def event(kind: str, start: int, members: Sequence[int], emitted: int | None = None, pos=(0.0, 0.0)) -> GroupEvent:
    """An event of these people; what it says about ids of groups is not scored."""
    return GroupEvent(kind, start, start, emitted, (), (), tuple(members), pos)
