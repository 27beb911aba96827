"""The catalogue of scores, docs/reference/metrics.md and what evaluate returns agree; see also test_evaluation."""

from __future__ import annotations

import math
import re
from pathlib import Path

from tests.hand_made import Scene, tracks, truth
from tracking.scoring import evaluate
from tracking.scoring.catalogue import ALL, CATALOGUE, CORE

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "reference" / "metrics.md"
TWO = {1: (0.0, 0.0), 2: (1.0, 0.0)}


def test_every_key_of_the_page_is_returned_and_the_other_way_round() -> None:
    scene = [Scene(TWO, {1: ((1, 2), None)})] * 3
    returned = set(evaluate(truth(scene), tracks(scene)))
    rows = set(re.findall(r"^\| `([^`]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
    assert returned == rows | {f"{key}_core" for key in rows if CATALOGUE[key].family == "groups"}


def test_keys_are_unique_and_said_in_full() -> None:
    assert len(CATALOGUE) == len(ALL)
    for score in ALL:
        assert score.meaning, score.key
        assert score.low < score.high
        assert (score.better == "neither") <= math.isnan(score.best)
    core = [score.key for score in ALL if score.family == CORE]
    assert core == [f"{score.key}_core" for score in ALL if score.family == "groups"]


def test_the_command_shows_scores_that_there_are() -> None:
    from tracking.app.commands.score_tables import SHOWN, TABLES

    assert {*SHOWN, *(key for keys in TABLES.values() for key in keys)} <= set(CATALOGUE)
