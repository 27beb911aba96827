"""Limits of `joint`: the Kalman filter, DEEPER-JIGT.2, labels, births, losses (companion page, section 4, E2, D7)."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Context, Frame
from tests.point_frames import FPS, detections, stepped
from tracking.environment.env import TuningEnv
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.individuals import process_noise
from tracking.papers.joint.tracker import Joint
from tracking.stats import paired

QUIET = {
    f"{event}_weights": (*weights[:-1], -100.0)
    for event, weights in zip(("merge", "split"), JointConfig().classifier.tolist(), strict=True)
}


def walk(starts, velocity, frames, noise=0.0, seed=0):
    """Places of people who walk straight, by frame."""
    rng, starts = np.random.default_rng(seed), np.array(starts, float)
    steps = np.arange(frames)[:, None, None] / FPS * np.asarray(velocity)
    return list(starts + steps + noise * rng.standard_normal((frames, len(starts), 2)))


def kalman(tracker, points, config):
    """The exact means of x and y of one person, from the newcomer's posterior on: Sigma of eq. 3, noise of a point."""
    frames = [len(t.id) for t in stepped(Joint(), [[p] for p in points])].index(1)
    tracker.reset(Context(FPS, float("nan")), 0)
    for k in range(1, frames):
        tracker.step(Frame(k, (k - 1) / FPS), detections(k, [points[k - 1]]))
    new = tracker.newcomers
    new.predict(1 / FPS)
    z = np.array([points[frames - 1]])
    new.measure(z, np.full(z.shape, np.nan), config.point_noise, config.detect_prob, 1 / FPS)
    place, rate, var, cross, rate_var = new.bank[:, 0]
    x, P = np.concatenate([place, rate]), np.kron([[var[0], cross[0]], [cross[0], rate_var[0]]], np.eye(2))
    A, H = np.eye(4) + np.eye(4, k=2) / FPS, np.eye(4)[:2]
    a, b, c = process_noise(config.place_noise, config.velocity_noise, 1 / FPS)
    out = []
    for z in points[frames:]:
        x, P = A @ x, A @ P @ A.T + np.kron([[a, b], [b, c]], np.eye(2))
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + config.point_noise**2 * np.eye(2))
        x, P = x + K @ (z - H @ x), P - K @ H @ P
        out.append(x)
    return np.array(out)


@pytest.mark.parametrize(("algorithm", "error"), [("ours", 0.006), ("paper", 0.025)])
def test_people_alone_have_the_kalman_filter(algorithm, error, monkeypatch):
    """Z all alone, exact association; ours: locally optimal proposal (E2); paper: all three people are
    drawn from the transition and weighted together, so that few of 1000 particles count."""
    monkeypatch.setattr("tracking.papers.joint.distributions.ALPHA", 0.0)
    config = JointConfig(particles=1000, partitions=1, place_noise=0.15, algorithm=algorithm, **QUIET)
    points = walk([[0, 0], [20, 0], [40, 5]], [1.2, 0.3], 25, noise=0.08)
    runs = [stepped(Joint(config), points, seed) for seed in range(6)]
    for person in range(3):
        exact = kalman(Joint(config), [p[person] for p in points], config)
        found = np.mean([[t.pos[person] for t in run[-len(exact) :]] for run in runs], axis=0)
        assert np.sqrt(np.mean((found - exact[:, :2]) ** 2)) < error
        assert np.sqrt(np.mean((exact[1:, :2] - [p[person] for p in points[-len(exact) + 1 :]]) ** 2)) > 0.03


def test_individuals_who_are_measured_are_the_same_in_all_particles():
    """p(X | y) of DEEPER-JIGT.2 is a delta: particles of X differ in nothing (D7)."""
    tracker = Joint(JointConfig(individuals="measured"))
    points = walk([[0, 0], [0, 0.7], [5, 5]], [1.0, 0.0], 20)
    tracks = stepped(tracker, points)
    assert np.ptp(tracker.nested.x, axis=0).max() < 1e-12
    np.testing.assert_allclose(tracks[-1].pos, points[-1], atol=1e-9)
    np.testing.assert_allclose(tracks[-1].vel, [[1, 0]] * 3, atol=1e-6)
    assert tracks[-1].group[0] == tracks[-1].group[1] >= 0 > tracks[-1].group[2]


def found_pairs(variant, seed):
    """The share of true pairs that are reported as groups, in the last 15 frames: three pairs and four people alone."""
    rng = np.random.default_rng(seed)
    homes = rng.permutation(7)[:, None] * np.array([0.0, 3.0]) + rng.normal(0, 0.2, (7, 2))
    starts = np.concatenate([homes, homes[:3] + np.array([0, 0.7])])
    config = JointConfig(particles=10, partitions=10, variant=variant)
    tracks = stepped(Joint(config), walk(starts, [1.2, 0.0], 30, noise=0.05, seed=seed), seed)[-15:]
    share = []
    for t in tracks:
        near = np.argmin(np.linalg.norm(t.pos - (starts + np.array([1.2 * t.t, 0]))[:, None], axis=2), axis=1)
        group = t.group[near]
        share += [group[k] >= 0 and np.flatnonzero(group == group[k]).tolist() == [k, k + 7] for k in range(3)]
    return np.mean(share)


