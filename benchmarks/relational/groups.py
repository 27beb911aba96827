"""Groups and events of `relational`, and its probabilities of pairs."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

import tracking
from benchmarks.relational.errors import config_of
from benchmarks.support import chart, tables
from benchmarks.support.options import HOTEL, ZARA
from scenarios.loading.resolve import resolve
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Array, Sequence, Tracks, Truth
from tracking.filters.assignment import optimal
from tracking.grouping.belief import default_belief
from tracking.grouping.grouped_tracks import with_groups, without_groups
from tracking.grouping.link_rule import LinkRule
from tracking.grouping.pair_probabilities import pair_probabilities
from tracking.papers.relational.relations import Relational
from tracking.prepare import prepare
from tracking.stats import paired

COLUMNS = ("HOTA", "IDF1", "group_F1_hull", "pairwise_F1")
OFFSET = 1_000_000
"""The seed of a filter is that of the scene, and so much more for each further filter seed."""
NEAR = 1.0
"""m: a track farther than this from a person is not this person's."""
BINS = 5


RECORDINGS = {"seq_hotel": HOTEL, "zara01": ZARA}
EXACT: dict[str, Any] = {"noise_m": 0.0, "detect_prob": 1.0, "clutter_rate": 0.0}
ROUGH = EXACT | {"noise_m": 0.1, "detect_prob": 0.95}
"""Detections of labelled people in mode reliability --recordings: without errors, and with; no false alarms."""


def sequences(given: argparse.Namespace, suite: str) -> Iterator[tuple[str, int, Sequence]]:
    """Yields the name, the seed and the sequence of each entry asked for."""
    for entry in (e for e in resolve(f"suite:{suite}") if not given.entry or e.name in given.entry.split(",")):
        for seed in given.seeds:
            yield entry.name, seed, simulate(entry.scenario, seed, 0, ())


def tracked(
    name: str, seed: int, sequence: Sequence, given: argparse.Namespace, mode: str = "file", sensor: Any = None,
    further: int = 0,
) -> list[Tracks]:  # fmt: skip
    """Returns the tracks of a tracker; mode, sensor: as of `tracking.prepare`; further: number of the filter seed."""
    config = None if name == "blob" else config_of(name, given.counts[0], given)
    ready = prepare(name, sequence, params=config, detections=mode, sensor=sensor, seed=seed)
    ready.reset(seed + further * OFFSET)
    return [ready.step(frame) for frame in ready.frames()]


def scores(given: argparse.Namespace) -> None:
    """Prints a table: rows are trackers and groupings, columns mean scores, and merges and splits of all sequences.

    A sequence has the means over the filter seeds, and events are summed over them. A second table has the paired
    differences of both filters.
    """
    warnings.simplefilter("ignore")
    values: dict[str, list[list[dict[str, float]]]] = {}
    for _, seed, q in sequences(given, given.suite):
        runs = [_grouped(seed, k, q, given) for k in given.filter_seeds]
        for label in runs[0]:
            values.setdefault(label, []).append([run[label] for run in runs])
    means = {
        label: np.array([np.nanmean([[s.get(key, np.nan) for key in COLUMNS] for s in runs], axis=0) for runs in rows])
        for label, rows in values.items()
    }
    title(given, len(next(iter(values.values()))))
    tables.head(["tracks, groups", *COLUMNS, "merge F1", "split F1"])
    for label, rows in values.items():
        scored = [s for runs in rows for s in runs]
        cells = (f"{value:.3f}" for value in np.nanmean(means[label], axis=0))
        tables.row([label, *cells, *(_pooled(scored, kind) for kind in ("merge", "split"))])
    print()
    tables.head(["relational − particle, belief", *COLUMNS])
    tables.row(["paired", *differences(means["particle, belief"], means["relational, belief"])])


def _grouped(seed: int, further: int, q: Sequence, given: argparse.Namespace) -> dict[str, dict[str, float]]:
    """Returns the scores of each tracker and grouping."""
    found = {name: tracked(name, seed, q, given, further=further) for name in ("blob", "particle", "relational")}
    bare = {name: without_groups(t) for name, t in found.items()}
    rows = {f"{name}, rule": with_groups(t, q.fps, q.px_per_m, LinkRule()) for name, t in bare.items()}
    rows |= {f"{name}, belief": with_groups(t, q.fps, q.px_per_m, default_belief()) for name, t in bare.items()}
    return {label: tracking.evaluate(q.truth, tracks) for label, tracks in rows.items()}


def _pooled(scored: list[dict[str, float]], kind: str) -> str:
    """Returns the F1 of a kind of events, pooled over sequences, with hits, false alarms and misses."""
    hit, false, missed = (
        int(np.nansum([s.get(f"{kind}_{key}", np.nan) for s in scored])) for key in ("TP", "FP", "FN")
    )
    return f"{2 * hit / max(2 * hit + false + missed, 1):.3f} ({hit}, {false}, {missed})"


def reliability(given: argparse.Namespace) -> None:
    """Prints a table: rows are probabilities of pairs, columns how often these belong together, and F1 at 1/2.

    The chart has the latter against the mean probability, in each column.
    """
    panels = []
    if not given.recordings:
        runs = [(seed, q, dict[str, Any]()) for _, seed, q in sequences(given, given.suite)]
        panels.append(_panel(f"suite {given.suite}", _reliability(runs, given)))
    for name, path in RECORDINGS.items() if given.recordings else ():
        (q,) = open_source(given.recordings / path)
        for label, sensor in (("exact", EXACT), ("errors of 0.1 m, 5 % missed", ROUGH)):
            print(f"\n{name}, {label}\n")
            found = _reliability([(seed, q, sensor) for seed in given.seeds], given)
            panels.append(_panel(f"{name}, {label}", found))
    if given.chart:
        chart.lines(panels, given.chart)


