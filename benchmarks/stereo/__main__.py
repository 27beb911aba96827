"""`stereo`: the paper's scenes, its decisions one by one, crowds beside one eye.

    python -m benchmarks.stereo MODE [--seeds a:b] [--only cross,merge,…] [--chart FILE] [--store FILE] [--json FILE]

scenes     the paper's scenes: position errors (bias and scatter apart), group scores, events
decisions  each decision of the tracker switched off: paired differences of F1 and of the position error
density    `stereo` in crowds of growing density, beside `group-pda` and `blob` on the left pictures (table and SVG)

The docstrings of the files in this folder say what the columns mean.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.stereo import decisions, density, scenes
from benchmarks.support.options import add_seeds, new_parser, one_thread, seeds_text

MODES: dict[str, Callable[[argparse.Namespace], Any]] = {
    "scenes": scenes.scenes,
    "decisions": decisions.decisions,
    "density": density.density,
}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=MODES)
    add_seeds(parser, "20000:20030")
    parser.add_argument("--only", help="scenes, separated by commas: cross, merge, stairs, crowded, split, pillar")
    parser.add_argument(
        "--options", help="decisions: names of decisions, separated by commas; scenes: stereo, preset paper"
    )
    parser.add_argument("--chart", type=Path, help="density: the SVG to write")
    parser.add_argument("--store", type=Path, help="JSON of rows; measured ones are kept")
    parser.add_argument("--json", type=Path, help="writes what was measured, sequence by sequence")
    args = parser.parse_args()
    one_thread()
    found = MODES[args.mode](args)
    if args.json is not None:
        content = {"mode": args.mode, "seeds": seeds_text(args.seeds), "found": found}
        args.json.write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    main()
