"""Limits and closed forms of `relational` and `particle` (companion page, section 3, E1 and E4 to E9)."""

from __future__ import annotations

import dataclasses
from itertools import islice

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Context, Frame
from tests.point_frames import detections, stepped
from tests.reference_relational import drawn, relate, relations
from tests.tracking.papers.relational.test_particle_set import sight
from tracking.filters.person_streams import birth_keys
from tracking.grouping.belief import UNSEEN
from tracking.papers.relational import particle_set, sensor, transition_kernels
from tracking.papers.relational.config import ParticleConfig, RelationalConfig
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.tracker import Particle, Relational
from tracking.running.prepare import prepare

# The paper's rule: partners count fully.
ALWAYS = np.array([0.0, np.inf, 0.0, 0.0])
# The paper's coupling: members of a group have its mean velocity, and noise of their own.
AT_ONCE = np.array([1.0, 0.0])
CERTAIN = {"detect_prob": 1.0, "clutter_density": 0.0}


def flat_table(diffusion):
    """A speed table without drift and with one diffusion."""
    return {"drift": [0.0] * 5, "diffusion": [diffusion] * 5, "noise_scale": 1.0}


def move(particles, noise, table, coupling, dt, shared=None, alike=ALWAYS, spread=0.0):
    """Move the particles by a step of dt s; spread: of the squares of distances and velocity differences."""
    p, shared = particles, np.zeros(noise.shape) if shared is None else shared
    spread = np.full(p.pairs.shape, spread)
    transition_kernels.move(
        p.pos, p.vel, p.exist, p.pairs, p.related, noise, shared, table, coupling, alike, spread, dt
    )  # fmt: skip


def first(sequence, length):
    """The first frames of a sequence."""
    return dataclasses.replace(sequence, frames=lambda: islice(sequence.frames(), length), bare=None, length=length)


def placed(count, pos, vel=None, exist=1.0):
    """`count` equal particles of people at pos (K, 2) with velocities vel (K, 2)."""
    pos = np.asarray(pos, float)
    vel = np.zeros_like(pos) if vel is None else np.asarray(vel, float)
    made = ParticleSet.empty(count)
    for place, velocity in zip(pos, vel, strict=True):
        made.add(np.tile(place, (count, 1))[:, None], np.tile(velocity, (count, 1))[:, None], exist)
    return made


def seat(tracker, particles):
    """Gives the tracker these people, who have not been measured in the last frame."""
    tracker.particles = particles
    k = particles.people
    unknown, key = np.full((k, 2), np.nan), birth_keys(np.zeros((k, 2)), 1)
    tracker.slots.extend(id=np.full(k, -1), missed=np.zeros(k), seen=np.zeros(k, bool), size=unknown, key=key)


# E1


def kalman(points, r, speed, spread, dt):
    """The exact filter of one coordinate: places after each frame; the first one starts it."""
    x, P = np.array([points[0], 0.0]), np.diag([r * r, speed * speed])
    A, G = np.array([[1, dt], [0, 1.0]]), np.array([dt, 1.0]) * spread
    out = [x[0]]
    for z in points[1:]:
        x, P = A @ x, A @ P @ A.T + np.outer(G, G)
        K = P[:, 0] / (P[0, 0] + r * r)
        x, P = x + K * (z - x[0]), P - np.outer(K, P[0])
        out.append(x[0])
    return np.array(out)


def test_one_person_converges_to_the_kalman_filter(monkeypatch):
    """The error of the mean falls as the root of the number of particles (E1)."""
    rng, fps, frames = np.random.default_rng(5), 10.0, 12
    points = np.cumsum(rng.normal(0.1, 0.03, (frames, 2)), axis=0)
    monkeypatch.setattr("tracking.papers.relational.tracker.SPEED_PRIOR", 0.8)
    config = ParticleConfig(**CERTAIN, **flat_table(0.5), point_noise=0.1)
    true = np.stack([kalman(points[:, d], 0.1, 0.8, 0.5 * fps**-0.5, 1 / fps) for d in (0, 1)], axis=1)
    counts, errors = [500, 2000, 8000], []
    for count in counts:
        tracker = Particle(dataclasses.replace(config, particles=count))
        runs = [stepped(tracker, [[p] for p in points], s) for s in range(8)]
        means = np.array([[t.pos[0] for t in run] for run in runs])
        errors.append(np.sqrt(np.mean((means - true)[:, 2:] ** 2)))
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.1)
    assert errors[-1] < 0.004


