"""All errors of one run of one sequence, with cause and cost; where the score is lost, by cause.

The *cost* of an error is what its repair alone adds to a score (HOTA for errors of people, group_F1 for those of
groups). By cause, repairs are made one after the other, first the part whose repair alone adds most, so that the gains
and what is left (errors of position) add up to all that the run lacks. A tracker of whole groups has errors of groups
only, and HOTA and IDF1 are unknown.
"""

from __future__ import annotations

from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Bools, Sequence, Tracks
from tracking.comparison import scorer_of
from tracking.errors.causes import Cause, Facts, cause_of_ghost, cause_of_group, cause_of_person
from tracking.errors.groups import LINEAGE, GroupError, Memberships, group_errors, wrong_lineages
from tracking.errors.people import PersonError, matched_people, person_errors
from tracking.errors.repairs import SHOWN, ComparedPeople, ComparedRun, scores
from tracking.grouping.foot_points import FEETLESS, source_of
from tracking.oracle import named_detections
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import MatchedSides
from tracking.scoring.events import compared_events
from tracking.scoring.group_rows import TrackedGroups, tracked_groups
from tracking.scoring.people import Similarity
from tracking.scoring.rows import find_rows
from tracking.scoring.similarity import REACH

EVERY = 10**9  # costs of all errors


@dataclass(frozen=True)
class FoundError:
    """One error, its cause, and its cost: what its repair alone adds to HOTA, or for errors of groups to group_F1."""

    error: PersonError | GroupError
    cause: Cause
    cost: float | None  # what its repair alone adds: HOTA, or group_F1 of errors of groups; None: unknown, or not asked

    @property
    def who(self) -> str:
        """The people and tracks concerned, in words."""
        error = self.error
        if isinstance(error, GroupError):
            others = f" with {' '.join(map(str, error.others))}" if error.others else ""
            groups = f"groups {' '.join(map(str, error.engulfed))}: " if error.engulfed else ""
            return f"{groups}people {' '.join(map(str, error.people))}{others}" if error.people else "nobody"
        if error.person is None:
            return f"track {error.after}"
        ids = " → ".join(str(id) for id in dict.fromkeys((error.before, error.after)) if id is not None)
        return f"person {error.person}" + (f", track {ids}" if ids else "")

    def facts(self, fps: float) -> dict[str, Any]:
        """Returns the error as values for JSON: frames from 1, seconds, ids, cause and words."""
        error, of_group = self.error, isinstance(self.error, GroupError)
        people = error.people if isinstance(error, GroupError) else () if error.person is None else (error.person,)
        return {
            "kind": error.kind, "start": error.start, "end": error.end,
            "seconds": (error.end - error.start + 1) / fps, "who": self.who,
            "of": "groups" if of_group else "people", "people": list(people),
            "others": list(getattr(error, "others", ())),
            "engulfed": list(getattr(error, "engulfed", ())), "before": getattr(error, "before", None),
            "after": getattr(error, "after", None),
            "cause": self.cause.name, "detail": self.cause.text, "cost": self.cost,
        }  # fmt: skip


@dataclass(frozen=True)
class CauseRow:
    """Number and total duration of the errors of one kind and cause, and what their repair adds to each score. The
    repair is made after those of the rows before. gains: by key of the score."""

    kind: str
    cause: str
    errors: int
    seconds: float
    gains: dict[str, float]


@dataclass(frozen=True)
class RunErrors:
    """The errors of a run, sorted by start; its scores by key; the gains by cause ([] if not computed); and what is
    left."""

    errors: list[FoundError]
    scores: dict[str, float]
    causes: list[CauseRow]
    left: dict[str, float]  # what is missing after all repairs


