"""`relational` and `particle`: errors, groups, calibration, and what each departure is worth.

    python -m benchmarks.relational MODE [--seeds a:b] [--counts 500,1000,…] [--set k=v]… [--params PRESET]

particles    the paper's Figs 7 and 8: errors of both filters, from the preset paper and by default, against the number
             of particles, on the suite occlusion. As in the paper, every visible person is detected and nobody else,
             and feet are displaced by partial occlusion; intervals are over the filter seeds; --chart FILE.svg
hidden       error of one of two people who walk together while nobody sees this one, against the length of the
             occlusion; --chart FILE.svg
recordings   error of one member of each labelled group in three recordings (--data) who is not detected for 2 s
             in every 6 s; positions err by 0.1 m
groups       scores of people, groups and events on a suite, beside `blob`; groupings of the same tracks
ablation     errors, HOTA, IDF1, group and pairwise F1 on a suite, and the error of a hidden partner, without each
             departure from the paper; differences to the defaults
observed     the speed table of the preset paper

The error is the mean, over true people and frames, of the distance to the track that an optimal assignment gives them,
at most 2 m, which is also the cost of a missing track. Both filters have the same detections and the same seeds. The
filter's seed is that of the scene, and further ones with --filter-seeds; in mode particles those alone. Differences are
paired, with 95 % intervals of means over seeds.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.relational import ablation, errors, groups, observed
from benchmarks.support.options import add_data, add_seeds, new_parser, one_thread


def main() -> None:
    parser = new_parser(__doc__)
    modes = {
        "particles": errors.particles, "hidden": errors.hidden, "recordings": errors.recordings,
        "groups": groups.scores, "ablation": ablation.ablation, "observed": observed.table,
    }  # fmt: skip
    parser.add_argument("mode", choices=modes)
    add_seeds(parser, "20000:20030")
    add_seeds(parser, "0:1", "--filter-seeds", "modes particles, groups and ablation: of the filter; ")
    parser.add_argument("--counts", type=lambda x: [int(n) for n in x.split(",")], default=[500, 1000, 2000, 4000])
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="parameters of both filters")
    parser.add_argument("--params", help="preset of both filters, as paper")
    parser.add_argument("--suite", default="standard", help="of modes groups and ablation")
    parser.add_argument("--entry", metavar="NAME", help="only these entries of the suite, a comma between them")
    parser.add_argument("--only", metavar="SETTING,…", help="mode ablation: these settings beside the defaults")
    add_data(parser)
    parser.add_argument("--chart", type=Path, metavar="FILE.svg", help="modes particles and hidden: draw them")
    given = parser.parse_args()
    modes[given.mode](given)


if __name__ == "__main__":
    one_thread()
    main()
