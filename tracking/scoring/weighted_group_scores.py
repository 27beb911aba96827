"""Scores of groups, pairwise membership, events and lineage, from their matchings, under weights of the frames.

`evaluate` gives every frame the weight 1, intervals by resampling give it others. A score whose denominator is 0 is
nan. `group_scores.py` and `events.py` match both sides and count.

Also here: who is in one group: pairwise membership, G-MITRE, and the groups that are right up to a tolerance T.

Pairwise membership: F1 over pairs of people who are in one group, independent of ids and shapes. Estimated pairs are
pairs of tracked people, mapped to true people; a pair is right if the two are in one true group.

G-MITRE: Solera, Calderara & Cucchiara (2016), "Socially Constrained Structural Learning for Groups Detection in Crowd",
IEEE TPAMI 38(5). It is the MITRE score of Vilain et al. (1995), "A Model-Theoretic Coreference Scoring Scheme", after
each person alone is joined to a fictitious person, and each other person's fictitious one is left alone. A group S of
one partition then holds |S| - 1 links, of which |S| - p(S) are right, p(S) being the number of parts into which the
other partition divides S.

Groups right at T: Setti, Russell, Bassetti & Cristani (2015), "F-Formation Detection: Individuating Free-Standing
Conversational Groups in Images", PLoS ONE 10(5), after Cristani et al. (2011), BMVC. A true group of n members is right
if some estimated group holds at least ceil(T n) of them and at most ceil((1 - T) n) others.

Both are means over frames. A precision or recall of a frame whose denominator is 0 is 1, as in the authors' programs.
Departure: people who are missed, and tracks mapped to nobody, are parts of their own in G-MITRE.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import FOUND, compare
from tracking.scoring.events import HEADLINE, MatchedEvents, same_lineage
from tracking.scoring.group_and_event_scores import (
    ComparedSides,
    TrackedGroups,
    compared_events,
    near_changes,
    tracked_groups,
    unknown_kinds,
)
from tracking.scoring.group_scores import (
    GroupComparison,
    GroupMatch,
    SharedMembers,
    correct,
    group_of_person,
    groups_found,
    hull_pairs,
    matched_groups,
    member_pairs,
    shared_members,
    switch_frames,
)
from tracking.scoring.people_and_groups import GroupRows, PersonRows, TrueGroups
from tracking.scoring.rows import FrameRows
from tracking.scoring.track_scores import weighted_hota
from tracking.scoring.weighted_sums import FrameSums, WeightedScores, mean, mean_of_known, ratio

# Numerator and denominator of T, by the name of the scores; integers avoid rounding.
TOLERANCES = {"right_groups": (2, 3), "exact_groups": (1, 1)}


def weighted_detection(
    sides: ComparedSides, true: GroupRows, tracked: TrackedGroups, shared: SharedMembers
) -> list[WeightedScores]:
    """Returns the weighted F1, precision and recall of G-MITRE, and of the groups right at T = 2/3 and T = 1."""
    size, est = len(sides.frames), tracked.counted
    n, m = (np.bincount(groups.rows.frame, minlength=size) for groups in (true, est))
    parts = []
    if tracked.named:
        parts.append(_means_over_frames("GMITRE", sides.frames, link_counts(sides, true, est), f1_of_means=False))
    for name, tolerance in TOLERANCES.items():
        hits = np.bincount(true.rows.frame[groups_right(true, est, shared, tolerance)], minlength=size)
        parts.append(_means_over_frames(name, sides.frames, np.stack([n, m, hits]), f1_of_means=True))
    return parts


def link_counts(sides: ComparedSides, true: GroupRows, est: GroupRows) -> Array:
    """Returns the links of G-MITRE by frame number, (3, size): true, estimated, right ones."""
    size = len(sides.frames)
    group, found = (group_of_person(g, len(p.rows))[:-1] for g, p in ((true, sides.true), (est, sides.est)))
    mapped = np.flatnonzero(sides.mapping >= 0)
    a, b, frame = group[sides.mapping[mapped]], found[mapped], sides.est.rows.frame[mapped]
    common = (a >= 0) & (b >= 0)
    first = np.unique(a[common] * len(est) + b[common], return_index=True)[1]
    right = np.bincount(frame[(a < 0) == (b < 0)], minlength=size) - np.bincount(frame[common][first], minlength=size)
    return np.array([_links(true, sides.true, group, size), _links(est, sides.est, found, size), right], float)


def _links(groups: GroupRows, people: PersonRows, group: Ints, size: int) -> Array:
    inside = np.bincount(groups.rows.frame, groups.count - 1, minlength=size)
    return np.asarray(inside + np.bincount(people.rows.frame[group < 0], minlength=size), float)


def groups_right(true: GroupRows, est: GroupRows, shared: SharedMembers, tolerance: tuple[int, int]) -> Bools:
    """Returns which true groups are right, (G,): some estimated group holds T of the members, and few others."""
    part, whole = tolerance
    i, j = np.divmod(shared.key, max(shared.width, 1))
    n = true.count[i]
    enough = shared.count >= -(-part * n // whole)
    pure = est.count[j] - shared.count <= -((part - whole) * n // whole)
    right = np.zeros(len(true), bool)
    right[i[enough & pure]] = True
    return right


def _means_over_frames(name: str, frames: Bools, counts: Array, f1_of_means: bool) -> WeightedScores:
    n, m, hits = counts
    sums, every = FrameSums(len(frames)), np.flatnonzero(frames)
    for key, part, whole in (("F1", 2 * hits, n + m), ("precision", hits, m), ("recall", hits, n)):
        sums.add_mean(key, every, ratio(part, whole, empty=1.0)[every])

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        found = {f"{name}_{key}": mean(s, key) for key in ("F1", "precision", "recall")}
        if f1_of_means:
            p, r = found[f"{name}_precision"], found[f"{name}_recall"]
            found[f"{name}_F1"] = np.where(p + r > 0, ratio(2 * p * r, p + r), p + r)
        return found

    return score


def pair_counts(true: GroupRows, est: GroupRows, person: Ints) -> Ints:
    """Returns how many pairs of people are in one group in each frame, (last + 1, 3): true, estimated, right pairs.

    person (K,): row of the true person of each membership of `est`, -1 none. An estimated pair is right if both are in
    one true group; a pair inside several estimated groups counts once.
    """
    group = group_of_person(true, int(max(true.member.max(initial=-1), person.max(initial=-1))) + 1)
    order = np.argsort(est.of, kind="stable")
    mapped = person[order]
    inside = FrameRows(est.of[order], order)  # the group takes the place of the frame

    def ordered(a: Ints, b: Ints) -> tuple[Ints, Array]:
        kept = np.flatnonzero((mapped[a] >= 0) & (mapped[a] < mapped[b]))
        return kept, np.ones(len(kept))

    both = compare(inside, inside, ordered)
    frame = est.rows.frame[est.of[order][both.i]]
    pairs = np.stack([mapped[both.i], mapped[both.j]])
    (p, q), first = np.unique(pairs, axis=1, return_index=True)  # hulls may overlap: a pair inside two of them is one
    size = 1 + int(max(true.rows.frame.max(initial=-1), est.rows.frame.max(initial=-1)))
    distinct = np.bincount(frame[first], minlength=size)
    repeated = np.bincount(frame, minlength=size) - distinct
    right = np.bincount(frame[first][(group[p] >= 0) & (group[p] == group[q])], minlength=size)
    return np.column_stack([_pairs_in(true, size), _pairs_in(est, size) - repeated, right])


def _pairs_in(groups: GroupRows, size: int) -> Ints:
    pairs = np.zeros(size, np.int64)
    np.add.at(pairs, groups.rows.frame, groups.count * (groups.count - 1) // 2)
    return pairs


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
        compared = GroupComparison(groups, est, shared, pairs, matched_groups(groups.pos, est.pos, pairs))
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
    hota = weighted_hota(compared.pairs.in_frames(frames), len(frames), by_level=False)
    groups = bool(frames[true.rows.frame].any() or frames[est.rows.frame].any())

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        n, m, hits = s["true"], s["est"], s["TP"]
        misses, false = n - hits, m - hits
        nothing = n + m == 0
        return {
            "1-FP": ratio(n - false, n),
            "1-FN": ratio(n - misses, n),
            "GDSR": ratio(s["right"], n),
            "GDSR2": ratio(s["pure"], n),
            "MOTP": mean(s, "MOTP"), "MSE": mean(s, "MSE"),
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
    distance = np.hypot(*(true.pos[i] - est.pos[j]).T)
    sums.add_mean("MOTP", frame, distance)
    sums.add_mean("MSE", frame, distance**2)
    for name, count in (("true", n), ("est", m), ("TP", hits)):
        sums.add(name, every, count)
    for name, good in zip(("right", "pure"), correct(compared, i, j), strict=True):
        sums.add(name, frame[good])
    sums.add("IDSW", switch_frames(frame, true.rows.id[i], est.rows.id[j]))
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
        late, known, right, with_lineage = (
            np.sum([s[f"{kind} {what}"] for kind in HEADLINE], axis=0)
            for what in ("latency", "latency known", "right", "lineage")
        )
        return out | {"event_latency": ratio(late, known), "lineage_accuracy": ratio(right, with_lineage)}

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
    sums.add(f"{kind} right", np.array([a.start for a, b in pairs if same_lineage(a, b)], np.int64))
