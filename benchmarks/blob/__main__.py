"""`blob`: on boxes beside other trackers, what its options and its ground are worth, from pixels.

    python -m benchmarks.blob peers [scenes] [rates] [real] [speed] --peer-python PYTHON [--data FOLDER] [--rounds 5]
        [--scenes 24] [--chart FILE.svg]
    python -m benchmarks.blob options [--scenes 30] [--data FOLDER]
    python -m benchmarks.blob ground [--seeds 0:2]
    python -m benchmarks.blob pixels [pets] [rendered] [hall] [standing] [above] [--data FOLDER] [--seeds 0:2]

The docstrings of benchmarks/blob/*.py say what each mode prints. Without a part a mode does all its parts (`pixels`:
all but `above`).
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.blob import boxes, ground, options, pixels
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser, one_thread

PARTS = {
    "peers": ("scenes", "rates", "real", "speed"),
    "options": (),
    "ground": (),
    "pixels": ("pets", "rendered", "hall", "standing", "above"),
}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=PARTS)
    parser.add_argument("part", nargs="*", help="parts of the mode")
    parser.add_argument("--peer-python", help="peers: interpreter of an environment with `trackers` and `supervision`")
    parser.add_argument("--rounds", type=int, default=5, help="peers: rounds of the timing")
    parser.add_argument("--scenes", type=int, help="scenes with occlusion; peers: 24, else 30")
    parser.add_argument("--chart", type=Path, help="peers: picture of `rates`")
    add_seeds(parser, "0:2", what="ground, pixels: ")
    add_data(parser)
    args = parser.parse_intermixed_args()
    unknown = set(args.part) - set(PARTS[args.mode])
    if unknown:
        parser.error(f"mode {args.mode} has no part {', '.join(sorted(unknown))}; parts: {', '.join(PARTS[args.mode])}")
    if args.mode == "peers":
        if args.peer_python is None:
            parser.error("mode peers needs --peer-python")
        one_thread()
        settings = boxes.PeerRun(args.peer_python, args.data, args.rounds, args.scenes or 24, args.chart)
        boxes.peers(args.part or PARTS["peers"], settings)
    elif args.mode == "options":
        one_thread()
        options.options(args.scenes or 30, args.data)
    elif args.mode == "ground":
        ground.ground(args.seeds)
    else:
        pixels.pixels(args.part or PARTS["pixels"][:-1], args.data / PETS, args.seeds)


if __name__ == "__main__":
    main()
