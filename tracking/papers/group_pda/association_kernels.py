"""Kernels of `group-pda`: search regions, and the masses and estimates of a group's associations.

Gennari & Hager (2004), section 4. Points are (M, 2), weights (M,) the people that each stands for (1, or a pixel's
share). A group's state is x (4,) = xi, v with P (4, 4), extent Sigma (2, 2) and size N in people. Slow twins:
tests/reference_group_pda.py.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.types import Array, Bools, Ints
from tracking.filters.components_kernels import WEIGHT, components, prefixes

NOTHING, NULL, MEASURED = range(3)
(GATE, LINK, PRIOR_XX, PRIOR_XY, PRIOR_YY, STRENGTH, LEAST, NOISE, COUNT, SHARE, DETECT, MISS, FREEZE, KEEP_EXTENT,
 KEEP_SIZE, CUT, REDRAWN, ALL, OTHERS) = range(19)  # fmt: skip
"""Rows of `rules`: see tracking.papers.group_pda.kernel_parameters."""
NEWCOMERS = 0.02
"""Probability that the number of people has nothing to do with what it was."""


@njit(cache=True)
def search(points: Array, x: Array, P: Array, extent: Array, noise: float, wider: Array, gate: float) -> Array:
    """(G, M) squared Mahalanobis distances, inf outside the search regions (2.2).

    Departure: by Sigma + H P H' + noise I, as the centroid is not known exactly; wider (G,) is added to the variances.
    """
    d2 = np.full((len(x), len(points)), np.inf)
    for g in range(len(x)):
        xx = extent[g, 0, 0] + P[g, 0, 0] + noise + wider[g]
        yy = extent[g, 1, 1] + P[g, 1, 1] + noise + wider[g]
        xy = extent[g, 0, 1] + P[g, 0, 1]
        area = xx * yy - xy * xy
        reach_x, reach_y = np.sqrt(gate * xx), np.sqrt(gate * yy)
        for k in range(len(points)):
            dx, dy = points[k, 0] - x[g, 0], points[k, 1] - x[g, 1]
            if abs(dx) <= reach_x and abs(dy) <= reach_y:
                d = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / area
                if d < gate:
                    d2[g, k] = d
    return d2


@njit(cache=True)
def near(place: Array, points: Array, reach: float) -> Bools:
    """(K,) whether one of the points (M, 2) is no further than reach from each place (K, 2); outwards along x."""
    order = np.argsort(points[:, 0])
    x = points[order, 0]
    found, most = np.zeros(len(place), np.bool_), reach * reach
    for k in range(len(place)):
        up = np.searchsorted(x, place[k, 0])
        down = up - 1
        while not found[k] and (up < len(x) or down >= 0):
            right = x[up] - place[k, 0] if up < len(x) else np.inf
            left = place[k, 0] - x[down] if down >= 0 else np.inf
            if min(left, right) > reach:
                break
            at = order[up] if right <= left else order[down]
            dx, dy = points[at, 0] - place[k, 0], points[at, 1] - place[k, 1]
            found[k] = dx * dx + dy * dy <= most
            if right <= left:
                up += 1
            else:
                down -= 1
    return found


@njit(cache=True)
def associate(
    points: Array, weights: Array, d2: Array, looks: Array, own: Ints, hits: Ints,
    x: Array, P: Array, extent: Array, size: Array, hold: Bools, rules: Array,
) -> tuple[Ints, Bools, Array]:  # fmt: skip
    """Update the groups x (G, 4), P, extent (G, 2, 2), size (G,) in place by their points (4.1 to 4.3).

    d2 (G, M) from `search`; own (M,): the group that an unclaimed point is attached to, or -1; hits (M,): in how many
    regions each point lies; looks (G, M): what a point's colour adds to the log mass of an association, per person, or
    (G, 0) without colours; hold (G,): whose extent and size rest. Returns (G,) NOTHING in the region but noise, or
    nothing that is the group's; NULL (no association is feasible) or MEASURED; (G, M) the points of the likeliest
    association; (G, 6) its innovation y and S (xx, xy, yy) and the mass of the miss.
    """
    groups, m = d2.shape
    state, chosen = np.zeros(groups, np.int64), np.zeros((groups, m), np.bool_)
    told = np.zeros((groups, 6))
    for g in range(groups):
        order, start = _claims(d2[g], looks[g], own, hits, g)
        if len(order) == 0:
            continue
        some, people = points[order], weights[order]
        if rules[ALL] > 0:
            start = len(order)
            feasible = np.ones(1, np.bool_)
        else:
            prior = rules[PRIOR_XX : PRIOR_YY + 1]
            feasible = prefixes(some, people, start, rules[LINK], rules[GATE], prior, rules[STRENGTH], rules[LEAST])[0]
        if not feasible.any():
            if components(some, people, rules[LINK])[1][:, WEIGHT].max() >= rules[LEAST]:
                state[g], chosen[g, order] = NULL, True
            continue
        look = looks[g][order] * people if looks.shape[1] else np.zeros(len(order))
        best = _estimate(
            some, people, look, start, feasible, x[g], P[g], extent[g], size[g : g + 1], hold[g], rules, told[g]
        )
        state[g] = MEASURED if best >= 0 else NOTHING
        if best >= 0:
            chosen[g, order[: start + best]] = True
    return state, chosen, told


@njit(cache=True)
def _claims(d2: Array, look: Array, own: Ints, hits: Ints, g: int) -> tuple[Ints, int]:
    """The points in a group's region: unshared ones, then the shared ones by their distance (4.1), in colours as well;
    how many are unshared."""
    inside = np.flatnonzero((d2 < np.inf) | (own == g))
    shared = hits[inside] > 1
    mine, others = inside[~shared], inside[shared]
    order = np.empty(len(inside), np.int64)
    order[: len(mine)] = mine
    far = d2[others] - 2 * look[others] if len(look) else d2[others]
    order[len(mine) :] = others[np.argsort(far, kind="mergesort")]
    return order, len(mine)


@njit(cache=True)
def _estimate(
    points: Array, weights: Array, look: Array, start: int, feasible: Bools,
    x: Array, P: Array, extent: Array, size: Array, hold: bool, rules: Array, told: Array,
) -> int:  # fmt: skip
    """Update one group in place by its associations, the first start, start + 1, … points; the likeliest one's number
    of shared points, or -1 where that is the miss."""
    people, mean, cov = _running(points, weights, x[0], x[1], start)
    S = np.empty((len(people), 3))
    log_mass = np.full(len(people), -np.inf)
    unit = weights.mean()  # people that one point stands for: makes m_N a mass of numbers of points
    alike = np.concatenate((np.zeros(1), np.cumsum(look[start:])))
    width = rules[COUNT] ** 2 + (rules[SHARE] * size[0]) ** 2  # sigma_n^2
    for j in range(len(people)):
        if feasible[j] and people[j] > 0:
            R = _centroid_noise(people[j], cov[j], extent, size[0], rules)
            S[j, 0], S[j, 1], S[j, 2] = P[0, 0] + R[0], P[0, 1] + R[1], P[1, 1] + R[2]
            m_d = _log_density(mean[j, 0], mean[j, 1], S[j])
            log_mass[j] = m_d + _log_count(people[j], size[0], width) + np.log(unit) + alike[j]  # (4.2), m_g = 1
    log_miss = _log_miss(points, weights, start, extent, P, size[0], rules)
    top = max(log_mass.max(), log_miss)
    beta, miss = np.exp(log_mass - top), np.exp(log_miss - top)
    total = beta.sum() + miss
    beta, miss = beta / total, miss / total
    best = int(np.argmax(beta))
    told[0], told[1], told[2:5], told[5] = mean[best, 0], mean[best, 1], S[best], miss
    calm = weights[start:].sum() <= rules[FREEZE] * size[0]
    _mix(beta, miss, mean, S, x, P)
    if calm and not hold:
        _adapt(beta, people, cov, extent, size, rules)
    return best if beta.sum() > miss else -1


@njit(cache=True)
def _running(points: Array, weights: Array, x: float, y: float, start: int) -> tuple[Array, Array, Array]:
    """People (J,), centroid relative to (x, y) (J, 2) and 1/N covariance (J, 3) of the first start, start + 1, …
    points, each from the one before (4.2.1)."""
    count = len(points) - start + 1
    people, mean, cov = np.zeros(count), np.zeros((count, 2)), np.zeros((count, 3))
    n = sx = sy = sxx = sxy = syy = 0.0
    for k in range(len(points) + 1):
        if k >= start and n > 0:
            j = k - start
            u, v = sx / n, sy / n
            people[j], mean[j, 0], mean[j, 1] = n, u, v
            cov[j, 0], cov[j, 1], cov[j, 2] = max(sxx / n - u * u, 0.0), sxy / n - u * v, max(syy / n - v * v, 0.0)
        if k < len(points):
            w, u, v = weights[k], points[k, 0] - x, points[k, 1] - y
            n, sx, sy = n + w, sx + w * u, sy + w * v
            sxx, sxy, syy = sxx + w * u * u, sxy + w * u * v, syy + w * v * v
    return people, mean, cov


@njit(cache=True)
def _log_count(people: float, size: float, width: float) -> float:
    """log m_N, per person: Gaussian about N with the variance `width`; ours: with tails, as people who are linked to a
    group come all at once."""
    gauss = np.exp(-0.5 * (people - size) ** 2 / width) / np.sqrt(2 * np.pi * width)
    return float(np.log((1 - NEWCOMERS) * gauss + NEWCOMERS / (size + people + 1)))


@njit(cache=True)
def _centroid_noise(seen: float, cov: Array, extent: Array, size: float, rules: Array) -> tuple[float, float, float]:
    """R (xx, xy, yy) of the centroid of `seen` people out of those that are there.

    Members who keep their places: r^2 / m + (1 - m / n) Sigma n / (n - 1) / m, drawn without replacement (ours); if
    more are seen than there are, the other way round, with the covariance cov (3,) of those who are seen; n - 1 is 1
    at least from points, as a size between one and two is a doubt about which, and from pixels what it is; or
    (2.1) read literally, drawn anew in each frame: Sigma / m. Sigma is of measured places: r^2 is in it.
    """
    noise = rules[NOISE] ** 2  # the extent is that of measured places, so it has this noise already
    if rules[REDRAWN] > 0:
        return extent[0, 0] / seen, extent[0, 1] / seen, extent[1, 1] / seen
    there = size / rules[DETECT]
    if seen > there:  # some are strangers: the group is drawn out of them
        strange = (seen - there) / max(seen - 1, 1.0) / max(there, 1.0)
        own = noise / max(there, 1.0)
        return own + strange * cov[0], strange * cov[1], own + strange * cov[2]
    m = max(seen, min(1.0, there))
    unseen = (there - m) / max(there - 1, rules[OTHERS]) / m if there > 1 else 0.0
    xx, yy = max(extent[0, 0] - noise, 0.0), max(extent[1, 1] - noise, 0.0)
    return noise / m + unseen * xx, unseen * extent[0, 1], noise / m + unseen * yy


@njit(cache=True)
def _log_density(dx: float, dy: float, S: Array) -> float:
    """log N((dx, dy); 0, S): m_d."""
    area = S[0] * S[2] - S[1] * S[1]
    d2 = (S[2] * dx * dx - 2 * S[1] * dx * dy + S[0] * dy * dy) / area
    return float(-0.5 * (d2 + np.log(area)) - np.log(2 * np.pi))


@njit(cache=True)
def _log_miss(points: Array, weights: Array, start: int, extent: Array, P: Array, size: float, rules: Array) -> float:
    """Log mass of the association that nothing is the group's: its points are anywhere in the region, and the unshared
    ones any number up to twice the group's."""
    if rules[MISS] <= 0:
        return -np.inf
    xx, yy, xy = extent[0, 0] + P[0, 0], extent[1, 1] + P[1, 1], extent[0, 1] + P[0, 1]
    area = np.pi * rules[GATE] * np.sqrt(max(xx * yy - xy * xy, 1e-300))
    strangers = np.log(weights.mean() / (2 * size + 1)) if start > 0 else 0.0
    return float(np.log(rules[MISS] / (1 - rules[MISS])) - np.log(area) + strangers)