def sums_by_cause(runs: SequenceOf[RunErrors]) -> list[CauseRow]:
    """Returns one row per kind and cause over all runs, sorted by the gain in HOTA and group_F1, greatest first. Errors
    and seconds are sums; gains are means over the runs that have the score, nan if none has it."""
    known = {key: sum(run.scores[key] == run.scores[key] for run in runs) for key in SHOWN}
    parts: dict[tuple[str, str], list[CauseRow]] = {}
    for row in (row for run in runs for row in run.causes):
        parts.setdefault((row.kind, row.cause), []).append(row)
    rows = []
    for (kind, cause), same in parts.items():
        sums = {key: float(np.nansum([row.gains[key] for row in same])) for key in SHOWN}
        gains = {key: sums[key] / known[key] if known[key] else float("nan") for key in SHOWN}
        rows.append(CauseRow(kind, cause, sum(row.errors for row in same), sum(row.seconds for row in same), gains))
    return sorted(rows, key=lambda row: -np.nansum([row.gains["HOTA"], row.gains["group_F1"]]))


def errors_of_run(
    sequence: Sequence, run: TrackingRun, similarity: Similarity | None = None, costs: int = EVERY, causes: bool = True
) -> RunErrors:
    """Returns the errors of a run as `find_errors` does, with the detections that the run's `info` tells; so causes
    can tell who was not detected."""
    named = sequence.truth is not None and run.info.get("detections") is not None
    known = named and not any(t.unit == "group" for t in run)
    return find_errors(
        sequence, run, named_detections(sequence, run.info, similarity) if known else None, similarity, costs, causes
    )


def find_errors(
    sequence: Sequence, tracks: SequenceOf[Tracks], seen: SequenceOf[Tracks] | None = None,
    similarity: Similarity | None = None, costs: int = EVERY, causes: bool = True,
) -> RunErrors:  # fmt: skip
    """Returns the errors of one run of a sequence.

    seen: the detections, with the ids of the true people that they show; None: unknown. costs: for how many errors,
    longest first, the cost is computed. causes: True computes the gains by cause. Costs and gains take most of the
    time. Raises InputError without labels, or if labels and tracks cannot be compared.
    """
    given = [tracks] if seen is None else [tracks, seen]
    with scorer_of(sequence) as scorer:
        compared = scorer.compare(given, similarity, None)
    sides = compared[0].sides
    tracked = tracked_groups(sides)
    if not tracked.known:
        raise InputError(
            file=sequence.name, got="groups without members, and no scale of the image", expected="px_per_m",
            remedy="state it with --px-per-m",
        )  # fmt: skip
    run, (_, place, _) = _compared_run(compared[0], tracked), _places(compared[0])
    of = _facts(sequence, compared[0], None if seen is None else compared[1], source_of(tracks) in FEETLESS)
    found = [FoundError(*one, None) for one in _with_causes(compared[0], tracked, run, place, of)]
    whole = scores(run) if costs or causes else {}
    found.sort(key=lambda one: one.error.start - one.error.end)
    found[:costs] = [FoundError(one.error, one.cause, _cost(run, one.error, whole)) for one in found[:costs]]
    found.sort(key=lambda one: (one.error.start, one.error.end))
    return RunErrors(found, whole, *(_by_cause(run, found, whole, of.fps) if causes else ([], {})))


def _with_causes(
    compared: MatchedSides, tracked: TrackedGroups, run: ComparedRun, place: Array, of: Facts
) -> list[tuple[PersonError | GroupError, Cause]]:
    events, found = compared.sides.truth.events, list[tuple[PersonError | GroupError, Cause]]()
    if run.people is not None:
        matched = run.people.matched
        for error in person_errors(matched):
            ghost = error.person is None
            found.append((error, cause_of_ghost(error, matched, place, of) if ghost else cause_of_person(error, of)))
    groups = group_errors(run.groups, events or (), of.fps)
    if events is not None and compared.groups is not None:
        groups += wrong_lineages(compared_events(compared.sides, tracked))
    return [*found, *((error, cause_of_group(error, of)) for error in groups)]


