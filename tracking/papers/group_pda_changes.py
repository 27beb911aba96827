"""What becomes of `group-pda`'s groups in a frame: points attached, splits, merging, births, loss and return.

Each function takes the bank as it is and leaves it changed; what is to be told comes back as `Change`s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.geometry import hull_gap
from sim.types import Array, Bools, Ints
from tracking.components import linked, partition
from tracking.ellipsoids import overlaps
from tracking.papers.group_pda_bank import UNNAMED, Bank, children, merged, newborn
from tracking.papers.group_pda_carry import thinned
from tracking.papers.group_pda_onset import REACH, Encounter, parting
from tracking.papers.group_pda_rules import Rules


@dataclass(frozen=True)
class Change:
    """kind of GroupEvent; since, s: when it began; ids before and after; pos (2,)."""

    kind: str
    since: float
    before: tuple[int, ...]
    after: tuple[int, ...]
    pos: tuple[float, float]


def attached(points: Array, d2: Array, bank: Bank, rules: Rules) -> Ints:
    """(M,) the group, a row of d2 (G, M), that each point in nobody's region belongs to as it is linked to one of its
    points, else -1. Of several groups the one whose point is nearest.

    From points a group that has an id takes only who was its member a moment ago: others are newcomers or false alarms,
    and groups of their own first.
    """
    link, own = rules.constraint.link, np.full(len(points), -1)
    taken = np.isfinite(d2).any(0) if len(d2) else np.zeros(len(points), bool)
    if taken.all() or not taken.any():
        return own
    label = linked(points, link)
    free = np.flatnonzero(~taken & np.isin(label, label[taken]))
    for part in np.unique(label[free]).tolist():
        mine, theirs = free[label[free] == part], np.flatnonzero(taken & (label == part))
        claim = d2[:, theirs].argmin(0)
        if len(np.unique(claim)) == 1:
            own[mine] = claim[0]
            continue
        apart = np.square(points[mine][:, None] - points[theirs]).sum(2)
        own[mine] = claim[apart.argmin(1)]
    if not rules.half_cell:
        for k in np.flatnonzero((own >= 0) & bank.named[own]).tolist():
            place = bank.places[own[k]][0] + bank.x[own[k], :2]
            if np.square(place - points[k]).sum(1).min() > _reach(rules) ** 2:
                own[k] = -1
    return own


def _reach(rules: Rules) -> float:
    """How far somebody may get away from where his group takes him, until the next frame."""
    return rules.scale * FASTEST * rules.dt + 3 * rules.noise


class Names:
    """Ids, each used once. State: the next one."""

    def __init__(self) -> None:
        self.next = 1

    def new(self) -> int:
        """A fresh id."""
        self.next += 1
        return self.next - 1


def split(bank: Bank, row: int, points: Array, weights: Array, rules: Rules, t: float, names: Names) -> Change | None:
    """Replace a group by those that its points (M, 2) form (3.3), if they are several; the largest keeps its id."""
    group = partition(points, weights, rules.constraint)
    if group.max(initial=-1) < 1:
        bank.null[row] = 0.0
        if group.max(initial=-1) < 0:  # nothing but noise
            bank.seen[row] = -np.inf
        return None
    made = children(bank, row, points, weights, group, rules, t)
    away = np.hypot(*(made.x[:, :2] - bank.x[row, :2]).T)
    largest, other = np.lexsort((made.x[:, 1], made.x[:, 0], away, -made.size))[:2].tolist()
    named = bank.id[row] != UNNAMED
    if named:
        made.id[:] = [bank.id[row] if k == largest else names.new() for k in range(len(made))]
    parts = [thinned(points[group == k]) for k in (largest, other)]
    since, place = parting(bank.past[row], parts, rules.ground, rules.body, t)
    change = Change("split", since, (int(bank.id[row]),), tuple(sorted(made.id.tolist())), tuple(place.tolist()))
    bank.keep(np.arange(len(bank)) != row)
    bank.add(made)
    return change if named else None


ARRIVAL = 1.0
"""s: a group that another joins so soon after it came has arrived, as in tracking.links."""
FASTEST = 2.0
"""m/s: nobody walks faster away from a group than this."""
LONGEST = 5.0
"""s that is looked back at most."""
OWN = 0.2
"""Share of a group that must be nearer to it than to any other for its velocity to be its own."""
PATIENCE = 0.5
"""s that an encounter outlasts without a look at both groups."""


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
            self.met = {p: met for p, met in self.met.items() if not set(p) & set(ids)}
            kind = "merge" if len(here) > 1 else "enter"
            yield Change(kind, since, tuple(sorted(ids)), (int(one.id[0]),), tuple(place.tolist()))

    def _went_on(self, pair: tuple[int, int], slow: bool, now: tuple[float, Array, Array, float]) -> Encounter:
        before = self.met.get(pair, Encounter(np.inf, []))
        path = [p for p in before.path if p[0] > now[0] - LONGEST]
        return Encounter(min(before.since, now[0]) if slow else np.inf, [*path, now])


def _near(bank: Bank, rows: Ints, rules: Rules) -> Iterator[tuple[tuple[int, int], bool, Array, Array, float]]:
    """R_x: ids of each two groups whose search regions overlap, whether their velocities differ by no more than
    allowed, the difference of their centroids on the ground, the middle between them, the nearest people's distance."""
    near = overlaps(bank.x[rows, :2], bank.extent[rows], rules.config.gate)
    near |= _touching(bank, rows, rules)
    v = bank.x[rows, 2:] * rules.ground
    var = np.einsum("gaa,a->g", bank.P[rows, 2:, 2:], np.square(rules.ground)) / 2
    most = rules.config.merge_velocity + rules.config.merge_doubt * np.sqrt(var[:, None] + var)
    slow = np.hypot(*(v[:, None] - v[None]).transpose(2, 0, 1)) <= most
    for i, j in np.argwhere(np.triu(near, 1)).tolist():
        i, j = sorted((i, j), key=lambda k: bank.id[rows[k]])
        a, b = bank.x[rows[i], :2], bank.x[rows[j], :2]
        d = (b - a) * rules.ground
        reach = REACH * sum(_spread(bank, rows[k], d, rules) for k in (i, j))
        gap = float(np.hypot(*d)) - reach
        yield (int(bank.id[rows[i]]), int(bank.id[rows[j]])), bool(slow[i, j]), d, (a + b) / 2, gap


