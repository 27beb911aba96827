"""Reader of a rectified stereo camera from OpenCV's YAML (`cv2.FileStorage`), as `cv2.stereoRectify` leads to it.

The text is read here, as the process ended once while `cv2.FileStorage` read damaged text.

Keys: image_width, image_height, px; P1 and P2, the 3 x 4 projections of the rectified left and right camera, P2[0, 3] =
-P2[0, 0] times the baseline in m; and, as OpenCV knows no world, rotation (3 x 3, world to rectified left camera) and
position (3 numbers, of the left camera, m).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE
from sim.io.files.numeric_text import read_text
from sim.scene.camera_check import require_camera
from sim.types import Array, Camera

SAME = 1e-6  # relative difference allowed between P1 and the left part of P2
KEYS = ("image_width", "image_height", "P1", "P2", "rotation", "position")
KEY = re.compile(r"([A-Za-z_]\w*)\s*:\s*(.*)")
NUMBER = re.compile(r"[-+]?([0-9]{1,30}\.?[0-9]{0,30}|\.[0-9]{1,30})([eE][-+]?[0-9]{1,3})?")
LIST = re.compile(r"\[([^\[\]]*)\]")
# A matrix of two or of any number of dimensions, as FileStorage writes it
MATRIX = re.compile(
    r"!!opencv-(?:nd-)?matrix\s+(?:rows:\s*([0-9]{1,2})\s+cols:\s*([0-9]{1,2})|sizes:\s*\[([0-9,\s]{0,20})\])\s+"
    r"dt:\s*\w+\s+data:\s*(\[[^\[\]]*\])\s*"
)


def read_opencv_yaml(path: Path) -> Camera:
    """Returns the left Camera, with its baseline, of a rectified pair in OpenCV's YAML `path`."""
    blocks = _blocks(path, read_text(path))
    missing = [key for key in KEYS if key not in blocks]
    if missing:
        raise InputError(
            file=path, place=", ".join(missing), got="nothing", expected=f"the keys {', '.join(KEYS)}",
            remedy="add them: see Calibration in docs/reference/formats.md",
        )  # fmt: skip
    values = {key: _value(blocks[key]) for key in KEYS}
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
        # OpenCV's pixel coordinates begin at the centre of the first pixel, ours at its corner.
        centre_px=(float(left[0, 2]) + 0.5, float(left[1, 2]) + 0.5), position=position, rotation=rotation,
        baseline=float(-right[0, 3] / fx),
    )  # fmt: skip
    return require_camera(camera, path)


def _blocks(path: Path, text: str) -> dict[str, str]:
    lines = [line.partition("#")[0].rstrip() for line in text.splitlines()]
    if not lines or not lines[0].startswith("%YAML"):
        expected = "a file of cv2.FileStorage, which begins with %YAML"
        raise InputError(file=path, got="no OpenCV YAML", expected=expected, remedy="check --camera")
    blocks: dict[str, list[str]] = {}
    key = ""
    for line in lines[1:]:
        if found := KEY.match(line):
            key = found[1]
            blocks[key] = [found[2]]
        elif key and line[:1].isspace():
            blocks[key].append(line)
    return {key: "\n".join(block) for key, block in blocks.items()}


def _value(block: str) -> Array | None:
    matrix = MATRIX.fullmatch(block)
    body = (block if matrix is None else matrix[4]).strip()
    if matrix is None and NUMBER.fullmatch(body):
        return np.array(float(body))
    items = LIST.fullmatch(body)
    numbers = [] if items is None else [item.strip() for item in items[1].split(",")]
    if not numbers or not all(NUMBER.fullmatch(item) for item in numbers):
        return None
    values = np.array([float(item) for item in numbers])
    if matrix is None:
        return values
    sizes = re.findall(r"[0-9]+", matrix[3]) if matrix[1] is None else (matrix[1], matrix[2])
    shape = tuple(int(size) for size in sizes)
    return values.reshape(shape) if int(np.prod(shape)) == len(values) else None


def _numbers(path: Path, values: Mapping[str, Array | None], key: str, shape: tuple[int, ...]) -> Array:
    value = values.get(key)
    if value is None or value.size != int(np.prod(shape)) or not (np.abs(value) <= COORDINATE).all():
        got = "no such numbers" if value is None else f"shape {value.shape}"
        expected = f"numbers of shape {shape} within {COORDINATE:g}" if shape else f"a number within {COORDINATE:g}"
        raise InputError(file=path, place=key, got=got, expected=expected, remedy="correct it")
    return np.asarray(value.reshape(shape), np.float64)
