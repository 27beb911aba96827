"""Noise of positions is estimated from the recording, whatever its size, direction and correlation over time."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.grouping.person_motion import Motion, PersonMotion, steady_places, step_rows


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


def test_places_without_any_complete_step_are_as_measured():
    # at 30 frames/s step 1 ends with frame 12: two people who first come in frame 1, the last, are in no step
    pos = np.array([[0.0, 0.0], [0.5, 0.0]])
    found = steady_places(np.array([1, 1]), np.array([0, 1]), pos, 2, 30.0)
    np.testing.assert_allclose(found, pos, atol=1e-12)
