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
from tracking.environment.env import TuningEnv
from tracking.environment.episodes import Rollout, play, sources
from tracking.environment.observation import NAMES
from tracking.parameter_space import encode

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


def test_what_the_tracker_refuses_for_a_sequence_is_drawn_back(tmp_path: Path) -> None:
    """At any frame rate newborn tracks of blob must start above confirm_ratio; what is possible depends on the rate."""
    (source,) = sources(write_scenes(tmp_path)[0], [3])
    names, none = ("confirm_ratio", "speed_prior", "size_rate_prior"), np.zeros((3, 0))
    made = policy("blob", parameters=names, statistics=(), offset=[0.5, -1.0, -1.0], weights=none, usual=[], spread=[])
    with pytest.raises(InputError, match="confirm_ratio"):
        play("blob", source, made.config(None), detections="file")
    rollout = Rollout(made.tracked(), source, detections="file")
    assert rollout.episode().frames == 0
    used = rollout.ready.tracker.inner.config
    assert used.confirm_ratio > made.base.confirm_ratio
    assert used.speed_prior < made.base.speed_prior


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


@pytest.mark.parametrize(
    ("fixed", "agent", "chosen"),
    [(0.1, 0.2, "agent"), (0.1, 0.05, "fixed"), (-0.2, -0.1, "defaults"), (-0.1, 0.1, "agent")],
)
def test_an_agent_is_to_beat_the_defaults_too(
    fixed: float, agent: float, chosen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Better than fixed parameters that are worse than the defaults is not good enough."""

    def said(run: object, policy: Policy, among: list[object], mode: str) -> np.ndarray:
        gain = agent if policy.weights.any() else fixed if policy.offset.any() else 0.0
        return np.linspace(0.2, 0.8, len(among)) + gain

    monkeypatch.setattr(agent_search, "played", said)
    seeds = {"seeds": range(3), "validation": range(10_000, 10_004)}
    found = agent_search.learn(TOY, write_scenes(tmp_path)[0], ("reach",), ("tracks",), generations=1, **seeds)
    assert (found.gain[0], found.total[0]) == pytest.approx((fixed, agent))
    kind = "agent" if found.policy is found.agent else "fixed" if found.policy is found.fixed else "defaults"
    assert kind == chosen
    assert (kind == "defaults") == (not found.policy.offset.any())


def test_nothing_is_learned_on_what_judges(tmp_path: Path) -> None:
    scene, _ = write_scenes(tmp_path)
    with pytest.raises(InputError, match="validation seeds, out of 10000:20000"):
        agent_search.learn(TOY, scene, ("reach",), (), seeds=range(4), validation=range(4))
    with pytest.raises(InputError, match="training seeds"):
        agent_search.learn(TOY, scene, ("reach",), (), seeds=range(20_000, 20_004))
    with pytest.raises(InputError, match="nothing is tuned on what was recorded"):
        agent_search.learn(TOY, tmp_path, ("reach",), ())


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


@pytest.mark.parametrize(("wrong", "place"), [({"generations": 0}, "generations"), ({"parameters": ()}, "parameters")])
def test_a_search_needs_something_to_do(wrong: dict[str, object], place: str, tmp_path: Path) -> None:
    given = {"parameters": ("reach",), "statistics": (), **wrong}
    with pytest.raises(InputError, match=f"{place}: .* at least one"):
        agent_search.learn(TOY, write_scenes(tmp_path)[0], **given)


def test_without_cmaes_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(InputError, match=r"flockscope\[tune\]"):
        agent_search.learn(TOY, write_scenes(tmp_path)[0], ("reach",), (), generations=1, seeds=range(2))