def _cost(run: ComparedRun, error: PersonError | GroupError, whole: dict[str, float]) -> float | None:
    if error.kind == LINEAGE:
        return None
    key = "group_F1" if isinstance(error, GroupError) else "HOTA"
    cost = scores(run, [error], [key])[key] - whole[key]
    return cost if np.isfinite(cost) else None


def _by_cause(
    run: ComparedRun, found: list[FoundError], whole: dict[str, float], fps: float
) -> tuple[list[CauseRow], dict[str, float]]:
    parts: dict[tuple[str, str], list[PersonError | GroupError]] = {}
    for one in found:
        parts.setdefault((one.error.kind, one.cause.name), []).append(one.error)
    alone = {key: scores(run, errors) for key, errors in parts.items()}
    rows, repaired, last = list[CauseRow](), list[PersonError | GroupError](), whole
    for key in sorted(parts, key=lambda key: -np.nansum([alone[key]["HOTA"], alone[key]["group_F1"]])):
        repaired += parts[key]
        now = scores(run, repaired) if rows else alone[key]
        frames = sum(error.end - error.start + 1 for error in parts[key])
        rows.append(CauseRow(*key, len(parts[key]), frames / fps, {k: now[k] - last[k] for k in now}))
        last = now
    return rows, {k: 1 - value for k, value in last.items()}


def _compared_run(compared: MatchedSides, tracked: TrackedGroups) -> ComparedRun:
    """Returns the run as it is repaired."""
    sides, nobody = compared.sides, np.zeros(len(tracked.counted), bool)
    person = sides.mapping if tracked.named else np.arange(len(sides.true.rows))
    true = tracked.counted.keep(nobody) if compared.groups is None else compared.groups.groups
    groups = Memberships(true, tracked.counted, sides.true.rows, person, tracked.named)
    if compared.people is None:
        return ComparedRun(groups, None)
    true_place, place, metre = _places(compared)
    reach: float | None = REACH * metre
    if compared.similarity == "boxes":
        assert sides.true.box is not None
        assert sides.est.box is not None
        true_place, place, reach = sides.true.box, sides.est.box, None
    return ComparedRun(groups, ComparedPeople(matched_people(compared.people), true_place, place, reach))


def _places(compared: MatchedSides) -> tuple[Array, Array, float]:
    """Returns the positions of true (R, 2) and tracked rows (S, 2) where they are compared, and their unit per m."""
    sides, surface = compared.sides, compared.sides.surface
    if compared.people is not None:
        surface = "ground" if compared.similarity == "ground" else "image"
    metre = 1.0 if surface == "ground" else sides.truth.px_per_m
    true, est = sides.true.positions_on(surface, "ground"), sides.est.positions_on(surface, sides.plane)
    assert true is not None
    assert est is not None
    return true, est, metre


def _facts(sequence: Sequence, compared: MatchedSides, seen: MatchedSides | None, pixels: bool) -> Facts:
    """Returns what is known of the true people, of the light and of false alarms."""
    sides = compared.sides
    detected: Bools | None = None
    alarms = np.zeros(0, np.int64), np.zeros((0, 2))
    if seen is not None:
        rows = seen.sides.est.rows
        detected, false = find_rows(rows, sides.true.rows) >= 0, find_rows(sides.true.rows, rows) < 0
        alarms = rows.frame[false], _places(seen)[1][false]
    light = sequence.load_light() if pixels and sequence.load_light is not None else None
    truth, kept, (pos, _, metre) = sides.truth, sides.inside[sides.truth.frame], _places(compared)
    vel, truncation, box = (None if a is None else a[kept] for a in (truth.vel, truth.truncation, truth.box))
    return Facts(
        truth.frame[kept], truth.id[kept], pos, metre, vel, truth.visibility[kept], truncation, box, detected, light,
        truth.fps, alarms,
    )  # fmt: skip
