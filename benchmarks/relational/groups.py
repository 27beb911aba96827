"""Groups and events of `relational`, and its probabilities of pairs."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

import tracking
from benchmarks.relational.errors import config_of
from benchmarks.support import tables
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Sequence, Tracks
from tracking.grouping.belief import default_belief
from tracking.grouping.grouped_tracks import with_groups, without_groups
from tracking.grouping.link_rule import LinkRule
from tracking.running.prepare import prepare

COLUMNS = ("HOTA", "IDF1", "group_F1_hull", "pairwise_F1")
# The seed of a filter is that of the scene, and so much more for each further filter seed.
OFFSET = 1_000_000


def sequences(given: argparse.Namespace, suite: str) -> Iterator[tuple[str, int, Sequence]]:
    """Yields the name, the seed and the sequence of each entry asked for."""
    for entry in (e for e in resolve(f"suite:{suite}") if not given.entry or e.name in given.entry.split(",")):
        for seed in given.seeds:
            yield entry.name, seed, simulate(entry.scenario, seed, 0, ())


def tracked(
    name: str, seed: int, sequence: Sequence, given: argparse.Namespace, mode: str = "file", sensor: Any = None,
    further: int = 0,
) -> list[Tracks]:  # fmt: skip
    """Returns the tracks of a tracker; mode, sensor: as of `prepare`; further: number of the filter seed."""
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


def title(given: argparse.Namespace, count: int) -> None:
    """Prints what a table of scores is of; count: of its sequences."""
    print(f"\nsuite {given.suite}, {count} sequences, {given.counts[0]} particles, "
          f"filter seeds {given.filter_seeds.start}:{given.filter_seeds.stop}")  # fmt: skip


def differences(before: Array, after: Array) -> list[str]:
    """Returns the paired differences of each column over the sequences (N, C) in which both values are known."""
    return [tables.difference_cell(column) for column in (after - before).T]
