"""The agent: decisions in a tracker as in the environment, and a search that finds what is there to be found."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Tracks
from tests.tuning_toys import write_scenes
from tracking import agent_search
from tracking.agent import Policy
from tracking.env import TuningEnv
from tracking.episodes import Rollout, play, sources
from tracking.observation import NAMES
from tracking.search import encode

FILE = f"{Path(__file__).parents[1] / 'adaptive_toy.py'}"
TOY = f"{FILE}:Changing"


def policy(tracker: str = TOY, **more) -> Policy:
    """Moves `reach` by how many tracks there are."""
    given = {"every": 0.6, "parameters": ("reach",), "statistics": ("tracks", "births")}
    numbers = {"offset": [0.1], "weights": [[0.3, -0.2]], "usual": [0.2, 0.5], "spread": [0.1, 0.2]}
    return Policy(tracker, **{**given, **numbers, **more})


def test_it_says_what_its_formula_says() -> None:
    made, seen = policy(), np.zeros(len(NAMES))
    seen[NAMES.index("tracks")], seen[NAMES.index("births")] = 0.3, 0.1
    start = float(encode(made.space, made.base)[0])
    assert encode(made.space, made.config(None)) == pytest.approx([start + 0.1])
    assert encode(made.space, made.config(seen)) == pytest.approx([start + 0.1 + 0.3 * 1 + 0.2 * 2])
    assert made.config(100 * seen) == dataclasses.replace(made.base, reach=5.0)


def places(answers: Iterable[Tracks]) -> np.ndarray:
    """Where everybody was said to be, frame by frame."""
    return np.concatenate([t.pos for t in answers])


@pytest.mark.parametrize(
    ("tracker", "parameter"), [(TOY, "reach"), ("blob", "accel_noise"), ("group-pda", "accel_noise")]
)
def test_a_tracker_with_it_decides_as_the_environment_does(tracker: str, parameter: str, tmp_path: Path) -> None:
    made = policy(tracker, parameters=(parameter,))
    scene, _ = write_scenes(tmp_path)
    (source,) = sources(scene, [3])
    env = TuningEnv(tracker, [source], params=made.config(None).as_dict(), decision_every=3, detections="file")
    seen, _ = env.reset(seed=0)
    done, reward, acted = False, 0.0, []
    while not done:
        acted.append(made.config(seen if acted else None))
        seen, gain, done, _, _ = env.step(encode(env.space, acted[-1]))
        reward += float(gain)
    assert len(set(acted)) > 1
    assert env.rollout is not None
    alone, plain = (Rollout(t, source, detections="file") for t in (made.tracked(), tracker))
    ours = places(t for _, t in alone.advance())
    assert ours == pytest.approx(places(env.rollout.answers), abs=1e-9)
    assert alone.scores()["objective"] == pytest.approx(reward, abs=1e-9)
    assert tracker == TOY or np.abs(ours - places(t for _, t in plain.advance())).max() > 1e-3


def test_without_weights_it_is_the_tracker(tmp_path: Path) -> None:
    made = policy("blob", parameters=("gate",), offset=[0.0], weights=[[0.0, 0.0]])
    (source,) = sources(write_scenes(tmp_path)[0], [3])
    assert play(made.tracked(), source, detections="file").scores == play("blob", source).scores


def test_parameters_that_the_tracker_refuses_are_not_taken(tmp_path: Path) -> None:
    made = policy(f"{FILE}:Choosy", offset=[0.3])
    (source,) = sources(write_scenes(tmp_path)[0], [3])
    assert play(made.tracked(), source, detections="file").frames == 20


def test_what_is_written_is_read(tmp_path: Path) -> None:
    made, file = policy(params={"reach": 0.3}), tmp_path / "policy.json"
    file.write_text(made.to_json())
    again = Policy.from_json(file)
    assert again.to_json() == made.to_json()
    seen = np.random.default_rng(0).uniform(size=len(NAMES))
    assert again.config(seen) == made.config(seen)
    file.write_text("{}")
    with pytest.raises(InputError, match="a policy"):
        Policy.from_json(file)


@pytest.mark.parametrize(
    ("wrong", "place"),
    [
        ({"parameters": ("rich",)}, "parameters"),
        ({"parameters": ("skip",)}, "parameters"),
        ({"statistics": ("tracks", "luck")}, "statistics"),
        ({"statistics": ("tracks", "merges")}, "statistics"),
        ({"every": 0.0}, "every"),
        ({"weights": [[0.1]]}, "weights"),
        ({"offset": [np.nan]}, "offset"),
    ],
)
def test_wrong_policies_are_named(wrong: dict[str, object], place: str) -> None:
    with pytest.raises(InputError, match=place):
        policy(**wrong)


def test_a_tracker_without_parameters_is_told_as_it_was_given() -> None:
    with pytest.raises(InputError, match="a tracker with parameters") as error:
        policy(tracker="tests/fake_tracker.py:Nearest")
    assert error.value.got == "tests/fake_tracker.py:Nearest"


def test_the_search_finds_what_the_defaults_lack(tmp_path: Path) -> None:
    scene, _ = write_scenes(tmp_path)
    told: list[int] = []
    found = agent_search.learn(
        TOY, scene, ("reach",), ("tracks",), every=0.6, generations=8, seeds=range(4),
        validation=range(10_000, 10_006), progress=lambda done, total, gain: told.append(done),
    )  # fmt: skip
    assert told == list(range(1, 17))
    assert len(found.history) == 16
    assert found.gain[1] > 0.1  # reach is far too short by default
    assert found.policy is (found.agent if found.more[1] > 0 else found.fixed)
    assert not found.fixed.weights.any()
    assert found.agent.weights.any()
    assert found.policy.config(None).as_dict()["reach"] > 0.3
    again = agent_search.learn(
        TOY, scene, ("reach",), ("tracks",), every=0.6, generations=8, seeds=range(4), validation=range(10_000, 10_006)
    )
    assert again.policy.to_json() == found.policy.to_json()


def test_a_gain_that_is_not_sure_is_not_believed(tmp_path: Path) -> None:
    scene, _ = write_scenes(tmp_path)
    found = agent_search.learn(
        f"{FILE}:Indifferent", scene, ("reach",), (), every=0.6, generations=2, seeds=range(3),
        validation=range(10_000, 10_004),
    )  # fmt: skip
    assert found.gain == found.more == (0.0, 0.0, 0.0)
    assert not found.policy.offset.any()
    assert found.fixed.offset.any()
    assert found.agent is found.fixed


def test_without_cmaes_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(InputError, match=r"flockscope\[tune\]"):
        agent_search.learn(TOY, write_scenes(tmp_path)[0], ("reach",), (), generations=1, seeds=range(2))
