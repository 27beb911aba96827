"""Lays the scores of any number of runs side by side: `compare` scores them alike, and `ComparedRuns` ranks them.

People are compared in one way on all sequences and for all runs. The oracle stands beside them: what the best tracker
could report from the same detections.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Sequence, Tracks
from tracking.oracle import oracle
from tracking.ranking import Ranking, rank
from tracking.run import TrackingRun
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer, Scores
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.people_comparison import IncomparableError, Similarity

if TYPE_CHECKING:
    import pyarrow

ORACLE = "oracle"


@dataclass(frozen=True, eq=False)
class ComparedRuns:
    """The scores of R runs on S sequences.

    runs: names, in the order given. sequences: names. scores: for each run a list of `Scores`, one per sequence.
    oracle: those of the oracle. similarity: how people were compared in all of them.
    """

    runs: tuple[str, ...]
    sequences: tuple[str, ...]
    scores: Mapping[str, list[Scores]]
    oracle: list[Scores]
    similarity: Similarity

    def values(self, key: str) -> Array:
        """Returns a score of the catalogue (R, S) of the runs on the sequences; nan where unknown."""
        return np.array([[one[key] for one in self.scores[run]] for run in self.runs])

    def ranking(self, key: str = "objective", sequences: SequenceOf[int] | None = None) -> Ranking:
        """Returns the ranking of the runs by a score of the catalogue. sequences: indices of those that count."""
        values = self.values(key)
        return rank(values if sequences is None else values[:, sequences], CATALOGUE[key].better == "higher")

    def to_arrow(self, key: str = "objective") -> pyarrow.Table:
        """Returns the ranking by a score as a table, one row per run, best first, after the oracle.

        Columns: run; first, last: the range of ranks, null for the oracle; mean, low, high: of the score, with its 95 %
        interval within the score's range; then the mean of every score of the catalogue that is known for some run.
        """
        import pyarrow as pa

        ranking = self.ranking(key)
        names = [self.runs[k] for k in ranking.order.tolist()]
        rows = [self.oracle, *(self.scores[name] for name in names)]
        of_oracle = rank(np.array([[one[key] for one in self.oracle]]))
        columns: dict[str, Any] = {
            "run": [ORACLE, *names],
            "first": [None, *ranking.first.tolist()],
            "last": [None, *ranking.last.tolist()],
        }
        for part in ("mean", "low", "high"):
            ends = np.concatenate([getattr(of_oracle, part), getattr(ranking, part)])
            columns[part] = np.clip(ends, CATALOGUE[key].low, CATALOGUE[key].high).tolist()
        for each in CATALOGUE:
            means = [_mean(np.array([one[each] for one in row])) for row in rows]
            if np.isfinite(means).any():
                columns[each] = means
        return pa.table(columns)

    def to_pandas(self, key: str = "objective") -> Any:
        """Returns the table of `to_arrow` as a data frame of pandas, which must be installed."""
        return self.to_arrow(key).to_pandas()


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def compare(
    sequences: Iterable[Sequence],
    runs: Mapping[str, Iterable[SequenceOf[Tracks]]],
    *,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
) -> ComparedRuns:
    """Returns the scores of several runs on the same labelled sequences, all compared alike, and those of the oracle.

    runs: by name, the tracks of each sequence in the order of `sequences`, as `track` returns them. similarity: of
    people, "boxes", "ground" or "image"; None: by the data (tracking.scoring.one_plane). group_match: of groups, by
    "hull" or "members".

    Raises InputError if a run lacks a sequence, a sequence lacks labels, the sequences are not comparable in one way,
    or runs cannot be compared with the truth or with each other.
    """
    given = list(sequences)
    tracks = {name: list(run) for name, run in runs.items()}
    for name, run in tracks.items():
        if len(run) != len(given):
            raise InputError(
                place=f"runs[{name!r}]", got=f"tracks of {len(run)} sequences", expected=f"of {len(given)}",
                remedy="give one run for each sequence, in their order",
            )  # fmt: skip
    found = [
        compare_one(sequence, [run[k] for run in tracks.values()], similarity, group_match)
        for k, sequence in enumerate(given)
    ]
    return joined(list(tracks), [sequence.name for sequence in given], found)


def joined(names: SequenceOf[str], sequences: SequenceOf[str], found: SequenceOf[list[Scores]]) -> ComparedRuns:
    """Returns the comparison of runs with these names; found: for each sequence, the result of `compare_one`.

    Raises InputError if people were not compared in one way on all sequences.
    """
    ways: dict[Similarity, str] = {}
    for sequence, row in zip(sequences, found, strict=True):
        ways.setdefault(row[0].similarity, sequence)
    if len(ways) > 1:
        got = ", ".join(f"{way} ({name})" for way, name in ways.items())
        raise InputError(
            place="--similarity", got=f"sequences whose people are compared in different ways: {got}",
            expected="one way for all", remedy="give --similarity, or score them apart",
        )  # fmt: skip
    oracles, *rest = ([row[k] for row in found] for k in range(len(names) + 1))
    scores = dict(zip(names, rest, strict=True))
    return ComparedRuns(tuple(names), tuple(sequences), scores, oracles, next(iter(ways), "ground"))


def compare_one(
    sequence: Sequence, runs: SequenceOf[SequenceOf[Tracks]], similarity: Similarity | None, group_match: GroupMatch
) -> list[Scores]:
    """Returns the scores of the oracle and of each run of one sequence, all compared alike. Raises InputError as
    `compare`."""
    info = next((run.info for run in runs if isinstance(run, TrackingRun) and run.info), {})
    with scorer_of(sequence) as scorer:
        best = oracle(sequence, info, similarity)
        return scorer.evaluate_all([best, *runs], similarity=similarity, group_match=group_match)


@contextmanager
def scorer_of(sequence: Sequence) -> Iterator[Scorer]:
    """Gives a scorer of the sequence's truth; what it cannot compare becomes an InputError that names the sequence.

    Raises InputError if the sequence has no labels, the runs cannot be compared as asked, or an id occurs twice in one
    frame.
    """
    if sequence.truth is None:
        raise InputError(
            file=sequence.source.get("path", sequence.name), got="no labels", expected="a sequence with truth",
            remedy="give one with gt/",
        )  # fmt: skip
    try:
        yield Scorer(sequence.truth)
    except IncomparableError as error:
        raise InputError(
            file=sequence.name, place="--similarity", got=str(error), expected="what all sides have",
            remedy="choose another --similarity, or track from the same detections",
        ) from None  # fmt: skip
    except ValueError as error:
        raise InputError(
            file=sequence.name, got=str(error), expected="each id once in a frame", remedy="remove one of the two rows",
        ) from None  # fmt: skip
