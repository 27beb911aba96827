"""Partitions: labels, cluster validity, uniform draws, the estimate (companion page, section 4, E5 to E7)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference_joint import all_partitions, label_of, validity
from tracking.grouping.belief import default_belief
from tracking.papers.joint import partition_labels_kernels
from tracking.papers.joint.config import SCALES as OWN_SCALES
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.distributions import FrameModel, stam_cumulated
from tracking.papers.joint.report import histogram_partition
from tracking.papers.joint.tracker import remembered

SCALES = np.array([0.5, 2.0])
PAIRS = np.array([[0, 0], [0.7, 0], [10, 0], [10.7, 0]])


def validities(points, labels, scales=SCALES):
    labels = np.asarray(labels)[None]
    out = np.empty(labels.shape[:2])
    partition_labels_kernels.validities(np.asarray(points, float)[None], labels, scales, out)
    return out[0]


def test_a_label_does_not_depend_on_how_groups_are_called():
    """E5."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        parts = list(all_partitions(5))[rng.integers(52)]
        label = np.zeros(5, np.int64)
        for name, part in zip(rng.permutation(20)[: len(parts)], parts, strict=True):
            label[part] = name + 1
        alone = [p[0] for p in parts if len(p) == 1]
        label[alone] = rng.choice([0, -1, 50], len(alone)) if len(set(alone)) < 2 else 0
        partition_labels_kernels.canonical(label)
        assert label.tolist() == label_of(parts).tolist()


def test_the_validity_is_that_of_the_definition():
    rng = np.random.default_rng(1)
    points, parts = rng.normal(0, 2, (5, 4)), list(all_partitions(5))
    expected = [validity(points, p, *SCALES) for p in parts]
    np.testing.assert_allclose(validities(points, [label_of(p) for p in parts]), expected)


@pytest.mark.parametrize("seed", range(4))
def test_the_validity_of_many_clusters_is_that_of_the_definition(seed):
    """Some of them are wide, so that they matter far away, and one person is far from all."""
    rng = np.random.default_rng(seed)
    points = np.concatenate([rng.uniform(0, 25, (90, 4)), [[400, -300, 0, 0]]])
    order = rng.permutation(90)
    parts = [sorted(order[a:b].tolist()) for a, b in ((0, 9), (9, 12), *((k, k + 1) for k in range(12, 90)))] + [[90]]
    found = validities(points, [label_of(parts)])
    np.testing.assert_allclose(found, validity(points, parts, *SCALES), rtol=1e-12)


@pytest.mark.parametrize(
    "points",
    [PAIRS, [[0, 0], [0.7, 0], [1.4, 0]], [[0, 0], [0.7, 0], [5, 5]]],
    ids=["two pairs", "abreast", "a pair and one"],
)
def test_the_true_partition_is_the_best_of_all(points):
    """E6: strictly better than all alone, all in one, and every other partition."""
    n = len(points)
    true = {4: [[0, 1], [2, 3]], 3: [[0, 1, 2]] if points[2][0] < 5 else [[0, 1], [2]]}[n]
    parts = list(all_partitions(n))
    found = validities(points, [label_of(p) for p in parts])
    ranked = np.argsort(found)
    assert label_of(parts[ranked[0]]).tolist() == label_of(true).tolist()
    assert found[ranked[1]] > 1.3 * found[ranked[0]]


def uniform(people, count):
    label = np.empty((1, count, people), np.int64)
    uniforms = np.random.default_rng(3).random((1, count, people + 1))
    partition_labels_kernels.uniform_partitions(stam_cumulated(people), uniforms, label)
    return label[0]


@pytest.mark.parametrize("people", [1, 12, 500])
def test_numbers_of_boxes_have_stams_probabilities_for_any_number_of_people(people):
    shares = np.diff(stam_cumulated(people), prepend=0.0)
    m = np.arange(1, len(shares) + 1)
    likely = shares[:-1] > 1e-9
    ratio = people * np.log(m[1:] / m[:-1]) - np.log(m[1:])
    assert np.log(shares[1:][likely] / shares[:-1][likely]) == pytest.approx(ratio[likely], abs=1e-5)
    assert shares[-1] < 1e-9


def test_partitions_are_drawn_uniformly():
    """E7: chi-squared of the 15 partitions of 4 people, 14 degrees of freedom; 36.1 is the quantile 0.999."""
    drawn = uniform(4, 60_000)
    expected = len(drawn) / 15
    counts = [int((drawn == label_of(p)).all(axis=1).sum()) for p in all_partitions(4)]
    assert sum(counts) == len(drawn)
    assert sum((n - expected) ** 2 / expected for n in counts) < 36.1


def test_the_histogram_takes_each_persons_label_of_most_weight():
    label = np.array([[[1, 1, 0], [1, 1, 1], [0, 0, 0]]])
    assert [r.tolist() for r in histogram_partition(label, np.array([[0.5, 0.2, 0.3]]))] == [[0, 1]]
    assert [r.tolist() for r in histogram_partition(label, np.array([[0.1, 0.8, 0.1]]))] == [[0, 1, 2]]


def test_pairs_of_a_group_gain_and_others_lose():
    found = remembered(np.zeros((4, 4)), np.array([3, 3, -1, -1]), np.array([1.0, 1.0, 1.0, 0.0]), 0.5)
    stay, come = default_belief().stay / 2, -default_belief().come / 2
    apart = found[np.triu_indices(4, 1)]
    np.testing.assert_allclose(apart, [stay, come, 0, come, 0, 0])
    assert np.array_equal(found, found.T)


def test_the_energy_is_of_beliefs_or_else_of_the_validity():
    """Apart they have less than together where all pairs are believed and near; VAR3 has none."""
    x = np.array([[[0.0, 0, 1, 0], [0.5, 0, 1, 0], [9.0, 9, 0, 0]]])
    z = np.array([[[1, 1, 0], [0, 0, 0]]])  # the first two together, all alone
    belief = np.array([[0, 1.5, -2], [1.5, 0, -1], [-2, -1, 0]])

    def energy(**changes):
        config = JointConfig(**changes)
        return FrameModel(config, 0.2, 0.1, x[0, :, :2], belief, None, np.arange(3)).energy(x, z)[0]

    np.testing.assert_allclose(energy(belief_rate=20.0), [20 * 0.2 * 1.5, 0])
    by_validity = energy(belief_rate=0.0)
    out = np.zeros((1, 2))
    partition_labels_kernels.validities(x, z, OWN_SCALES, out)
    np.testing.assert_allclose(by_validity, -60 * 0.2 * out[0])
    assert by_validity[0] > by_validity[1]
    assert not energy(variant="VAR3").any()
