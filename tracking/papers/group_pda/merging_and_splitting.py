"""Merging and splitting of `group-pda`'s groups, the onsets of both, and groups that follow the same people.

Merging (sec. 3.1, 3.2): which groups are near with like velocities, for how long, and their union. Input: the bank of
groups after the update of a frame; output: the bank with merged groups, and the events. The relation R_x holds for two
groups whose search regions (ellipses about the centroids) overlap and whose velocities are alike. G_x are the connected
components of groups under R_x; each becomes one group. With `corrections` velocities are alike if their difference, on
the mean of two steps, is at most `merge_velocity`, people of both are at most 1.5 m apart, and R_x must hold for
`merge_time`; without, if the regions SR_v overlap. Only groups that are measured well merge (see `GroupMerging.step`).

Onsets (ours): when an event that is known now began. A merge is known `merge_time` after its onset. A split is known
when its parts have long been apart; its onset is measured from the group's earlier points, divided among the parts.
Distances are metres on the ground (in an image depth is stretched to it). The distances and velocities of the truth's
rules come from sim.truth.merge_split_rules.

Splitting (sec. 3.3): a group without feasible associations falls apart. An association (a set of points that may be a
group's) is feasible if its points form one group under the group constraint G_y (tracking.filters.components). `split`
partitions the points (M, 2) of a group without feasible associations by G_y and replaces its row of the bank by one row
per part. A group of one part stays, one of noise only is removed. `children` makes the rows of the parts. Lengths are
in the unit of the points (m on the ground or px), times in s.

Of two groups that follow the same people the one with fewer people of its own becomes lost (ours). Groups that share
points are each measured by all of them. Without this rule a group that is hidden or has left would follow another one
for ever. For `coast_time` that is allowed, as hidden people come out again.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sim.truth.merge_split_rules import MERGE_DISTANCE, SPLIT_DISTANCE, SPLIT_VELOCITY
from sim.types import Array, Ints
from tracking.filters.components import partition, regions_overlap
from tracking.grouping.link_rule import ARRIVAL
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.group_pda.association import thinned
from tracking.papers.group_pda.association_mass_kernels import GATE_FACTOR
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces, newborn
from tracking.papers.group_pda.scaled_parameters import SPLIT_SPEED, ScaledParameters

# s before and after a moment over which the difference of two groups' velocities is averaged: the time of one step, so
# that the sway of people has no part in it.
STEP_TIME = 0.5
SPLIT_CHORD = 0.4  # s before and after a moment over which the velocity of a part that leaves is a chord.
# Distance of the last person in a row from its middle, in standard deviations: 1 for two people, 1.2 for three.
REACH = 1.1


class PairMoment(NamedTuple):
    """Two groups a and b at one time; a has the smaller id.

    t: s. velocity (2,): that of b less that of a, as filtered, m/s on the ground. middle (2,): point half-way between
    the centroids, in the unit of the points. gap: distance of their nearest people, m; negative if, from pixels, they
    overlap.
    """

    t: float
    velocity: Array
    middle: Array
    gap: float


def merge_onset(moments: list[PairMoment], most: float) -> int:
    """Returns the index of the moment since which two groups have been near with velocities that differ by at most
    `most`, m/s, on the mean of two steps; the number of moments if they are not."""
    t, v = np.array([m.t for m in moments]), np.array([m.velocity for m in moments])
    first, last = windows(t, STEP_TIME)
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(v, 0)])
    mean = (total[last + 1] - total[first]) / (last + 1 - first)[:, None]
    before = (np.hypot(*mean.T) > most) | (np.array([m.gap for m in moments]) > MERGE_DISTANCE)
    return int(np.flatnonzero(before)[-1]) + 1 if before.any() else 0


def windows(t: Array, half: float) -> tuple[Ints, Ints]:
    """Returns the first and the last index (K,) of the times t (K,), s, ascending, that are at most `half` s from each
    time; near both ends from the middle of the outermost window."""
    middle = np.clip(t, min(t[0] + half, t[-1]), max(t[-1] - half, t[0]))
    return np.searchsorted(t, middle - half - 1e-9), np.searchsorted(t, middle + half + 1e-9) - 1


def chords(t: Array, d: Array, half: float) -> Array:
    """Returns speeds (K,) of the positions d (K, 2) at the times t (K,), s, ascending: chords of their `windows`."""
    k, (first, last) = np.arange(len(t)), windows(t, half)
    first, last = np.minimum(first, np.maximum(k - 1, 0)), np.maximum(last, np.minimum(k + 1, len(t) - 1))
    return np.asarray(np.hypot(*(d[last] - d[first]).T) / np.maximum(t[last] - t[first], 1e-9))


def split_onset(
    recent: list[tuple[float, Array]], parts: list[Array], metres_per_unit: Array, body_cov: Array, known: float
) -> tuple[float, Array]:
    """Returns when, in s, a group began to divide into two parts, and its centroid (2,) at that time, in the points'
    unit."""
    before = [(t, y * metres_per_unit) for t, y in recent if t <= known + 1e-9]
    if len(before) < 2:
        t, y = before[0] if before else (known, parts[0] * metres_per_unit)
        return known, y.mean(0) / metres_per_unit
    middle = np.array([p.mean(0) for p in parts]) * metres_per_unit
    way = middle[1] - middle[0]
    way = metres_per_unit * way / max(float(np.hypot(*way)), 1e-9)
    spread = [max(float(way @ (np.cov(p.T, bias=True) - body_cov) @ way), 0.0) if len(p) > 1 else 0.0 for p in parts]
    reach = REACH * float(np.sqrt(spread).sum())
    times, apart = [], []
    for t, y in reversed(before):
        side = np.square(y[:, None] - middle).sum(2).argmin(1)
        middle = np.array([y[side == k].mean(0) if (side == k).any() else middle[k] for k in range(2)])
        times.append(t)
        apart.append(middle[1] - middle[0])
    when, d = np.array(times[::-1]), np.array(apart[::-1])
    gap = np.hypot(*d.T) - reach
    slow = chords(when, d, SPLIT_CHORD) < SPLIT_VELOCITY
    together = (gap <= MERGE_DISTANCE) | ((gap <= SPLIT_DISTANCE) & slow)
    k = min(int(np.flatnonzero(together)[-1]) + 1 if together.any() else 0, len(when) - 1)
    return float(when[k]), before[k][1].mean(0) / metres_per_unit


HISTORY_TIME = 5.0  # s of a pair's past that are kept.
PATIENCE = 1.5  # s for which the past of a pair is kept while the two are not near or one of them cannot merge.

Pair = tuple[int, int]  # Ids of two groups, the smaller first.


class GroupMerging:
    """Merges groups that stay near with like velocities.

    State: moments, a dict by pair of ids (the smaller first): a `PairMoment` for each frame of the last 5 s in which
    the two groups were near and could merge, oldest first. A pair is kept for 1.5 s after the last of them.
    """

    def __init__(self) -> None:
        self.moments: dict[Pair, list[PairMoment]] = {}

    def step(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
        """Merge the groups for which R_x (near, with like velocities) holds; yield their events. t: s."""
        able = np.flatnonzero(bank.confirmed & (bank.last_seen >= t) & (bank.null_time <= 0))
        near = {ids: self._extended(ids, now) for ids, now in _near_pairs(bank, able, scaled, t)}
        self.moments = {p: past for p, past in self.moments.items() if t - past[-1].t <= PATIENCE} | near
        onset = {pair: k for pair, moments in near.items() if (k := _onset(bank, pair, moments, scaled))}
        for ids in _connected(list(onset)):
            rows = np.flatnonzero(np.isin(bank.id, ids))
            first = min((m for pair, m in onset.items() if pair[0] in ids), key=lambda m: m.t)
            union = merged(bank, rows)
            present = bank.id[rows][(first.t - bank.first_seen[rows] > ARRIVAL) | (bank.parent[rows] != NO_ID)]
            keep = np.ones(len(bank), bool)
            keep[rows] = False
            bank.keep(keep)
            bank.add(union)
            heir = int(union.id[0])
            bank.parent[np.isin(bank.parent, ids)] = heir
            kind = "merge" if len(present) > 1 else "enter"
            yield WholeGroupEvent(kind, first.t, tuple(sorted(ids)), (heir,), tuple(first.middle.tolist()))

    def _extended(self, pair: Pair, now: PairMoment) -> list[PairMoment]:
        return [*(m for m in self.moments.get(pair, []) if m.t > now.t - HISTORY_TIME), now]


def _onset(bank: GroupBank, pair: Pair, moments: list[PairMoment], scaled: ScaledParameters) -> PairMoment | None:
    c = scaled.config
    if not c.corrections:
        rows = np.array([int(np.flatnonzero(bank.id == id)[0]) for id in pair])
        overlap = regions_overlap(bank.x[rows, 2:], bank.P[rows, 2:, 2:], c.gate)  # SR_v
        return moments[-1] if overlap[0, 1] else None
    k = merge_onset(moments, c.merge_velocity)
    due = k < len(moments) and moments[-1].t - moments[k].t >= c.merge_time - 1e-9
    return moments[k] if due else None


def merged(bank: GroupBank, rows: Ints) -> GroupBank:
    """Returns a bank of one row, the union (eq. 3.1) of the groups in `rows` (at least one); `bank` is not changed."""
    size = np.asarray(bank.size[rows].sum())
    w = bank.size[rows] / size
    x = w @ bank.x[rows]
    d = bank.x[rows, :2] - x[:2]
    extent = np.einsum("k,kij->ij", w, bank.extent[rows] + d[:, :, None] * d[:, None, :])
    P = np.einsum("k,kij->ij", w * w, bank.P[rows])
    heir = rows[np.lexsort((bank.id[rows], bank.first_seen[rows], -np.rint(bank.size[rows])))[0]]
    members = [bank.members[r] for r in rows.tolist()]
    offset = np.concatenate([bank.positions(r) - x[:2] for r in rows.tolist()])
    last_seen, known = (np.concatenate([getattr(m, name) for m in members]) for name in ("last_seen", "known"))
    one = slice(heir, heir + 1)
    return GroupBank(
        x[None], P[None], extent[None], size[None].copy(), bank.id[one], bank.first_seen[rows].min(keepdims=True),
        bank.last_seen[rows].max(keepdims=True), bank.measured_time[rows].max(keepdims=True), np.zeros(1), size[None],
        np.full(1, NO_ID), x[None, :2].copy(), bank.colour_hist[rows].sum(0, keepdims=True),
        [MemberPlaces(offset, last_seen, known)], [[]],
    )  # fmt: skip


def _near_pairs(bank: GroupBank, rows: Ints, scaled: ScaledParameters, t: float) -> Iterator[tuple[Pair, PairMoment]]:
    """Yields the pairs of groups whose search regions overlap: ids, the smaller first; the pair in this frame."""
    close = regions_overlap(bank.x[rows, :2], bank.extent[rows], scaled.config.gate)
    for i, j in np.argwhere(np.triu(close, 1)).tolist():
        i, j = sorted((i, j), key=lambda k: bank.id[rows[k]])
        a, b = bank.x[rows[i], :2], bank.x[rows[j], :2]
        d, v = ((q[1] - q[0]) * scaled.metres_per_unit for q in ((a, b), bank.x[rows[[i, j]], 2:]))
        gap = _gap(bank, rows[i], rows[j], d, scaled)
        yield (int(bank.id[rows[i]]), int(bank.id[rows[j]])), PairMoment(t, v, (a + b) / 2, gap)


def _gap(bank: GroupBank, a: int, b: int, d: Array, scaled: ScaledParameters) -> float:
    if not scaled.from_pixels:
        return _nearest(bank.positions(a) * scaled.metres_per_unit, bank.positions(b) * scaled.metres_per_unit)
    return float(np.hypot(*d)) - REACH * sum(_people_sd(bank, k, d, scaled) for k in (a, b))


def _nearest(here: Array, there: Array) -> float:
    tree = cKDTree(there, balanced_tree=False, compact_nodes=False)
    most = tree.query(here[::100])[0].min()
    return float(tree.query(here, distance_upper_bound=1.001 * most + 1e-9)[0].min())


def _people_sd(bank: GroupBank, row: int, way: Array, scaled: ScaledParameters) -> float:
    n, n0 = bank.size[row], scaled.constraint.strength
    factor = scaled.kernel_rules[GATE_FACTOR]
    people = ((n + n0) * factor * bank.extent[row] - n0 * scaled.constraint.prior) / n - scaled.body_cov
    along = scaled.metres_per_unit * way / max(float(np.hypot(*way)), 1e-9)
    return float(np.sqrt(max(along @ people @ along, 0.0)))


def _connected(pairs: list[Pair]) -> list[list[int]]:
    parts: list[set[int]] = []
    for pair in pairs:
        touched = [p for p in parts if p & set(pair)]
        parts = [p for p in parts if not p & set(pair)] + [set(pair).union(*touched)]
    return [sorted(p) for p in parts]


def split(
    bank: GroupBank, row: int, points: Array, weights: Array, scaled: ScaledParameters, t: float, ids: GroupIds
) -> WholeGroupEvent | None:
    """Replace the group in `row` by those that its points (M, 2) form under G_y; return the event of a confirmed
    group."""
    group = partition(points, weights, scaled.constraint)
    confirmed = bank.id[row] != NO_ID
    if group.max(initial=-1) < 1:
        bank.null_time[row] = 0.0
        if group.max(initial=-1) == 0:
            return None
        leave = WholeGroupEvent("leave", t, (int(bank.id[row]),), (), tuple(bank.x[row, :2].tolist()))
        bank.remove(row)
        return leave if confirmed else None
    parts = children(bank, row, points, weights, group, scaled, t)
    away = np.hypot(*(parts.x[:, :2] - bank.x[row, :2]).T)
    largest, other = np.lexsort((parts.x[:, 1], parts.x[:, 0], away, -parts.size))[:2].tolist()
    if confirmed:
        parts.id[:] = [bank.id[row] if k == largest else ids.new() for k in range(len(parts))]
    two = [thinned(points[group == k]) for k in (largest, other)]
    onset, place = split_onset(bank.recent_points[row], two, scaled.metres_per_unit, scaled.body_cov, t)
    event = WholeGroupEvent(
        "split", onset, (int(bank.id[row]),), tuple(sorted(parts.id.tolist())), tuple(place.tolist())
    )
    bank.remove(row)
    bank.add(parts)
    return event if confirmed else None


def children(
    bank: GroupBank, row: int, points: Array, weights: Array, group: Ints, scaled: ScaledParameters, t: float
) -> GroupBank:
    """Returns a bank of the groups into which the group in `row` splits; `bank` is not changed."""
    parts = newborn(points, weights, group, scaled, t)
    parts.first_seen[:], parts.measured_time[:] = bank.first_seen[row], bank.measured_time[row]
    parts.colour_hist[:] = bank.colour_hist[row]
    if bank.id[row] == NO_ID:
        parts.parent[:], parts.origin[:] = bank.parent[row], bank.origin[row]
    if scaled.config.corrections:
        parts.x[:, 2:] = bank.x[row, 2:]
        parts.P[:, 2:, 2:] = bank.P[row, 2:, 2:] + (scaled.scale * SPLIT_SPEED) ** 2 * np.eye(2)
    return parts


LEAST_MEASURED = 0.55  # Two groups may be one and the same if a smaller share of their people together is measured.


def may_be_one(bank: GroupBank, i: int, j: int) -> bool:
    """Returns True if so few people of the groups in rows i and j of the bank are measured that the two may be one
    group."""
    return bool(LEAST_MEASURED * (bank.size[i] + bank.size[j]) > bank.own_people[i] + bank.own_people[j])


class DuplicateGroups:
    """Finds pairs of groups that follow the same people.

    State: clock, a dict: the time, s, by pair of ids (the smaller first) of groups whose search regions overlap.
    A time grows in frames in which the two may be the same group and falls in the others; at 0, or once the regions do
    not overlap, the pair is dropped.
    """

    def __init__(self) -> None:
        self.clock: dict[tuple[int, int], float] = {}

    def step(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> None:
        """Advance the clocks by a frame, at time t (s), and make one group lost of each pair whose clock has passed
        `coast_time`."""
        rows = np.flatnonzero(bank.confirmed & (bank.last_seen >= t))
        rows = rows[np.argsort(bank.id[rows])]
        pairs = {(int(bank.id[i]), int(bank.id[j])): (i, j) for i, j in _overlapping(bank, rows, scaled.config.gate)}
        clock = {}
        for ids, (i, j) in pairs.items():
            clock[ids] = self.clock.get(ids, 0.0) + (scaled.dt if may_be_one(bank, i, j) else -scaled.dt)
        self.clock = {ids: s for ids, s in clock.items() if s > 0}
        for ids in [ids for ids, s in self.clock.items() if s > scaled.config.coast_time + 1e-9]:
            if ids not in self.clock:
                continue  # one of them has just become lost
            row = _with_fewer_own(bank, *pairs[ids])
            lost_at = t - max(scaled.config.coast_time, scaled.dt) - 1e-6
            bank.last_seen[row] = min(bank.last_seen[row], lost_at)
            self.clock = {pair: s for pair, s in self.clock.items() if bank.id[row] not in pair}


def _overlapping(bank: GroupBank, rows: Ints, gate: float) -> Iterator[tuple[int, int]]:
    near = regions_overlap(bank.x[rows, :2], bank.extent[rows], gate)
    return ((int(rows[i]), int(rows[j])) for i, j in np.argwhere(np.triu(near, 1)).tolist())


def _with_fewer_own(bank: GroupBank, i: int, j: int) -> int:
    share: Array = bank.own_people[[i, j]] / bank.size[[i, j]]
    return min((i, j), key=lambda row: (share[0] if row == i else share[1], -bank.first_seen[row], -bank.id[row]))
