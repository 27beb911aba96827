"""Merging of `group-pda`'s groups (3.1, 3.2): who is near whom, how fast, since when.

Departures: tracking.papers.group_pda.tracker.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.geometry.polygons import polygon_gap
from sim.types import Array, Bools, Ints
from tracking.filters.components import regions_overlap
from tracking.papers.group_pda.association_kernels import CUT, near
from tracking.papers.group_pda.duplicate_groups import doubtful
from tracking.papers.group_pda.event_onsets import FAR_APART, REACH, Encounter
from tracking.papers.group_pda.group_bank import UNNAMED, Bank, merged
from tracking.papers.group_pda.kernel_parameters import Rules

ARRIVAL = 1.0
"""s: a group that another joins so soon after it came has arrived, as in tracking.grouping.link_rule."""
LONGEST = 5.0
"""s that is looked back at most."""
MARGIN = 0.9
"""Of gamma: groups merge a little nearer than they split, as their extents are noisy."""
OWN = 0.2
"""Share of a group that must be nearer to it than to any other for its velocity to be its own."""
PATIENCE = 1.5
"""s that an encounter outlasts without a look at both groups."""


@dataclass(frozen=True)
class Change:
    """kind of GroupEvent; since, s: when it began; ids before and after; pos (2,)."""

    kind: str
    since: float
    before: tuple[int, ...]
    after: tuple[int, ...]
    pos: tuple[float, float]


class Merging:
    """Merging (3.1, 3.2) on updated states. State: the encounters of each two groups."""

    def __init__(self) -> None:
        self.met: dict[tuple[int, int], Encounter] = {}

    def step(self, bank: Bank, rules: Rules, t: float) -> Iterator[Change]:
        """Merge groups for which that has been so for `merge_time`; one that joins soon after it came has entered.

        Only those do that have an id, were measured in this frame, some of them by points that are nearer to no other
        group, and are in no spell: the others' velocities are ignorance, or another's.
        """
        able = np.flatnonzero(bank.named & (bank.seen >= t) & (bank.null <= 0) & (bank.own >= OWN * bank.size))
        near = {pair: self._went_on(pair, slow, (t, d, m, gap)) for pair, slow, d, m, gap in _near(bank, able, rules)}
        unsure = {int(g) for g in bank.id[bank.named]} - set(bank.id[able].tolist())
        kept = {p: m for p, m in self.met.items() if unsure & set(p) and t - m.path[-1][0] <= PATIENCE}
        self.met = near | kept
        due = [p for p, met in near.items() if t - met.since >= rules.config.merge_time - 1e-9]
        for ids in _connected(due):
            rows = np.flatnonzero(np.isin(bank.id, ids))
            since, place = min(
                (self.met[p].onset(rules.config.merge_velocity) for p in due if p[0] in ids), key=lambda found: found[0]
            )
            one = merged(bank, rows)
            here = bank.id[rows][(since - bank.born[rows] > ARRIVAL) | (bank.parent[rows] != UNNAMED)]
            keep = np.ones(len(bank), bool)
            keep[rows] = False
            bank.keep(keep)
            bank.add(one)
            bank.parent[np.isin(bank.parent, ids)] = one.id[0]
            self._hand_on(ids, int(one.id[0]), bank, rules)
            kind = "merge" if len(here) > 1 else "enter"
            yield Change(kind, since, tuple(sorted(ids)), (int(one.id[0]),), tuple(place.tolist()))

    def _hand_on(self, ids: list[int], heir: int, bank: Bank, rules: Rules) -> None:
        """What those that merged had with others is the heir's, ways shifted so that they do not jump."""
        met = {p: one for p, one in self.met.items() if not set(p) & set(ids)}
        for p, one in self.met.items():
            others = set(p) - set(ids)
            if len(others) != 1:
                continue
            pair = (min(heir, *others), max(heir, *others))
            a, b = (bank.x[np.flatnonzero(bank.id == id)[0], :2] for id in pair)
            turn = 1 if (p[0] in others) == (pair[0] in others) else -1
            shift = (b - a) * rules.ground - turn * one.path[-1][1]
            path = [(t, turn * d + shift, place, gap) for t, d, place, gap in one.path]
            if pair not in met or one.since < met[pair].since:
                met[pair] = Encounter(one.since, path)
        self.met = met

    def _went_on(self, pair: tuple[int, int], slow: bool, now: tuple[float, Array, Array, float]) -> Encounter:
        before = self.met.get(pair, Encounter(np.inf, []))
        path = [p for p in before.path if p[0] > now[0] - LONGEST]
        return Encounter(min(before.since, now[0]) if slow else np.inf, [*path, now])


