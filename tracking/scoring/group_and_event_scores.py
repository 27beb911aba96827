"""All scores that need labels of groups: groups (strict and core), pairwise membership, events, lineage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim.types import Bools, Groups, Ints, Tracks, Truth
from tracking.scoring.events import COUNTS_AS, HEADLINE, event_scores, pair_events
from tracking.scoring.events_by_true_people import told_events, told_without_people, true_events
from tracking.scoring.groups import Compared, GroupMatch, compare_groups, detection, group_scores, shared_members
from tracking.scoring.lineage import lineage_scores
from tracking.scoring.pairwise_membership import pairwise_scores
from tracking.scoring.rows import Crowd, People, Surface, crowd, people_inside

CORE = 1.0  # s round each true merge and split that the core leaves out


@dataclass(frozen=True, eq=False)
class Labelled:
    """What can be compared in the labelled frames f, frames[f]: the truth, a tracker's answers (those of other frames,
    too: an event may be told there), both sides' people.

    stands_for: the true row that each estimated person is mapped to, or -1; surface: where groups have their shapes.
    """

    truth: Truth
    answers: Sequence[Tracks]
    frames: Bools
    true: People
    est: People
    stands_for: Ints
    surface: Surface

    @property
    def scale(self) -> float:
        """Units of the surface per metre."""
        return self.truth.px_per_m if self.surface == "image" else 1.0


@dataclass(frozen=True, eq=False)
class Told:
    """A tracker's groups, members being rows of the truth: all of them; those that count, and who their members stand
    for (-1: nobody)."""

    every: Crowd
    counted: Crowd
    who: Ints


def social_scores(case: Labelled, by: GroupMatch) -> dict[str, float]:
    """Scores by key; those that the truth's labels do not allow are missing."""
    ours, comparable = true_groups(case)
    told = told_groups(case)
    found = pairwise_scores(ours, told.counted, told.who)
    shared = shared_members(ours, told.counted, told.who, len(case.true.rows))
    if comparable:
        compared = compare_groups(ours, told.counted, shared, "hull")
        found["group_F1_hull"] = detection(compared, case.frames)["F1"]
        if by == "hull":
            found |= strict_and_core(case, compared)
    if by == "members":
        found |= strict_and_core(case, compare_groups(ours, told.counted, shared, "members"))
    if case.truth.events is not None:
        found |= _events(case, told)
    return found


def true_groups(case: Labelled) -> tuple[Crowd, bool]:
    """The truth's groups, and whether their shapes are on the surface compared; else they have none."""
    wanted, other = case.truth.groups, case.truth.groups_px
    if case.surface == "image":
        wanted, other = other, wanted
    groups = other if wanted is None else wanted
    assert groups is not None, "a frame is labelled where there are groups"
    index = np.flatnonzero(case.frames)
    found = crowd(index, [groups[f - 1] for f in index.tolist()], case.true.rows)
    found = found.keep(found.count > 1)
    return (found, True) if wanted is not None else (replace(found, pos=np.full_like(found.pos, np.nan)), False)


def told_groups(case: Labelled) -> Told:
    """A tracker's groups of two or more. Where it names no members they are the true people in the hull: one person
    inside is left out as one person alone is; a hull with nobody inside is false."""
    answers = [t for t in case.answers if case.frames[t.index]]
    frames = np.array([t.index for t in answers], np.int64)
    every = crowd(frames, [t.groups or Groups.none() for t in answers], case.est.rows)
    if any(t.unit == "group" for t in answers) or not len(every.of):
        places = case.true.places(case.surface, "ground")
        if places is not None:
            every = people_inside(every, case.true.rows, places, case.scale)
        counted = every.keep(every.count != 1)
        return Told(every, counted, counted.who)
    counted = every.keep(every.count > 1)
    return Told(_in_truth(every, case.stands_for), counted, _stand_for(counted, case.stands_for))


def _stand_for(groups: Crowd, stands_for: Ints) -> Ints:
    return np.where(groups.who >= 0, np.append(stands_for, -1)[groups.who], -1)


def _in_truth(groups: Crowd, stands_for: Ints) -> Crowd:
    who = _stand_for(groups, stands_for)
    return replace(groups, of=groups.of[who >= 0], who=who[who >= 0])


def strict_and_core(case: Labelled, compared: Compared) -> dict[str, float]:
    """Group scores over all labelled frames, and again (…_core) without those near a true merge or split."""
    strict = group_scores(compared, case.frames)
    core = group_scores(compared, case.frames & ~near_changes(case.truth))
    return {f"group_{k}": v for k, v in strict.items()} | {f"group_{k}_core": v for k, v in core.items()}


def near_changes(truth: Truth) -> Bools:
    """Frames 0 … length no more than 1 s from the start of a true merge or split."""
    kinds = {*HEADLINE, *(kind for kind, as_ in COUNTS_AS.items() if as_ in HEADLINE)}
    starts = np.array([e.start for e in truth.events or () if e.kind in kinds], float)
    frame = np.arange(truth.length + 1)
    away = np.abs(frame[:, None] - starts[None]).min(axis=1, initial=np.inf)
    return np.asarray(away <= CORE * truth.fps + 1e-9)


def _events(case: Labelled, told: Told) -> dict[str, float]:
    """Scores of events. Crossings and queues are derived from people: of a method without any they are unknown unless
    it tells such itself."""
    truth, rows, frames = case.truth, case.true.rows, case.frames
    assert truth.events is not None
    places = case.true.places("image", "ground") if case.surface == "image" else None
    happened = true_events(truth.events, rows, case.true.group, places, frames)
    by_people = not any(t.unit == "group" for t in case.answers)
    said = told_without_people(case.answers, told.every, rows, frames, truth.fps, by_people)
    if by_people:
        said += told_events(case.answers, case.est, case.stands_for, rows, frames, truth.fps)
    pairings = pair_events(happened, said, truth.fps, case.scale)
    found = event_scores(pairings, truth.fps) | lineage_scores(pairings)
    if by_people:
        return found
    silent = {"cross", "queue"} - {event.kind for t in case.answers for event in t.events}
    return {k: float("nan") if k.partition("_")[0] in silent else v for k, v in found.items()}