@njit(cache=True)
def _mix(beta: Array, miss: float, mean: Array, S: Array, x: Array, P: Array) -> None:
    """x and P over all associations, each with its gain: x = sum beta_j x_j, P = sum beta_j (P_j + spread) (4.3)."""
    shift, spread, less = np.zeros(4), np.zeros((4, 4)), np.zeros((4, 4))
    step = np.empty(4)
    gain = np.empty((4, 2))
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
                less[a, b] += beta[j] * (gain[a, 0] * P[0, b] + gain[a, 1] * P[1, b])
                spread[a, b] += beta[j] * step[a] * step[b]
    for a in range(4):
        for b in range(4):
            spread[a, b] -= shift[a] * shift[b]
    P += spread - less
    P[:] = (P + P.T) / 2
    x += shift


@njit(cache=True)
def _adapt(beta: Array, people: Array, cov: Array, extent: Array, size: Array, rules: Array) -> None:
    """Sigma and N, each the mean of (2.4) over the associations; what the region's edge cut off is put back, and the
    covariance of few people shrunk (both ours)."""
    move, count = np.zeros(3), 0.0
    total = beta.sum()
    for j in range(len(beta)):
        if beta[j] > 0:
            n, share = people[j], beta[j]
            for a in range(3):
                whole = n * cov[j, a] + rules[STRENGTH] * rules[PRIOR_XX + a]
                move[a] += share * whole / (n + rules[STRENGTH]) / rules[CUT]
            count += share * n
    keep = rules[KEEP_EXTENT] + (1 - rules[KEEP_EXTENT]) * (1 - total)  # a miss leaves them as they are
    extent[0, 0] = keep * extent[0, 0] + (1 - rules[KEEP_EXTENT]) * move[0]
    extent[0, 1] = keep * extent[0, 1] + (1 - rules[KEEP_EXTENT]) * move[1]
    extent[1, 0] = extent[0, 1]
    extent[1, 1] = keep * extent[1, 1] + (1 - rules[KEEP_EXTENT]) * move[2]
    keep = rules[KEEP_SIZE] + (1 - rules[KEEP_SIZE]) * (1 - total)
    size[0] = keep * size[0] + (1 - rules[KEEP_SIZE]) * count
