"""The poses of a camera that moves, as a table of a stored sequence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.store.camera_files import cameras_table, read_cameras
from sim.store.sequence_folder import CAMERAS, open_sequence
from sim.store.validate import validate
from sim.types import Camera
from tracking.export.kitti import kitti

MOVED = ("duration=2", "camera.image=[160, 120]", "camera.focal_px=125", "camera.motion={kind='shake', px=5}")


def equal(a: Camera, b: Camera) -> bool:
    lens = all(getattr(a, key) == getattr(b, key) for key in ("kind", "image", "focal_px", "centre_px", "baseline"))
    return lens and np.array_equal(a.position, b.position) and np.array_equal(a.rotation, b.rotation)


def test_poses_come_back_from_a_dataset_and_no_camera_does(tmp_path: Path) -> None:
    (folder,) = generate(["cross"], range(90_001, 90_002), tmp_path, set=MOVED, images="png")
    assert not (folder / "camera.json").exists()
    assert validate(tmp_path) == []
    made, read = simulate(load("cross", MOVED), 90_001), open_sequence(folder)
    assert read.camera is None
    assert read.truth is not None
    assert read.truth.camera is None
    assert made.load_cameras is not None
    assert read.load_cameras is not None
    assert all(map(equal, made.load_cameras(), read.load_cameras()))
    assert np.array_equal(read.truth.box, made.truth.box)
    for a, b in zip(made, read, strict=True):
        assert np.array_equal(a.image, b.image)
        assert np.array_equal(a.detections.box, b.detections.box)
    target = kitti(folder, tmp_path / "kitti")[0]
    poses = np.loadtxt(target / "poses.txt").reshape(-1, 3, 4)
    for pose, camera in zip(poses, read.load_cameras(), strict=True):
        assert pose[:, 3] == pytest.approx(camera.position)
        assert pose[:, :3] @ camera.rotation == pytest.approx(np.eye(3), abs=1e-9)
    assert "Tr: 1.000000000000e+00 0.000000000000e+00" in (target / "calib.txt").read_text()


def test_a_camera_that_stands_still_has_no_poses(tmp_path: Path) -> None:
    (folder,) = generate(["cross"], range(90_001, 90_002), tmp_path, set=["duration=1"], streams=())
    assert not (folder / CAMERAS).exists()
    assert open_sequence(folder).load_cameras is None


def test_poses_of_other_frames_are_refused(tmp_path: Path) -> None:
    cameras = simulate(load("cross", MOVED), 90_001, streams=()).load_cameras
    assert cameras is not None
    (tmp_path / "cameras.parquet").write_bytes(cameras_table(cameras()))
    with pytest.raises(InputError, match="a row for each of the frames 1 to 21"):
        read_cameras(tmp_path / "cameras.parquet", 21)
    assert all(map(equal, cameras(), read_cameras(tmp_path / "cameras.parquet", 20)))