# E4


def same_tracks(first, second):
    for a, b in zip(first, second, strict=True):
        assert a.id.tolist() == b.id.tolist()
        assert a.pos.tobytes() == b.pos.tobytes()
        assert a.vel.tobytes() == b.vel.tobytes()
        assert a.cov.tobytes() == b.cov.tobytes()


def test_without_relations_it_is_the_baseline_to_the_last_bit():
    """Relations are drawn from streams of their own (E4)."""
    scene = simulate(load("cross", ["camera.fps=5", "duration=5"]), 40_002, 0, ())
    runs = []
    for name, params in (("particle", {}), ("relational", {"relation_evidence": "state", "relation_bias": -40.0})):
        ready = prepare(name, scene, detections="file", params={"particles": 200} | params)
        ready.reset(3)
        runs.append([ready.step(frame) for frame in ready.frames()])
    assert max(len(t.id) for t in runs[0]) > 3
    same_tracks(*runs)


# E5


def riccati(r, steps=400):
    """The stationary variance of a hidden partner's velocity, per axis: exact, C = 1, steps of 1 s, noise r."""
    A = np.array([[1, 0.5, 0.5], [0, 0.5, 0.5], [0, 0.5, 0.5]])  # x1, v1, v2
    G = np.array([[1, 0], [1, 0], [0, 1.0]])
    P = np.diag([r * r, 1.0, 1.0])
    for _ in range(steps):
        P = A @ P @ A.T + G @ G.T
        K = P[:, 0] / (P[0, 0] + r * r)
        P = P - np.outer(K, P[0])
    return P[2, 2]


def hidden_variance(related, seen, steps, count=20_000, r=0.4):
    """The velocity variance of person 2, per axis, by frame; person 1 is measured where `seen`."""
    config = ParticleConfig(**flat_table(1.0), point_noise=r, clutter_density=1e-6)
    rng, particles, out = np.random.default_rng(1), placed(count, [[0, 0], [5, 0]]), []
    relate(particles, 0, 1, related)
    truth, velocity = np.zeros(2), np.zeros(2)
    for _ in range(steps):
        move(particles, rng.standard_normal((count, 2, 2)), config.speed_table(1.0), AT_ONCE, 1.0)
        velocity = 0.7 * velocity + rng.standard_normal(2)
        truth = truth + velocity
        points = (truth + r * rng.standard_normal(2))[None] if seen else np.zeros((0, 2))
        particles.pos[:, 1] = 1e6  # never near the detection
        if seen:
            sensor.weigh(particles, points, *sight([0.9, 0.0], [False, True]), r, config)
            particles.resample(1.0, drawn(particles, rng))
        out.append(particles.vel[:, 1].var(axis=0).mean())
    return np.array(out)


def test_a_hidden_partner_has_a_bounded_velocity_variance():
    """(sqrt 5 - 1) C^2 as the noise of the visible one falls; information flows from the seen to the hidden (E5)."""
    found = hidden_variance(True, True, 60)[15:]
    assert found.mean() == pytest.approx(riccati(0.4), rel=0.03)
    assert found.mean() < 4 / 3 * 0.97


# E6


