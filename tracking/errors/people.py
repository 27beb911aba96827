"""Errors of people: switches, fragments, misses, late confirmations and ghosts, from the matches of CLEAR.

A true person is matched with at most one track in a frame. A stretch of frames in which a person is present and not
matched is a *gap*.

    late        a gap before the first match of the person: the track was confirmed late
    miss        a gap after which the person is not matched again: the track ended early, or there never was one
    fragment    a gap between two matches with the same track: the track flickers
    switch      a match with another track than in the match before, after a gap or without one; where two people swap
                ids, there are two
    ghost       a stretch of frames in which a track is reported and not matched

The number of switches is IDSW, that of fragments and of switches after a gap is Frag. The frames of all gaps sum to FN,
those of all ghosts to FP.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np

from sim.types import Ints
from tracking.scoring.clear import clear_matches
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import Pairs

PersonKind = Literal["switch", "fragment", "miss", "late", "ghost"]
NOBODY = -1


@dataclass(frozen=True, eq=False)
class MatchedPeople:
    """The R true and S tracked rows (one per person and frame), matched as CLEAR does."""

    pairs: Pairs  # candidate pairs of both sides
    track: Ints  # (R,): row of the track that each true person is matched with, -1 none
    person: Ints  # (S,): row of the true person that each track is matched with, -1 none


@dataclass(frozen=True)
class PersonError:
    """One error of a true person, or a ghost."""

    kind: PersonKind
    start: int  # first frame without a match; of a switch without a gap, the frame of the new track
    end: int  # last frame without a match; of a switch, the frame of the new track
    rows: tuple[int, ...]  # true rows of the gap, or tracked rows of the ghost
    person: int | None  # id of the true person; None for a ghost
    before: int | None = None  # id of the track that the person had before
    after: int | None = None  # id of the track that the person has afterwards; of a ghost, its own id


def matched_people(pairs: Pairs) -> MatchedPeople:
    """Returns the rows of both sides with the matches of CLEAR among their candidate pairs."""
    found = clear_matches(pairs)
    track, person = np.full(len(pairs.true), NOBODY, np.int64), np.full(len(pairs.est), NOBODY, np.int64)
    track[found.i], person[found.j] = found.j, found.i
    return MatchedPeople(pairs, track, person)


def person_errors(matched: MatchedPeople) -> list[PersonError]:
    """Returns all errors of people, ghosts included, sorted by start, then end and kind."""
    every = [*_errors_of_people(matched), *_ghosts(matched)]
    return sorted(every, key=lambda error: (error.start, error.end, error.kind))


def _errors_of_people(matched: MatchedPeople) -> Iterator[PersonError]:
    true, est = matched.pairs.true, matched.pairs.est
    found = np.where(matched.track == NOBODY, NOBODY, np.append(est.id, NOBODY)[matched.track])
    for person, rows in _by_id(true.id):
        before: int | None = None
        gap: tuple[int, ...] = ()
        for track, of_track in groupby(rows, key=lambda row: int(found[row])):
            stretch = tuple(of_track)
            if track == NOBODY:
                gap = stretch
                continue
            frame = int(true.frame[stretch[0]])
            span = first_and_last(true, gap) if gap else (frame, frame)
            if before not in (None, track):
                yield PersonError("switch", span[0], frame, gap, person, before, track)
            elif gap:
                yield PersonError("late" if before is None else "fragment", *span, gap, person, before, track)
            before, gap = track, ()
        if gap:
            yield PersonError("miss", *first_and_last(true, gap), gap, person, before)


def _ghosts(matched: MatchedPeople) -> Iterator[PersonError]:
    est = matched.pairs.est
    for track, rows in _by_id(est.id):
        for person, of_person in groupby(rows, key=lambda row: int(matched.person[row]) == NOBODY):
            if person:
                stretch = tuple(of_person)
                yield PersonError("ghost", *first_and_last(est, stretch), stretch, None, None, track)


def first_and_last(rows: FrameRows, stretch: Sequence[int]) -> tuple[int, int]:
    """Returns the first and the last frame of a stretch; stretch: row indices in `rows`, sorted by frame."""
    return int(rows.frame[stretch[0]]), int(rows.frame[stretch[-1]])


def _by_id(id: Ints) -> Iterator[tuple[int, list[int]]]:
    """Yields each id with its rows, by frame; rows are sorted by frame."""
    order = np.argsort(id, kind="stable")
    cuts = np.flatnonzero(np.diff(id[order], prepend=-1)) if len(id) else np.zeros(0, np.int64)
    for rows in np.split(order, cuts[1:]) if len(id) else ():
        yield int(id[rows[0]]), rows.tolist()
