"""Repairs of errors: the stretch of an error is replaced by the truth, and the result is scored again.

A gap gets the person's true places, and a switch joins the tracks before and after it. Ghosts and false groups are
removed. People of a wrong group, or of a wrong hull, get the true one. When all errors are repaired, only errors of
position are left. Repaired tracks never take an id that is in use in the same frame, so that each of two people who
swapped tracks is repaired alone. A wrong lineage has no repair and no cost: none of these scores counts lineages.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.errors.groups import UNSEEN, GroupError, Memberships
from tracking.errors.people import NOBODY, MatchedPeople, PersonError
from tracking.scoring.frame_weights import unweighted
from tracking.scoring.group_rows import GroupRows
from tracking.scoring.groups import f1, groups_found, shared_members
from tracking.scoring.hota import weighted_hota
from tracking.scoring.identity import weighted_identity
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import Pairs, box_pairs, point_pairs

SHOWN = ("HOTA", "IDF1", "group_F1")
OF_PEOPLE = {"HOTA": weighted_hota, "IDF1": weighted_identity}
NO_HULL = np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class ComparedPeople:
    """The R true and S tracked rows of people, with the places by which they are compared."""

    matched: MatchedPeople
    true_place: Array  # (R, D): positions or boxes by which people are compared
    place: Array  # (S, D)
    reach: float | None  # by which points are matched, in units of their places; None: they are boxes

    def pairs(self, rows: FrameRows, place: Array) -> Pairs:
        """Returns the candidate pairs of the true rows with K tracked rows; place (K, D): their positions or boxes."""
        given = self.matched.pairs.true, rows, self.true_place, place
        return box_pairs(*given) if self.reach is None else point_pairs(*given, self.reach)


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One run as it is compared with the truth."""

    groups: Memberships
    people: ComparedPeople | None  # None for a tracker of whole groups


def scores(
    run: ComparedRun, errors: Collection[PersonError | GroupError] = (), keys: Collection[str] = SHOWN
) -> dict[str, float]:
    """Returns the scores `keys` (some of HOTA, IDF1 and group_F1) of a run after the repair of these errors, by key;
    nan if unknown."""
    found, added = dict.fromkeys(SHOWN, float("nan")), np.zeros(0, np.int64)
    if run.people is not None:
        label, kept, new = _labels(run.people.matched, [error for error in errors if isinstance(error, PersonError)])
        added = np.array(list(new), np.int64)
        if parts := OF_PEOPLE.keys() & keys:
            pairs = _repaired_pairs(run.people, label, kept, new)
            found |= {key: unweighted(OF_PEOPLE[key](pairs, pairs.size), pairs.size)[key] for key in parts}
    if "group_F1" in keys:
        of_groups = [error for error in errors if isinstance(error, GroupError)]
        ghosts = [row for e in errors if isinstance(e, PersonError) and e.person is None for row in e.rows]
        changed = (added, ghosts) if run.groups.named else (added[:0], [])  # who is in a hull does not depend on tracks
        found["group_F1"] = _repaired_f1(run.groups, of_groups, *changed)
    return {key: found[key] for key in keys}


def _repaired_pairs(people: ComparedPeople, label: Ints, kept: Bools, new: dict[int, int]) -> Pairs:
    true, est, rows = people.matched.pairs.true, people.matched.pairs.est, np.array(list(new), np.int64)
    frame = np.concatenate([est.frame[kept], true.frame[rows]])
    order = np.argsort(frame, kind="stable")
    id = np.concatenate([label[kept], np.array(list(new.values()), np.int64)])[order]
    place = np.concatenate([people.place[kept], people.true_place[rows]])[order]
    pairs = people.pairs(FrameRows(frame[order], id), place)
    pairs.require_unique_ids()
    return pairs


def _labels(matched: MatchedPeople, errors: Collection[PersonError]) -> tuple[Ints, Bools, dict[int, int]]:
    """Returns the repaired id of each tracked row, which are kept, and the ids of added true rows."""
    true, est = matched.pairs.true, matched.pairs.est
    label, kept, new = est.id.copy(), np.ones(len(est), bool), {}
    kept[[row for error in errors if error.person is None for row in error.rows]] = False
    used = set(zip(est.frame[kept].tolist(), est.id[kept].tolist(), strict=True))
    fresh = int(est.id.max(initial=-1)) + 1
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


def _repaired_f1(of: Memberships, errors: Collection[GroupError], added: Ints, ghosts: Collection[int]) -> float:
    """Returns group_F1 after repairs; added (A,): true rows of added people, ghosts: tracked rows that go."""
    est = of.est
    gone, alone = np.zeros(len(est), bool), np.zeros(len(est.of), bool)
    loose = np.zeros(len(of.person) + 1, bool)  # the last: a member who is not among the people
    loose[list(ghosts)] = True
    together: dict[int, list[int]] = {}  # by true group, the rows that are one group
    for error in errors:
        gone[list(error.false)] = True
        alone[list(error.alone)] = True
        loose[list(error.rows)] = True
        for row in error.rows:
            together.setdefault(int(of.true_group[of.person[row]]), []).append(row)
    joined = _join_added(of, added, loose, together)
    kept = ~(gone[est.of] | loose[est.member] | alone)
    new = [(len(est) + k, row) for k, rows in enumerate(together.values()) for row in rows]
    home, member = np.array([*joined, *new], np.int64).reshape(-1, 2).T
    home, member = np.append(est.of[kept], home), np.append(est.member[kept], member)
    repaired = _groups_of(home, member, len(est) + len(together))
    nobody_inside = np.append((est.count == 0) & ~gone, np.zeros(len(together), bool))
    repaired = repaired.keep((repaired.count > 1) | nobody_inside)
    person = np.concatenate([of.person, added, [NOBODY]])[repaired.member]
    shared = shared_members(of.true, repaired, person, len(of.people))
    return f1(int(groups_found(of.true, repaired, shared).sum()), len(of.true), len(repaired))


def _groups_of(home: Ints, member: Ints, count: int) -> GroupRows:
    """Returns groups with these memberships, for counting: without frames, ids and places."""
    none = np.zeros(count, np.int64)
    return GroupRows(FrameRows(none, none), np.zeros((count, 2)), (NO_HULL,) * count, home, member)


def _join_added(of: Memberships, added: Ints, loose: Bools, together: dict[int, list[int]]) -> list[tuple[int, int]]:
    """Returns the estimated group that each added person joins, as pairs of rows: that of most tracked mates.

    Where too few mates were tracked for the group to be found, or these have no group, all of them get the true one:
    `loose` and `together` are changed.
    """
    home = np.full(len(of.person) + 1, NOBODY, np.int64)
    home[of.est.member] = of.est.of
    joined = []
    for k, row in enumerate(added.tolist(), len(of.person)):
        i = int(of.true_group[row])
        if i == NOBODY:
            continue
        mates = [int(of.track[m]) for m in of.true_members[i] if m >= 0 and of.track[m] >= 0]
        homes, counts = np.unique([home[j] for j in mates if home[j] >= 0 and not loose[j]], return_counts=True)
        if i not in together and len(homes) and of.states[i] != UNSEEN:
            joined.append((int(homes[np.argmax(counts)]), k))
            continue
        if i not in together:
            loose[mates] = True
            together[i] = mates
        together[i].append(k)
    return joined
