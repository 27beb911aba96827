"""Data association of `group-pda`: which points a group may have (gate), and its update by them (sec. 4).

Input: points (M, 2), in m on the ground or px, and the bank of G groups. Output: which points each group takes (a bool
array); the groups' states in the bank are updated in place. Order in a frame: `search_regions`, `gated_distances`,
`claimed`, `with_missed_members`, `place_density`, `log_ratio`, `associate`, `remember`. The masses and the update are
in association_kernels and association_mass_kernels.

Points of hidden feet are put below their heads first: `below_heads` (ours).

Members that the detector missed in a frame stand in at their predicted places (ours), so that misses do not move or
split a group.

A group remembers the places of its points (`MemberPlaces`), not whose points they are. From points, a place without any
point near it in this frame is a missed member. It is added as a point that only its group may have, for `carry_time`
after its last measurement. Then, until `coast_time`, its place stays the group's but is no point: whoever is hidden for
longer still belongs to the group, but would displace it. From pixels nobody is added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.scene.camera import to_ground
from sim.types import Array, Bools, Camera, Ints
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda.association_kernels import any_within, displacement
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces, Unshared
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

LOWEST_HEAD = 1.5  # m above the ground: only few people, mostly children, are shorter.
BELOW = 0.1  # Share of a box's height below its lower edge at which another box hides the feet.
FASTEST = 2.0  # m/s: nobody walks faster than this relative to a group (walking distance).


@dataclass(frozen=True)
class PointClaims:
    """Which of M points each of G groups may have. Groups are rows of the bank, from 0; points are in m or px.

    points (M, 2): x, y; weights (M,): people that each stands for; last_seen (M,): time, s, when it was measured,
    before this frame for a missed member; d2 (G, M): squared Mahalanobis distances of points from groups, inf outside a
    group's search region; owner (M,): row whose missed member the point is, or -1;
    claimants (M,): number of groups that may have the point.
    """

    points: Array
    weights: Array
    last_seen: Array
    d2: Array
    owner: Ints
    claimants: Ints


def below_heads(points: Array, box: Array, camera: Camera) -> Array:
    """Returns the points (M, 2), m on the ground, of people whose feet are hidden no further from the camera than the
    place below the head would be if it were LOWEST_HEAD = 1.5 m high; others as they are.

    Hidden feet displace a point away from the camera. They may be hidden if another box contains the place just below
    the box (M, 4), px. The head is at its upper edge. As most people are taller, a point that nothing displaces is
    nearer and stays (ours).
    """
    way = points - camera.position[:2]
    head = to_ground(camera, box[:, :2] + box[:, 2:] * np.array([0.5, 0.0]), LOWEST_HEAD)
    most = np.hypot(*(head - camera.position[:2]).T)
    excess = np.fmax(1 - most / np.maximum(np.hypot(*way.T), 1e-9), 0.0)  # 0 if the head shows no ground
    below = (box[:, :2] + box[:, 2:] * np.array([0.5, 1 + BELOW]))[:, None]
    hidden = ((below > box[:, :2]) & (below < box[:, :2] + box[:, 2:])).all(2).any(1)  # never in a box of its own
    return np.asarray(points - (excess * hidden)[:, None] * way)


def search_regions(bank: GroupBank, scaled: ScaledParameters) -> Array:
    """Returns the covariances (G, 2, 2) of the groups' search regions: Sigma + H P H' + r^2 I (eq. 2.2: Sigma).

    r: standard deviation of a person's position."""
    return np.asarray(bank.extent + bank.P[:, :2, :2] + scaled.point_sd**2 * np.eye(2))


def gated_distances(bank: GroupBank, points: Array, region: Array, scaled: ScaledParameters) -> Array:
    """Returns squared Mahalanobis distances (G, M) of the points (M, 2) from the groups, inf outside a search region
    (eq. 2.2)."""
    d2 = kernels.search(points, bank.x, region, scaled.config.gate)
    tentative = ~bank.confirmed
    claimed_by_confirmed = np.isfinite(d2[~tentative]).any(0)
    d2[np.ix_(tentative, claimed_by_confirmed)] = np.inf
    return d2


def walking_reach(scaled: ScaledParameters, elapsed: Array) -> Array:
    """Returns how far (K,), in the unit of the points, a member may be from its predicted place; elapsed (K,): s since
    it was measured."""
    return np.asarray(scaled.scale * FASTEST * np.maximum(elapsed, scaled.dt) + 3 * scaled.point_sd)


def claimed(points: Array, weights: Array, d2: Array, t: float) -> PointClaims:
    """Returns the claims on the points (M, 2) of the frame at time t, s: who may have each point."""
    return PointClaims(points, weights, np.full(len(points), t), d2, np.full(len(points), -1), np.isfinite(d2).sum(0))


