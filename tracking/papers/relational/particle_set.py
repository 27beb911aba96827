"""The particles of `relational`: weights, places, velocities, existence, relations, as arrays over people's slots.

Each person has weights of the own and is resampled alone, so that the weights of many people do not become those of
one particle; the posterior is taken for a product over people (ours). In the paper's filter a particle has one weight.

The relation "walking together" is kept for the pairs only that walk together in some particle, so that the cost is that
of the neighbours. `near_pairs` and `join` choose the pairs (sec. 3.2). The
groups of a particle are the connected components of its related pairs. `transition_kernels` moves people and changes
relations. Arrays are over P particles and K people.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.resampling import residual_resample
from tracking.papers.relational import particle_set_kernels, transition_kernels
from tracking.papers.relational.transition_kernels import belonging

Draws = Callable[[Ints], Array]  # Returns uniforms (R, P) in [0, 1) of the people (R,).
LARGEST = 2**31  # Numbers of slots are below this.
NEGLIGIBLE = 1e-4  # Pairs whose belonging is below this in every particle do not start to walk together.
FAR = 1e-6  # A new person does not join people whose belonging is below this in every particle.


@dataclass
class ParticleSet:
    """P particles over K slots; a slot is one person in all particles (ours), so that means over particles exist.

    count: P. one_weight: whether a particle has one weight. weights (P, K): of the particles, sum 1 for each slot; with
    one weight all columns are equal. pos (P, K, 2): m. vel (P, K, 2): m/s. exist (P, K): probability that the person
    exists, given the particle's path (ours: it is computed, not drawn). pairs (N, 2): people i < j whose relation is
    kept, in order of j, then i; all others do not walk together. related (N, P) bool: in which particles a pair walks
    together.
    """

    count: int
    one_weight: bool
    weights: Array
    pos: Array
    vel: Array
    exist: Array
    pairs: Ints
    related: Bools

    @classmethod
    def empty(cls, count: int) -> ParticleSet:
        """Returns `count` particles without people."""
        flat, two = np.zeros((count, 0)), np.zeros((count, 0, 2))
        pairs, related = np.zeros((0, 2), np.int64), np.zeros((0, count), bool)
        return cls(count, False, flat, two, two.copy(), flat.copy(), pairs, related)

    @property
    def people(self) -> int:
        """Number of slots K."""
        return int(self.pos.shape[1])

    @property
    def existence(self) -> Array:
        """The probability (K,) that each person exists."""
        return particle_set_kernels.column_sums(self.weights, self.exist)

    def estimates(self) -> tuple[Array, Array, Array]:
        """Returns means (K, 4) and covariances (K, 4, 4) of x, y, m, vx, vy, m/s, and the existence (K,)."""
        mean, cov, exist = np.zeros((self.people, 4)), np.zeros((self.people, 4, 4)), np.zeros(self.people)
        particle_set_kernels.moments(self.pos, self.vel, self.exist, self.weights, mean, cov, exist)
        return mean, cov, exist

    def labels(self) -> Ints:
        """Returns a label of each person's group in each particle, (P, K): the lowest slot number in the group."""
        label = np.empty(self.exist.shape, np.int64)
        particle_set_kernels.group_labels(self.pairs, self.related, label)
        return label

    def together(self) -> Array:
        """Returns the probability (K, K) that two people walk together, given that both exist; 1 on the diagonal, 0 for
        a pair that does not exist."""
        i, j = self.pairs.T
        both = (
            self.weights[:, j] * self.exist[:, i] * self.exist[:, j] * (1.0 if self.one_weight else self.weights[:, i])
        )
        total, out = both.sum(axis=0), np.eye(self.people)
        share = np.divide((both * self.related.T).sum(axis=0), total, out=np.zeros(len(i)), where=total > 0)
        out[i, j] = out[j, i] = share
        return out

    def share_weights(self, one_weight: bool) -> None:
        """Switches between one weight per particle, the product of its people's weights (one_weight True), and weights
        of each person alone (False)."""
        if one_weight and not self.one_weight and self.people:
            weights = self.weights.prod(axis=1)
            if not weights.sum() > 0:
                weights = np.ones(self.count)
            self.weights[:] = (weights / weights.sum())[:, None]
        self.one_weight = one_weight or (self.one_weight and bool(np.ptp(self.weights) > 1e-12 / self.count))

    def weigh(self, logs: Array) -> None:
        """Multiplies the weights by likelihoods: logs (P, K), natural, of each person; (P, 1) with one weight."""
        particle_set_kernels.weigh(self.weights, logs)

    def effective(self) -> Array:
        """Returns the effective number of particles of each slot, (K,)."""
        return np.asarray(1 / particle_set_kernels.column_sums(self.weights, self.weights))

    def resample(self, share: float, draws: Draws) -> Ints:
        """Resamples each person whose effective number is at most this share of the particles (sec. 2.1); with one
        weight all people together. Returns who is resampled."""
        few = np.flatnonzero(self.effective() <= share * self.count * (1 + 1e-9))
        if not len(few):
            return few
        uniforms = draws(few)
        chosen = np.empty((self.count, 1 if self.one_weight else len(few)), np.int64)
        for column, person in enumerate(few[: chosen.shape[1]].tolist()):
            weights = np.ascontiguousarray(self.weights[:, person])  # of one column numpy sums in another order
            chosen[:, column] = residual_resample(weights, uniforms[column])
        if self.one_weight:
            for values in (self.pos, self.vel, self.exist):
                values[:] = values[chosen[:, 0]]
            self.related = np.ascontiguousarray(self.related[:, chosen[:, 0]])
        else:
            for values in (self.pos, self.vel, self.exist):
                values[:, few] = values[chosen, few]
            # a relation is drawn with each person alone: particles of both are independent then
            place = np.full(len(self.weights.T), -1)
            place[few] = np.arange(len(few))
            for own in place[self.pairs].T:  # the smaller person comes first
                rows = np.flatnonzero(own >= 0)
                self.related[rows] = np.take_along_axis(self.related[rows], chosen.T[own[rows]], axis=1)
        self.weights[:, few] = 1 / self.count
        return few

    def spread(self, members: Ints, normals: Array) -> None:
        """Draws the particles of members (R,) apart by a kernel of the optimal width, which keeps their moments (ours);
        normals (R, 4, P): standard normals."""
        h = (4 / (self.count * 6)) ** (1 / 8)
        state = np.concatenate([self.pos[:, members], self.vel[:, members]], axis=2)
        state = np.ascontiguousarray(state.transpose(1, 2, 0))
        mean = state.mean(axis=2, keepdims=True)
        apart = state - mean
        values, vectors = np.linalg.eigh(apart @ apart.transpose(0, 2, 1) / self.count)
        root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
        new = (mean + np.sqrt(1 - h * h) * apart + h * (root @ normals)).transpose(2, 0, 1)
        self.pos[:, members], self.vel[:, members] = new[..., :2], new[..., 2:]

    def keep(self, slots: Bools) -> None:
        """Removes all slots except those where `slots` (K,) is True."""
        # np.compress keeps arrays C-contiguous: kernels are compiled once more for another layout
        for name in ("weights", "exist", "pos", "vel"):
            setattr(self, name, np.compress(slots, getattr(self, name), 1))
        rows, number = slots[self.pairs].all(axis=1), np.cumsum(slots) - 1
        self.pairs, self.related = number[self.pairs[rows]], self.related[rows]

    def add(self, pos: Array, vel: Array, exist: float) -> None:
        """Adds M slots with places pos (P, M, 2) and velocities vel (P, M, 2), the same existence in each particle, and
        no relations; their weights are equal, or the particles' one weight."""
        count, k, new = self.count, self.people, pos.shape[1]
        weights = self.weights[:, :1] if self.one_weight and k else np.full((count, 1), 1 / count)
        exists = np.full((count, new), exist)
        added = {"weights": np.repeat(weights, new, axis=1), "pos": pos, "vel": vel, "exist": exists}
        for name, values in added.items():
            setattr(self, name, np.concatenate([getattr(self, name), np.ascontiguousarray(values)], axis=1))

    def hold(self, pairs: Ints) -> None:
        """Keeps relations of further pairs i < j (N', 2), in any order; others do not walk together."""
        kept, further = _order_key(self.pairs), _order_key(pairs)
        key = np.union1d(kept, further)
        related = np.zeros((len(key), self.count), bool)
        related[np.searchsorted(key, kept)] = self.related
        self.pairs, self.related = np.stack([key % LARGEST, key // LARGEST], axis=1), related

    def close_groups(self) -> None:
        """Relates all members of each group, the connected components of a particle's relations, to each other."""
        label, some = self.labels(), np.empty((1, self.people), np.int64)
        ever: Bools = np.asarray(self.related.any(axis=1))
        particle_set_kernels.group_labels(self.pairs, ever[:, None], some)
        self.hold(np.argwhere(np.triu(some == some.T, 1)))
        self.related[:] = transition_kernels.same_group(label, self.pairs)

    def drop_strangers(self) -> None:
        """Keeps no relation of pairs that walk together in no particle."""
        rows = self.related.any(axis=1)
        if not rows.all():
            self.pairs, self.related = self.pairs[rows], self.related[rows]


def _order_key(pairs: Ints) -> Ints:
    return np.asarray(pairs[:, 1] * LARGEST + pairs[:, 0])


@np.errstate(over="ignore")
def near_pairs(pos: Array, rules: Array) -> Ints:
    """Returns the pairs i < j (N, 2) that may start to walk together, in any order.

    pos (P, K, 2), m; rules (4,). Pairs whose boxes round all particles are so far apart that their belonging is below
    NEGLIGIBLE are left out (ours).
    """
    low, high = pos.min(axis=0), pos.max(axis=0)
    apart = np.maximum(np.maximum(low[:, None] - high, low - high[:, None]), 0.0)
    near = belonging(np.sqrt(np.square(apart).sum(axis=2)), 0.0, rules) >= NEGLIGIBLE
    return np.argwhere(np.triu(near, 1))


def join(pos: Array, exist: Array, label: Ints, points: Array, uniforms: Array, rules: Array) -> tuple[Ints, Bools]:
    """Relates M new people, the last slots, to the groups that they join in each particle, one after the other (sec.
    3.2). Returns their pairs (N, 2) and relations (N, P); the groups label (P, K) of the new people are changed.

    pos (P, K, 2), m; exist (P, K): with the new people; points (M, 2), m: where they were detected; uniforms (M, P) in
    [0, 1); rules (4,). With the probability NEWCOMER_SHARE a person joins a group, people alone being groups
    of one; which one is drawn in proportion to the belonging at the distance of the group's nearest member, at equal
    velocities (ours). Where these sum to less than 1, the person is alone with what is missing. People whose belonging
    is below FAR in all particles are left out, so that the cost of a person is that of the neighbours.
    """
    old = label.shape[1] - len(points)
    loss, reach = rules[transition_kernels.DISTANCE], np.log(1 / FAR - 1) + rules[transition_kernels.BIAS]
    near, new = particle_set_kernels.reached(pos, points, (reach / loss) ** 2 if loss > 0 else np.inf).T
    new, near = new[near < old + new], near[near < old + new]
    near, start = near[np.argsort(new, kind="stable")], np.searchsorted(np.sort(new), np.arange(len(points) + 1))
    ever = transition_kernels.join(pos, exist, label, points, near, start, uniforms, rules)
    pairs = np.ascontiguousarray(np.argwhere(ever)[:, ::-1]) + np.array([0, old])
    return pairs, transition_kernels.same_group(label, pairs)