def _near(bank: Bank, rows: Ints, rules: Rules) -> Iterator[tuple[tuple[int, int], bool, Array, Array, float]]:
    """R_x: ids of each two groups whose search regions overlap, whether their velocities differ by no more than
    allowed (from pixels: and they are not far apart on the ground), the difference of their centroids on the ground,
    the middle between them, the nearest people's distance."""
    close = regions_overlap(bank.x[rows, :2], bank.extent[rows], MARGIN * rules.config.gate)
    close |= _touching(bank, rows, rules)
    v = bank.x[rows, 2:] * rules.ground
    var = np.einsum("gaa,a->g", bank.P[rows, 2:, 2:], np.square(rules.ground)) / 2
    most = rules.config.merge_velocity + rules.config.merge_doubt * np.sqrt(var[:, None] + var)
    slow = np.hypot(*(v[:, None] - v[None]).transpose(2, 0, 1)) <= most
    for i, j in np.argwhere(np.triu(close, 1)).tolist():
        if doubtful(bank, rows[i], rows[j]) and not rules.pixels:  # bodies hide each other in an image
            continue
        i, j = sorted((i, j), key=lambda k: bank.id[rows[k]])
        a, b = bank.x[rows[i], :2], bank.x[rows[j], :2]
        d = (b - a) * rules.ground
        gap = _gap(bank, rows[i], rows[j], d, rules)
        together = bool(slow[i, j]) and not (rules.pixels and gap > FAR_APART)  # bodies cover the ground behind them
        yield (int(bank.id[rows[i]]), int(bank.id[rows[j]])), together, d, (a + b) / 2, gap


def _gap(bank: Bank, a: int, b: int, d: Array, rules: Rules) -> float:
    """Distance of the nearest people of two groups, m: of the nearest points, or, as pixels are parts of bodies, of the
    centroids, d apart, less how far people are about them."""
    if not rules.pixels:
        here, there = (bank.places[k][0] + bank.x[k, :2] for k in (a, b))
        return float(np.hypot(*((here[:, None] - there) * rules.ground).T).min())
    return float(np.hypot(*d)) - REACH * sum(_spread(bank, k, d, rules) for k in (a, b))


def _spread(bank: Bank, row: int, way: Array, rules: Rules) -> float:
    """Standard deviation, m, of a group's people along a way on the ground: their extent without what it was shrunk to,
    and without that of one body."""
    n, n0 = bank.size[row], rules.constraint.strength
    people = ((n + n0) * rules.numbers[CUT] * bank.extent[row] - n0 * rules.constraint.prior) / n - rules.body
    along = rules.ground * way / max(float(np.hypot(*way)), 1e-9)
    return float(np.sqrt(max(along @ people @ along, 0.0)))


def _touching(bank: Bank, rows: Ints, rules: Rules) -> Bools:
    """(K, K) which groups have points that are linked (ours: regions, whose extents rest while points are shared, may
    be late)."""
    found = np.eye(len(rows), dtype=bool)
    place = [bank.places[r][0] + bank.x[r, :2] for r in rows.tolist()]
    low, high = (np.array([f(p, axis=0) for p in place]).reshape(-1, 2) for f in (np.min, np.max))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(2, initial=-np.inf)
    for i, j in np.argwhere(np.triu(gap <= rules.constraint.link, 1)).tolist():
        if rules.pixels:
            d = polygon_gap(place[i], place[j]) if min(len(place[i]), len(place[j])) > 2 else gap[i, j]
            found[i, j] = found[j, i] = d <= rules.constraint.link
        else:
            found[i, j] = found[j, i] = near(place[i], place[j], rules.constraint.link).any()
    return found


def _connected(pairs: list[tuple[int, int]]) -> list[list[int]]:
    """Connected components of a graph, G_x."""
    parts: list[set[int]] = []
    for pair in pairs:
        touched = [p for p in parts if p & set(pair)]
        parts = [p for p in parts if not p & set(pair)] + [set(pair).union(*touched)]
    return [sorted(p) for p in parts]
