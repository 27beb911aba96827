"""Repairs of errors: the stretch of an error is replaced by the truth, and the result is scored again.

A gap of a person gets the true places, and a switch joins the tracks before and after it; a ghost goes; people of a
wrong group get the true one. When all errors are repaired, only errors of position are left. Repaired tracks never take
an id that is in use in the same frame, so that each of two people who swapped tracks is repaired alone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.errors.groups import ALONE, GroupError, Memberships, group_f1, memberships, states
from tracking.errors.people import NOBODY, MatchedPeople, PersonError
from tracking.scoring.candidate_pairs import Pairs
from tracking.scoring.evaluation import people_scores
from tracking.scoring.rows import FrameRows

SHOWN = ("HOTA", "IDF1", "group_F1")


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One run as it is compared with the truth: R true and S tracked people in frames, matched."""

    matched: MatchedPeople
    true_place: Array  # (R, D): positions or boxes by which people are compared
    place: Array  # (S, D)
    true_group: Ints  # (R,): group of each true row, -1 alone
    group: Ints  # (S,): group of each tracked row, -1 alone
    person: Ints  # (S,): true row that each tracked row stands for in groups, -1 none
    labelled: Bools  # (length + 1,): frames with labelled groups
    pairs: Callable[[FrameRows, Array], Pairs]  # tracked rows and places: the candidate pairs with the truth

    def memberships(self) -> Memberships:
        """Returns who is in which group."""
        true, est = self.matched.pairs.true, self.matched.pairs.est
        sides = (true.frame, self.true_group), (est.frame, self.group)
        return memberships(*sides, _inverse(self.person, len(true)), self.person, self.labelled)

    @cached_property
    def unseen(self) -> set[tuple[int, int]]:
        """Frames and true groups of which too few members are tracked."""
        of = self.memberships()
        return {(frame, g) for frame in of.true for g, state in states(of, frame) if state == "unseen"}


def _inverse(person: Ints, people: int) -> Ints:
    track = np.full(people, NOBODY, np.int64)
    track[person[person >= 0]] = np.flatnonzero(person >= 0)
    return track


def scores(
    run: ComparedRun, errors: Collection[PersonError | GroupError] = (), keys: Collection[str] = SHOWN
) -> dict[str, float]:
    """Returns HOTA, IDF1 and group_F1 of a run after the repair of some errors, or some of these scores."""
    people = [error for error in errors if isinstance(error, PersonError)]
    label, kept, new = _labels(run.matched, people)
    group = run.group.copy()
    for error in errors:
        if isinstance(error, GroupError):
            group[list(error.alone)] = ALONE
            group[list(error.rows)] = ALONE if error.group is None else _fresh(run.group) + error.group
    true, est = run.matched.pairs.true, run.matched.pairs.est
    rows = np.array(list(new), np.int64)
    frame = np.concatenate([est.frame[kept], true.frame[rows]])
    order = np.argsort(frame, kind="stable")
    id = np.concatenate([label[kept], np.array(list(new.values()), np.int64)])[order]
    place = np.concatenate([run.place[kept], run.true_place[rows]])[order]
    found: dict[str, float] = {}
    if {"HOTA", "IDF1"} & set(keys):
        found = people_scores(run.pairs(FrameRows(frame[order], id), place))
    if "group_F1" in keys:
        added = _groups_of_added(run, group, rows)
        person, groups = (np.concatenate([a[kept], b])[order] for a, b in ((run.person, rows), (group, added)))
        sides = (true.frame, run.true_group), (frame[order], groups)
        found["group_F1"] = group_f1(memberships(*sides, _inverse(person, len(true)), person, run.labelled))
    return {key: found[key] for key in keys}


def _fresh(values: Ints) -> int:
    return int(values.max(initial=-1)) + 1


def _labels(matched: MatchedPeople, errors: Collection[PersonError]) -> tuple[Ints, Bools, dict[int, int]]:
    """Returns the repaired id of each tracked row, which are kept, and the ids of added true rows."""
    true, est = matched.pairs.true, matched.pairs.est
    label, kept, new = est.id.copy(), np.ones(len(est), bool), {}
    kept[[row for error in errors if error.person is None for row in error.rows]] = False
    used = set(zip(est.frame[kept].tolist(), est.id[kept].tolist(), strict=True))
    fresh = _fresh(est.id)
    by_person: dict[int, list[PersonError]] = {}
    for error in errors:
        if error.person is not None:
            by_person.setdefault(error.person, []).append(error)
    for person, ours in by_person.items():
        for segment in _segments(matched, np.flatnonzero(true.id == person), ours):
            added = [row for row in segment if matched.track[row] == NOBODY]
            tracked = [int(matched.track[row]) for row in segment if matched.track[row] != NOBODY]
            ids = set(est.id[tracked].tolist())
            taken = not ids or any((int(true.frame[row]), id) in used for row in added for id in ids)
            name = fresh if taken or len(ids) > 1 else ids.pop()
            fresh += name == fresh
            label[tracked] = name
            new.update(dict.fromkeys(added, name))
    return label, kept, new


def _segments(matched: MatchedPeople, rows: Ints, errors: list[PersonError]) -> list[list[int]]:
    """Returns the true rows of a person that get one id each after the repair, by frame."""
    joined = {error.end for error in errors if error.kind == "switch"}
    filled = {row for error in errors for row in error.rows}
    est, frame = matched.pairs.est, matched.pairs.true.frame
    segments: list[list[int]] = []
    last: int | None = None
    for row in rows.tolist():
        j = matched.track[row]
        if j == NOBODY:
            if row in filled:
                segments = segments or [[]]
                segments[-1].append(row)
            continue
        id = int(est.id[j])
        if not segments or (last is not None and id != last and int(frame[row]) not in joined):
            segments.append([])
        segments[-1].append(row)
        last = id
    return segments


def _groups_of_added(run: ComparedRun, group: Ints, rows: Ints) -> Ints:
    """Returns the group of added true people: that of most tracked mates.

    Where too few mates were tracked for the group to be found, or these have no group, all of them get the true one.
    """
    true, found = run.matched.pairs.true, np.full(len(rows), ALONE, np.int64)
    rows_of = _inverse(run.person, len(true))
    for k, row in enumerate(rows.tolist()):
        mine = int(run.true_group[row])
        if mine == ALONE:
            continue
        first, after = np.searchsorted(true.frame, (true.frame[row], true.frame[row] + 1))
        mates = np.arange(first, after)[run.true_group[first:after] == mine]
        tracked = rows_of[mates]
        tracked = tracked[tracked != NOBODY]
        labels, counts = np.unique(group[tracked][group[tracked] != ALONE], return_counts=True)
        if len(labels) and (int(true.frame[row]), mine) not in run.unseen:
            found[k] = labels[np.argmax(counts)]
        else:
            group[tracked] = found[k] = _fresh(run.group) + mine
    return found
