"""Groups and events of tracks do not depend on how many frames are added at once, and memory is bounded."""

from __future__ import annotations

import functools
import itertools
import pickle
from collections import Counter
from dataclasses import dataclass, fields, is_dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import GroupEvent, Groups, Tracks
from tracking.grouping.grouped_tracks import GroupsSoFar
from tracking.grouping.grouping_choice import grouping_of

FPS = 2.5
SCALE = 18.8  # px per m
SCENES = ("merge", "split", "cross", "queue", "waiting", "mixed")
NAMED = ("none", "all", "late", "members", "until", "events", "own")


@functools.cache
def truth_of(name, seed, fps):
    return simulate(load(name, set=[f"camera.fps={fps}"]), seed, streams=()).truth


@dataclass(frozen=True)
class Case:
    """Tracks of people of a scene, and how groups are filled in.

    plane: "ground", "image" (points in px), or "boxes" (boxes whose places on the ground are known). named: which
    groups and events the tracker reports. block: s after which people are forgotten. length: share of the frames.
    """

    name: str = "mixed"
    seed: int = 30_000
    mess: int = 0
    plane: str = "ground"
    named: str = "none"
    rule: str = "belief"
    objective: bool = False
    block: float = 20.0
    length: float = 1.0
    fps: float = FPS  # with 10, steps of the belief have 4 frames

    def tracks(self):
        """The tracks of the frames: rows in any order, positions that err, gaps, and predicted people."""
        truth, r = truth_of(self.name, self.seed, self.fps), np.random.default_rng(self.mess)
        ids = np.unique(truth.id)
        names = dict(zip(ids.tolist(), r.permutation(3 * len(ids))[: len(ids)].tolist(), strict=True))
        there, seen = (spells(r, truth.length, ids, share) for share in (0.12, 0.15))
        blind = r.random() < 0.3  # velocities unknown
        return [
            self.frame(truth, k, r, names, there[k - 1], seen[k - 1], blind)
            for k in range(1, 1 + max(1, round(self.length * truth.length)))
        ]

    def frame(self, truth, k, r, names, there, seen, blind):
        now = truth.at(k)
        kept = r.permutation(np.flatnonzero([there[p] for p in now.id.tolist()]))
        scale = 1.0 if self.plane == "ground" else SCALE
        pos = (now.pos[kept] + r.normal(0, 0.1, (len(kept), 2))) * scale
        vel = np.where(blind | (r.random((len(kept), 1)) < 0.1), np.nan, now.vel[kept] * scale)
        box = np.column_stack([pos - [10, 15], np.tile([20.0, 30.0], (len(kept), 1))])
        id = np.array([names[p] for p in now.id[kept].tolist()], np.int64)
        measured = np.array([seen[p] for p in now.id[kept].tolist()], bool)
        group, none = now.group[kept], np.full(len(kept), -1)
        named = {
            "none": False, "late": k > truth.length / 3, "until": k < truth.length / 3, "members": False,
            "events": False, "own": True, "all": True,
        }[self.named]  # fmt: skip
        groups, events, own = None, (), ()
        if self.named == "members":
            parts = tuple(np.sort(id[group == g]) for g in np.unique(group[group >= 0]))
            n = len(parts)
            groups = Groups(
                np.unique(group[group >= 0]), parts, np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2, 2)),
                np.array([float(len(p)) for p in parts]), (),
            )  # fmt: skip
        if self.named in ("events", "own") and k in (17, 40):
            kind = "cross" if self.named == "events" else "merge"
            events = (GroupEvent(kind, k - 5, k - 1, k, (-1, 2), (2,), (1, 2, 3), (1.0, 2.0)),)
        if self.named == "own":
            own = ("merge", "split")
        plane = "ground" if self.plane == "ground" else "image"
        return Tracks(
            k, (k - 1) / self.fps, plane, "person", id, group if named else none, pos, vel,
            np.zeros((len(kept), 4, 4)), box if self.plane == "boxes" else None, np.ones(len(kept)),
            groups, events, own_events=own, seen=measured,
        )  # fmt: skip

    def groups(self):
        places = on_ground if self.plane == "boxes" else None
        scale = SCALE if self.plane == "image" else 1.0
        made = GroupsSoFar(self.fps, scale, grouping_of(self.rule), objective=self.objective, places=places)
        made.block = round(self.block * self.fps)
        return made


