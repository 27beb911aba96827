"""Kernels of blob's tracks beside tables of all pairs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from tracking.filters import existence, kalman
from tracking.papers.blob import tracked_people_kernels as kernels

VIEW = np.array([[0.0, 0.0], [300.0, 200.0]])


def boxes_of(r, n):
    return np.column_stack([r.uniform(0, VIEW[1], (n, 2)), r.uniform(20, 90, (n, 2))])


def shares(boxes, others):
    """(N, M): of each box that lies in each of the others."""
    shared = 1.0
    for centre, side in ((0, 3), (1, 2)):
        ends = [(b[:, centre] - b[:, side] / 2, b[:, centre] + b[:, side] / 2) for b in (boxes, others)]
        (low, high), (other_low, other_high) = ends
        shared = shared * (np.minimum(high[:, None], other_high) - np.maximum(low[:, None], other_low)).clip(0)
    return shared / boxes[:, 2:].prod(1)[:, None]


@pytest.mark.parametrize("n", [0, 1, 12])
def test_shares_of_boxes_that_others_cover(n):
    r = np.random.default_rng(n)
    boxes, others = boxes_of(r, n), boxes_of(r, 7)
    assert kernels.covered_shares(boxes, others) == pytest.approx(shares(boxes, others))


@pytest.mark.parametrize("seed", range(4))
def test_whoever_stands_in_front_hides(seed):
    r = np.random.default_rng(seed)
    boxes, scale, person, var = boxes_of(r, 15), r.uniform(20, 60, 15), r.random(15), r.uniform(0.01, 1, (15, 4))
    foot = boxes[:, 1] + boxes[:, 2] / 2
    in_front = foot - foot[:, None] > 0.15 * scale[:, None]
    hidden = np.where(in_front, shares(boxes, boxes) * person, 0).max(1) * erf(0.35 / np.sqrt(2 * var[:, 0]))
    assert (hidden > 0).any()
    assert kernels.visible_shares(boxes, scale, person, var) == pytest.approx(1 - hidden)


@pytest.mark.parametrize("earlier", [False, True])
def test_second_boxes_are_near_their_owners(earlier):
    r = np.random.default_rng(1)
    boxes, scale, owned = boxes_of(r, 30), r.uniform(20, 100, 30), r.random(30) * (r.random(30) < 0.8)
    d2 = np.square((boxes[:, None] - boxes) / (0.3 * scale[:, None])).sum(2)
    known = np.exp(-d2 / 2) * owned / np.square(scale) * (np.tri(30, k=-1) if earlier else 1.0)
    total = np.ones(30)
    kernels.add_doubles(total, boxes, boxes, scale, owned, earlier)
    assert total == pytest.approx(1 + known.sum(1), rel=1e-12)


def test_a_pair_costs_less_the_likelier_it_is():
    r = np.random.default_rng(2)
    rows, p, states = np.array([0, 0, 2]), np.array([0.9, 0.5, 0.3]), r.dirichlet(np.ones(4), 3).T[:3]
    evidence, ratio = r.normal(0, 2, 3), np.exp(r.normal(0, 2, 3))
    shown, false = states[existence.SHOWN, rows], states[existence.FALSE, rows]
    measured, missed = p[rows] * (shown * ratio + false) * np.exp(evidence), 1 - p[rows] * (shown + false)
    cost = kernels.pair_costs(rows, evidence, ratio, 0.4, p, states)
    assert cost == pytest.approx(np.log(missed * (1 + 0.4 * ratio) / measured))
    assert kernels.pair_costs(rows, evidence, ratio, 0.4, np.zeros(3), states).tolist() == [np.inf] * 3


@pytest.mark.parametrize("seed", range(4))
def test_who_leaves_the_view_or_may_be_elsewhere_is_not_reported_while_missed(seed):
    r = np.random.default_rng(seed)
    boxes, bank, person, measured = boxes_of(r, 200), r.normal(0, 3, (5, 200, 4)), r.random(200), r.random(200) < 0.5
    bank[kalman.VAR] = r.uniform(0.01, 0.3, (200, 4))
    half, rate = boxes[:, 3:1:-1] / 2, bank[kalman.RATE, :, :2]
    low, high = boxes[:, :2] - half < VIEW[0], boxes[:, :2] + half > VIEW[1]
    leaves = ((low & (rate < 0)) | (high & (rate > 0))).any(1)
    right = np.where(measured, 1.0, erf(0.35 / np.sqrt(2 * bank[kalman.VAR, :, 0])))
    expected = (person * right >= 0.5) & (measured | ~leaves)
    assert (leaves & ~measured & (person * right >= 0.5)).any()
    assert kernels.reported(boxes, bank, person, measured, VIEW).tolist() == expected.tolist()
