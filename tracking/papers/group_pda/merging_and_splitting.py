"""Merging and splitting of `group-pda`'s groups, and the onsets of both.

Merging (sec. 3.1, 3.2): which groups are near with like velocities, for how long, and their union. Input: the bank of
groups after the update of a frame; output: the bank with merged groups, and the events. The relation R_x holds for two
groups whose search regions (ellipses about the centroids) overlap and whose velocities are alike. G_x are the connected
components of groups under R_x; each becomes one group. With `corrections` there is evidence over time (ours), as of a
Markov chain of two states: a moment speaks for one group the more, the smaller the difference of velocities is beside
`merge_velocity`, on the mean of two steps, and against it if people of both are more than 1.5 m apart. From points the
velocities are those of the members who are seen in both of two frames (`anchor` of the bank). Since the onset, when the
sum was least, it must have grown by `merge_time`. Without, velocities are alike if the regions SR_v overlap. Groups
that are not measured, or infeasible, do not merge.

Splitting (sec. 3.3, 4.2): a group without feasible associations for `split_time` falls apart. An association (a set of
points that may be a group's) is feasible if its points form one group under the group constraint G_y
(tracking.filters.components). `fall_apart` partitions the points (M, 2) of such a group by G_y and replaces its row of
the bank by one row per part. A group that G_y leaves whole stays. With `corrections` the parts stay parts of one group
(ours), and so do newborn groups beside a member: misses, sway and noise take people apart for a moment. Each part is
tracked by itself; the group is their union (eq. 3.1), which is reported and merges with others. Parts that R_x relates
become one row again. Sets of parts whose people have been more than 1.5 m from the rest's for `confirm_time` split off.

Onsets (ours): when an event that is known now began, by the moments of the two groups or parts. Distances are metres on
the ground (in an image depth is stretched to it). The distances and velocities of the truth's rules come from
sim.truth.merge_split_rules. Lengths are in the unit of the points (m on the ground or px), times in s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, SPLIT_VELOCITY
from sim.types import Array, Bools, Ints
from tracking.filters.components import partition, regions_overlap
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces, Unshared, newborn
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

# s before and after a moment for the difference of two groups' or parts' velocities: that of two steps in all.
WALK_TIME = 0.8
BEFORE = 16  # Places by which the way before the first moment is known.


class PairMoment(NamedTuple):
    """Two groups a and b at one time; a has the smaller id.

    t: s. way, velocity (2,): from a's anchor to b's, m on the ground, and b's velocity less a's, as filtered, m/s.
    middle (2,): mean of the centroids, weighted by people, in the unit of the points. gap: distance of their nearest
    people, m.
    """

    t: float
    way: Array
    velocity: Array
    middle: Array
    gap: float


def merge_onset(moments: list[PairMoment], alike: float) -> tuple[int, float]:
    """Returns the index of the moment since which two groups are most probably one, and the evidence for it, s."""
    t = np.array([m.t for m in moments])
    total = np.concatenate([[0.0], np.cumsum(likeness(moments, alike)[1:] * np.diff(t))])
    k = len(total) - 1 - int(total[::-1].argmin())
    return k, float(total[-1] - total[k])


def likeness(moments: list[PairMoment], alike: float) -> Array:
    """Returns how much each of K moments is evidence that two groups are one, (K,): -1 (against) to 1 (for).

    It is for one group if people of both are near and the velocities, averaged over two steps, differ by less than
    `alike`, m/s; else against it. Before the first moment, the two are taken to have moved with the velocity that the
    filter then had.
    """
    t, gap = np.array([m.t for m in moments]), np.array([m.gap for m in moments])
    before = np.linspace(-2 * WALK_TIME, 0, BEFORE, endpoint=False)
    came = moments[0].way + before[:, None] * moments[0].velocity
    way = np.concatenate([came, np.array([m.way for m in moments])])
    differ = chords(np.concatenate([t[0] + before, t]), way, WALK_TIME)[BEFORE:]
    return np.where(gap > MERGE_DISTANCE, -1.0, np.maximum(1 - np.square(differ / alike), -1.0))


def chords(t: Array, d: Array, half: float) -> Array:
    """Returns speeds (K,) of the positions d (K, 2) at the times t (K,), s, ascending: chords over `half` s before and
    after each time; near both ends those of the outermost whole chord."""
    middle, k = np.clip(t, min(t[0] + half, t[-1]), max(t[-1] - half, t[0])), np.arange(len(t))
    first = np.minimum(np.searchsorted(t, middle - half - 1e-9), np.maximum(k - 1, 0))
    last = np.maximum(np.searchsorted(t, middle + half + 1e-9) - 1, np.minimum(k + 1, len(t) - 1))
    return np.asarray(np.hypot(*(d[last] - d[first]).T) / np.maximum(t[last] - t[first], 1e-9))


def split_onset(moments: list[PairMoment]) -> PairMoment:
    """Returns the moment since which two parts of a group have been apart, if they parted as fast as they do now.

    Its time may be before the first moment; the rest is that of the next known moment."""
    now, speed = moments[-1], np.hypot(*moments[-1].velocity)
    t = float(now.t - max(now.gap - MERGE_DISTANCE, 0.0) / max(speed, SPLIT_VELOCITY))
    return next(m for m in moments if m.t >= t)._replace(t=t)


HISTORY_TIME = 5.0  # s of a pair's past that are kept.

Pair = tuple[int, int]  # Ids of two groups, the smaller first.


class GroupChanges:
    """Splits groups whose parts have come apart, and merges parts and groups that stay near with like velocities.

    State: moments, a dict by pair of ids (the smaller first): a `PairMoment` for each of the last 5 s in which the two
    were near, or parts of one group, and could merge, oldest first. A pair is kept for `coast_time` after the last.
    """

    def __init__(self) -> None:
        self.moments: dict[Pair, list[PairMoment]] = {}

    def step(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
        """Splits groups, and merges parts and groups, in the bank, in place, at time t, s; yields their events."""
        # First: an id that a part has from its lost group must not bring that group's past, if it is older.
        patience = scaled.config.coast_time + 1e-9
        self.moments = {p: past for p, past in self.moments.items() if t - past[-1].t <= patience}
        yield from self._split(bank, scaled, t)
        self._join_parts(bank, scaled, t)
        yield from self._merge(bank, scaled, t)

    def _split(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
        for group in np.unique(bank.group[bank.confirmed & (bank.parent != NO_ID)]).tolist():
            rows = np.flatnonzero(bank.group == group)
            for i, j in combinations(rows[_measured(bank, t)[rows]].tolist(), 2):
                self._extend(bank, i, j, scaled, t)
            pairs = [_pair(bank, i, j) for i, j in combinations(rows.tolist(), 2)]
            linked = [pair for pair in pairs if not self._apart(pair, scaled, t)]
            parts = [np.flatnonzero(np.isin(bank.id, ids)) for ids in _connected(linked, bank.id[rows].tolist())]
            if len(parts) > 1:
                yield from self._split_into(bank, group, parts, scaled, t)

    def _apart(self, pair: Pair, scaled: ScaledParameters, t: float) -> bool:
        if not scaled.config.corrections:
            return True
        moments = self.moments.get(pair, [])
        if not moments or moments[-1].t < t:
            return False  # one of them is not measured
        near = max((m.t for m in moments if m.gap <= MERGE_DISTANCE), default=moments[0].t)
        return t - near > scaled.config.confirm_time + 1e-9

    def _split_into(
        self, bank: GroupBank, group: int, parts: list[Ints], scaled: ScaledParameters, t: float
    ) -> Iterator[WholeGroupEvent]:
        heads = [rows[np.lexsort((-bank.size[rows], bank.id[rows] != group))[0]] for rows in parts]
        apart = []
        for i, j in (pair for two in combinations(parts, 2) for pair in product(*two)):
            moments = self.moments.get(_pair(bank, i, j)) or [moment(bank, i, j, scaled, t)]
            apart.append(split_onset(moments))
        first = max(apart, key=lambda m: m.t)
        together = first.t - bank.first_seen[np.concatenate(parts)].min() > HOLD_TIME
        for rows, head in zip(parts, heads, strict=True):
            bank.parent[rows], bank.parent[head] = bank.id[head], NO_ID
        if together:
            children = tuple(sorted(bank.id[heads].tolist()))
            yield WholeGroupEvent("split", first.t, (group,), children, tuple(first.middle.tolist()))

    def _join_parts(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> None:
        near = _overlapping(bank, np.flatnonzero(bank.confirmed & _measured(bank, t)), scaled.config.gate)
        pairs = [_pair(bank, i, j) for i, j in near if bank.group[i] == bank.group[j]]
        for ids in _connected([pair for pair in pairs if _onset(bank, pair, self.moments[pair], scaled)]):
            joined = np.isin(bank.id, ids)
            union = merged(bank, np.flatnonzero(joined))
            bank.keep(~joined)
            bank.add(union)

    def _merge(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
        measured = bank.confirmed & _measured(bank, t)
        heads = bank.id[measured & (bank.parent == NO_ID)]
        whole = whole_groups(bank, np.flatnonzero(measured & np.isin(bank.group, heads)))
        onset = {}
        for i, j in _overlapping(whole, np.arange(len(whole)), scaled.config.gate):
            pair = _pair(whole, i, j)
            if found := _onset(whole, pair, self._extend(whole, i, j, scaled, t), scaled):
                onset[pair] = found
        for ids in _connected(list(onset)):
            old = np.flatnonzero(np.isin(whole.id, ids))
            first = min((m for pair, m in onset.items() if pair[0] in ids), key=lambda m: m.t)
            union, present = merged(whole, old), first.t - whole.first_seen[old] > HOLD_TIME
            heir = int(union.id[0])
            bank.keep(~(np.isin(bank.group, ids) & _measured(bank, t)))
            bank.parent[np.isin(bank.parent, ids)] = heir
            bank.add(union)
            if present.sum() > 1:
                yield WholeGroupEvent("merge", first.t, tuple(sorted(ids)), (heir,), tuple(first.middle.tolist()))

    def _extend(self, bank: GroupBank, i: int, j: int, scaled: ScaledParameters, t: float) -> list[PairMoment]:
        pair, (a, b) = _pair(bank, i, j), sorted((i, j), key=lambda row: bank.id[row])
        past = [m for m in self.moments.get(pair, []) if t - HISTORY_TIME < m.t < t]
        self.moments[pair] = [*past, moment(bank, a, b, scaled, t)]
        return self.moments[pair]


def _measured(bank: GroupBank, t: float) -> Bools:
    return np.asarray((bank.last_seen >= t) & (bank.null_time <= 0))


def _pair(bank: GroupBank, i: int, j: int) -> Pair:
    a, b = sorted((int(bank.id[i]), int(bank.id[j])))
    return a, b


def whole_groups(bank: GroupBank, rows: Ints) -> GroupBank:
    """Returns a bank with one row per group of these rows of the bank: the union of its parts."""
    group = bank.group[rows]
    found = GroupBank.empty(bank.colour_hist.shape[1])
    many = np.isin(group, bank.parent[rows])
    found.add(bank.at(rows[~many]))
    for id in np.unique(group[many]).tolist():
        union = merged(bank, rows[group == id])
        union.id[:], union.parent[:] = id, NO_ID
        found.add(union)
    return found


def _onset(bank: GroupBank, pair: Pair, moments: list[PairMoment], scaled: ScaledParameters) -> PairMoment | None:
    c = scaled.config
    if not c.corrections:
        rows = np.array([int(np.flatnonzero(bank.id == id)[0]) for id in pair])
        overlap = regions_overlap(bank.x[rows, 2:], bank.P[rows, 2:, 2:], c.gate)  # SR_v
        return moments[-1] if overlap[0, 1] else None
    k, evidence = merge_onset(moments, c.merge_velocity)
    return moments[k] if evidence >= c.merge_time - 1e-9 else None


def merged(bank: GroupBank, rows: Ints) -> GroupBank:
    """Returns a bank of one row, the union (eq. 3.1) of the groups in `rows` (at least one); `bank` is not changed."""
    size = np.asarray(bank.size[rows].sum())
    w = bank.size[rows] / size
    x = w @ bank.x[rows]
    d = bank.x[rows, :2] - x[:2]
    extent = np.einsum("k,kij->ij", w, bank.extent[rows] + d[:, :, None] * d[:, None, :])
    P = np.einsum("k,kij->ij", w * w, bank.P[rows])
    age = bank.first_seen[rows]
    heir = rows[np.lexsort((bank.id[rows], age, -np.rint(bank.size[rows]), bank.parent[rows] != NO_ID))[0]]
    members = [bank.members[r] for r in rows.tolist()]
    offset = np.concatenate([bank.positions(r) - x[:2] for r in rows.tolist()])
    last_seen, known = (np.concatenate([getattr(m, name) for m in members]) for name in ("last_seen", "known"))
    one = np.array([heir])  # a copy, not a view
    return GroupBank(
        x[None], P[None], extent[None], size[None].copy(), bank.id[one], bank.first_seen[rows].min(keepdims=True),
        bank.last_seen[rows].max(keepdims=True), bank.measured_time[rows].max(keepdims=True), np.zeros(1),
        bank.parent[one], bank.anchor[one] + bank.x[one, :2] - x[:2], bank.colour_hist[rows].sum(0, keepdims=True),
        [MemberPlaces(offset, last_seen, known)], [Unshared(float(bank.last_seen[rows].max()), x[2:], offset + x[:2])],
    )  # fmt: skip


def moment(bank: GroupBank, a: int, b: int, scaled: ScaledParameters, t: float) -> PairMoment:
    """Returns the moment at time t, s, of the groups in the rows a and b of the bank; a has the smaller id."""
    walked = bank.x[:, :2] + bank.anchor
    way, v = ((y[b] - y[a]) * scaled.metres_per_unit for y in (walked, bank.x[:, 2:]))
    w = bank.size[[a, b]] / bank.size[[a, b]].sum()
    gap = float(cdist(*(bank.positions(row) * scaled.metres_per_unit for row in (a, b))).min())
    return PairMoment(t, way, v, w @ bank.x[[a, b], :2], gap)


# G_x (sec. 3.1): connected components under R_x.
def _connected(pairs: list[Pair], alone: Iterable[int] = ()) -> list[list[int]]:
    parts: list[set[int]] = [{id} for id in alone]
    for pair in pairs:
        touched = [p for p in parts if p & set(pair)]
        parts = [p for p in parts if not p & set(pair)] + [set(pair).union(*touched)]
    return [sorted(p) for p in parts]


def fall_apart(
    bank: GroupBank, row: int, points: Array, weights: Array, scaled: ScaledParameters, t: float, ids: GroupIds
) -> None:
    """Replaces the row of the bank by one for each part of its points (M, 2) under G_y; the largest keeps its id."""
    group = partition(points, weights, scaled.constraint)
    bank.null_time[row] = 0.0
    if group.max(initial=-1) < 1:
        return
    parts = newborn(points, weights, group, scaled, t)
    away = np.hypot(*(parts.x[:, :2] - bank.x[row, :2]).T)
    largest = int(np.lexsort((parts.x[:, 1], parts.x[:, 0], away, -parts.size))[0])
    parts.first_seen[:], parts.measured_time[:] = bank.first_seen[row], bank.measured_time[row]
    parts.colour_hist[:], parts.parent[:] = bank.colour_hist[row], bank.parent[row]
    parts.anchor[:] = bank.anchor[row] + bank.x[row, :2] - parts.x[:, :2]
    parts.unshared = [part._replace(velocity=bank.x[row, 2:]) for part in parts.unshared]
    if bank.id[row] != NO_ID:
        parts.parent[:] = bank.group[row]
        parts.parent[largest] = bank.parent[row]
        parts.id[:] = [bank.id[row] if k == largest else ids.new() for k in range(len(parts))]
    bank.keep(np.arange(len(bank)) != row)
    bank.add(parts)


# The part of R_x in space (sec. 3.1).
def _overlapping(bank: GroupBank, rows: Ints, gate: float) -> Iterator[tuple[int, int]]:
    near = regions_overlap(bank.x[rows, :2], bank.extent[rows], gate)
    return ((int(rows[i]), int(rows[j])) for i, j in np.argwhere(np.triu(near, 1)).tolist())
