"""What becomes of `group-pda`'s groups in a frame: points attached, splits, births, loss and return.

Each function takes the bank as it is and leaves it changed; what is to be told comes back as `Change`s.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.components import linked, partition
from tracking.papers.group_pda.association_kernels import near
from tracking.papers.group_pda.carried_members import thinned
from tracking.papers.group_pda.event_onsets import parting
from tracking.papers.group_pda.group_bank import UNNAMED, Bank, children, newborn
from tracking.papers.group_pda.kernel_parameters import Rules
from tracking.papers.group_pda.merging import Change

FASTEST = 2.0
"""m/s: nobody walks faster away from a group than this."""
GATE4 = 13.28
"""99 % of chi-square with 4 degrees of freedom."""


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
    if not rules.pixels:
        for row in np.unique(own[own >= 0]).tolist():
            mine = np.flatnonzero(own == row)
            if bank.named[row]:
                place = bank.places[row][0] + bank.x[row, :2]
                own[mine[~near(points[mine], place, float(_reach(rules, np.array(rules.dt))))]] = -1
    return own


def _reach(rules: Rules, since: Array) -> Array:
    """How far people may get away from where their group takes them in so many s (K,), a frame at least."""
    return np.asarray(rules.scale * FASTEST * np.maximum(since, rules.dt) + 3 * rules.noise)


class Names:
    """Ids, each used once. State: the next one."""

    def __init__(self) -> None:
        self.next = 1

    def new(self) -> int:
        """A fresh id."""
        self.next += 1
        return self.next - 1


def split(bank: Bank, row: int, points: Array, weights: Array, rules: Rules, t: float, names: Names) -> Change | None:
    """Replace a group by those that its points (M, 2) form (3.3), if several; the largest keeps its id. If they
    form none it has left."""
    group = partition(points, weights, rules.constraint)
    if group.max(initial=-1) < 1:
        bank.null[row] = 0.0
        if group.max(initial=-1) == 0:
            return None
        left = Change("leave", t, (int(bank.id[row]),), (), tuple(bank.x[row, :2].tolist()))  # nothing but noise
        named = bank.id[row] != UNNAMED
        bank.keep(np.arange(len(bank)) != row)
        return left if named else None
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


def standing(bank: Bank, rules: Rules, t: float) -> tuple[Array, Array, Ints]:
    """Where the people of named groups that were measured lately should be (K, 2), how far each may be from there (K,),
    and of which group he is, its id (K,)."""
    late = t - bank.seen <= max(rules.config.carry_time, rules.dt) + 1e-9
    rows = np.flatnonzero(bank.named & late).tolist()
    places = [bank.places[r][0] + bank.x[r, :2] for r in rows]
    seen = np.concatenate([np.zeros(0), *(bank.places[r][1] for r in rows)])
    whose = np.repeat(bank.id[rows], [len(p) for p in places])
    return np.concatenate([np.zeros((0, 2)), *places]), _reach(rules, t - seen), whose


def births(
    bank: Bank, points: Array, weights: Array, before: tuple[Array, Array, Ints], rules: Rules, t: float
) -> None:
    """Tentative groups out of unclaimed points (3.3). Ours: those that were a group's a moment ago are its children.

    before: what `standing` told then.
    """
    if not len(points):
        return
    group = partition(points, weights, rules.constraint)
    made = newborn(points, weights, group, rules, t)
    where, reach, whose = before
    for k in range(len(made) if len(where) else 0):
        d2 = np.square(points[group == k][:, None] - where).sum(2).min(0)
        d2[d2 > reach**2] = np.inf
        row = np.flatnonzero(bank.id == whose[d2.argmin()])
        if len(row) and np.isfinite(d2.min()):
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
        place = tuple(bank.x[row, :2].tolist())
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
    gone = bank.seen[old] < bank.born[new][:, None]  # not somebody else who is missed for a frame
    d2 = np.where(slow & gone & (d2 <= GATE4), d2, np.inf)
    while np.isfinite(d2).any():
        i, j = np.unravel_index(int(d2.argmin()), d2.shape)
        yield int(new[i]), int(old[j])
        d2[i], d2[:, j] = np.inf, np.inf


def deaths(bank: Bank, rules: Rules, t: float) -> Iterator[Change]:
    """Groups that were lost for too long die, tentative ones that were missed for `confirm_time`."""
    c = rules.config
    patience = np.where(bank.named, max(c.coast_time, c.recapture_time if c.recapture else 0.0), c.confirm_time)
    dead: Bools = t - bank.seen > patience + 1e-9
    for row in np.flatnonzero(dead & bank.named).tolist():
        seen = float(bank.seen[row])
        place = bank.x[row, :2] - (t - seen) * bank.x[row, 2:]  # where it was measured last
        yield Change("leave", seen, (int(bank.id[row]),), (), tuple(place.tolist()))
    if dead.any():
        bank.keep(~dead)
