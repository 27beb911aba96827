"""Partners and strangers of a suite beside those of recordings, and how far a learner gets from the one to the other.

    python -m benchmarks partners --peer-python PYTHON [--scenes streets] [--seeds 20000:20003] [--data FOLDER]

People are looked at every 0.4 s, while at most half of a person is outside of the image. A pair is two people who are
in view together for 2 s or more: partners if they are one group for most of that time, else strangers. Three numbers
are 25, 50 and 75 % quantiles, of means over time. Angles are between a walking pair and its way, 90° is abreast.
Strangers walk alike while they are less than 1.5 m apart, less than 0.3 m/s different, and both at least 0.3 m/s fast.
Arrivals in the first 2 s of a sequence are unknown.
A boosted classifier learns who are partners: from pairs, each with the mean, least and greatest values of quantities
and with times; or from moments of people within 4 m, with all that the belief knows of them. F1 is of those with a
probability above 0.5. weighed: partners and strangers weigh the same in training. Of a suite each seed is learned by
itself; mean, least and greatest. PYTHON: the interpreter of an environment with scikit-learn.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from benchmarks.support.options import HOTEL, ZARA, add_data, add_seeds, new_parser
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import resolve
from sim.types import Array, Bools, Truth
from tracking.fitting.grouping_scenes import SLOW, simulated
from tracking.grouping import pair_evidence as pe
from tracking.grouping.person_motion import STEP, PersonMotion, step_rows
from tracking.recordings.source import open_source

RUNNER = Path(__file__).parent / "peers" / "run_partners.py"
LEAST, NEAR, ALIKE, LONG = 2.0, 1.5, 0.3, 1.0  # s, m, m/s, s
SIDEWAYS, LENGTHWISE, WALKING = map(pe.QUANTITIES.index, ("sideways", "lengthwise", "walking difference"))
People = dict[str, Array]


def people_of(truth: Truth) -> People:
    """Returns what is known of the people of a scene. pairs (P, F): what is learned from. Of each pair (P,): partners;
    two, of a group of two; distance, m; angle, degrees; near; alike; arrival, s apart. moments (R, M): what is learned
    from; mates (R,). Of people (N,): neighbour, m to the nearest partner; speed, m/s. view (1,): how many."""
    assert truth.pos is not None
    every = max(1, round(truth.fps / SLOW))
    kept = (truth.frame - 1) % every == 0
    if truth.truncation is not None:
        kept &= truth.truncation <= 0.5
    column, step = np.unique(truth.id[kept], return_inverse=True)[1], (truth.frame[kept] - 1) // every
    steps, people = -(-truth.length // every), int(column.max(initial=0)) + 1
    group, first, last = np.full((steps, people), -1), np.full(people, steps), np.full(people, -1)
    group[step, column] = truth.group[kept]
    np.minimum.at(first, column, step)
    np.maximum.at(last, column, step)
    seen = step_rows(step, column, truth.pos[kept], steps, truth.fps / every)
    motion = PersonMotion(people, STEP).add(seen.step, seen.column, seen.pos, seen.time)
    vel, cuts = motion.vel, np.searchsorted(seen.step, np.arange(steps + 1))
    i, j = np.concatenate([np.add(np.triu_indices(b - a, 1), a) for a, b in pairwise(cuts)], axis=1)
    key, of, count = np.unique(seen.column[i] * people + seen.column[j], return_inverse=True, return_counts=True)
    a, b = key // people, key % people

    def seconds(rows: Bools) -> Array:
        return np.asarray(np.bincount(of, rows, len(key)) * STEP)

    now = pe.instant_evidence(seen.pos, motion, i, j, others=False)[:, : -len(pe.OTHERS)]
    now = np.column_stack([now, np.degrees(np.arctan2(now[:, SIDEWAYS], now[:, LENGTHWISE]))])
    least, greatest = (np.full((len(key), now.shape[1]), end) for end in (np.inf, -np.inf))
    np.fmin.at(least, of, now)
    np.fmax.at(greatest, of, now)
    with np.errstate(invalid="ignore"):
        mean = np.stack([STEP * np.bincount(of, np.nan_to_num(x), len(key)) / seconds(x == x) for x in now.T], 1)
    a_group, b_group = group[seen.step[i], seen.column[i]], group[seen.step[j], seen.column[j]]
    partners, near = seconds((a_group >= 0) & (a_group == b_group)) > count * STEP / 2, now[:, 0] < NEAR
    neighbour, ends = np.full(people, np.inf), np.r_[a[partners], b[partners]]
    number = np.bincount(ends, minlength=people)
    np.minimum.at(neighbour, ends, np.tile(mean[partners, 0], 2))
    arrival, departure = (np.abs(end[a] - end[b]) * STEP for end in (first, last))
    values = np.column_stack([mean, least, greatest, count * STEP, seconds(near), arrival, departure])
    arrival[np.minimum(first[a], first[b]) * STEP < LEAST] = np.nan
    pairs = {
        "pairs": np.where(np.isfinite(values), values, np.nan), "partners": partners,
        "two": partners & (np.maximum(number[a], number[b]) == 1), "distance": mean[:, 0], "angle": mean[:, -1],
        "near": least[:, 0] < NEAR, "alike": seconds(near & (now[:, WALKING] < ALIKE)) >= LONG, "arrival": arrival,
    }  # fmt: skip
    pace, parts = np.hypot(*vel.T), list(pe.evidence(seen, STEP))
    walked, walking = (np.bincount(seen.column, np.where(pace >= pe.STANDING, x, 0.0), people) for x in (pace, 1.0))
    mates = [(group[x.step, x.a] >= 0) & (group[x.step, x.a] == group[x.step, x.b]) for x in parts]
    return {
        **{name: x[count * STEP >= LEAST] for name, x in pairs.items()}, "neighbour": neighbour,
        "moments": np.concatenate([np.zeros((0, len(pe.NAMES))), *(x.values for x in parts)]),
        "mates": np.concatenate([np.zeros(0, bool), *mates]),
        "speed": walked[walking > 0] / walking[walking > 0], "view": np.array([len(step) / steps]),
    }  # fmt: skip


def merged(scenes: Sequence[People]) -> People:
    return {name: np.concatenate([one[name] for one in scenes]) for name in scenes[0]}


def figures(people: People) -> dict[str, str]:
    own, two, others = people["partners"], people["two"], ~people["partners"]

    def quarters(x: Array, digits: int = 2) -> str:
        return ", ".join(f"{q:.{digits}f}" for q in np.quantile(x[np.isfinite(x)], (0.25, 0.5, 0.75)))

    return {
        "people in view": quarters(people["view"], 1), "speed, m/s": quarters(people["speed"]),
        "people in groups": f"{np.isfinite(people['neighbour']).mean():.0%}",
        "partners, of them in groups of two": f"{own.sum()}, {two.sum() / own.sum():.0%}",
        "distance of partners, m": quarters(people["distance"][own]),
        "distance to the nearest partner, m": quarters(people["neighbour"]),
        "distance in groups of two, m": quarters(people["distance"][two]),
        "angle of groups of two": quarters(people["angle"][two], 0),
        "time between arrivals of partners, s": quarters(people["arrival"][own], 1),
        "time between arrivals of strangers, s": quarters(people["arrival"][others], 1),
        "strangers once within 1.5 m": f"{people['near'][others].mean():.0%}",
        "strangers who walk alike for 1 s": f"{people['alike'][others].mean():.1%}",
    }  # fmt: skip


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--peer-python", required=True, help="interpreter of an environment with scikit-learn")
    parser.add_argument("--scenes", nargs="+", default=["streets"], metavar="NAME", help="suites or *.toml files")
    add_seeds(parser, "20000:20003")
    add_data(parser)
    args = parser.parse_args()
    truths = {name: open_source(args.data / name, images=False)[0].truth for name in (HOTEL, ZARA)}
    some = {name: [people_of(truth)] for name, truth in truths.items() if truth is not None}
    for name in args.scenes:
        some[name] = [merged([people_of(simulated(entry, seed)) for entry in resolve(name)]) for seed in args.seeds]
    head(["", *(Path(name).stem for name in some)])
    columns = [figures(merged(people)) for people in some.values()]
    for key in columns[0]:
        row([key, *(column[key] for column in columns)])
    taught = [(name, one) for name, people in some.items() for one in people]
    with tempfile.TemporaryDirectory() as folder:
        rows, scores, kinds = f"{folder}/rows.npz", f"{folder}/f1.npy", ("pairs", "partners", "moments", "mates")
        np.savez(rows, **{f"{kind} {k}": one[kind] for kind in kinds for k, (_, one) in enumerate(taught)})
        subprocess.run([args.peer_python, RUNNER, rows, str(len(truths)), scores], check=True)
        f1 = np.load(scores)
    head(["learned from", "on", "pairs", "pairs, weighed", "moments", "moments, weighed"])
    for name, (k, other) in product(some, enumerate(truths)):
        if name != other:
            found = f1[[one == name for one, _ in taught], k].T
            cells = [f"{x.mean():.3f}" + f" ({x.min():.3f}–{x.max():.3f})" * (len(x) > 1) for x in found]
            row([Path(name).stem, Path(other).stem, *cells])


if __name__ == "__main__":
    main()
