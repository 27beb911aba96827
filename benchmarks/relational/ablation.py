"""What each departure of `relational` from the paper is worth."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any
from unittest.mock import patch

import numpy as np

import tracking
from benchmarks.relational.errors import HIDDEN, LENGTHS, errors, hidden_partner
from benchmarks.relational.groups import COLUMNS, differences, sequences, title, tracked
from benchmarks.support import tables
from sim.types import Array, Ints, Sequence
from tracking.grouping.belief import default_belief
from tracking.grouping.grouped_tracks import with_groups, without_groups
from tracking.papers.relational import sensor, tracker, transition_kernels

# Settings of the ablation beside the defaults. With relation_bias 40 partners count fully; detect_prob 1 and
# clutter_density 0 are the paper's sensor and weights. Capitals: of SWITCHES.
DEPARTURES = (
    "relation_evidence=state", "coupling_time=0", "common_noise=0", "relation_bias=40", "NO_SPREAD", "NO_FACTORS",
    "NO_OCCLUDERS", "detect_prob=1 clutter_density=0", "outlier_share=0", "hidden_time=2", "noise_scale=1",
    "clutter_density=0.02",
)  # fmt: skip
# Walks of the table of a hidden partner.
PARTNERS = 40


def _no_spread(pos: Array, vel: Array, pairs: Ints) -> Array:
    del pos, vel
    return np.zeros(pairs.shape)


# Departures without a parameter: a missed person has no factors of partners; nobody is behind other people; the
# filter's scatter is not taken off distances of partners.
SWITCHES: dict[str, Any] = {
    "NO_FACTORS": lambda: patch.object(sensor, "add_partner_factors", lambda *arguments: None),
    "NO_OCCLUDERS": lambda: patch.object(tracker, "BODY_RADIUS", 0.0),
    "NO_SPREAD": lambda: patch.object(transition_kernels, "pair_spread", _no_spread),
}


def ablation(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings, columns errors and scores on a suite, and paired differences to the defaults.

    Groups are those of the belief. A sequence has the means over the filter seeds. A second table has the errors of a
    hidden partner, as in mode hidden, in PARTNERS walks.
    """
    warnings.simplefilter("ignore")
    made = list(sequences(given, given.suite))
    names = ("error, m", "hidden people, m", *COLUMNS)
    title(given, len(made))
    tables.head(["setting", *names, *(f"Δ {name}" for name in names)])
    _compared(given, lambda changed: np.array([_mean_scores(seed, q, changed) for _, seed, q in made]))
    names = tuple(f"{length:g} s" for length in LENGTHS)
    print(f"\nerror of a hidden partner by the length of the occlusion, m; {PARTNERS} walks")
    tables.head(["setting", *names, *(f"Δ {name}" for name in names)])
    walks = range(given.seeds.start, given.seeds.start + PARTNERS)
    _compared(given, lambda changed: np.array([hidden_partner("relational", seed, changed) for seed in walks]))


def _compared(given: argparse.Namespace, measured: Callable[[argparse.Namespace], Array]) -> None:
    """Prints a row for each setting: the means of its columns, and the paired differences to the defaults."""
    defaults = None
    for setting in ("", *(given.only.split(",") if given.only else DEPARTURES)):
        own = [] if setting in SWITCHES else setting.split()
        changed = argparse.Namespace(**{**vars(given), "set": [*given.set, *own]})
        with SWITCHES.get(setting, nullcontext)():
            rows = measured(changed)
        defaults = rows if defaults is None else defaults
        means = (f"{value:.3f}" for value in np.nanmean(rows, axis=0))
        tables.row([setting or "defaults", *means, *differences(defaults, rows)])


def _mean_scores(seed: int, q: Sequence, given: argparse.Namespace) -> Array:
    return np.asarray(np.nanmean([_scored(seed, k, q, given) for k in given.filter_seeds], axis=0))


def _scored(seed: int, further: int, q: Sequence, given: argparse.Namespace) -> list[float]:
    """Returns the error, that of hidden people, m, and the COLUMNS of one run."""
    tracks = tracked("relational", seed, q, given, further=further)
    scored = tracking.evaluate(q.truth, with_groups(without_groups(tracks), q.fps, q.px_per_m, default_belief()))
    assert q.truth.visibility is not None
    away = errors(q.truth, tracks)
    hidden = away[q.truth.visibility < HIDDEN]
    return [away.mean(), hidden.mean() if len(hidden) else np.nan, *(scored.get(key, np.nan) for key in COLUMNS)]
