"""Lays the scores of any number of runs side by side: `compare` scores them alike, and `ComparedRuns` ranks them.

People are compared in one way on all sequences and for all runs. Beside them stands an oracle for each input that the
runs got: what the best tracker could report from it. The order of the runs has no effect.
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
from tracking.recording_ranking import recording_rankings
from tracking.running.run import TrackingRun
from tracking.running.run_info import input_name, input_summary
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer, Scores
from tracking.scoring.groups import GroupMatch
from tracking.scoring.people import IncomparableError, Similarity
from tracking.scoring.pooling import pooled
from tracking.stats import SURE, few, mean_of_finite

if TYPE_CHECKING:
    import pyarrow

MATCHED = ", matched"  # ends the name of an oracle whose detections do not tell whose they are
UNKNOWN = "unknown"  # Stands for the input of tracks without run.json.


@dataclass(frozen=True, eq=False)
class ComparedSequence:
    """The scores of R runs on one sequence."""

    scores: list[Scores]  # of each run
    inputs: list[str]  # what each run got, in few words
    given: list[str]  # the same with background and settings of the sensor; "" without run.json
    detections: list[str | None]  # hash of the stored ones that it got, None if it got no stored ones, "" if unknown
    oracles: Mapping[str, Scores]  # by input; if no run says what it got, of the stored detections, else of the labels
    blocks: Mapping[str, Ranking] | None = None  # by score, the ranking with intervals by weights of blocks of frames
    seconds: float = 0.0  # length of the sequence


@dataclass(frozen=True, eq=False)
class ComparedRuns:
    """The scores of R runs on S sequences.

    Attributes:
        runs: Names, in the order given.
        sequences: Names, in the order given.
        scores: By run, a list of `Scores`, one per sequence.
        inputs: By run, the tracker's inputs in words, such as "boxes (file)"; one unless they differ by sequence.
        oracles: By input, the scores of its oracle on each sequence, None where no run got this input. The name of an
            input ends with ", matched" if its detections do not tell whose they are.
        similarity: How people were compared in all sequences.
        blocks: For a single recording, the ranking by each score (by key), with intervals by resampling of blocks of
            frames; None if these were not computed.
        seconds: Length of all sequences together.
    """

    runs: tuple[str, ...]
    sequences: tuple[str, ...]
    scores: Mapping[str, list[Scores]]
    inputs: Mapping[str, tuple[str, ...]]
    oracles: Mapping[str, list[Scores | None]]
    similarity: Similarity
    blocks: Mapping[str, Ranking] | None = None
    seconds: float = 0.0

    def rows(self) -> dict[str, list[Scores | None]]:
        """Returns lists of scores, one per sequence, by name: first the oracles ("oracle from INPUT"), then the runs. A
        score is None where no run got the oracle's input."""
        oracles = {f"oracle from {name}": row for name, row in self.oracles.items()}
        return {**oracles, **{name: [*row] for name, row in self.scores.items()}}

    def values(self, key: str) -> Array:
        """Returns the score `key` of the R runs on the S sequences, (R, S); nan where unknown."""
        return np.array([_values(self.scores[run], key) for run in self.runs])

    def ranking(self, key: str = "objective", sequences: SequenceOf[int] | None = None) -> Ranking:
        """Returns the ranking of the runs by the score `key`. sequences: indices of the sequences that count; None:
        all. It has no effect if `blocks` is known."""
        if self.blocks is not None:
            return self.blocks[key]
        values = self.values(key)
        return rank(values if sequences is None else values[:, sequences], CATALOGUE[key].better == "higher")

    def pooled(self) -> dict[str, dict[str, float]]:
        """Returns for each name of `rows` the scores of all sequences together by key, as `tracking.scoring.pooled`.
        They have no interval and rank nobody."""
        return {name: pooled(one for one in row if one is not None) for name, row in self.rows().items()}

    def indicative(self, key: str = "objective") -> bool:
        """Returns True if intervals of the score `key` are only indicative: of fewer than 6 sequences in which all runs
        have it, or of a recording shorter than a minute."""
        if self.blocks is not None:
            return self.seconds < SURE
        return bool(few(self.ranking(key).sequences))

    def to_arrow(self, key: str = "objective") -> pyarrow.Table:
        """Returns the ranking by a score as a table, one row per run, best first, after the oracles.

        Columns: run; input; first and last, the range of ranks, null for oracles; mean, low and high, the mean of the
        score and the ends of its 95 % interval; indicative, whether the interval is of few sequences; then the mean of
        every score of the catalogue that some row has.
        """
        import pyarrow as pa

        ranking, rows = self.ranking(key), self.rows()
        oracles = list(rows)[: len(self.oracles)]
        names = [self.runs[k] for k in ranking.order.tolist()]
        of_oracles = [rank(_values(rows[name], key)[None]) for name in oracles]
        columns: dict[str, Any] = {
            "run": [*oracles, *names],
            "input": [*self.oracles, *(", ".join(self.inputs[name]) for name in names)],
            "first": [*[None] * len(oracles), *ranking.first.tolist()],
            "last": [*[None] * len(oracles), *ranking.last.tolist()],
        }
        for part in ("mean", "low", "high"):
            ends = np.concatenate([*(getattr(one, part) for one in of_oracles), getattr(ranking, part)])
            columns[part] = CATALOGUE[key].within(ends).tolist()
        of_runs = [self.indicative(key)] * len(names)
        columns["indicative"] = [*(bool(few(one.sequences)) for one in of_oracles), *of_runs]
        for each in CATALOGUE:
            means = [mean_of_finite(_values(rows[name], each)) for name in columns["run"]]
            if np.isfinite(means).any():
                columns[each] = means
        return pa.table(columns)