def test_without_information_weights_stay_and_people_go_straight_on():
    tracker = Relational(RelationalConfig(**flat_table(1e-6)))
    walk = [[(0.1 * k, 0.0), (0.1 * k, 1.0)] for k in range(15)]
    before = stepped(tracker, walk)[-1]
    tracker.particles.weights = np.random.default_rng(0).dirichlet(np.ones(tracker.particles.count), 2).T.copy()
    weights = tracker.particles.weights.copy()
    first = tracker.step(Frame(16, 1.5), None)
    second = tracker.step(Frame(17, 1.6), None)
    assert np.array_equal(tracker.particles.weights, weights)
    assert first.id.tolist() == second.id.tolist() == before.id.tolist()
    np.testing.assert_allclose(second.pos, first.pos + 0.1 * second.vel, atol=1e-3)


@pytest.mark.parametrize("kind", [Particle, Relational])
def test_who_is_only_predicted_is_not_seen(kind):
    tracks = stepped(kind(), [*[[(0, 0), (9, 0)]] * 5, None, [(0, 0)], [(0, 0), (9, 0)]])
    assert [t.seen.tolist() for t in tracks[4:]] == [[True, True], [False, False], [True, False], [True, True]]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("apart", "least", "most"), [(9.0, 8, 8), (0.7, 18, 21)])
def test_a_missed_person_is_reported_while_probably_there_and_longer_beside_a_partner(apart, least, most, seed):
    """For m s while exp(-m / 0.3), hidden once a second, is above a / 15, gone once in 15 s. a is the share of
    particles without a seen partner: 1 if alone, up to m = 0.81 s, and 1.8 s if it is below 0.037."""
    walk = [[(0.1 * k, 0.0), (0.1 * k, apart)] for k in range(51)]
    tracker = Relational()
    tracks = stepped(tracker, [*walk[:30], *[people[:1] for people in walk[30:50]], None, walk[50]], seed)
    reported = [len(t.id) for t in tracks[30:51]]
    frames = reported.count(2)
    assert least <= frames <= most
    assert reported == [2] * frames + [1] * (21 - frames)
    assert tracks[51].id.tolist() == tracks[29].id.tolist()
    tracker.slots.missed[0], tracker.slots.seen[:] = 2.0, False  # the partner is behind something in all particles
    assert tracker._stayed()[0] < 0.1


@pytest.mark.parametrize("fps", [4, 10, 25])
def test_missed_people_are_reported_for_one_time_at_all_frame_rates(fps):
    tracks = stepped(Relational(), [[(k / fps, 0.0)] for k in range(3 * fps)] + [[]] * (2 * fps), fps=fps)
    assert sum(len(t.id) for t in tracks[3 * fps :]) == int(0.3 * np.log(15) * fps)


@pytest.mark.parametrize("detect", [np.zeros(2), np.full(2, 0.9)])
def test_people_who_are_equal_in_all_particles_change_no_weight(detect):
    particles = placed(50, [[0, 0], [3, 0]])
    sensor.weigh(particles, np.zeros((0, 2)), *sight(detect), 0.08, ParticleConfig())
    np.testing.assert_allclose(particles.weights, 1 / 50, rtol=1e-12)


def joined_by(particles, label, points, uniforms, rules):
    """Relates the new people, the last slots, to the groups that they join."""
    pairs, related = particle_set.join(particles.pos, particles.exist, label, points, uniforms, rules)
    particles.hold(pairs)
    particles.related[len(particles.pairs) - len(pairs) :] = related
    assert np.array_equal(particles.pairs[len(particles.pairs) - len(pairs) :], pairs)


