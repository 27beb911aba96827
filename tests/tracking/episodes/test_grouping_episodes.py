"""The rule of groups as something to tune: true people, grouped by it, and nothing of their true groups seen."""

from __future__ import annotations

import numpy as np
import pytest

from sim.rng import rng
from tests.tuning_toys import write_scenes
from tracking.episodes import grouping_episodes as episodes
from tracking.episodes.episode import SourceCache, sources
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.link_rule import LinkRule
from tracking.scoring import evaluate
from tracking.tuning.search import tune


@pytest.fixture
def source(tmp_path):
    return sources(write_scenes(tmp_path)[0], (4,))[0]


def test_the_people_are_perfect_and_their_groups_unknown(source):
    truth = source.open().truth
    answers = episodes.people_as_tracks(truth)
    assert len(answers) == truth.length
    assert all((t.group == -1).all() and t.groups is None and t.events == () for t in answers)
    assert evaluate(truth, answers)["HOTA"] == 1.0


@pytest.mark.parametrize("seed", [3, 4])
def test_an_episode_is_what_evaluate_says(tmp_path, seed):
    (source,) = sources(write_scenes(tmp_path)[0], (seed,))
    truth, rule = source.open().truth, LinkRule(near=1.0)
    found = episodes.play_rule(source, rule, SourceCache())
    labels = episodes.FILMED if seed % 2 else episodes.SURVEYED
    people = episodes.people_as_tracks(episodes.with_label_errors(truth, labels, seed))
    factor = labels.scale ** rng(seed, "label").uniform(-1, 1)
    assert (factor == 1) == (seed == 4)
    similarity = "image" if labels is episodes.FILMED else "ground"
    scores = evaluate(truth, derive(people, truth.fps, truth.px_per_m * factor, rule), similarity=similarity)
    assert found.objective == scores["objective"]
    assert found.scores == {key: value for key, value in scores.items() if value == value}
    assert found.frames == truth.length


def test_labels_err_for_a_while_and_do_not_change_who_is_there():
    source = sources("crossing", (0,))[0]
    truth = source.open().truth
    for labels in (episodes.LabelErrors(0.06, 0.3, filmed=True), episodes.SURVEYED):
        found = episodes.with_label_errors(truth, labels, 7)
        assert (found.vel is None) == (found.pos is None) == labels.filmed
        assert found.frame.tobytes() + found.id.tobytes() == truth.frame.tobytes() + truth.id.tobytes()
        error = (found.box - truth.box)[:, :2] / truth.px_per_m if labels.filmed else found.pos - truth.pos
        assert found.box[:, 2:].tobytes() == truth.box[:, 2:].tobytes()
        assert error.std(axis=0) == pytest.approx([labels.sd] * 2, rel=0.1)
        own = error[truth.id == truth.id[0]]
        stay = np.exp(-1 / (truth.fps * labels.time))
        assert np.corrcoef(own[1:, 0], own[:-1, 0])[0, 1] == pytest.approx(stay, abs=0.2)
        again = [episodes.with_label_errors(truth, labels, seed) for seed in (7, 8)]
        same, other = (told.box if labels.filmed else told.pos for told in again)
        here = found.box if labels.filmed else found.pos
        assert same.tobytes() == here.tobytes()
        assert other.tobytes() != here.tobytes()


def test_filmed_people_are_grouped_in_the_image():
    """Boxes alone, at one scale: those who walk behind each other look nearer than they are."""
    truth = sources("crossing", (0,))[0].open().truth
    answers = episodes.people_as_tracks(episodes.with_label_errors(truth, episodes.FILMED, 1))
    assert {t.plane for t in answers} == {"image"}
    assert all(np.isnan(t.vel).all() for t in answers)
    assert evaluate(truth, derive(answers, truth.fps, truth.px_per_m), similarity="image").surface == "image"


def test_the_rule_is_tuned_like_a_tracker(tmp_path):
    """From a rule that asks for too much at the start."""
    one, _ = write_scenes(tmp_path)
    found = tune(
        "grouping", one, 10, seeds=range(4), validation=range(10_000, 10_004), test=range(20_000, 20_004), check=None,
        set=["near=0.5"], out=tmp_path / "rule.toml",
    )  # fmt: skip
    assert found.plan.goals[0].key == "pairwise_F1"
    assert "near" not in found.trials[0].params
    assert LinkRule.from_toml(tmp_path / "rule.toml") == found.config