def _values(scores: SequenceOf[Scores | None], key: str) -> Array:
    return np.array([float("nan") if one is None else one[key] for one in scores])


def compare(
    sequences: Iterable[Sequence],
    runs: Mapping[str, Iterable[SequenceOf[Tracks]]],
    *,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
    blocks: int = 0,
) -> ComparedRuns:
    """Scores several runs on the same labelled sequences, all by one similarity, and the oracle of each kind of input.

    The oracle's tracks are the tracker's detections with the true ids and groups.

    Args:
        sequences: Labelled sequences.
        runs: By name of the run, its tracks of each sequence, in the order of `sequences`, as `track` returns them.
        similarity: How people are compared, by "boxes", "ground" or "image"; None chooses by the data, as `evaluate`.
        group_match: How groups are matched, by "hull" or "members", as in `evaluate`.
        blocks: Number of random draws of blocks of frames for intervals on a single recording; 0 computes none.

    Returns:
        `ComparedRuns`, the scores of all runs and oracles on all sequences.

    Raises:
        InputError: A run lacks a sequence, a sequence lacks labels, sequences or runs cannot be compared in one way, or
            `blocks` is given for several sequences.
    """
    given = list(sequences)
    check_blocks(blocks, len(given))
    tracks = {name: list(run) for name, run in runs.items()}
    for name, run in tracks.items():
        if len(run) != len(given):
            raise InputError(
                place=f"runs[{name!r}]", got=f"tracks of {len(run)} sequences", expected=f"of {len(given)}",
                remedy="give one run for each sequence, in their order",
            )  # fmt: skip
    found = [
        compare_one(sequence, [run[k] for run in tracks.values()], similarity, group_match, blocks)
        for k, sequence in enumerate(given)
    ]
    return joined(list(tracks), [sequence.name for sequence in given], found)


def check_blocks(blocks: int, sequences: int) -> None:
    """Raises InputError if `blocks` is not 0 and there is more than one sequence."""
    if blocks and sequences > 1:
        raise InputError(
            place="--blocks", got=f"{sequences} sequences", expected="a single recording",
            remedy="leave it out: the interval over sequences is shown anyway",
        )  # fmt: skip


