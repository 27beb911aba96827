"""All errors of one run of one sequence, with cause and cost; where the score is lost, by cause.

The *cost* of an error is what its repair alone adds to a score (HOTA for errors of people, group_F1 for those of
groups). By cause, repairs are made one after the other, the one that adds most first, so that their gains and what is
left (errors of position) add up to all that the run lacks.
"""

from __future__ import annotations

from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Bools, Ints, Sequence, Tracks
from tracking.comparison import scorer_of
from tracking.errors.causes import Cause, Facts, cause_of_ghost, cause_of_group, cause_of_person, facts
from tracking.errors.groups import GroupError, group_errors
from tracking.errors.people import PersonError, matched_people, person_errors
from tracking.errors.repairs import ComparedRun, scores
from tracking.oracle import oracle
from tracking.running.run import TrackingRun
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.evaluation import MatchedSides
from tracking.scoring.people_and_groups import Surface
from tracking.scoring.people_comparison import Similarity
from tracking.scoring.position_errors import REACH
from tracking.scoring.rows import FrameRows, find_rows


@dataclass(frozen=True)
class FoundError:
    """One error with its cause and its cost."""

    error: PersonError | GroupError
    cause: Cause
    cost: float | None  # what its repair alone adds: HOTA, or group_F1 of errors of groups; None: not asked for

    @property
    def who(self) -> str:
        """The people and tracks concerned, in words."""
        error = self.error
        if isinstance(error, GroupError):
            others = f" with {' '.join(map(str, error.others))}" if error.others else ""
            return f"people {' '.join(map(str, error.people))}{others}"
        if error.person is None:
            return f"track {error.after}"
        ids = " → ".join(str(id) for id in dict.fromkeys((error.before, error.after)) if id is not None)
        return f"person {error.person}" + (f", track {ids}" if ids else "")

    def facts(self, fps: float) -> dict[str, Any]:
        """Returns the error as values for JSON: frames from 1, seconds, ids, cause and words."""
        error = self.error
        who: dict[str, Any] = (
            {"of": "groups", "people": list(error.people), "others": list(error.others), "before": None, "after": None}
            if isinstance(error, GroupError)
            else {
                "of": "people", "people": [] if error.person is None else [error.person], "others": [],
                "before": error.before, "after": error.after,
            }
        )  # fmt: skip
        return {
            "kind": error.kind, "start": error.start, "end": error.end,
            "seconds": (error.end - error.start + 1) / fps, "who": self.who, **who,
            "cause": self.cause.name, "detail": self.cause.text, "cost": self.cost,
        }  # fmt: skip


@dataclass(frozen=True)
class CauseRow:
    """What the repair of all errors of one kind and cause adds, after the repairs of the rows before."""

    kind: str
    cause: str
    errors: int
    seconds: float
    gains: dict[str, float]


@dataclass(frozen=True)
class RunErrors:
    """The errors of a run by start, the scores as they are, and where the rest is lost."""

    errors: list[FoundError]
    scores: dict[str, float]
    causes: list[CauseRow] = field(default_factory=list)
    left: dict[str, float] = field(default_factory=dict)  # what is missing after all repairs


def errors_of_run(
    sequence: Sequence, run: TrackingRun, similarity: Similarity | None = None, costs: bool = True
) -> RunErrors:
    """Returns the errors of a run, with the detections of the input that it names.

    Raises InputError as `find_errors`, and for a tracker of whole groups.
    """
    if any(t.unit == "group" for t in run):
        raise InputError(
            file=sequence.name, got="a tracker of whole groups", expected="tracks of people",
            remedy="score it with `flockscope score`",
        )  # fmt: skip
    seen = oracle(sequence, run.info, similarity) if run.info.get("detections") is not None else None
    return find_errors(sequence, run, seen, similarity, costs)


