"""Pairs of people of one frame: who is in one group, by labels, by a grouping, and by SPENCER's relations.

SPENCER (Linder et al. 2016) relates pairs of each frame by a linear model and takes connected components.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sim.types import Array, Bools, Ints, Truth
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.known_people import people_as_tracks
from tracking.recordings.source import open_source


def pairs_in_frames(truth: Truth) -> tuple[Ints, Ints, Bools]:
    """Returns the rows i, j of all pairs of people of one frame, and whether they are labelled as one group."""
    found = []
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        i, j = np.triu_indices(r.stop - r.start, 1)
        found.append((i + r.start, j + r.start))
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    return i, j, (truth.group[i] >= 0) & (truth.group[i] == truth.group[j])


def linked_pairs(truth: Truth, rule: Grouping, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows the rule puts into one group."""
    derived = derive(people_as_tracks(truth), truth.fps, truth.px_per_m, rule, objective=True)
    group = np.concatenate([t.group for t in derived])
    return (group[i] >= 0) & (group[i] == group[j])


def f1(weight: Array, frame: Ints, true: Bools, found: Bools) -> Array:
    """Returns the pairwise F1 of each row of weights (D, frames), (D,); rows of pairs: frame (from 0), true, found."""
    count = [np.bincount(frame[rows], minlength=weight.shape[1]) for rows in (true & found, true, found)]
    hits, positives, reported = (weight @ c for c in count)
    return np.asarray(2 * hits / np.maximum(positives + reported, 1e-9))


def spencer(truth: Truth, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows SPENCER's default relations put into one group: its linear model, as written out in
    the software (spencer_people_tracking), from labelled positions and velocities."""
    assert truth.pos is not None
    assert truth.vel is not None
    distance = np.hypot(*(truth.pos[i] - truth.pos[j]).T)
    speed = np.hypot(*truth.vel.T)
    heading = np.where(speed < 0.1, 0.0, np.arctan2(truth.vel[:, 1], truth.vel[:, 0]))
    turn = np.abs((heading[i] - heading[j] + np.pi) % (2 * np.pi) - np.pi)
    differ = np.abs(speed[i] - speed[j])
    strength = 1.553 * (3.038 - 1.875 * distance - 0.560 * differ - 0.913 * turn) + 0.0124
    linked = (strength > 0) & (distance <= 3.0) & (differ <= 1.0) & (turn <= np.pi / 4)
    rows = len(truth.frame)
    part = connected_components(coo_array((np.ones(linked.sum()), (i[linked], j[linked])), (rows, rows)))[1]
    return np.asarray(part[i] == part[j])


def pairwise_f1(truth: Truth, grouping: Grouping) -> float:
    """Returns the pairwise F1 of a grouping of labelled people."""
    i, j, same = pairs_in_frames(truth)
    return float(f1(np.ones((1, truth.length)), truth.frame[i] - 1, same, linked_pairs(truth, grouping, i, j))[0])


def labelled(path: Path) -> Truth:
    """Returns the truth of a recording."""
    truth = open_source(path, images=False)[0].truth
    assert truth is not None
    return truth
