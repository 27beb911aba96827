"""Stored episodes of `stress` and `tune` are taken over only if all that decides them is unchanged."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

import tracking
from sim import hashing
from tests.refusals import answer
from tests.tuning_toys import write_scenes
from tracking.app.cli import run
from tracking.running import used_files

GUIDE = Path(tracking.__file__).parents[1] / "docs" / "guides" / "your-own-tracker.md"
EXTRA = """
import importlib
import os
import numpy as np
from nearest import Nearest as Plain

class Nearest(Plain):
    def reset(self, context, seed):
        super().reset(context, seed)
        weights = os.path.join(os.path.dirname(__file__), "weights.npy")
        self.factor = float(np.load(weights))
        assert not os.path.exists("other") and os.listdir(os.path.join(os.path.dirname(__file__), "models"))

    def step(self, frame, detections):
        from lazy import check
        return check(super().step(frame, detections))
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    """The guide's own Walker(Nearest) in two files; between them a class that opens a file and imports late."""
    monkeypatch.chdir(tmp_path)
    nearest, walker = re.findall(r"Save this as `\w+\.py`:\n\n```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    (tmp_path / "own" / "models").mkdir(parents=True)
    (tmp_path / "own" / "models" / "a.bin").touch()
    texts = {"nearest": nearest, "walker": walker.replace("from nearest", "from extra"), "extra": EXTRA}
    for name, text in {**texts, "lazy": "def check(tracks): return tracks\n"}.items():
        (tmp_path / "own" / f"{name}.py").write_text(text)
    np.save(tmp_path / "own" / "weights.npy", np.array(1.0))
    write_scenes(tmp_path)
    return tmp_path


def stress(capsys, *more: str) -> tuple[int, dict[str, list[float]]]:
    """Returns how many of the 2 episodes were taken over, and the scores."""
    capsys.readouterr()
    line = ["stress", "own/walker.py:Walker", "--suite", "one.toml", "--seeds", "0:2", "--start", "2", "--by", "HOTA"]
    found = answer(capsys, *line, "--out", "o", *more)
    assert (found["taken_over"]["stored"] is None) == (found["taken_over"]["episodes"] == 0)
    return found["taken_over"]["episodes"], found["curves"]["own/walker.py:Walker"]["mean"]


def appended(name: str, text: str = "\n# changed\n") -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        (folder / name).write_text((folder / name).read_text() + text)

    return change


CHANGES = {
    "the file": appended("own/walker.py"), "a base class": appended("own/nearest.py"),
    "a class between": appended("own/extra.py"), "a module imported late": appended("own/lazy.py"),
    "weights": lambda folder: np.save(folder / "own" / "weights.npy", np.array(2.0)),
    "a listed folder": lambda folder: (folder / "own" / "models" / "b.bin").touch(),
}  # fmt: skip


def test_a_changed_file_is_not_answered_by_stored_episodes(folder: Path, capsys) -> None:
    assert [stress(capsys)[0], stress(capsys)[0]] == [0, 2]
    for what, change in CHANGES.items():
        change(folder)
        assert [stress(capsys)[0], stress(capsys)[0]] == [0, 2], what


def test_nor_is_a_file_that_two_workers_read(folder: Path, capsys) -> None:
    two = ("--workers", "2")
    assert [stress(capsys, *two)[0], stress(capsys)[0]] == [0, 2]
    CHANGES["a module imported late"](folder)
    assert [stress(capsys)[0], stress(capsys, *two)[0]] == [0, 2]


def test_with_a_limit_of_time_the_files_of_the_other_process_count(folder: Path, capsys) -> None:
    limited = ("--step-timeout", "60")
    assert [stress(capsys, *limited)[0], stress(capsys, *limited)[0], stress(capsys)[0]] == [0, 2, 0]
    CHANGES["a module imported late"](folder)
    assert stress(capsys, *limited)[0] == 0
    CHANGES["weights"](folder)
    assert stress(capsys, *limited)[0] == 0


def test_the_guides_tracker_whose_base_class_is_broken_has_another_score(folder: Path, capsys) -> None:
    """The score fell from .580 to .036 by hand, and stayed .580 here."""
    (folder / "own" / "walker.py").write_text((folder / "own" / "walker.py").read_text().replace("extra", "nearest"))
    _, good = stress(capsys)
    path = folder / "own" / "nearest.py"
    path.write_text(path.read_text().replace("id[new] = self.id[old]", "pass"))
    taken, broken = stress(capsys)
    assert taken == 0
    assert broken[0] < good[0] / 2
    assert (taken, broken) == (0, stress(capsys, "--fresh")[1])


def test_a_package_in_another_folder_has_episodes_of_its_own(folder: Path, capsys, monkeypatch) -> None:
    """As two checkouts have, one of which is on the path: the files of the first are unchanged."""
    nearest = (folder / "own" / "nearest.py").read_text()
    found = []
    for number in "1212":
        package = folder / number / "wT_pkg"
        package.mkdir(parents=True, exist_ok=True)
        (package / "mine.py").write_text("from . import helper\n" + nearest)
        (package / "helper.py").write_text(f"x = {number}")
        with monkeypatch.context() as patch:
            patch.syspath_prepend(folder / number)
            for module in ("wT_pkg", "wT_pkg.mine", "wT_pkg.helper"):
                patch.setitem(sys.modules, module, None)
                del sys.modules[module]
            line = ["stress", "wT_pkg.mine:Nearest", "--suite", "one.toml", "--seeds", "0:2", "--start", "2"]
            found.append(answer(capsys, *line, "--by", "HOTA", "--out", "o")["taken_over"]["episodes"])
    assert found == [0, 0, 2, 2]


def test_a_file_that_was_missing(folder: Path, capsys) -> None:
    appended("own/lazy.py", "\ntry:\n    open('own/more.json')\nexcept OSError:\n    pass\n")(folder)
    assert [stress(capsys)[0], stress(capsys)[0]] == [0, 2]
    (folder / "own" / "more.json").touch()
    assert stress(capsys)[0] == 0


def test_files_that_the_tracker_writes_do_not_count(folder: Path, capsys) -> None:
    text = (
        "\nimport time\nfrom pathlib import Path\nPath('log').write_text(str(time.time()))\nPath('log').read_text()\n"
    )
    appended("own/lazy.py", text)(folder)
    assert [stress(capsys)[0], stress(capsys)[0]] == [0, 2]


def test_other_packages(folder: Path, capsys, monkeypatch) -> None:
    assert [stress(capsys)[0], stress(capsys)[0]] == [0, 2]
    monkeypatch.setattr(used_files, "packages_hash", lambda: "another")
    assert stress(capsys)[0] == 0


def test_a_constant_of_the_scorer_and_the_version_of_numpy_in_a_copy(folder: Path, capsys, monkeypatch) -> None:
    """With hashes of a copy of the sources."""
    for name in hashing.PACKAGES:
        source = Path(hashing.__file__).parents[1] / name
        shutil.copytree(source, folder / "copy" / name, ignore=shutil.ignore_patterns("__pycache__"))
    constants = folder / "copy" / "tracking" / "scoring" / "ground_or_image.py"
    monkeypatch.setattr(hashing, "__file__", str(folder / "copy" / "sim" / "hashing.py"))
    monkeypatch.setattr(hashing, "versions", hashing.versions.__wrapped__)

    def taken() -> int:
        monkeypatch.setattr("tracking.stress.sweep.runtime", cache(hashing.runtime.__wrapped__))
        return stress(capsys)[0]

    assert [taken(), taken()] == [0, 2]
    constants.write_text(constants.read_text() + "\n# another constant\n")
    assert [taken(), taken()] == [0, 2]
    version = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "2.0.99" if name == "numpy" else version(name))
    assert [taken(), taken()] == [0, 2]


TUNE = (
    "tune", "own/walker.py:Walker", "--suite", "one.toml", "--trials", "2", "--seeds", "0:2", "--check", "none",
    "--validation", "10000:10001", "--test", "20000:20001", "--out", "w.toml",
)  # fmt: skip


def tune(capsys, *more: str) -> dict:
    capsys.readouterr()
    return answer(capsys, *TUNE, *more)


@pytest.mark.parametrize("what", ["a base class", "a module imported late", "weights"])
def test_a_search_of_another_tracker_is_refused_and_begins_anew_with_fresh(folder: Path, capsys, what: str) -> None:
    assert tune(capsys)["taken_over"] == {"trials": 0, "episodes": 0, "stored": None}
    again = tune(capsys)["taken_over"]
    assert again["trials"] == 2
    assert again["episodes"] > 0
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d", again["stored"])
    CHANGES[what](folder)
    assert run([*TUNE]) == 2
    assert "--fresh" in capsys.readouterr().err
    assert tune(capsys, "--fresh")["taken_over"]["trials"] == 0
    assert tune(capsys)["taken_over"]["trials"] == 2