def test_a_newcomer_in_an_empty_scene_is_alone_and_beside_a_group_in_it_by_half():
    """Sec. 3.2; far from all groups a newcomer is alone (ours)."""
    rules, count = np.array([0.05, 12.0, 3.0, 3.0]), 20_000
    u = np.random.default_rng(0).random(count)

    def joined(pos, related=()):
        particles = placed(count, np.array(pos).reshape(-1, 2))
        for i, j in related:
            relate(particles, i, j)
        place = np.array([[0.0, 0.5]])
        particles.add(np.tile(place, (count, 1))[:, None], np.zeros((count, 1, 2)), 1.0)
        label = particles.labels()
        joined_by(particles, label, place, u[None], rules)
        assert np.array_equal(label, particles.labels())
        group = np.where(label[:, -1] == len(pos), -1, label[:, -1])
        return [float((group == g).mean()) for g in range(-1, len(pos))]

    assert joined([]) == [1.0]
    assert joined([[0, 0]]) == pytest.approx([0.5, 0.5], abs=0.01)
    assert joined([[0, 0], [1, 0]], [(0, 1)]) == pytest.approx([0.5, 0.5, 0], abs=0.01)
    assert joined([[0, 0], [0, 1]]) == pytest.approx([0.5, 0.25, 0.25], abs=0.01)
    assert joined([[0, 30]]) == pytest.approx([1, 0], abs=0.01)


# E7


def reconsidered(particles, rules, rng):
    particles.hold(particle_set.near_pairs(particles.pos, rules))
    uniforms = rng.random((particles.count, particles.people, 2))
    odds = np.full(len(particles.pairs), rules[transition_kernels.BIAS])
    related = particles.related
    transition_kernels.relate(particles.pos, particles.vel, particles.pairs, related, odds, uniforms, rules)


def test_a_pairs_relation_approaches_its_equilibrium_at_its_rate():
    rules = np.array([-np.expm1(-0.5 * 0.1), 1.0, 1.0, 0.0])
    particles = placed(40_000, [[0, 0], [0.5, 0]])
    g, rng = 1 / (1 + np.exp(0.5 - 1.0)), np.random.default_rng(0)
    for step in range(1, 21):
        reconsidered(particles, rules, rng)
        assert relations(particles)[:, 0, 1].mean() == pytest.approx(g * (1 - np.exp(-0.05 * step)), abs=0.012)


# E8


def test_with_the_papers_sensor_a_person_who_jumps_is_a_new_one():
    """No particle explains the detection, so that a float has no weight for it; the other person stays (E8)."""
    walk = [[(0.1 * k, 0.0), (0.1 * k, 5.0)] for k in range(10)]
    walk += [[(60.0 + 0.1 * k, 0.0), (1.0 + 0.1 * k, 5.0)] for k in range(35)]
    before, *_, last = stepped(Particle(ParticleConfig(**CERTAIN, noise_scale=1.0)), walk)[9:]
    assert len(before.id) == len(last.id) == 2
    assert len(set(before.id.tolist()) & set(last.id.tolist())) == 1
    np.testing.assert_allclose(np.sort(last.pos[:, 0]), [4.4, 63.4], atol=0.2)


# E9


@pytest.mark.parametrize("related", [False, True])
@pytest.mark.parametrize("time", [0.0, 0.4])
def test_diffusion_is_that_of_any_frame_rate(related, time):
    spreads = []
    for fps in (25.0, 12.5):
        particles, rng = placed(20_000, [[0, 0], [1, 0]], [[1, 0], [1, 0]]), np.random.default_rng(3)
        relate(particles, 0, 1, related)
        coupling = np.array([1 - np.exp(-1 / (fps * time)), 0.5]) if time else AT_ONCE
        for _ in range(round(fps)):
            noise, shared = rng.standard_normal((2, 20_000, 2, 2))
            move(particles, noise, ParticleConfig().speed_table(1 / fps), coupling, 1 / fps, shared)
        mean = particles.vel.mean(axis=1) if related else particles.vel[:, 0]
        place = particles.pos.mean(axis=1) if related else particles.pos[:, 0]
        spreads.append([mean.std(axis=0).mean(), place.std(axis=0).mean()])
    np.testing.assert_allclose(spreads[0], spreads[1], rtol=0.05)


