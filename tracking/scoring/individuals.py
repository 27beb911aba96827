"""Scores of individuals: HOTA, CLEAR and Identity together; any similarity in [0, 1] will do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tracking.scoring.clear import clear
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.pairs import Pairs


def scores(pairs: Pairs) -> dict[str, float]:
    """All three families by name. ValueError where an id is twice in one frame."""
    return next(scores_until(pairs, [_last(pairs)]))


def scores_until(pairs: Pairs, frames: Iterable[int]) -> Iterator[dict[str, float]]:
    """The scores of each beginning of the sequence, up to and with these frames; who is like whom is not asked again."""
    pairs.true.unique("truth")
    pairs.est.unique("tracks")
    for frame in frames:
        part = pairs.until(frame)
        yield {**hota(part), **clear(part), **identity(part)}


def _last(pairs: Pairs) -> int:
    return max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=0)
