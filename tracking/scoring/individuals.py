"""Scores of individuals: HOTA, CLEAR and Identity together; any similarity in [0, 1] will do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tracking.scoring.clear import clear
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.similarity import Pairs


def scores(pairs: Pairs) -> dict[str, float]:
    """All three families by name. ValueError where an id is twice in one frame."""
    pairs.true.unique("truth")
    pairs.est.unique("tracks")
    return _families(pairs)


def scores_until(pairs: Pairs, frames: Iterable[int]) -> Iterator[dict[str, float]]:
    """The scores of each beginning of the sequence, up to these frames; who is like whom is not asked again."""
    pairs.true.unique("truth")
    pairs.est.unique("tracks")
    return (_families(pairs.until(frame)) for frame in frames)


def _families(pairs: Pairs) -> dict[str, float]:
    return {**hota(pairs), **clear(pairs), **identity(pairs)}
