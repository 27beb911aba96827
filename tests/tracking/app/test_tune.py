"""The command `tune`: its options as a user types them, one object or lines, and errors in one line."""

from __future__ import annotations

import pytest

from tests.tuning_toys import TOY, write_scenes
from tracking.app.cli import run


@pytest.fixture
def line(tmp_path) -> list[str]:
    one, two = write_scenes(tmp_path)
    seeds = ["--seeds", "0:2", "--validation", "10000:10003", "--test", "20000:20003"]
    goal = ["--objective", "HOTA", "--only", "reach", "--trials", "12"]
    return ["tune", TOY, "--suite", one, "--check", two, *seeds, *goal, "--out", str(tmp_path / "new" / "toy.toml")]


def test_it_says_what_was_gained(line, tmp_path, capsys):
    assert run(line) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    told = printed.out.splitlines()
    assert told[0] == "toy_tracker.py:Toy tuned on one.toml, detections file, for HOTA"
    assert any(text.startswith("one.toml: HOTA ") and text.endswith(": better") for text in told)
    assert any(text.startswith("two.toml: HOTA ") for text in told)
    assert any(text.startswith("reach: 0.1 → ") for text in told)
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == [
        "toy.history.svg", "toy.importance.svg", "toy.journal", "toy.journal.locks", "toy.json", "toy.toml",
    ]  # fmt: skip
