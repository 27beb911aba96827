"""Reader for CAVIAR ground truth (CVML): an XML file with the labels of a recording, frames from 0.

The format states neither frame rate nor picture size. CAVIAR's own recordings have 25 fps and 384x288 px; for labels of
others in this format the user gives the frame rate. A box is stored as centre and size. Most boxes are wider than tall
although the people stand, so only their centres can be relied on. The image scale is the median of the longer sides /
1.7 m. Groups are labelled in each frame.
"""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import COORDINATE, FRAMES
from sim.arrays import repeated_ids
from sim.geometry.boxes import centres
from sim.scene.camera import scale_of_all_boxes, scale_of_first_boxes
from sim.store.numeric_text import NAME_THEM, NumericTable, bounded_number, person_ids, xml_root
from sim.store.recorded_sequence import recorded_sequence
from sim.types import Sequence, Truth
from tracking.recordings.mot_table import MotTable
from tracking.recordings.mot_text import truth_of_table
from tracking.recordings.options import NO_OPTIONS, RecordingOptions

FPS = 25.0
LAST_ID = 10**15 - 1  # ids pass through float64
IMAGE_SIZE = (384, 288)
SMALLEST = 1e-6  # px: least width and height of a box


def people_of(path: Path, root: ET.Element) -> tuple[MotTable, int]:
    """Returns the people in a CAVIAR file, sorted by (frame, id), and its number of frames.

    Our frame number is that of the file + 1. The groups of the table are None if no frame has a list of groups.
    """
    rows, length = list[tuple[float, ...]](), 0
    for element in root.iterfind("frame"):
        index = _whole(path, "frame", element, "number", FRAMES - 1) + 1
        length = max(length, index)
        label = _labels(path, index, element)
        rows += [_row(path, index, person, label) for person in element.iterfind("objectlist/object")]
    values = np.array(sorted(rows), np.float64).reshape(-1, 7)
    frame, id, label_ = (values[:, k].astype(np.int64) for k in range(3))
    table = NumericTable(path, np.delete(values, 2, axis=1), frame - 1, unit="frame")
    table.reject(repeated_ids(frame, id), "each id once in a frame", "remove one of the two")
    group = None if root.find("frame/grouplist") is None else label_
    return MotTable(table, frame, id, values[:, 3:], np.zeros((len(rows), 0)), group), length


def _number(path: Path, place: str, element: ET.Element, key: str, low: float = -COORDINATE) -> float:
    return bounded_number(path, f"{place}: {element.tag} {key}", element.get(key), low, COORDINATE)


def _whole(path: Path, place: str, element: ET.Element, key: str, last: int = LAST_ID) -> int:
    return int(bounded_number(path, f"{place}: {element.tag} {key}", element.get(key), 0, last, whole=True))


def _labels(path: Path, index: int, element: ET.Element) -> dict[int, int]:
    label: dict[int, int] = {}
    for group in element.iterfind("grouplist/group"):
        members = person_ids(path, f"frame {index - 1}: members", group.findtext("members") or "")
        # One member is no group.
        if len(members) < 2:
            continue
        if members & label.keys():
            warnings.warn(f"{path}: frame {index - 1}: a person in two groups; the first holds", stacklevel=3)
        number = _whole(path, f"frame {index - 1}", group, "id")
        label.update({m: number for m in sorted(members) if m not in label})
    return label


def _row(path: Path, index: int, person: ET.Element, label: dict[int, int]) -> tuple[float, ...]:
    """Returns (frame, id, label, left, top, width, height), px; label -1 for alone."""
    place, box = f"frame {index - 1}", person.find("box")
    id = _whole(path, place, person, "id")
    place += f": object {id}"
    if box is None:
        raise InputError(file=path, place=place, got="an object without box", expected="a box", remedy="add it")
    x, y = (_number(path, place, box, key) for key in ("xc", "yc"))
    w, h = (_number(path, place, box, key, SMALLEST) for key in ("w", "h"))
    return index, id, label.get(id, -1), x - w / 2, y - h / 2, w, h


def open_file(path: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns the CAVIAR file `path` as Sequence, without pictures and detections.

    Its truth is in the image. `options.px_per_m` None: the scale of the truth is the median of the longer sides of all
    boxes / 1.7 m, that of the sequence the median of the first 100; `source["px_per_m_frames"]` is then the last frame
    of these boxes. `options.camera` is refused for CAVIAR's own recordings.
    """
    root, px_per_m = xml_root(path, "a CAVIAR file (CVML)", "fetch the file again"), options.px_per_m
    remedy = f"give another file; if it holds rows of people, write them as .csv, and {NAME_THEM}"
    got = "no <frame> in <dataset>" if root.tag == "dataset" else f"<{root.tag}>"
    reject(root.tag != "dataset" or root.find("frame") is None, path, got, "<dataset> of CAVIAR (CVML)", remedy)
    table, length = people_of(path, root)
    name, sides, centre = root.get("name", path.stem), table.box[:, 2:].max(axis=1), centres(table.box)
    # CAVIAR's own recordings have hypotheses about what people do, and all boxes lie in CAVIAR's pictures.
    inside = bool(((centre >= 0) & (centre <= IMAGE_SIZE)).all())
    own = inside and root.find("frame/objectlist/object/hypothesislist") is not None
    rate = options.fps or FPS
    if own:
        options.reject(path, "a CAVIAR recording", "its boxes do not show where people stand", "camera")
    got = "labels without frame rate, not of CAVIAR's recordings"
    reject(options.fps is None and not own, path, got, "the frames per second of the video", "give --fps", "--fps")
    if options.fps is None:
        # The text names no path, so that a command over many recordings prints it once.
        words = f"CAVIAR's recordings are taken at {FPS:g} fps, with pictures of {IMAGE_SIZE[0]}×{IMAGE_SIZE[1]} px"
        warnings.warn(f"{words} (--fps says otherwise)", stacklevel=3)
    scale, learned = scale_of_first_boxes(table.frame, sides) if px_per_m is None else (px_per_m, 0)

    def truth() -> Truth:
        return truth_of_table(table, name, rate, length, px_per_m or scale_of_all_boxes(sides))

    source = {"kind": "caviar", "path": str(path), **({"px_per_m_frames": learned} if learned else {})}
    size = IMAGE_SIZE if own else None
    return recorded_sequence(
        source, name, rate, length, load_truth=truth, px_per_m=scale, image_size=size, camera=options.camera
    )


def is_caviar(path: Path) -> bool:
    """Returns True if "<dataset" is in the first 1000 bytes of the file, as in CVML."""
    with path.open("rb") as file:
        return b"<dataset" in file.read(1000)