def test_velocities_of_partners_approach_each_other_with_the_time_constant():
    """Their difference falls by e in coupling_time, at any frame rate, and the mean stays; a person alone goes on."""
    for fps in (10.0, 40.0):
        particles = placed(1, [[0, 0], [0, 1], [9, 9]], [[2, 0], [0, 1], [1, 1]])
        relate(particles, 0, 1)
        coupling = np.array([1 - np.exp(-1 / (fps * 0.5)), 0.5])
        for _ in range(round(0.5 * fps)):
            move(particles, np.zeros((1, 3, 2)), ParticleConfig(**flat_table(0.0)).speed_table(1.0), coupling, 1 / fps)
        a, b, alone = particles.vel[0]
        np.testing.assert_allclose(a - b, np.array([2, -1]) / np.e, rtol=1e-12)
        np.testing.assert_allclose((a + b) / 2, [1, 0.5], rtol=1e-12)
        assert alone.tolist() == [1, 1]


def test_all_members_of_a_particles_group_have_its_mean_velocity():
    """Sec. 3.2; also those who are related by way of others, and in each particle by its own relations."""
    particles = placed(3, [[0, 0], [0, 1], [0, 2], [0, 9]], [[3, 0], [0, 0], [0, 3], [1, 1]])
    relate(particles, 0, 1, np.array([True, True, False]))
    relate(particles, 1, 2, np.array([True, False, False]))
    particles.close_groups()
    assert particles.pairs.tolist() == [[0, 1], [0, 2], [1, 2]]
    move(particles, np.zeros((3, 4, 2)), ParticleConfig(**flat_table(0.0)).speed_table(1.0), AT_ONCE, 1.0)
    expected = np.array([
        [[1, 1], [1, 1], [1, 1], [1, 1]], [[1.5, 0], [1.5, 0], [0, 3], [1, 1]], [[3, 0], [0, 0], [0, 3], [1, 1]],
    ])  # fmt: skip
    np.testing.assert_allclose(particles.vel, expected, rtol=1e-12)


def test_the_preset_keeps_groups_closed():
    """No member of a group is related to a part of it alone, after each frame."""
    scene = simulate(load("queue", ["camera.fps=5"]), 40_002, 0, ())
    config = RelationalConfig.load("paper").with_set("particles=100")
    ready = prepare("relational", first(scene, 40), detections="file", params=config)
    ready.reset(0)
    largest = 0
    for frame in ready.frames():
        ready.step(frame)
        made = relations(ready.tracker.particles)
        closed = made | np.eye(made.shape[1], dtype=bool)
        steps = closed.astype(int) @ closed.astype(int) > 0
        assert np.array_equal(steps, closed)
        largest = max(largest, int(closed.sum(axis=2).max(initial=0)))
    assert largest > 2


def test_partners_count_by_how_alike_they_are():
    """A partner 1 m away with a velocity difference of 1 m/s has the weight w = 1 / (1 + e^2) in the mean, and the
    noises of both have the correlation 2 c w / (1 + w^2), c = common_noise w."""
    alike, w = np.array([0.0, 3.0, 2.0, 3.0]), 1 / (1 + np.exp(2))
    particles = placed(1, [[0, 0], [0, 1]], [[2, 0], [1, 0]])
    relate(particles, 0, 1)
    move(particles, np.zeros((1, 2, 2)), ParticleConfig(**flat_table(0.0)).speed_table(1.0), AT_ONCE, 1.0, None, alike)
    np.testing.assert_allclose(particles.vel[0, :, 0], [(2 + w) / (1 + w), (1 + 2 * w) / (1 + w)], rtol=1e-12)
    count, rng = 40_000, np.random.default_rng(5)
    particles = placed(count, [[0, 0], [0, 1.3]])
    relate(particles, 0, 1)
    noise, shared = rng.standard_normal((2, count, 2, 2))
    coupling, w = np.array([0.5, 0.7]), 1 / (1 + np.exp(2 * 1.3 - 3))
    move(particles, noise, ParticleConfig(**flat_table(1.0)).speed_table(1.0), coupling, 1.0, shared, alike)
    common = 2 * 0.7 * w**2 / (1 + w**2)
    np.testing.assert_allclose(np.cov(particles.vel[..., 0].T), [[1, common], [common, 1]], atol=0.02)


