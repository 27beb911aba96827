"""All scores of a tracker against a truth: `evaluate`, and `Scorer`, which prepares one truth for many evaluations.

This module decides what is compared (which frames, which similarity of people, which surface for groups). It calls the
modules of the single scores and returns their results under the keys of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sim.types import Bools, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.annotated_frames import annotated_frames, seen_in
from tracking.scoring.candidate_pairs import Pairs
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.clear import clear
from tracking.scoring.distractors import without_distractors
from tracking.scoring.group_and_event_scores import ComparedSides
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.matching import mapped_people
from tracking.scoring.one_plane import from_pixels, grounded, in_one_plane, on_feet
from tracking.scoring.people_and_groups import (
    PersonRows,
    Surface,
    TrueGroups,
    tracked_people,
    true_groups,
    true_people,
)
from tracking.scoring.people_comparison import (
    IncomparableError,
    Similarity,
    people_pairs,
    plane_of,
)
from tracking.scoring.position_errors import position_scores
from tracking.scoring.weighted_group_scores import weighted_groups_and_events
from tracking.scoring.weighted_sums import unweighted

__all__ = ["IncomparableError", "MatchedSides", "Scorer", "Scores", "Similarity", "evaluate"]


@dataclass(frozen=True, eq=False)
class MatchedSides:
    """One truth and one tracker's tracks, compared but not counted yet.

    - sides: both sides in the scored frames, people mapped.
    - similarity: how people are compared. people: their candidate pairs, None for a tracker of whole groups.
    - groups: the true groups in the scored frames, None if none of these frames is labelled.
    """

    sides: ComparedSides
    similarity: Similarity
    people: Pairs | None
    groups: TrueGroups | None


@dataclass(frozen=True, eq=False)
class Scores(Mapping[str, float]):
    """A read-only mapping from key to score (float), with every key of the catalogue in its order; KeyError for others.

    - by_key: the scores. nan: not labelled, not comparable, or a denominator of 0.
    - similarity: how people were compared, by "boxes" (IoU) or by positions on the "ground" or in the "image".
    - surface: where groups were compared, "ground" or "image".
    - group_match: how groups were matched, by "hull" or by "members".
    - frames: number of scored frames. length: number of frames of the sequence. step: from one annotated frame to the
      next, 1 unless the labels are sparse; None if they are not evenly spaced.
    """

    by_key: Mapping[str, float]
    similarity: Similarity
    surface: Surface
    group_match: GroupMatch
    frames: int
    length: int
    step: int | None

    def __getitem__(self, key: str) -> float:
        return self.by_key[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_key)

    def __len__(self) -> int:
        return len(self.by_key)

    def __str__(self) -> str:
        """Returns one line per score that is not nan: key, padded to 28 characters, and value with four significant
        digits.
        """
        return "\n".join(f"{key:28} {value:.4g}" for key, value in self.items() if not math.isnan(value))


def evaluate(
    truth: Truth,
    tracks: Iterable[Tracks],
    *,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
    frames: int | range | None = None,
) -> Scores:
    """Returns every score of the catalogue (docs/reference/metrics.md) for one tracker; a score that cannot be computed
    is nan.

    tracks: the tracker's `Tracks`, one per frame, in any order; of two with equal frame the later is used. similarity:
    compares people by IoU ("boxes") or by max(0, 1 - d / 2 m) ("ground", "image"), d being their distance. None follows
    the data, as tracking.scoring.one_plane says. group_match: matches groups by IoU of their hulls ("hull") or
    Jaccard index of their members ("members"); group_F1, group_precision and group_recall are by members in both cases.
    frames: a number n scores frames 1 … n, a range only its frames, None all frames. A frame without tracks counts as
    empty. If the labels are clearly sparse, only annotated frames are scored (`annotated_frames`).

    Groups and events that the tracks lack come from the default grouping, in the image only if `truth.px_per_m` is
    known. Scores of people are nan for a tracker of whole groups, scores of groups and events if no scored frame has
    group labels.

    Raises IncomparableError if boxes or positions to be compared are missing, ValueError if an id occurs twice in one
    frame, and InputError if groups must be derived in the image and `truth.px_per_m` is 0 or less.
    """
    return Scorer(truth).evaluate(tracks, similarity=similarity, group_match=group_match, frames=frames)


class Scorer:
    """Scores any number of trackers against one truth.

    State: truth, on the ground if its boxes can be; annotated, its frames that can be scored; labelled (length + 1,),
    bool by frame number: the frame is annotated with groups; the true people and groups as rows of arrays, built at
    first use and kept. The truth must not change meanwhile.
    """

    def __init__(self, truth: Truth) -> None:
        self.truth = truth = grounded(truth)
        self.annotated = annotated_frames(truth)
        self.labelled = labelled_frames(truth) & self.annotated.frames
        self._groups: dict[Surface, TrueGroups] = {}

    @cached_property
    def of_feet(self) -> Scorer:
        """The scorer of tracks that were moved to the ground by their boxes: true people stand where their boxes do."""
        return Scorer(on_feet(self.truth))

    @cached_property
    def people(self) -> PersonRows:
        """The true people of all frames as `PersonRows`, one row per person and frame, sorted by frame."""
        return true_people(self.truth, chosen_frames(None, self.truth.length))

    def scored(self, frames: int | range | None) -> Bools:
        """Returns which of the frame numbers 0 … length are scored, (length + 1,) bool: chosen and annotated ones.

        frames: n for frames 1 … n, a range, or None for all.
        """
        return chosen_frames(frames, self.truth.length) & self.annotated.frames

    def groups(self, surface: Surface) -> TrueGroups:
        """Returns the true groups of two or more people in all labelled frames; members are row indices of `people`.

        surface: "ground" (m) or "image" (px). If the truth has groups on the other surface only, their shapes do not
        count: `comparable` is False. Raises AssertionError if the truth has groups on neither.
        """
        if surface not in self._groups:
            self._groups[surface] = true_groups(self.truth, self.labelled, self.people.rows, surface)
        return self._groups[surface]

    def sides(self, tracks: Sequence[Tracks], frames: Bools) -> ComparedSides:
        """Returns the truth's and the tracker's data in the frames f where frames[f] is true, before people are mapped.

        tracks: one tracker's, of these frames only, sorted by frame. frames (length + 1,): bool by frame number. In the
        result `frames` keeps only labelled frames, and `mapping` is -1 for every tracked row. Tracked people on
        distractors are left out.
        """
        kept = frames[self.people.rows.frame]
        true = self.people if kept.all() else self.people.keep(kept)
        est, plane = tracked_people(tracks), plane_of(self.truth, tracks)
        if self.truth.unscored is not None:
            est = without_distractors(self.truth, self.truth.unscored, est)
        nobody = np.full(len(est.rows), -1, np.int64)
        return ComparedSides(self.truth, tracks, frames, self.labelled & frames, true, est, nobody, plane)

    def evaluate(
        self,
        tracks: Iterable[Tracks],
        *,
        similarity: Similarity | None = None,
        group_match: GroupMatch = "hull",
        frames: int | range | None = None,
    ) -> Scores:
        """Returns every score of the catalogue for one tracker against this truth, as the function `evaluate` does."""
        (found,) = self.evaluate_all([tracks], similarity=similarity, group_match=group_match, frames=frames)
        return found

    def evaluate_all(
        self,
        runs: Sequence[Iterable[Tracks]],
        *,
        similarity: Similarity | None = None,
        group_match: GroupMatch = "hull",
        frames: int | range | None = None,
    ) -> list[Scores]:
        """Returns the scores of several runs, all compared in one plane and by one similarity; else as `evaluate`.

        Raises what `evaluate` raises, and IncomparableError if the runs fit no common plane.
        """
        return [_scores(one, group_match, self.annotated.step) for one in self.compare(runs, similarity, frames)]

    def compare(
        self, runs: Sequence[Iterable[Tracks]], similarity: Similarity | None, frames: int | range | None
    ) -> list[MatchedSides]:
        """Returns this truth and the tracks of each run with people mapped, ready to be counted.

        runs: `Tracks` in any order, at most one per frame counts. similarity: as in `evaluate`. frames: those to score,
        as in `evaluate`.

        Raises IncomparableError if boxes or positions are missing or the runs fit no common plane, and InputError if
        groups must be derived in the image and `truth.px_per_m` is 0 or less.
        """
        inside = self.scored(frames)
        ordered = [_in_order(run, inside) for run in runs]
        moved, chosen = in_one_plane(self.truth, ordered, [from_pixels(run) for run in runs], similarity)
        judges = [self.judge(given, run) for given, run in zip(ordered, moved, strict=True)]
        return [judge._matched(run, chosen, inside) for judge, run in zip(judges, moved, strict=True)]

    def judge(self, given: Sequence[Tracks], moved: Sequence[Tracks]) -> Scorer:
        """Returns the scorer for a run that was `given`, and is compared as `moved`: this one, or that of feet."""
        return self.of_feet if moved is not given and plane_of(self.truth, moved) == "ground" else self

    def _matched(self, given: Sequence[Tracks], similarity: Similarity, inside: Bools) -> MatchedSides:
        truth = self.truth
        labelled = bool((self.labelled & inside).any())
        if labelled and (truth.events is not None or any(t.groups is None for t in given)):
            given = with_groups(given, truth.fps, truth.px_per_m)
        sides, pairs = self.sides(seen_in(given, inside), inside), None
        if not sides.groups_only:
            pairs = people_pairs(sides, similarity)
            sides = replace(sides, mapping=mapped_people(pairs))
        groups = self.groups(sides.surface).in_frames(inside, inside[self.people.rows.frame]) if labelled else None
        return MatchedSides(sides, similarity, pairs, groups)


def _scores(compared: MatchedSides, group_match: GroupMatch, step: int | None) -> Scores:
    sides, found = compared.sides, dict.fromkeys(CATALOGUE, float("nan"))
    frames_scored = int(sides.inside.sum())
    if compared.people is not None:
        found |= people_scores(compared.people)
        where = (sides.surface, sides.plane, sides.scale)
        found |= position_scores(sides.true, sides.est, sides.mapping, *where, frames_scored)
    if compared.groups is not None:
        scores = weighted_groups_and_events(sides, compared.groups, group_match)
        found |= unweighted(scores, len(sides.frames))
    found["objective"] = objective_of(found)
    return Scores(found, compared.similarity, sides.surface, group_match, frames_scored, sides.truth.length, step)


def chosen_frames(frames: int | range | None, length: int) -> Bools:
    """Returns which of the frame numbers 0 … length are chosen, (length + 1,) bool; frame 0 never is.

    frames: a number n chooses frames 1 … n (none if n < 1, all if n > length), a range its frames between 1 and length,
    None all.
    """
    inside = np.zeros(length + 1, bool)
    if isinstance(frames, range):
        inside[[f for f in frames if 1 <= f <= length]] = True
    else:
        inside[1 : 1 + (length if frames is None else max(frames, 0))] = True
    return inside


def labelled_frames(truth: Truth) -> Bools:
    """Returns which of the frame numbers 0 … length have labelled groups, (length + 1,) bool; frame 0 never has.

    Without groups on the ground and in the image no frame has. With groups and without `truth.labelled`, all frames
    have.
    """
    if truth.groups is None and truth.groups_px is None:
        return np.zeros(truth.length + 1, bool)
    labelled = np.ones(truth.length, bool) if truth.labelled is None else truth.labelled
    return np.concatenate([[False], labelled])


def _in_order(tracks: Iterable[Tracks], inside: Bools) -> list[Tracks]:
    """Returns one tracker's `Tracks` sorted by frame, from frame 1 to the last chosen frame.

    tracks: in any order. inside (length + 1,): which frame numbers are chosen. Frames before the last chosen one are
    kept even if not chosen; later ones are dropped, as they must not influence the scores. Of two `Tracks` with equal
    frame the later in the input is kept. Empty if no frame is chosen.
    """
    last = int(np.flatnonzero(inside)[-1]) if inside.any() else 0
    by_frame = {t.index: t for t in tracks if 1 <= t.index <= last}
    return [by_frame[index] for index in sorted(by_frame)]


def people_scores(pairs: Pairs) -> dict[str, float]:
    """Returns the scores of HOTA, CLEAR and Identity as one dict by key.

    pairs: all people of both sides and their candidate pairs of any similarity in (0, 1]. CLEAR and Identity use pairs
    of 0.5 or more. Without people on a side all scores are 0, except LocA, which is 1, and the counts FN and ML, or FP,
    of the other side's people. Raises ValueError if an id occurs twice in one frame on a side.
    """
    pairs.true.require_unique_ids("truth")
    pairs.est.require_unique_ids("tracks")
    return {**hota(pairs), **clear(pairs), **identity(pairs)}


def objective_of(found: Mapping[str, float]) -> float:
    """Returns the mean of found["HOTA"] and found["group_F1"]; if one is nan the other, if both are nan nan.

    Raises KeyError if a key is missing.
    """
    known = [v for v in (found["HOTA"], found["group_F1"]) if v == v]
    return sum(known) / len(known) if known else float("nan")
