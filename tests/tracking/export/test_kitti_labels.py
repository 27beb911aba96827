"""Labels of KITTI's tracking: levels, boxes as the reader reads them, people in the camera's coordinates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim.store import sequence_folder
from sim.types import Sequence
from tests.made_up import make_sequence
from tests.sim.scene.test_camera_stereo import rig
from tracking.export.kitti import calibration
from tracking.export.kitti_labels import kitti_labels, levels
from tracking.export.labelled_pictures import labelled_pictures
from tracking.recordings.source import open_source


def stored(folder: Path, live: Sequence) -> Path:
    return sequence_folder.write_sequence(folder, live, scenario="schema = 1\n", seed=1)


def rows(path: Path) -> list[list[str]]:
    return [line.split(" ") for line in path.read_text().splitlines()]


def test_levels(tmp_path: Path) -> None:
    """Of truncation at 0.15 and 0.5; of occlusion at 0.2 and 0.5 of what is inside the picture; 3 if ignored."""
    (labelled,) = labelled_pictures(stored(tmp_path / "s", make_sequence(1)))
    people = next(p for p in map(labelled.people, range(1, 13)) if len(p.id) >= 2)
    one = {name: getattr(people, name)[:1] for name in ("rows", "id", "group", "box", "part")}
    for outside, visible, ignored, expected in (
        (0.0, 1.0, False, (0, 0)), (0.14, 0.86, False, (0, 0)), (0.15, 0.85, False, (1, 0)), (0.5, 0.5, False, (2, 0)),
        (0.0, 0.81, False, (0, 0)), (0.0, 0.79, False, (0, 1)), (0.0, 0.51, False, (0, 1)), (0.0, 0.49, False, (0, 2)),
        (0.5, 0.3, False, (2, 1)), (0.0, 0.1, True, (0, 3)),
    ):  # fmt: skip
        person = replace(people, **one, visibility=np.array([visible]), ignored=np.array([ignored]))
        truncation = np.full(len(labelled.truth.id), outside)
        assert tuple(level.tolist()[0] for level in levels(truncation, person)) == expected
        assert levels(None, person)[0].tolist() == [0]


def test_boxes_come_back(tmp_path: Path) -> None:
    """The reader scores who is neither truncated nor ignored; whole numbers are the centres of pixels."""
    live, r = make_sequence(1), np.random.default_rng(0)
    box = r.uniform((-8, -8, 20, 40), (630, 470, 60, 90), (len(live.truth.id), 4))
    truth = live.truth.replace(box=box, truncation=r.uniform(0, 0.3, len(box)))
    stored(tmp_path / "flockscope-train/s", replace(live, load_truth=lambda: truth))
    made = kitti_labels(tmp_path / "flockscope-train/s", tmp_path / "out")
    (labelled,) = labelled_pictures(tmp_path / "flockscope-train/s")
    folder = tmp_path / "out/flockscope-train"
    assert (folder / "evaluate_tracking.seqmap.flockscope-train").read_text() == "s empty 000000 000012\n"
    (back,) = open_source(folder / "label_02/s.txt")
    kept = seen = 0
    for index in range(1, 13):
        people = labelled.people(index)
        scored = ~people.ignored & (labelled.truth.truncation[people.rows] < 0.15)
        here = back.truth.rows(index)
        seen += int(scored.sum())
        assert back.truth.id[here].tolist() == people.id[scored].tolist()
        corners = np.hstack([back.truth.box[here, :2], back.truth.box[here, :2] + back.truth.box[here, 2:]])
        expected = np.clip(people.part[scored] - 0.5, 0, (639, 479, 639, 479))
        assert corners == pytest.approx(expected, abs=0.011)
        kept += int((~people.ignored).sum())
    assert seen > 10
    found = rows(folder / "label_02/s.txt")
    assert (made.pictures, made.kept, made.ignored) == (12, kept, len(found) - kept)
    assert {len(row) for row in found} == {17}
    assert [row[4] for row in found].count("3") == made.ignored > 0


def test_people_stand_where_the_calibration_projects_them(tmp_path: Path) -> None:
    """The middle of the feet, by P2 of calib.txt, and a step ahead, by rotation_y."""
    camera, live = rig(40.0), make_sequence(1)
    truth = live.truth
    place = np.column_stack([np.linspace(-1, 1, len(truth.id)), np.linspace(5, 8, len(truth.id))])
    box = np.tile([20.0, 30.0, 40.0, 50.0], (len(truth.id), 1))
    truth = truth.replace(pos=place, z=np.full(len(place), 0.3), box=box, heading=np.linspace(-3, 3, len(place)))
    live = replace(live, camera=camera, image_size=camera.image, load_truth=lambda: truth)
    kitti_labels(stored(tmp_path / "x/s", live), tmp_path / "out")
    found = np.array([row[3:4] + row[5:6] + row[10:] for row in rows(tmp_path / "out/x/label_02/s.txt")], float)
    assert len(found) == len(place)
    lines = dict(line.split(": ") for line in calibration(camera).splitlines())
    p2, to_camera = (np.array(lines[name].split(), float).reshape(3, 4) for name in ("P2", "Tr"))
    x = np.column_stack([place, np.full(len(place), 0.3), np.ones(len(place))]) @ to_camera.T
    assert found[:, 5:8] == pytest.approx(x, abs=0.006)
    u = np.column_stack([x, np.ones(len(x))]) @ p2.T
    v = np.column_stack([found[:, 5:8], np.ones(len(x))]) @ p2.T
    assert v[:, :2] / v[:, 2:] == pytest.approx(u[:, :2] / u[:, 2:], abs=1)
    height = truth.height
    assert found[:, 2:5] == pytest.approx(np.column_stack([height, 0.27 * height, 0.16 * height]), abs=0.006)
    ahead = np.column_stack([np.cos(truth.heading), np.sin(truth.heading), np.zeros(len(place))]) @ camera.rotation.T
    turn = found[:, 8]
    assert np.cos(turn) * ahead[:, 0] - np.sin(turn) * ahead[:, 2] == pytest.approx(
        np.hypot(ahead[:, 0], ahead[:, 2]), abs=0.001
    )
    seen = turn - np.arctan2(x[:, 0], x[:, 2]) - found[:, 1]
    assert np.cos(seen) == pytest.approx(1, abs=1e-3)
    assert np.abs(found[:, 1]).max() <= np.pi + 0.01


@pytest.mark.parametrize("kind", [None, "top"])
def test_without_a_pinhole_camera_the_solids_are_unknown(tmp_path: Path, kind: str | None) -> None:
    live = make_sequence(1)
    down = replace(live.camera, kind="top", rotation=np.diag([1.0, -1.0, -1.0]), px_per_m=40.0)
    live = replace(live, camera=None if kind is None else down)
    kitti_labels(stored(tmp_path / "x/s", live), tmp_path / "out")
    found = rows(tmp_path / "out/x/label_02/s.txt")
    assert {(row[5], *row[10:]) for row in found} == {
        ("-10.00", "-1.00", "-1.00", "-1.00", "-1000.00", "-1000.00", "-1000.00", "-10.00")
    }
