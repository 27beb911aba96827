"""Stops a trial early when it surely loses to the best trial on the scenes that both were played on: the p-value of a
paired test lies below a limit.

Wilcoxon's signed-rank test (1945), one-sided, as in Optuna's WilcoxonPruner. *Ours*: p-values are exact with ties and
zeros, too. Parameters that change nothing in most scenes give zeros and ties; scipy then draws permutations, which
takes longer than an episode (figures: CONTRIBUTING.md). The test is repeated after each scene, so p is not the error
rate of a whole trial.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import optuna
from optuna.pruners import BasePruner
from optuna.trial import FrozenTrial

LEAST_SCENES = 2


class SignedRankPruner(BasePruner):
    """Prunes a trial whose values on the scenes so far are surely worse than the best trial's on the same scenes.

    A trial is pruned if the one-sided p-value of Wilcoxon's signed-rank test is below p; 0 never prunes. Values must be
    reported with the number of the scene as step. For studies with one goal.
    """

    def __init__(self, p: float) -> None:
        self.p = p

    def prune(self, study: optuna.Study, trial: FrozenTrial) -> bool:
        """Returns True if the trial is to be pruned."""
        try:
            best = study.best_trial.intermediate_values
        except ValueError:
            return False
        sign = 1.0 if study.direction == optuna.study.StudyDirection.MAXIMIZE else -1.0
        gains = [sign * (v - best[k]) for k, v in trial.intermediate_values.items() if k in best]
        return len(gains) >= LEAST_SCENES and sum(gains) < 0 and signed_rank_p_value(gains) < self.p


def signed_rank_p_value(gains: Sequence[float]) -> float:
    """Returns the one-sided p-value of Wilcoxon's signed-rank test: small if the gains are mostly negative."""
    d = np.asarray(gains, float)
    _, place, count = np.unique(np.abs(d), return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    doubled = (2 * last - count + 1)[place]  # twice the mean rank, which is an integer
    signed = doubled[d != 0]
    ways = np.zeros(int(signed.sum()) + 1)
    ways[0] = 1.0
    for rank in signed:
        ways[rank:] = (ways[rank:] + ways[:-rank]) / 2
        ways[:rank] /= 2
    return float(ways[: int(doubled[d > 0].sum()) + 1].sum())
