"""Truth and tracks as scores: who is compared with whom, by what, in which frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sim.types import Array, Bools, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.group_and_event_scores import Labelled, social_scores
from tracking.scoring.groups import GroupMatch
from tracking.scoring.individuals import scores as individual_scores
from tracking.scoring.mapping import mapped
from tracking.scoring.position_errors import REACH, place_scores
from tracking.scoring.rows import People, Surface, tracked_people, true_people
from tracking.scoring.similarity import Pairs, box_pairs, point_pairs

Similarity = Literal["boxes", "ground", "image"]


class IncomparableError(ValueError):
    """One side lacks what is to be compared."""


@dataclass(frozen=True, eq=False)
class Scores(Mapping[str, float]):
    """Scores by key, every key of the catalogue in its order; nan: not labelled, or nothing to divide by.

    similarity: by what people were compared; surface: where groups were; group_match: by what groups were matched.
    """

    by_key: Mapping[str, float]
    similarity: Similarity
    surface: Surface
    group_match: GroupMatch

    def __getitem__(self, key: str) -> float:
        return self.by_key[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_key)

    def __len__(self) -> int:
        return len(self.by_key)

    def __str__(self) -> str:
        """The scores that are known, a line each."""
        return "\n".join(f"{key:28} {value:.4g}" for key, value in self.items() if not math.isnan(value))


def evaluate(
    truth: Truth,
    tracks: Iterable[Tracks],
    *,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
    frames: int | range | None = None,
) -> Scores:
    """Every score of the catalogue (docs/metrics.md); frames without an answer count as empty.

    similarity: of people, "boxes" (IoU), "ground" or "image" (max(0, 1 - d / 2 m)); where absent, boxes if both sides
    have them, else the tracks' plane. group_match: groups are matched by the IoU of their "hull"s or the Jaccard index
    of their "members". frames: score only frames up to this one, or these. Tracks without groups get them by the
    baseline rule. IncomparableError where the truth, or the tracks, lack what is to be compared.
    """
    inside = chosen_frames(frames, truth.length)
    given: Sequence[Tracks] = _answers(tracks, inside)
    told = labelled_frames(truth) & inside
    if told.any() and (truth.events is not None or any(t.groups is None for t in given)):
        given = with_groups(given, truth.fps, truth.px_per_m)
    answers = [t for t in given if inside[t.index]]
    plane, chosen = plane_of(truth, answers), similarity or usual_similarity(truth, answers)
    true, est = true_people(truth, inside), tracked_people(answers)
    nobody = np.full(len(est.rows), -1, np.int64)
    case = Labelled(truth, answers, told, true, est, nobody, "image" if plane == "image" else "ground")
    found = dict.fromkeys(CATALOGUE, float("nan"))
    if not any(t.unit == "group" for t in answers):
        pairs = people_pairs(true, est, chosen, plane, truth.px_per_m)
        case = replace(case, stands_for=mapped(pairs))
        found |= individual_scores(pairs)
        found |= place_scores(true, est, case.stands_for, case.surface, plane, case.scale, int(inside.sum()))
    if told.any():
        found |= social_scores(case, group_match)
    found["objective"] = objective_of(found)
    return Scores(found, chosen, case.surface, group_match)


def chosen_frames(frames: int | range | None, length: int) -> Bools:
    """Which of the frames 0 … length are meant (frame 0 never is)."""
    inside = np.zeros(length + 1, bool)
    wanted = range(1, length + 1) if frames is None else range(1, frames + 1) if isinstance(frames, int) else frames
    inside[[f for f in wanted if 1 <= f <= length]] = True
    return inside


def labelled_frames(truth: Truth) -> Bools:
    """The frames 0 … length whose groups are labelled."""
    if truth.groups is None and truth.groups_px is None:
        return np.zeros(truth.length + 1, bool)
    labelled = np.ones(truth.length, bool) if truth.labelled is None else truth.labelled
    return np.concatenate([[False], labelled])


def _answers(tracks: Iterable[Tracks], inside: Bools) -> list[Tracks]:
    """Answers in the order of frames, none after the last that counts: what is scored never looks ahead."""
    last = int(np.flatnonzero(inside)[-1]) if inside.any() else 0
    by_frame = {t.index: t for t in tracks if 1 <= t.index <= last}
    return [by_frame[index] for index in sorted(by_frame)]


def plane_of(truth: Truth, answers: Sequence[Tracks]) -> str:
    """The plane of the answers; the truth's own where nothing was answered."""
    own = "image" if truth.pos is None else "ground"
    return next((t.plane for t in answers if len(t.id)), answers[0].plane if answers else own)


def usual_similarity(truth: Truth, answers: Iterable[Tracks]) -> Similarity:
    """Overlap of boxes where both sides have measured ones, else distance in the tracks' plane."""
    some = [t for t in answers if len(t.id)]
    if truth.box is not None and all(t.box is not None for t in some):
        return "boxes"
    return "image" if some and some[0].plane == "image" else "ground"


def people_pairs(true: People, est: People, similarity: Similarity, plane: str, px_per_m: float) -> Pairs:
    """Possible pairs of people by a similarity; plane: of the tracks' pos."""
    if similarity == "boxes":
        if true.box is None or est.box is None:
            raise IncomparableError("no boxes to compare: score on the ground")
        return box_pairs(true.rows, est.rows, true.box, est.box)
    reach = REACH * px_per_m if similarity == "image" else REACH
    ours, theirs = _places(true, similarity, "ground"), _places(est, similarity, plane)
    return point_pairs(true.rows, est.rows, ours, theirs, reach)


def _places(people: People, surface: Surface, plane: str) -> Array:
    places = people.places(surface, plane)
    if places is None and len(people.rows):
        where, other = {
            "ground": ("on the ground", "boxes or in the image"),
            "image": ("in the image", "on the ground"),
        }[surface]
        raise IncomparableError(f"no positions {where} to compare: score {other}")
    return np.zeros((0, 2)) if places is None else places


def objective_of(found: Mapping[str, float]) -> float:
    """Mean of HOTA and the groups' F1 by hulls, or the one that there is."""
    known = [v for v in (found["HOTA"], found["group_F1_hull"]) if v == v]
    return sum(known) / len(known) if known else float("nan")
