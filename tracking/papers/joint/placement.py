"""The groups of new people: drawn when they are added to the particles (ours; the paper's f adds them alone)."""

from __future__ import annotations

import numpy as np

from tracking.filters.person_streams import Keys, PersonStreams
from tracking.papers.joint import dirichlet_process_kernels
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.decentralised_filter import Nested
from tracking.papers.joint.distributions import PLACING, newest
from tracking.papers.joint.division_kernels import place_newcomers


def place(nested: Nested, config: JointConfig, lag: float, streams: PersonStreams, key: Keys) -> None:
    """Draw in all partitions whether each of the M last people, alone so far, joins a group or person; in place.

    It is the nearest one, joined with the probability of the validity; with the Dirichlet process any one. lag: s, in
    which an event happens. key (M,): of the streams of the new people.
    """
    n, c, people = nested, config, nested.x.shape[1]
    drawn = streams.uniforms(PLACING, key, n.log_q.size, 2).reshape(*n.log_q.shape, len(key), 2)
    if c.partition_dynamics == "dirichlet":
        chance = (np.arange(people) >= people - len(key)).astype(float)
        uniforms = np.zeros((*n.z.shape, 2))
        uniforms[:, :, people - len(key) :] = drawn
        dirichlet_process_kernels.propose(newest(n.x), n.z, chance, uniforms, c.mixture)
        return
    uniforms = np.ascontiguousarray(drawn[..., 0])
    place_newcomers(newest(n.x), n.z, uniforms, c.validity_rate * lag, c.scales)
