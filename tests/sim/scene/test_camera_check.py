"""Cameras that cannot see the ground of a scene end in one line, whoever gives them."""

import json

import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from scenarios.limits import SCALES, is_number
from sim.io.formats.calibration import read_calibration
from sim.scene.camera import camera_rotation, px_per_m_at_centre, require_camera
from sim.sequence import simulate

DOWN = camera_rotation(0.6, 0.4).tolist()
GOOD = {
    "format": 1, "kind": "pinhole", "image": [640, 480], "focal_px": [500, 500], "centre_px": [320, 240],
    "position": [1, 2, 5], "rotation": DOWN, "baseline": 0, "px_per_m": None,
}  # fmt: skip
TOP = GOOD | {"kind": "top", "px_per_m": 40.0, "rotation": camera_rotation(np.pi / 2, 0.4).tolist()}
CLOSE = GOOD | {"focal_px": [6e4, 6e4], "position": [1, 2, 0.1], "rotation": camera_rotation(1.5, 0.4).tolist()}
MIRRORED = (np.diag([-1.0, 1.0, 1.0]) @ np.array(DOWN)).tolist()
LARGER = (2 * np.array(DOWN)).tolist()

BAD = {
    "mirrored": (GOOD | {"rotation": MIRRORED}, "mirrored"),
    "scaled": (GOOD | {"rotation": LARGER}, "right angles"),
    "no rotation": (GOOD | {"rotation": [[0, 0, 0]] * 3}, "right angles"),
    "underground": (GOOD | {"position": [1, 2, -5]}, "above the ground"),
    "on the ground": (GOOD | {"position": [1, 2, 0]}, "above the ground"),
    "looking up": (GOOD | {"rotation": camera_rotation(-0.6, 0.0).tolist()}, "sees the ground"),
    "no focal length": (GOOD | {"focal_px": [0, 0]}, "focal"),
    "a negative focal length": (GOOD | {"focal_px": [-500, 500]}, "focal"),
    "mm for px": (GOOD | {"focal_px": [3.5, 3.5]}, "focal"),
    "two unlike focal lengths": (GOOD | {"focal_px": [500, 5000]}, "focal"),
    "the centre elsewhere": (GOOD | {"centre_px": [5000, 240]}, "centre"),
    "no image": (GOOD | {"image": [0, 0]}, "image"),
    "half a pixel": (GOOD | {"image": [640.5, 480]}, "image"),
    "a huge image": (GOOD | {"image": [16000, 16000]}, "image"),
    "a lens that folds": (GOOD | {"radial": -2.0}, "radial"),
    "far away": (GOOD | {"position": [1e300, 2, 5]}, "position"),
    "no numbers": (GOOD | {"position": ["1", "2", "5"]}, "position"),
    "a telephoto lens just above the ground": (CLOSE, "px_per_m"),
    "no scale from above": (TOP | {"px_per_m": 0.0}, "px_per_m"),
    "from above, but level": (TOP | {"rotation": DOWN}, "look"),
    "another format": (GOOD | {"format": 2}, "format"),
    "a format that is no number": (GOOD | {"format": "1"}, "format"),
}


@pytest.mark.parametrize("name", BAD)
def test_calibrations(name, tmp_path):
    document, word = BAD[name]
    (tmp_path / "camera.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=word) as error:
        read_calibration(tmp_path / "camera.json")
    assert "camera.json" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("document", [GOOD, TOP])
def test_good_ones(document, tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(document))
    camera = read_calibration(tmp_path / "camera.json")
    assert require_camera(camera) is camera
    rounded = np.round(camera.rotation, 3)
    assert require_camera(camera.replace(rotation=rounded)).rotation.tolist() == rounded.tolist()


def test_ground_too_far_away_gives_no_scale(tmp_path):
    """The scale of an image whose centre shows the ground 50 km away lies within the bounds of stored sequences."""
    level, nearly = (GOOD | {"rotation": camera_rotation(tilt, 0.4).tolist()} for tilt in (0.0, 1e-4))
    scales = []
    for k, document in enumerate((level, nearly)):
        (tmp_path / f"{k}.json").write_text(json.dumps(document))
        scales.append(px_per_m_at_centre(read_calibration(tmp_path / f"{k}.json")))
    assert scales[1] == pytest.approx(scales[0], rel=0.01)
    assert is_number(scales[1], *SCALES)


def test_tsai(tmp_path):
    text = """<Camera><Geometry width="768" height="576" dpx="5.0e-03" dpy="4.0e-03"/>
    <Intrinsic focal="{}" kappa1="5.1e-03" cx="324.0" cy="282.0" sx="1.1"/>
    <Extrinsic tx="800" ty="-3000" tz="{}" rx="{}" ry="-0.89" rz="-0.43"/></Camera>"""
    path = tmp_path / "c.xml"
    path.write_text(text.format(5.5, 35000, 2.04))
    assert read_calibration(path).position[2] > 0
    for wrong, word in (((5500, 35000, 2.04), "focal"), ((5.5, -35000, 2.04), "above"), ((5.5, 1e30, 2), "tz")):
        path.write_text(text.format(*wrong))
        with pytest.raises(InputError, match=word):
            read_calibration(path)


def test_cameras_of_scenarios():
    settings = ["camera.height=5", "camera.position=[8, -4]", "camera.crop=true"]
    assert simulate(load("merge", set=settings), 40000).camera is not None
    with pytest.raises(InputError, match="camera: rotation: got an image without ground"):
        simulate(load("merge", set=[*settings, "camera.tilt_deg=-30"]), 40000)
