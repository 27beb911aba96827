"""`flockscope compare`: verdicts from intervals and tolerance, exit codes, and what is no comparison."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refused
from tracking.app.cli import run

KEYS = ("objective", "IDSW")


def stored(path: Path, objective, switches=None, **more) -> str:
    columns = [np.asarray(objective, float), np.zeros(len(objective)) if switches is None else switches]
    rows = [
        {"name": f"s{k}", "similarity": "ground", **dict(zip(KEYS, map(float, values), strict=True)), **more}
        for k, values in enumerate(zip(*columns, strict=True))
    ]
    path.write_text(json.dumps({"status": "ok", "sequences": rows}))
    return str(path)


BASE = np.array([0.5, 0.6, 0.7, 0.8, 0.55, 0.65])
NOISE = np.array([0.02, -0.02, 0.01, -0.01, 0.015, -0.015])


VERDICTS = [
    (-0.1 + NOISE, "regression", 1),
    (0.1 + NOISE, "improvement", 0),
    (NOISE / 10, "no difference", 0),
    (10 * NOISE, "too noisy", 0),
    (-0.05 + 10 * NOISE, "too noisy", 0),
    (0.05 + 10 * NOISE, "too noisy", 0),
    (-0.005 + NOISE / 100, "no difference", 0),
]


@pytest.mark.parametrize(("change", "verdict", "code"), VERDICTS)
def test_verdicts(change, verdict, code, tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE + change)
    assert run(["compare", before, now, "--json"]) == code
    (row,) = json.loads(capsys.readouterr().out)["scores"]
    assert row["verdict"] == verdict
    assert row["low"] <= row["difference"] <= row["high"]


def test_more_switches_are_worse(tmp_path, capsys):
    before = stored(tmp_path / "a.json", BASE, np.arange(6.0))
    now = stored(tmp_path / "b.json", BASE, np.arange(6.0) + 3 + NOISE)
    assert run(["compare", before, now, "--by", "IDSW", "--by", "objective"]) == 1
    assert "IDSW" in (text := capsys.readouterr().out)
    assert "regression" in text


def test_a_saved_baseline_gives_the_same_verdict(tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE - 0.1 + NOISE)
    small = tmp_path / "small.json"
    assert run(["compare", before, before, "--save", str(small)]) == 0
    capsys.readouterr()
    assert run(["compare", str(small), now]) == 1
    assert len(small.read_bytes()) < 1000


NOT_COMPARED = [
    (lambda p: stored(p, BASE[:4], truth="a"), "incomplete: got no s4, s5"),
    (lambda p: stored(p, np.append(BASE, 0.5), truth="a"), "incomplete: got s6, not in"),
    (lambda p: stored(p, BASE, similarity="image", truth="a"), "s0: similarity: got 'image'"),
    (lambda p: stored(p, BASE, truth="b"), "s0: truth"),
    (lambda p: stored(p, BASE, truth=None), "s0: truth: got None"),
    (lambda p: str(p.parent), "no scores of sequences; expected a file of `flockscope score --json`"),
    (lambda p: (p.write_text('{"sequences": [{"name": "a"}, {"name": "a"}]}'), str(p))[1], "a sequence twice"),
]


@pytest.mark.parametrize(("write", "words"), NOT_COMPARED)
def test_what_is_not_compared_ends_with_2(write, words, tmp_path, capsys):
    before = stored(tmp_path / "a.json", BASE, truth="a")
    assert words in refused(capsys, "compare", before, write(tmp_path / "b.json"))


OPTIONS = [
    (1, [], "too few"),
    (2, ["--by", "HOTA"], "choose other scores, that both have: --by objective --by IDSW"),
    (6, ["--save", "mine.txt"], "ends in .json"),
]


@pytest.mark.parametrize(("sequences", "more", "words"), OPTIONS)
def test_scores_and_files_that_cannot_be(sequences, more, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    few = stored(tmp_path / "a.json", BASE[:sequences])
    assert words in refused(capsys, "compare", few, few, *more)
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
