"""The groups of new people: drawn when they are added to the particles (ours; the paper's f adds them alone)."""

from __future__ import annotations

import numpy as np

from tracking.papers.joint import dirichlet_process_kernels
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.decentralised_filter import Nested
from tracking.papers.joint.distributions import newest
from tracking.papers.joint.division_kernels import place_newcomers


def place(nested: Nested, new: int, config: JointConfig, lag: float, draws: np.random.Generator) -> None:
    """Draw in all partitions whether each of the `new` last people, alone so far, joins a group or person; in place.

    It is the nearest one, joined with the probability of the validity; with the Dirichlet process any one. lag: s, in
    which an event happens.
    """
    n, c, people = nested, config, nested.x.shape[1]
    if c.partition_dynamics == "dirichlet":
        chance = (np.arange(people) >= people - new).astype(float)
        uniforms = draws.random((*n.z.shape, 2))
        dirichlet_process_kernels.propose(newest(n.x), n.z, chance, uniforms, c.mixture)
        return
    state, uniforms = newest(n.x), np.ascontiguousarray(np.moveaxis(draws.random((new, *n.log_q.shape)), 0, 2))
    place_newcomers(state, n.z, uniforms, c.validity_rate * lag, c.scales)
