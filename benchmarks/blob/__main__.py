"""`blob`: what its options and its ground are worth, from pixels.

    python -m benchmarks.blob options [--scenes 30] [--data FOLDER]
    python -m benchmarks.blob ground [--seeds 0:2]
    python -m benchmarks.blob both [pets] [rendered] [faults] [standing] [evidence] [--data FOLDER] [--seeds 0:2]
    python -m benchmarks.blob pixels [pets] [rendered] [hall] [standing] [above] [--data FOLDER] [--seeds 0:2]
    python -m benchmarks.blob degraded [grey] [tinted] [mpeg2] … [--seeds 20000:20002]

The docstrings of benchmarks/blob/*.py say what each mode prints. Without a part a mode does all its parts (`pixels`:
all but `above`).
"""

from __future__ import annotations

from benchmarks.blob import both, degraded, ground, options, pixels
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser, one_thread

PARTS = {
    "options": (),
    "ground": (),
    "degraded": tuple(degraded.KINDS),
    "both": ("pets", "rendered", "faults", "standing", "evidence"),
    "pixels": ("pets", "rendered", "hall", "standing", "above"),
}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=PARTS)
    parser.add_argument("part", nargs="*", help="parts of the mode")
    parser.add_argument("--scenes", type=int, default=30, help="options: scenes with occlusion")
    add_seeds(parser, "0:2", what="both, degraded, ground, pixels: ")
    add_data(parser)
    args = parser.parse_intermixed_args()
    unknown = set(args.part) - set(PARTS[args.mode])
    if unknown:
        parser.error(f"mode {args.mode} has no part {', '.join(sorted(unknown))}; parts: {', '.join(PARTS[args.mode])}")
    if args.mode == "options":
        one_thread()
        options.options(args.scenes, args.data)
    elif args.mode == "ground":
        ground.ground(args.seeds)
    elif args.mode == "degraded":
        degraded.degraded(args.part, args.seeds)
    elif args.mode == "both":
        both.both(args.part or [*PARTS["both"]], args.data / PETS, args.seeds)
    else:
        pixels.pixels(args.part or PARTS["pixels"][:-1], args.data / PETS, args.seeds)


if __name__ == "__main__":
    main()
