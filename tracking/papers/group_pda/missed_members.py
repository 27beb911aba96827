"""Members that the detector missed in a frame stand in at their predicted places (ours), so that misses do not move or
split a group.

A group remembers the places of its points (`MemberPlaces`), not whose points they are. From points, a place without any
point near it in this frame is a missed member. It is added as a point that only its group may have, for `carry_time`
after its last measurement. From pixels nobody is added; only the group's convex hull is kept, which is reported while
the group coasts.
"""

from __future__ import annotations

import numpy as np

from sim.geometry.hull_kernels import convex_hulls
from sim.types import Array, Bools, Ints
from tracking.papers.group_pda.association import PointClaims
from tracking.papers.group_pda.association_kernels import any_within
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

RECENT_TIME = 3.0  # s for which a group's points are kept, to date the onset of a split.
RECENT_POINTS = 64  # At most so many points of a group are kept of each frame.


def with_missed_members(claims: PointClaims, bank: GroupBank, scaled: ScaledParameters, t: float) -> PointClaims:
    """Returns new claims with the members missed at time t (s) appended as points of their own group alone."""
    has_points = np.asarray(np.isfinite(claims.d2).any(axis=1))
    has_points[claims.owner[claims.owner >= 0]] = True
    place, row, last_seen = missed_members(bank, claims.points, scaled, t)
    kept = has_points[row]
    place, row, last_seen = place[kept], row[kept], last_seen[kept]
    return PointClaims(
        np.concatenate([claims.points, place]),
        np.concatenate([claims.weights, np.ones(len(place))]),
        np.concatenate([claims.last_seen, last_seen]),
        np.hstack([claims.d2, np.full((len(bank), len(place)), np.inf)]),
        np.concatenate([claims.owner, row]),
        np.concatenate([claims.claimants, np.ones(len(place), np.int64)]),
    )


def missed_members(bank: GroupBank, points: Array, scaled: ScaledParameters, t: float) -> tuple[Array, Ints, Array]:
    """Returns the places (K, 2), rows of the bank (K,) and last measurements (K,) in s of the members missed at time t
    (s)."""
    c, recent = scaled.config, []
    if c.carry_time > 0 and not scaled.from_pixels:
        for row, members in enumerate(bank.members):
            late = members.known & (t - members.last_seen <= c.carry_time + 1e-9)
            if late.any():
                place = members.offset[late] + bank.x[row, :2]
                recent.append((place, np.full(int(late.sum()), row), members.last_seen[late]))
    if not recent:
        return np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros(0)
    place, row_of, last_seen = (np.concatenate(part) for part in zip(*recent, strict=True))
    missed = ~any_within(place, points, scaled.scale * c.carry_reach)
    return place[missed], row_of[missed], last_seen[missed]


def remember(bank: GroupBank, claims: PointClaims, exclusive: Bools, scaled: ScaledParameters, t: float) -> None:
    """Stores each group's points of this frame as its members and recent points, in the bank, in place."""
    for row in np.flatnonzero(exclusive.any(1)).tolist():
        mine, last_seen = claims.points[exclusive[row]], claims.last_seen[exclusive[row]]
        kept = [p for p in bank.recent_points[row] if p[0] > t - RECENT_TIME]
        bank.recent_points[row] = [*kept, (t, thinned(mine))]
        offset = mine - bank.x[row, :2]
        if not scaled.from_pixels:
            known = any_within(offset, bank.members[row].offset, scaled.scale * scaled.config.carry_reach)
            bank.members[row] = MemberPlaces(offset, last_seen, known)
            continue
        (offset,) = convex_hulls([offset])
        bank.members[row] = MemberPlaces(offset, np.full(len(offset), t), np.ones(len(offset), bool))


def thinned(points: Array) -> Array:
    """Returns at most RECENT_POINTS = 64 of the points (M, 2), selected by a hash of their coordinates."""
    if len(points) <= RECENT_POINTS:
        return points
    scattered = np.sin(points @ np.array([12.9898, 78.233])) * 43758.5453
    return points[np.argsort(scattered - np.floor(scattered), kind="stable")[:RECENT_POINTS]]
