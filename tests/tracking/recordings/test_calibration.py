import json

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.camera import project, scaled_to_image
from sim.store.camera_files import camera_document, read_camera
from tests.made_up import same
from tracking.recordings.calibration import read_calibration, read_tsai
from tracking.recordings.source import open_source

XML = """<?xml version="1.0" encoding="UTF-8"?>
<Camera name="c">
  <Geometry width="768" height="576" ncx="795" nfx="752" dx="4.85e-03" dy="4.65e-03" dpx="5.0e-03" dpy="4.0e-03"/>
  <Intrinsic focal="5.5" kappa1="5.1e-03" cx="324.0" cy="282.0" sx="1.1"/>
  <Extrinsic tx="800" ty="-3000" tz="35000" rx="2.04" ry="-0.89" rz="-0.43"/>
</Camera>
"""


def by_the_book(x, y, z):
    """Tsai's model as Willson writes it, mm in, px out (counted from the middle of the first pixel)."""
    rx, ry, rz = 2.04, -0.89, -0.43
    sa, ca, sb, cb, sg, cg = np.sin(rx), np.cos(rx), np.sin(ry), np.cos(ry), np.sin(rz), np.cos(rz)
    xc = cb * cg * x + (cg * sa * sb - ca * sg) * y + (sa * sg + ca * cg * sb) * z + 800
    yc = cb * sg * x + (sa * sb * sg + ca * cg) * y + (ca * sb * sg - cg * sa) * z - 3000
    zc = -sb * x + cb * sa * y + ca * cb * z + 35000
    xu, yu = 5.5 * xc / zc, 5.5 * yc / zc
    xd, yd = xu, yu
    for _ in range(200):
        bend = 1 + 5.1e-3 * (xd**2 + yd**2)
        xd, yd = xu / bend, yu / bend
    return 1.1 * xd / 5.0e-3 + 324, yd / 4.0e-3 + 282


@pytest.fixture
def bent(tmp_path):
    (tmp_path / "c.xml").write_text(XML)
    return read_tsai(tmp_path / "c.xml")


def test_tsai_by_the_book(bent):
    assert bent.image == (768, 576)
    for xyz in np.random.default_rng(0).uniform(-8, 8, (50, 3)):
        uv, _ = project(bent, xyz[None])
        assert uv[0] - 0.5 == pytest.approx(by_the_book(*(1000 * xyz)), abs=1e-6)


def test_a_bent_camera_comes_back_and_a_straight_one_says_nothing_of_it(tmp_path, bent):
    for camera in (bent, bent.replace(radial=0.0)):
        document = camera_document(camera)
        assert ("radial" in document) == (camera.radial != 0)
        (tmp_path / "camera.json").write_text(json.dumps(document))
        same(camera, read_camera(tmp_path / "camera.json"))


def test_a_calibration_is_scaled_to_the_recording(tmp_path, bent):
    half = scaled_to_image(bent, (384, 288), tmp_path)
    xyz = np.random.default_rng(0).uniform(-8, 8, (50, 3))
    assert project(half, xyz)[0] == pytest.approx(project(bent, xyz)[0] / 2)
    assert half.image == (384, 288)
    assert scaled_to_image(bent, None, tmp_path) is bent
    with pytest.raises(InputError, match="768×576"):
        scaled_to_image(bent, (640, 360), tmp_path)


BROKEN = [
    ("<Camera", "Camera", "broken XML"), ("Geometry", "Geometrie", "Geometry width"),
    ('kappa1="5.1e-03"', "", "Intrinsic kappa1"), ('focal="5.5"', 'focal="0"', "Intrinsic focal"),
    ('rx="2.04"', 'rx="nan"', "Extrinsic rx"), ('rx="2.04"', 'rx="two"', "Extrinsic rx"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "place"), BROKEN)
def test_a_broken_calibration_is_one_line(tmp_path, old, new, place):
    (tmp_path / "c.xml").write_text(XML.replace(old, new))
    with pytest.raises(InputError, match=place):
        open_source(tmp_path, camera=tmp_path / "c.xml")
    with pytest.raises(InputError, match="No such file"):
        open_source(tmp_path, camera=tmp_path / "none.xml")


ROTATION, POSITION = [[1.0, 0, 0], [0, -0.6, -0.8], [0, 0.8, -0.6]], [1.0, 2, 5]
P1 = [[520.0, 0, 319.5, 0], [0, 510, 239.5, 0], [0, 0, 1, 0]]
P2 = [[520.0, 0, 319.5, -62.4], [0, 510, 239.5, 0], [0, 0, 1, 0]]
K = [520.0, 0, 319.5, 0, 510, 239.5, 0, 0, 1]
ROS = """image_width: 640
image_height: 480
camera_name: narrow
camera_matrix:
  rows: 3
  cols: 3
  data: [520.0, 0, 319.5, 0, 510, 239.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0, 0, 0, 0, {}]
"""
POSE = {"rotation": ROTATION, "position": POSITION}
SIZE = {"image_width": 640, "image_height": 480}


