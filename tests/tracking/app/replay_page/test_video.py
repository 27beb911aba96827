"""The video of a replay page: every frame in its slot, inside the page or beside it."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.coded_pictures import SIZE, number, sequence
from tracking.app.replay_page.page import write_page
from tracking.app.replay_page.video import PageVideo, page_video
from tracking.recordings.source import open_source


def shown(made: PageVideo, folder: Path) -> list[tuple[float, int]]:
    """(time, number) of the video's frames, as a player decodes them."""
    import av

    path = folder / "decoded.mp4"
    path.write_bytes(base64.b64decode(made.content) if made.content else (folder / made.address).read_bytes())
    with av.open(str(path)) as container:
        return [(float(f.time), number(f.to_ndarray(format="bgr24"))) for f in container.decode(video=0)]


@pytest.mark.parametrize("fps", [10.0, 2.5, 30000 / 1001, 7.0])
def test_each_frame_is_in_its_slot(tmp_path: Path, fps: float) -> None:
    made = page_video(sequence(70, fps), tmp_path / "page.html")
    assert made.address == ""
    assert made.fps == pytest.approx(fps, abs=1e-9)
    found = shown(made, tmp_path)
    assert [k for _, k in found] == list(range(1, 71))
    np.testing.assert_allclose([t for t, _ in found], np.arange(70) / fps, atol=1e-4)
    assert not (tmp_path / "page.view.mp4").exists()


def test_a_lost_frame_keeps_its_slot_and_is_told(tmp_path: Path) -> None:
    made = page_video(sequence(9, lost=(4, 5)), tmp_path / "page.html")
    assert made.lost == (4, 5)
    assert [k for _, k in shown(made, tmp_path)] == [1, 2, 3, 3, 3, 6, 7, 8, 9]
    assert page_video(sequence(9, lost=(1,)), tmp_path / "page.html").lost == (1,)


def test_large_ones_stand_beside_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tracking.app.replay_page.video.LARGE", 100)
    made = page_video(sequence(5), tmp_path / "a page.html")
    assert (made.address, made.content) == ("a%20page.view.mp4", "")
    assert (tmp_path / "a page.view.mp4").exists()
    assert page_video(sequence(5), tmp_path / "b.html", "inside").address == ""
    assert page_video(sequence(5), tmp_path / "b.html", "none") is None
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a page.view.mp4"]


def test_neither_source_nor_overlay_is_replaced(tmp_path: Path) -> None:
    """README: `view --out replay.html` and `overlay --out replay.mp4`."""
    made = page_video(sequence(5), tmp_path / "a.html", "beside")
    (tmp_path / "a.mp4").write_bytes(before := b"an overlay")
    page_video(sequence(5), tmp_path / "a.html", "beside")
    assert (tmp_path / "a.mp4").read_bytes() == before
    whole = (tmp_path / made.address).read_bytes()
    (read,) = open_source(tmp_path / made.address)
    with pytest.raises(InputError, match="the source itself"):
        page_video(read, tmp_path / "a.html", "beside")
    assert (tmp_path / made.address).read_bytes() == whole


def test_the_page_holds_the_video(tmp_path: Path) -> None:
    bare = sequence(5)
    made = page_video(bare, tmp_path / "page.html")
    page = write_page(bare, [], tmp_path / "page.html", video=made).read_text()
    (held,) = re.findall(r'<script type="text/plain" id="film">(.*?)</script>', page, re.DOTALL)
    assert held == made.content
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    facts = json.loads(data)
    assert facts["video"] == {"src": "", "fps": 10.0, "lost": []}
    assert facts["image"] == list(SIZE)
    assert json.loads(
        re.findall(r'id="data">(.*?)</script>', write_page(bare, [], tmp_path / "x.html").read_text(), re.DOTALL)[0]
    )["video"] is None  # fmt: skip
