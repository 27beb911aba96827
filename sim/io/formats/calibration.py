"""The camera calibration that a user gives for a recording (`--camera FILE`): read it, scale it to the pictures.

*Tsai's calibration as XML* (as in PETS 2009): a world point X becomes x_cam = (x, y, z) = R X + T in mm, with R = Rz Ry
Rx of the angles rx, ry, rz (rad) and T = (tx, ty, tz). Ideal sensor position: (f x/z, f y/z) in mm, f the focal length.
Distorted position Xd (2-vector, mm): Xd (1 + kappa1 |Xd|²) = ideal. Pixel: u = sx Xd_x/dpx + cx, v = Xd_y/dpy + cy,
where dpx, dpy are the size of a sensor element in mm, sx a scale factor and (cx, cy) the image centre in px.

*OpenCV's YAML* of a rectified pair (`cv2.FileStorage`, `cv2.stereoRectify`): image_width, image_height, px; P1 and
P2, the 3 x 4 projections of the left and right camera, P2[0, 3] = -P2[0, 0] times the baseline in m; and, as OpenCV
knows no world, rotation (3 x 3, world to rectified left camera) and position (3 numbers, of the left camera, m).

Pixel coordinates of both begin at the middle of the first pixel, ours at its corner.
"""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, YAML_BYTES
from scenarios.reading import require_regular
from sim.io.files.numeric_text import bounded_number, read_text, xml_root
from sim.io.store.camera_files import read_camera
from sim.scene.camera import require_camera
from sim.types import Array, Camera

MM = 1000.0  # per m
PARTS = {
    "Geometry": ("width", "height", "dpx", "dpy"),
    "Intrinsic": ("focal", "kappa1", "cx", "cy", "sx"),
    "Extrinsic": ("tx", "ty", "tz", "rx", "ry", "rz"),
}
SMALLEST, LARGEST = 1e-9, 1e9  # mm or px: least value above 0, and greatest absolute value of a number
POSITIVE = ("width", "height", "dpx", "dpy", "focal", "sx")


def read_tsai(path: Path) -> Camera:
    """Returns the camera of Tsai's calibration as XML, in m and px."""
    v = _values(path)
    rotation = _rotation(v["rx"], v["ry"], v["rz"])
    shift = np.array([v["tx"], v["ty"], v["tz"]]) / MM
    camera = Camera(
        kind="pinhole", image=(round(v["width"]), round(v["height"])),
        focal_px=(v["sx"] * v["focal"] / v["dpx"], v["focal"] / v["dpy"]), centre_px=(v["cx"] + 0.5, v["cy"] + 0.5),
        position=-rotation.T @ shift, rotation=rotation, radial=v["kappa1"] * v["focal"] ** 2,
    )  # fmt: skip
    return require_camera(camera, path)


def _values(path: Path) -> dict[str, float]:
    root = xml_root(path, "Tsai's calibration as XML, or a camera.json", "check --camera")
    found = {}
    for part, name in ((part, name) for part, names in PARTS.items() for name in names):
        element = root.find(part)
        text, low = None if element is None else element.get(name), SMALLEST if name in POSITIVE else -LARGEST
        found[name] = bounded_number(path, f"{part} {name}", text, low, LARGEST)
    return found


def _wrong(path: Path, place: str, got: str, expected: str, remedy: str = "correct the calibration") -> InputError:
    return InputError(file=path, place=place, got=got, expected=expected, remedy=remedy)


