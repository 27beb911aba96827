"""Noise of positions is estimated from the recording, whatever its size, direction and correlation over time."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.grouping.person_motion import Motion, PersonMotion, SteadyPlaces, frames_per_step, step_rows


def walkers(across: float, along: float, turn: float, fps: float = 2.5, people: int = 8, seconds: float = 30) -> Motion:
    """The motion of people who walk as legs do, whose positions err with a correlation time of 1 s."""
    r, frames = np.random.default_rng(0), int(seconds * fps)
    speed = np.cumsum(r.normal(0, 0.15 / np.sqrt(fps), (frames, people, 2)), axis=0) + r.normal(0, 1, (people, 2))
    error, stay = np.empty((frames, people, 2)), np.exp(-1 / fps)
    error[0] = r.normal(size=(people, 2))
    for t in range(1, frames):
        error[t] = stay * error[t - 1] + np.sqrt(1 - stay**2) * r.normal(size=(people, 2))
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    pos = np.cumsum(speed / fps, axis=0) + (error * [across, along]) @ axes
    frame, column = np.divmod(np.arange(frames * people), people)
    seen = step_rows(frame, column, pos.reshape(-1, 2), frames, fps)
    return PersonMotion(people, 0.4 if fps > 1 else 1 / fps).add(seen.step, seen.column, seen.pos, seen.time)


@pytest.mark.parametrize(("across", "along", "turn"), [(0.0, 0.0, 0.0), (0.1, 0.3, 0.0), (0.15, 0.6, 0.8), (0.2, 1, 2)])
@pytest.mark.parametrize("fps", [1.0, 2.5])
def test_noise_is_found(across, along, turn, fps):
    xx, xy, yy = walkers(across, along, turn, fps).noise[-40:].mean(axis=0)
    values, vectors = np.linalg.eigh([[xx, xy], [xy, yy]])
    assert np.sqrt(np.maximum(values, 0)) == pytest.approx([across, along], rel=0.25, abs=0.1)
    if along > across:
        # errors along are the second axis, turned
        assert abs(vectors[:, 1] @ [-np.sin(turn), np.cos(turn)]) > 0.97


def test_noise_of_one_person_is_told_from_that_of_all():
    motion, steps = PersonMotion(6, 0.4), 100
    r = np.random.default_rng(1)
    error = r.normal(0, 0.02, (steps, 6, 2))
    error[:, 5] *= 20
    step, column = np.divmod(np.arange(steps * 6), 6)
    noise = motion.add(step, column, error.reshape(-1, 2), step * 0.4).noise[-6:, 0]
    assert noise[5] > 10 * noise[:5].max()
    late = motion.new(np.zeros((2, 2)), np.zeros((2, 2))).noise
    assert (late[0] == late[1]).all()
    assert noise[:5].max() < late[0, 0] < noise[5], "who is new has the noise of all"


def test_velocities_by_regression_of_uniform_motion_are_exact():
    step = np.arange(12)
    pos, motion = np.column_stack([3 + 0.5 * step, 1 - 0.2 * step]), PersonMotion(1, 0.4)
    found = motion.add(step, np.zeros(12, np.int64), pos, 0.4 * step)
    np.testing.assert_allclose(found.slope[1:], np.tile([1.25, -0.5], (11, 2, 1)), atol=1e-9)
    assert np.isnan(found.slope[0]).all()
    assert np.isnan(found.vel[0]).all()


def walk(error: float, people: int = 4, seconds: int = 20, fps: float = 10.0):
    """Frames, columns, true and measured places of people who walk at 1 m/s and err by white noise."""
    frame, column = np.divmod(np.arange(int(seconds * fps) * people), people)
    true = np.column_stack([frame / fps, 2.0 * column])
    measured = true + np.random.default_rng(0).normal(0, error, true.shape)
    return frame, column, true, measured, int(seconds * fps), fps


def steady_places(frame, column, pos, length, fps):
    """The steady places of all frames at once, (R, 2)."""
    people, seen = np.full(int(column.max(initial=-1)) + 1, -1), step_rows(frame, column, pos, length, fps)
    motion = PersonMotion(len(people), frames_per_step(fps) / fps)
    noise = motion.add(seen.step, seen.column, seen.pos, seen.time).noise
    steady = SteadyPlaces(fps)
    steady.take(people)
    return steady.add(frame, column, pos, seen, noise)


def test_steady_places_are_nearer_the_truth_and_exact_ones_stay():
    frame, column, true, measured, length, fps = walk(0.4)
    late = frame > 30
    found = steady_places(frame, column, measured, length, fps)
    assert np.abs(found - true)[late].mean() < 0.4 * np.abs(measured - true)[late].mean()
    frame, column, true, _, length, fps = walk(0.0)
    exact = steady_places(frame, column, true, length, fps)
    np.testing.assert_allclose(exact[frame > 20], true[frame > 20], atol=0.02)
    np.testing.assert_allclose(exact[frame > 60], true[frame > 60], atol=1e-3)


def test_steady_places_do_not_look_ahead():
    frame, column, _, measured, length, fps = walk(0.4)
    whole = steady_places(frame, column, measured, length, fps)
    for until in (37, 90):
        part = frame < until
        found = steady_places(frame[part], column[part], measured[part], until, fps)
        np.testing.assert_array_equal(found, whole[part])


def test_who_comes_later_has_the_noise_of_those_before():
    frame, column, _, measured, length, fps = walk(0.4)
    late = (column < 3) | (frame > 100)
    found = steady_places(frame[late], column[late], measured[late], length, fps)
    new = (column[late] == 3) & (frame[late] == 102)
    assert np.abs(found - measured[late])[new].max() > 0.05, "the second place counts little"


def test_a_person_in_the_last_frames_alone_stays():
    frame, pos = np.array([2]), np.array([[3.0, 4.0]])
    np.testing.assert_array_equal(steady_places(frame, np.array([0]), pos, 3, 10.0), pos)
    assert len(steady_places(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 2)), 3, 10.0)) == 0
