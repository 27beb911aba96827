"""Numba kernels of the belief: sums of tables, and the decisions of pairs over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints


@njit(cache=True)
def table_sums(values: Array, mix: Array, bias: float, column: Ints, cut: Ints, at: Array, heights: Array) -> Array:
    """Returns the beliefs (R,), log-odds: bias plus what each table says of its quantity, 0 where it is unknown.

    values (R, Q): quantities; mix (R, M): weights of the M columns of the tables. column (T,): the quantity of each
    table; cut (T + 1,): where each table's knots begin in at (N,) and heights (M, N): the knots, ascending in each
    table, and the log-odds there. Tables are linear between knots and constant beyond the ends.
    """
    out = np.full(len(values), bias)
    for r in range(len(values)):
        for t in range(len(column)):
            x = values[r, column[t]]
            if not np.isnan(x):
                k, last = cut[t], cut[t + 1] - 1
                while k < last and at[k + 1] <= x:
                    k += 1
                part = (x - at[k]) / (at[k + 1] - at[k]) if x > at[k] and k < last else 0.0
                for m in range(len(heights)):
                    if mix[r, m] > 0:
                        out[r] += mix[r, m] * heights[m, k]
                        if part > 0:
                            out[r] += mix[r, m] * part * (heights[m, k + 1] - heights[m, k])
    return out


@njit(cache=True)
def changed(log_odds: Any, join: float, part: float, seconds: Any) -> Any:
    """Returns the log-odds of a two-state Markov relation after `seconds` without evidence; numbers or arrays.

    log_odds: before. Strangers become mates `join` times, mates strangers `part` times per second.
    """
    usual = join / (join + part)
    share = usual + (1 / (1 + np.exp(-log_odds)) - usual) * np.exp(-(join + part) * seconds)
    return np.log(share / (1 - share))


@njit(cache=True)
def decisions(
    step: Ints, pair: Ints, log_odds: Array, seconds: float, share: float, join: float, part: float, last: Ints,
    decision: Array,
) -> Array:  # fmt: skip
    """Returns the log-odds (R,) of a two-state Markov relation after each of R rows.

    step (R,): ascending; pair (R,): index in last and decision (K,), the pair's last row and log-odds, changed in
    place; decision is nan before a pair's first row, whose belief it then takes. log_odds (R,): beliefs, of which each
    row adds `share`. seconds: length of a step, s. Strangers become mates `join` times, mates strangers `part` times
    per second.
    """
    out = np.empty(len(step))
    for r in range(len(step)):
        k = pair[r]
        if np.isnan(decision[k]):
            decision[k] = log_odds[r]
        else:
            decision[k] = changed(decision[k], join, part, (step[r] - last[k]) * seconds) + share * log_odds[r]
        last[k], out[r] = step[r], decision[k]
    return out
