"""All scores of a tracker against a truth: `evaluate`, and `Scorer`, which prepares one truth for many evaluations.

This module decides what is compared (which frames, which similarity of people, which surface for groups). It calls the
modules of the single scores and returns their results under the keys of the catalogue, for all frames or under weights
of the frames (tracking.scoring.frame_weights).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Bools, Tracks, Truth
from tracking.grouping.foot_points import source_of
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.annotated_frames import annotated_frames, seen_in
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.clear import weighted_clear
from tracking.scoring.events import compared_events, unknown_kinds, weighted_events
from tracking.scoring.frame_weights import FrameScores, WeightedScores, mean_of_known, unweighted
from tracking.scoring.ground_or_image import grounded, in_one_plane, plane_of
from tracking.scoring.group_rows import TrueGroups, tracked_groups, true_groups
from tracking.scoring.groups import GroupMatch, f1, groups_found, shared_members, weighted_groups
from tracking.scoring.hota import hota_scores, hota_sums, unweighted_hota
from tracking.scoring.identity import weighted_identity
from tracking.scoring.matching import mapped_people
from tracking.scoring.membership import weighted_membership
from tracking.scoring.people import (
    ComparedSides,
    IncomparableError,
    PersonRows,
    Similarity,
    Surface,
    people_pairs,
    tracked_people,
    true_people,
)
from tracking.scoring.position_errors import weighted_positions
from tracking.scoring.rows import span
from tracking.scoring.similarity import Pairs
from tracking.scoring.unscored_tracks import left_out

PORTION = 100  # Draws that are computed together: bounds memory.


__all__ = ["IncomparableError", "MatchedSides", "Scorer", "Scores", "Similarity", "evaluate"]


@dataclass(frozen=True, eq=False)
class Scores(Mapping[str, float]):
    """A read-only mapping from key to score (float), with every key of the catalogue in its order.

    Printed, it shows one line per score that is not nan.

    Attributes:
        by_key: the scores. nan means not labelled, not comparable, or a denominator of 0.
        similarity: how people were compared, by "boxes" (IoU) or by positions on the "ground" or in the "image".
        surface: where groups were compared, "ground" or "image".
        group_match: how groups were matched, by "hull" or by "members".
        frames: number of scored frames.
        length: number of frames of the sequence.
        step: frames from one annotated frame to the next, 1 unless the labels are sparse; None if not evenly spaced.
        left_out: number of tracked rows that the labels leave out: on distractors, in ignored regions, too low.
        hota: sums (7, 19) of which `pooled` makes HOTA and its parts; None for a tracker of whole groups.
    """

    by_key: Mapping[str, float]
    similarity: Similarity
    surface: Surface
    group_match: GroupMatch
    frames: int
    length: int
    step: int | None
    left_out: int = 0
    hota: Array | None = None

    def __getitem__(self, key: str) -> float:
        return self.by_key[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_key)

    def __len__(self) -> int:
        return len(self.by_key)

    def __str__(self) -> str:
        return "\n".join(f"{key:28} {value:.4g}" for key, value in self.items() if not math.isnan(value))


def objective(hota: Array, group_f1: Array) -> Array:
    """Returns the score that ranks and tunes, (D,): the mean of HOTA and group_F1 (D,), or what is known of them."""
    return mean_of_known(np.column_stack([hota, group_f1]))


@dataclass(frozen=True, eq=False)
class MatchedSides:
    """One truth and one tracker's tracks in the scored frames, with people matched, ready for computing scores."""

    sides: ComparedSides  # both sides in the scored frames, people mapped
    similarity: Similarity  # how people are compared
    people: Pairs | None  # their candidate pairs, None for a tracker of whole groups
    groups: TrueGroups | None  # the true groups in the scored frames, None if none of these frames is labelled
    step: int | None  # from one annotated frame to the next, None if they are not evenly spaced

    def scores(self, group_match: GroupMatch) -> Scores:
        """Returns every score of the catalogue; group_match as of `evaluate`."""
        sides, inside = self.sides, self.sides.inside
        found, frames, length = unweighted(self._weighted(group_match), len(inside)), int(inside.sum()), len(inside) - 1
        hota = None if self.hota is None else self.hota(np.ones((1, len(inside))))[0]
        how = (self.similarity, sides.surface, group_match)
        return Scores(found, *how, frames, length, self.step, sides.left_out, hota)

    @cached_property
    def hota(self) -> Callable[[Array], Array] | None:
        """The function of `hota_sums`; None for a tracker of whole groups. Raises ValueError if an id is twice in a
        frame."""
        if self.people is None:
            return None
        self.people.require_unique_ids()
        return hota_sums(self.people, len(self.sides.inside))

    def objective_scores(self) -> dict[str, float]:
        """Returns HOTA, group_F1 and objective as `scores` does, by key, in a tenth of the time."""
        found = {"HOTA": math.nan, "group_F1": math.nan}
        if self.people is not None:
            self.people.require_unique_ids()
            found["HOTA"] = unweighted_hota(self.people)
        if self.groups is not None and (tracked := tracked_groups(self.sides)).known:
            true, est = self.groups.groups, tracked.counted
            shared = shared_members(true, est, tracked.person, len(self.sides.true.rows))
            found["group_F1"] = f1(int(groups_found(true, est, shared).sum()), len(true), len(est))
        mean = objective(*(np.array([score]) for score in found.values()))
        return {**found, "objective": float(mean[0])}

    def weighted_scores(self, group_match: GroupMatch) -> Callable[[Array], Array]:
        """Returns a function from weights of frames to scores; group_match as of `evaluate`.

        The function takes D draws of weights (D, length), one weight for each of the frames 1 … length. The weights of
        a draw should have the mean 1, because scores that are counts are sums of weights. The function returns the K
        scores of `CATALOGUE` in its order, (D, K). A score is nan where its denominator is 0 under the weights.
        """
        scores = self._weighted(group_match)

        def in_portions(weights: Array) -> Array:
            padded = np.pad(np.asarray(weights, float), ((0, 0), (1, 0)))  # frame 0 is no frame
            portions = [padded[first : first + PORTION] for first in range(0, len(padded), PORTION)]
            return np.concatenate([np.column_stack(list(scores(portion).values())) for portion in portions])

        return in_portions

    def _weighted(self, group_match: GroupMatch) -> WeightedScores:
        sides, parts = self.sides, list[WeightedScores]()
        if self.people is not None and self.hota is not None:
            parts += [weighted_people(self.people, len(sides.inside), self.hota), weighted_positions(sides)]
        if self.groups is not None:
            true, tracked, scores = self.groups.groups, tracked_groups(sides), FrameScores(len(sides.inside))
            shared = shared_members(true, tracked.counted, tracked.person, len(sides.true.rows))
            parts += [scores, *weighted_membership(scores, sides, true, tracked, shared)]
            parts += weighted_groups(scores, sides, self.groups, tracked, shared, group_match)
            if sides.truth.events is not None:
                matched = [m for m in compared_events(sides, tracked) if m.kind not in unknown_kinds(sides)]
                parts.append(weighted_events(matched, sides.truth.fps, len(sides.inside)))

        def score(weights: Array) -> dict[str, Array]:
            found = dict.fromkeys(CATALOGUE, np.full(len(weights), np.nan))
            for part in parts:
                found |= part(weights)
            found["objective"] = objective(found["HOTA"], found["group_F1"])
            return {key: found[key] for key in CATALOGUE}

        return score


