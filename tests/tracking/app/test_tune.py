"""The command `tune`: its options as a user types them, one object or lines, and errors in one line."""

from __future__ import annotations

import json

import pytest

from tests.tuning_toys import TOY, write_scenes
from tracking.app.cli import run


@pytest.fixture
def line(tmp_path) -> list[str]:
    one, two = write_scenes(tmp_path)
    seeds = ["--seeds", "0:2", "--validation", "10000:10003", "--test", "20000:20003"]
    goal = ["--objective", "HOTA", "--only", "reach", "--trials", "12"]
    return ["tune", TOY, "--suite", one, "--check", two, *seeds, *goal, "--out", str(tmp_path / "new" / "toy.toml")]


def changed(line: list[str], option: str, value: str) -> list[str]:
    """The line with another value of an option, or with one more of an option that is not in it or can be repeated."""
    if option not in line or option in ("--set", "--suite", "--objective"):
        return [*line, option, value]
    at = line.index(option) + 1
    return [*line[:at], value, *line[at + 1 :]]


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


def test_the_same_again_as_one_object_with_more_trials(line, tmp_path, capsys):
    assert run([*line, "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["status"] == "ok"
    assert first["counts"]["trials"] == 12
    assert first["file"] == str(tmp_path / "new" / "toy.toml")
    assert first["comparisons"][0]["sequences"] == 3
    line[line.index("--trials") + 1] = "13"
    assert run([*line, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["counts"]["trials"] == 13
    assert run(["track", TOY, "tests/nothing", "--params", str(tmp_path / "new" / "toy.toml"), "--out", "x"]) == 2
    assert "tests/nothing" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--seeds", "0-5"], "--seeds: got '0-5'"), (["--validation", "x"], "--validation: got 'x'"),
        (["--test", "0:5"], "--test: got 0:5; expected test seeds"),
        (["--trials", "none"], "invalid value for '--trials'"), (["--objective", "HOTTA"], "did you mean HOTA?"),
        (["--only", "reach,skipp"], "did you mean skip?"), (["--set", "reech=1"], "did you mean reach?"),
        (["--set", "weather.sun=1"], "weather.sun"), (["--suite", "no-such"], "--suite: got 'no-such'"),
        (["--prune", "2"], "--prune: got 2.0"), (["--workers", "0"], "invalid value for '--workers'"),
        (["--storage", "nonsense://x"], "--storage"), (["--detections", "image"], "--detections"),
        (["--sensor", "no-such.toml"], "no-such.toml"), (["--out", "toy.json"], "--out: got toy.json"),
    ],
)  # fmt: skip
def test_wrong_options_are_one_line(line, more, words, capsys):
    assert run(changed(line, *more)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.splitlines()) == 1
    assert words in printed.err
