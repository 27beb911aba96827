"""The ground that boxes show, against the camera, and what it is worth to groups.

    python -m benchmarks ground [boxes] [pixels] [pets] [--boxes 20000:20100] [--pixels 20000:20020] [--data FOLDER]

boxes, pixels: scenes of the suites standard and streets, each before a camera of its own. Its height (2.2 to 12 m),
tilt (3 to 50°) and focal length (0.75 to 1.45 widths of the picture) are drawn. `blob` tracks the boxes of a simulated
detector, or pictures of 480 × 270 px. The first table has the errors of the ground, median and 90 %: tilt, height of
the camera (as a factor), and distances between people up to 4 m apart (as a factor, median of a scene). The second
has the pairwise F1 of groups with the camera known, with the ground learned, and with one scale for near and far;
differences are paired over scenes. A scene whose ground stays unknown counts as learned, with one scale.

pets: the same errors for PETS09-S2L1-first200, by labels, detections and pixels, against its calibration.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from benchmarks.ground.errors import GroundError, ground_error, pets, scores
from benchmarks.ground.scenes import Source, tracked
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser
from benchmarks.support.tables import difference_cell, head, mean_cell, row

PARTS = ("boxes", "pixels", "pets")


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("part", nargs="*", help="parts; default: all")
    add_seeds(parser, "20000:20100", "--boxes", "boxes: ")
    add_seeds(parser, "20000:20020", "--pixels", "pixels: ")
    add_data(parser)
    args = parser.parse_intermixed_args()
    unknown = set(args.part) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; parts: {', '.join(PARTS)}")
    parts = args.part or PARTS
    warnings.simplefilter("ignore", UserWarning)
    sources: dict[Source, range] = {"boxes": args.boxes, "pixels": args.pixels}
    for source, seeds in sources.items():
        if source in parts:
            of_scenes(source, seeds, args.data)
    if "pets" in parts:
        head(["PETS09-S2L1-first200", "tilt, °", "camera's height", "distances"])
        for name, error in pets(args.data / PETS):
            known = error and [f"{error.tilt_deg:+.1f}", f"{error.height:+.1%}", f"{error.distances:+.1%}"]
            row([name, *(known or ["unknown"])])


def of_scenes(source: Source, seeds: range, data: Path) -> None:
    """Prints both tables of one source."""
    errors, found = list[GroundError | None](), []
    for scene in tracked(source, seeds, data):
        errors.append(ground_error(scene))
        found.append(scores(scene))
    known = np.array([error for error in errors if error is not None]).reshape(-1, 3)
    head([source, "scenes", "ground known", "tilt, °", "camera's height", "distances"])
    middle, most = (np.nanquantile(np.abs(known), q, axis=0) for q in (0.5, 0.9))
    forms = (".1f", ".1%", ".1%")
    cells = [f"{a:{form}}, {b:{form}}" for a, b, form in zip(middle, most, forms, strict=True)]
    row(["median, 90 %", str(len(errors)), str(len(known)), *cells])
    camera, learned, none = np.array(found).T
    head([source, "pairwise F1", "learned less this"])
    for name, values in (("camera known", camera), ("learned", learned), ("one scale", none)):
        row([name, mean_cell(values), "" if values is learned else difference_cell(learned - values)])


if __name__ == "__main__":
    main()