def evaluate(
    truth: Truth | None,
    tracks: Iterable[Tracks],
    *,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
    frames: int | range | None = None,
) -> Scores:
    """Returns every score of the catalogue (docs/reference/metrics.md) for one tracker.

    Args:
        truth: the labels of a sequence, `sequence.truth`. If they are clearly sparse, only annotated frames are scored.
        tracks: the tracker's `Tracks`, one per frame, in any order. A frame without `Tracks` counts as a frame without
            tracked people. If the tracks have no groups, groups and events are derived by the default grouping; in the
            image, this needs a known `truth.px_per_m`.
        similarity: compares people by IoU ("boxes") or by max(0, 1 - d / 2 m) of their distance d ("ground", "image").
            None chooses by the data: the ground if both sides have or can get positions there, else boxes if everybody
            has one and no camera is known, else the image.
        group_match: matches groups by IoU of their hulls ("hull") or Jaccard index of their members ("members").
            group_F1, group_precision and group_recall are by members in both cases.
        frames: the frames to score. A number n means frames 1 … n, a range its frames, None all frames.

    Returns:
        `Scores`, a mapping from key to value. A score is nan if it cannot be computed. So scores of people are nan for
        a tracker of whole groups, and scores of groups and events are nan if no scored frame has group labels.

    Raises:
        IncomparableError: boxes or positions to be compared are missing.
        ValueError: an id occurs twice in one frame, two `Tracks` are of one frame, or `frames` chooses none.
        InputError: `truth` is None, or groups must be derived in the image and `truth.px_per_m` is 0 or less.
    """
    if truth is None:
        raise InputError(place="truth", got="None", expected="labels", remedy="evaluate a sequence that has a truth")
    (compared,) = Scorer(truth).compare([tracks], similarity, frames)
    return compared.scores(group_match)


