"""What may be used for what: seeds kept apart, no recordings, suites that share nothing."""

from __future__ import annotations

import pytest

from scenarios.errors import InputError
from tests.recordings import mot_folder
from tests.tuning_toys import toy_plan, write_scenes
from tracking.tuning import search_plan

DEFAULT_SEEDS = [
    ("train", 1, range(16)), ("train", 4, range(4)), ("train", 32, range(2)), ("val", 4, range(10_000, 10_012)),
    ("test", 4, range(20_000, 20_025)), ("test", 28, range(20_000, 20_004)),
]  # fmt: skip


@pytest.mark.parametrize(("split", "count", "expected"), DEFAULT_SEEDS)
def test_default_seeds_make_enough_episodes(split, count, expected):
    assert search_plan.chosen_seeds(None, split, count) == expected


WRONG_SEEDS = [
    ("seeds", range(9_998, 10_002)), ("seeds", range(20_000, 20_002)), ("seeds", range(0)),
    ("validation", range(5)), ("validation", range(20_000, 20_005)), ("test", range(5)),
    ("test", range(29_999, 30_001)),
]  # fmt: skip


@pytest.mark.parametrize(("option", "seeds"), WRONG_SEEDS)
def test_seeds_of_another_range_are_refused(tmp_path, option, seeds):
    with pytest.raises(InputError, match=f"--{option}.*kept apart"):
        toy_plan(tmp_path, **{option: seeds})


def test_the_three_sets_share_no_source(tmp_path):
    made = toy_plan(tmp_path)
    sets = [made.training, made.validation, *made.tests.values()]
    keys = [source.key for sources in sets for source in sources]
    assert len(set(keys)) == len(keys) == 5 + 6 + 6 + 6


def test_a_recording_is_never_tuned_on(tmp_path):
    folder = mot_folder(tmp_path / "recording", "1,1,0,0,5,5,1,1,1\n")
    for option in ("suite", "check"):
        with pytest.raises(InputError, match="nothing is tuned on what was recorded") as caught:
            toy_plan(tmp_path, **{option: str(folder)})
        assert f"--{option}" in str(caught.value)


USUAL_CHECKS = [
    (["crossing"], "friends-meet"),
    (["standard"], "friends-meet"),
    (["friends-meet"], "crossing"),
    (["suite:friends-meet", "cross"], None),
]


@pytest.mark.parametrize(("names", "expected"), USUAL_CHECKS)
def test_the_usual_check_shares_nothing(names, expected):
    assert search_plan.default_check_suite(names) == expected


def test_a_check_that_shares_a_scenario_is_refused(tmp_path):
    shared = search_plan.shared_scenarios(["standard"], ["crossing"])
    assert shared == ["cross", "cross-same-speed", "pass-by", "side-by-side"]
    one, _ = write_scenes(tmp_path)
    (tmp_path / "all.toml").write_text('about = "all"\nentry = [{ scenario = "one.toml" }, { scenario = "two.toml" }]')
    with pytest.raises(InputError, match=r"all\.toml, which has one of"):
        toy_plan(tmp_path, check=str(tmp_path / "all.toml"))
    assert toy_plan(tmp_path, check=None).check is None
    assert search_plan.shared_scenarios([one], [one]) == ["one"]


def test_settings_reach_the_scenes(tmp_path):
    made = toy_plan(tmp_path, set=["scenario.duration=5", "sensor.detect_prob=0.5", "tracker.skip=2"])
    assert {s.entry.scenario.duration for s in (*made.training, *made.validation)} == {5.0}
    unused = made.tests["two.toml"][0].entry.scenario
    assert (unused.duration, unused.sensor.detect_prob) == (4.0, 0.5), "the detector is the same everywhere"
    assert made.base.skip == 2
    assert "skip" not in made.defaults


WRONG_OPTIONS = [
    ({"trials": 0}, "--trials: got 0"), ({"finalists": 0}, "--finalists"),
    ({"seed": -1}, "--seed"), ({"only": ["reech"]}, "did you mean reach"),
    ({"only": ["reach"], "set": ["reach=1"]}, "reach; .* not set"), ({"only": ["steps"]}, "have an effect"),
    ({"set": ["reach=99"]}, "from 0.05 to 5"), ({"detections": "image"}, "--detections"),
    ({"tracker": "tests/fake_tracker.py:Nearest"}, "a tracker with parameters"),
    ({"tracker": "blobb"}, "did you mean blob"), ({"suite": "crosing"}, "--suite.*crossing"),
    ({"seeds": 5}, "--seeds: got 5; expected training seeds, a range out of"),
    ({"set": ["sensor.detect_prob=0.5"], "detections": "truth"}, "remove the sensor"),
    ({"tracker": "grouping", "detections": "file"}, "whose identity is known"),
    ({"set": [f"{name}=0.1" for name in ("reach", "skip", "colour", "forbidden")]}, "skip|colour"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), WRONG_OPTIONS)
def test_wrong_options_are_one_line(tmp_path, change, words):
    with pytest.raises(InputError, match=words):
        toy_plan(tmp_path, **change)
