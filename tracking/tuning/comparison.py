"""Finished trials, the candidates among them, and paired comparisons of their scores with those of the defaults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.printable import counted
from tracking.config import Config
from tracking.environment.episodes import Episode
from tracking.stats import paired
from tracking.tuning.goals import Goal


@dataclass(frozen=True)
class TrialRecord:
    """A finished trial of a search (one set of parameters, played on the training scenes), for plots and tables.

    - number: its place in the search, 0 for the defaults.
    - values: one per goal, from training; an estimate if the trial was pruned, empty if its parameters are impossible.
    - params: value of each searched parameter by name.
    - episodes: number of training episodes played, 0 if the parameters are impossible.
    - pruned: True if it was stopped before its last training scene.
    - error: why its parameters are impossible, "" if they are possible.
    """

    number: int
    values: tuple[float, ...]
    params: dict[str, Any]
    episodes: int
    pruned: bool = False
    error: str = ""


@dataclass(frozen=True)
class Comparison:
    """One score of the defaults and of a tuned config on the same sequences, in the unit of the score.

    - scenes: name of the suite, or "validation".
    - key: the name of the score; higher: True if greater values are better.
    - before, after: means of the defaults and of the config over the sequences where both have the score. That of
      "frames/s" is the mean of the speeds of the sequences, not all frames / all seconds.
    - difference: mean of after - before; low, high: its 95 % interval, nan with fewer than two sequences.
    - sequences: number of these sequences.
    """

    scenes: str
    key: str
    higher: bool
    before: float
    after: float
    difference: float
    low: float
    high: float
    sequences: int

    @property
    def verdict(self) -> str:
        """Returns "better" or "worse" if the interval of the difference excludes 0, else (or with nan) "no sure
        difference". An end that is exactly 0 does not exclude it.
        """
        if not (self.low > 0 or self.high < 0):
            return "no sure difference"
        return "better" if (self.difference > 0) == self.higher else "worse"

    @property
    def difference_words(self) -> str:
        """The difference with its interval; without it if an end is unknown (nan)."""
        known = math.isfinite(self.low) and math.isfinite(self.high)
        return f"{self.difference:+.4f}" + (f" [{self.low:+.4f}, {self.high:+.4f}]" if known else " (no interval)")

    def line(self) -> str:
        """Returns one line of text."""
        change = f"{self.before:.4f} → {self.after:.4f}, {self.difference_words}"
        return f"{self.scenes}: {self.key} {change}, {counted(self.sequences, 'sequence')}: {self.verdict}"


@dataclass(frozen=True)
class Candidate:
    """A config that was good in training, or the defaults.

    - trial: number of its trial in the search, 0 for the defaults.
    - config: all parameters.
    - training, validation: its values, one per goal, on the training and validation scenes; () if not played.
    - gain: its first goal compared with that of the defaults on the validation scenes, None if not played or unknown;
      for the defaults themselves the comparison with themselves, of difference 0.
    """

    trial: int
    config: Config
    training: tuple[float, ...]
    validation: tuple[float, ...] = ()
    gain: Comparison | None = None


def compare_episodes(scenes: str, goal: Goal, before: Sequence[Episode], after: Sequence[Episode]) -> Comparison | None:
    """Returns the comparison of a goal between `before` and `after`, paired by sequence, with a 95 %
    interval of the mean difference.

    scenes: name for the result. before, after: episodes of the same sequences in the same order, equally many
    (not checked). Sequences where either side lacks the score, or has an infinite one, are left out; None if that
    leaves no sequence. The difference is after - before. With one sequence the interval is nan.
    """
    a, b = (np.array([goal.of(e) for e in episodes]) for episodes in (before, after))
    known = np.isfinite(a) & np.isfinite(b)
    if not known.any():
        return None
    a, b = a[known][:, None], b[known][:, None]
    difference, low, high = (float(end[0]) for end in paired(a, b))
    return Comparison(
        scenes, goal.key, goal.higher, float(a.mean()), float(b.mean()), difference, low, high, int(known.sum())
    )


def pareto_front(candidates: Sequence[Candidate], goals: Sequence[Goal]) -> list[Candidate]:
    """Returns the candidates that no other candidate dominates on the validation scenes, sorted by the first goal, best
    first.

    A candidate dominates another if it is no worse in any goal and better in one. Of candidates with equal values the
    first stays. A candidate with a nan is left out, as nothing is known of its rank. Every candidate needs one
    validation value per goal, else ValueError is raised. No candidates give [].
    """
    known = [c for c in candidates if not np.isnan(c.validation).any()]

    def dominates(one: Candidate, other: Candidate) -> bool:
        gains = [g.gain(b, a) for g, a, b in zip(goals, one.validation, other.validation, strict=True)]
        return min(gains) >= 0 and max(gains) > 0

    kept = {c.validation: c for c in reversed(known) if not any(dominates(other, c) for other in known)}
    return sorted(kept.values(), key=lambda c: goals[0].gain(c.validation[0], 0.0))
