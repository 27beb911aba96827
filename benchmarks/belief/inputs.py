"""Mode `inputs` of `benchmarks.belief`: groups and events by what the belief is given of simulated people.

Parts:
truth     exact positions, ids known
points    what the scenario's own sensor reports, tracked by `blob`
boxes     boxes of six cameras with the errors of real detectors (`benchmarks.belief.cameras`), ids known; sequences
          take the cameras in turn. Scored at the true places: what is measured is the grouping
blob      the same boxes, tracked by `blob`
pixels    pictures, tracked by `blob`
trackers  what the scenario's own sensor reports, by tracker; groups are the tracker's own where it names them

Columns: pairwise F1, group F1 and event F1, means over sequences with 95 % intervals; at most: pairwise F1 of the true
groups of the people who are detected, where that is known; merges that are right, wrong and missed in all; median life
of groups, s (`benchmarks.belief.lives`), then the share of stretches below 1 s, each with the truth's, which are those
of the people who are detected where that is known.
--before: the same of another belief, and the paired difference; or the paired difference from the scores that --json
has stored, as of other code.
"""

from __future__ import annotations

import json
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.belief.cameras import VIEWS, at_most, at_true_places, known_boxes, seen_by, truly_grouped
from benchmarks.belief.lives import lives_of_tracks, lives_of_truth
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import difference_cell, mean_cell, number, table
from scenarios.errors import InputError
from scenarios.loading.resolve import Entry, resolve
from sim.sequence import LabelledSequence, simulate
from sim.types import Array, DetectionMode, Tracks, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.foot_points import completed
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.known_people import people_as_tracks
from tracking.running.prepare import prepare
from tracking.scoring.evaluation import evaluate

KEYS = ("pairwise_F1", "group_F1_hull", "event_F1", "merge_TP", "merge_FP", "merge_FN")
SCORES = KEYS[:3]
COLUMNS = (
    "pairwise F1", "at most", "group F1", "event F1", "merges right, wrong, missed", "life, s", "of the truth",
    "below 1 s", "of the truth",
)  # fmt: skip
NAMING = ("group-pda", "relational", "particle", "joint")
BRIEF = 1.0  # s
Grouped = Callable[[Belief], Sequence[Tracks]]
Stored = dict[str, dict[str, dict[str, list[float]]]]  # `KEYS` by part, row and sequence


@dataclass(frozen=True)
class Input:
    """One sequence as the belief is given it."""

    rows: tuple[str, ...]  # of the table in which it counts
    truth: Truth
    grouped: Grouped  # returns its tracks with the groups of a belief
    apart: bool = True  # another belief may find other groups
    most: float = float("nan")  # pairwise F1 of the true groups of the people who are detected, if that is known
    seen: Sequence[Tracks] | None = None  # the true groups of these people, if that is known


def _tracked(tracker: str, sequence: LabelledSequence, mode: DetectionMode, seed: int) -> Grouped:
    ready = prepare(tracker, sequence, detections=mode, seed=seed)
    ready.reset(seed)
    reported = [ready.step(frame) for frame in ready.frames()]
    scale, known = ready.scale(reported), ready.context
    return lambda belief: completed(
        reported, sequence.fps, scale.px_per_m, belief, camera=known.camera, scene=known.scene,
        image_size=known.image_size,
    )[0]  # fmt: skip


