"""Delta debugging: the smallest scenario in which a tracker still fails.

Pieces of one kind (tracking.stress.reductions) are taken out in chunks: all of them, halves, quarters, down to single
ones. What is left is kept if the tracker still fails with the scene's own seed, and with enough of the confirming
seeds; else the chunk is put back. All kinds are tried again until no single piece can be taken out (1-minimal).

Groups that are drawn are replaced by those of the own seed as soon as the tracker still fails then. A piece that is
taken out of the script then leaves all others where they are.

The confirming seeds are the N after the own one. As many of them as fail at the start must fail after each step. A
result is then played on N seeds that the search has not seen. If fewer than 80 % of these fail (or than the share at
the start, if that is less), they become confirming seeds, too, and the search goes on from the last accepted scene that
holds on all. After three rounds it stops there. The seeds on which the last result is shown are always new.

Episodes depend on scenario and seed only. No episode is played twice, and workers do not change the result.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field

from scenarios.errors import WorkError, counted
from scenarios.loading.toml_files import dump
from scenarios.schema.scenario import Scenario
from tracking.stress.failures import EpisodeOf, Failure, Outcome, Subject
from tracking.stress.reductions import STAGES, Piece, Stage, pinned, without

ALLOWED = 5  # one of so many confirming seeds may not fail
ROUNDS = 3  # of fresh seeds


def _most(seeds: int) -> int:
    return seeds - seeds // ALLOWED


# Yields one outcome for each episode, in order, when it is asked for; may be closed before the end.
PlayEpisodes = Callable[[Sequence[EpisodeOf]], Generator[Outcome]]


class BudgetSpentError(Exception):
    """No episode or no time is left; caught by `Search.run`."""


@dataclass
class Search:
    """The search for a smallest scene.

    State: `trail`, the accepted scenes from the first to the smallest; `guard`, the confirming seeds; `required`, how
    many of them must fail; `missed`, how often each did not; `known`, the outcomes by scenario and seed; `first`, that
    of the scene at the start; `played`, the number of episodes; `complete`, True if no single piece can be taken out.
    """

    subject: Subject
    failure: Failure
    seed: int
    confirm: int
    play: PlayEpisodes
    episodes: int | None = None  # budget
    minutes: float | None = None
    report: Callable[[str], None] = lambda text: None
    trail: list[Scenario] = field(default_factory=list)
    guard: list[int] = field(default_factory=list)
    required: int = 0
    missed: Counter[int] = field(default_factory=Counter)
    known: dict[tuple[str, int], Outcome] = field(default_factory=dict)
    first: Outcome = Outcome()
    played: int = 0
    complete: bool = False
    _end: float = float("inf")

    @property
    def smallest(self) -> Scenario:
        """The smallest accepted scene."""
        return self.trail[-1]

    def run(self, scenario: Scenario, repeat: int = 0) -> None:
        """Searches until a scene is smallest and confirmed, or the budget is spent.

        Raises WorkError if the tracker does not fail on the scene. repeat: number of the suite's copy that the scene
        is; smaller ones are copies of none.
        """
        if self.minutes is not None:
            self._end = time.monotonic() + 60 * self.minutes
        self._start(scenario, repeat)
        try:
            self.trail = [self._choose_start(scenario, repeat)]
            for _ in range(ROUNDS):
                self._minimise()
                if self._holds_on_fresh_seeds():
                    return
            self.complete = False
        except BudgetSpentError:
            self.complete = False

    def fresh_seeds(self) -> list[int]:
        """Returns the seeds after all that the search has used."""
        first = self.seed + len(self.guard) + 1
        return list(range(first, first + self.confirm))

    def _start(self, scenario: Scenario, repeat: int) -> None:
        (outcome,) = self.play([EpisodeOf(self.subject, self.failure, scenario, self.seed, repeat)])
        self.played, self.first = 1, outcome
        if outcome.problem is not None:
            raise outcome.problem
        if not self.failure.holds(outcome):
            raise WorkError(
                file=f"{scenario.name}, seed {self.seed}", place="--while", got=self.failure.found(outcome),
                expected=f"a scene with {self.failure.text}", remedy="choose another condition, or another seed",
            )  # fmt: skip
        self.trail = [scenario]
        if repeat == 0:
            self.known[dump(scenario), self.seed] = outcome

    def _choose_start(self, scenario: Scenario, repeat: int) -> Scenario:
        """Returns the scene or the one of fixed groups, on whichever more confirming seeds fail."""
        fixed = pinned(scenario, self.seed, repeat)
        starts = [s for s in (fixed, scenario) if s is not None and self._fails(s, self.seed)]
        if not starts:
            raise WorkError(
                file=f"{scenario.name}, seed {self.seed}", got=f"copy {repeat} of an entry with `repeat`",
                expected="a scene that fails as a scenario of its own, too", remedy="choose another sequence",
            )  # fmt: skip
        self.guard = [self.seed + 1 + k for k in range(self.confirm)]
        counts = [self._count(start, self.guard) for start in starts]
        chosen = 0 if counts[0] >= _most(len(self.guard)) else counts.index(max(counts))
        self.required = counts[chosen]
        return starts[chosen]

    def _enough(self, seeds: int) -> int:
        return min(_most(seeds), self.required * seeds // max(len(self.guard), 1))

    def _holds_on_fresh_seeds(self) -> bool:
        """Returns True if enough fresh seeds fail; else they confirm, too, and the search is back where all hold."""
        fresh = self.fresh_seeds()
        enough = self._enough(len(fresh))
        if self._count(self.smallest, fresh) >= enough:
            return True
        self.required += enough
        self.guard += fresh
        while len(self.trail) > 1 and not self._confirmed(self.smallest):
            self.trail.pop()
        return False

    def _minimise(self) -> None:
        self.complete = False
        changed = True
        while changed:
            changed = self._fix()
            for stage in STAGES:
                changed |= self._reduce(stage)
        self.complete = True

    def _fix(self) -> bool:
        """Replaces drawn groups by those of the own seed; returns True if the tracker still fails then."""
        fixed = pinned(self.smallest, self.seed)
        if fixed in (None, self.smallest) or not (self._fails(fixed, self.seed) and self._confirmed(fixed)):
            return False
        self.trail.append(fixed)
        return True

    def _reduce(self, stage: Stage) -> bool:
        """Takes out all pieces of one kind that can be; returns True if there were any."""
        pieces = stage(self.smallest)
        size, before = len(pieces), self.smallest
        while size:
            first = 0
            while first < len(pieces):
                starts = range(first, len(pieces), size)
                kept = self._first_that_holds([pieces[k : k + size] for k in starts])
                if kept is None:
                    break
                index, scenario = kept
                self.trail.append(scenario)
                pieces, first = stage(scenario), starts[index]
            size //= 2
        return self.smallest is not before

    def _first_that_holds(self, chunks: Sequence[list[Piece]]) -> tuple[int, Scenario] | None:
        candidates = ((k, without(self.smallest, chunk)) for k, chunk in enumerate(chunks))
        valid = [(k, scenario) for k, scenario in candidates if scenario not in (None, self.smallest)]
        while valid:
            outcomes = self.outcomes([(scenario, self.seed) for _, scenario in valid if scenario is not None])
            with closing(outcomes):
                failing = next((n for n, outcome in enumerate(outcomes) if self._failed(outcome)), None)
            if failing is None:
                return None
            index, scenario = valid[failing]
            assert scenario is not None
            if self._confirmed(scenario):
                return index, scenario
            valid = valid[failing + 1 :]
        return None

    def _confirmed(self, scenario: Scenario) -> bool:
        """Returns True if enough confirming seeds fail; stops as soon as that is decided."""
        failed, left = 0, len(self.guard)
        order = sorted(self.guard, key=lambda seed: -self.missed[seed])  # those that decide soonest first
        with closing(self.outcomes([(scenario, seed) for seed in order])) as outcomes:
            for seed in order:
                if not failed < self.required <= failed + left:
                    break
                fails = self._failed(next(outcomes))
                failed, left = failed + fails, left - 1
                self.missed[seed] += not fails
        return failed >= self.required

    def _count(self, scenario: Scenario, seeds: Iterable[int]) -> int:
        return sum(map(self._failed, self.outcomes([(scenario, seed) for seed in seeds])))

    def _fails(self, scenario: Scenario, seed: int) -> bool:
        return self._count(scenario, [seed]) == 1

    def _failed(self, outcome: Outcome) -> bool:
        return outcome.problem is None and self.failure.holds(outcome)

    def outcomes(self, wanted: Sequence[tuple[Scenario, int]], budget: bool = True) -> Generator[Outcome]:
        """Yields the outcomes in order; those that are not known yet are played when they are asked for.

        Raises BudgetSpentError if one must be played and the budget is spent; budget: False plays it all the same.
        """
        keys = [(dump(scenario), seed) for scenario, seed in wanted]
        missing = {key: one for key, one in zip(keys, wanted, strict=True) if key not in self.known}
        playing = self.play([EpisodeOf(self.subject, self.failure, *one) for one in missing.values()])
        try:
            for key in keys:
                if key not in self.known:
                    if budget and self._spent():
                        raise BudgetSpentError
                    self.known[key] = next(playing)
                    self.played += 1
                    self.report(f"{self.smallest.duration:g} s, {counted(len(self.smallest.group), 'group')}")
                yield self.known[key]
        finally:
            playing.close()  # before other episodes are given to the workers

    def _spent(self) -> bool:
        return time.monotonic() > self._end or (self.episodes is not None and self.played >= self.episodes)
