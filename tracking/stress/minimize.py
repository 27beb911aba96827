"""Delta debugging: the smallest scenario in which a tracker still fails.

Pieces of one kind (tracking.stress.reductions) are taken out in chunks: all of them, halves, quarters, down to single
ones. What is left is kept if the tracker still fails with the scene's own seed, and with enough of the confirming
seeds; else the chunk is put back. All kinds are tried again until no single piece can be taken out (1-minimal).

Drawn groups are replaced by those of the scene's own seed once the tracker still fails with them. A piece that is
taken out of the script then leaves all others where they are.

The confirming seeds are the N after the scene's own. As many of them as fail at the start must fail after each step. A
result is then played on N seeds that the search has not seen. If fewer than 80 % of these fail (or than the share at
the start, if that is less), they become confirming seeds, too, and the search goes on from the last accepted scene that
holds on all. After three rounds it stops there. The seeds on which the last result is shown are always new.

Episodes depend on scenario and seed only. No episode is played twice.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from scenarios.errors import WorkError
from scenarios.loading.toml_files import dump
from scenarios.schema.scenario import Scenario
from tracking.stress import reductions
from tracking.stress.failures import Failure, Judgement
from tracking.stress.reductions import Piece, pinned, without

Stage = Callable[[Scenario], list[Piece]]

# The kinds of pieces, in the order in which they are taken out.
STAGES: tuple[Stage, ...] = (
    reductions.script, reductions.seconds, reductions.beginning, reductions.obstacles, reductions.difficulties,
    reductions.people, reductions.details,
)  # fmt: skip

ALLOWED = 5  # one of so many confirming seeds may not fail
ROUNDS = 3  # of fresh seeds


def _most(seeds: int) -> int:
    return seeds - seeds // ALLOWED


# Plays an episode of a scenario with a seed; the last is the number of the suite's copy that the scenario is.
Play = Callable[[Scenario, int, int], Judgement]


class BudgetSpentError(Exception):
    """No episode or no time is left; caught by `Minimizer.run`."""


@dataclass
class Minimizer:
    """The search for a smallest scene.

    State: `trail`, the accepted scenes from the first to the smallest; `guard`, the confirming seeds; `required`, how
    many of them must fail; `missed`, how often each did not; `known`, the outcomes by scenario and seed; `first`, that
    of the scene at the start; `played`, the number of episodes; `complete`, True if no single piece can be taken out.
    """

    play: Play
    failure: Failure
    seed: int
    confirm: int
    episodes: int | None = None  # budget
    minutes: float | None = None
    trail: list[Scenario] = field(default_factory=list)
    guard: list[int] = field(default_factory=list)
    required: int = 0
    missed: Counter[int] = field(default_factory=Counter)
    known: dict[tuple[str, int], Judgement] = field(default_factory=dict)
    first: Judgement = Judgement()
    played: int = 0
    complete: bool = False
    _end: float = float("inf")

    @property
    def smallest(self) -> Scenario:
        """The smallest accepted scene."""
        return self.trail[-1]

    def run(self, scenario: Scenario, repeat: int = 0) -> None:
        """Searches until no piece can be taken out and fresh seeds confirm the scene, or the budget is spent.

        The result is `smallest`. Raises WorkError if the tracker does not fail on the scene. repeat: number of the copy
        of the suite's entry that the scene is; it counts for the first scene only.
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
        """Returns `confirm` seeds that the search has not used, those after the greatest used one."""
        first = self.seed + len(self.guard) + 1
        return list(range(first, first + self.confirm))

    def _start(self, scenario: Scenario, repeat: int) -> None:
        outcome = self.play(scenario, self.seed, repeat)
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
        starts = [s for s in (fixed, scenario) if s is not None and self.fails(s, self.seed)]
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

    def _holds_on_fresh_seeds(self) -> bool:
        """Returns True if enough fresh seeds fail; else they confirm, too, and the search is back where all hold."""
        fresh = self.fresh_seeds()
        enough = min(_most(len(fresh)), self.required * len(fresh) // max(len(self.guard), 1))
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
            changed = self._accept(pinned(self.smallest, self.seed))  # drawn groups become those of the own seed
            for stage in STAGES:
                changed |= self._reduce(stage)
        self.complete = True

    def _reduce(self, stage: Stage) -> bool:
        """Takes out all pieces of one kind that can be; returns True if there were any."""
        pieces = stage(self.smallest)
        size, before = len(pieces), self.smallest
        while size:
            first = 0
            while first < len(pieces):
                if self._accept(without(self.smallest, pieces[first : first + size])):
                    pieces = stage(self.smallest)
                else:
                    first += size
            size //= 2
        return self.smallest is not before

    def _accept(self, scenario: Scenario | None) -> bool:
        """Makes a scene the smallest if it is another one and the tracker fails on it; returns True if it did."""
        if scenario is None or scenario == self.smallest:
            return False
        accepted = self.fails(scenario, self.seed) and self._confirmed(scenario)
        self.trail += [scenario] * accepted
        return accepted

    def _confirmed(self, scenario: Scenario) -> bool:
        """Returns True if enough confirming seeds fail; stops as soon as that is decided."""
        failed, left = 0, len(self.guard)
        for seed in sorted(self.guard, key=lambda seed: -self.missed[seed]):  # those that decide soonest first
            if not failed < self.required <= failed + left:
                break
            fails = self.fails(scenario, seed)
            failed, left = failed + fails, left - 1
            self.missed[seed] += not fails
        return failed >= self.required

    def _count(self, scenario: Scenario, seeds: Iterable[int]) -> int:
        return sum(self.fails(scenario, seed) for seed in seeds)

    def fails(self, scenario: Scenario, seed: int) -> bool:
        """Returns True if the tracker fails, in the way that is searched for, on a scene with this seed."""
        outcome = self.outcome(scenario, seed)
        return outcome.problem is None and self.failure.holds(outcome)

    def outcome(self, scenario: Scenario, seed: int, budget: bool = True) -> Judgement:
        """Returns the outcome of an episode, which is played if it is not known yet.

        Raises BudgetSpentError if it must be played and the budget is spent; budget: False plays it all the same.
        """
        key = dump(scenario), seed
        if key not in self.known:
            if budget and (time.monotonic() > self._end or self.played == self.episodes):
                raise BudgetSpentError
            self.known[key] = self.play(scenario, seed, 0)
            self.played += 1
        return self.known[key]
