"""Markdown tables on standard output, and cells of means, shares and differences with 95 % intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf, sqrt

import numpy as np

from sim.types import Array
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import LEVEL, score_interval

EXACT = 1e-12  # a difference nearer to 0 is due to rounding
UNBOUNDED = replace(CATALOGUE["RMSE_pos"], low=-inf, high=inf)  # of figures that are no scores: nothing is cut
INDICATIVE = ", indicative"  # follows intervals of fewer than 6 sequences
NORMAL = 1.959963984540054  # a standard normal variable lies within +- NORMAL with probability LEVEL


def wilson(hits: int, count: int) -> tuple[float, float, float]:
    """Returns the share of `hits` out of `count` and its 95 % interval (Wilson 1927): nan, 0 and 1 if count is 0.

    The interval holds all p with (share - p)² <= z² p (1 - p) / count, where z = 1.96 is the normal quantile.
    """
    if count == 0:
        return float("nan"), 0.0, 1.0
    share, z2 = hits / count, NORMAL**2 / count
    middle = (share + z2 / 2) / (1 + z2)
    half = sqrt(z2 * (share * (1 - share) + z2 / 4)) / (1 + z2)
    return share, max(0.0, middle - half), min(1.0, middle + half)


def head(columns: Sequence[str]) -> None:
    """Prints an empty line, the names of the columns and the rule under them."""
    print()
    row(columns)
    print("|" + "---|" * len(columns))


def row(cells: Iterable[str]) -> None:
    """Prints one row at once, so that a long benchmark shows its progress."""
    print("| " + " | ".join(cells) + " |", flush=True)


def table(title: str, first: str, columns: Sequence[str], rows: Mapping[str, Sequence[str]]) -> None:
    """Prints a whole table; first: name of the first column, which holds the keys of `rows`."""
    print(f"\n{title}")
    head([first, *columns])
    for name, cells in rows.items():
        row([name, *cells])
    differences = [cell for cells in rows.values() for cell in cells if cell[:1] in ("+", "-") and "[" in cell]
    if differences:
        chance = (1 - LEVEL) * len(differences)
        print(f"\n* a sure difference, in the direction of its sign; of {len(differences)} some {chance:.2g} by chance")


def mean_cell(values: Sequence[float] | Array, score: str = "HOTA", digits: int = 3) -> str:
    """Returns the mean of values (S,) of S sequences with its interval, cut at the range of a score of the catalogue;
    with the word indicative if fewer than 6 values are known."""
    mean, low, high, few = _ends(values, score, difference=False)
    return interval(mean, low, high, digits) + INDICATIVE * few


def difference_cell(values: Sequence[float] | Array, score: str = "HOTA") -> str:
    """Returns the mean of differences (S,) of S sequences with its interval, cut at those that a score of the catalogue
    can have; with the word indicative, and never sure, if fewer than 6 are known."""
    mean, low, high, few = _ends(values, score, difference=True)
    return signed(mean, low, high).removesuffix(" *") + INDICATIVE if few else signed(mean, low, high)


def _ends(values: Sequence[float] | Array, score: str, difference: bool) -> tuple[float, float, float, bool]:
    known = CATALOGUE.get(score, UNBOUNDED)
    found = score_interval(known, np.asarray(values, float)[:, None], difference)
    mean, low, high = (float(found[end][0]) for end in ("mean", "low", "high"))
    return mean, low, high, bool(found["indicative"][0] and np.isfinite(low))


def interval(mean: float, low: float, high: float, digits: int = 3) -> str:
    """Returns "mean [low, high]"; without the ends if they are not finite; a dash if the mean is not."""
    if not np.isfinite(mean):
        return "–"
    return f"{mean:.{digits}f}" + (f" [{low:.{digits}f}, {high:.{digits}f}]" if np.isfinite(low) else "")


def signed(mean: float, low: float, high: float) -> str:
    """Returns a difference with its sign and its ends; * means sure (0 lies outside), not that it is good."""
    if not np.isfinite(mean):
        return "–"
    ends = f" [{low:+.3f}, {high:+.3f}]" if np.isfinite(low) else ""
    return f"{mean:+.3f}{ends}" + (" *" if low > EXACT or high < -EXACT else "")


def share(hits: int, count: int) -> str:
    """Returns a share with Wilson's interval and its counts; a dash if `count` is 0."""
    middle, low, high = wilson(hits, count)
    return f"{interval(middle, low, high)} {hits}/{count}" if count else "–"


def number(value: float, digits: int = 3) -> str:
    """Returns a number, or a dash if it is not finite."""
    return f"{value:.{digits}f}" if np.isfinite(value) else "–"
