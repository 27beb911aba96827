"""A policy changes parameters by what the tracker has seen: in a run, live, and in the environment alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tracking
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Sequence
from tests.toy_tracker import Toy
from tracking.environment.env import TuningEnv
from tracking.papers.blob.config import BlobConfig
from tracking.running.policy import FollowedPolicy, Policy, averaged, read_policy
from tracking.running.signals import NAMES
from tracking.running.time_limit import TimeLimited
from tracking.tuning.adaptive import play_policy

WEIGHTS = {"position_noise": {"bias": -0.2, "residual": 0.9}, "hidden_time": {"found": -0.5, "bias": 0.3}}
POLICY = Policy(BlobConfig(gate=0.99), 0.6, 1.0, WEIGHTS)


@pytest.fixture(scope="module")
def sequence() -> Sequence:
    changes = "sensor.box_noise.scale={ at = [0, 3], value = [0.5, 4] }"
    return simulate(load("pass-by", ["camera.fps=5", "duration=6", "camera.crop=true", changes]), 3, 0, ())


def seen(**values: float) -> np.ndarray:
    return np.array([values.get(name, 0.0) for name in NAMES])


def test_residuals_are_linear_and_clipped() -> None:
    assert [p.name for p in POLICY.space] == ["position_noise", "hidden_time"]
    assert POLICY.residual(seen(residual=0.5, found=0.4)) == pytest.approx([0.25, 0.1])
    assert POLICY.residual(seen(found=1.0)) == pytest.approx([-0.2, -0.2])
    assert POLICY.residual(seen()).tolist() == [0.0, 0.0], "nothing is seen yet"
    steep = replace(POLICY, weights={"gate": {"residual": 50.0}, "accel_noise": {"residual": -50.0}})
    assert steep.residual(seen(residual=1.0)).tolist() == [-1.0, 1.0]  # in the order of the config
    assert (steep.config(seen(residual=1.0)).accel_noise, steep.config(seen()).accel_noise) == (0.05, 0.3)


def test_a_policy_without_weights_is_its_config() -> None:
    assert Policy(BlobConfig(), 1.0, 0.0, {}).config(seen(residual=1.0)) == BlobConfig()
    assert replace(POLICY, weights={"gate": {}}).config(seen(residual=1.0)) == BlobConfig(gate=0.99)


def test_averages_begin_with_the_first_that_is_known() -> None:
    first, then = seen(residual=0.5), seen(residual=1.0)
    assert averaged(None, first, POLICY) is first
    assert averaged(np.zeros(len(NAMES)), first, POLICY) is first
    assert averaged(first, then, POLICY)[NAMES.index("residual")] == pytest.approx(1 - 0.5 * np.exp(-0.6))
    assert averaged(first, then, replace(POLICY, memory=0.0)) is then


def test_a_file_holds_all_of_it(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(POLICY.to_toml())
    assert read_policy(BlobConfig, tmp_path / "p.toml") == POLICY
    (tmp_path / "c.toml").write_text(BlobConfig().to_toml())
    assert read_policy(BlobConfig, tmp_path / "c.toml") is None


WRONG = [
    ('every = "1"', "place every", "every"), ("[policy.gaet]\nbias = 1", "did you mean gate", "gaet"),
    ("[policy.management]\nbias = 1", "may change between frames", "management"),
    ("[policy.gate]\nresidul = 1", "did you mean residual", "residul"),
    ("[policy.gate]\nbias = 'x'", "a number", "gate.bias"),
    ("policy = 3", "tracker, every", "policy"), ('tracker = "joint"', "made for", "tracker"),
    ("more = 1", "tracker, every", "more"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "words", "place"), WRONG)
def test_wrong_files_are_named(tmp_path: Path, line: str, words: str, place: str) -> None:
    text = line if line.startswith(("[", "policy")) else f"{line}\n[policy.gate]\nbias = 0.1"
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(InputError) as error:
        read_policy(BlobConfig, tmp_path / "p.toml")
    assert "p.toml" in error.value.line()
    assert place in error.value.line()
    assert words in error.value.line() or words.startswith("place")


def test_a_run_live_and_the_environment_do_the_same(sequence: Sequence, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(POLICY.to_toml())
    run = tracking.track("blob", sequence, params=tmp_path / "p.toml", detections="file")
    assert run.info["policy"] == {"every": 0.6, "memory": 1.0, "limit": 1.0, "weights": WEIGHTS}
    live = tracking.Live("blob", fps=5, camera=sequence.camera, params=POLICY, image_size=sequence.image_size)
    reported = []
    for frame in sequence:
        assert frame.detections is not None
        now = live.step(boxes=frame.detections.box, scores=frame.detections.score, points=frame.detections.pos)
        reported += now.completed
    reported += live.finish().completed
    with TimeLimited("blob", 600.0) as limited:
        envs = [TuningEnv(tracker, sequence, detections="file", decision_every=3) for tracker in ("blob", limited)]
        played = [env.rollout.tracks for env in envs if play_policy(env, POLICY) and env.rollout is not None]
    assert len(reported) == len(run) == 30
    for one, *others in zip(run, reported, *played, strict=True):
        assert len(others) == 3
        for other in others:
            assert np.array_equal(one.id, other.id)
            assert np.array_equal(one.pos, other.pos)
    plain = tracking.track("blob", sequence, params={"gate": 0.99}, detections="file")
    assert any(not np.array_equal(a.pos, b.pos) for a, b in zip(run, plain, strict=True))
    assert "policy" not in plain.info


def test_it_looks_at_no_later_frame(sequence: Sequence) -> None:
    whole = tracking.track("blob", sequence, params=POLICY, detections="file")
    half = replace(sequence, length=15, frames=lambda: (f for f in list(sequence)[:15]), bare=None)
    first = tracking.track("blob", half, params=POLICY, detections="file")
    assert all(np.array_equal(a.pos, b.pos) for a, b in zip(first, whole[:15], strict=True))


class Deaf(Toy):
    """Keeps no config."""

    def reset(self, context, seed):  # type: ignore[no-untyped-def]
        super().reset(context, seed)
        if "config" in self.__dict__:
            del self.config


def test_a_tracker_that_keeps_no_config_is_named() -> None:
    deaf = Deaf(Deaf.config_class())
    del deaf.config
    with pytest.raises(InputError, match="keeps its config"):
        FollowedPolicy(POLICY, 5.0, 40.0).begin(deaf)
