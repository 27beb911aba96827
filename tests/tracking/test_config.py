"""Configs: declared once, parsed strictly, derived everywhere."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from scenarios.errors import InputError
from tracking.config import Config, file_of, param, read_params
from tracking.papers.blob.config import BlobConfig
from tracking.running.tracker_registry import find, names


@dataclasses.dataclass(frozen=True)
class Small(Config):
    tracker = "small"
    rate: float = param(1.0, (0.1, 10.0), "1/s", "a rate", "log")
    count: int = param(3, (1, 9), "", "a count", "int", online=False)
    kind: str = param("a", ("a", "b"), "", "a choice", "categorical")
    on: bool = param(True, (True, False), "", "a switch", "categorical", tunable=False)


def test_spaces_are_derived():
    assert [p.name for p in Small.space()] == ["rate", "count", "kind"]
    assert [p.name for p in Small.space(online=True)] == ["rate", "kind"]
    rate = Small.params()["rate"]
    assert (rate.default, rate.low, rate.high, rate.scale, rate.unit) == (1.0, 0.1, 10.0, "log", "1/s")


def test_set_parses_each_kind():
    config = Small().with_set("rate=2", "tracker.count=4", "kind=b", "on=false")
    assert config == Small(2.0, 4, "b", False)
    assert type(config.rate) is float


WRONG_ASSIGNMENTS = [
    ("raet=2", "did you mean rate?"), ("rate=11", "a number from 0.1 to 10"),
    ("rate=nan", "a number from 0.1 to 10"), ("rate=x", "a number from 0.1 to 10"), ("count=2.5", "an integer"),
    ("kind=c", "one of a, b"), ("rate", "name=value"),
]  # fmt: skip


@pytest.mark.parametrize(("assignment", "words"), WRONG_ASSIGNMENTS)
def test_wrong_assignments_name_what_was_expected(assignment, words):
    with pytest.raises(InputError, match=words.replace("?", r"\?")):
        Small().with_set(assignment)


@pytest.mark.parametrize("values", [{"rate": True}, {"rate": "1"}, {"count": 10}, {"on": 1}, {"kind": "c"}])
def test_wrong_values_are_refused(values):
    with pytest.raises(InputError):
        Small.from_dict(values)


def test_toml_round_trip(tmp_path):
    path, config = tmp_path / "p.toml", Small(0.30000000000000004, 5, "b", False)
    path.write_text(config.to_toml())
    assert Small.from_toml(path) == config


WRONG_FILES = [
    ('tracker = "blob"', "expected small"), ("[params]\nrat = 1", "did you mean rate"), ("rate = 1", "under"),
    ("params = 3", "under"), ("x = = 1", "TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), WRONG_FILES)
def test_wrong_files_are_one_line(tmp_path, text, words):
    path = tmp_path / "p.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        Small.from_toml(path)
    assert "p.toml" in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        Small.from_toml(tmp_path / "none.toml")


WITH_PRESETS = [find(name).config_class for name in names()]


@pytest.mark.parametrize("kind", WITH_PRESETS, ids=names())
def test_the_paper_preset_names_every_parameter_that_is_ours(kind):
    """A parameter whose meaning says "ours" has its off value in the file, or a value without effect."""
    given = read_params(file_of(kind.tracker, "paper"), kind.tracker)
    ours = {name for name, p in kind.params().items() if re.search(r"\bours\b", p.meaning)}
    assert ours
    assert not ours - given.keys(), "give them their off values in tracking/presets/paper"
    paper = kind.load("paper")
    assert all(np.array_equal(getattr(paper, name), value) for name, value in given.items())


def test_a_preset_is_found_by_name_beside_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paper").write_text("[params]\ngate = 0.5\n")
    assert BlobConfig.load("paper") != BlobConfig()
    assert BlobConfig.load("./paper") == BlobConfig.load(tmp_path / "paper") == BlobConfig(gate=0.5)
    with pytest.raises(InputError, match="preset of blob: paper"):
        BlobConfig.load("papers")
    with pytest.raises(InputError, match="No such file"):
        Small.load("paper2")


def test_a_vector_has_as_many_numbers_as_its_default():
    @dataclasses.dataclass(frozen=True)
    class Rows(Config):
        rows: tuple[float, ...] = param((0.1, 0.5), (0.0, 1.0), "", "by row", "vector")

    assert Rows.from_dict({"rows": [1, 0.25]}).rows == (1.0, 0.25)
    assert Rows().with_set("rows=[0.2, 0.3]") == Rows().with_set("rows=0.2,0.3") == Rows((0.2, 0.3))
    assert not Rows.space()
    for wrong in ([0.1], [0.1, 0.2, 0.3], [0.1, 1.5], [0.1, "a"], 0.1, "ab"):
        with pytest.raises(InputError, match=r"2 numbers from 0 to 1"):
            Rows.from_dict({"rows": wrong})
    with pytest.raises(InputError, match=r"2 numbers from 0 to 1"):
        Rows().with_set("rows=0.2")
