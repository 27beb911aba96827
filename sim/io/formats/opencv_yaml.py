"""Reader of a rectified stereo camera from OpenCV's YAML (`cv2.FileStorage`), as `cv2.stereoRectify` leads to it.

Keys: image_width, image_height, px; P1 and P2, the 3 x 4 projections of the rectified left and right camera, P2[0, 3] =
-P2[0, 0] times the baseline in m; and, as OpenCV knows no world, rotation (3 x 3, world to rectified left camera) and
position (3 numbers, of the left camera, m).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE
from sim.io.files.numeric_text import read_text
from sim.scene.camera_check import require_camera
from sim.types import Array, Camera

SAME = 1e-6
"""Relative difference allowed between P1 and the left part of P2."""
POSE = ("rotation", "position")


def read_opencv_yaml(path: Path) -> Camera:
    """Return the left Camera, with its baseline, of a rectified pair in OpenCV's YAML `path`.

    OpenCV's pixel coordinates begin at the centre of the first pixel, ours at its corner; 0.5 px is added. Raises
    InputError if the file cannot be read as OpenCV's YAML, a key is missing or of a wrong shape, P1 and P2 are no
    rectified horizontal pair, or the camera cannot be used (sim.scene.camera_check).
    """
    import cv2

    text = read_text(path)
    storage = cv2.FileStorage()
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        storage.open(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY | cv2.FILE_STORAGE_FORMAT_YAML)
        values = {key: _value(storage, key) for key in ("image_width", "image_height", "P1", "P2", *POSE)}
    except (cv2.error, SystemError, UnicodeError):
        expected = "a file of cv2.FileStorage"
        raise InputError(file=path, got="no OpenCV YAML", expected=expected, remedy="check --camera") from None
    finally:
        storage.release()
        cv2.utils.logging.setLogLevel(level)
    width, height = (float(_numbers(path, values, k, ())) for k in ("image_width", "image_height"))
    left, right = (_numbers(path, values, k, (3, 4)) for k in ("P1", "P2"))
    rotation, position = _numbers(path, values, "rotation", (3, 3)), _numbers(path, values, "position", (3,))
    fx, fy = float(left[0, 0]), float(left[1, 1])
    apart = np.abs(left - right)
    apart[0, 3] = 0
    if not (fx > 0 and apart.max() <= SAME * fx and right[0, 3] < 0):
        expected = "P1 and P2 equal but for P2[0, 3] < 0"
        raise InputError(file=path, place="P2", got="another pair", expected=expected, remedy="rectify the pair")
    if width != round(width) or height != round(height):
        expected = "whole numbers of px"
        raise InputError(
            file=path, place="image_width", got=f"{width:g}×{height:g}", expected=expected, remedy="correct it"
        )
    camera = Camera(
        kind="pinhole", image=(int(width), int(height)), focal_px=(fx, fy),
        centre_px=(float(left[0, 2]) + 0.5, float(left[1, 2]) + 0.5), position=position, rotation=rotation,
        baseline=float(-right[0, 3] / fx),
    )  # fmt: skip
    return require_camera(camera, path)


def _value(storage: Any, key: str) -> Array | None:
    """Returns a number or matrix as an array, None if the key is missing or something else."""
    node = storage.getNode(key)
    if node.isInt() or node.isReal():
        return np.array(node.real())
    if node.isMap():
        found = node.mat()
        return None if found is None else np.asarray(found, np.float64)
    if node.isSeq():
        return np.array([node.at(k).real() for k in range(node.size())])
    return None


def _numbers(path: Path, values: dict[str, Array | None], key: str, shape: tuple[int, ...]) -> Array:
    """Returns the value of a key in the shape; raises InputError if it is missing or does not fit."""
    value = values[key]
    if value is None or value.size != int(np.prod(shape)) or not (np.abs(value) <= COORDINATE).all():
        got = "no such key" if value is None else f"shape {value.shape}"
        expected = f"numbers of shape {shape} within {COORDINATE:g}" if shape else f"a number within {COORDINATE:g}"
        raise InputError(file=path, place=key, got=got, expected=expected, remedy="correct it")
    return np.asarray(value.reshape(shape), np.float64)
