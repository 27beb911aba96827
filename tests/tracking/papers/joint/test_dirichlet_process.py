"""The Dirichlet process as dynamics of partitions: Gibbs sampling, rates, in the tracker."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Context, Detections, Frame
from tests.reference_joint import all_partitions, label_of, log_evidence
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.dirichlet_process_kernels import propose
from tracking.papers.joint.partition_kernels import canonical
from tracking.papers.joint.tracker import Joint
from tracking.prepare import prepare

C, NU, S, S_V = 0.05, 5.0, 0.5, 0.4
MIXTURE = np.array([np.log(C), NU, S, S_V])
FOUR = np.array([[0, 0, 0.2, 0], [0.8, 0.1, 0, 0.1], [1.4, 0.9, 0.1, 0.3], [2.0, 0.2, -0.3, 0]])


class Chains:
    """Partitions of the same people, drawn again and again: state (K, 4), label (1, count, K)."""

    def __init__(self, state, label, count, seed=0):
        self.state, self.rng = np.asarray(state, float), np.random.default_rng(seed)
        self.label = np.tile(np.asarray(label, np.int64), (1, count, 1))

    def step(self, chance):
        chance = np.broadcast_to(np.asarray(chance, float), len(self.state)).copy()
        uniforms = self.rng.random((*self.label.shape, 2))
        propose(self.state[None], self.label, chance, uniforms, MIXTURE)

    def share(self, label):
        return float((self.label[0] == np.asarray(label)).all(axis=1).mean())


@pytest.mark.parametrize("chance", [1.0, 0.4])
def test_people_who_stand_have_the_partitions_of_the_posterior(chance):
    """Chi-squared of the 15 partitions of 4 people, 14 degrees of freedom; 36.1 is the quantile 0.999."""
    chains = Chains(FOUR, [0, 0, 0, 0], 40_000)
    for _ in range(int(40 / chance)):
        chains.step(chance)
    parts = list(all_partitions(4))
    log_p = np.array([log_evidence(FOUR, p, C, NU, S, S_V) for p in parts])
    posterior = np.exp(log_p - log_p.max()) / np.exp(log_p - log_p.max()).sum()
    assert posterior.min() * 40_000 > 5
    counts = np.array([chains.share(label_of(p)) for p in parts]) * 40_000
    assert counts.sum() == pytest.approx(40_000)
    assert ((counts - posterior * 40_000) ** 2 / (posterior * 40_000)).sum() < 36.1


@pytest.mark.parametrize("fps", [5, 10, 30])
def test_the_rate_of_changes_does_not_depend_on_the_frame_rate(fps):
    """Two people far from each other part as soon as one of the two is redrawn: after 1 s with 1 - exp(-2 rate)."""
    config = JointConfig(redraw_rate=0.6)
    chains = Chains([[0, 0, 0, 0], [30, 0, 0, 0]], [1, 1], 40_000)
    for _ in range(fps):
        chains.step(-np.expm1(-config.redraw_rate / fps))
    assert chains.share([1, 1]) == pytest.approx(np.exp(-1.2), abs=0.012)


def test_nobody_changes_at_chance_zero():
    chains = Chains(FOUR, [1, 1, 0, 0], 50)
    chains.step(0.0)
    assert chains.share([1, 1, 0, 0]) == 1


def test_labels_keep_their_form():
    rng = np.random.default_rng(3)
    chains = Chains(rng.normal(0, 1, (7, 4)), [1, 1, 1, 0, 5, 5, 0], 200)
    for _ in range(10):
        chains.state += rng.normal(0, 0.1, (7, 4))
        chains.step(0.5)
    for label in chains.label[0]:
        named = label.copy()
        canonical(named)
        assert np.array_equal(named, label)


def test_the_order_of_people_does_not_matter():
    order = np.array([2, 0, 3, 1])
    first, second = Chains(FOUR, [0, 0, 0, 0], 40_000), Chains(FOUR[order], [0, 0, 0, 0], 40_000, seed=1)
    for _ in range(20):
        first.step(0.5)
        second.step(0.5)
    for p in all_partitions(4):
        moved = [sorted(int(np.flatnonzero(order == k)[0]) for k in part) for part in p]
        assert first.share(label_of(p)) == pytest.approx(second.share(label_of(moved)), abs=0.015)


@pytest.mark.parametrize("newcomers", ["validity", "alone"])
def test_the_tracker_follows_groups_with_the_process(newcomers):
    """People come and go; labels keep their form; groups are found."""
    scene = simulate(load("merge", ["camera.fps=5", "duration=10"]), 40_003, 0, ())
    params = {
        "partition_dynamics": "dirichlet", "validity": "bayesian", "belief_rate": 0.0, "newcomers": newcomers,
        "particles": 15, "partitions": 15,
    }  # fmt: skip
    ready = prepare("joint", scene, detections="file", params=params)
    ready.reset(0)
    groups = 0
    for frame in ready.frames():
        groups += (ready.step(frame).group >= 0).sum()
        nested = ready.tracker.nested
        for label in nested.z[:, 0]:
            named = label.copy()
            canonical(named)
            assert np.array_equal(named, label)
    assert groups > 20


def test_a_newcomer_beside_a_pair_joins_by_the_process():
    """In the first frame of a third person; near the pair it is in their group in many partitions, else in none."""
    config = JointConfig(partition_dynamics="dirichlet", redraw_rate=0.05, confirm_time=0.0, speed_prior=0.2)
    together = {}
    for where in (0.6, 8.0):
        tracker = Joint(config)
        tracker.reset(Context(10.0, float("nan")), 0)
        for k in range(1, 12):
            points = np.array([[0, 0], [0.6, 0], [0.3, where]])[: 2 if k < 11 else 3]
            found = Detections(k, (k - 1) / 10, "ground", points, None, None, np.ones(len(points)))
            tracker.step(Frame(k, (k - 1) / 10), found)
        label = tracker.nested.z
        together[where] = float(((label[..., 2] > 0) & (label[..., 2] == label[..., 0])).mean())
    assert together[0.6] > 0.4
    assert together[8.0] < 0.05
