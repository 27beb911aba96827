"""Do two groups keep their ids through an encounter? For `benchmarks.group_pda`.

An encounter of two true groups lasts from the first to the last frame in which their hulls are within 1 m of each
other on the ground. The estimated id of a true group is the id that it is matched with, by the overlap of hulls, in
more than half of the frames of a second. Before the encounter that second is the last one before it, or, if there is
no whole second before it, the first one in which both groups are matched. After the encounter it is the first one
after it, or, if there is no whole second, the last one in which both groups are present. The ids are kept if each
group has the same id before and after, and the two ids differ. The people in an estimated hull are found by position,
for all trackers alike. Hulls with one person inside are left out, as in the scores.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sim.geometry.polygons import gap_pairs, pack
from sim.truth.crossing_events import CROSS_GAP
from sim.types import Array, Groups, Ints, Tracks, Truth
from tracking.scoring.evaluation import labelled_frames
from tracking.scoring.ground_or_image import plane_of
from tracking.scoring.group_rows import group_rows, people_inside
from tracking.scoring.groups import hull_pairs, matched_groups
from tracking.scoring.people import true_people

SECOND = 1.0


@dataclass(frozen=True)
class Encounter:
    """Ids of two true groups, the frames (from 1) in which both are present, and the first and last near frame."""

    a: int
    b: int
    frames: tuple[int, ...]
    first: int
    last: int


def encounters(truth: Truth) -> list[Encounter]:
    """Returns the encounters of a sequence: the two groups of each true crossing.

    Without a crossing: every two groups that come within 1 m and take part in no common merge or split.
    """
    crossed = [e for e in truth.events or () if e.kind == "cross"]
    if crossed:
        return [Encounter(*e.before, tuple(_gaps(truth, *e.before)[0].tolist()), e.start, e.end) for e in crossed]
    assert truth.groups is not None
    names = sorted({g for here in truth.groups for g in here.id.tolist()})
    kin = [set(side) for e in truth.events or () for side in (e.before, e.after)]
    found = []
    for a, b in combinations(names, 2):
        frames, gap = _gaps(truth, a, b)
        near = frames[gap <= CROSS_GAP].tolist()
        if near and not any({a, b} <= side for side in kin):
            found.append(Encounter(a, b, tuple(frames.tolist()), near[0], near[-1]))
    return found


def _gaps(truth: Truth, a: int, b: int) -> tuple[Ints, Array]:
    """Returns the frames in which both groups are present, and the distance of their hulls on the ground, m."""
    hulls = [_hulls(truth.groups or (), name) for name in (a, b)]
    both = sorted(hulls[0].keys() & hulls[1].keys())
    rows = np.arange(len(both))
    if not both:
        return rows, np.zeros(0)
    one, other = (pack([of[f] for f in both]) for of in hulls)
    return np.array(both), gap_pairs(one, other, rows, rows)


def _hulls(groups: Sequence[Groups], name: int) -> dict[int, Array]:
    """Returns the hull of one group by frame."""
    return {f: here.hull[k] for f, here in enumerate(groups, 1) for k in np.flatnonzero(here.id == name).tolist()}


class GroupMatches:
    """The id of the estimated group that is matched with each true group, by (frame, true id)."""

    def __init__(self, truth: Truth, tracks: Sequence[Tracks]) -> None:
        image = plane_of(truth, tracks) == "image"
        groups, scale = (truth.groups_px, truth.px_per_m) if image else (truth.groups, 1.0)
        assert groups is not None
        frames = labelled_frames(truth)
        people, index = true_people(truth, frames), np.flatnonzero(frames)
        places = people.positions_on("image" if image else "ground", "ground")
        assert places is not None
        true = group_rows(index, [groups[f - 1] for f in index.tolist()], people.rows)
        reported = [(t.index, t.groups) for t in tracks if frames[t.index] and t.groups is not None]
        est = group_rows(np.array([f for f, _ in reported], np.int64), [g for _, g in reported], people.rows)
        est = people_inside(est, people.rows, places, scale)
        est = est.keep(est.count != 1)
        pairs = matched_groups(true.pos, est.pos, hull_pairs(true, est))
        key = list(zip(true.rows.frame.tolist(), true.rows.id.tolist(), strict=True))
        self.id = {key[i]: g for i, g in zip(pairs.i.tolist(), est.rows.id[pairs.j].tolist(), strict=True)}

    def keep_ids(self, e: Encounter, fps: float) -> bool:
        """Returns True if both groups have the same id before and after an encounter."""
        before, after = self._seconds(e, round(SECOND * fps))
        ids = [(self._most(group, before), self._most(group, after)) for group in (e.a, e.b)]
        return all(x is not None and x == y for x, y in ids) and ids[0][0] != ids[1][0]

    def _seconds(self, e: Encounter, n: int) -> tuple[Sequence[int], Sequence[int]]:
        """Returns the frames that decide the ids before and after an encounter; n: frames of a second."""
        before, after = ([f for f in e.frames if f < e.first][-n:], [f for f in e.frames if f > e.last][:n])
        if len(before) < n:
            before = [f for f in e.frames if (f, e.a) in self.id and (f, e.b) in self.id][:n]
        if len(after) < n:
            after = list(e.frames[-n:])
        return before, after

    def _most(self, group: int, frames: Sequence[int]) -> int | None:
        """Returns the id that a true group is matched with in more than half of the frames, or None."""
        seen = Counter(self.id[f, group] for f in frames if (f, group) in self.id).most_common(1)
        return seen[0][0] if seen and 2 * seen[0][1] > len(frames) else None


def ids_kept(truth: Truth, tracks: Sequence[Tracks]) -> list[bool]:
    """Returns for every encounter of a sequence whether both groups keep their ids."""
    found = encounters(truth)
    matches = GroupMatches(truth, tracks) if found else None
    return [] if matches is None else [matches.keep_ids(e, truth.fps) for e in found]
