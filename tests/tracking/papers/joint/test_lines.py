"""Lines of people: queues are lines, circles of conversing groups and groups that walk abreast are none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference_joint import all_partitions, label_of, line_of_group
from tracking.papers.joint import line_kernels


def standing(pos, velocity=(0.0, 0.0)):
    pos = np.asarray(pos, float)
    return np.concatenate([pos, np.tile(np.asarray(velocity, float), (len(pos), 1))], axis=1)


def queue(n, velocity=(0.0, 0.0)):
    return standing([[0.8 * k, 0.0] for k in range(n)], velocity)


def circle(n, spacing=0.8):
    angle = 2 * np.pi * np.arange(n) / n
    return standing(spacing / 2 / np.sin(np.pi / n) * np.column_stack([np.cos(angle), np.sin(angle)]))


def pairs(state):
    out = np.empty((len(state), len(state)))
    line_kernels.lines_of(state, out)
    return out


def whole(state):
    return line_kernels.line_of(state, pairs(state), np.zeros(len(state), np.int64), 0, 0)


@pytest.mark.parametrize("n", [3, 4, 5, 8])
def test_a_queue_is_a_line_and_a_circle_is_none(n):
    assert whole(queue(n)) == pytest.approx(1)
    assert whole(queue(n, (0.5, 0.0))) == pytest.approx(1)
    assert whole(circle(n)) == 0


def test_who_walks_abreast_is_in_no_line():
    assert whole(queue(3, (0.0, 1.0))) < 0.01
    assert pairs(queue(3, (0.0, 1.0))).max() < 0.01


def test_a_pair_is_in_a_line_with_a_third_person_of_any_group_who_is_near_and_alike():
    near, far = standing([[0, 0], [0.8, 0], [1.6, 0]]), standing([[0, 0], [0.8, 0], [2.4, 0]])
    assert pairs(near)[0, 1] == pairs(near)[1, 2] == pairs(near)[0, 2] == pytest.approx(1)
    assert not pairs(far).any()
    assert not pairs(near[:2]).any()
    walking = near.copy()
    walking[2, 2] = 1.5
    assert pairs(walking)[0, 1] < 0.3


def test_lines_turn_with_the_scene_and_do_not_depend_on_the_order():
    rng = np.random.default_rng(0)
    state = queue(5, (0.2, 0.1)) + rng.normal(0, 0.05, (5, 4))
    turn = np.array([[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]])
    turned, order = state @ np.kron(np.eye(2), turn.T), rng.permutation(5)
    np.testing.assert_allclose(pairs(turned), pairs(state))
    np.testing.assert_allclose(pairs(state[order]), pairs(state)[np.ix_(order, order)])
    assert whole(turned) == pytest.approx(whole(state))
    assert 0 < whole(state[order]) == pytest.approx(whole(state))


def test_people_in_lines_are_counted_in_every_partition():
    rng = np.random.default_rng(1)
    state = np.array([queue(4) + rng.normal(0, 0.06, (4, 4)) for _ in range(2)])
    parts = list(all_partitions(4))
    label = np.array([[label_of(p) for p in parts]] * 2)
    line, out = np.empty((2, 4, 4)), np.empty(label.shape[:2])
    line_kernels.lines(state, line)
    line_kernels.people_in_lines(state, line, label, out)
    for i in range(2):
        for found, part in zip(out[i], parts, strict=True):
            expected = 0.0
            for p in part:
                two = line[i, p[0], p[-1]] if len(p) == 2 else 0.0
                expected += len(p) * (line_of_group(state[i, p]) if len(p) > 2 else two)
            assert found == pytest.approx(expected)
