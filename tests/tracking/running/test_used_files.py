"""What a tracker has used: files and folders that decide its answers, however it comes by them."""

from __future__ import annotations

import compileall
import shutil
import sys
from pathlib import Path

import pytest
from numba import _helperlib

from tracking.running.tracker_registry import find
from tracking.running.used_files import changes, inside, owner_of, used

TRACKER = """
import ctypes, cv2, importlib.util, os
from pathlib import Path
from . import helper

HERE = Path(__file__).parent

def plugin():
    spec = importlib.util.spec_from_file_location("plugin", HERE / f"plug{1}.py")
    spec.loader.exec_module(importlib.util.module_from_spec(spec))

class Mine:
    needs = ("points",)
    def step(self, frame, detections): ...
    def reset(self, context, seed):
        HOW
"""
FILES = {"__init__.py": "", "helper.py": "x = 1", "plug1.py": "x = 1", "models/gain.yml": "%YAML:1.0\n---\ngain: 1\n"}
# What `reset` does, the path below the package that is changed then, and the path that is found to have changed.
READ = {
    "a listing of the package's folder": ("os.listdir(HERE)", "new.json", ""),
    "a file that OpenCV opens": ("cv2.FileStorage(str(HERE / 'models' / 'gain.yml'), 0)", *["models/gain.yml"] * 2),
    "a module that is in no list": ("plugin()", "plug1.py", "plug1.py"),
    "a compiled library": ("ctypes.CDLL(str(HERE / f'{1}.so'))", "1.so", "1.so"),
    "a link to another package": ("pass", "../a", "helper.py"),
}


@pytest.mark.parametrize("what", READ)
def test_what_a_package_reads(tmp_path: Path, monkeypatch, what: str) -> None:
    how, changed, found = READ[what]
    package = tmp_path / f"wU_{tmp_path.name}"  # what one has used is kept by its name
    for version in "ab":
        (tmp_path / version / "models").mkdir(parents=True)
        for name, text in {**FILES, "mine.py": TRACKER.replace("HOW", how)}.items():
            (tmp_path / version / name).write_text(text)
    compileall.compile_dir(tmp_path / "a", quiet=1)  # so that sources are not opened
    shutil.copy(_helperlib.__file__, tmp_path / "a" / "1.so")
    (tmp_path / "b" / "helper.py").write_text("x = 2")
    package.symlink_to("a")
    monkeypatch.syspath_prepend(tmp_path)
    tracker = find(f"{package.name}.mine:Mine")
    with inside(owner_of(tracker.__module__)):
        tracker().reset(None, 0)
    before = used(tracker)
    assert changes(before) == []
    (package if changed == "../a" else package / changed).unlink(missing_ok=True)
    package.symlink_to("b") if changed == "../a" else (package / changed).write_text("x = 22")
    assert changes(before) == [str(package / found)]
    for module in [name for name in sys.modules if name.startswith(package.name)]:
        del sys.modules[module]
