"""Scores of individuals: HOTA, CLEAR and Identity together; any similarity in [0, 1] will do."""

from __future__ import annotations

from tracking.scoring.clear import clear
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.pairs import Pairs


def scores(pairs: Pairs) -> dict[str, float]:
    """All three families by name. ValueError where an id is twice in one frame."""
    pairs.true.unique("truth")
    pairs.est.unique("tracks")
    return {**hota(pairs), **clear(pairs), **identity(pairs)}
