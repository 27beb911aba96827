"""Scores of events: what a tracker told beside what happened, one to one, for each kind.

Two events are the same if they are of one kind, start within 1 s of each other, and concern the same people (Jaccard
index of at least 0.5) or, where a method knows no people, happen within 1.5 m. form counts as merge, dissolve as split.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array

KINDS = ("merge", "split", "cross", "queue", "enter", "leave")
COUNTS_AS = {"form": "merge", "dissolve": "split"}
HEADLINE = ("merge", "split")
LATE = 1.0  # s between the starts
ALIKE = 0.5  # Jaccard index of the people
NEAR = 1.5  # m, without people

People = frozenset[int]


@dataclass(frozen=True, slots=True)
class Part:
    """Some of an event's people: true ids, and how many tracks beside them are nobody (or somebody twice)."""

    people: People
    wrong: int = 0

    def jaccard(self, other: Part) -> float:
        """Share of all that both have; wrong ones are in no other part."""
        common = len(self.people & other.people)
        whole = len(self.people | other.people) + self.wrong + other.wrong
        return common / whole if whole else 0.0


@dataclass(frozen=True, slots=True)
class Told:
    """An event in terms of true people. start, emitted: frames; members None where the method knows no people; pos in
    the plane of both sides; parents, children: the parts before and after, None where unknown."""

    kind: str
    start: int
    emitted: int | None
    members: Part | None
    pos: tuple[float, float]
    parents: tuple[Part, ...] | None = None
    children: tuple[Part, ...] | None = None


@dataclass(frozen=True, slots=True)
class Pairing:
    """Which true event (rows of `true`) is which told one, for one kind."""

    kind: str
    true: Sequence[Told]
    told: Sequence[Told]
    pairs: Sequence[tuple[Told, Told]]


def pair_events(true: Sequence[Told], told: Sequence[Told], fps: float, scale: float) -> list[Pairing]:
    """The events of both sides, kind by kind; scale: the plane's units per metre."""
    found = []
    for kind in KINDS:
        a, b = ([e for e in side if COUNTS_AS.get(e.kind, e.kind) == kind] for side in (true, told))
        found.append(Pairing(kind, a, b, _one_to_one(a, b, _alike(a, b, fps, scale))))
    return found


def _alike(true: Sequence[Told], told: Sequence[Told], fps: float, scale: float) -> Array:
    """How much alike each two are (N, M), 0: not the same event."""
    starts = [np.array([e.start for e in side], float) for side in (true, told)]
    late = np.abs(starts[0][:, None] - starts[1][None]) / fps
    alike = np.zeros(late.shape)
    for i, j in np.argwhere(late <= LATE + 1e-9).tolist():
        a, b = true[i], told[j]
        if a.members is not None and b.members is not None:
            s = a.members.jaccard(b.members)
            alike[i, j] = s if s >= ALIKE - 1e-12 else 0.0
        else:
            d = float(np.hypot(a.pos[0] - b.pos[0], a.pos[1] - b.pos[1])) / scale
            alike[i, j] = 1 - d / (2 * NEAR) if d <= NEAR + 1e-9 else 0.0
    # Of two as much alike, the one that starts nearer.
    return np.where(alike > 0, alike + (LATE - late) * 1e-3, 0.0)


def _one_to_one(true: Sequence[Told], told: Sequence[Told], alike: Array) -> list[tuple[Told, Told]]:
    """As many pairs as there can be, of these the most alike."""
    if not alike.any():
        return []
    from scipy.optimize import linear_sum_assignment

    one_more = 2.0 * min(alike.shape)  # outweighs all likeness together
    rows, columns = linear_sum_assignment(np.where(alike > 0, one_more + alike, 0.0), maximize=True)
    return [(true[i], told[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if alike[i, j] > 0]


def event_scores(pairings: Sequence[Pairing], fps: float) -> dict[str, float]:
    """Scores by kind, their headline (mean of merge and split) and latency; a kind that neither side has is nan."""
    out: dict[str, float] = {}
    for p in pairings:
        hits, there, said = len(p.pairs), len(p.true), len(p.told)
        late = [(b.emitted - a.start) / fps for a, b in p.pairs if b.emitted is not None]
        out |= {
            f"{p.kind}_F1": _share(2 * hits, there + said),
            f"{p.kind}_precision": _share(hits, said),
            f"{p.kind}_recall": _share(hits, there),
            f"{p.kind}_TP": float(hits),
            f"{p.kind}_FP": float(said - hits),
            f"{p.kind}_FN": float(there - hits),
            f"{p.kind}_latency": _mean(late),
        }
    head = [p for p in pairings if p.kind in HEADLINE]
    late = [(b.emitted - a.start) / fps for p in head for a, b in p.pairs if b.emitted is not None]
    return {
        **{f"event_{s}": _mean([out[f"{p.kind}_{s}"] for p in head]) for s in ("F1", "precision", "recall")},
        "event_latency": _mean(late),
        **out,
    }


def _share(part: float, whole: int) -> float:
    return part / whole if whole else float("nan")


def _mean(values: Sequence[float]) -> float:
    known = [v for v in values if v == v]
    return sum(known) / len(known) if known else float("nan")
