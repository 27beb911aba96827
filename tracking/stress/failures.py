"""When a tracker fails: a score beyond a bound, or an error of a kind; and one episode in which it may fail.

    HOTA<0.7         a score of the catalogue beyond a bound, by <, <=, > or >=; a perfect tracker must not be beyond it
    late split       a kind of error of `flockscope errors` that occurs at least once
    switch:hidden    an error of this kind with this cause
    crash            an error that the tracker raises

A score counts only where the oracle has it, too: a false group in a scene without true groups is no failure of
group_F1.

An error that the start explains does not count: it must last until its people have been in view for the time that a
tracker needs to report them, 0.5 s, or their group, 2 s. Else each failure would become a scene of a few frames.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from operator import ge, gt, le, lt
from typing import get_args

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.loading.toml_files import did_you_mean
from scenarios.schema.scenario import Scenario
from sim.truth.merge_split_rules import HOLD_TIME
from sim.types import Sequence, Truth
from tracking.errors import groups
from tracking.errors.causes import CAUSES, CONFIRMED, CUT
from tracking.errors.people import PersonError, PersonKind
from tracking.running.run import TrackingRun
from tracking.scoring.catalogue import CATALOGUE

OPERATORS: dict[str, Callable[[float, float], bool]] = {"<": lt, "<=": le, ">": gt, ">=": ge}
COMPARISON = re.compile(r"\s*([\w-]+)\s*(<=|>=|<|>)\s*(-?[0-9.]+)\s*")
CRASH = "crash"
KINDS = (*get_args(PersonKind), *groups.KINDS, CRASH)

Run = Callable[[Sequence], TrackingRun]  # Tracks a sequence.


@dataclass(frozen=True)
class Judgement:
    """The result of one episode: scores by key, errors, number of people, or the problem that prevents a judgement."""

    scores: Mapping[str, float] = field(default_factory=dict)
    errors: frozenset[tuple[str, str]] = frozenset()  # kinds and causes, if they were asked for
    people: int = 0
    problem: FlockscopeError | None = None  # why there is nothing to judge


@dataclass(frozen=True)
class Failure:
    """A condition on an episode: a score with its bound, or a kind of error, with or without a cause."""

    text: str
    score: str = ""
    beyond: str = ""
    bound: float = 0.0
    kind: str = ""
    cause: str = ""

    def holds(self, outcome: Judgement) -> bool:
        """Returns True if the tracker failed in this way: the score is beyond the bound, or such an error occurred."""
        if self.kind:
            return any(self.kind == kind and self.cause in ("", cause) for kind, cause in outcome.errors)
        return OPERATORS[self.beyond](outcome.scores.get(self.score, float("nan")), self.bound)

    def found(self, outcome: Judgement) -> str:
        """Returns in words what the episode shows: its problem, the errors that occurred, or the value of the score."""
        if outcome.problem is not None:
            return outcome.problem.line()
        if self.kind:
            every = sorted({kind if not self.cause else f"{kind}:{cause}" for kind, cause in outcome.errors})
            return f"errors: {', '.join(every) or 'none'}"
        return f"{self.score} = {outcome.scores.get(self.score, float('nan')):.4g}"


def parse_failure(text: str) -> Failure:
    """Returns the failure that a text of `--while` describes, such as "HOTA<0.7" or "switch:hidden". Raises InputError
    for any other text."""
    found = COMPARISON.fullmatch(text)
    expected = "SCORE<NUMBER (or <=, >, >=), a kind of error, or crash, as in HOTA<0.7, switch, switch:hidden"
    if found is None:
        kind, _, cause = (part.strip() for part in text.partition(":"))
        if kind not in KINDS:
            raise _wrong(text, expected, did_you_mean(kind, KINDS))
        if ":" in text and (cause not in CAUSES or kind == CRASH):
            raise _wrong(text, f"a cause: {', '.join(CAUSES)}", did_you_mean(cause, CAUSES))
        return Failure(text.strip(), kind=kind, cause=cause)
    score, beyond, number = found.groups()
    if score not in CATALOGUE:
        raise _wrong(text, "a score of docs/reference/metrics.md", did_you_mean(score, CATALOGUE, "choose one of them"))
    try:
        failure = Failure(f"{score}{beyond}{number}", score, beyond, float(number))
    except ValueError:
        raise _wrong(text, expected, "correct the number") from None
    _check_can_fail(failure)
    return failure


def _check_can_fail(failure: Failure) -> None:
    """Raises InputError for a condition that holds for a perfect tracker, too, or for no value of the score."""
    score, beyond = CATALOGUE[failure.score], OPERATORS[failure.beyond]
    worst, best = (score.low, score.high) if score.better == "higher" else (score.high, score.low)
    # A number of hits has no upper bound. It is small for a perfect tracker in a small scene.
    perfect = [best] if math.isfinite(best) else [worst, best]
    always = any(beyond(value, failure.bound) for value in perfect)
    if always or not beyond(worst, failure.bound):
        got = f"{failure.text!r}, true of {'a perfect' if always else 'no'} tracker"
        if not math.isfinite(best):
            expected, remedy = "a score with a best value", "give a share, such as HOTA<0.7"
        else:
            sign = "<" if score.better == "higher" else ">"
            expected = f"{score.key}{sign}NUMBER, with a number from {score.low:g} to {score.high:g}"
            example = best - 0.3 if score.better == "higher" else best + 2
            remedy = f"write {score.key}{sign}{example:g}"
        raise _wrong(failure.text, expected, remedy, got)


def _wrong(text: str, expected: str, remedy: str, got: str = "") -> InputError:
    return InputError(place="--while", got=got or repr(text), expected=expected, remedy=remedy)


def play_episode(
    run: Run, streams: Iterable[str], failure: Failure, scenario: Scenario, seed: int, repeat: int = 0
) -> Judgement:
    """Simulates a scene, tracks it with `run`, and returns scores and errors as far as `failure` needs them.

    streams: the pictures to draw. repeat: number of the copy in the suite. `problem` of the result is set if an order
    of the script does not come true, or if the tracker raises an error and the failure is not "crash".
    """
    from sim.sequence import simulate
    from tracking.comparison import scorer_of
    from tracking.oracle import oracle

    try:
        sequence = simulate(scenario, seed, repeat, streams)
        truth = sequence.truth  # raises for a script that did not come true before anything is tracked
        assert truth is not None, "a simulated sequence has labels"
        people = len({*truth.id.tolist()})
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                tracked = run(sequence)
        except WorkError:
            if failure.kind != CRASH:
                raise
            return Judgement({}, frozenset([(CRASH, "")]), people)
        with scorer_of(sequence) as scorer:
            scores = {key: value for key, value in scorer.evaluate(tracked).items() if value == value}
            if failure.score and failure.holds(Judgement(scores)):
                best = scorer.evaluate(oracle(sequence, tracked.info))[failure.score]
                scores = {key: value for key, value in scores.items() if key != failure.score or best == best}
        return Judgement(scores, _errors(failure, sequence, truth, tracked), people)
    except FlockscopeError as error:
        return Judgement(problem=error)


def _errors(failure: Failure, sequence: Sequence, truth: Truth, run: TrackingRun) -> frozenset[tuple[str, str]]:
    from tracking.errors.found import errors_of_run, find_errors

    if failure.kind in ("", CRASH):
        return frozenset()
    # Only causes need the oracle, which says who was detected.
    quick = not failure.cause and all(t.unit == "person" for t in run)
    found = (find_errors if quick else errors_of_run)(sequence, run, costs=0, causes=False)
    return frozenset((one.error.kind, one.cause.name) for one in found.errors if _outlasts_start(one.error, truth))


def _outlasts_start(error: PersonError | groups.GroupError, truth: Truth) -> bool:
    """Returns True if an error goes on when its people have been in view for long enough to be reported."""
    people, time = ((error.person,), CONFIRMED) if isinstance(error, PersonError) else (error.people, HOLD_TIME)
    inside = truth.truncation is None or truth.truncation <= CUT
    seen = (truth.frame[(truth.id == person) & inside].tolist() for person in people)  # a ghost concerns nobody
    return error.end - max((min(frames, default=0) for frames in seen), default=0) >= time * truth.fps
