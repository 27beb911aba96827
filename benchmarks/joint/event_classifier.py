"""The event classifier on true partitions of simulated sequences and of recordings."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from benchmarks.joint.runs import sequences
from benchmarks.support import tables
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA, seeds_text
from sim.io.source import open_source
from sim.types import Array, Truth
from tracking.fitting.joint_events import (
    CLASSES,
    NONE,
    STRIDE,
    EventRows,
    event_rows,
    event_scores,
    log_probabilities,
)
from tracking.papers.joint.config import FITTED, JointConfig

CHORD = 0.5  # s over which velocities of boxes are measured


def classifier(given: argparse.Namespace) -> None:
    """Prints the scores of the event classifier on true partitions of unseen seeds, or of recordings."""
    if given.recordings:
        recordings(given.data)
        return
    truths = [sequence.truth for sequence in sequences(given.seeds)]
    rows = [event_rows(t, JointConfig().lag, k, wrong=False) for k, t in enumerate(truths) if t is not None]
    report(f"friends-meet, seeds {seeds_text(given.seeds)}", rows, truths[0].fps if truths[0] else 1.0)


def report(title: str, parts: Iterable[EventRows], fps: float) -> None:
    """Prints scores, weights and confusion matrix of the rows of sequences with fps frames/s; and, where there are
    none, expected events per minute."""
    parts = list(parts)
    rows = EventRows.joined(parts)
    scores = event_scores(rows, FITTED)
    tables.table(title, "score", ["value"], {k: [f"{v:.4g}"] for k, v in scores.items()})
    spread = np.append(rows.features.std(axis=0), 1.0)
    weights = JointConfig().classifier * spread
    tables.table(
        "weight of each feature times its standard deviation over the rows",
        "",
        [f"{name}, {when}" for when in ("early", "late") for name in ("distance", "velocity", "spread")] + ["constant"],
        {name: [f"{w:+.2f}" for w in row] for name, row in zip(CLASSES, weights, strict=False)},
    )
    most = log_probabilities(rows, FITTED).argmax(axis=1)
    cells = {
        name: [str(int(((rows.event == k) & (most == j)).sum())) for j in range(len(CLASSES))]
        for k, name in enumerate(CLASSES)
    }
    tables.table("confusion: rows true, columns the most probable event", "", CLASSES, cells)
    quiet = [part for part in parts if (part.event == NONE).all()]
    joined = EventRows.joined(quiet)
    if joined.seconds:
        per_row = 1 - np.exp(log_probabilities(joined, FITTED)[:, NONE])
        step, lag = (max(1, round(seconds * fps)) for seconds in (STRIDE, JointConfig().lag))
        rate = per_row.sum() * step / lag / (joined.seconds / 60)
        print(f"\nexpected events per minute in {len(quiet)} sequences without one: {rate:.3f}")


def recordings(data: Path) -> None:
    """Prints the same of each labelled recording in the folder `data`."""
    for path in (WALK_TOGETHER, HOTEL, ZARA):
        (sequence,) = open_source(data / path)
        assert sequence.truth is not None
        rows = event_rows(on_the_ground(sequence.truth), JointConfig().lag, 0, wrong=False)
        report(path, [rows], sequence.truth.fps)


def on_the_ground(truth: Truth) -> Truth:
    """Returns a truth with positions, m, and velocities, m/s: of the centres of boxes if it has boxes only."""
    if truth.pos is not None:
        return truth
    assert truth.box is not None
    pos = (truth.box[:, :2] + truth.box[:, 2:] / 2) / truth.px_per_m
    return truth.replace(pos=pos, vel=_velocities(truth, pos))


def _velocities(truth: Truth, pos: Array) -> Array:
    """Returns the velocities (R, 2), m/s, of rows at pos (R, 2), m: chords over CHORD, or to a person's first row."""
    vel, chord = np.zeros_like(pos), max(1, round(CHORD * truth.fps))
    for person in np.unique(truth.id):
        rows = np.flatnonzero(truth.id == person)
        frame = truth.frame[rows]
        before = np.searchsorted(frame, frame - chord)
        before = np.where(before == np.arange(len(rows)), np.minimum(before + 1, len(rows) - 1), before)
        time = np.maximum(np.abs(frame - frame[before]), 1) / truth.fps
        vel[rows] = (pos[rows] - pos[rows[before]]) * np.sign(frame - frame[before])[:, None] / time[:, None]
    return vel
