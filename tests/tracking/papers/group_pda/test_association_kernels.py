"""Associations of `group-pda` beside a slow oracle, and its limit cases: Kalman, the gate's fixed point, merging."""

from __future__ import annotations

import tracemalloc
from collections import Counter
from dataclasses import fields, replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.stats import multivariate_normal, norm

from tests import reference_group_pda as reference
from tracking.filters.components import Constraint
from tracking.grouping.whole_groups import NO_ID
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda.association import PointClaims, place_density, point_log_density, remember
from tracking.papers.group_pda.association_kernels import any_within, displacement
from tracking.papers.group_pda.association_mass_kernels import NEWCOMERS, centroid_noise, log_count, log_density
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import GroupBank, MemberPlaces, Unshared, newborn
from tracking.papers.group_pda.merging_and_splitting import merged
from tracking.papers.group_pda.scaled_parameters import gate_factor, scale_parameters

STATES = ["nothing", "null", "measured"]
PLAIN = reference.Rules(Constraint(1.5, 9.21, 0.09 * np.eye(2), 3.0), 0.06, 0.5, 0.9, True, False)


def positive(r, n, scale=1.0):
    A = r.normal(size=(n, n)) * scale
    return A @ A.T / n + 0.05 * scale**2 * np.eye(n)


def random_rules(r, seed):
    """All options and kinds of association together, one combination after the other."""
    correct, redrawn, every = (bool(seed >> k & 1) for k in range(3))
    constraint = Constraint(
        r.uniform(0.6, 2), r.uniform(6, 14), positive(r, 2, 0.4), r.uniform(0.5, 4), r.choice([0, 1.2])
    )
    return reference.Rules(
        constraint, r.uniform(0.02, 0.3), r.uniform(0.2, 2), r.uniform(0.1, 0.99), correct, redrawn, every,
        float(r.choice([1e-9, 1.0])),
    )  # fmt: skip


def random_groups(r, count):
    x = np.hstack([r.uniform(0, 4, (count, 2)), r.normal(0, 1, (count, 2))])
    P = np.array([positive(r, 4, 0.3) for _ in range(count)])
    extent = np.array([positive(r, 2, r.uniform(0.2, 0.8)) for _ in range(count)])
    return x, P, extent, r.uniform(0.5, 9, count)


def random_case(seed):
    """Up to three groups near each other, up to nine points each, some of them attached to a group; hold."""
    r = np.random.default_rng(seed)
    rules, count = random_rules(r, seed), int(r.integers(1, 4))
    x, P, extent, size = random_groups(r, count)
    of = r.integers(count, size=int(r.integers(0, 9 * count + 1)))
    spread = np.array([np.linalg.cholesky(S) for S in extent])[of]
    points = x[of, :2] + np.einsum("kij,kj->ki", spread, r.normal(0, 1.2, (len(of), 2)))
    weights = r.uniform(0.2, 1.8, len(of)) if r.random() < 0.5 else np.ones(len(of))
    region = np.array([reference.search_region(*group, rules.noise**2) for group in zip(P, extent, strict=True)])
    d2 = kernels.search(points, x, region, rules.constraint.gate)
    hits, own = np.isfinite(d2).sum(0), np.full(len(of), -1)
    free = np.flatnonzero((hits == 0) & (r.random(len(of)) < 0.7))
    own[free], hits[free] = r.integers(count, size=len(free)), 1
    case = points, weights, d2, own, hits, x, P, extent, size, r.random(count) < 0.2
    return rules, case, region


def kernel(case, rules):
    """A copy of the case after the kernel: states, rows chosen, x, P, extent, size."""
    points, weights, d2, own, hits, *groups, hold = case
    after = [a.copy() for a in groups]
    found = kernels.associate(points, weights, d2, np.zeros(d2.shape), own, hits, *after, hold, rules.numbers)
    return [STATES[s] for s in found[0].tolist()], found[1], *after