def of_truth(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
    people = people_as_tracks(truth)
    yield Input((suite,), truth, lambda belief: derive(people, truth.fps, truth.px_per_m, belief))


def of_points(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
    yield Input((suite,), sequence.truth, _tracked("blob", sequence, "file", seed))


def of_boxes(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    view = VIEWS[number % len(VIEWS)]
    sequence = seen_by(view, entry, seed, data)
    boxes, truth = known_boxes(sequence), sequence.truth

    def grouped(belief: Belief) -> list[Tracks]:
        found, _ = completed(
            boxes, sequence.fps, sequence.px_per_m, belief, camera=sequence.camera, scene=sequence.scene,
            image_size=sequence.image_size,
        )  # fmt: skip
        return at_true_places(truth, found)

    yield Input((suite, view.name), truth, grouped, most=at_most(truth, boxes), seen=truly_grouped(truth, boxes))


def of_blob(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    view = VIEWS[number % len(VIEWS)]
    sequence = seen_by(view, entry, seed, data)
    yield Input((suite, view.name), sequence.truth, _tracked("blob", sequence, "file", seed))


def of_pixels(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=("left", "background"))
    yield Input((suite,), sequence.truth, _tracked("blob", sequence, "image", seed))


def of_trackers(entry: Entry, seed: int, suite: str, number: int, data: Path) -> Iterator[Input]:
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
    for name in ("blob", *NAMING):
        yield Input((name,), sequence.truth, _tracked(name, sequence, "file", seed), name not in NAMING)


@dataclass(frozen=True)
class Part:
    """A part of the benchmark: how it makes inputs, its default seeds and its suites."""

    made: Callable[[Entry, int, str, int, Path], Iterator[Input]]
    seeds: str
    suites: tuple[str, ...] = ("standard", "streets", "friends-meet")


PARTS: Mapping[str, Part] = {
    "truth": Part(of_truth, "20000:20002"), "points": Part(of_points, "20000:20001"),
    "boxes": Part(of_boxes, "20000:20002"), "blob": Part(of_blob, "20000:20001"),
    "pixels": Part(of_pixels, "20000:20001", ("quick",)), "trackers": Part(of_trackers, "20000:20002", ("quick",)),
}  # fmt: skip


@dataclass
class Found:
    """What a row of a table is made of."""

    scores: dict[str, list[float]] = field(default_factory=dict)  # by sequence: `KEYS`
    lives: list[Array] = field(default_factory=list)  # of the reported groups of each sequence, s
    true: list[Array] = field(default_factory=list)  # of the true groups, s
    most: list[float] = field(default_factory=list)

    def add(self, sequence: str, given: Input, tracks: Sequence[Tracks]) -> None:
        """Adds a sequence."""
        truth = given.truth
        found = evaluate(truth, tracks)
        self.most.append(given.most)
        self.scores[sequence] = [float(found[key]) for key in KEYS]
        self.lives.append(lives_of_tracks(tracks, truth.fps))
        seen = given.seen
        self.true.append(lives_of_truth(truth) if seen is None else lives_of_tracks(seen, truth.fps))

    def cells(self) -> list[str]:
        """Returns the cells of `COLUMNS`."""
        values = np.array([*self.scores.values()])
        merges = ", ".join(f"{n:.0f}" for n in np.nansum(values[:, len(SCORES) :], axis=0))
        lives = [np.concatenate(part) for part in (self.lives, self.true)]
        spans = [number(float(np.median(x)), 1) if len(x) else "–" for x in lives]
        brief = [f"{(x < BRIEF).mean():.1%}" if len(x) else "–" for x in lives]
        means = [mean_cell(column) for column in values[:, : len(SCORES)].T]
        known = [x for x in self.most if np.isfinite(x)]
        most = number(float(np.mean(known))) if known else "–"
        return [means[0], most, *means[1:], merges, *spans, *brief]


def differences(own: Mapping[str, Sequence[float]], other: Mapping[str, Sequence[float]]) -> list[str]:
    """Returns the cells of the paired differences over the sequences that both have, as of `COLUMNS`. Of merges they
    are means by sequence."""
    shared = [name for name in own if name in other]
    change = np.array([np.subtract(own[name], other[name]) for name in shared]).reshape(-1, len(KEYS))
    scores = [difference_cell(column) for column in change[:, : len(SCORES)].T]
    merges = [f"{np.nanmean(x):+.2f}" if np.isfinite(x).any() else "–" for x in change[:, len(SCORES) :].T]
    return [scores[0], "", *scores[1:], ", ".join(merges), "", "", "", ""]


def inputs(
    seeds: Mapping[str, range], suites: Sequence[str] | None, data: Path, belief: Belief,
    before: Belief | Stored | None = None, store: Path | None = None,
) -> None:  # fmt: skip
    """Prints a table for each part of `seeds`. store: file that the scores of each sequence are written to."""
    second, stored = (before, {}) if isinstance(before, Belief) else (None, before or {})
    kept: Stored = {}
    for name in seeds:
        rows = _measured(PARTS[name], seeds[name], suites, data, {"belief": belief, "before": second})
        cells = {}
        for row, found in rows["belief"].items():
            cells[row] = found.cells()
            if row in rows["before"]:
                cells[f"{row}, before"] = rows["before"][row].cells()
                cells[f"{row}, minus before"] = differences(found.scores, rows["before"][row].scores)
            elif row in stored.get(name, {}):
                cells[f"{row}, minus before"] = differences(found.scores, stored[name][row])
        table(f"{name}: seeds {seeds_text(seeds[name])}", "", COLUMNS, cells)
        kept[name] = {row: found.scores for row, found in rows["belief"].items()}
        if store is not None:
            store.write_text(json.dumps(kept, indent=1), encoding="utf-8")


def _measured(
    part: Part, seeds: range, suites: Sequence[str] | None, data: Path, beliefs: Mapping[str, Belief | None]
) -> dict[str, dict[str, Found]]:
    rows: dict[str, dict[str, Found]] = {name: defaultdict(Found) for name in beliefs}
    number = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        for suite in suites or part.suites:
            for entry in resolve(suite):
                for seed in seeds:
                    for given in part.made(entry, seed, Path(suite).stem, number, data):
                        for name, belief in beliefs.items():
                            if belief is not None and (name == "belief" or given.apart):
                                tracks = given.grouped(belief)
                                for row in given.rows:
                                    rows[name][row].add(f"{entry.name}, seed {seed}", given, tracks)
                    number += 1
    return rows


def stored_scores(path: str) -> Stored:
    """Returns the scores by part, row and sequence that --json stored. Raises InputError for another file."""
    expected, remedy = "scores by part, row and sequence", "write the file with --json"
    try:
        found: Stored = json.loads(Path(path).read_text(encoding="utf-8"))
        lengths = {len(scores) for part in found.values() for row in part.values() for scores in row.values()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise InputError(file=path, got=str(error), expected=expected, remedy=remedy) from error
    if lengths != {len(KEYS)}:
        raise InputError(file=path, got=f"{sorted(lengths)} scores", expected=f"{len(KEYS)} each", remedy=remedy)
    return found