def test_groups_are_found_the_better_the_more_of_the_model_is_used():
    """E9: full - VAR2 and VAR2 - VAR3, paired over scenes, with intervals off 0."""
    full, var2, var3 = (np.array([found_pairs(v, seed) for seed in range(6)]) for v in ("full", "VAR2", "VAR3"))
    for better, worse in ((full, var2), (var2, var3)):
        _, low, _ = paired(worse, better)
        assert low > 0


def test_a_pair_that_walks_together_is_a_group_and_crossing_strangers_are_none():
    pair = walk([[0, 0], [0, 0.7]], [1.2, 0.0], 40, noise=0.05)
    stranger = walk([[6, -3]], [0.0, 1.2], 40, noise=0.05, seed=1)
    tracks = stepped(Joint(), [np.concatenate([a, b]) for a, b in zip(pair, stranger, strict=True)])
    for t in tracks[8:]:
        k = np.argsort(t.pos[:, 1]) if t.index < 20 else np.arange(3)
        together = t.group[t.group >= 0]
        assert len(together) == 2, (t.index, k)
        assert len(set(together.tolist())) == 1


def test_parting_people_split():
    a = walk([[0, 0]], [1.0, 0.0], 70, noise=0.05)
    straight = [[0.0, 0.7 + 0.1 * max(k - 30, 0)] for k in range(70)]
    b = [np.array([[p[0] + x[0, 0], p[1]]]) for p, x in zip(straight, a, strict=True)]
    tracks = stepped(Joint(), [np.concatenate([x, y]) for x, y in zip(a, b, strict=True)])
    assert all((t.group >= 0).all() for t in tracks[8:30])
    assert (tracks[-1].group < 0).all()


@pytest.mark.parametrize("fps", [5, 20])
def test_a_person_who_is_missed_goes_on_and_is_removed_after_a_time(fps):
    tracks = stepped(tracker := Joint(), walk([[0, 0]], [FPS / fps, 0.0], 2 * fps) + [[]] * (4 * fps), fps=fps)
    assert [t.t for t in tracks if len(t.id)][-1] == pytest.approx(3.1, abs=0.2)
    assert tracks[3 * fps].pos[0, 0] == pytest.approx(3.0, abs=0.6)
    assert not len(tracker.people.id)


def test_a_member_who_is_missed_stays_in_the_group():
    """Without a measurement nothing is known of a change of groups."""
    points = walk([[0, 0], [0, 0.7], [0, 1.4]], [1.2, 0.0], 40, noise=0.05)
    shown = [p if k < 25 else p[:2] for k, p in enumerate(points)]
    tracks = stepped(Joint(), shown)
    for t in tracks[24:]:
        assert len(set(t.group.tolist())) == 1
        assert t.group[0] >= 0
    assert [len(t.id) for t in tracks[24:36]] == [3] * 12


def test_a_lost_image_removes_nobody():
    tracks = stepped(Joint(), [*walk([[0, 0]], [1.0, 0.0], 20), *[None] * 25])
    assert tracks[-1].id.tolist() == tracks[19].id.tolist() == [1]


def test_a_false_alarm_of_one_frame_is_no_person():
    assert not any(len(t.id) for t in stepped(Joint(), [[[3, 3]], [], [], [], []]))


def test_a_new_person_goes_on_in_frames_without_a_detector():
    """The velocity is that of the walk, and the time of the first sight is kept."""
    tracker, frames = Joint(JointConfig(**QUIET)), walk([[0, 0]], [1.3, 0], 12)
    shown = stepped(tracker, [*frames[:2], None, None, None, *frames[5:8]])
    assert [len(t.id) for t in shown] == [0] * 6 + [1, 1]
    assert shown[-1].vel[0, 0] == pytest.approx(1.3, abs=0.35)


@pytest.mark.parametrize("drawn", [1, 6, 16])
def test_events_name_only_people_who_were_reported(drawn):
    """Where parameters jump between the ends of their ranges, some are confirmed, missed and forgotten at once."""
    rng = np.random.default_rng((7, drawn))
    every = int(rng.choice([1, 3]))
    env = TuningEnv("joint", "merge", seeds=[30_000 + drawn % 5], set=["camera.fps=5"], decision_every=every)
    env.reset(seed=0)
    for _ in range(45 // every):
        env.step(rng.choice([-1.0, 1.0], env.action_space.shape))
    reported = set[int]()
    for tracks in env.rollout.tracks:
        reported |= set(tracks.id.tolist())
        assert reported.issuperset(person for event in tracks.events for person in event.members)
