"""The camera calibration that a user gives for a recording (`--camera FILE`): read it, scale it to the pictures."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.regular_file import require_regular
from sim.io.formats.opencv_yaml import read_opencv_yaml
from sim.io.formats.tsai import read_tsai
from sim.io.store.camera_files import read_camera
from sim.types import Camera

PERSON, SMALLEST = 1.7, 2.0  # a person's height, m, and the least px that it must have in the picture
WIDEST, WIDEST_SHARE = 2.0, 0.25  # m, and share of the height: a longer baseline is not in metres
SHAPE_TOLERANCE = 0.01  # relative difference allowed between the aspect ratios of calibration and recording


def read_calibration(path: Path) -> Camera:
    """Returns the camera of a calibration file: Tsai's .xml, OpenCV's .yml of a rectified pair, or camera.json."""
    require_regular(path, "check --camera: a camera.json, or Tsai's calibration as .xml")
    if path.suffix.lower() == ".toml":
        remedy = "give the recording's calibration; a TOML file describes a view for `flockscope replay --camera`"
        raise InputError(
            file=path, place="--camera", got="a TOML file", expected="a camera.json, or Tsai's calibration as .xml",
            remedy=remedy,
        )  # fmt: skip
    if path.suffix.lower() in (".yml", ".yaml"):
        camera = read_opencv_yaml(path)
    else:
        camera = read_tsai(path) if path.suffix.lower() == ".xml" else read_camera(path)
    return _require_metres(camera, path)


def _require_metres(camera: Camera, path: Path) -> Camera:
    height = float(camera.position[2])
    # From so high, a person right below would be smaller than 2 px in any direction of view.
    person = camera.focal_px[1] * PERSON / height if camera.kind == "pinhole" else np.inf
    if person < SMALLEST:
        got = f"height {height:g} m, from where a person is {person:.2g} px tall"
        raise InputError(file=path, place="position", got=got, expected="metres", remedy="give all lengths in metres")
    if camera.baseline > max(WIDEST, height * WIDEST_SHARE):
        raise InputError(
            file=path, place="baseline", got=f"{camera.baseline:g} m, {height:g} m above the ground",
            expected=f"metres, up to {max(WIDEST, height * WIDEST_SHARE):g} m",
            remedy="give T, and P2 made from it, in metres: divide by 1000 if they are in mm",
        )  # fmt: skip
    return camera


def scaled_to_image(
    camera: Camera, image: tuple[int, int] | None, path: Path, aspect: Fraction = Fraction(1)
) -> Camera:
    """Returns the camera for pictures of `image` (width, height) px; `aspect` is that of the stored pixels."""
    if image is None or image == camera.image:
        return camera
    x, y = image[0] / camera.image[0], image[1] / camera.image[1]
    # It may be calibrated with the stored pixels or with square ones.
    if all(abs(x / y / ratio - 1) > SHAPE_TOLERANCE for ratio in (1.0, float(aspect))):
        raise InputError(
            file=path, place="--camera", got="a calibration for {}×{} px".format(*camera.image),
            expected="one for {}×{} px, or of that shape".format(*image), remedy="give this recording's calibration",
        )  # fmt: skip
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    return camera.replace(
        image=image,
        focal_px=(fx * x, fy * y),
        centre_px=(cx * x, cy * y),
        px_per_m=float(camera.px_per_m * np.sqrt(x * y)),
    )
