"""Kernels of `group-pda`: search regions, and the update of each group by its associations and their masses.

Gennari & Hager (2004), section 4. Points are (M, 2); weights (M,) are the people that each point stands for: 1, or the
share of a person that a pixel is. A group's state is x (4,) = xi, v (centroid x, y and velocity) with covariance P
(4, 4); extent Sigma (2, 2), the covariance of its members' positions; size N in people. Lengths are in the unit of the
points. Symmetric 2 x 2 matrices are stored as (3,) = xx, xy, yy. Face: tracking.papers.group_pda.association; masses:
association_mass_kernels. Slow twins: tests/reference_group_pda.py.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import sort_by
from sim.types import Array, Bools, Ints
from tracking.filters.components_kernels import AROUND, WEIGHT, cells, components, prefixes, unset
from tracking.papers.group_pda.association_mass_kernels import (
    COUNT_SD,
    COUNT_SHARE,
    GATE,
    GATE_FACTOR,
    KEEP,
    LEAST_WEIGHT,
    LINK,
    PRIOR_WEIGHT,
    PRIOR_XX,
    PRIOR_YY,
    UNCONSTRAINED,
    centroid_noise,
    log_count,
    log_density,
    running_moments,
)  # fmt: skip

# State of a group after `associate`: no point is the group's; no association is feasible; it was measured.
NOTHING, NULL, MEASURED = range(3)


@njit(cache=True)
def search(points: Array, x: Array, region: Array, gate: float) -> Array:
    """Returns squared Mahalanobis distances (G, M) of points (M, 2) from groups, inf outside the search region (eq.
    2.2).

    x (G, 4): centroid x, y, velocity; region (G, 2, 2): covariance of each group's search region, in the squared unit
    of the points. The region is d^2 < gate.
    """
    d2 = np.empty((len(x), len(points)))
    for g in range(len(x)):
        xx, xy, yy = region[g, 0, 0], region[g, 0, 1], region[g, 1, 1]
        area = xx * yy - xy * xy
        reach_x, reach_y = np.sqrt(gate * xx), np.sqrt(gate * yy)
        for k in range(len(points)):
            dx, dy = points[k, 0] - x[g, 0], points[k, 1] - x[g, 1]
            d2[g, k] = np.inf
            if abs(dx) <= reach_x and abs(dy) <= reach_y:
                d = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / area
                if d < gate:
                    d2[g, k] = d
    return d2


@njit(cache=True)
def any_within(place: Array, points: Array, reach: float) -> Bools:
    """Returns flags (K,): True if any of the points (M, 2) is at most `reach` from the place (K, 2); all in one unit.

    Without points all are False. reach: above 0. The points of a place's cell and of the cells around it are compared.
    """
    m, found, most = len(points), np.zeros(len(place), np.bool_), reach * reach
    if m == 0 or len(place) == 0:
        return found
    both = np.empty((m + len(place), 2))
    for k in range(len(both)):
        for axis in range(2):
            both[k, axis] = points[k, axis] if k < m else place[k - m, axis]
    cell, around = cells(both, reach * (1 + 1e-9))  # no point within reach is further away
    head, after = unset(len(around)), unset(m)
    for p in range(m):
        after[p], head[cell[p]] = head[cell[p]], p
    for k in range(len(place)):
        c = cell[m + k]
        for n in range(-1, AROUND):
            near = c if n < 0 else around[c, n]
            p = head[near] if near >= 0 else -1
            while p >= 0 and not found[k]:
                dx, dy = points[p, 0] - place[k, 0], points[p, 1] - place[k, 1]
                found[k] = dx * dx + dy * dy <= most
                p = after[p]
            if found[k]:
                break
    return found


@njit(cache=True)
def displacement(before: Array, after: Array, reach: float) -> tuple[Array, Bools]:
    """Returns the mean displacement (2,) of the places before (K, 2) that are after (M, 2), too: 0 if none is; and
    whether there was a place before within reach of each of those after, (M,).

    A place is there, too, if it and one after are each other's nearest, at most `reach` apart; all in one unit.
    """
    least, nearest = np.full(len(after), np.inf), np.zeros(len(after), np.int64)
    least_back, back = np.full(len(before), np.inf), np.zeros(len(before), np.int64)
    for j in range(len(after)):
        for i in range(len(before)):
            dx, dy = after[j, 0] - before[i, 0], after[j, 1] - before[i, 1]
            d2 = dx * dx + dy * dy
            if d2 < least[j]:
                least[j], nearest[j] = d2, i
            if d2 < least_back[i]:
                least_back[i], back[i] = d2, j
    total, count = np.zeros(2), 0
    for j in range(len(after)):
        i = nearest[j]
        if least[j] <= reach * reach and back[i] == j:
            total[0] += after[j, 0] - before[i, 0]
            total[1] += after[j, 1] - before[i, 1]
            count += 1
    return total / max(count, 1), least <= reach * reach


@njit(cache=True)
def associate(
    points: Array, weights: Array, d2: Array, log_ratio: Array, owner: Ints, claimants: Ints,
    x: Array, P: Array, extent: Array, size: Array, rest: Bools, rules: Array,
) -> tuple[Ints, Bools]:  # fmt: skip
    """Update the groups x (G, 4), P (G, 4, 4), extent (G, 2, 2), size (G,) in place by the points (sec. 4.1 to 4.3).

    x: centroid and velocity; P: its covariance. points (M, 2); weights (M,): people each stands for. d2 (G, M): of
    `search`. log_ratio (G, M): what a point adds to the log mass per person by its colour or place. owner (M,): the row
    of the only group that may have the point, a missed member that stands in, whose d2 is inf; -1 for a point of this
    frame. claimants (M,): number of groups that may have the point. rest (G,): True for groups whose extent and size
    must not change. rules: see association_mass_kernels.

    Returns the state (G,) of each group and the points (G, M) bool of its likeliest association:
    - NOTHING = 0: the group has no points, or only noise. No points are chosen; it is not updated.
    - NULL = 1: it has points, more than noise, but no feasible association (points that form one group). All its points
      are chosen; it is not updated.
    - MEASURED = 2: else.
    """
    groups, m = d2.shape
    state, chosen = np.zeros(groups, np.int64), np.zeros((groups, m), np.bool_)
    for g in range(groups):
        order, start = _ordered_points(d2[g], log_ratio[g], owner, claimants, g)
        n = len(order)
        if n == 0:
            continue
        mine, people, fresh, colour = np.empty((n, 2)), np.empty(n), np.empty(n), np.empty(n)
        for k in range(n):
            p = order[k]
            mine[k, 0], mine[k, 1] = points[p, 0], points[p, 1]
            people[k], fresh[k] = weights[p], weights[p] if owner[p] < 0 else 0.0
            colour[k] = log_ratio[g, p] * weights[p]
        if rules[UNCONSTRAINED]:
            start = n
            feasible = np.ones(1, np.bool_)
        else:
            prior = rules[PRIOR_XX : PRIOR_YY + 1]
            # m_g (eq. 4.1)
            feasible = prefixes(
                mine, people, start, rules[LINK], rules[GATE], prior, rules[PRIOR_WEIGHT], rules[LEAST_WEIGHT]
            )
        taken = 0
        if feasible.any():
            best = _estimate(
                mine, people, fresh, colour, start, feasible, x[g], P[g], extent[g], size[g : g + 1], rest[g], rules
            )
            state[g], taken = MEASURED, start + best
        elif (components(mine, people, rules[LINK])[1][:, WEIGHT] >= rules[LEAST_WEIGHT]).any():
            # all m_g = 0: a split, if it lasts (sec. 4.2)
            state[g], taken = NULL, n
        for k in range(taken):
            chosen[g, order[k]] = True
    return state, chosen


# The points that no other group claims, then the others in ascending order (sec. 4.1).
@njit(cache=True)
def _ordered_points(d2: Array, log_ratio: Array, owner: Ints, claimants: Ints, g: int) -> tuple[Ints, int]:
    order, distance = np.empty(len(d2), np.int64), np.empty(len(d2))
    own = shared = 0
    for shares in (False, True):  # first the points that no other group claims
        for n in range(len(d2)):
            if not (d2[n] < np.inf or owner[n] == g) or (claimants[n] > 1) != shares:
                continue
            distance[n] = d2[n] - 2 * log_ratio[n]
            order[own + shared] = n
            if shares:
                shared += 1
            else:
                own += 1
    sort_by(distance, order[own : own + shared])
    return order[: own + shared], own


@njit(cache=True)
def _estimate(
    points: Array, weights: Array, fresh: Array, colour: Array, start: int, feasible: Bools,
    x: Array, P: Array, extent: Array, size: Array, rest: bool, rules: Array,
) -> int:  # fmt: skip
    people, mean, cov = running_moments(points, weights, x[0], x[1], start)
    S, seen, evidence = np.empty((len(people), 3)), np.empty(len(people)), np.empty(len(people))
    measured = shown = 0.0  # people measured in this frame; of the shared points, what colours and places tell
    for k in range(len(points) + 1):
        if k >= start:
            seen[k - start], evidence[k - start] = measured, shown
        if k < len(points):
            measured += fresh[k]
            shown += colour[k] if k >= start else 0.0
    log_mass = np.full(len(people), -np.inf)
    unit = weights.sum() / len(weights)  # people that one point stands for: makes m_N a mass of numbers of points
    width = rules[COUNT_SD] ** 2 + (COUNT_SHARE * size[0]) ** 2  # sigma_n^2
    for j in range(len(people)):
        if feasible[j] and people[j] > 0:
            R = centroid_noise(people[j], seen[j] if seen[j] > 0 else people[j], cov[j], extent, size[0], rules)
            S[j, 0], S[j, 1], S[j, 2] = P[0, 0] + R[0], P[0, 1] + R[1], P[1, 1] + R[2]
            m_d = log_density(mean[j, 0], mean[j, 1], S[j])
            log_mass[j] = m_d + log_count(people[j], size[0], width) + np.log(unit) + evidence[j]  # eq. 4.2, m_g = 1
    beta = np.exp(log_mass - log_mass.max())
    beta /= beta.sum()
    _mix(beta * (seen > 0), mean, S, x, P)
    if not rest:
        _adapt(beta, people, cov, extent, size, rules)
    return int(beta.argmax())


# Mean and covariance over each association's Kalman update, as in the PDAF (sec. 4.3).
@njit(cache=True)
def _mix(beta: Array, mean: Array, S: Array, x: Array, P: Array) -> None:
    shift, spread, less = np.zeros(4), np.zeros((4, 4)), np.zeros((4, 4))
    step, gain = np.empty(4), np.empty((4, 2))
    for j in range(len(beta)):
        if beta[j] <= 0:
            continue
        area = S[j, 0] * S[j, 2] - S[j, 1] * S[j, 1]
        ixx, ixy, iyy = S[j, 2] / area, -S[j, 1] / area, S[j, 0] / area
        for a in range(4):
            gain[a, 0] = P[a, 0] * ixx + P[a, 1] * ixy
            gain[a, 1] = P[a, 0] * ixy + P[a, 1] * iyy
            step[a] = gain[a, 0] * mean[j, 0] + gain[a, 1] * mean[j, 1]
            shift[a] += beta[j] * step[a]
        for a in range(4):
            for b in range(4):
                less[a, b] += beta[j] * (gain[a, 0] * P[b, 0] + gain[a, 1] * P[b, 1])
                spread[a, b] += beta[j] * step[a] * step[b]
    for a in range(4):
        x[a] += shift[a]
        for b in range(4):
            P[a, b] += spread[a, b] - shift[a] * shift[b] - less[a, b]
    for a in range(4):
        for b in range(a):
            P[a, b] = P[b, a] = (P[a, b] + P[b, a]) / 2


# Eq. 2.4, of the mean over the associations.
@njit(cache=True)
def _adapt(beta: Array, people: Array, cov: Array, extent: Array, size: Array, rules: Array) -> None:
    target, count = np.zeros(3), 0.0
    for j in range(len(beta)):
        if beta[j] > 0:
            n, share = people[j], beta[j]
            for a in range(3):
                total_cov = n * cov[j, a] + rules[PRIOR_WEIGHT] * rules[PRIOR_XX + a]
                target[a] += share * total_cov / (n + rules[PRIOR_WEIGHT]) / rules[GATE_FACTOR]
            count += share * n
    new = 1 - rules[KEEP]
    keep = rules[KEEP] + new * (1 - beta.sum())  # masses sum to 1 but for rounding
    extent[0, 0] = keep * extent[0, 0] + new * target[0]
    extent[0, 1] = keep * extent[0, 1] + new * target[1]
    extent[1, 0] = extent[0, 1]
    extent[1, 1] = keep * extent[1, 1] + new * target[2]
    size[0] = keep * size[0] + new * count