def spells(r, length, ids, share):
    """By frame and id, False in spells of some frames and in some long ones; `share` of the short ones."""
    out = {p: np.ones(length, bool) for p in ids.tolist()}
    for flags in out.values():
        for _ in range(r.poisson(share * length / 3)):
            at = r.integers(0, length)
            flags[at : at + r.geometric(0.4)] = False
        if r.random() < 0.3:
            at = r.integers(0, length)
            flags[at : at + r.integers(10, 120)] = False
    return [{p: bool(flags[k]) for p, flags in out.items()} for k in range(length)]


def on_ground(tracks):
    """Where boxes stand: of a ground that is seen from the side, farther away the higher it is in the image."""
    box = np.concatenate([np.zeros((0, 4)), *(t.box for t in tracks)])
    foot = box[:, :2] + box[:, 2:] * [0.5, 1.0]
    return np.column_stack([foot[:, 0], 1.5 * foot[:, 1]]) / SCALE


def in_portions(groups, tracks, sizes):
    """The tracks with groups and events, with as many frames added at once as `sizes` says in turn."""
    out, low, sizes = [], 0, itertools.cycle(sizes)
    while low < len(tracks):
        high = low + next(sizes)
        out += groups.add(tracks[low:high])
        low = high
    return groups.ended(out)


def assert_same(found, expected):
    """To the last bit."""
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert bits(one) == bits(other), one.index


