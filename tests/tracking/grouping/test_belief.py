"""The belief: equal to a slow twin, and its file."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tests import reference_belief as slow
from tracking.grouping import pair_evidence
from tracking.grouping.belief import FROZEN, Belief, default_belief
from tracking.grouping.pair_beliefs import beliefs_of_tracks
from tracking.grouping.pair_evidence import NAMES, evidence
from tracking.grouping.person_motion import StepRows


def walk(seed: int, frames: int, people: int):
    """Frame, id and position of people some of whom stand, come late, are missed for a while, and go."""
    r = np.random.default_rng(seed)
    speed = r.normal(0, 0.8, (people, 2)) * (np.arange(people) > 1)[:, None]
    pos = r.uniform(0, 6, (people, 2)) + np.cumsum(speed / 2.5 + r.normal(0, 0.03, (frames, people, 2)), axis=0)
    begin, end = r.integers(0, 6, people), r.integers(12, frames + 1, people)
    there = (np.arange(frames)[:, None] >= begin) & (np.arange(frames)[:, None] < end)
    there &= r.random(there.shape) > 0.1
    frame, column = np.nonzero(there)
    return frame + 1, r.permutation(100)[:people][column], pos[frame, column]


def places(seed, frames=30, people=7, seconds=0.2):
    frame, id, pos = walk(seed, frames, people)
    ids, column = np.unique(id, return_inverse=True)
    out = np.full((frames, len(ids), 2), np.nan)
    out[frame - 1, column] = pos
    return out


def step_rows(pos, time):
    """The rows of tables pos (S, P, 2), nan if not seen, time (S, P)."""
    step, column = np.nonzero(np.isfinite(pos[..., 0]))
    return StepRows(step, column, pos[step, column], time[step, column])


def times(pos, seconds):
    """Mean times of what was seen in each step: up to half a step earlier than its end."""
    ends = np.arange(len(pos))[:, None] * seconds
    return ends - np.random.default_rng(0).uniform(0, seconds / 2, pos.shape[:2])


@pytest.mark.parametrize("seed", [0, 1, 2, "square"])
@pytest.mark.parametrize("seconds", [0.3, 0.4])
def test_evidence_equals_the_slow_twin(seed, seconds, monkeypatch):
    monkeypatch.setattr(pair_evidence, "PORTION", 50)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])  # all have two others equally near
    pos = np.tile(square, (3, 1, 1)) if seed == "square" else places(seed)
    time = times(pos, seconds)
    expected = slow.evidence(pos, time, seconds)
    rows = [
        (key, np.append(values, noise))
        for r in evidence(step_rows(pos, time), seconds)
        for *key, values, noise in zip(r.step.tolist(), r.a.tolist(), r.b.tolist(), r.values, r.noise, strict=True)
    ]
    assert sorted(tuple(key) for key, _ in rows) == sorted(expected)
    for key, values in rows:
        wanted = [expected[tuple(key)][name] for name in (*NAMES, "noise")]
        np.testing.assert_allclose(values, wanted, atol=1e-7, err_msg=str(key))


@pytest.mark.parametrize("seed", range(3))
def test_beliefs_equal_the_slow_twin(seed):
    """Steps of 4 frames at 10 frames per s; each person is seen in one of them."""
    pos, belief = places(seed), default_belief()
    frames = 4 * np.arange(len(pos))[:, None] - np.random.default_rng(0).integers(0, 4, pos.shape[:2])
    frames[0] = 0
    step, column = np.nonzero(np.isfinite(pos[..., 0]))
    rows = frames[step, column], column, pos[step, column]
    order = np.lexsort(rows[1::-1])
    every = beliefs_of_tracks(*(x[order] for x in rows), 4 * len(pos) - 3, 10.0, belief)
    found, expected = every.take(~every.missed), slow.beliefs(pos, frames / 10, 0.4, belief)
    keys = zip(found.step.tolist(), found.a.tolist(), found.b.tolist(), strict=True)
    np.testing.assert_allclose(found.log_odds, [expected[key] for key in keys], atol=1e-9)
    assert len(found.log_odds) == len(expected) > 50


def test_the_file_is_read_as_written(tmp_path):
    belief = default_belief()
    (tmp_path / "b.toml").write_text(belief.toml_text("two\nlines"))
    again = Belief.from_toml(tmp_path / "b.toml")
    assert again.toml_text() == belief.toml_text()
    assert FROZEN.read_text().endswith(belief.toml_text())


BAD_FILES = [
    ('grouping = "belief"', 'grouping = "rule"', "grouping"),
    ("bias = [", "bias = [nan, ", "bias"),
    ("memory = ", "memory = -", "memory"),
    ("stay", "wait", "wait"),
    ('name = "sideways, 5 s"', 'name = "sideways, 3 s"', "table 8: name"),
    ("now = [", "now = [1, ", "table 1: now"),
    ("at = [", "at = [9, ", "table 1: at"),
    ("at = [", "at = [-1, ", "table 1: now"),
    ("threshold = [", "threshold = [0.5, ", "threshold"),
    ("noise = [0.0", "noise = [0.0, 0.05", "bias"),
    ("at = [", "at = [[1], [2, 3], ", "table 1: at"),
    ("events = [", 'events = ["x", ', "table 1: events"),
    ("events = [", "change = [", "table 1"),
    ("[[table]]", "[[row]]", "grouping"),
    ("share = 0.18", "share = 0.0", "share"),
    ("share = 0.18", "share = 1.0", "share"),
    ("nearest = ", "nearest = 1", "nearest"),
    ("threshold = [0.", "threshold = [2.", "threshold"),
    ("noise = [0.0", "noise = [-0.1", "noise"),
]


@pytest.mark.parametrize(("old", "new", "named"), BAD_FILES)
def test_bad_files_are_refused(tmp_path, old, new, named):
    text = FROZEN.read_text()
    assert old in text
    (tmp_path / "b.toml").write_text(text.replace(old, new) if named == "grouping" else text.replace(old, new, 1))
    with pytest.raises(InputError, match="fit grouping") as error:
        Belief.from_toml(tmp_path / "b.toml")
    assert error.value.place == named
