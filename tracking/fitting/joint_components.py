"""The Dirichlet process mixture of `joint`, fitted to simulated truth: maximum pseudo-likelihood of true partitions.

The pseudo-likelihood (Besag 1975) of a partition is the product over people of p(label | labels of all others, X), as
cluster_evidence_kernels has it. It needs no sum over all partitions, and its factors are what the Dirichlet process
draws from. Places and velocities have errors as large as those of a particle, as in joint_events.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.rng import rng
from sim.types import Array, Ints, Truth
from tracking.fitting.joint_events import PLACE_ERROR, VELOCITY_ERROR
from tracking.papers.joint.cluster_evidence_kernels import log_conditionals
from tracking.papers.joint.config import MIXTURE, JointConfig, mixture_of
from tracking.papers.joint.partition_kernels import canonical

STRIDE = 1.0
"""Time between two partitions that are looked at, s."""
START = (0.01, 5.0, 0.5, 0.5)
"""Values of MIXTURE from which the search starts."""


@dataclass(frozen=True)
class TruePartition:
    """The people of a frame: state (K, 4): x, y, m, vx, vy, m/s, with errors;"""

    state: Array
    label: Ints  # (K,): as partition_kernels


def true_partitions(truth: Truth, seed: int) -> list[TruePartition]:
    """Returns the true partitions of a simulated sequence, every STRIDE, of two people or more; seed: of the errors."""
    assert truth.pos is not None
    assert truth.vel is not None
    draws, found = rng(seed, "label", 3), []
    spread = np.array([PLACE_ERROR, PLACE_ERROR, VELOCITY_ERROR, VELOCITY_ERROR])
    for frame in range(1, truth.length + 1, max(1, round(STRIDE * truth.fps))):
        rows = truth.rows(frame)
        state = np.concatenate([truth.pos[rows], truth.vel[rows]], axis=1)
        if len(state) > 1:
            label = truth.group[rows] + 1
            canonical(label)
            found.append(TruePartition(state + spread * draws.standard_normal(state.shape), label))
    return found


def component_scores(parts: Sequence[TruePartition], values: dict[str, float]) -> dict[str, float]:
    """Returns scores of a mixture: partitions, people, log_loss per person, and right, the share with p above 1/2."""
    log_p = _log_probabilities(parts, values)
    return {
        "partitions": float(len(parts)),
        "people": float(len(log_p)),
        "log_loss": -float(log_p.mean()),
        "right": float((log_p > math.log(0.5)).mean()),
    }


def fit_components(parts: Sequence[TruePartition]) -> dict[str, float]:
    """Returns the parameters of the mixture by name. Raises InputError if nobody is in a group or everybody in one."""
    from scipy.optimize import minimize

    together = sum(bool(part.label.any()) for part in parts)
    one = sum(bool((part.label == 1).all()) for part in parts)
    if not together or one == len(parts):
        raise InputError(
            place="scenes", got=f"{len(parts)} partitions, {together} with a group, {one} of one group",
            expected="people in groups and others outside", remedy="give more seeds or scenarios with groups",
        )  # fmt: skip

    def loss(logs: Array) -> float:
        return component_scores(parts, dict(zip(MIXTURE, np.exp(logs).tolist(), strict=True)))["log_loss"]

    declared = JointConfig.params()
    ranges = [(math.log(declared[name].low), math.log(declared[name].high)) for name in MIXTURE]
    tolerance = {"xatol": 5e-3, "fatol": 1e-6, "maxiter": 400}
    found = minimize(loss, np.log(START), method="Nelder-Mead", bounds=ranges, options=tolerance)
    return {name: float(f"{value:.4g}") for name, value in zip(MIXTURE, np.exp(found.x).tolist(), strict=True)}


def _log_probabilities(parts: Sequence[TruePartition], values: dict[str, float]) -> Array:
    mixture, found = mixture_of(values), []
    for part in parts:
        out = np.empty(len(part.label))
        log_conditionals(part.state, part.label, mixture, out)
        found.append(out)
    return np.concatenate(found)