def find_errors(
    sequence: Sequence, tracks: SequenceOf[Tracks], seen: SequenceOf[Tracks] | None = None,
    similarity: Similarity | None = None, costs: bool = True,
) -> RunErrors:  # fmt: skip
    """Returns the errors of a run of people; seen: tracks of true ids that show which people were detected.

    Without costs, the costs and gains are not known, which is much quicker. Raises InputError without labels, or if
    they and the tracks cannot be compared.
    """
    given = [tracks] if seen is None else [tracks, seen]
    with scorer_of(sequence) as scorer:
        compared = scorer.compare(given, similarity, None)
    run, of, place = _prepared(compared[0], None if seen is None else compared[1])
    matched = run.matched
    people = person_errors(matched)
    groups = group_errors(run.memberships(), matched.pairs.true.id, compared[0].sides.truth.events or (), of.fps)
    causes = [cause_of_ghost(e, matched, place, of) if e.person is None else cause_of_person(e, of) for e in people] + [
        cause_of_group(e, of) for e in groups
    ]
    every: list[PersonError | GroupError] = [*people, *groups]
    whole = scores(run)
    worth = [_cost(run, error, whole) if costs else None for error in every]
    found = [FoundError(*one) for one in zip(every, causes, worth, strict=True)]
    found.sort(key=lambda one: (one.error.start, one.error.end))
    return RunErrors(found, whole, *(_by_cause(run, found, whole, of.fps) if costs else ([], {})))


def _cost(run: ComparedRun, error: PersonError | GroupError, whole: dict[str, float]) -> float:
    key = "group_F1" if isinstance(error, GroupError) else "HOTA"
    return scores(run, [error], [key])[key] - whole[key]


def _by_cause(
    run: ComparedRun, found: list[FoundError], whole: dict[str, float], fps: float
) -> tuple[list[CauseRow], dict[str, float]]:
    parts: dict[tuple[str, str], list[FoundError]] = {}
    for one in found:
        parts.setdefault((one.error.kind, one.cause.name), []).append(one)
    order = sorted(parts, key=lambda key: -sum(one.cost or 0.0 for one in parts[key]))
    rows, repaired, last = [], [], whole
    for key in order:
        repaired += [one.error for one in parts[key]]
        now = scores(run, repaired)
        frames = sum(one.error.end - one.error.start + 1 for one in parts[key])
        rows.append(CauseRow(*key, len(parts[key]), frames / fps, {k: now[k] - last[k] for k in now}))
        last = now
    return rows, {k: 1 - value for k, value in last.items()}


def _prepared(compared: MatchedSides, seen: MatchedSides | None) -> tuple[ComparedRun, Facts, Array]:
    """Returns the run as it is repaired, the facts of the truth, and the positions of tracked people (S, 2)."""
    sides, pairs = compared.sides, compared.people
    assert pairs is not None, "a tracker of whole groups reports no people"
    boxes = compared.similarity == "boxes"
    surface: Surface = "ground" if compared.similarity == "ground" else "image"
    true_pos, pos = sides.true.positions_on(surface, "ground"), sides.est.positions_on(surface, sides.plane)
    assert true_pos is not None
    assert pos is not None
    metre = 1.0 if surface == "ground" else sides.truth.px_per_m
    true_place, place = (sides.true.box, sides.est.box) if boxes else (true_pos, pos)
    assert true_place is not None
    assert place is not None

    def compare(rows: FrameRows, places: Array) -> Pairs:
        assert true_place is not None
        if boxes:
            return box_pairs(pairs.true, rows, true_place, places)
        return point_pairs(pairs.true, rows, true_place, places, REACH * metre)

    run = ComparedRun(
        matched_people(pairs), true_place, place, sides.true.group, _groups(sides.tracks, sides.est.rows),
        sides.mapping, sides.frames, compare,
    )  # fmt: skip
    detected: Bools | None = None
    if seen is not None:
        detected = find_rows(seen.sides.est.rows, sides.true.rows) >= 0
    kept = sides.inside[sides.truth.frame]
    return run, facts(sides.truth, kept, true_pos, metre, detected), pos


def _groups(tracks: SequenceOf[Tracks], rows: FrameRows) -> Ints:
    """Returns the group of each tracked row, (S,), by the members that groups name."""
    group = np.full(len(rows), -1, np.int64)
    for t in tracks:
        named = t.groups is not None and len(t.groups.members) > 0
        for id, members in zip(t.groups.id, t.groups.members, strict=True) if t.groups is not None and named else ():
            where = find_rows(rows, FrameRows(np.full(len(members), t.index), np.asarray(members)))
            group[where[where >= 0]] = id
    return group