def _rotation(rx: float, ry: float, rz: float) -> Array:
    (a, b, c), (sa, sb, sc) = np.cos([rx, ry, rz]), np.sin([rx, ry, rz])
    x = np.array([[1, 0, 0], [0, a, -sa], [0, sa, a]])
    y = np.array([[b, 0, sb], [0, 1, 0], [-sb, 0, b]])
    z = np.array([[c, -sc, 0], [sc, c, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


SAME = 1e-6  # relative difference allowed between P1 and the left part of P2
KEYS: dict[str, tuple[int, ...]] = {
    "image_width": (), "image_height": (), "P1": (3, 4), "P2": (3, 4), "rotation": (3, 3), "position": (3,)
}  # fmt: skip


def read_opencv_yaml(path: Path) -> Camera:
    """Returns the left Camera, with its baseline, of a rectified pair in OpenCV's YAML `path`."""
    found = _opencv_numbers(path)
    missing = [key for key in KEYS if key not in found]
    if missing:
        raise _wrong(path, ", ".join(missing), "nothing", f"the keys {', '.join(KEYS)}", "add them, or a camera.json")
    for key, shape in KEYS.items():
        if found[key].size != math.prod(shape) or not (np.abs(found[key]) <= COORDINATE).all():
            raise _wrong(path, key, f"{found[key].size} numbers", f"{math.prod(shape)} within {COORDINATE:g}")
    width, height, left, right, rotation, position = (found[key].reshape(shape) for key, shape in KEYS.items())
    fx, fy = float(left[0, 0]), float(left[1, 1])
    apart = np.abs(left - right)
    apart[0, 3] = 0
    if not (fx > 0 and apart.max() <= SAME * fx and right[0, 3] < 0):
        raise _wrong(path, "P2", "another pair", "P1 and P2 equal but for P2[0, 3] < 0", "rectify the pair")
    camera = Camera(
        kind="pinhole", image=(int(width), int(height)), focal_px=(fx, fy),
        # OpenCV's pixel coordinates begin at the centre of the first pixel, ours at its corner.
        centre_px=(float(left[0, 2]) + 0.5, float(left[1, 2]) + 0.5), position=position, rotation=rotation,
        baseline=float(-right[0, 3] / fx),
    )  # fmt: skip
    return require_camera(camera, path)


def _opencv_numbers(path: Path) -> dict[str, Array]:
    """Returns the numbers (N,) under each of KEYS that the file has."""
    import cv2

    text = read_text(path, YAML_BYTES)
    found = {}
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        for key in KEYS:
            node = storage.getNode(key)
            # The numbers of a matrix are read without its stated size, which may be as large as the memory.
            items = node.getNode("data") if node.isMap() else node
            numbers = [items.at(k) for k in range(items.size())] if items.isSeq() else [items]
            if not node.empty():
                found[key] = np.array([number.real() for number in numbers])
    except (cv2.error, SystemError):
        expected = "a file of cv2.FileStorage, which begins with %YAML"
        raise InputError(file=path, got="no OpenCV YAML", expected=expected, remedy="check --camera") from None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return found


PERSON, SMALLEST_PERSON = 1.7, 2.0  # a person's height, m, and the least px that it must have in the picture
WIDEST, WIDEST_SHARE = 2.0, 0.25  # m, and share of the height: a longer baseline is not in metres
SHAPE_TOLERANCE = 0.01  # relative difference allowed between the aspect ratios of calibration and recording


def read_calibration(path: Path) -> Camera:
    """Returns the camera of a calibration file: Tsai's .xml, OpenCV's .yml of a rectified pair, or camera.json."""
    require_regular(path, "check --camera: a camera.json, or Tsai's calibration as .xml")
    readers = {".yml": read_opencv_yaml, ".yaml": read_opencv_yaml, ".xml": read_tsai}
    camera = readers.get(path.suffix.lower(), read_camera)(path)
    height = float(camera.position[2])
    # From so high, a person right below would be smaller than 2 px in any direction of view.
    person = camera.focal_px[1] * PERSON / height if camera.kind == "pinhole" else np.inf
    if person < SMALLEST_PERSON:
        got = f"height {height:g} m, from where a person is {person:.2g} px tall"
        raise _wrong(path, "position", got, "metres", "give all lengths in metres")
    widest = max(WIDEST, height * WIDEST_SHARE)
    if camera.baseline > widest:
        remedy = "give T, and P2 made from it, in metres: divide by 1000 if they are in mm"
        raise _wrong(path, "baseline", f"{camera.baseline:g} m", f"metres, up to {widest:g} m at this height", remedy)
    return camera


def scaled_to_image(
    camera: Camera, image: tuple[int, int] | None, path: Path, aspect: Fraction = Fraction(1)
) -> Camera:
    """Returns the camera scaled to pictures of `image` (width, height) px; unchanged for None or the same size.

    aspect: width / height of a stored pixel. Raises InputError if the pictures have another shape than the calibration.
    """
    if image is None or image == camera.image:
        return camera
    x, y = image[0] / camera.image[0], image[1] / camera.image[1]
    # It may be calibrated with the stored pixels or with square ones.
    if all(abs(x / y / ratio - 1) > SHAPE_TOLERANCE for ratio in (1.0, float(aspect))):
        got, expected = "a calibration for {}×{} px".format(*camera.image), "one for {}×{} px, or of that shape"
        raise _wrong(path, "--camera", got, expected.format(*image), "give this recording's calibration")
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    scale = float(camera.px_per_m * np.sqrt(x * y))
    return camera.replace(image=image, focal_px=(fx * x, fy * y), centre_px=(cx * x, cy * y), px_per_m=scale)