def _spread(bank: Bank, row: int, way: Array, rules: Rules) -> float:
    """Standard deviation, m, of a group's people along a way on the ground: their extent without what it was shrunk to,
    and without that of one body."""
    n, n0 = bank.size[row], rules.constraint.strength
    people = ((n + n0) * bank.extent[row] - n0 * rules.constraint.prior) / n - rules.body
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
        if rules.half_cell:
            d = hull_gap(place[i], place[j]) if min(len(place[i]), len(place[j])) > 2 else gap[i, j]
        else:
            d = np.sqrt(np.square(place[i][:, None] - place[j]).sum(2).min())
        found[i, j] = found[j, i] = d <= rules.constraint.link
    return found


def _connected(pairs: list[tuple[int, int]]) -> list[list[int]]:
    """Connected components of a graph, G_x."""
    parts: list[set[int]] = []
    for pair in pairs:
        touched = [p for p in parts if p & set(pair)]
        parts = [p for p in parts if not p & set(pair)] + [set(pair).union(*touched)]
    return [sorted(p) for p in parts]


def standing(bank: Bank, rules: Rules, t: float) -> tuple[Array, Ints]:
    """Where the people of named groups that were measured lately should be (K, 2), and of which group, its id (K,)."""
    late = t - bank.seen <= max(rules.config.carry_time, rules.dt) + 1e-9
    rows = np.flatnonzero(bank.named & (bank.null <= 0) & late).tolist()
    places = [bank.places[r][0] + bank.x[r, :2] for r in rows]
    return np.concatenate([np.zeros((0, 2)), *places]), np.repeat(bank.id[rows], [len(p) for p in places])


