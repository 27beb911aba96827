"""All scores of a tracker against a truth: `evaluate`, and `Scorer`, which prepares one truth for many evaluations.

This module decides what is compared (which frames, which similarity of people, which surface for groups). It calls the
modules of the single scores and returns their results under the keys of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from sim.types import Array, Bools, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.clear import clear
from tracking.scoring.group_and_event_scores import ComparedSides, group_and_event_scores
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.matching import mapped_people
from tracking.scoring.people_and_groups import (
    PersonRows,
    Surface,
    TrueGroups,
    tracked_people,
    true_groups,
    true_people,
)
from tracking.scoring.position_errors import REACH, position_scores

Similarity = Literal["boxes", "ground", "image"]
"""How two people are compared: IoU of boxes, or distance of positions on the ground or in the image."""


class IncomparableError(ValueError):
    """Raised if the truth or the tracks have people but lack the boxes or positions that are to be compared. By boxes
    also if the truth has no boxes at all. It is a ValueError.
    """


@dataclass(frozen=True, eq=False)
class Scores(Mapping[str, float]):
    """A read-only mapping from key to score (float), with every key of the catalogue in its order; KeyError for others.

    - by_key: the scores. nan: not labelled, not comparable, or a denominator of 0.
    - similarity: how people were compared, by "boxes" (IoU) or by positions on the "ground" or in the "image".
    - surface: where groups were compared, "ground" or "image".
    - group_match: how groups were matched, by "hull" or by "members".
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
    compares people by IoU ("boxes") or by max(0, 1 - d / 2 m) ("ground", "image"), d being their distance. None: boxes
    if both sides have them, else the plane of the tracks. group_match: matches groups by IoU of their hulls ("hull") or
    Jaccard index of their members ("members"). frames: a number n scores frames 1 … n, a range only its frames, None
    all frames. A frame without tracks counts as empty.

    Groups and events that the tracks lack come from the baseline rule, in the image only if `truth.px_per_m` is known.
    Scores of people are nan for a tracker of whole groups, scores of groups and events if no scored frame has group
    labels.

    Raises IncomparableError if boxes or positions to be compared are missing, ValueError if an id occurs twice in one
    frame, and InputError if groups must be derived in the image and `truth.px_per_m` is 0 or less.
    """
    return Scorer(truth).evaluate(tracks, similarity=similarity, group_match=group_match, frames=frames)


class Scorer:
    """Scores any number of trackers against one truth.

    State: truth; labelled (length + 1,), bool by frame number: the frame has labelled groups; the true people and
    groups as rows of arrays, built at first use and kept. The truth must not change meanwhile.
    """

    def __init__(self, truth: Truth) -> None:
        self.truth = truth
        self.labelled = labelled_frames(truth)
        self._groups: dict[Surface, TrueGroups] = {}

    @cached_property
    def people(self) -> PersonRows:
        """The true people of all frames as `PersonRows`, one row per person and frame, sorted by frame."""
        return true_people(self.truth, chosen_frames(None, self.truth.length))

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
        result `frames` keeps only labelled frames, and `mapping` is -1 for every tracked row.
        """
        kept = frames[self.people.rows.frame]
        true = self.people if kept.all() else self.people.keep(kept)
        est, plane = tracked_people(tracks), plane_of(self.truth, tracks)
        nobody = np.full(len(est.rows), -1, np.int64)
        return ComparedSides(self.truth, tracks, self.labelled & frames, true, est, nobody, plane)

    def evaluate(
        self,
        tracks: Iterable[Tracks],
        *,
        similarity: Similarity | None = None,
        group_match: GroupMatch = "hull",
        frames: int | range | None = None,
    ) -> Scores:
        """Returns every score of the catalogue for one tracker against this truth, as the function `evaluate` does.

        tracks: one `Tracks` per frame, any order; of two with equal frame the later is used. similarity: "boxes",
        "ground", "image" or None (boxes if both sides have them, else the tracks' plane). group_match: "hull" or
        "members". frames: n for frames 1 … n, a range, or None for all. A frame without tracks counts as empty. Groups
        and events that the tracks lack come from the baseline rule. Scores of people are nan for a tracker of whole
        groups. Scores of groups and events are nan if no chosen frame is labelled.

        Raises IncomparableError if boxes or positions are missing, ValueError if an id occurs twice in one frame,
        InputError if groups must be derived in the image and `truth.px_per_m` is 0 or less.
        """
        truth, inside = self.truth, chosen_frames(frames, self.truth.length)
        given: Sequence[Tracks] = _in_order(tracks, inside)
        labelled = bool((self.labelled & inside).any())
        if labelled and (truth.events is not None or any(t.groups is None for t in given)):
            given = with_groups(given, truth.fps, truth.px_per_m)
        sides = self.sides([t for t in given if inside[t.index]], inside)
        chosen = similarity or usual_similarity(truth, sides.tracks)
        found = dict.fromkeys(CATALOGUE, float("nan"))
        if not sides.groups_only:
            pairs = people_pairs(sides, chosen)
            sides = replace(sides, mapping=mapped_people(pairs))
            found |= people_scores(pairs)
            found |= position_scores(
                sides.true, sides.est, sides.mapping, sides.surface, sides.plane, sides.scale, int(inside.sum())
            )
        if labelled:
            groups = self.groups(sides.surface).in_frames(inside, inside[self.people.rows.frame])
            found |= group_and_event_scores(sides, groups, group_match)
        found["objective"] = objective_of(found)
        return Scores(found, chosen, sides.surface, group_match)


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


