"""Finding trackers, what can work with what, and what a stranger's class may not answer."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim.types import Detections, Sequence, Tracks
from tracking import tracker_registry

STRANGER = """
from dataclasses import dataclass

@dataclass
class Mark:
    x: int = 0

class Mine:
    needs = ("points",)
    def reset(self, context, seed): ...
    def step(self, frame, detections): ...

class NoNeeds:
    needs = "points"
    def reset(self, context, seed): ...
    def step(self, frame, detections): ...

class Nothing: ...

class Number(Mine):
    needs = 5

class Listed(Mine):
    needs = (["boxes"],)

class Unknown(Mine):
    needs = ("boxes", "sound")

class Short(Mine):
    def step(self, frame): ...

class Blind(Mine):
    def reset(self): ...

class Demanding(Mine):
    def __init__(self, x): ...

class Unset(Mine):
    step = None

class Wild(Mine):
    config_class = dict

class Static(Mine):
    @staticmethod
    def step(frame, detections): ...

class Loose(Mine):
    def __init__(self, *args): ...
    def step(self, *args, **more): ...

def function(): ...
"""


def source(**has):
    return Sequence("s", 10.0, 1, lambda: iter(()), **has)


def tracks(n=2, **changes):
    two = np.zeros((n, 2))
    alone = np.full(n, -1)
    made = Tracks(3, 0.2, "ground", "person", np.arange(n), alone, two, two, np.zeros((n, 4, 4)), None, np.ones(n))
    return made.replace(**changes)


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


def test_from_file_under_a_private_name(tmp_path):
    path = tmp_path / "numpy.py"
    path.write_text(STRANGER)
    found = tracker_registry.find(f"{path}:Mine")
    assert found.__module__.startswith("_flockscope_numpy_")
    assert tracker_registry.find(f"{path}:Mine").needs == ("points",)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("blop", "did you mean blob"),
        ("{file}:None_", "a class of this module"),
        ("{file}:NoNeeds", "needs = 'points'"),
        ("{file}:Nothing", "no needs, reset, step"),
        ("{file}:Number", "needs = 5"),
        ("{file}:Listed", "needs = "),
        ("{file}:Unknown", "sound"),
        ("{file}:Short", r"step\(self, frame\); expected a class"),
        ("{file}:Blind", r"reset\(self\); expected a class"),
        ("{file}:Demanding", r"__init__\(x\), called with nothing"),
        ("{file}:Unset", "step = None"),
        ("{file}:Wild", "config_class = "),
        ("{file}:function", "got a function; expected a class"),
        ("{file}:", "a class of this module"),
        ("{leaves}:Mine", "SystemExit: 3"),
        (":Mine", "Empty module name"),
        ("{missing}:Mine", "no such file"),
        ("{broken}:Mine", "ZeroDivisionError"),
        ("no.such.module:Mine", "ModuleNotFoundError"),
    ],
)
def test_wrong_trackers_are_one_line(tmp_path, spec, words):
    (tmp_path / "mine.py").write_text(STRANGER)
    (tmp_path / "broken.py").write_text("1 / 0")
    (tmp_path / "leaves.py").write_text("raise SystemExit(3)")
    paths = {name: tmp_path / f"{name}.py" for name in ("mine", "missing", "broken", "leaves")}
    paths["file"] = paths["mine"]
    with pytest.raises(InputError, match=words) as caught:
        tracker_registry.find(spec.format(**paths))
    assert "\n" not in str(caught.value)


def test_signatures_that_can_be_called_pass(tmp_path):
    (tmp_path / "mine.py").write_text(STRANGER)
    assert [tracker_registry.find(f"{tmp_path}/mine.py:{name}").__name__ for name in ("Static", "Loose")] == [
        "Static",
        "Loose",
    ]


@pytest.mark.parametrize(
    ("needs", "has", "expected"),
    [
        (("boxes",), {"has_detections": True, "load_truth": lambda: None}, "file"),
        (("boxes",), {"has_images": True, "load_truth": lambda: None}, "truth"),
        (("pixels", "boxes"), {"has_images": True, "has_detections": True}, "image"),
        (("pixels", "boxes"), {"has_detections": True}, "file"),
        (("stereo", "points"), {"has_images": True, "load_truth": lambda: None}, "truth"),
        (("stereo",), {"has_images": True, "has_right": True}, "image"),
    ],
)
def test_default_mode(needs, has, expected):
    assert tracker_registry.choose_mode(needs, source(**has), None) == expected


@pytest.mark.parametrize(
    ("needs", "has", "asked"),
    [
        (("boxes",), {"has_images": True}, None),
        (("boxes",), {"has_detections": True}, "truth"),
        (("boxes",), {"has_images": True, "has_detections": True}, "image"),
        (("stereo",), {"has_images": True, "load_truth": lambda: None}, None),
    ],
)
def test_what_cannot_work_names_both_sides(needs, has, asked):
    with pytest.raises(InputError) as caught:
        tracker_registry.choose_mode(needs, source(**has), asked)
    assert needs[0] in str(caught.value)
    assert "images" in str(caught.value) or "detections" in str(caught.value)


def test_nan_names_frame_and_row():
    box = np.ones((3, 4))
    box[1, 2] = np.nan
    with pytest.raises(InputError, match="frame 7: detection 2"):
        tracker_registry.check_detections(
            Detections(7, 0.6, "image", np.ones((3, 2)), None, box, np.ones(3)), ("boxes",)
        )
    with pytest.raises(InputError, match="got points; expected boxes"):
        tracker_registry.check_detections(Detections(7, 0.6, "ground", np.ones((3, 2))), ("boxes",))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"id": np.array([4, 4])}, "the same id twice"),
        ({"id": np.array([-1, 4])}, "id -1"),
        ({"id": np.array([1.0, 2.0])}, "float64"),
        ({"pos": np.zeros((2, 3))}, r"pos of shape \(2, 3\)"),
        ({"vel": np.zeros((1, 2))}, "vel of shape"),
        ({"cov": np.full((2, 4, 4), np.nan)}, "NaN or infinity in cov"),
        ({"box": np.zeros((2, 3))}, "box of shape"),
        ({"index": 4}, "index 4"),
        ({"plane": "floor"}, "floor"),
    ],
)
def test_wrong_answers_name_tracker_frame_and_fault(changes, words):
    with pytest.raises(WorkError, match=words) as caught:
        tracker_registry.check_tracks(tracks(**changes), 3, "mine.py:Mine")
    assert str(caught.value).startswith("mine.py:Mine: frame 3")


def test_right_answers_pass():
    assert tracker_registry.check_tracks(tracks(), 3, "x").id.tolist() == [0, 1]
    assert len(tracker_registry.check_tracks(tracks(0), 3, "x").id) == 0
    assert tracker_registry.check_tracks(tracks(score=np.zeros(0)), 3, "x").score.tolist() == [1.0, 1.0]
    with pytest.raises(WorkError, match="NoneType"):
        tracker_registry.check_tracks(None, 3, "x")
