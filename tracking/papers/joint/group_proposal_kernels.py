"""Kernels of the distributions: how groups move individuals (eqs 3, 5), and the joint group proposal (eqs 6, 7).

The proposal has features of a group and its nearest one, events, and what they do.

States are (K, 4): x, y in m, vx, vy in m/s. The features of a group g and its nearest group g' are (d_KL, d_v, d_intra)
at two times, a step apart, both with the members of Z_t, and g' the nearest at the earlier time. People alone are
groups of one (ours).
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import sort_by
from sim.types import Array, Ints
from tracking.filters.nearest_kernels import empty_cells, nearest, put
from tracking.papers.joint.division_kernels import divide
from tracking.papers.joint.partition_labels_kernels import clusters, same_row

# Columns of moments (G, 9): mean place and velocity, covariance of the places shrunk to PRIOR, mean squared distance
# to the mean place, number of people.
X, Y, VX, VY, XX, XY, YY, SPREAD, SIZE = range(9)
# Standard deviation per axis, m, to which covariances of places are shrunk.
PRIOR = 0.35
# Number of people that PRIOR counts for.
PRIOR_WEIGHT = 1.0
# Largest log(1 + d_KL); also its value without another group.
LOG_KL_MOST = 8.0
# d_KL, d_v, d_intra at the earlier time, then at the later one.
FEATURES = 6
# Slots of `rules` (5,): time step over lag; weight of the validity in the choice of parts; 1 if the size prior acts on
# all events, 0 if on Merge alone; its mean and standard deviation, people.
RATIO, SHARPNESS, SIZE_OF_ALL, SIZE_MEAN, SIZE_STD = range(5)
# Slots of a person's uniforms: place of its group in the order of visits; event; parts of a split.
ORDER, EVENT, PARTS = range(3)
# Slots of a covariance or precision (3,) of one axis of a state: of the place, place and velocity, the velocity.
PLACE, CROSS, RATE = range(3)


@njit(cache=True)
def nearest_places(places: Array, count: int, found: Ints) -> None:
    """Writes the nearest other one of the first `count` places (K, 2 or more) to each, of equal ones the first; -1
    without."""
    corner, after = np.empty(3), np.empty(count, np.int64)
    cells = empty_cells(places, count, corner)
    for k in range(count):
        put(places, k, corner, cells, after)
    for k in range(count):
        found[k] = nearest(places, k, corner, cells, after)


@njit(cache=True)
def moments_of(state: Array, cluster: Ints, count: int, out: Array) -> None:
    """Writes the moments (G, 9) of the clusters of people: state (K, 4), cluster (K,), count G."""
    n = len(cluster)
    for g in range(count):
        for c in range(SIZE + 1):
            out[g, c] = 0.0
    for k in range(n):
        g = cluster[k]
        out[g, SIZE] += 1
        for d in range(4):
            out[g, X + d] += state[k, d]
    for g in range(count):
        for d in range(4):
            out[g, X + d] /= out[g, SIZE]
    for k in range(n):
        g = cluster[k]
        x, y = state[k, 0] - out[g, X], state[k, 1] - out[g, Y]
        out[g, XX] += x * x
        out[g, XY] += x * y
        out[g, YY] += y * y
    for g in range(count):
        out[g, SPREAD] = (out[g, XX] + out[g, YY]) / out[g, SIZE]
        weight = out[g, SIZE] + PRIOR_WEIGHT
        out[g, XX] = (out[g, XX] + PRIOR_WEIGHT * PRIOR**2) / weight
        out[g, YY] = (out[g, YY] + PRIOR_WEIGHT * PRIOR**2) / weight
        out[g, XY] /= weight


@njit(cache=True)
def log_symmetric_kl(a: Array, b: Array) -> float:
    """Returns log(1 + d_KL) of two rows of moments, at most LOG_KL_MOST; d_KL is the sum of both directions.

    With covariances A, B and difference d of the means: (tr(A^-1 B) + tr(B^-1 A) - 4 + d' (A^-1 + B^-1) d) / 2.
    """
    det_a, det_b = a[XX] * a[YY] - a[XY] ** 2, b[XX] * b[YY] - b[XY] ** 2
    traces = (a[YY] * b[XX] - 2 * a[XY] * b[XY] + a[XX] * b[YY]) * (1 / det_a + 1 / det_b)
    x, y = a[X] - b[X], a[Y] - b[Y]
    xx, yy, xy = a[YY] / det_a + b[YY] / det_b, a[XX] / det_a + b[XX] / det_b, a[XY] / det_a + b[XY] / det_b
    divergence = (traces - 4 + xx * x * x - 2 * xy * x * y + yy * y * y) / 2
    return min(math.log1p(max(divergence, 0.0)), LOG_KL_MOST)


@njit(cache=True)
def features_of(early: Array, late: Array, g: int, other: int, out: Array) -> None:
    """Writes the six features of cluster g and its nearest cluster `other` (-1: none); early, late: moments
    (G, 9)."""
    for k in range(2):
        moments = early if k == 0 else late
        out[3 * k] = LOG_KL_MOST if other < 0 else log_symmetric_kl(moments[g], moments[other])
        out[3 * k + 1] = 0.0
        if other >= 0:
            x, y = moments[g, VX] - moments[other, VX], moments[g, VY] - moments[other, VY]
            out[3 * k + 1] = math.sqrt(x * x + y * y)
        out[3 * k + 2] = math.sqrt(moments[g, SPREAD])


@njit(cache=True)
def partition_features(
    early: Array, late: Array, label: Ints, features: Array, nearest: Ints, cluster: Ints, head: Ints, first: Array
) -> int:
    """Writes features (G, 6), nearest cluster, head and early moments (G, 9) of each cluster of one partition, and the
    cluster (K,) of each person; return G.

    early, late (K, 4): states at both times; label (K,): the partition.
    """
    count = clusters(label, cluster, head)
    second = np.empty_like(first)
    moments_of(early, cluster, count, first)
    moments_of(late, cluster, count, second)
    nearest_places(first, count, nearest)
    for g in range(count):
        features_of(first, second, g, nearest[g], features[g])
    return count


@njit(cache=True)
def event_probabilities(
    features: Array, size: float, other: float, weights: Array, rules: Array
) -> tuple[float, float]:
    """Returns the probabilities of Merge and Split of a group in a step: pi(e | X, g, g'), eq. 7.

    features (6,); size, other: people in g and g', other = 0 if a merge is excluded; weights (2, 7): of Merge and
    Split, the constant last; rules: as RATIO and the following. The classifier gives probabilities over EVENT_TIME,
    against None; they are turned into those of a step as hazards (ours). The prior N(|e|; mu, sigma) of sec. 4
    multiplies them: |e| is the size after the event, of a split the mean of the two parts. One person does not split.
    """
    merge, split, none = weights[0, FEATURES], weights[1, FEATURES], 0.0  # scores
    for k in range(FEATURES):
        merge += weights[0, k] * features[k]
        split += weights[1, k] * features[k]
    mean, spread = rules[SIZE_MEAN], rules[SIZE_STD]
    merge -= ((size + other - mean) / spread) ** 2 / 2
    if rules[SIZE_OF_ALL]:
        split -= ((size / 2 - mean) / spread) ** 2 / 2
        none -= ((size - mean) / spread) ** 2 / 2
    if other == 0:
        merge = -np.inf
    if size < 2:
        split = -np.inf
    top = max(merge, split, none)
    merge, split, none = math.exp(merge - top), math.exp(split - top), math.exp(none - top)
    total = merge + split + none
    happening = merge + split
    if happening == 0:
        return 0.0, 0.0
    quiet = max(none / total, 1e-12) ** rules[RATIO]
    return (1 - quiet) * merge / happening, (1 - quiet) * split / happening


@njit(cache=True)
def propose(
    early: Array,
    late: Array,
    label: Ints,
    uniforms: Array,
    weights: Array,
    rules: Array,
    scales: Array,
) -> None:
    """Draw Z_{t+1} from the joint group proposal for all particles: pi(Z_{t+1} | X_{0:t+1}, Z_t, y), eqs 6 and 7.

    early, late (N_x, K, 4): states at both times; label (N_x, N_z, K): Z_t, changed in place; uniforms (N_x, N_z, K,
    3): of the heads of groups. weights, rules: as event_probabilities; scales: as partition_labels_kernels.SCATTER and
    the following.

    Groups are visited in random order. A group that an event has changed is not visited. A pair of groups that are each
    other's nearest draws its merge once, so that the probability is the pair's (ours).
    """
    particles, partitions, n = label.shape
    cluster, head, nearest = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    first, features = np.empty((n, 9)), np.empty((n, FEATURES))
    order, changed, visited = np.empty(n), np.empty(n, np.bool_), np.empty(n, np.bool_)
    merge, split = np.empty(n), np.empty(n)
    before, visits = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(particles):
        count = 0
        for j in range(partitions):
            if j == 0 or not same_row(label[i, j], before):
                for k in range(n):
                    before[k] = label[i, j, k]
                count = partition_features(early[i], late[i], before, features, nearest, cluster, head, first)
                for g in range(count):
                    other = first[nearest[g], SIZE] if nearest[g] >= 0 else 0.0
                    merge[g], split[g] = event_probabilities(features[g], first[g, SIZE], other, weights, rules)
            happens = False
            for g in range(count):
                order[g] = uniforms[i, j, head[g], ORDER]
                changed[g] = visited[g] = False
                visits[g] = g
                happens = happens or uniforms[i, j, head[g], EVENT] < merge[g] + split[g]
            if not happens:
                continue
            sort_by(order, visits[:count])
            for at in range(count):
                g = visits[at]
                if changed[g]:
                    continue
                h, u = nearest[g], uniforms[i, j, head[g], EVENT]
                p_merge, p_split = merge[g], split[g]
                if h < 0 or changed[h] or (visited[h] and nearest[h] == g):
                    p_merge = 0.0
                visited[g] = True
                if u < p_merge:
                    changed[g] = changed[h] = True
                    name = 1 + min(head[g], head[h])
                    for k in range(n):
                        if cluster[k] == g or cluster[k] == h:
                            label[i, j, k] = name
                elif u < p_merge + p_split:
                    changed[g] = True
                    divide(late[i], cluster, g, uniforms[i, j, head[g], PARTS], rules[SHARPNESS], scales, label[i, j])


@njit(cache=True)
def log_normal(residual: Array, precision: Array, log_scale: float) -> float:
    """Returns log N(residual; 0, Sigma) of a state's residual (4,) x, y, vx, vy; log_scale: of the density at 0."""
    total = 0.0
    for d in range(2):
        place, rate = residual[d], residual[d + 2]
        total += precision[PLACE] * place * place + 2 * precision[CROSS] * place * rate + precision[RATE] * rate * rate
    return log_scale - total / 2


@njit(cache=True)
def group_dynamics(
    new: Array, old: Array, label: Ints, precision: Array, log_scale: float, dt: float, out: Array
) -> None:
    """Writes log p(X_{t+1} | X_t, Z_t) of each partition, (N_x, N_z), eq. 5: N(x + B g, Sigma) for each person.

    new, old (N_x, K, 4): states; label (N_x, N_z, K); precision (3,): as PLACE, CROSS, RATE; dt: s. g is the mean of
    the person's group; only places move with its velocity. g of a person alone is the own state, not that of all
    people alone (a reading).
    """
    particles, partitions, n = label.shape
    sums, size, residual = np.empty((n + 1, 2)), np.empty(n + 1), np.empty(4)
    for i in range(particles):
        for j in range(partitions):
            if j > 0 and same_row(label[i, j], label[i, j - 1]):
                out[i, j] = out[i, j - 1]
                continue
            sums[:], size[:] = 0.0, 0.0
            for k in range(n):
                g = label[i, j, k]
                size[g] += 1
                sums[g, 0] += old[i, k, 2]
                sums[g, 1] += old[i, k, 3]
            total = 0.0
            for k in range(n):
                g = label[i, j, k]
                for d in range(2):
                    velocity = old[i, k, d + 2]
                    if g > 0:
                        velocity = sums[g, d] / size[g]
                    residual[d] = new[i, k, d] - (old[i, k, d] + dt * velocity)
                    residual[d + 2] = new[i, k, d + 2] - old[i, k, d + 2]
                total += log_normal(residual, precision, log_scale)
            out[i, j] = total
