"""Which people may start to walk together in `relational`, and the relations of new people (sec. 3.2).

Arrays are over P particles and K people. The relation "walking together" is kept for the pairs only that walk together
in some particle, so that the cost is that of the neighbours: pairs (N, 2) are people i < j, in order of j, then i, and
related (N, P) says in which particles. The groups of a particle are the connected components of its related pairs.
`transition_kernels` moves people and changes relations.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.relational import transition_kernels
from tracking.papers.relational.transition_kernels import belonging

NEGLIGIBLE = 1e-4  # Pairs whose belonging is below this in every particle do not start to walk together.
FAR = 1e-6  # A new person does not join people whose belonging is below this in every particle.


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


@np.errstate(over="ignore")
def join(
    pos: Array, exist: Array, label: Ints, points: Array, share: float, uniforms: Array, rules: Array
) -> tuple[Ints, Bools]:
    """Relate M new people, the last slots, to the groups that they join in each particle, one after the other (sec.
    3.2). Return their pairs (N, 2) and relations (N, P); the groups label (P, K) of the new people are changed.

    pos (P, K, 2), m; exist (P, K): with the new people; points (M, 2), m: where they were detected; uniforms (M, P) in
    [0, 1); rules (4,). With the probability `share` (the paper: 1/2) a person joins a group, people alone being groups
    of one; which one is drawn in proportion to the belonging at the distance of the group's nearest member, at equal
    velocities (ours). Where these sum to less than 1, the person is alone with what is missing. People whose belonging
    is below FAR in all particles are left out, so that the cost of a person is that of the neighbours.
    """
    particles, n = label.shape
    low, high = pos.min(axis=0), pos.max(axis=0)
    apart = np.maximum(np.maximum(low - points[:, None], points[:, None] - high), 0.0)
    near = belonging(np.sqrt(np.square(apart).sum(axis=2)), 0.0, rules) >= FAR
    near &= np.arange(n) < np.arange(n - len(points), n)[:, None]
    some, ends = np.nonzero(near)[1], near.sum(axis=1).cumsum()
    found = transition_kernels.join(pos, exist, label, points, some, ends, share, uniforms, rules)
    new, other, particle = found.reshape(-1, 3).T
    kept, row = np.zeros(near.shape, bool), np.empty(near.shape, np.int64)
    kept[new, other] = True
    new_one, old_one = np.nonzero(kept)
    row[kept] = np.arange(len(new_one))
    related = np.zeros((len(new_one), particles), bool)
    related[row[new, other], particle] = True
    return np.stack([old_one, new_one + n - len(points)], axis=1), related