def joined(names: SequenceOf[str], sequences: SequenceOf[str], found: SequenceOf[ComparedSequence]) -> ComparedRuns:
    """Returns the comparison of runs with these names; found: for each sequence, the result of `compare_one`. Raises
    InputError if people were compared in different ways on the sequences."""
    ways: dict[Similarity, str] = {}
    for sequence, one in zip(sequences, found, strict=True):
        ways.setdefault(one.scores[0].similarity, sequence)
    if len(ways) > 1:
        got = ", ".join(f"{way} ({name})" for way, name in ways.items())
        raise InputError(
            place="--similarity", got=f"sequences whose people are compared in different ways: {got}",
            expected="one way for all", remedy="give --similarity, or score them apart",
        )  # fmt: skip
    scores = {name: [one.scores[k] for one in found] for k, name in enumerate(names)}
    inputs = {name: tuple(dict.fromkeys(one.inputs[k] for one in found)) for k, name in enumerate(names)}
    oracles = {
        name: [one.oracles.get(name) for one in found] for name in sorted({n for one in found for n in one.oracles})
    }
    blocks = found[0].blocks if len(found) == 1 else None
    seconds = sum(one.seconds for one in found)
    return ComparedRuns(
        tuple(names), tuple(sequences), scores, inputs, oracles, next(iter(ways), "ground"), blocks, seconds
    )  # fmt: skip


def compare_one(
    sequence: Sequence,
    runs: SequenceOf[SequenceOf[Tracks]],
    similarity: Similarity | None,
    group_match: GroupMatch,
    blocks: int = 0,
    oracles: bool = True,
) -> ComparedSequence:
    """Returns the scores of each run of one sequence, and of the oracles of their inputs, all by one similarity. The
    arguments are as in `compare`; oracles: False leaves the oracles out."""
    infos = [run.info if isinstance(run, TrackingRun) else {} for run in runs]
    inputs = [input_name(info) for info in infos]
    with scorer_of(sequence) as scorer:
        given = {name: info for name, info in sorted(zip(inputs, infos, strict=True), key=lambda one: one[0]) if name}
        if not given:
            given = {"stored detections" if sequence.has_detections else "labels": {}}
        found_best = {name: oracle(sequence, info, similarity) for name, info in given.items()} if oracles else {}
        best = {name + MATCHED * (run.info["owners"] == "matched"): run for name, run in found_best.items()}
        rows: list[SequenceOf[Tracks]] = [*best.values(), *runs]
        compared = scorer.compare(rows, similarity)
        found, drawn = [one.scores(group_match) for one in compared], None
        if blocks:
            weighted = [one.weighted_scores(group_match) for one in compared[len(best) :]]
            drawn = recording_rankings(scorer.truth, weighted, blocks)
    own = dict(zip(best, found, strict=False))
    named, summaries = [name or UNKNOWN for name in inputs], [input_summary(info) for info in infos]
    seconds = scorer.truth.length / scorer.truth.fps
    stored = [info.get("detections_hash", "") for info in infos]
    return ComparedSequence(found[len(best) :], named, summaries, stored, own, drawn, seconds)


@contextmanager
def scorer_of(sequence: Sequence) -> Iterator[Scorer]:
    """Context manager that yields a `Scorer` of the sequence's truth; raises InputError if there is no truth. If the
    block raises ValueError, it becomes an InputError that names the sequence."""
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
            remedy="choose another --similarity, or track from detections that are alike: "
            "if the labels are boxes alone, with -1 for x, y and z in det.txt",
        ) from None  # fmt: skip
    except ValueError as error:
        raise InputError(
            file=sequence.name, got=str(error), expected="each id once in a frame", remedy="remove one of the two rows",
        ) from None  # fmt: skip
