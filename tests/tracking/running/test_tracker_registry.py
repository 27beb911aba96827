"""Finding trackers by name, file and module, and refusing classes that are none."""

from __future__ import annotations

import os
import sys

import pytest

from scenarios.errors import InputError
from tracking.running import tracker_registry

STRANGER = """
class Mine:
    needs = ("points",)
    def reset(self, context, seed): ...
    def step(self, frame, detections): ...

class Wrong(Mine):
    {}

class Nothing: ...

def function(): ...
"""
# What is wrong in a class, and what is said of it.
WRONG = {
    "needs = 'points'": "needs = 'points'", "needs = 5": "needs = 5", "needs = (['boxes'],)": "needs = ",
    "needs = ('boxes', 'sound')": "sound", "config_class = dict": "config_class = ",
}  # fmt: skip


def test_registered_and_by_module():
    assert tracker_registry.find("blob") is tracker_registry.find("tracking.papers.blob.tracker:Blob")


def test_a_file_is_loaded_anew_where_it_has_changed(tmp_path):
    path = tmp_path / "mine.py"
    text = "class Mine:\n  needs = ('points',)\n  def reset(self, c, s): pass\n  def step(self, f, d): pass\n"
    path.write_text(text)
    first = tracker_registry.find(f"{path}:Mine")
    assert tracker_registry.find(f"{path}:Mine") is first
    path.write_text(text.replace("points", "boxes"))
    assert tracker_registry.find(f"{path}:Mine").needs == ("boxes",)


SPECS = [
    ("blop", "did you mean blob"), ("nope", "choose one. Your"), ("{mine}:None_", "a class of this module"),
    ("{mine}:", "a class of this module"), ("{mine}:Nothing", "no needs, reset, step"),
    ("{mine}:function", "got a function; expected a class"), ("{leaves}:Mine", "SystemExit: 3"),
    (":Mine", "Empty module name"), ("{missing}:Mine", "no such file"),
    ("{alone}:Mine", "No module named 'wE_missing'; .*put its file beside the tracker's"),
    ("{broken}:Mine", "ZeroDivisionError"), ("no.such.module:Mine", "ModuleNotFoundError"),
]  # fmt: skip


@pytest.mark.parametrize(("spec", "words"), SPECS)
def test_wrong_names_are_one_line(tmp_path, spec, words):
    texts = {"mine": STRANGER.format("..."), "broken": "1 / 0", "leaves": "raise SystemExit(3)"}
    for name, text in {**texts, "alone": "import wE_missing"}.items():
        (tmp_path / f"{name}.py").write_text(text)
    paths = {name: tmp_path / f"{name}.py" for name in (*texts, "alone", "missing")}
    with pytest.raises(InputError, match=words):
        tracker_registry.find(spec.format(**paths))


@pytest.mark.parametrize("body", WRONG)
def test_wrong_classes_are_one_line(tmp_path, body):
    (tmp_path / "mine.py").write_text(STRANGER.format(body))
    with pytest.raises(InputError, match=WRONG[body]):
        tracker_registry.find(f"{tmp_path}/mine.py:Wrong")


NEIGHBOUR = """
from dataclasses import dataclass
from wE_neighbour import REACH
class Mine:
    needs, reach = ("points",), REACH
    def reset(self, context, seed): ...
    def step(self, frame, detections):
        import wE_later
        return wE_later.answer
"""


def test_a_file_imports_the_files_beside_it(tmp_path):
    """As a script does, at once and later."""
    before = list(sys.path)
    (tmp_path / "wE_neighbour.py").write_text("REACH = 3")
    (tmp_path / "wE_later.py").write_text("answer = 4")
    (tmp_path / "mine.py").write_text(NEIGHBOUR)
    found = tracker_registry.find(f"{tmp_path}/mine.py:Mine")
    assert (found.reach, found().step(None, None)) == (3, 4)
    assert sys.path == before


def test_workers_in_another_folder_find_the_file(tmp_path, monkeypatch):
    """`tune FILE.py:Class --cluster` with a relative path was looked for in the folder of each worker."""
    from tracking.episodes.tuned_tracker import tuned_tracker

    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "toy.py").write_text(TUNABLE)
    monkeypatch.chdir(tmp_path)
    tracker = tuned_tracker("own/toy.py:Mine")
    assert (tracker.tracker, tracker.name) == (f"{tmp_path.resolve()}/own/toy.py:Mine", "own/toy.py:Mine")
    monkeypatch.chdir(os.sep)
    assert tuned_tracker(tracker.tracker).code == tracker.code
    assert tracker_registry.located("blob") == "blob"
    assert tracker_registry.located("package.module:Class") == "package.module:Class"


TUNABLE = """
from dataclasses import dataclass
from tracking.config import Config, param

@dataclass(frozen=True)
class MineConfig(Config):
    reach: float = param(1.0, (0.1, 5.0), "m", "reach", "log")

class Mine:
    needs, config_class = ("points",), MineConfig
    def __init__(self, config): ...
    def reset(self, context, seed): ...
    def step(self, frame, detections): ...
"""
