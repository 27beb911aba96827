"""Slow, obvious oracles of groups: the rules of membership, read frame by frame and pair by pair."""

from __future__ import annotations

from itertools import combinations

import numpy as np


def labels(pos, vel, present, intent, fps):
    """For each frame the set of groups (frozensets of columns, 2 or more people)."""
    hold = int(np.ceil(2.0 * fps - 1e-9))
    parts, found = [], []
    for t in range(len(present)):
        parts = come_and_go(parts, present, intent, t)
        while True:
            after = divide(parts, pos, vel, present, intent, t, hold)
            after = join(after, pos, vel, present, intent, t, hold)
            if set(after) == set(parts):
                break
            parts = after
        found.append({p for p in parts if len(p) > 1})
    return found


def come_and_go(parts, present, intent, t):
    here = {p for p in range(present.shape[1]) if present[t, p]}
    parts = [frozenset(part & here) for part in parts if part & here]
    new = here - set().union(*parts)
    return parts + [frozenset(p for p in new if intent[t, p] == g) for g in {intent[t, p] for p in new}]


def classes(part, intent, t):
    return [frozenset(p for p in part if intent[t, p] == g) for g in sorted({intent[t, p] for p in part})]


def divide(parts, pos, vel, present, intent, t, hold):
    out = []
    for part in parts:
        pieces = classes(part, intent, t)
        near = [
            (a, b) for a, b in combinations(pieces, 2) if not holds("apart", a, b, pos, vel, present, intent, t, hold)
        ]
        out += components(pieces, near)
    return out


def join(parts, pos, vel, present, intent, t, hold):
    links = []
    for a, b in combinations(parts, 2):
        core_a, core_b = core(a, intent, t), core(b, intent, t)
        if core_a is None or core_b is None or intent[t, min(core_a)] != intent[t, min(core_b)]:
            continue
        if holds("together", core_a, core_b, pos, vel, present, intent, t, hold):
            links.append((a, b))
    return components(parts, links)


def core(part, intent, t):
    largest = max(classes(part, intent, t), key=len)
    return largest if 2 * len(largest) > len(part) else None


def holds(rule, a, b, pos, vel, present, intent, t, hold):
    if t + hold > len(present):
        return False
    return all(holds_now(rule, a, b, pos[s], vel[s], present[s], intent[s]) for s in range(t, t + hold))


def holds_now(rule, a, b, pos, vel, present, intent):
    a, b = [p for p in a if present[p]], [p for p in b if present[p]]
    if not a or not b:
        return False
    same = [intent[p] == intent[q] for p in a for q in b]
    gap = min(np.linalg.norm(pos[p] - pos[q]) for p in a for q in b)
    differ = np.linalg.norm(vel[a].mean(axis=0) - vel[b].mean(axis=0))
    if rule == "together":
        return all(same) and gap < 1.5 and differ < 0.5
    return not any(same) and (gap > 2.5 or (gap > 1.5 and differ > 0.7))


def components(parts, links):
    groups = [{p} for p in parts]
    for a, b in links:
        ga, gb = next(g for g in groups if a in g), next(g for g in groups if b in g)
        if ga is not gb:
            groups.remove(gb)
            ga |= gb
    return [frozenset().union(*g) for g in groups]