def plane_of(truth: Truth, tracks: Sequence[Tracks]) -> str:
    """Returns the plane of one tracker's positions: "ground", "space" or "image".

    It is that of the first `Tracks` with people, else of the first `Tracks`. If `tracks` is empty it is the truth's:
    "image" if the truth has no positions on the ground, else "ground".
    """
    own = "image" if truth.pos is None else "ground"
    return next((t.plane for t in tracks if len(t.id)), tracks[0].plane if tracks else own)


def usual_similarity(truth: Truth, tracks: Iterable[Tracks]) -> Similarity:
    """Returns how people are compared by default: "boxes" if the truth and every non-empty frame of the tracks have
    boxes.

    Else "image" if the first non-empty frame of the tracks is in the image, else "ground". Tracks without anybody count
    as having boxes.
    """
    some = [t for t in tracks if len(t.id)]
    if truth.box is not None and all(t.box is not None for t in some):
        return "boxes"
    return "image" if some and some[0].plane == "image" else "ground"


def people_pairs(sides: ComparedSides, similarity: Similarity) -> Pairs:
    """Returns the candidate pairs of true and tracked people of one frame, with a similarity in (0, 1].

    sides: both sides' people in the scored frames. similarity: "boxes" takes the IoU; "ground" and "image" take 1 -
    distance / 2 m, the image by `truth.px_per_m` (no pairs if that is nan). Without people on a side there are no
    pairs. Raises IncomparableError if a side has people but not the boxes or positions to be compared. With "boxes" it
    is also raised if the truth has no boxes at all.
    """
    true, est = sides.true, sides.est
    if similarity == "boxes":
        if true.box is None or est.box is None:
            raise IncomparableError("no boxes to compare: score on the ground")
        return box_pairs(true.rows, est.rows, true.box, est.box)
    reach = REACH * sides.truth.px_per_m if similarity == "image" else REACH
    true_pos, est_pos = _positions(true, similarity, "ground"), _positions(est, similarity, sides.plane)
    return point_pairs(true.rows, est.rows, true_pos, est_pos, reach)


def _positions(people: PersonRows, surface: Surface, plane: str) -> Array:
    """Returns the positions x, y (R, 2) of the R rows of `people` on a surface, in m ("ground") or px ("image").

    plane: plane of the positions in `people`. Without rows and positions the result has shape (0, 2). Raises
    IncomparableError if there are rows but no positions on the surface.
    """
    positions = people.positions_on(surface, plane)
    if positions is None and len(people.rows):
        where, other = {
            "ground": ("on the ground", "boxes or in the image"),
            "image": ("in the image", "on the ground"),
        }[surface]
        raise IncomparableError(f"no positions {where} to compare: score {other}")
    return np.zeros((0, 2)) if positions is None else positions


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
    """Returns the mean of found["HOTA"] and found["group_F1_hull"]; if one is nan the other, if both are nan nan.

    Raises KeyError if a key is missing.
    """
    known = [v for v in (found["HOTA"], found["group_F1_hull"]) if v == v]
    return sum(known) / len(known) if known else float("nan")