def births(bank: Bank, points: Array, weights: Array, before: tuple[Array, Ints], rules: Rules, t: float) -> None:
    """Tentative groups out of unclaimed points (3.3). Ours: those that were a group's a moment ago are its children.

    before: what `standing` told then.
    """
    if not len(points):
        return
    group = partition(points, weights, rules.constraint)
    made = newborn(points, weights, group, rules, t)
    where, whose = before
    reach = _reach(rules)
    for k in range(len(made) if len(where) else 0):
        d2 = np.square(points[group == k][:, None] - where).sum(2).min(0)
        row = np.flatnonzero(bank.id == whose[d2.argmin()])
        if len(row) and d2.min() <= reach**2:
            _adopt(made, k, bank, int(row[0]), rules)
    bank.add(made)


def _adopt(made: Bank, k: int, bank: Bank, row: int, rules: Rules) -> None:
    """A newborn is what left a group: its child, with its velocity."""
    share = bank.size[row] / (bank.size[row] + made.size[k])
    made.parent[k] = bank.id[row]
    made.origin[k] = share * bank.x[row, :2] + (1 - share) * made.x[k, :2]
    if rules.config.inherit_velocity:
        made.x[k, 2:] = bank.x[row, 2:]
        made.P[k, 2:, 2:] = bank.P[row, 2:, 2:] + (rules.scale * rules.config.split_speed) ** 2 * np.eye(2)


def confirm(bank: Bank, rules: Rules, t: float, names: Names) -> Iterator[Change]:
    """Names for tentative groups that were measured for long enough: that of a lost group which should be here, with
    its velocity, or a fresh one."""
    c = rules.config
    new = np.flatnonzero(~bank.named & (bank.measured > c.confirm_time + 1e-9))
    old = np.flatnonzero(bank.named & (bank.seen < t)) if c.recapture else new[:0]
    back = dict(_returned(bank, new, old, rules)) if len(new) and len(old) else {}
    for row in new.tolist():
        place = tuple(bank.x[row, :2])
        if row in back:
            lost = back[row]
            bank.id[row], bank.born[row] = bank.id[lost], bank.born[lost]
            bank.id[lost], bank.seen[lost] = UNNAMED, -np.inf
        else:
            bank.id[row] = names.new()
            id, parent = int(bank.id[row]), int(bank.parent[row])
            if parent != UNNAMED and (bank.id == parent).any():
                place = tuple(bank.origin[row].tolist())
                yield Change("split", float(bank.born[row]), (parent,), tuple(sorted((parent, id))), place)
            else:
                yield Change("enter", float(bank.born[row]), (), (id,), place)


def _returned(bank: Bank, new: Ints, old: Ints, rules: Rules) -> Iterator[tuple[int, int]]:
    """New groups and the unmeasured ones in whose predicted region, position and velocity, they lie: rows, the likest
    first, each once."""
    d = bank.x[new][:, None] - bank.x[old]
    S = bank.P[new][:, None] + bank.P[old]
    S[..., :2, :2] += bank.extent[old]
    d2 = np.einsum("nki,nki->nk", d, np.linalg.solve(S, d[..., None])[..., 0])
    doubt = np.sqrt(np.einsum("nkaa,a->nk", S[..., 2:, 2:], np.square(rules.ground)) / 2)
    slow = np.hypot(*np.moveaxis(d[..., 2:] * rules.ground, 2, 0)) <= rules.config.merge_velocity + doubt
    d2 = np.where(slow & (d2 <= GATE4), d2, np.inf)
    while np.isfinite(d2).any():
        i, j = np.unravel_index(int(d2.argmin()), d2.shape)
        yield int(new[i]), int(old[j])
        d2[i], d2[:, j] = np.inf, np.inf


GATE4 = 13.28
"""99 % of chi-square with 4 degrees of freedom."""


def deaths(bank: Bank, rules: Rules, t: float) -> Iterator[Change]:
    """Groups that were lost for too long die, tentative ones that were missed for `confirm_time`."""
    c = rules.config
    patience = np.where(bank.named, max(c.coast_time, c.recapture_time if c.recapture else 0.0), c.confirm_time)
    dead: Bools = t - bank.seen > patience + 1e-9
    for row in np.flatnonzero(dead & bank.named).tolist():
        unseen = min(t - bank.seen[row], patience[row])
        place = bank.x[row, :2] - unseen * bank.x[row, 2:]  # where it was measured last
        yield Change("leave", float(t - unseen), (int(bank.id[row]),), (), tuple(place.tolist()))
    if dead.any():
        bank.keep(~dead)
