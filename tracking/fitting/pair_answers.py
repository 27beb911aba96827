"""The answers of a person about pairs: the file that the replay page saves, and the rows of evidence that it tells of.

The file names the people by a hash of who is where and when, so that it fits the recording, and the reading options,
from which the page was made, and no other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError, counted
from sim.store.tables import Id, Number, model, read_values
from tracking.fitting.place_belief import Answered
from tracking.grouping.explained_pairs import ExplainedPairs

KIND = "pair labels"
ANSWERS = ("together", "not", "don't know")
AGAIN = "save the answers from the page again"


@dataclass(frozen=True)
class PairAnswer:
    """What somebody said of two people."""

    a: int
    b: int
    start: float  # s: the stretch that was shown, both ends included
    end: float
    answer: str  # one of `ANSWERS`


@dataclass(frozen=True)
class AnswerFile:
    """A file of answers about the people of one recording."""

    path: Path
    recording: str
    people: str
    frames: int
    answers: tuple[PairAnswer, ...]

    @classmethod
    def read(cls, path: Path) -> AnswerFile:
        """Returns the answers in a file of the replay page. Raises InputError for another file, wrong values, or no
        answer but "don't know"."""
        said = {"answer": Literal[ANSWERS]}
        answer: Any = model(**{"a": Id, "b": Id, "from": Number, "to": Number, **said})
        kinds: dict[str, Any] = {
            "kind": Literal[KIND],
            "recording": str,
            "people": str,
            "frames": Id,
            "answers": list[answer],
        }
        found = read_values(path, AGAIN, AGAIN, **kinds)
        answers = tuple(PairAnswer(x.a, x.b, getattr(x, "from"), x.to, x.answer) for x in found.answers)
        if all(x.answer == ANSWERS[2] for x in answers):
            got = f"{counted(len(answers), 'answer')}, none of them together or not"
            remedy = "answer more questions on the page"
            raise InputError(file=path, place="answers", got=got, expected="at least one", remedy=remedy)
        return cls(path, found.recording, found.people, found.frames, answers)

    def counts(self) -> str:
        """Returns how often each answer was given, in words."""
        count = Counter(x.answer for x in self.answers)
        return ", ".join(f"{count[name]} {name}" for name in ANSWERS)


def answered_rows(
    files: Sequence[AnswerFile], recordings: Mapping[str, ExplainedPairs]
) -> list[tuple[ExplainedPairs, Answered]]:
    """Returns the evidence about the people of each file, and the rows of it about which the file tells.

    recordings: evidence by the name of the recording. Raises InputError if a file is about other people, or names
    people or stretches that its recording does not have.
    """
    return [(pairs, _rows(file, pairs)) for file in files for pairs in [_recording_of(file, recordings)]]


def _recording_of(file: AnswerFile, recordings: Mapping[str, ExplainedPairs]) -> ExplainedPairs:
    for pairs in recordings.values():
        if pairs.people == file.people:
            return pairs
    known = ", ".join(f"{name}, {counted(pairs.length, 'frame')}" for name, pairs in recordings.items())
    got = f"other people: of {file.recording}, {counted(file.frames, 'frame')}"
    remedy = "give the source or the tracks of the page, with the options of `view`, as its --camera"
    raise InputError(file=file.path, place="people", got=got, expected=f"those of {known}", remedy=remedy)


def _rows(file: AnswerFile, pairs: ExplainedPairs) -> Answered:
    known, rows = set(pairs.ids.tolist()), list[np.ndarray]()
    told = [(k, x) for k, x in enumerate(file.answers) if x.answer != ANSWERS[2]]
    time = pairs.step * pairs.size / pairs.fps
    half = 0.5 / pairs.fps
    for k, x in told:
        low, high = sorted((x.a, x.b))
        if not {low, high} <= known:
            got = f"person {min({low, high} - known)}"
            raise InputError(file=file.path, place=f"answers[{k}]", got=got, expected="known people", remedy=AGAIN)
        found = (pairs.a == low) & (pairs.b == high) & (time > x.start - half) & (time < x.end + half)
        rows.append(np.flatnonzero(found))
        if not len(rows[-1]):
            got = f"{low} and {high} from {x.start:g} to {x.end:g} s"
            expected = "a stretch in which the two are within 4 m of each other"
            raise InputError(file=file.path, place=f"answers[{k}]", got=got, expected=expected, remedy=AGAIN)
    question = np.repeat(np.arange(len(rows)), [len(x) for x in rows])
    together = np.array([x.answer == ANSWERS[0] for _, x in told])
    return Answered(np.concatenate(rows), question, together[question])
