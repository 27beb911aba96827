"""Merging of `group-pda`'s groups (sec. 3.1, 3.2): which are near with like velocities, for how long, and their union.

Input: the bank of groups after the update of a frame; output: the bank with merged groups, and the events. The relation
R_x holds for two groups whose search regions (ellipses about the centroids) overlap and whose velocities are alike. G_x
are the connected components of groups under R_x; each becomes one group. Departures: the velocity test is a physical
difference (`merge_velocity`), R_x must hold for `merge_time`, and only groups that are measured well take part
(see `GroupMerging.step`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sim.geometry.polygons import polygon_gap
from sim.truth.merge_split_rules import SPLIT_DISTANCE
from sim.types import Array, Bools, Ints
from tracking.filters.components import regions_overlap
from tracking.grouping.link_rule import ARRIVAL
from tracking.grouping.whole_groups import NO_ID, WholeGroupEvent
from tracking.papers.group_pda.association_mass_kernels import GATE_FACTOR
from tracking.papers.group_pda.event_onsets import REACH, PairHistory, PairMoment
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces, alike_velocities
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

HISTORY_TIME = 5.0  # s of a pair's past that are kept.
# Factor on gamma for merging: groups merge at a smaller distance than they split, as their extents are noisy.
GATE_MARGIN = 0.9
PATIENCE = 1.5  # s for which the history of a pair is kept while one of the groups cannot merge.

Pair = tuple[int, int]  # Ids of two groups, the smaller first.


class NearPair(NamedTuple):
    """Two groups whose search regions (ellipses about the centroids) overlap or whose points are linked in this frame.

    ids: of the two groups, the smaller first. alike: True if their velocities are alike and, from pixels, their people
    are at most 2.5 m apart. moment: the pair in this frame: time (s), difference of centroids (m), place half-way, gap
    between nearest people (m).
    """

    ids: Pair
    alike: bool
    moment: PairMoment


class GroupMerging:
    """Merges groups that stay near with like velocities.

    State: histories, a dict by pair of ids (the smaller first): the `PairHistory` of each pair of groups that are near
    each other, or were within the last 1.5 s while one of them could not merge.
    """

    def __init__(self) -> None:
        self.histories: dict[Pair, PairHistory] = {}

    def step(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
        """Merge the groups for which R_x (near, with like velocities) has held for `merge_time`; yield their events. t:
        s."""
        able = np.flatnonzero(bank.confirmed & (bank.last_seen >= t) & (bank.null_time <= 0))
        near = {pair.ids: self._extended(pair) for pair in _near_pairs(bank, able, scaled, t)}
        unable = {int(g) for g in bank.id[bank.confirmed]} - set(bank.id[able].tolist())
        kept = {p: h for p, h in self.histories.items() if unable & set(p) and t - h.moments[-1].t <= PATIENCE}
        self.histories = near | kept
        due = [p for p, history in near.items() if t - history.alike_since >= scaled.config.merge_time - 1e-9]
        for ids in _connected(due):
            rows = np.flatnonzero(np.isin(bank.id, ids))
            onset, place = min(
                (self.histories[p].merge_onset(scaled.config.merge_velocity) for p in due if p[0] in ids),
                key=lambda found: found[0],
            )
            union = merged(bank, rows)
            present = bank.id[rows][(onset - bank.first_seen[rows] > ARRIVAL) | (bank.parent[rows] != NO_ID)]
            keep = np.ones(len(bank), bool)
            keep[rows] = False
            bank.keep(keep)
            bank.add(union)
            heir = int(union.id[0])
            bank.parent[np.isin(bank.parent, ids)] = heir
            kind = "merge" if len(present) > 1 else "enter"
            yield WholeGroupEvent(kind, onset, tuple(sorted(ids)), (heir,), tuple(place.tolist()))

    def _extended(self, pair: NearPair) -> PairHistory:
        before, now = self.histories.get(pair.ids, PairHistory(np.inf, [])), pair.moment
        moments = [m for m in before.moments if m.t > now.t - HISTORY_TIME]
        return PairHistory(min(before.alike_since, now.t) if pair.alike else np.inf, [*moments, now])


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


def _near_pairs(bank: GroupBank, rows: Ints, scaled: ScaledParameters, t: float) -> Iterator[NearPair]:
    close = regions_overlap(bank.x[rows, :2], bank.extent[rows], GATE_MARGIN * scaled.config.gate)
    close |= _linked(bank, rows, scaled)
    v, cov = bank.x[rows, 2:], bank.P[rows, 2:, 2:]
    alike = alike_velocities(v[:, None] - v, cov[:, None] + cov, 0.0, scaled)
    for i, j in np.argwhere(np.triu(close, 1)).tolist():
        i, j = sorted((i, j), key=lambda k: bank.id[rows[k]])
        a, b = bank.x[rows[i], :2], bank.x[rows[j], :2]
        d = (b - a) * scaled.metres_per_unit
        gap = _gap(bank, rows[i], rows[j], d, scaled)
        far = scaled.from_pixels and gap > SPLIT_DISTANCE  # regions overlap, as bodies cover the ground behind them
        ids = (int(bank.id[rows[i]]), int(bank.id[rows[j]]))
        yield NearPair(ids, bool(alike[i, j]) and not far, PairMoment(t, d, (a + b) / 2, gap))


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


def _linked(bank: GroupBank, rows: Ints, scaled: ScaledParameters) -> Bools:
    found = np.eye(len(rows), dtype=bool)
    place, link = [bank.positions(r) for r in rows.tolist()], scaled.constraint.link
    low, high = (np.array([f(p, axis=0) for p in place]).reshape(-1, 2) for f in (np.min, np.max))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(2, initial=-np.inf)
    for i, j in np.argwhere(np.triu(gap <= link, 1)).tolist():
        if scaled.from_pixels:
            d = polygon_gap(place[i], place[j]) if min(len(place[i]), len(place[j])) > 2 else gap[i, j]
            found[i, j] = found[j, i] = d <= link
        else:
            found[i, j] = found[j, i] = _nearest(place[i], place[j]) <= link
    return found


def _connected(pairs: list[Pair]) -> list[list[int]]:
    parts: list[set[int]] = []
    for pair in pairs:
        touched = [p for p in parts if p & set(pair)]
        parts = [p for p in parts if not p & set(pair)] + [set(pair).union(*touched)]
    return [sorted(p) for p in parts]
