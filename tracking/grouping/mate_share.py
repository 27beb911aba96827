"""How many of those who come near each other belong together *here*: the share of mates, estimated while people walk.

A belief is fitted to scenes with a certain share of mates among the pairs. Elsewhere there are more, on a shopping
street, or fewer, in a hall of commuters, and all log-odds are wrong by about one number. It is found as the share that
explains the beliefs about the pairs so far best (expectation maximisation for unknown priors: Saerens, Latinne and
Decaestecker, Neural Computation 14, 2002), where the share of the fit counts as much as `WEIGHT` pairs. Each pair
counts once, by its latest belief, and nothing looks ahead.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints

WEIGHT = 30.0  # Pairs.
MIDDLES = -12.0 + 0.25 * np.arange(81, dtype=np.float64)  # Log-odds in the middles of the bins.


class MateShare:
    """The shift of log-odds that the share of mates among the pairs so far asks for. share: that of the fit.

    State: latest (K,), bin of each pair's latest belief, -1 for none; counts (B,), pairs by bin, those who are gone
    included; shift (1,), log-odds.
    """

    def __init__(self, share: float) -> None:
        self.share = share
        self.latest, self.counts, self.shift = np.zeros(0, np.int64), np.zeros(len(MIDDLES)), np.zeros(1)

    def add(self, step: Ints, pair: Ints, log_odds: Array) -> Array:
        """Adds beliefs (R,), steps ascending, of pairs (R,), numbers from 0. Returns the shift (R,) at each step."""
        from tracking.grouping.belief_kernels import shifts_of_share

        more, out = int(pair.max(initial=-1)) + 1 - len(self.latest), np.empty(len(step))
        if more > 0:
            self.latest = np.concatenate([self.latest, np.full(more, -1)])
        shifts_of_share(step, pair, log_odds, MIDDLES, self.share, WEIGHT, self.latest, self.counts, self.shift, out)
        return out

    def take(self, rows: Ints) -> None:
        """Renumbers the pairs: pair k becomes what was pair rows[k], or a new one if rows[k] is -1."""
        self.latest = np.append(self.latest, -1)[np.where(rows < len(self.latest), rows, -1)]
