"""Counts of people at lines and zones, beside the truth: with exact tracks, and with those of `blob`.

    python -m benchmarks counts [--seeds 20000:20001] [--scenes 20]

Streets: entries of the suite streets, evenly spread over it. Two lines cross the middle of the view, along and across,
and a zone is the middle quarter of it. The truth is counted over the true positions of everybody, in view or not, by a
loop over the frames of each person: who has been farther than 0.25 m from a line on one side, and then is on the other,
has crossed it. Exact tracks are true positions, in view those of people who are at most half outside of the image: the
lines end at the edge of the view, where people come and go. `blob` gets simulated boxes. An error is the sum
of the differences per scene, line and direction, as a share of the true number;
with its sign, or all counted as positive. The intervals are of the scenes' own shares. Each step: every change of side
between two frames counts, as with --margin 0. With errors: true positions with errors of a standard deviation of 0.3 m
on each axis, which last for some 1 s (an autoregression with the factor 0.9 per frame) or are new in each frame; the
covariance is reported, or not.

People at lines: `cases.toml`, where each person does one thing at one of the lines. Counts to the left and right.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from math import sqrt
from pathlib import Path

import numpy as np

import tracking
from benchmarks.support.in_memory import truth_in_view
from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, mean_cell, row
from scenarios.loading.resolve import resolve
from sim.rng import rng
from sim.sequence import simulate
from sim.types import Array, Frame, Tracks, Truth
from tracking.export.interval_counts import MARGIN
from tracking.export.places import Places, inside
from tracking.export.tidy_tables import TidyTables, run_tables, truth_tables

CASES = Path(__file__).with_name("cases.toml")
# What people do at the lines of the cases: the ends in x, m, and how often each crosses it to the left and right.
LINES: Mapping[str, tuple[float, float, int, int]] = {
    "cross": (2, 10, 1, 0), "stand": (12, 20, 1, 0), "along": (22, 30, 0, 0), "back": (32, 40, 0, 0),
    "return": (42, 50, 1, 1), "appear": (52, 60, 0, 0), "vanish": (62, 70, 0, 0), "past": (73, 79, 0, 0),
}  # fmt: skip
DOES = {
    "cross": "cross it", "stand": "stand on it, then go on", "along": "walk along it, all the time on it",
    "back": "turn back before it", "return": "cross it, turn, and cross it again", "appear": "appear on it, go on",
    "vanish": "go to it, disappear on it", "past": "walk past its end",
}  # fmt: skip
COUNTS = ("across_to_left", "across_to_right", "along_to_left", "along_to_right", "zone_enter", "zone_leave")
LINE_COUNTS = 4  # of them are of lines
ERROR = 0.3  # m, standard deviation on each axis


def places_of(truth: Truth) -> Places:
    """Returns the two lines and the zone of a street; truth: of people in view."""
    assert truth.pos is not None
    (left, low), (right, high) = truth.pos.min(axis=0), truth.pos.max(axis=0)
    x, y = (left + right) / 2, (low + high) / 2
    w, h = (right - left) / 4, (high - low) / 4
    return {
        "across": np.array([[x, low], [x, high]]), "along": np.array([[left, y], [right, y]]),
        "zone": np.array([[x - w, y - h], [x + w, y - h], [x + w, y + h], [x - w, y + h]]),
    }  # fmt: skip


def true_counts(truth: Truth, places: Places) -> Array:
    """Returns the numbers of COUNTS by a loop over the frames of each person."""
    assert truth.pos is not None
    count = dict.fromkeys(COUNTS, 0)
    for person in np.unique(truth.id):
        way = truth.pos[truth.id == person]
        for name, corners in places.items():
            distance = distance_of(way, corners)
            # along the line from its first end, in shares of its length
            share = (way - corners[0]) @ (corners[1] - corners[0]) / ((corners[1] - corners[0]) ** 2).sum()
            side, begin = 0, 0
            for k, d in enumerate(distance.tolist()):
                if abs(d) <= MARGIN:
                    continue
                now = 1 if d > 0 else -1
                if side == -now:
                    middle = begin + int(np.argmin(np.abs(distance[begin : k + 1])))
                    if name == "zone" or 0 <= share[middle] <= 1:
                        words = ("enter", "leave") if name == "zone" else ("to_left", "to_right")
                        count[f"{name}_{words[now < 0]}"] += 1
                side, begin = now, k
    return np.array([count[name] for name in COUNTS], float)


def distance_of(way: Array, corners: Array) -> Array:
    """Returns signed distances (R,), m: from a line, above 0 to its left, or from the edges of a zone, above 0 inside;
    the zone is a rectangle along the axes."""
    if len(corners) == 2:
        along = (corners[1] - corners[0]) / np.hypot(*(corners[1] - corners[0]))
        return np.asarray((way - corners[0]) @ np.array([-along[1], along[0]]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    beyond = np.maximum(np.maximum(low - way, way - high), 0)
    within = np.minimum(way - low, high - way).min(axis=1)
    return np.where(inside(way, corners), within, -np.hypot(*beyond.T))


def counts_of(tables: TidyTables, names: tuple[str, ...] = COUNTS) -> Array:
    """Returns the numbers of columns of the table `counts`, (len(names),), summed over time."""
    return np.array([np.sum(tables.counts.columns[name]) for name in names], float)


def scenes(entries: int, seeds: range) -> Iterator[tuple[Array, dict[str, Array]]]:
    """Yields of each street the true numbers of COUNTS, and the numbers by what counts them."""
    every = resolve("streets")
    chosen = np.unique(np.linspace(0, len(every) - 1, entries).round().astype(int))
    for k in chosen.tolist():
        for seed in seeds:
            sequence = simulate(every[k].scenario, seed, every[k].repeat, streams=())
            assert sequence.truth is not None
            assert sequence.length is not None
            seen, run = truth_in_view(sequence, sequence.length), tracking.track("blob", sequence, detections="file")
            places = places_of(seen)
            yield (
                true_counts(sequence.truth, places),
                {
                    "exact tracks of everybody": counts_of(truth_tables(sequence.truth, places)),
                    "exact tracks in view": counts_of(truth_tables(seen, places)),
                    "exact tracks in view, each step": counts_of(truth_tables(seen, places, margin=0.0)),
                    **with_errors(seen, places, rng(seed, "label", k)),
                    "`blob`": counts_of(run.tables(places)),
                    "`blob`, each step": counts_of(run.tables(places, margin=0.0)),
                },
            )


def with_errors(truth: Truth, places: Places, random: np.random.Generator) -> dict[str, Array]:
    """Returns the numbers of COUNTS of true positions with errors, by the kind of error and what is known of it."""
    assert truth.pos is not None
    order = np.lexsort((truth.frame, truth.id))
    first = np.diff(truth.id[order], prepend=-1) != 0
    new, found = random.normal(0, ERROR, (len(order), 2)), {}
    for memory, what in ((0.9, "errors that last"), (0.0, "new errors in each frame")):
        error = new.copy()
        for k in np.flatnonzero(~first).tolist():
            error[k] = memory * error[k - 1] + sqrt(1 - memory**2) * new[k]
        pos = truth.pos.copy()
        pos[order] += error
        for cov, known in ((np.full((4, 4), np.nan), "unknown"), (ERROR**2 * np.eye(4), "known")):
            tracks = []
            for index in range(1, truth.length + 1):
                r = truth.rows(index)
                at, many = Frame(index, (index - 1) / truth.fps), np.tile(cov, (r.stop - r.start, 1, 1))
                tracks.append(Tracks.of_points(at, truth.id[r], pos[r], cov=many))
            found[f"with {what}, {known}"] = counts_of(run_tables(tracks, truth.fps, places))
    return found


def streets(entries: int, seeds: range) -> None:
    """Prints the table of streets."""
    truths, found = [], dict[str, list[Array]]()
    for true, numbers in scenes(entries, seeds):
        truths.append(true)
        for name, number in numbers.items():
            found.setdefault(name, []).append(number)
    true = np.array(truths)
    parts = {"lines": slice(0, LINE_COUNTS), "zones": slice(LINE_COUNTS, None)}
    total = {part: int(true[:, cut].sum()) for part, cut in parts.items()}
    print(f"\nstreets: {len(true)} scenes, {total['lines']} crossings of lines, {total['zones']} of edges of zones")
    head(["counted by", *(f"{part}, {kind}" for part in parts for kind in ("error", "with its sign"))])
    for name, numbers in found.items():
        cells = []
        for cut in parts.values():
            off, all_true = (np.array(numbers) - true)[:, cut], true[:, cut].sum(axis=1)
            for error in (np.abs(off).sum(axis=1), off.sum(axis=1)):
                shares = 100 * error[all_true > 0] / all_true[all_true > 0]
                cells.append(f"{100 * error.sum() / all_true.sum():.1f} %, of scenes {mean_cell(shares, '', 1)}")
        row([name, *cells])


def people_at_lines(seeds: range) -> None:
    """Prints the table of people who do one thing at a line each."""
    (entry,) = resolve(str(CASES))
    places = {name: np.array([[a, 10.0], [b, 10.0]]) for name, (a, b, *_) in LINES.items()}
    names = tuple(f"{name}_{side}" for name in LINES for side in ("to_left", "to_right"))
    total = dict[str, Array]()
    for seed in seeds:
        sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
        truth, run = sequence.truth, tracking.track("blob", sequence, detections="file")
        assert truth is not None
        for label, margin in {"": None, ", each step": 0.0}.items():
            for who, tables in {
                "exact tracks": truth_tables(truth, places, margin=margin), "`blob`": run.tables(places, margin=margin),
            }.items():  # fmt: skip
                total[who + label] = total.get(who + label, np.zeros(len(names))) + counts_of(tables, names)
    people = dict.fromkeys(LINES, 8 * len(seeds))  # `repeat` of each group
    print(f"\npeople at lines: {len(seeds)} scenes")
    head(["people", "what they do", "true", *total])
    for k, (name, (*_, left, right)) in enumerate(LINES.items()):
        cells = (f"{number[2 * k]:.0f}, {number[2 * k + 1]:.0f}" for number in total.values())
        row([str(people[name]), DOES[name], f"{left * people[name]}, {right * people[name]}", *cells])


def main() -> None:
    parser = new_parser(__doc__)
    add_seeds(parser, "20000:20001")
    parser.add_argument("--scenes", type=int, default=20, help="entries of the suite streets")
    args = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)  # of lines that nobody is near
    streets(args.scenes, args.seeds)
    people_at_lines(range(args.seeds.start, args.seeds.start + 5))


if __name__ == "__main__":
    main()