def _panel(title: str, found: dict[str, Array]) -> chart.Panel:
    """Returns a chart of the share of pairs that belong together against the range of their probability; found: by row
    of the table, (N, 2), of probability and truth. "as said" is the mean probability, of the first row."""
    middle = (np.arange(BINS) + 0.5) / BINS
    shares = {label: _by_range(values) for label, values in found.items()}
    said = next(iter(shares.values()))[:, 1]
    curves = {"as said": np.where(np.isfinite(said), said, middle)} | {k: x[:, 2] for k, x in shares.items()}
    return chart.Panel(title, middle.tolist(), curves, "probability", "share that belong together", (0.0, 1.0))


def _by_range(values: Array) -> Array:
    """Returns for each range of probabilities the number of pairs, their mean probability and the share that belongs
    together, (BINS, 3), nan without pairs; values (N, 2): probability and truth."""
    k = np.minimum((values[:, 0] * BINS).astype(int), BINS - 1)
    parts = [values[k == b] for b in range(BINS)]
    return np.array([[len(part), *(part.mean(axis=0) if len(part) else (np.nan, np.nan))] for part in parts])


def _pairs(true: dict[int, int]) -> list[tuple[int, int, float]]:
    """Returns the pairs of tracks, a < b, and whether they belong together; true: group by track, as `_people_of`."""
    return [(a, b, float(true[a] == true[b])) for a in true for b in true if a < b]


def _reliability(runs: list[tuple[int, Sequence, dict[str, Any]]], given: argparse.Namespace) -> dict[str, Array]:
    """Prints the table of some sequences with their seeds and settings of the sensor, none for stored detections.

    Returns the probability of each pair and whether the two belong together, (N, 2), by row of the table.
    """
    boxes = runs[0][1].camera is not None
    trackers = ("relational", "particle", *(["blob"] if boxes else []))  # blob takes boxes
    rows: dict[str, list[Array]] = {"relational": [], **{f"belief on {name}": [] for name in trackers}}
    for seed, q, sensor in runs:
        mode = "truth" if sensor else "file"
        found = {}
        config = config_of("relational", given.counts[0], given)
        ready = prepare("relational", q, params=config, detections=mode, sensor=sensor, seed=seed)
        ready.reset(seed)
        found["relational"] = []
        tracker = ready.tracker
        assert isinstance(tracker, Relational)
        for frame in ready.frames():
            tracks = ready.step(frame)
            found["relational"].append(tracks)
            ids, together = tracker.walking_together()
            place = {int(i): k for k, i in enumerate(ids)}
            pairs = _pairs(_people_of(q.truth, tracks))
            known = [(together[place[a], place[b]], same) for a, b, same in pairs]
            rows["relational"].append(np.array(known).reshape(-1, 2))
        for name in trackers[1:]:
            found[name] = tracked(name, seed, q, given, mode, sensor)
        for name, bare in found.items():
            rows[f"belief on {name}"].append(_believed(q, bare))
    tables.head(["pairs", *(f"{k / BINS:g} to {(k + 1) / BINS:g}" for k in range(BINS)), "F1 at 1/2", "mean gap"])
    found_pairs = {label: np.concatenate(parts) for label, parts in rows.items()}
    for label, values in found_pairs.items():
        (p, same), (number, mean, share) = values.T, _by_range(values).T
        cells = [f"{share[b]:.2f} ({int(number[b])})" if number[b] else "" for b in range(BINS)]
        gap = np.nansum(abs(share - mean) * number) / len(values)
        hit, said = (same[p > 0.5]).sum(), (p > 0.5).sum()
        tables.row([label, *cells, f"{2 * hit / max(said + same.sum(), 1):.3f}", f"{gap:.3f}"])
    return found_pairs


def _believed(q: Sequence, tracks: list[Tracks]) -> Array:
    """Returns the probability of each pair by the belief, 0 for pairs 4 m and more apart, and whether the two belong
    together, (N, 2)."""
    found = pair_probabilities(tracks, q.fps, q.px_per_m, default_belief())
    joined = zip(found.frame.tolist(), found.a.tolist(), found.b.tolist(), strict=True)
    said = dict(zip(joined, found.probability.tolist(), strict=True))
    known = []
    for t in tracks:
        known += [(said.get((t.index, a, b), 0.0), same) for a, b, same in _pairs(_people_of(q.truth, t))]
    return np.array(known).reshape(-1, 2)


def _people_of(truth: Truth, tracks: Tracks) -> dict[int, int]:
    """Returns the true group, -1 - person for a person alone, of each track that is a person's, by id of the track."""
    assert truth.pos is not None
    rows = truth.rows(tracks.index)
    away = np.hypot(*(truth.pos[rows][:, None] - tracks.pos[None, :, :2]).transpose(2, 0, 1))
    group, person = truth.group[rows], truth.id[rows]
    unit = np.where(group >= 0, group, -1 - person)
    return {int(tracks.id[j]): int(unit[i]) for i, j in zip(*optimal(away, NEAR), strict=True)}


def title(given: argparse.Namespace, count: int) -> None:
    """Prints what a table of scores is of; count: of its sequences."""
    print(f"\nsuite {given.suite}, {count} sequences, {given.counts[0]} particles, "
          f"filter seeds {given.filter_seeds.start}:{given.filter_seeds.stop}\n")  # fmt: skip


def differences(before: Array, after: Array) -> list[str]:
    """Returns the paired differences of each column over the sequences (N, C) in which both values are known."""
    known = np.isfinite(before) & np.isfinite(after)
    pairs = [paired(a[k], b[k]) for a, b, k in zip(before.T, after.T, known.T, strict=True)]
    return [tables.signed(*map(float, p)) for p in pairs]