def test_two_hundred_random_cases() -> None:
    seen = Counter()
    for seed in range(192):
        rules, case, _ = random_case(seed)
        d2, own, hits, *groups = case[2:]
        state, chosen, *after = kernel(case, rules)
        for g in range(len(state)):
            expected = reference.update(g, *case[:5], *(a[g] for a in groups), rules)
            assert state[g] == expected[0], (seed, g)
            assert sorted(np.flatnonzero(chosen[g])) == sorted(expected[1]), (seed, g)
            for found, right in zip(after, expected[2:], strict=True):
                np.testing.assert_allclose(found[g], right, rtol=1e-8, atol=1e-10, err_msg=f"{seed} {g}")
            seen[state[g]] += 1
            seen["moved"] += not np.array_equal(after[2][g], groups[2][g])
            seen["carried"] += bool((own[expected[1]] >= 0).any())
            seen["shared"] += bool(((hits > 1) & np.isfinite(d2[g])).any())
            seen[rules.unconstrained, rules.correct, rules.redrawn] += 1
    assert len([key for key in seen if isinstance(key, tuple)]) == 8
    assert min(seen[k] for k in ("nothing", "null", "measured", "moved", "shared", "carried")) > 5, seen


def kalman(x, P, F, Q):
    f = KalmanFilter(4, 2)
    f.x, f.P, f.F, f.Q, f.H = x[:, None].copy(), P.copy(), F, Q, reference.H
    return f


