"""Real stereo recordings: left and right pictures in folders, calibrations of ours and of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from tests.recordings import mot_folder
from tests.sim.scene.test_camera_stereo import rig
from tracking.recordings.calibration import read_calibration
from tracking.recordings.source import open_source
from tracking.running.run import track

SIZE = (48, 64)


def write_yaml(path, camera, **changed) -> None:
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    left = np.array([[fx, 0, cx - 0.5, 0], [0, fy, cy - 0.5, 0], [0, 0, 1, 0]])
    right = left.copy()
    right[0, 3] = -fx * camera.baseline
    values = {"image_width": camera.image[0], "image_height": camera.image[1], "P1": left, "P2": right}
    values |= {"rotation": camera.rotation, "position": camera.position, **changed}
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        if value is not None:
            storage.write(key, value if isinstance(value, int) else np.array(value))
    storage.release()


def test_opencv_yaml_gives_the_camera(tmp_path) -> None:
    camera = rig(40.0)
    write_yaml(tmp_path / "pair.yml", camera)
    found = read_calibration(tmp_path / "pair.yml")
    assert found.image == camera.image
    assert found.centre_px == pytest.approx(camera.centre_px)
    assert found.focal_px == pytest.approx(camera.focal_px)
    assert found.baseline == pytest.approx(camera.baseline)
    assert found.rotation == pytest.approx(camera.rotation)
    assert found.position == pytest.approx(camera.position)


@pytest.mark.parametrize(
    ("changed", "place"),
    [({"P2": None}, "P2"), ({"P2": np.eye(3)}, "P2"), ({"P2": np.eye(3, 4)}, "P2"), ({"position": None}, "position")],
)
def test_a_calibration_that_is_no_pair_is_refused(tmp_path, changed, place) -> None:
    write_yaml(tmp_path / "pair.yaml", rig(40.0), **changed)
    with pytest.raises(InputError) as error:
        read_calibration(tmp_path / "pair.yaml")
    assert error.value.place == place


def test_a_folder_with_right_pictures_is_a_stereo_recording(tmp_path) -> None:
    r = np.random.default_rng(0)
    camera = rig(40.0).replace(image=(SIZE[1], SIZE[0]), centre_px=(SIZE[1] / 2, SIZE[0] / 2), focal_px=(50.0, 50.0))
    still = r.integers(20, 200, (*SIZE, 3), np.uint8)
    made = {
        name: [still + r.integers(0, 9, still.shape, np.uint8) for _ in range(12)] for name in ("img1", "img1_right")
    }
    shown = {f"{name}/{k:06d}.png": p for name, pictures in made.items() for k, p in enumerate(pictures, 1)}
    del shown["img1_right/000007.png"]
    mot_folder(tmp_path / "rec", pictures=shown)
    write_yaml(tmp_path / "pair.yml", camera)
    (sequence,) = open_source(tmp_path / "rec", camera=tmp_path / "pair.yml", fps=30.0)
    with pytest.warns(UserWarning, match="frame 7"):
        frames = list(sequence)
    assert sequence.has_right
    assert all(np.array_equal(f.image, p) for f, p in zip(frames, made["img1"], strict=True))
    right = [f.right for f in frames]
    assert right[6] is None
    assert np.array_equal(right[7], made["img1_right"][7])
    with pytest.warns(UserWarning, match="frame 7"):
        assert len(track("stereo", sequence, detections="image")) == 12


def test_right_pictures_are_numbered_like_the_left_ones(tmp_path) -> None:
    """Also if the first right picture is lost: 000000.png of the left is frame 1, so 000002.png of the right is 3."""
    numbers = [("img1", k) for k in range(4)] + [("img1_right", k) for k in (2, 3)]
    pictures = {f"{name}/{k:06d}.png": np.full((*SIZE, 3), 10 * k, np.uint8) for name, k in numbers}
    (sequence,) = open_source(mot_folder(tmp_path, ini="frameRate=10\n", pictures=pictures))
    with pytest.warns(UserWarning, match="right: frame 1 has no readable picture"):
        frames = list(sequence)
    assert [f.image[0, 0, 0] for f in frames] == [0, 10, 20, 30]
    assert [None if f.right is None else f.right[0, 0, 0] for f in frames] == [None, None, 20, 30]


OTHER_UNITS = [
    (120.0, 1, r"baseline: got 120 m.*divide by 1000"),
    (12.0, 1, r"baseline: got 12 m.*divide by 1000"),
    (120.0, 1000, r"position: got height .*all lengths in metres"),
]


@pytest.mark.parametrize(("baseline", "unit", "words"), OTHER_UNITS)
def test_lengths_that_are_not_in_metres_are_refused(tmp_path, baseline, unit, words) -> None:
    """OpenCV's T is in the unit of the calibration board, often mm or cm."""
    camera = rig(40.0)
    write_yaml(tmp_path / "pair.yml", camera.replace(baseline=baseline), position=unit * camera.position)
    with pytest.raises(InputError, match=words):
        read_calibration(tmp_path / "pair.yml")


def test_right_pictures_without_numbers_are_as_many_as_the_left_ones(tmp_path) -> None:
    files = ["img1/a", "img1/b", "img1/c", "img1_right/b", "img1_right/c"]
    pictures = {f"{file}.png": np.zeros((*SIZE, 3), np.uint8) for file in files}
    mot_folder(tmp_path, ini="frameRate=10\n", pictures=pictures)
    with pytest.raises(InputError, match="2 pictures without numbers; expected 3, as in img1"):
        open_source(tmp_path)
