"""What a tracker has used: files and folders that decide its answers, however it comes by them."""

from __future__ import annotations

import compileall
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tracking.running.tracker_registry import find
from tracking.running.used_files import changes, inside, owner_of, used

TRACKER = """
import ctypes
import importlib.util
import os
from pathlib import Path
import cv2
from . import helper

HERE = Path(__file__).parent

def plugin():
    spec = importlib.util.spec_from_file_location("plugin", HERE / f"plug{{1}}.py")
    spec.loader.exec_module(importlib.util.module_from_spec(spec))

class Mine:
    needs = ("points",)
    def step(self, frame, detections): ...
    def reset(self, context, seed):
        {}
"""
PLACE = "models"


@pytest.fixture
def name(tmp_path: Path) -> str:
    """Name of the test's package: what one has used is kept by its name."""
    return f"wU_{tmp_path.name}"


def write(package: Path, statement: str = "pass") -> Path:
    (package / PLACE).mkdir(parents=True)
    texts = {"__init__.py": "", "helper.py": "x = 1", "mine.py": TRACKER.format(statement), "plug1.py": "x = 1"}
    for name, text in {**texts, f"{PLACE}/gain.yml": "%YAML:1.0\n---\ngain: 1\n"}.items():
        (package / name).write_text(text)
    return package


@pytest.fixture
def imported(monkeypatch, name: str) -> Callable[[Path], type]:
    """Returns the class of a package in a folder; the package is imported anew, and no longer after the test."""

    def load(folder: Path) -> type:
        monkeypatch.syspath_prepend(folder)
        for module in (name, f"{name}.mine", f"{name}.helper"):
            monkeypatch.setitem(sys.modules, module, None)
            del sys.modules[module]
        return find(f"{name}.mine:Mine")

    return load


def used_in_reset(tracker: type) -> dict[str, str]:
    with inside(owner_of(tracker.__module__)):
        tracker().reset(None, 0)
    found = used(tracker)
    assert changes(found) == []
    return found


READ = {
    "a listing of the package's folder": ("os.listdir(HERE)", "new.json"),
    "a file that OpenCV opens": ("cv2.FileStorage(str(HERE / 'models' / 'gain.yml'), 0)", "models/gain.yml"),
    "a module that is in no list": ("plugin()", "plug1.py"),
}  # fmt: skip


@pytest.mark.parametrize("what", READ)
def test_what_a_package_reads(tmp_path: Path, imported, name: str, what: str) -> None:
    statement, changed = READ[what]
    package = write(tmp_path / name, statement)
    compileall.compile_dir(package, quiet=1)  # the plugin's source is not opened
    found = used_in_reset(imported(tmp_path))
    (package / changed).write_text("x = 22")
    assert changes(found) == [str(package if "listing" in what else package / changed)]


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_compiled_library(tmp_path: Path, imported, name: str) -> None:
    package, source = write(tmp_path / name, "ctypes.CDLL(str(HERE / f'{1}.so'))"), tmp_path / "k.c"
    source.write_text("int f(void){return 1;}")
    subprocess.run(["cc", "-shared", "-o", package / "1.so", source], check=True)
    found = used_in_reset(imported(tmp_path))
    (package / "1.so").unlink()  # the loaded one stays whole
    (package / "1.so").write_bytes(b"another")
    assert changes(found) == [str(package / "1.so")]


def test_a_link_to_another_package(tmp_path: Path, imported, name: str) -> None:
    for folder in "ab":
        write(tmp_path / folder / name)
    compileall.compile_dir(tmp_path, quiet=1)
    (tmp_path / "b" / name / "helper.py").write_text("x = 2")
    (tmp_path / "now").symlink_to("a")
    found = used_in_reset(imported(tmp_path / "now"))
    (tmp_path / "now").unlink()
    (tmp_path / "now").symlink_to("b")
    assert changes(found) == [str(tmp_path / "now" / name / "helper.py")]
