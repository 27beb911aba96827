"""Files are recognised as ours by what is parsed of them."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.files.own_files import GENERATOR, is_ours, marked_png, refuse_foreign_file
from sim.io.files.tables import Column, table_bytes
from sim.io.pictures.video_files import write_video

META = '<meta name="generator" content="flockscope">'
PAGE = f"<!doctype html><head>{META}</head>".encode()
MARKS = {"a": str, "b": dict}


def png() -> bytes:
    cv2 = pytest.importorskip("cv2")
    return bytes(cv2.imencode(".png", np.arange(48, dtype=np.uint8).reshape(4, 4, 3))[1])


def test_a_marked_picture_shows_the_same():
    cv2 = pytest.importorskip("cv2")
    shown = (cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR) for body in (png(), marked_png(png())))
    assert np.array_equal(*shown)


@pytest.mark.parametrize(
    ("name", "body", "expected"),
    [
        ("x.json", b'{"a": "t", "b": {}, "c": 1}', True), ("x.json", b'{"a": "t", "b": []}', False),
        ("x.json", b'["a", "b"]', None), ("x.json", b'{"a": "t", "b": {}', None),
        ("x.parquet", table_bytes([Column("a", np.arange(3))], {}), True), ("x.parquet", b"PAR1", None),
        ("x.html", PAGE, True), ("x.html", b"", False),
        ("x.png", marked_png(png()), True), ("x.png", png(), False), ("x.png", b"", False),
        ("x.mp4", b"flockscope", False), ("x.mp4", b"", False), ("x.txt", PAGE, False),
    ],
)  # fmt: skip
def test_files(tmp_path, name, body, expected):
    path = tmp_path / name
    assert is_ours(path, MARKS) is None
    refuse_foreign_file(path, MARKS)
    path.write_bytes(body)
    assert is_ours(path, MARKS) is expected
    if not expected:
        with pytest.raises(InputError, match="did not write"):
            refuse_foreign_file(path, MARKS)


@pytest.mark.parametrize("comment", [GENERATOR, "another", ""])
def test_videos(tmp_path, comment):
    with write_video(tmp_path / "x.mp4", (32, 32), 10.0, comment=comment) as video:
        video.add(np.zeros((32, 32, 3), np.uint8))
    assert is_ours(tmp_path / "x.mp4") is (comment == GENERATOR)
