"""KITTI export: pictures, disparities and calibration as KITTI's own tools read them."""

from __future__ import annotations

import os

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.camera import project_pair
from sim.store import sequence_folder
from sim.streams import decode_disparity
from tests.made_up import make_pictured
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
