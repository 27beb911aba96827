"""Scores of events and of lineage: a tracker's events matched one to one to the true ones, kind by kind.

Two events match if their kind is equal, their starts are at most 1 s apart and their people agree: the Jaccard index of
the members is at least 0.5. If a tracker names no people, the positions must be at most 1.5 m apart instead. `form`
counts as merge and `dissolve` as split. Lineage: a matched merge or split is right if its parents and its children are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.scoring.annotated_frames import first_seen, widest_step
from tracking.scoring.event_members import (
    COUNTS_AS,
    HEADLINE,
    HULL_TIME,
    KINDS,
    ComparableEvent,
    EventMembers,
    events_of_hulls,
    tracked_events,
    true_events,
)
from tracking.scoring.frame_weights import F1_AND_PARTS, FrameScores, WeightedScores, mean_of_known, ratio
from tracking.scoring.group_rows import TrackedGroups
from tracking.scoring.people import ComparedSides

LATE = 1.0  # s: greatest difference of the starts
ALIKE = 0.5  # least Jaccard index of the members
NEAR = 1.5  # m: greatest distance if no members are named
SAME_PART = 0.5  # two parts are the same if their Jaccard index exceeds this; then no other part can be the same


@dataclass(frozen=True, slots=True)
class MatchedEvents:
    """All events of one kind in a sequence, of the truth and of a tracker, and which of them match."""

    # "merge", "split", "cross", "queue", "enter" or "leave"; "form" is among the merges, "dissolve" among the splits
    kind: str
    # true, est: the true events and the tracker's events of this kind, matched or not
    true: Sequence[ComparableEvent]
    est: Sequence[ComparableEvent]
    # the matched events, each (true event, tracker's event); an event is in one pair at most
    pairs: Sequence[tuple[ComparableEvent, ComparableEvent]]


def compared_events(sides: ComparedSides, tracked: TrackedGroups) -> list[MatchedEvents]:
    """Returns the events of the truth and of the tracker that start in labelled frames, matched, one entry per kind."""
    truth, rows, frames, fps = sides.truth, sides.true.rows, sides.frames, sides.truth.fps
    assert truth.events is not None
    step, happened = widest_step(sides.inside), first_seen(truth.events, sides.inside)
    positions = sides.true.positions_on("image", "ground") if sides.surface == "image" else None
    true = true_events(happened, sides.true, positions, frames, step)
    names_members = not sides.groups_only
    est = events_of_hulls(sides.tracks, tracked.every, rows, frames, max(round(HULL_TIME * fps), step), names_members)
    if names_members:
        est += tracked_events(sides.tracks, sides.est, sides.mapping, rows, frames, max(round(LATE * fps), step))
    return match_events(true, est, fps, sides.scale)


def unknown_kinds(sides: ComparedSides) -> set[str]:
    """Returns the kinds of events whose scores are unknown. For a tracker of whole groups they are "cross" and "queue",
    unless it reports such an event. Else there are none."""
    if not sides.groups_only:
        return set()
    return {"cross", "queue"} - {event.kind for t in sides.tracks for event in t.events}


def match_events(
    true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], fps: float, scale: float
) -> list[MatchedEvents]:
    """Returns one `MatchedEvents` per kind, in the order of `KINDS`, also for kinds without events. scale: units of
    `pos` per metre. Of several matchings, one with the most pairs is taken, then the most similar."""
    found = []
    for kind in KINDS:
        a, b = ([e for e in side if COUNTS_AS.get(e.kind, e.kind) == kind] for side in (true, est))
        found.append(MatchedEvents(kind, a, b, _one_to_one(a, b, _similarity(a, b, fps, scale))))
    return found


def _similarity(true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], fps: float, scale: float) -> Array:
    """Returns the similarity (N, M) of true and estimated events, 0 if they cannot be matched."""
    starts = [np.array([e.start for e in side], float) for side in (true, est)]
    late = np.abs(starts[0][:, None] - starts[1][None]) / fps
    similarity = np.zeros(late.shape)
    for i, j in np.argwhere(late <= LATE + 1e-9).tolist():
        a, b = true[i], est[j]
        if a.members is not None and b.members is not None:
            s = a.members.jaccard(b.members)
            similarity[i, j] = s if s >= ALIKE - 1e-12 else 0.0
        else:
            d = float(np.hypot(a.pos[0] - b.pos[0], a.pos[1] - b.pos[1])) / scale
            similarity[i, j] = 1 - d / (2 * NEAR) if d <= NEAR + 1e-9 else 0.0
    # Between equally similar events the one with the nearer start wins.
    return np.where(similarity > 0, similarity + (LATE - late) * 1e-3, 0.0)


def _one_to_one(
    true: Sequence[ComparableEvent], est: Sequence[ComparableEvent], similarity: Array
) -> list[tuple[ComparableEvent, ComparableEvent]]:
    if not similarity.any():
        return []
    from scipy.optimize import linear_sum_assignment

    one_more = 2.0 * min(similarity.shape)  # outweighs the total similarity of all pairs
    rows, columns = linear_sum_assignment(np.where(similarity > 0, one_more + similarity, 0.0), maximize=True)
    return [(true[i], est[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if similarity[i, j] > 0]


def same_lineage(true: ComparableEvent, est: ComparableEvent) -> bool:
    """Returns True if both events have equally many parents and equally many children, and these agree. They agree if
    each true part has an estimated part with a Jaccard index above 0.5. False if any lineage is unknown."""
    if true.parents is None or true.children is None or est.parents is None or est.children is None:
        return False
    return _same_parts(true.parents, est.parents) and _same_parts(true.children, est.children)


def _same_parts(true: Sequence[EventMembers], est: Sequence[EventMembers]) -> bool:
    return len(true) == len(est) and all(any(a.jaccard(b) > SAME_PART for b in est) for a in true)


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
