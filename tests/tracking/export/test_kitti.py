"""KITTI export: pictures, disparities and calibration as KITTI's own tools read them."""

from __future__ import annotations

import os
from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.camera import project_pair
from sim.store import sequence_folder
from sim.streams import decode_disparity
from tests.made_up import make_pictured, make_sequence
from tests.sim.scene.test_camera_stereo import rig
from tracking.export.kitti import calibration, kitti


def matrices(text: str) -> dict[str, np.ndarray]:
    lines = [line.split(":") for line in text.splitlines()]
    return {name: np.array(numbers.split(), float).reshape(3, -1) for name, numbers in lines}


def test_the_calibration_projects_as_the_camera_does() -> None:
    camera, world = rig(40.0), np.random.default_rng(0).uniform([-2, 4, 0], [2, 9, 2], (20, 3))
    found = matrices(calibration(camera))
    x = np.column_stack([np.column_stack([world, np.ones(20)]) @ found["Tr"].T, np.ones(20)])
    left, right = (x @ found[name].T for name in ("P2", "P3"))
    uvd = project_pair(camera, world)
    assert left[:, :2] / left[:, 2:] + 0.5 == pytest.approx(uvd[:, :2])
    assert left[:, 0] / left[:, 2] - right[:, 0] / right[:, 2] == pytest.approx(uvd[:, 2])


@pytest.mark.parametrize("kind", ["pinhole", "top"])
def test_pictures_of_one_camera(tmp_path, kind: str) -> None:
    """Only a pinhole camera has a calibration of KITTI."""
    live = make_pictured(3, ("left",))
    down = replace(live.camera, kind="top", rotation=np.diag([1.0, -1.0, -1.0]), px_per_m=40.0)
    live = live if kind == "pinhole" else replace(live, camera=down)
    sequence_folder.write_sequence(tmp_path / "x/a", live, scenario="schema = 1\n", seed=3, streams=("left",))
    (target,) = kitti(tmp_path / "x", tmp_path / "out")
    assert sorted(os.listdir(target)) == [*(["calib.txt"] if kind == "pinhole" else []), "image_2", "times.txt"]
    sequence_folder.write_sequence(tmp_path / "x/a", make_sequence(3), scenario="schema = 1\n", seed=3)
    with pytest.raises(InputError, match="no stream left"):
        kitti(tmp_path / "x", tmp_path / "out")


def test_pairs_and_disparities_are_those_of_the_dataset(tmp_path) -> None:
    live = make_pictured(3, ("left", "right", "disparity"))
    folder = tmp_path / "flockscope-train/a"
    sequence_folder.write_sequence(
        folder, live, scenario="schema = 1\n", seed=3, streams=("left", "right", "disparity"), images="png"
    )
    (target,) = kitti(folder, tmp_path / "out")
    assert target == tmp_path / "out/flockscope-train/a"
    with pytest.raises(InputError, match="a folder of tracks or of a sequence"):
        kitti(tmp_path, tmp_path)
    assert sorted(os.listdir(target / "disp_noc_0")) == [f"{k:06d}.png" for k in range(1, live.length + 1)]
    codes = cv2.imread(str(target / "disp_noc_0/000005.png"), cv2.IMREAD_UNCHANGED)
    assert codes.dtype == np.uint16
    assert decode_disparity(codes) == pytest.approx(live.load_pixels(5).disparity, abs=1 / 256, nan_ok=True)
    frame = next(f for f in live.frames() if f.index == 5)
    assert np.array_equal(cv2.imread(str(target / "image_2/000005.png")), frame.image)
    assert np.array_equal(cv2.imread(str(target / "image_3/000005.png")), frame.right)
    assert (target / "calib.txt").read_text() == calibration(live.camera)
    assert np.loadtxt(target / "times.txt") == pytest.approx([k / live.fps for k in range(live.length)])
