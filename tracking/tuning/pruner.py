"""When a trial is given up: once it surely loses to the best one on the scenes that both were played on.

Wilcoxon's signed-rank test (1945), one-sided, as in Optuna's WilcoxonPruner, but with exact probabilities whatever is
tied: parameters that change nothing in most scenes give zeros and ties, for which scipy draws permutations, and a test
then takes longer than an episode. Testing again after each scene, p is no error rate of the whole trial.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import optuna
from optuna.pruners import BasePruner
from optuna.trial import FrozenTrial

LEAST = 2  # scenes


class SignedRank(BasePruner):
    """Gives up a trial that reports, by the number of the scene as its step, surely worse values than the best one."""

    def __init__(self, p: float) -> None:
        self.p = p

    def prune(self, study: optuna.Study, trial: FrozenTrial) -> bool:
        """Whether the trial is to be given up; never before there is a best one."""
        try:
            best = study.best_trial.intermediate_values
        except ValueError:
            return False
        sign = 1.0 if study.direction == optuna.study.StudyDirection.MAXIMIZE else -1.0
        gains = [sign * (v - best[k]) for k, v in trial.intermediate_values.items() if k in best]
        return len(gains) >= LEAST and sum(gains) < 0 and chance(gains) < self.p


def chance(gains: Sequence[float]) -> float:
    """The probability of a sum of positive ranks no greater than this one's, were each sign a coin's throw.

    Ranks are of the absolute values, those of equal ones averaged; zeros have their ranks and no sign.
    """
    d = np.asarray(gains, float)
    _, place, count = np.unique(np.abs(d), return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    doubled = (2 * last - count + 1)[place]  # twice the mean rank: whole
    free = doubled[d != 0]
    ways = np.zeros(int(free.sum()) + 1)
    ways[0] = 1.0
    for rank in free:
        ways[rank:] = (ways[rank:] + ways[:-rank]) / 2
        ways[:rank] /= 2
    return float(ways[: int(doubled[d > 0].sum()) + 1].sum())
