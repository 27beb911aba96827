"""`joint`: the paper's Table 2, what departures are worth, and what eq. 5 is worth for two people.

    python -m benchmarks.joint MODE [--seeds a:b] [--filter-seeds a:b] [--set k=v]… [--only A,B]

table2      the paper's Tables 2 and 3b: full, VAR1, VAR2, VAR3 and .2 of the preset paper and of the default, on
            friends-meet and on a recording (--data); differences of variants, paired
particles   full and VAR1 of the preset by N_x, on friends-meet; and for two people, beside the exact posterior
ablation    friends-meet: scores without each departure from the paper, paired differences
coupling    two people: what eq. 5 is worth by the exact posterior, and by the decentralised filter

One sequence of each scenario counts. Group scores are pooled over the frames of all sequences together; differences
are of the means over sequences, with 95 % intervals. Detections are the points of the simulated detector; `.2` has
true positions, as in the paper.
"""

from __future__ import annotations

import argparse

from benchmarks.joint import exact, settings, table2
from benchmarks.support.options import add_data, add_seeds, new_parser, one_thread, seed_range


def particles(given: argparse.Namespace) -> None:
    """Prints the tables of the mode particles."""
    table2.by_number(given)
    exact.by_number(given)


def main() -> None:
    parser = new_parser(__doc__)
    modes = {
        "table2": table2.table2, "particles": particles, "ablation": settings.ablation, "coupling": exact.coupling,
    }  # fmt: skip
    parser.add_argument("mode", choices=modes)
    add_seeds(parser, "20000:20001")
    add_data(parser)
    parser.add_argument("--filter-seeds", type=seed_range, default="0:5", metavar="A:B", help="seeds of the filters")
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="parameters of joint")
    parser.add_argument("--suite", help="of the mode ablation (friends-meet)")
    parser.add_argument("--only", help="ablation: settings, separated by commas")
    given = parser.parse_args()
    modes[given.mode](given)


if __name__ == "__main__":
    one_thread()
    main()