class Scorer:
    """Scores any number of trackers against one truth, which must not change meanwhile.

    State: truth, with positions on the ground if it has positions there, or boxes and a camera; annotated, the frames
    that can be scored; labelled (length + 1,), bool by frame number, the annotated frames with labelled groups; the
    true people and groups as rows, built at first use and kept.
    """

    def __init__(self, truth: Truth) -> None:
        self.truth = truth = grounded(truth)
        self.annotated = annotated_frames(truth)
        self.labelled = labelled_frames(truth) & self.annotated.frames
        self._groups: dict[Surface, TrueGroups] = {}

    @cached_property
    def people(self) -> PersonRows:
        """The true people of all frames as `PersonRows`, one row per person and frame, sorted by frame."""
        return true_people(self.truth, chosen_frames(None, self.truth.length))

    def scored(self, frames: int | range | None) -> Bools:
        """Returns which of the frame numbers 0 … length are scored, (length + 1,) bool: those chosen and annotated.
        frames: a number n chooses 1 … n, a range its frames, None all frames."""
        return chosen_frames(frames, self.truth.length) & self.annotated.frames

    def groups(self, surface: Surface) -> TrueGroups:
        """Returns the true groups of two or more in all labelled frames; members are row indices of `people`."""
        if surface not in self._groups:
            self._groups[surface] = true_groups(self.truth, self.labelled, self.people.rows, surface)
        return self._groups[surface]

    def sides(self, tracks: Sequence[Tracks], frames: Bools) -> ComparedSides:
        """Returns the data of truth and tracks in the frames f where frames[f] is true, without the tracked people that
        the labels leave out. No tracked person is mapped to a true person yet."""
        true = self.people.keep(span(self.people.rows.frame, frames))
        kept = frames[true.rows.frame]
        true = true if kept.all() else true.keep(kept)
        est, plane = tracked_people(tracks), plane_of(self.truth, tracks)
        out = left_out(self.truth, est)
        est = est.keep(~out) if out.any() else est
        nobody, count = np.full(len(est.rows), -1, np.int64), int(out.sum())
        return ComparedSides(self.truth, tracks, frames, self.labelled & frames, true, est, nobody, plane, count)

    def evaluate(
        self, tracks: Iterable[Tracks], *, similarity: Similarity | None = None, frames: int | range | None = None
    ) -> Scores:
        """Returns the scores of one tracker against this truth, as the function `evaluate` with "hull" does."""
        (compared,) = self.compare([tracks], similarity, frames)
        return compared.scores("hull")

    def compare(
        self, runs: Sequence[Iterable[Tracks]], similarity: Similarity | None = None, frames: int | range | None = None
    ) -> list[MatchedSides]:
        """Returns for each run this truth and the run's tracks, compared, with tracked people mapped to true people.
        All runs are compared in one plane and by one similarity; the arguments are as in `evaluate`."""
        inside = self.scored(frames)
        ordered = [_in_order(run, inside) for run in runs]
        moved, chosen = in_one_plane(self.truth, ordered, [source_of(run) for run in runs], similarity)
        return [self._matched(run, chosen, inside) for run in moved]

    def _matched(self, given: Sequence[Tracks], similarity: Similarity, inside: Bools) -> MatchedSides:
        truth = self.truth
        labelled = bool((self.labelled & inside).any())
        if labelled and (truth.events is not None or any(t.groups is None for t in given)):
            given = with_groups(given, truth.fps, truth.px_per_m)
        sides, pairs = self.sides(seen_in(given, inside), inside), None
        if not sides.groups_only:
            pairs = people_pairs(sides, similarity)
            sides = replace(sides, mapping=mapped_people(pairs))
        groups = self.groups(sides.surface).in_frames(inside, self.people.rows) if labelled else None
        return MatchedSides(sides, similarity, pairs, groups, self.annotated.step)


def chosen_frames(frames: int | range | None, length: int) -> Bools:
    """Returns which of the frame numbers 0 … length are chosen, (length + 1,) bool; frame 0 never is. frames: a number
    n chooses 1 … n, a range its frames, None all frames."""
    inside = np.zeros(length + 1, bool)
    if isinstance(frames, range):
        inside[[f for f in frames if 1 <= f <= length]] = True
    else:
        inside[1 : 1 + (length if frames is None else max(frames, 0))] = True
    if frames is not None and length and not inside.any():
        raise ValueError(f"frames: got {frames}, expected some of 1 to {length}")
    return inside


def labelled_frames(truth: Truth) -> Bools:
    """Returns which of the frame numbers 0 … length have labelled groups, (length + 1,) bool."""
    if truth.groups is None and truth.groups_px is None:
        return np.zeros(truth.length + 1, bool)
    labelled = np.ones(truth.length, bool) if truth.labelled is None else truth.labelled
    return np.concatenate([[False], labelled])


def _in_order(tracks: Iterable[Tracks], inside: Bools) -> list[Tracks]:
    # later frames must not influence the scores; earlier ones do, as groups are derived from them
    last = int(np.flatnonzero(inside)[-1]) if inside.any() else 0
    given = [t for t in tracks if 1 <= t.index <= last]
    by_frame = {t.index: t for t in given}
    if len(by_frame) < len(given):
        raise ValueError("tracks: got two Tracks of one frame, expected one of each frame")
    return [by_frame[index] for index in sorted(by_frame)]


def weighted_people(pairs: Pairs, size: int, hota: Callable[[Array], Array]) -> WeightedScores:
    """Returns a function from weights (D, size) of frames to the scores of HOTA, CLEAR and identity, (D,) by key. size:
    length of the recording + 1. hota: as of `hota_sums`. No id may be twice in a frame."""
    clear, identity = weighted_clear(pairs, size), weighted_identity(pairs, size)
    return lambda weights: hota_scores(hota(weights)) | clear(weights) | identity(weights)
