"""What each departure of `relational` from the paper is worth."""

from __future__ import annotations

import argparse
import warnings
from contextlib import nullcontext
from typing import Any
from unittest.mock import patch

import numpy as np

import tracking
from benchmarks.relational.errors import HIDDEN, errors
from benchmarks.relational.groups import COLUMNS, differences, sequences, title, tracked
from benchmarks.support import tables
from sim.types import Array, Bools, Ints, Sequence
from tracking.grouping.belief import default_belief
from tracking.grouping.grouped_tracks import with_groups, without_groups
from tracking.papers.relational import sensor_kernels, transition_kernels

DEPARTURES = (
    "relation_evidence=state", "coupling_time=0 common_noise=0", "coupling_time=0", "common_noise=0",
    "relation_bias=40", "detect_prob=1 clutter_density=0", "NO_FACTORS",
    "PAIR_BY_PAIR", "outlier_share=0",
    "hidden_time=2", "noise_scale=1",
    "clutter_density=0.02",
)  # fmt: skip
"""Settings of the ablation beside the defaults. With relation_bias 40 partners count fully; detect_prob 1 and
clutter_density 0 are the paper's sensor and weights. Capitals: of SWITCHES."""


def _pair_by_pair(
    pos: Array, vel: Array, pairs: Ints, related: Bools, odds: Array, uniforms: Array, rules: Array
) -> None:  # fmt: skip
    """Draws the relations of each pair by themselves, with the hazards of `transition_kernels.relate`."""
    rng = np.random.default_rng(int(uniforms.sum()))
    change = (rng.random(related.shape) < rules[transition_kernels.RATE]) & np.isfinite(odds)[:, None]
    related[:] = np.where(change, rng.random(related.shape) < 1 / (1 + np.exp(-odds))[:, None], related)


SWITCHES: dict[str, Any] = {
    "NO_FACTORS": lambda: patch.object(sensor_kernels, "partner_factors", lambda *arguments: None),
    "PAIR_BY_PAIR": lambda: patch.object(transition_kernels, "relate", _pair_by_pair),
}
"""Departures without a parameter: a missed person has no factors of partners; a person does not reconsider all
relations at once."""


def ablation(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings, columns errors and scores on a suite, and paired differences to the defaults.

    Groups are those of the belief. A sequence has the means over the filter seeds.
    """
    warnings.simplefilter("ignore")
    made = list(sequences(given, given.suite))
    names = ("error, m", "hidden people, m", *COLUMNS)
    title(given, len(made))
    tables.head(["setting", *names, *(f"Δ {name}" for name in names)])
    defaults = None
    for setting in ("", *(given.only.split(",") if given.only else DEPARTURES)):
        own = [] if setting in SWITCHES else setting.split()
        changed = argparse.Namespace(**{**vars(given), "set": [*given.set, *own]})
        with SWITCHES.get(setting, nullcontext)():
            runs = [[_scored(seed, k, q, changed) for k in given.filter_seeds] for _, seed, q in made]
        rows = np.nanmean(np.array(runs), axis=1)
        defaults = rows if defaults is None else defaults
        means = (f"{value:.3f}" for value in np.nanmean(rows, axis=0))
        tables.row([setting or "defaults", *means, *differences(defaults, rows)])


def _scored(seed: int, further: int, q: Sequence, given: argparse.Namespace) -> list[float]:
    """Returns the error, that of hidden people, m, and the COLUMNS of one run."""
    tracks = tracked("relational", seed, q, given, further=further)
    scored = tracking.evaluate(q.truth, with_groups(without_groups(tracks), q.fps, q.px_per_m, default_belief()))
    assert q.truth.visibility is not None
    away = errors(q.truth, tracks)
    hidden = away[q.truth.visibility < HIDDEN]
    return [away.mean(), hidden.mean() if len(hidden) else np.nan, *(scored.get(key, np.nan) for key in COLUMNS)]
