"""Scores by input: cells of a perfect answer, paired differences, stored scores."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.belief import inputs
from scenarios.errors import InputError
from tests import hand_made


def couple(length: int = 40):
    people = [{1: (0.1 * k, 0.0), 2: (0.1 * k, 0.7), 3: (0.0, 5.0)} for k in range(length)]
    return [hand_made.Scene(here, {7: ([1, 2], None)}) for here in people]


def test_cells_of_a_perfect_answer():
    truth, found = hand_made.truth(couple()), inputs.Found()
    given = inputs.Input(("",), truth, lambda _: [], most=0.5)
    found.add("a", given, hand_made.tracks(couple()))
    cells = dict(zip(inputs.COLUMNS[:7], found.cells(), strict=False))
    assert cells["pairwise F1"] == cells["group F1"] == "1.000"
    assert cells["at most"] == "0.500"
    assert cells["life, s"] == cells["of the truth"] == "4.0"
    assert found.cells()[-2:] == ["0.0%", "0.0%"]


def test_differences_are_own_minus_other():
    own = {f"s{k}": [0.75] * 6 for k in range(6)}
    other = {f"s{k}": [0.5] * 5 + [1.75] for k in range(1, 8)}
    cells = inputs.differences(own, other)
    assert len(cells) == len(inputs.COLUMNS)
    assert cells[0].startswith("+0.250")
    assert cells[4] == "+0.25, +0.25, -1.00"


def test_tables_of_two_beliefs_and_of_stored_scores(tmp_path, monkeypatch, capsys):
    """The second belief finds nobody; its rows, and the differences, stand beside."""
    scenes = couple()

    def made(entry, seed, suite, number, data):
        def grouped(belief):
            return hand_made.tracks(scenes if belief == "good" else [hand_made.Scene(s.people) for s in scenes])

        yield inputs.Input((suite,), hand_made.truth(scenes), grouped)

    monkeypatch.setattr(inputs, "PARTS", {"truth": inputs.Part(made, "0:1", ("cross",))})
    monkeypatch.setattr(inputs, "Belief", str)
    inputs.inputs({"truth": range(6)}, None, tmp_path, "good", "bad", tmp_path / "scores.json")
    printed = capsys.readouterr().out
    assert "| cross | 1.000" in printed
    assert "| cross, before | 0.000" in printed
    assert "| cross, minus before | +1.000" in printed
    monkeypatch.setattr(inputs, "Belief", type(None))
    inputs.inputs({"truth": range(6)}, None, tmp_path, "good", inputs.stored_scores(str(tmp_path / "scores.json")))
    assert "| cross, minus before | +0.000" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["", "[]", json.dumps({"truth": {"cross": {"a": [1.0]}}})])
def test_other_files_are_refused(tmp_path, text):
    path = tmp_path / "scores.json"
    path.write_text(text)
    with pytest.raises(InputError, match="write the file with --json"):
        inputs.stored_scores(str(path))


def test_groups_as_wholes_have_no_lives():
    truth, found = hand_made.truth(couple()), inputs.Found()
    found.add("a", inputs.Input(("",), truth, lambda _: []), hand_made.tracks(couple(), unit="group"))
    assert found.cells()[5] == "–"
    assert np.isfinite(float(found.cells()[6]))
