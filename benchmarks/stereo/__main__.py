"""`stereo`: the paper's scenes and the tracker's decisions, crowds beside one eye; pairs for matchers.

    python -m benchmarks.stereo MODE [--seeds a:b] [--json FILE]

scenes     the paper's scenes by its preset and the default: position errors, group scores; each decision switched off
density    `stereo` in crowds of growing density, beside `group-pda` and `blob` on the left pictures
matching   OpenCV's matchers on the suite `stereo-matching`, and the best single plane

The docstrings of the files in this folder say what the columns mean.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.stereo import density, matching, scenes
from benchmarks.support.options import add_seeds, new_parser, one_thread, seeds_text

MODES: dict[str, Callable[[argparse.Namespace], Any]] = {
    "scenes": scenes.scenes, "density": density.density, "matching": matching.matching,
}  # fmt: skip


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=MODES)
    add_seeds(parser, "20000:20003")
    parser.add_argument("--json", type=Path, help="writes what was measured, sequence by sequence")
    args = parser.parse_args()
    one_thread()
    found = MODES[args.mode](args)
    if args.json is not None:
        content = {"mode": args.mode, "seeds": seeds_text(args.seeds), "found": found}
        args.json.write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    main()
