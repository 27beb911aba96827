"""The speed table of the preset `paper`, learned as the paper learns it: from observations in successive frames.

python -m benchmarks.relational observed --seeds 30000:30004
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Truth
from sim.types import Sequence as Recording
from tracking.filters.assignment import optimal
from tracking.fitting.relational import speed_table, velocity_changes

FURTHEST = 2.0  # Largest distance of a detection from its person, m.
# Settings of a sensor as the paper's observations are: every visible person, nobody else, and displaced feet.
LABELS = ("sensor.detect_prob=1", "sensor.occlusion_power=0", "sensor.clutter_rate=0")
PAPER_ENDS = (0.0125, 2.5, 5.0, 7.5)  # Column A of the paper's Table 3, m/s.


def table(given: argparse.Namespace) -> None:
    """Prints the parameters that are fitted to the suite occlusion."""
    entries = resolve("suite:occlusion", LABELS)
    scenes = (simulate(entry.scenario, seed, entry.repeat, ()) for entry in entries for seed in given.seeds)
    for name, value in fit_observed(scenes, PAPER_ENDS).items():
        print(name, np.round(value, 3))


def fit_observed(sequences: Iterable[Recording], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns fitted parameters by name: drift, diffusion, and point_noise, the standard deviation of detected
    positions, m. ends: upper ends of the rows of the speed table, m/s."""
    changes, errors = [], []
    for sequence in sequences:
        truth, error = observed(sequence)
        changes.append(velocity_changes(truth, 1))
        errors.append(error)
    noise = float(np.sqrt(np.mean(np.square(np.concatenate(errors)))))
    return speed_table(changes, ends) | {"point_noise": noise}


def observed(sequence: Recording) -> tuple[Truth, Array]:
    """Returns the truth with detected positions in place of the true ones, and the errors (N, 2) of all detected
    positions, m. Velocities are differences from the frame before; rows without a velocity are left out."""
    truth = sequence.truth
    assert truth is not None
    assert truth.pos is not None
    pos, true = np.full((len(truth.id), 2), np.nan), truth.pos[:, :2]
    for frame in sequence:
        rows = truth.rows(frame.index)
        assert frame.detections is not None
        points = frame.detections.pos[:, :2]
        people, found = optimal(np.hypot(*(true[rows][:, None] - points).transpose(2, 0, 1)), FURTHEST)
        pos[np.arange(rows.start, rows.stop)[people]] = points[found]
    order = np.lexsort((truth.frame, truth.id))
    before, after = order[:-1], order[1:]
    vel = np.full(pos.shape, np.nan)
    vel[after] = (pos[after] - pos[before]) * truth.fps
    apart = (truth.id[after] != truth.id[before]) | (truth.frame[after] - truth.frame[before] != 1)
    vel[after[apart]] = np.nan
    kept, errors = np.isfinite(vel[:, 0]), pos - true
    frame, id, group = truth.frame[kept], truth.id[kept], truth.group[kept]
    seen = truth.replace(
        frame=frame, id=id, group=group, pos=pos[kept], vel=vel[kept], box=None, visibility=truth.visibility[kept]
    )
    return seen, errors[np.isfinite(errors[:, 0])]
