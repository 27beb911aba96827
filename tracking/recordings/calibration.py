"""The camera calibration that a user gives for a recording (`--camera FILE`, `replay --calibration FILE`).

It is Tsai's XML, a file of OpenCV or ROS, or flockscope's own camera.json. Readers of recordings scale it to their
pictures.

*Tsai's calibration as XML* (as in PETS 2009): a world point X becomes x_cam = (x, y, z) = R X + T in mm, with R = Rz Ry
Rx of the angles rx, ry, rz (rad) and T = (tx, ty, tz). Ideal sensor position: (f x/z, f y/z) in mm, f the focal length.
Distorted position Xd (2-vector, mm): Xd (1 + kappa1 |Xd|²) = ideal. Pixel: u = sx Xd_x/dpx + cx, v = Xd_y/dpy + cy,
where dpx, dpy are the size of a sensor element in mm, sx a scale factor and (cx, cy) the image centre in px.

*OpenCV's YAML, XML or JSON* (`cv2.FileStorage`) of a rectified pair (`cv2.stereoRectify`): image_width, image_height,
px; P1 and P2, the 3 x 4 projections of the left and right camera, P2[0, 3] = -P2[0, 0] times the baseline in m. Or of
one camera without distortion, as ROS's camera_info: its matrix K (camera_matrix) in place of P1 and P2. As neither
knows a world, they need rotation (3 x 3, world to rectified left camera) and position (3 numbers, of that camera, m).

Pixel coordinates of both begin at the middle of the first pixel, ours at its corner.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import COORDINATE, JSON_BYTES, XML_BYTES, YAML_BYTES
from scenarios.reading import parse_json, read_regular, require_regular
from sim.scene.camera import require_camera
from sim.store.camera_files import read_camera
from sim.store.numeric_text import bounded_number, read_text, xml_root
from sim.types import Array, Camera

MM = 1000.0  # per m
YAML = (".yml", ".yaml")
OWN = ("kind", "image", "focal_px", "centre_px")  # keys of camera.json
FORMS = f"Tsai's XML, OpenCV's K or P1 and P2, or a camera.json with {', '.join(OWN)}, rotation, position"
AS_OWN, CORRECT = "write its numbers as a camera.json", "correct the calibration"
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
    reject(all(root.find(part) is None for part in PARTS), path, f"<{root.tag}>", FORMS, AS_OWN)
    found = {}
    for part, name in ((part, name) for part, names in PARTS.items() for name in names):
        element = root.find(part)
        text, low = None if element is None else element.get(name), SMALLEST if name in POSITIVE else -LARGEST
        found[name] = bounded_number(path, f"{part} {name}", text, low, LARGEST)
    return found


def _rotation(rx: float, ry: float, rz: float) -> Array:
    (a, b, c), (sa, sb, sc) = np.cos([rx, ry, rz]), np.sin([rx, ry, rz])
    x = np.array([[1, 0, 0], [0, a, -sa], [0, sa, a]])
    y = np.array([[b, 0, sb], [0, 1, 0], [-sb, 0, b]])
    z = np.array([[c, -sc, 0], [sc, c, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


SAME = 1e-6  # relative difference allowed between P1 and the left part of P2
STRAY = [0, 1, 2, 2], [1, 0, 0, 1]  # elements of K that are 0 without skew
DISTORTION = re.compile("(?i:d|dist|dist_?coef+s?|.*distortion.*)|[kp][1-6]")  # names of coefficients
# of each key its shape, and the names that others give it
KEYS: dict[str, tuple[tuple[int, ...], tuple[str, ...]]] = {
    "image_width": ((), ("width",)), "image_height": ((), ("height",)),
    "rotation": ((3, 3), ()), "position": ((3,), ()),
    "P1": ((3, 4), ()), "P2": ((3, 4), ()), "K": ((3, 3), ("k", "camera_matrix", "cameraMatrix", "Camera_Matrix")),
}  # fmt: skip


def read_opencv(path: Path) -> Camera:
    """Returns the left Camera, with its baseline, of a rectified pair that OpenCV stored, or the one of a matrix K."""
    found = _opencv_numbers(path)
    one = "K" in found and "P1" not in found and "P2" not in found
    wanted = ["image_width", "image_height", *(["K"] if one else ["P1", "P2"]), "rotation", "position"]
    missing = [key for key in wanted if key not in found]
    remedy = "add them (rotation: 3 × 3, world to camera; position: of the camera, m, z up), or give a camera.json"
    reject(missing, path, "nothing", f"the keys {', '.join(wanted)}", remedy, ", ".join(missing))
    for key in wanted:
        size = math.prod(KEYS[key][0])
        wrong = found[key].size != size or not (np.abs(found[key]) <= COORDINATE).all()
        reject(wrong, path, f"{found[key].size} numbers", f"{size} within {COORDINATE:g}", CORRECT, key)
    remedy = "undistort the pictures (cv2.undistort), and give zeros"
    reject(one and found["D"].any(), path, "distortion", "a camera without, or the Tsai XML", remedy, "D")
    value = {key: found[key].reshape(KEYS[key][0]) for key in wanted}
    left = value["K" if one else "P1"]
    right = left if one else value["P2"]
    wrong = np.abs(left[STRAY]).max() > SAME * abs(left[0, 0]) or left[2, 2] != 1
    remedy = "transpose it, if it is MATLAB's; skew is not supported"
    reject(wrong, path, left.tolist(), "fx, 0, cx; 0, fy, cy; 0, 0, 1", remedy, "K" if one else "P1")
    fx, fy = float(left[0, 0]), float(left[1, 1])
    apart = np.abs(left - right)
    apart[0, -1] = 0
    pair = fx > 0 and apart.max() <= SAME * fx and (one or right[0, 3] < 0)
    reject(not pair, path, "another pair", "P1 and P2 equal but for P2[0, 3] < 0", "rectify the pair", "P2")
    camera = Camera(
        kind="pinhole", image=(int(value["image_width"]), int(value["image_height"])), focal_px=(fx, fy),
        # OpenCV's pixel coordinates begin at the centre of the first pixel, ours at its corner.
        centre_px=(float(left[0, 2]) + 0.5, float(left[1, 2]) + 0.5), position=value["position"],
        rotation=value["rotation"], baseline=0.0 if one else float(-right[0, 3] / fx),
    )  # fmt: skip
    return require_camera(camera, path)


def _opencv_numbers(path: Path) -> dict[str, Array]:
    """Returns the numbers (N,) under each of KEYS that the file has, in YAML, XML or JSON."""
    import cv2

    text = read_text(path, YAML_BYTES)
    if path.suffix.lower() in YAML and not text.startswith("%YAML"):
        text = f"%YAML:1.0\n---\n{text}"  # as ROS writes it
    found = {}
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        for key, (_, others) in KEYS.items():
            node = next((node for name in (key, *others) if not (node := storage.getNode(name)).empty()), None)
            if node is not None:
                # The numbers of a matrix are read without its stated size, which may be as large as the memory.
                found[key] = np.array(list(_numbers(node.getNode("data") if node.isMap() else node)))
        names = storage.root().keys()
        nodes = [storage.getNode(name) for name in names if DISTORTION.fullmatch(name)]
        found["D"] = np.array([v for node in nodes for v in _numbers(node.getNode("data") if node.isMap() else node)])
    except (cv2.error, SystemError):
        expected = "a file of cv2.FileStorage in YAML, XML or JSON"
        raise InputError(file=path, got="no OpenCV file", expected=expected, remedy="check --camera") from None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return found


def _numbers(node: Any) -> Iterator[float]:
    if node.isString():
        return
    if not node.isSeq():
        yield node.real()
        return
    for k in range(node.size()):
        yield from _numbers(node.at(k))


PERSON, SMALLEST_PERSON = 1.7, 2.0  # a person's height, m, and the least px that it must have in the picture
WIDEST, WIDEST_SHARE = 2.0, 0.25  # m, and share of the height: a longer baseline is not in metres


def read_calibration(path: Path) -> Camera:
    """Returns the camera of a calibration file: Tsai's XML, OpenCV's or ROS's YAML, XML or JSON, or camera.json."""
    require_regular(path, "check --camera: a camera.json, or Tsai's calibration as .xml")
    camera = _reader(path)(path)
    height = float(camera.position[2])
    # From so high, a person right below would be smaller than 2 px in any direction of view.
    person = camera.focal_px[1] * PERSON / height if camera.kind == "pinhole" else np.inf
    got = f"height {height:g} m, from where a person is {person:.2g} px tall"
    reject(person < SMALLEST_PERSON, path, got, "metres", "give all lengths in metres", "position")
    widest = max(WIDEST, height * WIDEST_SHARE)
    got, expected = f"{camera.baseline:g} m", f"metres, up to {widest:g} m at this height"
    remedy = "give T, and P2 made from it, in metres: divide by 1000 if they are in mm"
    reject(camera.baseline > widest, path, got, expected, remedy, "baseline")
    return camera


def _reader(path: Path) -> Callable[[Path], Camera]:
    suffix = path.suffix.lower()
    if suffix == ".xml":
        return read_opencv if b"<opencv_storage" in read_regular(path, XML_BYTES)[:1000] else read_tsai
    if suffix in YAML:
        return read_opencv
    keys = {name for key, (_, others) in KEYS.items() for name in (key, *others)} - {"rotation", "position"}
    document = parse_json(read_text(path, JSON_BYTES), path, "give a camera.json")
    if isinstance(document, dict) and not keys.isdisjoint(document):
        return read_opencv
    if isinstance(document, dict) and document.keys().isdisjoint(OWN):
        raise InputError(file=path, got=f"the keys {', '.join(document)}"[:100], expected=FORMS, remedy=AS_OWN)
    return read_camera
