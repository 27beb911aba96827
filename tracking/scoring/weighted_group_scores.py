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

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import FOUND, Pairs, compare
from tracking.scoring.events import HEADLINE, ComparableEvent, MatchedEvents, same_lineage
from tracking.scoring.group_and_event_scores import (
    ComparedSides,
    TrackedGroups,
    compared_events,
    near_changes,
    tracked_groups,
    unknown_kinds,
)
from tracking.scoring.group_scores import (
    CORRECT,
    GroupMatch,
    SharedMembers,
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
from tracking.scoring.weighted_sums import F1_AND_PARTS, FrameScores, WeightedScores, mean_of_known, ratio

# Numerator and denominator of T, by the name of the scores; integers avoid rounding.
TOLERANCES = {"right_groups": (2, 3), "exact_groups": (1, 1)}


def link_counts(sides: ComparedSides, true: GroupRows, est: GroupRows) -> Array:
    """Returns the numbers of links of G-MITRE by frame number, (3, size): true, estimated and right links in order."""
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
    """Returns which true groups are right at T, (G,) bool, as the module defines it. tolerance: numerator and
    denominator of T."""
    part, whole = tolerance
    i, j = np.divmod(shared.key, max(shared.width, 1))
    n = true.count[i]
    enough = shared.count >= -(-part * n // whole)
    pure = est.count[j] - shared.count <= -((part - whole) * n // whole)
    right = np.zeros(len(true), bool)
    right[i[enough & pure]] = True
    return right


def pair_counts(true: GroupRows, est: GroupRows, person: Ints) -> Ints:
    """Returns how many pairs of people are in one group in each frame, (last + 1, 3): true, estimated, right pairs.

    person (K,): row of the true person of each membership of `est`, -1 none. An estimated pair is right if its two
    people are in one true group. A pair that is in several estimated groups counts once.
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


def weighted_groups_and_events(sides: ComparedSides, true: TrueGroups, by: GroupMatch) -> list[WeightedScores]:
    """Returns functions from weights (D, size) to the scores of groups, membership, events and lineage, (D,) by key.

    by: matches groups by "hull" (IoU) or by "members" (Jaccard index). The keys are those of the catalogue. Keys with
    "_core" leave out frames up to 1 s from the start of a true merge or split. Keys are missing where the truth or the
    tracker lacks data.
    """
    core = sides.frames & ~near_changes(sides.truth)
    tracked = tracked_groups(sides)
    groups, est, scores = true.groups, tracked.counted, FrameScores(len(core))
    n, m = (scores.column(side.rows.frame, within=sides.frames) for side in (groups, est))
    shared = shared_members(groups, est, tracked.person, len(sides.true.rows))
    hulls = hull_pairs(groups, est) if true.comparable else None
    pairs = hulls if by == "hull" else member_pairs(groups, est, shared) if tracked.known else None
    parts: list[WeightedScores] = [scores]
    if tracked.known:
        parts += _add_membership(scores, sides, groups, tracked, shared)
        found = groups.rows.frame[groups_found(groups, est, shared)]
        scores.add_f1("group", n, m, scores.column(found, within=sides.frames))
        scores.add_f1("group", n * core, m * core, scores.column(found, within=core), "_core")
    if hulls is not None:
        overlapping = matched_groups(groups.pos, est.pos, hulls, FOUND).frame
        scores.add_ratio("group_F1_hull", 2 * scores.column(overlapping, within=sides.frames), n + m)
    if pairs is not None:
        chosen = matched_groups(groups.pos, est.pos, pairs)
        for frames, end in ((sides.frames, ""), (core, "_core")):
            parts.append(_weighted_groups(groups, est, shared, chosen.keep(frames[chosen.frame]), frames, end))
            parts.append(_group_hota(pairs.in_frames(frames), (n + m) * frames, end))
    if sides.truth.events is not None:
        matched, unknown = compared_events(sides, tracked), unknown_kinds(sides)
        parts.append(weighted_events([m for m in matched if m.kind not in unknown], sides.truth.fps, len(core)))
    return parts


def _add_membership(
    scores: FrameScores, sides: ComparedSides, true: GroupRows, tracked: TrackedGroups, shared: SharedMembers
) -> list[WeightedScores]:
    est = tracked.counted
    pairs = pair_counts(true, est, tracked.person)
    of_true, of_est, common = (scores.column(np.arange(len(pairs)), column) for column in pairs.T)
    scores.add_f1("pairwise", of_true, of_est, common)
    n, m = (scores.column(groups.rows.frame) for groups in (true, est))
    parts: list[WeightedScores] = []
    if tracked.named:
        parts.append(_means_over_frames("GMITRE", sides.frames, link_counts(sides, true, est)))
    for name, tolerance in TOLERANCES.items():
        right = scores.column(true.rows.frame[groups_right(true, est, shared, tolerance)])
        means = _means_over_frames(name, sides.frames, np.stack([n, m, right]))
        means.add_further(partial(_f1_of_means, name))
        parts.append(means)
    return parts


def _means_over_frames(name: str, frames: Bools, counts: Array) -> FrameScores:
    (n, m, hits), every, scores = counts, np.flatnonzero(frames), FrameScores(len(frames))
    for key, part, whole in zip(F1_AND_PARTS, (2 * hits, hits, hits), (n + m, m, n), strict=True):
        scores.add_mean(f"{name}_{key}", every, ratio(part, whole, empty=1.0)[every])
    return scores


def _f1_of_means(name: str, means: dict[str, Array], _: object) -> dict[str, Array]:
    p, r = means[f"{name}_precision"], means[f"{name}_recall"]
    return {f"{name}_F1": np.where(p + r > 0, ratio(2 * p * r, p + r), p + r)}


def _weighted_groups(
    true: GroupRows, est: GroupRows, shared: SharedMembers, chosen: Pairs, frames: Bools, end: str
) -> WeightedScores:
    i, j, frame, (part, whole), scores = chosen.i, chosen.j, chosen.frame, CORRECT, FrameScores(len(frames))
    distance = np.hypot(*(true.pos[i] - est.pos[j]).T)
    scores.add_mean(f"group_MOTP{end}", frame, distance)
    scores.add_mean(f"group_MSE{end}", frame, distance**2)
    common = shared.of(i, j)
    right = whole * common >= part * true.count[i]
    pure = right & (whole * common >= part * est.count[j])
    n, m = (scores.column(rows.frame, within=frames) for rows in (true.rows, est.rows))
    hits, switches = scores.column(frame), scores.column(switch_frames(frame, true.rows.id[i], est.rows.id[j]))
    false = m - hits
    ratios = {
        "1-FP": n - false, "1-FN": hits, "MOTA": hits - false - switches,
        "GDSR": scores.column(frame[right]), "GDSR2": scores.column(frame[pure]),
    }  # fmt: skip
    for key, column in ratios.items():
        scores.add_ratio(f"group_{key}{end}", column, n)
    for key, column in {"TP": hits, "FP": false, "FN": n - hits, "IDSW": switches}.items():
        scores.add(f"group_{key}{end}", column)
    return scores


def _group_hota(pairs: Pairs, rows: Array, end: str) -> WeightedScores:
    hota = weighted_hota(pairs, len(rows))

    def score(weights: Array) -> dict[str, Array]:
        some = weights @ rows > 0
        return {f"group_{key}{end}": np.where(some, values, np.nan) for key, values in hota(weights).items()}

    return score


def weighted_events(matched: Sequence[MatchedEvents], fps: float, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to the scores of events and lineage, (D,) by key."""
    scores = FrameScores(size)
    right, with_lineage = np.zeros(size), np.zeros(size)

    def starting(events: Iterable[ComparableEvent]) -> Array:
        return scores.column(np.array([event.start for event in events], np.int64))

    for kind, true, est, pairs in ((m.kind, m.true, m.est, m.pairs) for m in matched):
        hit = {id(event) for pair in pairs for event in pair}
        hits, false, missed = (
            starting(events)
            for events in ([a for a, _ in pairs], *([e for e in side if id(e) not in hit] for side in (est, true)))
        )
        scores.add_f1(kind, hits + missed, hits + false, hits)
        for key, column in {"TP": hits, "FP": false, "FN": missed}.items():
            scores.add(f"{kind}_{key}", column)
        late = [np.nan if b.emitted is None else (b.emitted - a.start) / fps for a, b in pairs]
        scores.add_mean(f"{kind}_latency", np.array([a.start for a, _ in pairs], np.int64), np.array(late, float))
        if kind in HEADLINE:
            right += starting(a for a, b in pairs if same_lineage(a, b))
            with_lineage += starting(a for a in true if a.has_lineage)
    scores.add_ratio("lineage_accuracy", right, with_lineage)
    scores.add_further(_of_merges_and_splits)
    return scores


def _of_merges_and_splits(found: dict[str, Array], sums: dict[str, Array]) -> dict[str, Array]:
    late, known = (np.sum([sums[f"{kind}_latency{of}"] for kind in HEADLINE], axis=0) for of in ("", " of"))
    means = {name: np.column_stack([found[f"{kind}_{name}"] for kind in HEADLINE]) for name in F1_AND_PARTS}
    return {f"event_{k}": mean_of_known(values) for k, values in means.items()} | {"event_latency": ratio(late, known)}
