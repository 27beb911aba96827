import json

import numpy as np
import pytest

from sim.io.store.track_boxes import WIDTH, upright_boxes
from sim.io.store.track_files import read_tracks, tracks_files, write_tracks
from sim.scene.body import PERSON_HEIGHT
from sim.types import Camera

# Level, at (0, 0, 1.7), looking along +y: x right, z down, y forward.
LEVEL = Camera(
    "pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([0.0, 0.0, 1.7]),
    np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
)  # fmt: skip


def test_upright_people_on_stairs_are_seen_higher_up(make_tracks):
    from sim.types import Scene, Stairs

    flight = Stairs(np.array([0.0, 9.0]), np.array([0.0, 11.0]), 4.0, 1.0, 4)
    scene = Scene(np.array([20.0, 20.0]), stairs=(flight,))
    live = [t.replace(pos=np.tile([0.0, 10.0], (len(t.id), 1))) for t in make_tracks(1, boxed=False)]
    text = tracks_files(live, fps=10.0, camera=LEVEL, scene=scene)["tracks.txt"].decode().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in text])
    assert rows[:, 9] == pytest.approx(0.5)
    np.testing.assert_allclose(rows[:, 2:6], upright_boxes(LEVEL, np.tile([0.0, 10.0, 0.5], (len(rows), 1))), atol=0.01)


def test_boxes_of_upright_people():
    """At 10 m the horizon cuts the head, feet are 500 * 1.7 / 10 px below, and the width is seen at about 10 m."""
    pytest.importorskip("sim.scene.camera")
    boxes = upright_boxes(LEVEL, np.array([[0.0, 10.0], [2.0, 20.0], [0.0, -10.0]]))
    left, top, width, height = boxes[0]
    assert top == pytest.approx(240, abs=1e-9)
    assert height == pytest.approx(500 * PERSON_HEIGHT / (10 - WIDTH / 2))
    assert width == pytest.approx(500 * WIDTH / 10, rel=0.01)
    assert left + width / 2 == pytest.approx(320)
    assert boxes[1, 0] > left + width
    assert boxes[1, 3] < height * 0.52
    assert np.isnan(boxes[2]).all(), "behind"
    assert upright_boxes(LEVEL, np.zeros((0, 2))).shape == (0, 4)


def test_a_tracker_without_boxes_gets_them_in_text_only(tmp_path, make_tracks):
    pytest.importorskip("sim.scene.camera")
    live = [t.replace(pos=t.pos + np.array([0, 10])) for t in make_tracks(2, boxed=False)]
    write_tracks(tmp_path, live, fps=10.0, camera=LEVEL)
    assert json.loads((tmp_path / "run.json").read_text())["boxes"] == "projected"
    assert all(t.box is None for t in read_tracks(tmp_path))
    first = (tmp_path / "tracks.mot.txt").read_text().splitlines()[0].split(",")
    assert float(first[4]) > 0
    assert b"-1,-1,-1,-1" in tracks_files(live, fps=10.0)["tracks.txt"]
