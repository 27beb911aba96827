"""Options that contradict what there is are refused with one line."""

from __future__ import annotations

import sys

import pytest

from benchmarks.belief.__main__ import main
from scenarios.errors import InputError


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("inputs", "sounds"), "PART: got sounds; expected truth, points, boxes, blob, pixels, trackers; "),
        (("noise", "--before", "rule"), "rule: --before: got the baseline rule; expected a belief; "),
        (("suites", "--grouping", "rule"), "rule: --grouping: got the baseline rule; expected a belief; "),
        (("calibration", "--inputs", "dots"), "--inputs: got dots; expected truth, "),
    ],
)
def test_wrong_options_are_one_line(words, line, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["belief", *words])
    with pytest.raises(InputError) as error:
        main()
    assert error.value.line().startswith(line)


def test_each_part_has_its_seeds(monkeypatch):
    given = {}
    monkeypatch.setattr("benchmarks.belief.inputs.inputs", lambda seeds, *_: given.update(seeds))
    monkeypatch.setattr(sys, "argv", ["belief", "inputs", "truth", "pixels", "--pixels-seeds", "3:5"])
    main()
    assert given == {"truth": range(20_000, 20_002), "pixels": range(3, 5)}


@pytest.mark.parametrize(
    "words", [("noise", "--seeds", "0"), ("cost", "--people", "30", "x"), ("cost", "--rounds", "0")]
)
def test_numbers_are_at_least_one(words, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["belief", *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert "expected a number of at least 1, got" in capsys.readouterr().err