def test_the_equilibrium_of_a_pair_is_the_belief():
    """Whatever the particles say; pairs without a belief, 4 m and more apart, do not walk together."""
    tracker = Relational(RelationalConfig(particles=20_000, relation_rate=2.0))
    tracker.reset(Context(10.0, float("nan")), 3)
    place = np.array([[0, 0], [0.5, 0], [0, 0.5], [30, 0]])
    seat(tracker, placed(20_000, place, np.array([[0, 0], [1, 0], [0, 0], [0, 0]])))
    relate(tracker.particles, 0, 3)
    tracker._follow(np.concatenate([place, np.zeros((4, 2))], axis=1))
    assert (tracker.belief.log_odds[3, :3] == UNSEEN).all()
    tracker.belief.log_odds[:3, :3] = odds = np.array([[0, 1.0, -2.0], [1.0, 0, 0.5], [-2.0, 0.5, 0]])
    for _ in range(60):
        tracker.streams.frame += 1
        tracker._relate()
    found = relations(tracker.particles).mean(axis=0)
    apart = ~np.eye(3, dtype=bool)
    np.testing.assert_allclose(found[:3, :3][apart], (1 / (1 + np.exp(-odds)))[apart], atol=0.015)
    assert found[3].max() == 0
    gone = np.concatenate([place, np.zeros((4, 2))], axis=1)
    gone[1] = np.nan
    for _ in range(tracker.belief.size):
        tracker._follow(gone)
    before = relations(tracker.particles)[:, 1]
    for _ in range(60):
        tracker.streams.frame += 1
        tracker._relate()
    assert np.array_equal(relations(tracker.particles)[:, 1], before)  # who is not seen stays with the partners


def walked(evidence, apart, frames):
    """The probability that two people walk together, in each frame, 10 frames/s: both walk at 1.2 m/s, the second one
    apart(t) beside the first, m."""
    tracker = Relational(RelationalConfig(relation_evidence=evidence, particles=500))
    tracker.reset(Context(10.0, float("nan")), 1)
    out = []
    for k in range(frames):
        x = 0.12 * k
        tracker.step(Frame(k + 1, k / 10), detections(k + 1, [(x, 0), (x, apart(k / 10))]))
        ids, together = tracker.walking_together()
        out.append(together[0, 1] if len(ids) == 2 else np.nan)
    return np.array(out)


def test_the_belief_tells_who_passes_from_who_walks_along():
    """Both are as near and as fast as partners after 6 s. Only the belief remembers that one has come from far."""

    def passing(t):
        return max(0.8, 6 - 1.3 * t)

    for evidence in ("belief", "state"):
        both = [walked(evidence, apart, 61)[-6:].mean() for apart in (lambda t: 0.8, passing)]
        stays, comes = np.log(both) - np.log1p(-np.array(both))
        assert stays > 2
        assert (stays - comes > 2) == (evidence == "belief"), (evidence, stays, comes)


@pytest.mark.parametrize("kind", [Particle, Relational])
def test_in_the_image_the_answers_are_those_on_the_ground_in_px(kind):
    walk = [[(1 + 0.1 * k, 2.0), (1 + 0.1 * k, 2.8), (9 - 0.1 * k, 5.0)] for k in range(20)]
    ground, tracker = stepped(kind(), walk)[-1], kind()
    tracker.reset(Context(10.0, 40.0), 0)
    for k, points in enumerate(walk, 1):
        found = detections(k, 40.0 * np.array(points))
        image = tracker.step(Frame(k, (k - 1) / 10.0), dataclasses.replace(found, plane="image"))
    assert len(image.id) == 3
    np.testing.assert_allclose(image.pos, 40 * ground.pos)
    np.testing.assert_allclose(image.vel, 40 * ground.vel)
    np.testing.assert_allclose(image.cov, 1600 * ground.cov)