def associate(
    bank: GroupBank, claims: PointClaims, region: Array, log_ratio: Array, scaled: ScaledParameters, t: float
) -> Bools:
    """Updates the groups of the bank in place by their associations (sec. 4.1 to 4.3) and returns the points that they
    have, (G, M); a point is one group's at most.

    A group whose points are all more probably others' is only predicted: it is hidden (ours)."""
    size = bank.size.copy()
    x, P = bank.x.copy(), bank.P.copy()
    state, chosen = kernels.associate(
        claims.points, claims.weights, claims.d2, log_ratio, claims.owner, claims.claimants,
        bank.x, bank.P, bank.extent, bank.size, bank.null_time > 0, scaled.kernel_rules,
    )  # fmt: skip
    mine, shared = chosen.copy(), np.flatnonzero(chosen.sum(0) > 1)
    log_density = point_log_density(size, region, claims.d2[:, shared], log_ratio[:, shared])
    likeliest = np.where(chosen[:, shared], log_density, -np.inf).argmax(0) if len(bank) else shared
    mine[:, shared] = np.arange(len(bank))[:, None] == likeliest
    its = mine if scaled.config.corrections else chosen
    has_new_point = (its & (claims.last_seen >= t)).any(1)  # more than missed members
    measured, null = (state == kernels.MEASURED) & has_new_point, (state == kernels.NULL) & has_new_point
    hidden = (state == kernels.MEASURED) & ~has_new_point
    bank.x[hidden], bank.P[hidden] = x[hidden], P[hidden]
    bank.last_seen[measured | null] = t
    bank.measured_time[measured] += scaled.dt
    shorter = np.maximum(bank.null_time - scaled.dt * measured, 0.0)
    bank.null_time = np.where(null, bank.null_time + scaled.dt, shorter)
    return mine


def point_log_density(size: Array, region: Array, d2: Array, log_ratio: Array) -> Array:
    """Returns the log of N_g N(y; xi_g, S_g) times the ratio of which `log_ratio` (G, M) is the log, of each group and
    point y of this frame, (G, M), without its constant; -inf where a group may not have the point."""
    log_weight = np.log(np.maximum(size, 1e-300)) - np.log(np.linalg.det(region)) / 2
    return np.asarray(log_weight[:, None] - d2 / 2 + log_ratio)


STRAY = 0.5  # m/s: by which members' places grow uncertain (ours).
# Part of the density of a group's members that is even over its extent, of those who are not where they walked.
LEAST_PLACES = 0.05
MOST_PLACES = 64  # Places that are compared: bounds memory from pixels.


def place_density(bank: GroupBank, points: Array, may: Bools, scaled: ScaledParameters, t: float) -> Array:
    """Returns the density (G, M) of the points about the places to which each group's members have walked on since no
    other group could have its points, where `may` (G, M), and a little of it all over the group's extent."""
    density = np.tile(LEAST_PLACES / np.sqrt(np.linalg.det(bank.extent))[:, None], len(points))
    for row in np.flatnonzero(may.any(1)).tolist():
        then, velocity, places = bank.unshared[row]
        some = places[:: len(places) // MOST_PLACES + 1]
        away = np.square(points[may[row], None] - some - (t - then) * velocity).sum(2)
        var = 2 * scaled.point_sd**2 + np.square(scaled.scale * STRAY * (t - then))
        density[row, may[row]] += (np.exp(-away / var / 2) / var).mean(1)
    return density


def log_ratio(density: Array, may: Bools) -> Array:
    """Returns log p(y | g) - log p(y | other groups) (G, S) of shared points y and the groups that `may` (G, S) have
    them, given p (G, S); 0 of other groups."""
    p = np.asfortranarray(np.where(may, density, 0.0))  # numpy sums each point's groups alike, of one and of many
    others = np.where(may, (p.sum(0) - p) / (may.sum(0) - 1), 1.0)
    return np.asarray(np.log(np.where(may, p, 1.0)) - np.log(others))


def with_missed_members(claims: PointClaims, bank: GroupBank, scaled: ScaledParameters, t: float) -> PointClaims:
    """Returns new claims with the members missed at time t (s) appended as points of their own group alone."""
    has_points = np.asarray(np.isfinite(claims.d2).any(axis=1))
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
    c = scaled.config
    place, row, last_seen, known = bank.members_of(range(len(bank)))
    late = known & (t - last_seen <= c.carry_time + 1e-9)
    late &= c.carry_time > 0 and not scaled.from_pixels
    late[late] = ~any_within(place[late], points, scaled.scale * c.carry_reach)
    return place[late], row[late], last_seen[late]


def remember(
    bank: GroupBank, claims: PointClaims, exclusive: Bools, predicted: Array, scaled: ScaledParameters, t: float
) -> None:
    """Stores each group's points of this frame as its members, and how far these walked, in the bank, in place.

    predicted (G, 2): the groups' centroids before the update.
    """
    rows, shared = np.flatnonzero(exclusive.any(1)).tolist(), np.asarray((exclusive & (claims.claimants > 1)).any(1))
    reach, hidden = scaled.scale * scaled.config.carry_reach, _hidden_members(bank, rows, claims.points, scaled, t)
    for row, gone in zip(rows, hidden, strict=True):
        own, past = np.flatnonzero(exclusive[row]), bank.members[row]
        mine, known = claims.points[own], np.zeros(len(own), bool)
        if not shared[row]:
            bank.unshared[row] = Unshared(t, bank.x[row, 2:].copy(), mine)
        if not scaled.from_pixels:
            walked, known = displacement(past.offset + predicted[row], mine, reach)
            bank.anchor[row] += predicted[row] - bank.x[row, :2] + walked
        parts = zip(
            (mine - bank.x[row, :2], claims.last_seen[own], known),
            (past.offset[gone], past.last_seen[gone], past.known[gone]),
            strict=True,
        )
        bank.members[row] = MemberPlaces(*map(np.concatenate, parts))


def _hidden_members(bank: GroupBank, rows: list[int], points: Array, scaled: ScaledParameters, t: float) -> list[Bools]:
    c, (place, row, last_seen, known) = scaled.config, bank.members_of(rows)
    age = t - last_seen
    hidden = known & (age > c.carry_time + 1e-9) & (age <= c.coast_time + 1e-9)
    hidden &= c.carry_time > 0 and not scaled.from_pixels
    hidden[hidden] = ~any_within(place[hidden], points, scaled.scale * c.carry_reach)
    return np.split(hidden, np.searchsorted(row, rows[1:])) if rows else []
