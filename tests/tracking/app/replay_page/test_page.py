"""The replay page: what it holds comes back exactly, whatever is missing; names cannot break out of it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np

from sim.types import Groups, Sequence, Tracks, Truth
from tracking.app.replay_page import page_rows
from tracking.app.replay_page.page import Run, page_data, write_page

NIL = page_rows.NIL


def data_of(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    return json.loads(found.group(1))


def column(values: list[int]) -> np.ndarray:
    whole = np.cumsum(values).astype(float)
    whole[whole == NIL] = np.nan
    return whole


def decode(side: dict) -> dict[str, np.ndarray]:
    """What decode.js does."""
    stints = np.array(side["stints"]).reshape(-1, 3)
    frame = np.concatenate([np.arange(a, a + n) for _, a, n in stints]) if len(stints) else np.zeros(0)
    pairs = np.array(side["group"]).reshape(-1, 2)
    return {
        "id": np.repeat(stints[:, 0], stints[:, 2]), "frame": frame, "group": np.repeat(pairs[:, 0], pairs[:, 1]),
        "x": column(side["x"]) / side["scale"], "y": column(side["y"]) / side["scale"], "angle": column(side["a"]),
        "box": np.stack([column(c) / 2 for c in side["box"]], axis=1) if side["box"] else None,
    }  # fmt: skip


def test_truth_comes_back(sequence: Sequence, truth: Truth) -> None:
    data = json.loads(json.dumps(page_data(sequence, [])))
    side = decode(data["truth"])
    order = np.lexsort((truth.frame, truth.id))
    np.testing.assert_array_equal(side["id"], truth.id[order])
    np.testing.assert_array_equal(side["frame"], truth.frame[order])
    np.testing.assert_array_equal(side["group"], truth.group[order])
    np.testing.assert_allclose(np.c_[side["x"], side["y"]], truth.pos[order], atol=0.0051)
    np.testing.assert_allclose(side["box"], truth.box[order], atol=0.26)
    walking = np.hypot(*truth.vel[order].T) > 0.1
    aim = np.degrees(np.arctan2(*truth.vel[order][walking].T[::-1]))
    np.testing.assert_allclose(side["angle"][walking], aim, atol=0.51)
    assert np.isnan(side["angle"][~walking]).all()
    assert data["tracks"] is None
    assert [e[0] for e in data["truth"]["events"]] == ["enter", "merge", "cross", "split", "leave"]
    assert data["unlabelled"] == [[151, 160]]


def test_tracks_come_back(sequence: Sequence, tracks: list[Tracks]) -> None:
    side = decode(page_data(sequence, [Run(tracks)])["tracks"])
    for answer in (tracks[0], tracks[90], tracks[-1]):
        now = side["frame"] == answer.index
        order = np.argsort(answer.id)
        np.testing.assert_array_equal(side["id"][now], answer.id[order])
        np.testing.assert_array_equal(side["group"][now], answer.group[order])
        np.testing.assert_allclose(side["x"][now], answer.pos[order, 0], atol=0.0051)
        np.testing.assert_allclose(side["box"][now], answer.box[order], atol=0.26)
    bars = page_data(sequence, [Run(tracks)])["tracks"]["bars"]
    assert sorted(bar[0] for bar in bars) == [0, 7, 8]
    assert page_data(sequence, [Run(tracks)])["tracks"]["links"] == [(54, 7, 0), (114, 0, 8)]


def test_detections_come_back(sequence: Sequence) -> None:
    found = page_data(sequence, [])["detections"]
    boxes = np.concatenate([f.detections.box for f in sequence if f.detections is not None])
    np.testing.assert_allclose(np.stack([column(c) for c in found["box"]], axis=1), boxes, atol=0.51)
    assert sum(n for _, n in found["frames"]) == len(boxes)


def test_the_page_is_self_contained(sequence: Sequence, tracks: list[Tracks], tmp_path: Path) -> None:
    page = write_page(sequence, [Run(tracks)], tmp_path / "new" / "page.html").read_text()
    assert "@@" not in page
    assert re.findall(r"(?:src|href)\s*=|url\(|@import|fetch\(|XMLHttpRequest", page) == []
    assert [u for u in re.findall(r"https?://[^\"'\s]+", page) if u != "http://www.w3.org/2000/svg"] == []
    assert data_of(page)["name"] == "meeting"


def test_names_cannot_break_out(sequence: Sequence, tmp_path: Path) -> None:
    name = '</script><script>alert("x")</script><!-- @@DATA@@ \u2028'
    odd = Sequence(name, 10.0, 160, sequence.frames, sequence.load_truth)
    page = write_page(odd, [], tmp_path / "page.html").read_text()
    assert page.count("<script") == page.count("</script>") == 3
    assert data_of(page)["name"] == name
    assert "<title>&lt;/script&gt;" in page


def test_without_ground_there_is_no_plan(sequence: Sequence, truth: Truth) -> None:
    boxes = Sequence("boxes", 10.0, None, sequence.frames, lambda: truth.replace(pos=None, vel=None))
    data = page_data(boxes, [])
    assert data["bounds"] is None
    assert data["length"] == truth.length
    assert data["truth"]["plane"] == "image"
    assert data["image"] is not None
    assert data["camera"] is None


def test_nobody_anywhere(sequence: Sequence) -> None:
    none = np.zeros(0, np.int64)
    empty = Truth("none", 10.0, 5, 60.0, none, none, none, np.zeros((0, 2)), None, None, np.zeros(0), events=())
    two, cov = np.zeros((0, 2)), np.zeros((0, 4, 4))
    quiet = [Tracks(k, 0.0, "ground", "person", none, none, two, two, cov, groups=Groups.none()) for k in range(1, 6)]
    data = page_data(Sequence("none", 10.0, 5, lambda: iter(()), lambda: empty), [Run(quiet)])
    assert data["truth"]["x"] == data["tracks"]["x"] == []
    assert data["truth"]["bars"] == []
    assert page_data(Sequence("bare", 10.0, None, lambda: iter(())), [])["length"] == 1
