"""`joint`: the paper's Table 2, recordings, event classifier, numbers of particles, events, what departures are worth.

    python -m benchmarks.joint MODE [--seeds a:b] [--filter-seeds a:b] [--set k=v]… [--only A,B]

table2      friends-meet: the paper's columns for full, VAR1, VAR2, VAR3 and .2, and beside them the preset paper,
            group-pda, relational and the default grouping over blob; differences of variants, paired
recordings  seq_hotel, zara01 and Meet_WalkTogether1 from labelled positions with noise 0.1 m and 5 % misses: the
            columns of Table 3b and pairwise F1, beside relational and the default grouping over particle (--data)
classifier  the event classifier: confusion matrix, log loss, expected events per minute where nothing happens; with
            --recordings on true partitions of seq_hotel, zara01 and Meet_WalkTogether1
particles   friends-meet: accuracy and frames/s over N_x and N_z (--chart FILE.svg)
events      a suite (--suite): event F1, hits, false alarms, misses and latency, beside group-pda and the default
            grouping over blob and particle
ablation    friends-meet: scores without each departure from the paper that has a parameter, paired differences

A row of table2 holds a sequence's scores, means over filter seeds. Group scores are pooled over the frames of all
sequences together, strict and core, and of the first variant by kind of sequence; differences are of the means over
sequences, with 95 % intervals. Detections are the points of the simulated detector; `.2` has true positions, as in the
paper.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.joint import event_classifier, events, recordings, settings, table2
from benchmarks.support.options import add_data, add_seeds, new_parser, one_thread, seed_range


def main() -> None:
    parser = new_parser(__doc__)
    modes = {
        "table2": table2.table2, "recordings": recordings.recordings, "classifier": event_classifier.classifier,
        "particles": settings.particles, "events": events.events, "ablation": settings.ablation,
    }  # fmt: skip
    parser.add_argument("mode", choices=modes)
    add_seeds(parser, "20000:20001")
    parser.add_argument("--filter-seeds", type=seed_range, default="0:5", metavar="A:B", help="seeds of the filters")
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="parameters of joint")
    parser.add_argument("--suite", help="of the modes events (standard) and ablation (friends-meet)")
    parser.add_argument("--recordings", action="store_true", help="mode classifier: labelled recordings (--data)")
    parser.add_argument("--chart", type=Path, metavar="FILE.svg", help="mode particles: draw it")
    parser.add_argument("--only", help="table2, recordings, events: variants; ablation: settings; separated by commas")
    add_data(parser)
    given = parser.parse_args()
    modes[given.mode](given)


if __name__ == "__main__":
    one_thread()
    main()
