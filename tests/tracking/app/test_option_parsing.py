"""Labels of runs: LABEL=RUN in score, view and stress, and paths that contain "="."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios.errors import InputError
from tests.processes import FAKE
from tests.refusals import answer, refused
from tests.tuning_toys import write_scenes
from tracking.app.cli import run
from tracking.app.option_parsing import labelled, split_label


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("mine=runs/a", ("mine", "runs/a")),
        ("mine=blob", ("mine", "blob")),
        ("a=b=c", ("a", "b=c")),
        ("mine=new.py:Class", ("mine", "new.py:Class")),
        ("runs/a", ("", "runs/a")),
        ("runs/a=b", ("", "runs/a=b")),
        ("lr=0.1", ("", "lr=0.1")),
        ("my=own.py:Class", ("", "my=own.py:Class")),
        ("new=lr=0.1", ("new", "lr=0.1")),
        ("new=my=own.py:Class", ("new", "my=own.py:Class")),
    ],
)
def test_what_exists_has_no_label(text: str, parts: tuple[str, str], tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lr=0.1").mkdir()
    Path("my=own.py").touch()
    assert split_label(text) == parts


@pytest.mark.parametrize("text", ["=blob", "mine=", "oracle=blob", "oracle from boxes=blob"])
def test_wrong_labels(text: str) -> None:
    with pytest.raises(InputError, match="expected LABEL=RUN"):
        split_label(text)


def test_names_are_unique() -> None:
    assert labelled(["x/a", "y/a", "b=x/a"], lambda text: text[-1]) == {"x/a": "x/a", "y/a": "y/a", "b": "x/a"}
    with pytest.raises(InputError, match=r"got a twice.*label"):
        labelled(["a=x", "a=y"])


def test_labels_of_runs_and_trackers(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    scene = Path(write_scenes(tmp_path)[0]).name
    assert run(["generate", scene, "--seeds", "0:2", "--out", "data", "--streams", "none"]) == 0
    assert run(["track", FAKE, "data", "--out", "lr=0.1"]) == 0
    found = answer(capsys, "score", "data", "lr=0.1", "first=lr=0.1", f"fake={FAKE}")
    assert {row["run"] for row in found["ranking"]} >= {"first", "lr=0.1", "fake"}
    assert run(["view", "data", "first=lr=0.1", f"fake={FAKE}", "--out", "pages"]) == 0
    page = Path("pages/index.html").read_text(encoding="utf-8")
    assert all(f'<th scope="row">{name}</th>' in page for name in ("first", "fake"))
    options = ["--suite", scene, "--seeds", "0:2", "--start", "2", "--by", "HOTA", "--out", "o"]
    assert run(["stress", f"old={FAKE}", FAKE, *options]) == 0
    assert json.loads(Path("o/stress.json").read_text())["curves"].keys() == {"old", FAKE, "oracle"}
    assert "first twice" in refused(capsys, "score", "data", "first=lr=0.1", f"first={FAKE}")


@pytest.mark.parametrize("text", ["=blob", " =blob", "mine=", "oracle x=blob"])
def test_a_label_says_something_and_is_not_the_oracles(text):
    with pytest.raises(InputError, match="LABEL=RUN"):
        split_label(text)
