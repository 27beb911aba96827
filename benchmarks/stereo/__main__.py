"""`stereo`: the paper's scenes, its decisions one by one, honest pictures, cost of matching.

    python -m benchmarks.stereo MODE [--seeds a:b] [--only cross,merge,…] [--chart FILE] [--store FILE] [--json FILE]

pictures   OpenCV's StereoSGBM and the tracker's own matcher against the true disparity
decalibration  what a slightly wrong rig costs the tracker's matcher
real       the tracker's matcher on a real pair
photometric   left against right picture at the true disparity, without a matcher
contrast   the rendered ground beside real ground, without a matcher
trajectories  the paths of groups in space, as in Figs. 5, 7 and 9 of the paper (an SVG)
scenes     the paper's scenes: position errors (bias and scatter apart), group scores, events
causes     position errors with true disparities, and with people that count alike
decisions  each decision of the tracker switched off: paired differences of F1 and of the position error
points     decisions switched off where the tracker gets points, with misses and false alarms
density    `stereo` in crowds of growing density, beside `group-pda` and `blob` on the left pictures (table and SVG)
cost       time of matching inside the foreground over dense matching, against the foreground's share (table and SVG);
           frames per second

The docstrings of the files in this folder say what the columns mean.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.stereo import (
    causes,
    contrast,
    cost,
    decalibration,
    decisions,
    density,
    from_points,
    photometric,
    pictures,
    real,
    scenes,
    trajectories,
)
from benchmarks.support.options import add_data, add_seeds, new_parser, one_thread, seeds_text

MODES: dict[str, Callable[[argparse.Namespace], Any]] = {
    "pictures": pictures.pictures,
    "decalibration": decalibration.decalibration,
    "real": real.real,
    "photometric": photometric.photometric,
    "contrast": contrast.contrast,
    "trajectories": trajectories.trajectories,
    "scenes": scenes.scenes,
    "causes": causes.causes,
    "decisions": decisions.decisions,
    "points": from_points.points,
    "density": density.density,
    "cost": cost.cost,
}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=MODES)
    add_seeds(parser, "20000:20030")
    add_data(parser)
    parser.add_argument(
        "--only", help="scenes, separated by commas: cross, merge, stairs, crowded, split, pillar; points: scenarios"
    )
    parser.add_argument(
        "--options", help="decisions: names of decisions, separated by commas; scenes: stereo, preset paper"
    )
    parser.add_argument("--chart", type=Path, help="trajectories (needed), density, cost: the SVG to write")
    parser.add_argument(
        "--store", type=Path, help="scenes, causes, decisions, density: JSON of rows; measured ones are kept"
    )
    parser.add_argument("--json", type=Path, help="writes what was measured, sequence by sequence")
    args = parser.parse_args()
    if args.mode == "trajectories" and args.chart is None:
        parser.error("trajectories needs --chart FILE")
    one_thread()
    found = MODES[args.mode](args)
    if args.json is not None:
        content = {"mode": args.mode, "seeds": seeds_text(args.seeds), "found": found}
        args.json.write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    main()