def bits(value):
    """Everything in a value, with the bytes of its arrays."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if is_dataclass(value):
        return [(f.name, bits(getattr(value, f.name))) for f in fields(value)]
    return [bits(x) for x in value] if isinstance(value, list | tuple) else repr(value)


@st.composite
def cases(draw):
    some = st.sampled_from
    fps, share = draw(some(((FPS, 1.0), (FPS, 1.0), (10.0, 0.3))))
    return Case(
        draw(some(SCENES)), 30_000, draw(st.integers(0, 99)),
        draw(some(("ground", "image", "boxes"))), draw(some(NAMED)), draw(some(("belief", "belief", "rule"))),
        draw(st.booleans()), draw(some((6.0, 20.0, 60.0))), share * draw(st.floats(0.3, 1.0)), fps,
    )  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(cases(), st.lists(st.one_of(st.integers(1, 9), st.integers(10, 200)), min_size=1, max_size=6))
def test_any_number_of_frames_at_once_gives_the_same(case, sizes):
    tracks = case.tracks()
    assert_same(in_portions(case.groups(), tracks, sizes), in_portions(case.groups(), tracks, [len(tracks)]))


SOME = (
    Case("mixed", block=6.0, length=0.3, fps=10.0), Case("cross", named="all"),
    Case("merge", named="late", plane="image"),
    Case("queue", rule="rule"), Case("waiting", plane="boxes", block=6.0), Case("split", named="members"),
    Case("split", rule="rule"),
    Case("mixed", named="until", objective=True), Case("queue", named="events", plane="boxes", rule="rule"),
)  # fmt: skip


@pytest.mark.parametrize("case", SOME, ids=lambda c: f"{c.name}-{c.plane}-{c.named}-{c.rule}")
def test_frames_one_by_one_give_the_same(case):
    tracks = case.tracks()
    expected = in_portions(case.groups(), tracks, [len(tracks)])
    assert_same(in_portions(case.groups(), tracks, [1]), expected)
    assert_same(in_portions(case.groups(), tracks, [7]), expected)


@settings(max_examples=8, deadline=None)
@given(cases(), st.floats(0.1, 0.9), st.integers(4, 60))
def test_groups_that_are_pickled_between_two_frames_go_on(case, share, size):
    tracks = case.tracks()
    half, whole = round(share * len(tracks)), case.groups()
    whole.add(tracks[:half])
    again = pickle.loads(pickle.dumps(whole))
    assert_same(in_portions(again, tracks[half:], [size]), in_portions(whole, tracks[half:], [len(tracks)]))


def walkers(paths, there=None, ids=None):
    """Tracks of people on these paths (T, P, 2), m; there (T, P): False where a person is absent; ids (T, P)."""
    there = np.ones(paths.shape[:2], bool) if there is None else there
    ids = np.broadcast_to(np.arange(paths.shape[1]), there.shape) if ids is None else ids
    out = []
    for k, (pos, seen, id) in enumerate(zip(paths, there, ids, strict=True)):
        n = int(seen.sum())
        rest = np.full((n, 2), np.nan), np.zeros((n, 4, 4)), None, np.ones(n)
        out.append(Tracks(k + 1, k / FPS, "ground", "person", id[seen], np.full(n, -1), pos[seen], *rest))
    return out


def strolling(frames, pairs=2):
    """Paths (T, 2 pairs, 2) of pairs who walk 8 m apart, two and two 0.8 m apart; they sway by some cm."""
    y = np.array([[8.0 * k, 8.0 * k + 0.8] for k in range(pairs)]).ravel()
    x = np.arange(frames)[:, None] / FPS + np.zeros(len(y))
    return np.stack([x, y + np.zeros_like(x)], axis=2) + np.random.default_rng(0).normal(0, 0.03, (frames, len(y), 2))


@pytest.mark.parametrize("sizes", [(7,), (13, 1, 60), (1000,)])
@pytest.mark.parametrize("gone", [40, 49, 50, 51, 80, 99])
def test_who_was_not_seen_for_some_time_is_forgotten(sizes, gone):
    """After 20 to 40 s: at the end of the first block of 50 frames throughout which the person was absent."""
    frames = 240
    there = np.ones((frames, 4), bool)
    there[gone:, 3] = False
    tracks, groups = walkers(strolling(frames), there), Case().groups()
    low, sizes = 0, itertools.cycle(sizes)
    while low < frames:
        size = next(sizes)
        groups.add(tracks[low : low + size])
        low = min(low + size, frames)
        known = 3 in groups.ids.tolist()
        assert known == (low < 50 * -(-gone // 50) + 50)
        pairs = groups.finder.history.pairs
        assert list(zip(groups.ids[pairs.a].tolist(), groups.ids[pairs.b].tolist(), strict=True)) == [
            (0, 1), *([(2, 3)] * known)
        ]  # fmt: skip
        assert (3 in groups.labels.people.linked) <= known
        assert (3 in groups.history.measured) == known


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_pairs_who_parted_are_forgotten_though_they_stay(size):
    """They are less than 4 m apart until frame 66."""
    paths = strolling(150, 1)
    paths[60:, 1, 1] += np.minimum(np.arange(90) * 0.5, 20)
    tracks, groups = walkers(paths), Case().groups()
    for low, high in ((0, 99), (99, 100), (100, 149), (149, 150)):
        for k in range(low, high, size):
            groups.add(tracks[k : min(k + size, high)])
        assert len(groups.finder.history.pairs.a) == (high < 150)
    assert groups.ids.tolist() == [0, 1]


def test_who_returns_after_being_forgotten_is_a_new_person():
    """With the id of before, or with another: the groups and events are the same."""
    frames, back = 300, 180
    paths, there = strolling(frames), np.ones((frames, 4), bool)
    paths[:, 3, 1] += np.interp(np.arange(frames), [back, back + 30, back + 60], [5, 5, 0])
    paths[:back, 3, 1] -= 5
    there[40:back, 3] = False
    ids = np.tile(np.arange(4), (frames, 1))
    other = np.where((np.arange(frames) >= back)[:, None] & (ids == 3), 4, ids)
    found, expected = (in_portions(Case().groups(), walkers(paths, there, x), [9]) for x in (ids, other))
    assert {"leave", "merge", "form"} & {e.kind for t in found for e in t.events}
    for one, new in zip(found, expected, strict=True):
        assert one.group.tolist() == new.group.tolist()
        events = [(*bits(e)[:6], tuple(3 if p == 4 else p for p in e.members), bits(e.pos)) for e in new.events]
        assert [(*bits(e)[:6], e.members, bits(e.pos)) for e in one.events] == events


def sizes_of(value, place="", seen=None):
    """Yields place and number of entries of every array, list, dict and set in a state."""
    seen = set() if seen is None else seen
    if id(value) in seen or isinstance(value, str | bytes):
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        yield place, value.size
    elif isinstance(value, list | tuple | dict | set | frozenset | Counter):
        yield place, len(value)
        for part in value.values() if isinstance(value, dict) else value:
            yield from sizes_of(part, f"{place}[]", seen)
    else:
        names = [
            *getattr(value, "__dict__", ()),
            *(n for c in type(value).__mro__ for n in getattr(c, "__slots__", ())),
        ]
        for name in names:
            yield from sizes_of(getattr(value, name), f"{place}.{name}", seen)


def coming_and_going(seconds):
    """Tracks of people who walk in ones to threes, in both directions through a corridor, for 8 to 20 s. Some stop one
    behind another for 6 s, others part."""
    r, frames = np.random.default_rng(0), int(seconds * FPS)
    rows, name = [[] for _ in range(frames)], 0
    for start in range(-20, frames, 12):
        (way, stops, part), y = r.integers(0, 2, 3) * [2, 1, 1] - [1, 0, 0], r.uniform(0, 3)
        lasts = np.arange(int(r.integers(20, 50)))
        along = np.interp(lasts, [0, 10, 10 + 15 * stops, 100], [0, 5, 5, 5 + 0.5 * (90 - 15 * stops)])
        for k in range(int(r.integers(1, 4))):
            name += 1
            x = 7 - way * 7 + way * (along - 0.8 * k * stops)
            beside = 0.7 * k * (1 - stops) + k * part * np.interp(lasts, [18, 30], [0, 4])
            pos = np.column_stack([x, y + beside]) + r.normal(0, 0.03, (len(lasts), 2))
            for t, place in zip(lasts + start, pos, strict=True):
                if 0 <= t < frames:
                    rows[t].append((name, place))
    for k, now in enumerate(rows):
        n = len(now)
        pos = np.array([place for _, place in now]).reshape(n, 2)
        rest = np.full((n, 2), np.nan), np.zeros((n, 4, 4)), None, np.ones(n)
        id = np.array([p for p, _ in now], np.int64)
        yield Tracks(k + 1, k / FPS, "ground", "person", id, np.full(n, -1), pos, *rest)


@pytest.mark.parametrize("rule", ["belief", "rule"])
def test_the_state_does_not_grow_with_time(rule):
    """Every array, list, dict and set of it, over 3,000 s in which people come and go."""
    groups, tracks = GroupsSoFar(FPS, rule=grouping_of(rule)), coming_and_going(3_000.0)
    most, kinds, size = ({}, {}), Counter(), 100
    for portion in iter(lambda: list(itertools.islice(tracks, size)), []):
        kinds.update(e.kind for t in groups.add(portion) for e in t.events)
        part = most[0] if groups.end <= 600 * FPS else most[1] if groups.end > 2_400 * FPS else {}
        now = Counter()
        for place, count in sizes_of(groups):
            now[place] += count
        for place, count in now.items():
            part[place] = max(part.get(place, 0), count)
    grown = {place: (most[0].get(place, 0), n) for place, n in most[1].items() if n > 1.5 * most[0].get(place, 0) + 10}
    assert grown == {}
    assert {"cross", "queue", "merge", "split", "dissolve", "leave", "enter"} <= kinds.keys()
