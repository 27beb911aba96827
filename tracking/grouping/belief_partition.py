"""Consistent groups from beliefs of pairs, by average linkage, and the links that these groups stand for.

In each step the two groups (or people) with the highest mean log-odds over their pairs are joined, as long as it is
above 0. So a chain of strangers is no group, and a group whose ends are far apart is one.
"""

from __future__ import annotations

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY, frames_of
from sim.truth.proximity import runs, stretches
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import Belief, beliefs_of_tracks
from tracking.grouping.link_rule import Links
from tracking.grouping.pair_evidence import frames_per_step

BRIDGED = 0.5
"""s: gaps in a stretch of being near and alike that do not end it."""


def partition(step: Ints, a: Ints, b: Ints, log_odds: Array, unseen: float) -> tuple[Ints, Ints, Ints]:
    """Returns the people in groups of each step, (step, person, group), (N,) each, sorted by group.

    step, a, b (R,): one row per pair and step, persons a != b. log_odds (R,). unseen: log-odds of pairs without a row.
    group: any number that no other group of any step has. People alone are left out.
    """
    people = int(max(a.max(initial=0), b.max(initial=0))) + 1
    linked = log_odds > 0
    node = np.unique(np.concatenate([step[linked] * people + a[linked], step[linked] * people + b[linked]]))
    u, v = (np.searchsorted(node, step * people + p) for p in (a, b))
    known = np.ones(len(step), bool)
    for place, p in ((u, a), (v, b)):
        known &= node[np.minimum(place, len(node) - 1)] == step * people + p if len(node) else False
    u, v, x = u[known], v[known], log_odds[known] - unseen
    group: Ints = np.arange(len(node))
    size: Array = np.ones(len(node))
    while len(x):
        mean = x / (size[u] * size[v]) + unseen
        rank = np.empty(len(x), np.int64)
        rank[np.lexsort((u * len(node) + v, mean))] = np.arange(len(x))
        best = np.full(len(node), -1)
        for side in (u, v):
            np.maximum.at(best, side, rank)
        join = (mean > 0) & (best[u] == rank) & (best[v] == rank)
        if not join.any():
            break
        into: Ints = np.arange(len(node))
        into[v[join]] = u[join]
        size, group = np.asarray(np.bincount(into, size, len(node)), float), into[group]
        u, v = into[u], into[v]
        apart = u != v
        key = np.minimum(u, v)[apart] * len(node) + np.maximum(u, v)[apart]
        key, place = np.unique(key, return_inverse=True)
        x = np.asarray(np.bincount(place, x[apart], len(key)), float)
        u, v = key // len(node), key % len(node)
    order = np.argsort(group, kind="stable")
    count = np.bincount(group, minlength=len(node))
    order = order[count[group[order]] > 1]
    return node[order] // people, node[order] % people, group[order]


def belief_links(frame: Ints, column: Ints, pos: Array, length: int, fps: float, belief: Belief) -> Links:
    """Returns all switches of links in a sequence of `length` frames: any two members of a group are linked.

    A row is one person in one frame: frame (R,) from 0; column (R,): number of the person, from 0; pos (R, 2): x, y in
    m. fps: frames per second.
    """
    size = frames_per_step(fps)
    seconds = size / fps
    found = beliefs_of_tracks(frame, column, pos, length, fps, belief)
    people, steps = int(column.max(initial=0)) + 1, length // size
    seen = np.zeros((steps, people), bool)
    whole = frame < steps * size
    seen[frame[whole] // size, column[whole]] = True
    pair = found.a * people + found.b
    order_of_rows = np.lexsort((found.step, pair))
    pair, step, decision = pair[order_of_rows], found.step[order_of_rows], found.decision[order_of_rows]
    row, at = _remembered(pair, step, seen, frames_of(belief.memory, 1 / seconds))
    p, s = np.concatenate([pair, pair[row]]), np.concatenate([step, at])
    t, person, group = partition(s, p // people, p % people, np.concatenate([decision, decision[row]]), belief.unseen)
    i, j = runs(np.arange(len(group)) + 1, np.searchsorted(group, group, side="right"))
    low, high = np.minimum(person[i], person[j]), np.maximum(person[i], person[j])
    both, when = low * people + high, t[i]
    order = np.lexsort((when, both))
    patience = frames_of(belief.patience, 1 / seconds)
    both, first, last = stretches(both[order], when[order], 1, patience)
    near = (found.distance < MERGE_DISTANCE) & ~(found.differ >= MERGE_VELOCITY)
    onset, parting = _onsets(pair, step, near[order_of_rows], both, first, last, frames_of(BRIDGED, 1 / seconds))
    ends = last + patience < steps
    t = np.concatenate([first, last[ends] + patience])
    columns = np.concatenate([both, both[ends]])
    on = np.concatenate([np.ones(len(first), bool), np.zeros(int(ends.sum()), bool)])
    since = np.concatenate([onset, parting[ends]])
    order = np.lexsort((columns, t))
    t, columns, on, since = t[order], columns[order], on[order], since[order]
    return Links((t + 1) * size - 1, columns // people, columns % people, on, since * size)


def _remembered(pair: Ints, step: Ints, seen: Bools, memory: int) -> tuple[Ints, Ints]:
    """Returns rows that stand for steps in which one of a pair was missed: (row, step), (N,) each.

    pair, step (R,): rows sorted by pair, then step; pair is a * P + b. seen (S, P): True where a person was seen.
    memory: steps for which a row is repeated.
    """
    steps, people = seen.shape
    last = np.concatenate([np.diff(pair) != 0, [True]])[: len(pair)]
    following = np.where(last, steps, np.append(step[1:], steps)[: len(step)])
    row, at = runs(step + 1, np.minimum(following, step + memory + 1))
    missed = ~(seen[at, pair[row] // people] & seen[at, pair[row] % people])
    return row[missed], at[missed]


def _onsets(pair: Ints, step: Ints, near: Bools, both: Ints, first: Ints, last: Ints, bridge: int) -> tuple[Ints, Ints]:
    """Returns the steps in which the pairs of links came together, and parted: (N,), (N,).

    It is the first step of the stretch of being near and alike, or of not being so, that lasts until the link begins in
    step `first` (N,), or has ended after step `last` (N,); that step itself if there is none. pair, step, near (R,):
    rows sorted by pair, then step. both (N,): the pair of each link. bridge: steps of gaps that a stretch may have.
    """
    stride = int(max(step.max(initial=0), last.max(initial=0))) + 2
    out = []
    for flag, when in ((near, first), (~near, last + 1)):
        p, begin, end = stretches(pair[flag], step[flag], 1, bridge)
        k = np.searchsorted(p * stride + begin, both * stride + when, side="right") - 1
        p, begin, end = (np.append(x, -1) for x in (p, begin, end))  # k may be -1
        lasts = (p[k] == both) & (end[k] + bridge >= when)
        out.append(np.where(lasts, begin[k], when))
    return out[0], out[1]
