"""Scores of several sequences together, as TrackEval's COMBINED row."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.scoring.hota import hota_scores

COUNTS = ("TP", "FN", "FP", "IDSW", "MT", "PT", "ML", "Frag", "IDTP")  # Scores that add up over sequences.


def pooled(scores: Iterable[Scores]) -> dict[str, float]:
    """Returns HOTA, CLEAR and Identity scores of all sequences together, by key, as TrackEval's COMBINED row.

    Counts add up over the sequences, and the other scores are ratios of such sums. So a sequence weighs by its people,
    and not as one value of many, as in a mean. No person or track is in two sequences. There is no interval.

    Args:
        scores: of one tracker on each sequence. Sequences without scores of people are left out.

    Returns:
        The pooled scores in the order of the catalogue; {} if no sequence has scores of people.
    """
    known = [one for one in scores if one.hota is not None]
    sums = [one.hota for one in known if one.hota is not None]
    if not sums:
        return {}
    found = {key: sum(one[key] for one in known) for key in COUNTS}
    hits, true, est, right = found["TP"], found["TP"] + found["FN"], found["TP"] + found["FP"], found["IDTP"]
    similar = sum(one["MOTP"] * one["TP"] for one in known)
    found |= {key: float(value[0]) for key, value in hota_scores(np.sum(sums, axis=0)[None]).items()}
    ratios = {
        "MOTA": (hits - found["FP"] - found["IDSW"], true), "MOTP": (similar, hits),
        "IDF1": (2 * right, true + est), "IDP": (right, est), "IDR": (right, true),
    }  # fmt: skip
    found |= {key: part / whole if whole else 0.0 for key, (part, whole) in ratios.items()}
    return {key: found[key] for key in CATALOGUE if key in found}
