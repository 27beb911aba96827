"""Scores of groups, pairwise membership, events and lineage, from their matchings, under weights of the frames.

`evaluate` gives every frame the weight 1, intervals by resampling give it others. A score whose denominator is 0 is
nan. `group_scores.py`, `group_detection.py` and `events.py` match both sides and count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import FOUND
from tracking.scoring.events import HEADLINE, MatchedEvents, same_lineage
from tracking.scoring.group_and_event_scores import (
    ComparedSides,
    TrackedGroups,
    compared_events,
    near_changes,
    tracked_groups,
    unknown_kinds,
)
from tracking.scoring.group_detection import pair_counts, weighted_detection
from tracking.scoring.group_scores import (
    GroupComparison,
    GroupMatch,
    compare_groups,
    correct,
    groups_found,
    hull_pairs,
    matched_groups,
    member_pairs,
    shared_members,
    sizes,
    switch_frames,
)
from tracking.scoring.hota import weighted_hota
from tracking.scoring.people_and_groups import GroupRows, TrueGroups
from tracking.scoring.position_errors import gaussian_wasserstein
from tracking.scoring.weighted_sums import FrameSums, WeightedScores, mean, mean_of_known, ratio


def weighted_groups_and_events(sides: ComparedSides, true: TrueGroups, by: GroupMatch) -> WeightedScores:
    """Returns the weighted scores of groups, membership, events and lineage, by the keys of the catalogue.

    by: matches groups by "hull" (IoU) or by "members" (Jaccard index). Core frames are more than 1 s away from every
    true merge and split. Keys are missing where the truth or the tracker lacks data.
    """
    size, core = len(sides.frames), sides.frames & ~near_changes(sides.truth)
    tracked = tracked_groups(sides)
    groups, est = true.groups, tracked.counted
    shared = shared_members(groups, est, tracked.person, len(sides.true.rows))
    hulls = hull_pairs(groups, est) if true.comparable else None
    pairs = hulls if by == "hull" else member_pairs(groups, est, shared) if tracked.known else None
    parts: list[WeightedScores] = []
    if tracked.known:
        parts += [_pairwise(true, tracked, size), *weighted_detection(sides, groups, tracked, shared)]
        found = groups.rows.frame[groups_found(groups, est, shared)]
        for frames, end in ((sides.frames, ""), (core, "_core")):
            parts.append(_renamed(_detection(groups, est, found, frames), None, end))
    if hulls is not None:
        overlapping = matched_groups(groups.pos, est.pos, hulls, FOUND).frame
        parts.append(_renamed(_detection(groups, est, overlapping, sides.frames), {"F1": "group_F1_hull"}))
    if pairs is not None:
        compared = compare_groups(groups, est, shared, pairs)
        for frames, end in ((sides.frames, ""), (core, "_core")):
            parts.append(_renamed(weighted_groups(compared, frames), None, end))
    if sides.truth.events is not None:
        matched, unknown = compared_events(sides, tracked), unknown_kinds(sides)
        parts.append(weighted_events([m for m in matched if m.kind not in unknown], sides.truth.fps, size))
    return lambda weights: {key: value for part in parts for key, value in part(weights).items()}


def _renamed(scores: WeightedScores, names: dict[str, str] | None, end: str = "") -> WeightedScores:
    """Returns the same function with other keys: those of `names` only, or without names "group_<key><end>"."""

    def renamed(weights: Array) -> dict[str, Array]:
        found = scores(weights)
        return {f"group_{k}{end}": v for k, v in found.items()} if names is None else {
            new: found[old] for old, new in names.items()
        }  # fmt: skip

    return renamed


def _pairwise(true: TrueGroups, tracked: TrackedGroups, size: int) -> WeightedScores:
    counts = pair_counts(true.groups, tracked.counted, tracked.person)
    sums = FrameSums(size)
    for name, column in zip(("true", "est", "hits"), counts.T, strict=True):
        sums.add(name, np.arange(len(counts)), column)

    def score(weights: Array) -> dict[str, Array]:
        return {f"pairwise_{key}": values for key, values in _f1_and_parts(sums.of(weights)).items()}

    return score


def _f1_and_parts(s: Mapping[str, Array]) -> dict[str, Array]:
    return {
        "F1": ratio(2 * s["hits"], s["true"] + s["est"]),
        "precision": ratio(s["hits"], s["est"]),
        "recall": ratio(s["hits"], s["true"]),
    }


def _detection(true: GroupRows, est: GroupRows, found: Ints, frames: Bools) -> WeightedScores:
    sums = FrameSums(len(frames))
    sums.add("true", _kept(true.rows.frame, frames))
    sums.add("est", _kept(est.rows.frame, frames))
    sums.add("hits", _kept(found, frames))

    def score(weights: Array) -> dict[str, Array]:
        return _f1_and_parts(sums.of(weights))

    return score


def _kept(frame: Ints, frames: Bools) -> Ints:
    return frame[frames[frame]]


def weighted_groups(compared: GroupComparison, frames: Bools) -> WeightedScores:
    """Returns the weighted scores of groups over the frames f where frames[f] is true, by key without "group_"."""
    true, est, sums = compared.true, compared.est, _sums_of_groups(compared, frames)
    hota = weighted_hota(compared.pairs.in_frames(frames), len(frames))
    groups = bool(frames[true.rows.frame].any() or frames[est.rows.frame].any())

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        n, m, hits = s["true"], s["est"], s["TP"]
        misses, false = n - hits, m - hits
        nothing = n + m == 0
        return {
            "1-FP": ratio(n - false, n),
            "1-FN": ratio(n - misses, n),
            "1-FP_frames": 1 - ratio(s["false share"], s["frames"]),
            "1-FN_frames": 1 - ratio(s["missed share"], s["frames"]),
            "GDSR": ratio(s["right"], n),
            "GDSR2": ratio(s["pure"], n),
            **{key: mean(s, key) for key in ("MOTP", "MSE", "MOTP_ungated", "size_error", "extent_error")},
            "MOTA": ratio(n - misses - false - s["IDSW"], n),
            "IDSW": s["IDSW"], "TP": hits, "FP": false, "FN": misses,
            **({key: np.where(nothing, np.nan, v) for key, v in hota(weights).items()} if groups else {}),
        }  # fmt: skip

    return score


def _sums_of_groups(compared: GroupComparison, frames: Bools) -> FrameSums:
    true, est, chosen = compared.true, compared.est, compared.chosen
    kept = frames[chosen.frame]
    i, j, frame = chosen.i[kept], chosen.j[kept], chosen.frame[kept]
    size, sums, every = len(frames), FrameSums(len(frames)), np.flatnonzero(frames)
    n, m, hits = (np.bincount(f, minlength=size)[every] for f in (true.rows.frame, est.rows.frame, frame))
    for name, count in (("frames", np.ones_like(n)), ("true", n), ("est", m), ("TP", hits)):
        sums.add(name, every, count)
    sums.add("false share", every, (m - hits) / np.maximum(n, 1))
    sums.add("missed share", every, (n - hits) / np.maximum(n, 1))
    for name, good in zip(("right", "pure"), correct(compared, i, j), strict=True):
        sums.add(name, frame[good])
    sums.add("IDSW", switch_frames(frame, true.rows.id[i], est.rows.id[j]))
    distance = np.hypot(*(true.pos[i] - est.pos[j]).T)
    sums.add_mean("MOTP", frame, distance)
    sums.add_mean("MSE", frame, distance**2)
    counted = frames[true.rows.frame]
    sums.add_mean("MOTP_ungated", true.rows.frame[counted], compared.nearest[counted])
    sums.add_mean("size_error", frame, np.abs(sizes(true)[i] - sizes(est)[j]))
    extent = gaussian_wasserstein(true.pos[i], true.extent[i], est.pos[j], est.extent[j])
    sums.add_mean("extent_error", frame, extent)
    return sums


def weighted_events(matched: Sequence[MatchedEvents], fps: float, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to the scores of events and lineage, (D,) by key."""
    sums = FrameSums(size)
    for m in matched:
        _add_events(sums, m, fps)

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        out: dict[str, Array] = {}
        for kind in (m.kind for m in matched):
            hits, false, missed = (s[f"{kind} {what}"] for what in ("TP", "FP", "FN"))
            out |= {
                f"{kind}_F1": ratio(2 * hits, 2 * hits + false + missed),
                f"{kind}_precision": ratio(hits, hits + false),
                f"{kind}_recall": ratio(hits, hits + missed),
                f"{kind}_TP": hits, f"{kind}_FP": false, f"{kind}_FN": missed,
                f"{kind}_latency": mean(s, f"{kind} latency"),
            }  # fmt: skip
        for name in ("F1", "precision", "recall"):
            out[f"event_{name}"] = mean_of_known(np.column_stack([out[f"{kind}_{name}"] for kind in HEADLINE]))
        late, known, right, matched_lineage, with_lineage = (
            np.sum([s[f"{kind} {what}"] for kind in HEADLINE], axis=0)
            for what in ("latency", "latency known", "right", "matched lineage", "lineage")
        )
        return out | {
            "event_latency": ratio(late, known),
            "lineage_accuracy": ratio(right, with_lineage),
            "lineage_accuracy_found": ratio(right, matched_lineage),
        }

    return score


def _add_events(sums: FrameSums, events: MatchedEvents, fps: float) -> None:
    kind, pairs = events.kind, events.pairs
    hit = {id(event) for pair in pairs for event in pair}
    start = np.array([a.start for a, _ in pairs], np.int64)
    sums.add(f"{kind} TP", start)
    for name, side in (("FN", events.true), ("FP", events.est)):
        sums.add(f"{kind} {name}", np.array([e.start for e in side if id(e) not in hit], np.int64))
    late = [np.nan if b.emitted is None else (b.emitted - a.start) / fps for a, b in pairs]
    sums.add_mean(f"{kind} latency", start, np.array(late, float))
    sums.add(f"{kind} lineage", np.array([a.start for a in events.true if a.has_lineage], np.int64))
    judged = [(a, b) for a, b in pairs if a.has_lineage]
    sums.add(f"{kind} matched lineage", np.array([a.start for a, _ in judged], np.int64))
    sums.add(f"{kind} right", np.array([a.start for a, b in judged if same_lineage(a, b)], np.int64))