@pytest.mark.parametrize("redrawn", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_one_group_that_shares_nothing_is_a_kalman_filter(seed: int, redrawn: bool) -> None:
    """E1: x, P are filterpy's on the centroid, extent and size those of (2.4)."""
    r = np.random.default_rng(seed)
    made = scale_parameters(GroupPdaConfig(), 10.0, 1.0)
    rules = replace(PLAIN, redrawn=redrawn, correct=False)
    x, P, extent, size = random_groups(r, 1)
    f = kalman(x[0], P[0], made.F, made.Q)
    for _ in range(50):
        count = int(r.integers(1, 8))
        y = x[0, :2] + r.normal(0, 0.3, (count, 2))
        n, _, S = reference.moments(y, np.ones(count))
        R = reference.centroid_noise(count, S, extent[0], size[0], rules)
        f.update(y.mean(axis=0)[:, None], R=R)
        inside = np.zeros((1, count)), np.full(count, -1), np.ones(count, np.int64)
        c = rules.constraint
        narrow = 0.9 * extent[0] + 0.1 * (n * S + c.strength * c.prior) / (n + c.strength)
        number = 0.9 * size[0] + 0.1 * count
        state, chosen, x, P, extent, size = kernel(
            (y, np.ones(count), *inside, x, P, extent, size, np.zeros(1, bool)), rules
        )
        assert (state, chosen.all()) == (["measured"], True)
        np.testing.assert_allclose(x[0], f.x[:, 0], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(P[0], f.P, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(extent[0], narrow, rtol=1e-12)
        np.testing.assert_allclose(size[0], number, rtol=1e-12)
        f.predict()
        x, P = x @ made.F.T, made.F @ P @ made.F.T + made.Q


@pytest.mark.parametrize("seed", range(4))
def test_masses_sum_to_one(seed: int) -> None:
    """E1: associations that are all alike, as what they share weighs nothing, are as one; so is the sum of masses."""
    r = np.random.default_rng(seed)
    x, P, extent, size = random_groups(r, 1)
    y = x[0, :2] + r.normal(0, 0.2, (12, 2))
    weights = np.where(np.arange(12) < 5, 1.0, 0.0)
    hold = np.zeros(1, bool)
    alone = y[:5], weights[:5], np.zeros((1, 5)), np.full(5, -1), np.ones(5, np.int64), x, P, extent, size, hold
    hits = np.where(np.arange(12) < 5, 1, 2)
    among = y, weights, np.arange(12.0)[None], np.full(12, -1), hits, x, P, extent, size, hold
    for a, b in zip(kernel(alone, PLAIN)[2:], kernel(among, PLAIN)[2:], strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12)


def gaussian(count):
    """Points spread evenly as a Gaussian of covariance I is."""
    k = np.arange(count)
    q, t = np.sqrt(-2 * np.log(1 - (k + 0.5) / count)), k * np.pi * (3 - np.sqrt(5))
    return np.stack([q * np.cos(t), q * np.sin(t)], axis=1)


def settled(gate, correct, frames=120, start=1.0, count=400):
    """Extent and size after so long, when only what the region holds is looked at."""
    points, weights = gaussian(count), np.ones(count)
    constraint = Constraint(10.0, gate, np.eye(2), 0.0)
    rules = replace(PLAIN, constraint=constraint, noise=1e-3, correct=correct)
    x, P, extent, size = np.zeros((1, 4)), 1e-6 * np.eye(4)[None], start * np.eye(2)[None], np.array([float(count)])
    for _ in range(frames):
        region = reference.search_region(P[0], extent[0], rules.noise**2)
        d2 = kernels.search(points, x, region[None], gate)
        case = points, weights, d2, np.full(count, -1), np.ones(count, np.int64)
        state, *_, x, P, extent, size = kernel((*case, x, P, extent, size, np.zeros(1, bool)), rules)
        assert state == ["measured"]
    return np.sqrt(np.linalg.det(extent[0])), size[0] / count


GATES = [
    (5.99, False, 0.715, 1 - np.exp(-0.715 * 5.99 / 2), 0.8),
    (9.21, False, 0.943, 1 - np.exp(-0.943 * 9.21 / 2), 2.0),
    (13.8, False, 0.993, 1.0, 0.8),
    (9.21, True, 1.0, 0.99, 0.8),
    (9.21, True, 1.0, 0.99, 2.0),
]


@pytest.mark.parametrize(("gate", "correct", "extent", "inside", "start"), GATES)
def test_what_the_gate_cuts_off(gate: float, correct: bool, extent: float, inside: float, start: float) -> None:
    """E3: the fixed point of s = c(gate s), or of s = c(gate s) / c(gate), which is 1."""
    found = settled(gate, correct, start=start)
    assert found[0] == pytest.approx(extent, abs=0.02)
    assert found[1] == pytest.approx(inside, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_places_of_missed_members(seed: int) -> None:
    """R of a centroid with carried places: over many frames, in its spread.

    Nine people who keep their places, each seen with probability 0.7; a missed one is where it was last measured.
    """
    r = np.random.default_rng(seed)
    frames, n, noise, measured = 20_000, 9, 0.1, np.zeros((9, 2))
    error, R = np.zeros((frames, 2)), 0.0
    for t in range(frames):
        fresh = (r.random(n) < 0.7) if t else np.ones(n, bool)
        measured[fresh] = r.normal(0, noise, (fresh.sum(), 2))
        error[t] = measured.mean(0)
        extent = np.array([[1.0, 0.0], [0.0, 1.0]])
        R += centroid_noise(n, max(fresh.sum(), 1), np.zeros(3), extent, float(n), replace(PLAIN, noise=noise).numbers)[
            0
        ]
    long = error.reshape(-1, 100, 2).sum(1)  # errors of sums tell what correlated errors amount to
    assert np.var(long) / 100 == pytest.approx(R / frames, rel=0.15)


def bank(**given):
    """Groups, of which only some things are said."""
    n, made = len(given["size"]), GroupBank.empty()
    for f in fields(GroupBank):
        none = getattr(made, f.name)
        nil = [[] for _ in range(n)] if isinstance(none, list) else np.zeros((n, *none.shape[1:]), none.dtype)
        setattr(made, f.name, given.get(f.name, nil))
    one_place = MemberPlaces(np.zeros((1, 2)), np.zeros(1), np.ones(1, bool))
    return replace(made, id=np.arange(n), parent=np.full(n, NO_ID), members=given.get("members", [one_place] * n))


def samples(r, count):
    """Groups of points, and their bank with exact 1/N moments."""
    points = [r.normal(r.uniform(-5, 5, 2), r.uniform(0.2, 2, 2), (int(r.integers(1, 9)), 2)) for _ in range(count)]
    mean = np.array([y.mean(axis=0) for y in points])
    x = np.hstack([mean, r.normal(size=(count, 2))])
    extent = np.array([np.cov(y.T, bias=True).reshape(2, 2) for y in points])
    P = np.array([positive(r, 4) for _ in range(count)])
    members = [MemberPlaces(y - y.mean(0), np.full(len(y), k), np.ones(len(y), bool)) for k, y in enumerate(points)]
    size = np.array([float(len(y)) for y in points])
    born = r.permutation(count).astype(float)
    return points, bank(x=x, P=P, extent=extent, size=size, first_seen=born, members=members)


@pytest.mark.parametrize("seed", range(6))
def test_merging_pools_moments(seed: int) -> None:
    """E2: exactly those of the union, (3.1)."""
    points, groups = samples(np.random.default_rng(seed), 4)
    one = merged(groups, np.arange(4))
    union = np.concatenate(points)
    np.testing.assert_allclose(one.x[0, :2], union.mean(axis=0), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(one.x[0, 2:], np.average(groups.x[:, 2:], axis=0, weights=groups.size), atol=1e-12)
    np.testing.assert_allclose(one.extent[0], np.cov(union.T, bias=True), rtol=1e-12, atol=1e-12)
    assert one.size[0] == len(union)
    place, seen, _ = one.members[0]
    np.testing.assert_allclose(place + one.x[0, :2], union, atol=1e-12)
    assert np.array_equal(seen, np.repeat(np.arange(4.0), [len(y) for y in points]))


def test_whose_a_shared_point_is() -> None:
    """By N_g N(y; xi_g, S_g), so that a large diffuse group has no claim on all that lies near a compact one."""
    for seed in range(100):
        _, case, region = random_case(seed)
        points, _, d2, own, _, x, _, _, size, _ = case
        log_density = point_log_density(size, region, d2, np.zeros(d2.shape))
        may = np.isfinite(log_density) & (np.random.default_rng(seed).random(d2.shape) < 0.8)
        some = np.flatnonzero(may.any(0))
        density = np.exp(np.where(may, log_density, -np.inf))[:, some]
        expected = reference.shares(points, x, region, size, own, may)[:, some]
        np.testing.assert_allclose(density / density.sum(0), expected, rtol=1e-9, atol=1e-12)
    region, d2 = np.array([4.0, 0.25])[:, None, None] * np.eye(2), np.array([[1.0], [1.2]])
    log_density = point_log_density(np.full(2, 2.0), region, d2, np.zeros((2, 1)))
    assert log_density[1] > log_density[0] + 2  # the nearer by d2 is the diffuse one
    colours = point_log_density(np.full(2, 2.0), region, d2, np.array([[2.0], [-2.0]]))
    assert colours[0] > colours[1] + 1


def test_a_shared_point_is_of_the_group_whose_members_walked_there() -> None:
    scaled, points = scale_parameters(GroupPdaConfig(), 10, 1.0), np.array([[0.0, 0.0], [2.0, 0.2]])
    bank = newborn(points, np.ones(2), np.arange(2), scaled, 5.0)
    bank.unshared = [Unshared(5.0, np.array([1 - 2 * k, 0.0]), points[k : k + 1]) for k in range(2)]
    bank.x[:, 2:] *= -1  # of no account: they may have been led astray by shared points
    may = np.ones((2, 2), bool)
    soon, late = (place_density(bank, points + np.array([[t, 0.0], [-t, 0.0]]), may, scaled, 5 + t) for t in (0.5, 2.0))
    assert (np.diag(soon) > 10 * soon[[1, 0], [0, 1]]).all()
    assert late.max() < 0.2 * soon.max()
    many = np.repeat(points, 2_000, 0)
    bank.unshared = [group._replace(points=np.repeat(group.points, 2_000, 0)) for group in bank.unshared]
    tracemalloc.start()
    of_many = place_density(bank, many, np.ones((2, 4_000), bool), scaled, 5.0)
    np.testing.assert_allclose(of_many[:, ::2_000], place_density(bank, points, may, scaled, 5.0))
    assert tracemalloc.get_traced_memory()[1] < 2e7  # bytes; all pairs take more than 1e8
    tracemalloc.stop()


def test_who_comes_into_view_or_is_hidden_does_not_displace_a_group() -> None:
    before, walked = np.array([[0.0, 0.0], [0.6, 0.0], [3.0, 0.0]]), np.array([0.2, 0.1])
    after = np.vstack([before[1::-1] + walked, [[1.4, 0.0], [-2.0, 1.0]]])  # one is hidden, two come
    scaled = scale_parameters(GroupPdaConfig(), 10, 1.0)
    claims = PointClaims(after, np.ones(4), np.full(4, 0.1), np.ones((1, 4)), np.full(4, -1), np.ones(4, int))
    one = newborn(before, np.ones(3), np.zeros(3, int), scaled, 0.0)
    predicted, one.x[0, :2] = one.x[:, :2].copy(), after.mean(0)
    remember(one, claims, np.ones((1, 4), bool), predicted, scaled, 0.1)
    assert one.x[0, :2] + one.anchor[0] - predicted[0] == pytest.approx(walked)


@pytest.mark.parametrize("seed", range(30))
def test_near_is_that_of_all_pairs(seed: int) -> None:
    r = np.random.default_rng(seed)
    place, points = (np.round(r.uniform(0, 5, (int(r.integers(0, 20)), 2)), 1) for _ in range(2))
    reach = float(r.choice([0.05, 0.5, 2.0]))
    squared = np.square(place[:, None] - points).sum(2) <= reach**2
    np.testing.assert_array_equal(any_within(place, points, reach), squared.any(1))


@pytest.mark.parametrize("reach", [0.3, 3.0])
def test_displacement_is_of_mutually_nearest_places(reach: float) -> None:
    before = np.array([[0.0, 0], [4, 0], [4.3, 0]])
    after = np.array([[0.2, 0], [0, 1], [4.5, 0.4]])  # the second is nobody's; the third is of (4.3, 0), not of (4, 0)
    expected = np.array([[0.2, 0], [0.2, 0.4]])[: 1 + (reach > 1)].mean(0)
    walked, known = displacement(before, after, reach)
    np.testing.assert_allclose(walked, expected, atol=1e-12)
    assert known.tolist() == [True, reach > 1, reach > 1]
    assert not any(part.any() for part in displacement(before[:0], after, reach))


def test_gate_factor() -> None:
    for gate in (1.0, 3.0, 6.0, 9.21, 20.0):
        assert gate_factor(gate) == pytest.approx(reference.truncation(gate), rel=1e-12)
    points = gaussian(100_000)
    inside = points[np.square(points).sum(1) < 6.0]
    assert np.var(inside, axis=0) == pytest.approx(gate_factor(6.0), rel=1e-3)


def test_masses_are_densities():
    S, at = np.array([[0.5, 0.2], [0.2, 0.3]]), np.array([0.4, -0.7])
    assert log_density(*at, S[[0, 0, 1], [0, 1, 1]]) == pytest.approx(multivariate_normal([0, 0], S).logpdf(at))
    tail = NEWCOMERS * 6 / (6 + 4) ** 2
    assert np.exp(log_count(4.0, 5.0, 2.0)) == pytest.approx(tail + (1 - NEWCOMERS) * norm(5, np.sqrt(2)).pdf(4))


@pytest.mark.parametrize("scale", [0.1, 1.0, 30.0])
def test_distances_are_known_within_the_search_region(scale):
    r = np.random.default_rng(0)
    region, x = np.array([positive(r, 2, scale) for _ in range(4)]), scale * r.normal(size=(4, 4))
    points = r.normal(0, 3 * scale, (200, 2))
    d2 = np.array([
        [(p - mean[:2]) @ np.linalg.inv(cov) @ (p - mean[:2]) for p in points]
        for mean, cov in zip(x, region, strict=True)
    ])  # fmt: skip
    expected = np.where(d2 < 9.21, d2, np.inf)
    assert 50 < np.isfinite(expected).sum() < 750
    np.testing.assert_allclose(kernels.search(points, x, region, 9.21), expected, rtol=1e-9)
