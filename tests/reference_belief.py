"""Slow, obvious twins of the belief: evidence of pairs, beliefs over time, and linkage."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

TIMES = (0.8, 5.0, 15.0)
SLOPES = (1.5, 4.0)


def evidence(pos, time, seconds):
    """dict from (step, a, b) to the dict of quantities and "noise"; pos (S, P, 2), time (S, P), nan where not seen."""
    steps, people = pos.shape[:2]
    seen = [[p for p in range(people) if np.isfinite(pos[t, p, 0])] for t in range(steps)]
    past, offsets, found = {}, {}, {}
    noise = noises(pos, time, seen)
    for t in range(steps):
        vel = {p: chord(pos, time, t, p, seconds) for p in seen[t]}
        slope = {(p, span): regression(pos[: t + 1, p], time[: t + 1, p], span) for p in seen[t] for span in SLOPES}
        place = {p: mean_place(pos[: t + 1, p], time[: t + 1, p], SLOPES[0]) for p in seen[t]}
        for a, b in combinations(seen[t], 2):
            if np.hypot(*(pos[t, b] - pos[t, a])) < 4.0:
                row = instant(pos[t], vel, a, b) | {"file": file(place, slope, a, b, seen[t])}
                past.setdefault((a, b), []).append((t, row | others(pos[t], vel, a, b)))
                offsets.setdefault((a, b), []).append((t, pos[t, b] - pos[t, a]))
                row = {
                    f"{name}, {time:g} s": mean(past[a, b], name, t, time, seconds)
                    for name in past[a, b][0][1]
                    for time in TIMES
                }
                error = noise[t, a] + noise[t, b]
                for span in SLOPES:
                    one, other = slope[a, span], slope[b, span]
                    row[f"pace, {span:g} s"] = np.hypot(*(one + other)) / 2
                    share = 4 / (1 + span) / span**2
                    row[f"velocity difference in noise, {span:g} s"] = length_in(other - one, 0.25, share * error)
                for span in TIMES:
                    weights = np.array([math.exp(-(t - s) * seconds / span) for s, _ in offsets[a, b]])
                    middle = weights @ [x for _, x in offsets[a, b]] / weights.sum()
                    row[f"offset in noise, {span:g} s"] = length_in(middle, 0.6, error / (1 + span))
                row["time near"] = min(len(past[a, b]) * seconds, 20.0)
                row["noise"] = math.sqrt(max(np.trace(error), 0.0) / 2)
                found[t, a, b] = row
    return found


def regression(pos, time, span):
    """Slope of the weighted least squares line through what was seen up to now, nan for one position."""
    known = np.isfinite(pos[:, 0])
    if known.sum() < 2:
        return np.full(2, math.nan)
    weights = np.exp((time[known] - time[known][-1]) / span)
    return np.polyfit(time[known] - time[known][-1], pos[known], 1, w=np.sqrt(weights))[0]


def mean_place(pos, time, span):
    """Mean over what was seen up to now, with weights exp(-age / span)."""
    known = np.isfinite(pos[:, 0])
    weights = np.exp((time[known] - time[known][-1]) / span)
    return weights @ pos[known] / weights.sum()


def noises(pos, time, seen):
    """dict from (step, person) to the covariance (2, 2) of the person's positions."""
    all_sum, all_count = 0.01 * np.eye(2) * 10, 10.0
    own, found = {}, {}
    for t, people in enumerate(seen):
        for p in people:
            own.setdefault(p, (np.zeros((2, 2)), 0.0))
            if t >= 2 and p in seen[t - 1] and p in seen[t - 2]:
                (x2, x1, x), (t2, t1, now) = pos[t - 2 : t + 1, p], time[t - 2 : t + 1, p]
                off = x - x1 - (x1 - x2) * (now - t1) / (t1 - t2)
                off *= min(1.0, 4.0 / max(np.hypot(*off), 1e-9))
                span = (now - t2) / 2
                r = math.exp(-span)
                new = (np.outer(off, off) - np.eye(2) * (0.18 * span) ** 2) / (6 - 8 * r + 2 * r**2)
                fade = math.exp(-span / 20)
                own[p] = own[p][0] * fade + new, own[p][1] * fade + 1
                all_sum, all_count = all_sum + new, all_count + 1
        for p in people:
            found[t, p] = (20 * all_sum / all_count + own[p][0]) / (20 + own[p][1])
    return found


def length_in(vector, usual, error):
    """Mahalanobis length; error (2, 2): made a covariance where it is none."""
    var = np.maximum(np.diag(error), 0.0)
    most = math.sqrt(var[0] * var[1])
    cov = np.diag(var) + np.array([[0.0, 1.0], [1.0, 0.0]]) * min(max(error[0, 1], -most), most)
    return math.sqrt(vector @ np.linalg.inv(cov + usual**2 * np.eye(2)) @ vector)


def file(pos, slope, a, b, seen):
    """At how many ends of the pair somebody goes on in line along their way; pos: dict by person."""
    apart, way = pos[b] - pos[a], (slope[a, 4.0] + slope[b, 4.0]) / 2
    if not np.hypot(*way) >= 0.3 or not np.hypot(*apart) < 1.8:
        return math.nan
    if abs(apart @ way) < 0.8 * np.hypot(*apart) * np.hypot(*way):
        return 0.0

    def goes_on(end, line):
        steps = [pos[p] - pos[end] for p in seen if p not in (a, b)]
        return any(np.hypot(*x) < 1.8 and x @ line >= 0.866 * np.hypot(*x) * np.hypot(*line) for x in steps)

    return float(goes_on(b, apart)) + float(goes_on(a, -apart))


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
    found, latest, shift = {}, {}, 0.0
    rows = evidence(pos, time, seconds)
    usual = math.log(belief.share / (1 - belief.share))
    for t in range(len(pos)):
        now = [key for key in rows if key[0] == t]
        for key in now:
            found[key] = log_odds(belief, rows[key])
            latest[key[1:]] = min(max(math.floor((found[key][0] + 12) / 0.25 + 0.5), 0), 80) * 0.25 - 12
        for _ in range(2 if now else 0):
            told = 30 * belief.share + sum(1 / (1 + math.exp(-x - shift)) for x in latest.values())
            share = told / (30 + len(latest))
            shift = math.log(share / (1 - share)) - usual
        for key in now:
            found[key] = found[key] + [shift, 0.0]
    return found


def log_odds(belief, row):
    """The sums of the tables at the noise of a row, (2,)."""
    found = np.array([np.interp(row["noise"], belief.noise, bias) for bias in belief.bias])
    for table in belief.tables:
        x = row[table.name]
        if not math.isnan(x):
            levels = [[np.interp(x, table.at, y) for y in decision] for decision in table.log_odds]
            found += [np.interp(row["noise"], belief.noise, y) for y in levels]
    return found


def groups(people, log_odds, unseen, share):
    """Linkage of one step, one join at a time; log_odds: dict from (a, b), a < b."""
    parts = [frozenset([p]) for p in people]
    while True:
        best = None
        for x, y in combinations(parts, 2):
            linked = {(p, q): log_odds.get((min(p, q), max(p, q)), unseen) for p in x for q in y}
            nearest = [max(linked[p, q] for q in y) for p in x] + [max(linked[p, q] for p in x) for q in y]
            worth = (1 - share) * sum(linked.values()) / len(linked) + share * sum(nearest) / len(nearest)
            if worth > 0 and (best is None or worth > best[0]):
                best = worth, x, y
        if best is None:
            return {p for p in parts if len(p) > 1}
        parts = [p for p in parts if p not in best[1:]] + [best[1] | best[2]]
