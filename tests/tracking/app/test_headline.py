"""This project's own gate: no tracker is worse than its stored scores, by `flockscope compare`."""

from __future__ import annotations

import json

import pytest

from benchmarks.gate import HEADLINE, TRACKERS, headline
from tracking.app.cli import run


@pytest.mark.slow
def test_no_tracker_is_worse_than_its_stored_scores(tmp_path):
    """After a wanted change: python -m benchmarks gate headline --write"""
    found = {name: result for name, _, result in headline(tmp_path)}
    assert found.keys() == TRACKERS.keys()
    assert all(result.code == 0 for result in found.values()), "\n".join(result.text for result in found.values())


@pytest.mark.parametrize("name", TRACKERS)
def test_a_loss_is_a_regression(name, tmp_path, capsys):
    stored = HEADLINE / f"{name}.json"
    document = json.loads(stored.read_text())
    for row in document["sequences"]:
        row["group_F1"] -= 0.05
    (tmp_path / "now.json").write_text(json.dumps(document))
    by = [word for key in TRACKERS[name] for word in ("--by", key)]
    assert run(["compare", str(stored), str(tmp_path / "now.json"), *by]) == 1
    assert "regression" in capsys.readouterr().out
