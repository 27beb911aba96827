"""Causes of errors, read from the truth: what was hard about the scene where the tracker went wrong.

A cause is a fact of the truth, not a proof. The first that holds is named:

    edge        the person is cut by the edge of the picture
    hidden      most of the body is hidden, for most of the gap
    undetected  the detector has no detection of the person, for most of the gap
    light       the brightness changes by more than a fifth within a second of the error's start (input from pixels)
    clutter     a switch with a false alarm of the detector nearer than 0.8 m to the person, in its frames
    near        another person is nearer than 0.8 m
    turned      the person's direction turns by more than 60 degrees within a second
    left        a ghost of somebody who is gone
    displaced   a ghost within 2 m of somebody who is not tracked
    double      a ghost within 1 m of somebody who is tracked
    clutter     any other ghost
    apart       people of one group are more than 2 m apart
    beside      strangers walk within 1.5 m of the group
    clutter     an error of groups with a false alarm of the detector within 1.5 m of one of its people
    tracker     none of these: the tracker alone
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sim.geometry.boxes import box_intersections
from sim.types import Array, Bools, Ints
from tracking.errors.groups import GroupError
from tracking.errors.people import NOBODY, MatchedPeople, PersonError

CAUSES = (
    "edge", "hidden", "undetected", "light", "near", "turned", "left", "displaced", "double", "clutter", "apart",
    "beside", "tracker",
)  # fmt: skip
CUT = 0.2  # truncation from which a person is cut by the edge
HIDDEN = 0.35  # visibility below which most of a person is hidden
NEAR = 0.8  # m
TURN = np.deg2rad(60)
CONFIRMED = 0.5  # s: trackers wait so long before they report somebody
AROUND = 1.0  # s before a switch in which causes are looked for
DISPLACED, DOUBLE = 2.0, 1.0  # m
APART, BESIDE = 2.0, 1.5  # m between nearest people
LIGHT = 1.2  # ratio of the greatest to the least brightness


@dataclass(frozen=True)
class Cause:
    """The cause of an error in one word, and in detail."""

    name: str
    text: str = ""


@dataclass(frozen=True, eq=False)
class Facts:
    """What is known of the true people, one row per person and frame, R rows sorted by frame."""

    frame: Ints
    id: Ints
    pos: Array  # (R, 2), m on the ground; px in the image
    metre: float  # units of pos per metre
    vel: Array | None  # (R, 2), m/s
    visibility: Array  # (R,)
    truncation: Array | None  # (R,)
    box: Array | None  # (R, 4), px
    detected: Bools | None  # (R,): the detector has a detection of the person; None: not known
    light: Array | None  # (length,): factor of brightness of each frame; None: not known, or not from pixels
    fps: float
    alarms: tuple[Ints, Array]  # frames (A,) and places (A, 2), as pos, of the detector's false alarms

    def rows(self, first: int, last: int | None = None, ids: Iterable[int] | None = None) -> Ints:
        """Returns the row indices of the frames `first` to `last`, both included; of `first` alone if `last` is None.
        ids: only of these people; None: of all."""
        low, high = np.searchsorted(self.frame, (first, (first if last is None else last) + 1)).tolist()
        kept = slice(None) if ids is None else np.isin(self.id[low:high], [*ids])
        return np.arange(low, high)[kept]

    def change_of_light(self, frame: int) -> Cause | None:
        """Returns the change of brightness from 1 s before to 1 s after a frame as a cause; None if it is 20 % or less
        or the light is unknown."""
        if self.light is None:
            return None
        near = self.light[max(frame - 1 - round(self.fps), 0) : frame + round(self.fps)]
        ratio = float(near.max() / near.min())
        return Cause("light", f"brightness changes by {ratio - 1:.0%}") if ratio > LIGHT else None

    def false_alarm(self, rows: Ints, frames: range, reach: float) -> Cause | None:
        """Returns a false alarm as a cause if one is nearer than `reach` (m) to one of the people in `rows`, else None.
        Only `frames` count, and a person and a false alarm must be in the same frame."""
        frame, pos = self.alarms
        near = np.flatnonzero((frame >= frames.start) & (frame < frames.stop))
        gaps = np.hypot(*(self.pos[rows][:, None] - pos[near][None]).transpose(2, 0, 1)) / self.metre
        least = gaps[self.frame[rows][:, None] == frame[near]].min(initial=np.inf)
        return Cause("clutter", f"{least:.2f} m from a false alarm") if least < reach else None

    def nearest(self, at: Array, frame: int, without: int = NOBODY) -> tuple[float, int] | None:
        """Returns distance, m, and row of the person nearest to the place `at` in a frame; None if nobody is there.
        without: a row that does not count."""
        people = self.rows(frame)
        people = people[people != without]
        d = np.hypot(*(self.pos[people] - at).T) / self.metre
        return (float(d.min()), int(people[np.argmin(d)])) if len(d) else None


def cause_of_person(error: PersonError, of: Facts) -> Cause:
    """Returns the cause of an error that concerns a true person (not a ghost)."""
    assert error.person is not None
    gap = np.array(error.rows, np.int64)
    frames = len(gap) / of.fps
    if len(gap):
        if of.truncation is not None and np.median(of.truncation[gap]) > CUT:
            return Cause("edge", f"cut by the edge for {frames:.1f} s")
        hidden = of.visibility[gap] < HIDDEN
        if 2 * hidden.sum() >= len(gap):
            return Cause("hidden", f"hidden for {hidden.sum() / of.fps:.1f} s{_hidden_by(gap[hidden], of)}")
        if of.detected is not None and 2 * (unseen := ~of.detected[gap]).sum() >= len(gap):
            return Cause("undetected", f"not detected for {unseen.sum() / of.fps:.1f} s")
    if (light := of.change_of_light(error.start)) is not None:
        return light
    if error.kind == "late" and frames < CONFIRMED:
        return Cause("tracker")
    around = of.rows(max(error.start - round(AROUND * of.fps), 1), error.end, [error.person])
    during = range(error.start, error.end + 1)
    if error.kind == "switch" and (clutter := of.false_alarm(around, during, NEAR)) is not None:
        return clutter
    others = (of.nearest(of.pos[row], int(of.frame[row]), row) for row in around.tolist())
    distance, other = min((one for one in others if one is not None), default=(np.inf, NOBODY))
    if distance < NEAR:
        return Cause("near", f"{distance:.2f} m from person {of.id[other]}")
    turn = _turn(around, of)
    return Cause("turned", f"turned by {np.rad2deg(turn):.0f}°") if turn > TURN else Cause("tracker")


def _hidden_by(rows: Ints, of: Facts) -> str:
    """Returns " by person N", the one whose box covers most of the person's and whose feet are nearer to the camera."""
    if of.box is None:
        return ""
    covered: dict[int, float] = {}
    for row in rows.tolist():
        others = of.rows(int(of.frame[row]))
        others = others[(others != row) & (of.box[others, 1] + of.box[others, 3] > of.box[row, 1] + of.box[row, 3])]
        for other, area in zip(others.tolist(), box_intersections(of.box[others], of.box[row]).tolist(), strict=True):
            covered[int(of.id[other])] = covered.get(int(of.id[other]), 0.0) + area
    who = max(covered, key=covered.__getitem__, default=None)
    return f" by person {who}" if who is not None and covered[who] > 0 else ""


