"""Real stereo recordings: left and right pictures in folders, calibrations of ours and of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.formats.calibration import read_calibration
from sim.io.source import open_source
from tests.sim.scene.test_stereo import rig
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
    for name, pictures in made.items():
        (tmp_path / "rec" / name).mkdir(parents=True)
        for k, picture in enumerate(pictures, 1):
            cv2.imwrite(str(tmp_path / "rec" / name / f"{k:06d}.png"), picture)
    (tmp_path / "rec/img1_right/000007.png").unlink()
    write_yaml(tmp_path / "pair.yml", camera)
    (sequence,) = open_source(tmp_path / "rec", camera=tmp_path / "pair.yml", fps=30.0)
    with pytest.warns(UserWarning, match="frame 7"):
        frames = list(sequence)
    assert sequence.has_right
    assert all(np.array_equal(f.image, p) for f, p in zip(frames, made["img1"], strict=True))
    right = [f.right for f in frames]
    assert right[6] is None
    assert np.array_equal(right[7], made["img1_right"][7])
    with pytest.warns(UserWarning, match="frame 7"), pytest.warns(UserWarning, match="background sample"):
        assert len(track("stereo", sequence, detections="image")) == 12


def test_right_pictures_are_numbered_like_the_left_ones(tmp_path) -> None:
    """Also if the first right picture is lost: 000000.png of the left is frame 1, so 000002.png of the right is 3."""
    for name, numbers in (("img1", range(4)), ("img1_right", (2, 3))):
        (tmp_path / name).mkdir()
        for k in numbers:
            cv2.imwrite(str(tmp_path / name / f"{k:06d}.png"), np.full((*SIZE, 3), 10 * k, np.uint8))
    (tmp_path / "seqinfo.ini").write_text("[Sequence]\nframeRate=10\n")
    (sequence,) = open_source(tmp_path)
    with pytest.warns(UserWarning, match="right: frame 1 has no readable picture"):
        frames = list(sequence)
    assert [f.image[0, 0, 0] for f in frames] == [0, 10, 20, 30]
    assert [None if f.right is None else f.right[0, 0, 0] for f in frames] == [None, None, 20, 30]


@pytest.mark.parametrize("unit", [1000, 100])
def test_a_baseline_that_is_not_in_metres_is_refused(tmp_path, unit) -> None:
    """OpenCV's T is in the unit of the calibration board, often mm or cm."""
    camera = rig(40.0)
    left = np.array([[camera.focal_px[0], 0, 40, 0], [0, camera.focal_px[1], 30, 0], [0, 0, 1, 0]])
    right = left.copy()
    right[0, 3] = -camera.focal_px[0] * unit * 0.12
    write_yaml(tmp_path / "pair.yml", camera, P1=left, P2=right)
    with pytest.raises(InputError, match=rf"baseline: got {unit * 0.12:g} m.*divide by 1000"):
        read_calibration(tmp_path / "pair.yml")


def test_a_whole_calibration_in_mm_is_refused(tmp_path) -> None:
    camera = rig(40.0)
    write_yaml(tmp_path / "pair.yml", camera.replace(baseline=120.0), position=1000 * camera.position)
    with pytest.raises(InputError, match=r"position: got height .*all lengths in metres"):
        read_calibration(tmp_path / "pair.yml")


def test_right_pictures_without_numbers_are_as_many_as_the_left_ones(tmp_path) -> None:
    for name, files in (("img1", "abc"), ("img1_right", "bc")):
        (tmp_path / name).mkdir()
        for file in files:
            cv2.imwrite(str(tmp_path / name / f"{file}.png"), np.zeros((*SIZE, 3), np.uint8))
    (tmp_path / "seqinfo.ini").write_text("[Sequence]\nframeRate=10\n")
    with pytest.raises(InputError, match="2 pictures without numbers; expected 3, as in img1"):
        open_source(tmp_path)
