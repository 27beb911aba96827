"""Reader for Tsai's camera calibration as XML (as in PETS 2009): elements Geometry, Intrinsic, Extrinsic.

Model: a world point X becomes x_cam = (x, y, z) = R X + T in mm, with R = Rz Ry Rx of the angles rx, ry, rz (rad) and T
= (tx, ty, tz). Ideal sensor position: (f x/z, f y/z) in mm, f the focal length. Distorted position Xd (2-vector, mm):
Xd (1 + kappa1 |Xd|²) = ideal. Pixel: u = sx Xd_x/dpx + cx, v = Xd_y/dpy + cy, where dpx, dpy are the size of a sensor
element in mm, sx a scale factor and (cx, cy) the image centre in px. Tsai's pixel coordinates begin at the middle of
the first pixel, ours at its corner, half a pixel further up and left.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import XML_BYTES
from sim.io.files.numeric_text import read_number, read_text
from sim.scene.camera_check import require_camera
from sim.types import Array, Camera

MM = 1000.0  # per m
PARTS = {
    "Geometry": ("width", "height", "dpx", "dpy"),
    "Intrinsic": ("focal", "kappa1", "cx", "cy", "sx"),
    "Extrinsic": ("tx", "ty", "tz", "rx", "ry", "rz"),
}
LARGEST = 1e9  # mm or px: absolute value of a number
POSITIVE = ("width", "height", "dpx", "dpy", "focal", "sx")


def read_tsai(path: Path) -> Camera:
    """Returns the camera of Tsai's calibration as XML, in m and px."""
    v = _values(path)
    rotation = _rotation(v["rx"], v["ry"], v["rz"])
    shift = np.array([v["tx"], v["ty"], v["tz"]]) / MM
    camera = Camera(
        kind="pinhole",
        image=(round(v["width"]), round(v["height"])),
        focal_px=(v["sx"] * v["focal"] / v["dpx"], v["focal"] / v["dpy"]),
        centre_px=(v["cx"] + 0.5, v["cy"] + 0.5),
        position=-rotation.T @ shift,
        rotation=rotation,
        radial=v["kappa1"] * v["focal"] ** 2,
    )
    return require_camera(camera, path)


def _values(path: Path) -> dict[str, float]:
    try:
        root = ElementTree.fromstring(read_text(path, XML_BYTES))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        expected = "Tsai's calibration as XML, or a camera.json"
        raise InputError(file=path, got=f"no XML ({error})", expected=expected, remedy="check --camera") from None
    found = {}
    for part, names in PARTS.items():
        element = root.find(part)
        for name in names:
            text = None if element is None else element.get(name)
            try:
                value = read_number(text if text is not None else "nan")
            except ValueError:
                value = float("nan")
            if not abs(value) <= LARGEST or (name in POSITIVE and value <= 0):
                kind = "a number above 0" if name in POSITIVE else f"a number within {LARGEST:g}"
                raise InputError(
                    file=path, place=f"{part} {name}", got="nothing" if text is None else repr(text), expected=kind,
                    remedy="complete the calibration",
                )  # fmt: skip
            found[name] = value
    return found


def _rotation(rx: float, ry: float, rz: float) -> Array:
    (a, b, c), (sa, sb, sc) = np.cos([rx, ry, rz]), np.sin([rx, ry, rz])
    x = np.array([[1, 0, 0], [0, a, -sa], [0, sa, a]])
    y = np.array([[b, 0, sb], [0, 1, 0], [-sb, 0, b]])
    z = np.array([[c, -sc, 0], [sc, c, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)