def stored(path, values):
    """What cv2.FileStorage writes, in the format of the suffix."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        storage.write(key, np.array(value, float) if isinstance(value, list) else value)
    storage.release()
    return path


def ros_yaml(path):
    path.write_text(ROS.format(0) + f"rotation: {np.ravel(ROTATION).tolist()}\nposition: {POSITION}\n")
    return path


def as_json(values):
    def write(path):
        path.write_text(json.dumps(values))
        return path

    return write


FORMS = {
    "pair.yml": lambda path: stored(path, {**SIZE, "P1": P1, "P2": P2, **POSE}),
    "pair.xml": lambda path: stored(path, {**SIZE, "P1": P1, "P2": P2, **POSE}),
    "pair.json": lambda path: stored(path, {**SIZE, "P1": P1, "P2": P2, **POSE}),
    "plain.json": as_json({**SIZE, "P1": P1, "P2": P2, **POSE}),
    "ros.json": as_json({"width": 640, "height": 480, "K": K, "D": [0, 0, 0, 0, 0], **POSE}),
    "ros2.json": as_json({"width": 640, "height": 480, "k": K, "d": [], **POSE}),
    "ros.yaml": ros_yaml,
}


@pytest.mark.parametrize("name", FORMS)
def test_calibrations_of_opencv_and_ros(tmp_path, name):
    """Compared with cv2.projectPoints, whose pixel (0, 0) is the middle of the first one."""
    camera = read_calibration(FORMS[name](tmp_path / name))
    points = np.array([[1.0, 8, 0], [0, 10, 1.7], [3, 12, 0.5]])
    shift = -np.array(ROTATION) @ POSITION
    expected, _ = cv2.projectPoints(points, cv2.Rodrigues(np.array(ROTATION))[0], shift, np.reshape(K, (3, 3)), None)
    assert project(camera, points)[0] == pytest.approx(expected[:, 0] + 0.5)
    assert camera.image == (640, 480)
    assert camera.baseline == pytest.approx(0.12 if "P" in (tmp_path / name).read_text() else 0)


BARE = {
    "ros.json": {"K": K, "D": [0, 0, 0, 0, 0], "width": 640, "height": 480},
    "pair.json": {**SIZE, "P1": P1, "P2": P2},
    "opencv.json": {"camera_matrix": [K[:3], K[3:6], K[6:]], "dist_coeff": [[0.0, 0, 0, 0, 0]], **SIZE},
}


@pytest.mark.parametrize("name", BARE)
def test_a_calibration_without_a_place_names_the_keys_to_add(tmp_path, name):
    with pytest.raises(InputError, match=r"rotation, position: got nothing; .*; add them \(rotation: 3 × 3, world to"):
        read_calibration(as_json(BARE[name])(tmp_path / name))
    assert read_calibration(as_json({**BARE[name], **POSE})(tmp_path / name)).focal_px == (520, 510)


@pytest.mark.parametrize(
    ("name", "text"), [("a.json", '{"intrinsics": [1, 2]}'), ("a.xml", "<chunk><sensors/></chunk>")]
)
def test_another_form_names_those_that_are_read(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(
        InputError, match=r"got (<chunk>|the keys intrinsics); expected Tsai's .* or a camera\.json with"
    ):
        read_calibration(tmp_path / name)


def test_a_distorted_camera_is_refused(tmp_path):
    (tmp_path / "a.yaml").write_text(
        ROS.format(0.1) + f"rotation: {np.ravel(ROTATION).tolist()}\nposition: {POSITION}\n"
    )
    with pytest.raises(InputError, match=r"D: got distortion; .*undistort the pictures"):
        read_calibration(tmp_path / "a.yaml")


DISTORTED = [{"k1": -0.3, "k2": 0.1}, {"distortion_coeffs": [0.1, 0, 0, 0]}, {"RadialDistortion": [0.1, 0]}]


@pytest.mark.parametrize("more", DISTORTED)
def test_distortion_by_any_name_is_seen(tmp_path, more):
    straight = {**SIZE, "K": K, **POSE, "distortion_model": "plumb_bob"}
    with pytest.raises(InputError, match=r"D: got distortion; .*undistort the pictures"):
        read_calibration(as_json(straight | more)(tmp_path / "a.json"))
    zeros = {key: np.zeros_like(value).tolist() for key, value in more.items()}
    assert read_calibration(as_json(straight | zeros)(tmp_path / "a.json")).focal_px == (520, 510)


@pytest.mark.parametrize("matrix", [np.reshape(K, (3, 3)).T, np.reshape(K, (3, 3)) + np.diag([30, 0], 1)])
def test_a_transposed_matrix_and_skew_are_refused(tmp_path, matrix):
    """MATLAB's IntrinsicMatrix is the transpose: read as K, its centre would be (0, 0)."""
    with pytest.raises(InputError, match=r"K: got \[\[520.0.*transpose it, if it is MATLAB's"):
        read_calibration(as_json({**SIZE, "K": matrix.tolist(), **POSE})(tmp_path / "a.json"))
