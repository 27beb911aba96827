"""How alike simulated and real streets are in what tells who walks with whom.

    python -m benchmarks.belonging pairs [--scenes street crowd party streets] [--seeds 0:3] [--out FOLDER]
    python -m benchmarks.belonging likeness [--chart FILE.svg]
    python -m benchmarks.belonging people [--sparse DENSITY]
    python -m benchmarks.belonging transfer --peer-python PYTHON [--train street+crowd+party …]
    python -m benchmarks.belonging giveaway --peer-python PYTHON

PYTHON is the interpreter of an environment of its own, with scikit-learn and numpy: python -m venv FOLDER, then
FOLDER/bin/pip install scikit-learn numpy. All modes but `pairs` read what `pairs` wrote to --out. --scenes names
scenarios, suites or *.toml files, by default street, crowd, party and the suite streets. The recordings are seq_hotel
and zara01. Everything is sampled at 2.5 frames/s; people more than half outside the image are left out. A source is
called by its file name without folder and ending; A+B stands for both.
pairs: writes the people, and the features of all pairs of people who are less than 5 m apart in some frame
(benchmarks/belonging/pair_features.py), one row per pair and frame. All modes but `people` use at most 2000 rows of a
simulated scene, drawn at random: a dense scene has many pairs, and would else outweigh all others.
likeness: quantiles (10, 50, 90 %) of each feature, of mates (two people of one labelled group) and of strangers; then
the Kolmogorov-Smirnov distance of each simulated source to each recording, beside that of the two recordings.
people: who is on the streets, how they arrive, wait and walk. --sparse adds a column of the scenes of a source with
fewer people per m², as recordings are to be compared with scenes of their own density.
transfer: classifiers that are trained on one source tell mates from strangers on a recording. Pairwise F1 over (pair,
frame) at the threshold 0.5 and at the threshold that is best on held-out scenes of the training source; average
precision; 95 % intervals by blocks of frames. Then F1 at 0.5 without one family of features.
giveaway: a classifier tells simulated from real pairs: area under the ROC curve on held-out scenes (0.5: cannot tell),
and how much of it is lost if the values of one family of features are shuffled.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from benchmarks.belonging import likeness, people, transfer
from benchmarks.belonging.sources import recorded, simulated, write
from benchmarks.support.options import HOTEL, ZARA, add_data, add_seeds, new_parser

RECORDINGS = {Path(folder).name: folder for folder in (HOTEL, ZARA)}


def pairs(scenes: list[str], seeds: range, out: Path, data: Path, label_errors: bool) -> None:
    for name in (*RECORDINGS, *scenes):
        begun = time.perf_counter()
        source = recorded(data / RECORDINGS[name]) if name in RECORDINGS else simulated(name, seeds, label_errors)
        write(out, Path(name).stem, source)
        rows = f"{len(source.mates)} rows of pairs, {source.mates.sum()} of mates"
        print(f"{name}: {len(source.length)} scenes, {rows}, {time.perf_counter() - begun:.0f} s", file=sys.stderr)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["pairs", "likeness", "people", "transfer", "giveaway"])
    parser.add_argument("--scenes", nargs="+", default=["street", "crowd", "party", "streets"], metavar="NAME")
    parser.add_argument("--out", type=Path, default=Path("belonging"), metavar="FOLDER", help="of the sources")
    parser.add_argument("--label-errors", action="store_true", help="pairs: simulated positions err like labels do")
    parser.add_argument("--chart", type=Path, metavar="FILE", help="likeness: where to draw the distributions")
    parser.add_argument("--sparse", type=float, metavar="DENSITY", help="people: scenes below it in a column")
    parser.add_argument("--train", nargs="+", metavar="A+B", help="transfer: instead of each scene")
    parser.add_argument("--peer-python", metavar="PYTHON", help="interpreter of an environment with scikit-learn")
    add_seeds(parser, "0:3", what="pairs: ")
    add_data(parser)
    args = parser.parse_args()
    if args.mode in ("transfer", "giveaway") and args.peer_python is None:
        parser.error(f"mode {args.mode} needs --peer-python")
    scenes = [Path(name).stem for name in args.scenes]
    if args.mode == "pairs":
        pairs(args.scenes, args.seeds, args.out, args.data, args.label_errors)
    elif args.mode == "likeness":
        likeness.likeness(args.out, scenes, tuple(RECORDINGS), args.chart)
    elif args.mode == "people":
        people.people(args.out, scenes, tuple(RECORDINGS), args.sparse)
    elif args.mode == "transfer":
        transfer.transfer(args.out, args.train or scenes, tuple(RECORDINGS), args.peer_python)
    else:
        transfer.giveaway(args.out, scenes, tuple(RECORDINGS), args.peer_python)


if __name__ == "__main__":
    main()
