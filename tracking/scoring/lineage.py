"""Who came from whom: parents and children of merges and splits, apart from ids."""

from __future__ import annotations

from collections.abc import Sequence

from tracking.scoring.events import HEADLINE, Pairing, Part, Told

MOST = 0.5  # a part is the right one if both have more than this in common: then no other can be


def lineage_scores(pairings: Sequence[Pairing]) -> dict[str, float]:
    """Share of the true merges and splits, and of those found, whose parents and children are all told right.

    Events whose true parents or children are not known (a label for life tells neither) do not count; nan without any.
    """
    head = [p for p in pairings if p.kind in HEADLINE]
    there = sum(known(event) for p in head for event in p.true)
    pairs = [(a, b) for p in head for a, b in p.pairs if known(a)]
    right = sum(same_lineage(a, b) for a, b in pairs)
    return {
        "lineage_accuracy": right / there if there else float("nan"),
        "lineage_accuracy_found": right / len(pairs) if pairs else float("nan"),
    }


def known(event: Told) -> bool:
    """Whether it is said where the event's people came from and went."""
    return event.parents is not None and event.children is not None


def same_lineage(true: Told, told: Told) -> bool:
    """Whether the parents, and the children, are as many and each is one of the other side's."""
    if true.parents is None or true.children is None or told.parents is None or told.children is None:
        return False
    return same_parts(true.parents, told.parents) and same_parts(true.children, told.children)


def same_parts(true: Sequence[Part], told: Sequence[Part]) -> bool:
    """Whether each true part has one told part with which it shares more than half."""
    return len(true) == len(told) and all(any(a.jaccard(b) > MOST for b in told) for a in true)
