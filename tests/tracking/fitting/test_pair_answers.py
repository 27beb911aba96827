"""Files of answers: what they tell of the evidence, and what is refused, in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.near_pairs import evidence_of
from tracking.fitting.pair_answers import AnswerFile, answered_rows

PAIRS = evidence_of(0, people=12)
SAID = [
    {"a": 10, "b": 11, "from": 4.0, "to": 8.0, "answer": "together"},
    {"a": 13, "b": 12, "from": 0.0, "to": 4.0, "answer": "don't know"},
    {"a": 15, "b": 14, "from": 0.0, "to": 4.0, "answer": "not"},
]
FILE = {"format": 1, "kind": "pair labels", "recording": "walk", "people": PAIRS.people, "frames": 60, "answers": SAID}


def written(folder: Path, text: object) -> Path:
    path = folder / "answers.json"
    path.write_text(text if isinstance(text, str) else json.dumps(text))
    return path


def test_rows_of_the_stretches(tmp_path):
    file = AnswerFile.read(written(tmp_path, FILE))
    assert file.counts() == "1 together, 1 not, 1 don't know"
    ((pairs, found),) = answered_rows([file], {"other": evidence_of(1), "walk": PAIRS})
    assert pairs is PAIRS
    first, second = (found.row[found.question == k] for k in (0, 1))
    assert PAIRS.step[first].tolist() == list(range(10, 21))
    assert set(PAIRS.a[first]) == {10}
    assert PAIRS.step[second].tolist() == list(range(11))
    assert set(PAIRS.b[second]) == {15}
    np.testing.assert_array_equal(found.together, found.question == 0)


def changed(**values):
    return FILE | values


def said(**values):
    return changed(answers=[SAID[0] | values, *SAID[1:]])


BAD = {
    "broken": ('{"format": 1, ', "", "answers.json"),
    "a list": ("[1]", "", "JSON object"),
    "another file": ({"format": 1, "tracks": 3}, "kind", "nothing"),
    "another kind": (changed(kind="scores"), "kind", "pair labels"),
    "another format": (changed(format=2), "format", "2"),
    "no answers": (changed(answers=[]), "answers", "0 answers"),
    "all unknown": (changed(answers=SAID[1:2]), "answers", "1 answer"),
    "another word": (said(answer="perhaps"), "answers[0].answer", "perhaps"),
    "no number": (said(**{"from": None}), "answers[0].from", "None"),
    "another recording": (changed(people="0" * 64), "people", "of walk, 60 frames"),
    "unknown person": (said(b=99), "answers[0]", "person 99"),
    "never near": (said(**{"from": 400.0, "to": 500.0}), "answers[0]", "10 and 11 from 400 to 500 s"),
}


@pytest.mark.parametrize("what", BAD)
def test_refused(tmp_path, what):
    content, place, got = BAD[what]
    path = written(tmp_path, content)
    with pytest.raises(InputError) as error:
        answered_rows([AnswerFile.read(path)], {"walk": PAIRS})
    assert error.value.file == str(path)
    assert error.value.place.startswith(place)
    assert got in error.value.line()
    assert error.value.remedy