def _turn(rows: Ints, of: Facts) -> float:
    """Returns the largest change of direction over the rows, rad; a person who hardly moves does not turn."""
    if of.vel is None or len(rows) < 2:
        return 0.0
    v = of.vel[rows][np.hypot(*of.vel[rows].T) > 0.3]
    if len(v) < 2:
        return 0.0
    angle = np.unwrap(np.arctan2(v[:, 1], v[:, 0]))
    return float(np.ptp(angle))


def cause_of_ghost(error: PersonError, matched: MatchedPeople, place: Array, of: Facts) -> Cause:
    """Returns the cause of a ghost. place (S, 2): positions of all tracked rows, in the unit of `Facts.pos`."""
    frames = matched.pairs.est.frame
    found = (of.nearest(place[row], int(frames[row])) for row in error.rows)
    nearest = sorted(one for one in found if one is not None)
    owner = _owner(error, matched, of)
    if owner is not None and not len(of.rows(error.start, ids=[owner])):
        return Cause("left", f"person {owner} is gone")
    if (light := of.change_of_light(error.start)) is not None:
        return light
    if not nearest:
        return Cause("clutter")
    distance, row = nearest[len(nearest) // 2]
    if matched.track[row] == NOBODY and distance < DISPLACED:
        return Cause("displaced", f"{distance:.2f} m from person {of.id[row]}, who is not tracked")
    if distance < DOUBLE:
        return Cause("double", f"{distance:.2f} m from person {of.id[row]}, who is tracked")
    return Cause("clutter", f"{distance:.1f} m from anybody")


def _owner(error: PersonError, matched: MatchedPeople, of: Facts) -> int | None:
    """Returns the person whom the track of a ghost was matched with last before."""
    est = matched.pairs.est
    before = np.flatnonzero((est.id == error.after) & (est.frame < error.start) & (matched.person != NOBODY))
    return int(of.id[matched.person[before[-1]]]) if len(before) else None


def cause_of_group(error: GroupError, of: Facts) -> Cause:
    """Returns the cause of an error of a group: by the places of people in its middle frame, then the light."""
    frame = (error.start + error.end) // 2
    rows = of.rows(frame, ids=error.people)
    return (
        _places_of_group(error, rows, frame, of)
        or of.false_alarm(rows, range(frame, frame + 1), BESIDE)
        or of.change_of_light(error.start)
        or Cause("tracker")
    )


def _places_of_group(error: GroupError, rows: Ints, frame: int, of: Facts) -> Cause | None:
    """Returns members who are apart, or others beside them, as a cause."""
    if len(rows) < 2:
        return None
    gaps = np.hypot(*(of.pos[rows][:, None] - of.pos[rows][None]).transpose(2, 0, 1)) / of.metre
    np.fill_diagonal(gaps, np.inf)
    if error.group is not None and gaps.min(axis=1).max() > APART:
        return Cause("apart", f"{gaps.min(axis=1).max():.1f} m from the next member")
    others = of.rows(frame, ids=error.others)
    if len(others):
        d = np.hypot(*(of.pos[rows][:, None] - of.pos[others][None]).transpose(2, 0, 1)).min() / of.metre
        if d < BESIDE:
            return Cause("beside", f"{d:.1f} m from others")
    if error.false and gaps.min() < BESIDE:
        return Cause("beside", f"{gaps.min():.1f} m apart")
    return None
