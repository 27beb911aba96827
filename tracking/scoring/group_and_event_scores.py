"""Both sides' people, groups and events in the scored frames, matched, for the scores that need labelled groups.

Scores of groups come twice: strict (all labelled frames) and core (without frames up to 1 s from a true merge or
split). weighted_group_scores.py computes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim.types import Bools, Groups, Ints, Tracks, Truth
from tracking.scoring.annotated_frames import first_seen, widest_step
from tracking.scoring.events import LATE, MatchedEvents, match_events
from tracking.scoring.events_by_true_people import CHANGES, HULL_TIME, events_of_hulls, tracked_events, true_events
from tracking.scoring.people_and_groups import GroupRows, PersonRows, Surface, group_rows, people_inside

CORE = 1.0  # s around the start of each true merge or split that the core scores leave out


@dataclass(frozen=True, eq=False)
class ComparedSides:
    """The truth's and one tracker's data in the scored frames."""

    truth: Truth  # all of it
    # one `Tracks` per scored frame, labelled or not (an event may be reported in an unlabelled one), sorted by frame
    tracks: Sequence[Tracks]
    inside: Bools  # (length + 1,): bool by frame number: scored
    frames: Bools  # (length + 1,): scored, and with labelled groups
    # true, est: the R true and S tracked people in the scored frames
    true: PersonRows
    est: PersonRows
    mapping: Ints  # (S,): row of `true` that each row of `est` is mapped to, -1 none
    plane: str  # of the tracks' positions: "ground", "space" or "image"
    left_out: int = 0  # number of tracked people that the labels leave out of `est`

    @property
    def surface(self) -> Surface:
        """Where groups are compared: "image" if the tracks are in the image, else "ground"."""
        return "image" if self.plane == "image" else "ground"

    @property
    def scale(self) -> float:
        """Units of the surface per metre: the truth's px_per_m in the image (nan if unknown), 1 on the ground."""
        return self.truth.px_per_m if self.surface == "image" else 1.0

    @property
    def groups_only(self) -> bool:
        """True if the tracker follows groups as wholes (`Tracks.unit` is "group") in some scored frame."""
        return any(t.unit == "group" for t in self.tracks)


@dataclass(frozen=True, eq=False)
class TrackedGroups:
    """One tracker's groups in the labelled frames."""

    # all groups; memberships hold rows of the true people. Members mapped to nobody are left out. If the tracker names
    # no members, they are the true people inside the hull.
    every: GroupRows
    # the groups that are scored. Members are rows of the tracked people if the tracker names members, else rows of the
    # true people inside the hull.
    counted: GroupRows
    person: Ints  # (K,): for each of the K memberships of `counted`, the row of the true person, -1 none
    named: bool  # True if the tracker names members, or follows people and has no groups
    known: bool = True  # False if the tracker names no members, and who is inside its hulls is unknown


def tracked_groups(sides: ComparedSides) -> TrackedGroups:
    """Returns the tracker's groups in labelled frames, and which of them are scored.

    If the tracker names members, its groups of two or more members are scored. Otherwise the members of a group are the
    true people inside its hull or at most 0.3 m outside. Then a hull with exactly one person is not scored; a hull with
    nobody is scored, as a false group.
    """
    tracks = [t for t in sides.tracks if sides.frames[t.index]]
    frames = np.array([t.index for t in tracks], np.int64)
    every = group_rows(frames, [t.groups or Groups.none() for t in tracks], sides.est.rows)
    wholes = any(t.unit == "group" for t in tracks)
    if wholes or not len(every.of):
        positions = sides.true.positions_on(sides.surface, "ground")
        known = positions is not None and bool(np.isfinite(sides.scale))
        if positions is not None and known:
            every = people_inside(every, sides.true.rows, positions, sides.scale)
        # a person alone is no group; a hull with nobody inside is a false one
        counted = every.keep(every.count != 1)
        return TrackedGroups(every, counted, counted.member, not (wholes or len(every)), known or not len(every))
    counted = every.keep(every.count > 1)
    person = _true_rows(every, sides.mapping)
    mapped = replace(every, of=every.of[person >= 0], member=person[person >= 0])
    return TrackedGroups(mapped, counted, _true_rows(counted, sides.mapping), named=True)


def _true_rows(groups: GroupRows, mapping: Ints) -> Ints:
    return np.where(groups.member >= 0, np.append(mapping, -1)[groups.member], -1)


def near_changes(truth: Truth) -> Bools:
    """Returns which of the frame numbers 0 … length are at most 1 s from the start of a true merge or split. The result
    is bool, (length + 1,). `form` counts as a merge and `dissolve` as a split."""
    starts = np.array([e.start for e in truth.events or () if e.kind in CHANGES], float)
    frame = np.arange(truth.length + 1)
    away = np.abs(frame[:, None] - starts[None]).min(axis=1, initial=np.inf)
    return np.asarray(away <= CORE * truth.fps + 1e-9)


def compared_events(sides: ComparedSides, tracked: TrackedGroups) -> list[MatchedEvents]:
    """Returns the events of the truth and of the tracker that start in labelled frames, matched, one entry per kind."""
    truth, rows, frames, fps = sides.truth, sides.true.rows, sides.frames, sides.truth.fps
    assert truth.events is not None
    step, happened = widest_step(sides.inside), first_seen(truth.events, sides.inside)
    positions = sides.true.positions_on("image", "ground") if sides.surface == "image" else None
    true = true_events(happened, sides.true, positions, frames, step)
    names_members = not sides.groups_only
    est = events_of_hulls(sides.tracks, tracked.every, rows, frames, max(round(HULL_TIME * fps), step), names_members)
    if names_members:
        est += tracked_events(sides.tracks, sides.est, sides.mapping, rows, frames, max(round(LATE * fps), step))
    return match_events(true, est, fps, sides.scale)


def unknown_kinds(sides: ComparedSides) -> set[str]:
    """Returns the kinds of events whose scores are unknown. For a tracker of whole groups they are "cross" and "queue",
    unless it reports such an event. Else there are none."""
    if not sides.groups_only:
        return set()
    return {"cross", "queue"} - {event.kind for t in sides.tracks for event in t.events}
