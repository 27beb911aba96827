"""Slow, obvious twins of the belief: evidence of pairs, beliefs over time, and average linkage."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

TIMES = (0.8, 5.0, 15.0)


def evidence(pos, time, seconds):
    """dict from (step, a, b) to the dict of quantities; pos (S, P, 2), time (S, P), nan where not seen."""
    steps, people = pos.shape[:2]
    seen = [[p for p in range(people) if np.isfinite(pos[t, p, 0])] for t in range(steps)]
    past, found = {}, {}
    for t in range(steps):
        vel = {p: chord(pos, time, t, p, seconds) for p in seen[t]}
        for a, b in combinations(seen[t], 2):
            if np.hypot(*(pos[t, b] - pos[t, a])) < 4.0:
                past.setdefault((a, b), []).append((t, instant(pos[t], vel, a, b) | others(pos[t], vel, a, b)))
                row = {
                    f"{name}, {time:g} s": mean(past[a, b], name, t, time, seconds)
                    for name in past[a, b][0][1]
                    for time in TIMES
                }
                row["time near"] = min(len(past[a, b]) * seconds, 20.0)
                found[t, a, b] = row
    return found


def chord(pos, time, t, p, seconds):
    for steps in range(max(1, round(0.8 / seconds)), 0, -1):
        if t - steps >= 0 and np.isfinite(pos[t - steps, p, 0]):
            return (pos[t, p] - pos[t - steps, p]) / (time[t, p] - time[t - steps, p])
    return np.full(2, math.nan)


def instant(pos, vel, a, b):
    apart, m = pos[b] - pos[a], (vel[a] + vel[b]) / 2
    distance, pace = np.hypot(*apart), np.hypot(*m)
    side, along = distance, math.nan
    if pace >= 0.3:
        side, along = abs(apart[0] * m[1] - apart[1] * m[0]) / pace, abs(apart @ m) / pace
    speeds = [np.hypot(*vel[p]) for p in (a, b)]
    differ, turn, walking, one = np.hypot(*(vel[b] - vel[a])), math.nan, math.nan, math.nan
    if not math.isnan(differ):
        one = float(min(speeds) < 0.3 <= max(speeds))
    if min(speeds) >= 0.3:
        walking = differ
        turn = math.acos(min(max(vel[a] @ vel[b] / speeds[0] / speeds[1], -1.0), 1.0))
    return {
        "distance": distance, "velocity difference": differ, "sideways": side, "lengthwise": along,
        "growth": apart @ (vel[b] - vel[a]) / max(distance, 0.1), "turn": turn, "walking difference": walking,
        "one walks": one,
    }  # fmt: skip


def others(pos, vel, a, b):
    """vel: of those who are seen, by person."""
    third = [p for p in vel if p not in (a, b)]
    nearer = [sum(np.hypot(*(pos[p] - pos[x])) < np.hypot(*(pos[b] - pos[a])) for p in third) for x in (a, b)]
    common = [
        p
        for p in third
        if all(np.hypot(*(pos[p] - pos[x])) < 1.5 and np.hypot(*(vel[p] - vel[x])) < 0.7 for x in (a, b))
    ]
    return {"nearer others": sum(nearer) / 2, "common neighbours": float(len(common))}


def mean(rows, name, t, time, seconds):
    known = [(math.exp(-(t - s) * seconds / time), row[name]) for s, row in rows if not math.isnan(row[name])]
    return sum(w * x for w, x in known) / sum(w for w, _ in known) if known else math.nan


def beliefs(pos, time, seconds, belief):
    """dict from (step, a, b) to the two log-odds."""
    found = {}
    for (t, a, b), row in evidence(pos, time, seconds).items():
        log_odds = belief.bias.copy()
        for table in belief.tables:
            x = row[table.name]
            if not math.isnan(x):
                log_odds += [np.interp(x, table.at, y) for y in table.log_odds]
        found[t, a, b] = log_odds
    return found


def groups(people, log_odds, unseen):
    """Average linkage of one step, one join at a time; log_odds: dict from (a, b), a < b."""
    parts = [frozenset([p]) for p in people]
    while True:
        best = None
        for x, y in combinations(parts, 2):
            linked = [log_odds.get((min(p, q), max(p, q)), unseen) for p in x for q in y]
            mean = sum(linked) / len(linked)
            if mean > 0 and (best is None or mean > best[0]):
                best = mean, x, y
        if best is None:
            return {p for p in parts if len(p) > 1}
        parts = [p for p in parts if p not in best[1:]] + [best[1] | best[2]]
