"""Do two groups keep their ids through an encounter? One definition, for every mode of benchmarks/group_pda.py.

An encounter of two true groups reaches from the first frame in which their hulls are within 1 m of each other on the
ground to the last one. A group's estimated id is the one that it is matched with, by the overlap of hulls, in more than
half of the frames of a second: the last one before the encounter, the first one after it. Where no whole second is
before, it is the first second in which both groups are matched; where none is after, the last one in which both are
there; and so for two groups that are never within 1 m. Kept: both have one id before and after, and not the same one.
Who is in an estimated hull is judged by places, for all trackers alike; hulls with one person inside are left out, as
in the scores.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sim.geometry.polygons import gap_pairs, pack
from sim.truth.encounters import CROSS_GAP
from sim.types import Array, Groups, Ints, Tracks, Truth
from tracking.scoring.evaluation import labelled_frames, plane_of
from tracking.scoring.group_scores import hull_pairs, matched_groups, shared_members
from tracking.scoring.people_and_groups import group_rows, people_inside, true_people

SECOND = 1.0
NEVER = (2**31, 0)


@dataclass(frozen=True)
class Encounter:
    """Two true groups, the frames (from 1) in which both are there, and the first and last one of their being near."""

    a: int
    b: int
    frames: tuple[int, ...]
    first: int
    last: int


@dataclass(frozen=True)
class Fate:
    """What became of an encounter: both ids kept; one estimated hull held most of both groups for a second in all."""

    kept: bool
    merged: bool


def meeting(truth: Truth, a: int, b: int) -> Encounter:
    """The encounter of two groups, near or not."""
    frames, gap = _gaps(truth, a, b)
    near = frames[gap <= CROSS_GAP].tolist()
    return Encounter(a, b, tuple(frames.tolist()), *((near[0], near[-1]) if near else NEVER))


def met(truth: Truth) -> list[Encounter]:
    """The two groups of each true crossing; where there is none, every two groups that come within 1 m and neither
    become one nor were one."""
    crossed = [(meeting(truth, *e.before), e) for e in truth.events or () if e.kind == "cross"]
    if crossed:
        return [Encounter(m.a, m.b, m.frames, e.start, e.end) for m, e in crossed]
    assert truth.groups is not None
    names = sorted({g for here in truth.groups for g in here.id.tolist()})
    kin = [set(side) for e in truth.events or () for side in (e.before, e.after)]
    apart = [(a, b) for a, b in combinations(names, 2) if not any({a, b} <= side for side in kin)]
    return [e for pair in apart if (e := meeting(truth, *pair)).first <= e.last]


def _gaps(truth: Truth, a: int, b: int) -> tuple[Ints, Array]:
    """The frames in which both groups are there, and the distance of their hulls on the ground, m."""
    hulls = [_hulls(truth.groups or (), name) for name in (a, b)]
    both = sorted(hulls[0].keys() & hulls[1].keys())
    rows = np.arange(len(both))
    if not both:
        return rows, np.zeros(0)
    one, other = (pack([of[f] for f in both]) for of in hulls)
    return np.array(both), gap_pairs(one, other, rows, rows)


def _hulls(groups: Sequence[Groups], name: int) -> dict[int, Array]:
    """The hull of one group by frame."""
    return {f: here.hull[k] for f, here in enumerate(groups, 1) for k in np.flatnonzero(here.id == name).tolist()}


class Match:
    """Which estimated group each true one is in each frame. id: by (frame, true id), where it is matched; held: the
    rows of the estimated hulls with more than half of its people, by the same."""

    def __init__(self, truth: Truth, tracks: Sequence[Tracks]) -> None:
        image = plane_of(truth, tracks) == "image"
        groups, scale = (truth.groups_px, truth.px_per_m) if image else (truth.groups, 1.0)
        assert groups is not None
        frames = labelled_frames(truth)
        people, index = true_people(truth, frames), np.flatnonzero(frames)
        places = people.positions_on("image" if image else "ground", "ground")
        assert places is not None
        true = group_rows(index, [groups[f - 1] for f in index.tolist()], people.rows)
        told = [(t.index, t.groups) for t in tracks if frames[t.index] and t.groups is not None]
        est = group_rows(np.array([f for f, _ in told], np.int64), [g for _, g in told], people.rows)
        est = people_inside(est, people.rows, places, scale)
        est = est.keep(est.count != 1)
        pairs = matched_groups(true.pos, est.pos, hull_pairs(true, est))
        key = list(zip(true.rows.frame.tolist(), true.rows.id.tolist(), strict=True))
        self.id = {key[i]: g for i, g in zip(pairs.i.tolist(), est.rows.id[pairs.j].tolist(), strict=True)}
        shared = shared_members(true, est, est.member, len(people.rows))
        i, j = np.divmod(shared.key, max(shared.width, 1))
        most = 2 * shared.count > true.count[i]
        self.held: dict[tuple[int, int], set[int]] = {}
        for row, hull in zip(i[most].tolist(), j[most].tolist(), strict=True):
            self.held.setdefault(key[row], set()).add(hull)

    def fate(self, e: Encounter, fps: float) -> Fate:
        """What became of the two groups."""
        before, after = self._seconds(e, round(SECOND * fps))
        ids = [(self._most(group, before), self._most(group, after)) for group in (e.a, e.b)]
        kept = all(x is not None and x == y for x, y in ids) and ids[0][0] != ids[1][0]
        none: set[int] = set()
        together = sum(bool(self.held.get((f, e.a), none) & self.held.get((f, e.b), none)) for f in e.frames)
        return Fate(kept, together >= SECOND * fps)

    def _seconds(self, e: Encounter, n: int) -> tuple[Sequence[int], Sequence[int]]:
        """The frames by which the groups get their ids, before and after."""
        before, after = ([f for f in e.frames if f < e.first][-n:], [f for f in e.frames if f > e.last][:n])
        if e.first > e.last or len(before) < n:
            before = [f for f in e.frames if (f, e.a) in self.id and (f, e.b) in self.id][:n]
        if e.first > e.last or len(after) < n:
            after = list(e.frames[-n:])
        return before, after

    def _most(self, group: int, frames: Sequence[int]) -> int | None:
        """The id that a true group is matched with in more than half of these frames."""
        seen = Counter(self.id[f, group] for f in frames if (f, group) in self.id).most_common(1)
        return seen[0][0] if seen and 2 * seen[0][1] > len(frames) else None


def fates(truth: Truth, tracks: Sequence[Tracks]) -> list[Fate]:
    """What became of every encounter of a sequence."""
    found = met(truth)
    match = Match(truth, tracks) if found else None
    return [] if match is None else [match.fate(e, truth.fps) for e in found]
