"""Names of sequences are labels: whatever a label holds, its path stays inside the folder of --out."""

from __future__ import annotations

import fcntl
import os
from contextlib import ExitStack
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from scenarios.errors import InputError
from sim.pictures.video_files import write_video
from sim.store import own_files
from sim.store.atomic import PARTIAL, lock_folder
from sim.store.tables import table_bytes

EVIL = (
    "../../x", "/etc/passwd", "..", ".", "", "a\0b", "a/b", "a\\b", "C:x", "con", "NUL.txt", "\u202egnp.exe", "x" * 300,
    "ä" * 200, ".partial-x", ".hidden", "a.", "a ", "\udcff", "a\nb", "~", "-rf", "${HOME}",
)  # fmt: skip
ENDINGS = ("", ".html", ".view.mp4", "-s00001")
labels = st.one_of(st.text(max_size=300), st.text("./\\\0 aé\n:", max_size=20), st.sampled_from(EVIL))


def check(folder: Path, label: str, ending: str) -> None:
    path = own_files.output_path(folder, label, ending)
    assert path.parent == folder
    assert path.name not in ("", ".", "..")
    assert not path.name.startswith(".")
    assert os.path.realpath(path) == os.path.join(os.path.realpath(folder), path.name)
    temporary = f"{PARTIAL}{path.name}-{'0' * 12}"
    assert len(os.fsencode(temporary)) <= 255
    temporary.encode("utf-8")


@given(labels, st.sampled_from(ENDINGS))
@example("../../x", "")
def test_no_label_leaves_the_folder(label: str, ending: str) -> None:
    check(Path("/some/folder"), label, ending)


@given(st.lists(labels, max_size=5))
def test_no_two_labels_share_a_path(names: list[str]) -> None:
    try:
        paths = own_files.output_paths(Path("out"), names, ".png")
    except InputError:
        return
    assert len({str(path).casefold() for path in paths}) == len(names)


@pytest.mark.parametrize(("a", "b"), [("x", "x"), ("a/b", "a_b"), ("A", "a"), ("x" * 300, "x" * 301), ("", "_")])
def test_two_labels_of_one_file_are_refused(a: str, b: str) -> None:
    with pytest.raises(InputError, match="unique names"):
        own_files.output_paths(Path("out"), [a, b])


META = '<meta name="generator" content="flockscope">'
PAGE = f"<!doctype html><head>{META}</head>".encode()
MARKS = {"a": str, "b": dict}


def png() -> bytes:
    return bytes(cv2.imencode(".png", np.arange(48, dtype=np.uint8).reshape(4, 4, 3))[1])


def test_a_marked_picture_shows_the_same():
    shown = (
        cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR) for body in (png(), own_files.marked_png(png()))
    )
    assert np.array_equal(*shown)


FILES = [
    ("x.json", b'{"a": "t", "b": {}, "c": 1}', True), ("x.json", b'{"a": "t", "b": []}', False),
    ("x.json", b'["a", "b"]', None), ("x.json", b'{"a": "t", "b": {}', None),
    ("x.parquet", table_bytes({"a": np.arange(3)}, {}, {}), True), ("x.parquet", b"PAR1", None),
    ("x.html", PAGE, True), ("x.html", b"", False), ("x.toml", b"a = 1\n# flockscope x", False),
    ("x.png", own_files.marked_png(png()), True), ("x.png", png(), False), ("x.png", b"", False),
    ("x.mp4", b"flockscope", False), ("x.mp4", b"", False), ("x.txt", PAGE, False), ("x.toml", b"# flockscope x", True),
]  # fmt: skip


@pytest.mark.parametrize(("name", "body", "expected"), FILES)
def test_files(tmp_path, name, body, expected):
    path = tmp_path / name
    assert own_files.is_ours(path, MARKS) is None
    own_files.refuse_foreign_file(path, MARKS)
    path.write_bytes(body)
    assert own_files.is_ours(path, MARKS) is expected
    if not expected:
        with pytest.raises(InputError, match="did not write"):
            own_files.refuse_foreign_file(path, MARKS)


@pytest.mark.parametrize("comment", [own_files.GENERATOR, "another", ""])
def test_videos(tmp_path, comment):
    with write_video(tmp_path / "x.mp4", (32, 32), 10.0, comment=comment) as video:
        video.add(np.zeros((32, 32, 3), np.uint8))
    assert own_files.is_ours(tmp_path / "x.mp4") is (comment == own_files.GENERATOR)


@pytest.mark.parametrize("step", ["mkdir", "flock"])
def test_nobody_removes_or_replaces_a_folder_that_another_locks(tmp_path, monkeypatch, step):
    """The other comes between two steps of the first: before its mkdir, or between its open and its flock."""
    root, stack, place = tmp_path / "a/out", ExitStack(), {"mkdir": Path, "flock": fcntl}[step]
    original = getattr(place, step)

    def late(*given, **more):
        monkeypatch.undo()
        if step == "flock":
            root.rmdir()
        stack.enter_context(lock_folder(root))
        return original(*given, **more)

    monkeypatch.setattr(place, step, late)
    with stack:
        for _ in range(2):
            with pytest.raises(InputError, match="another run"), lock_folder(root):
                pass
        assert root.is_dir()
    assert not root.exists()
