"""Goals: which way is better, means over what is known, speed over all frames."""

from __future__ import annotations

import math

import pytest

from scenarios.errors import InputError
from tracking.environment.episodes import Episode
from tracking.tuning.comparison import SPEED, Goal, finite_mean, goals_of


def episode(seconds: float = 1.0, frames: int = 10, **scores: float) -> Episode:
    return Episode("x", 0, scores.get("objective", math.nan), scores, frames, seconds, 0.0)


def test_directions_come_from_the_catalogue():
    assert goals_of(["HOTA", "GOSPA", SPEED]) == (Goal("HOTA"), Goal("GOSPA", False), Goal(SPEED))


def test_gain_is_positive_where_the_second_is_better():
    assert Goal("HOTA").gain(0.2, 0.5) == pytest.approx(0.3)
    assert Goal("GOSPA", False).gain(0.2, 0.5) == pytest.approx(-0.3)


def test_unknown_scores_are_left_out_of_the_mean():
    goal = Goal("event_F1")
    assert goal.mean([episode(event_F1=0.5), episode(), episode(event_F1=1.0)]) == 0.75
    assert math.isnan(goal.mean([episode()]))
    assert math.isnan(finite_mean([]))


def test_speed_is_frames_over_seconds_of_all():
    assert Goal(SPEED).mean([episode(1.0, 10), episode(3.0, 10)]) == 5.0
    assert math.isnan(Goal(SPEED).of(episode(0.0)))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (["HOTTA"], "did you mean HOTA"),
        (["hota"], "did you mean HOTA"),
        (["HOTA", "HOTA"], "HOTA twice"),
        ([], "got none"),
        (["fps"], "docs/reference/metrics.md"),
    ],
)
def test_wrong_keys_are_one_line(keys, words):
    with pytest.raises(InputError, match=words) as caught:
        goals_of(keys)
    assert "--objective" in str(caught.value)
