"""Who has won, and what was gained: judged on scenes on which nothing was searched.

The few best of training are played on the validation scenes, beside the defaults; the best there wins, not the luckiest
in training. What the winner changed without gain there is taken back, parameter by parameter. Winner and defaults are
then played on the test scenes, and on those of a suite that was not used; those figures are the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scenarios.errors import FlockscopeError
from tracking.config import Config
from tracking.environment.episodes import Episode, Source
from tracking.stats import paired
from tracking.tuning.goals import Goal
from tracking.tuning.parallel_episodes import Play
from tracking.tuning.search_plan import Plan, every_score

SHOWN = ("objective", "HOTA", "group_F1_hull", "pairwise_F1", "event_F1")
"""Scores that are compared beside the goals."""

Episodes = Sequence[Episode]
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """A score before and after, means over the sequences where both are known, and the 95 % interval of the difference.

    better: whether more is better; sure: the interval does not reach 0.
    """

    scenes: str
    key: str
    higher: bool
    before: float
    after: float
    difference: float
    low: float
    high: float
    sequences: int

    @property
    def verdict(self) -> str:
        """better, worse, or no sure difference."""
        if not (self.low > 0 or self.high < 0):
            return "no sure difference"
        return "better" if (self.difference > 0) == self.higher else "worse"

    def line(self) -> str:
        """In one line."""
        ends = f"[{self.low:+.4f}, {self.high:+.4f}]"
        change = f"{self.before:.4f} → {self.after:.4f}, {self.difference:+.4f} {ends}"
        return f"{self.scenes}: {self.key} {change}, {self.sequences} sequences: {self.verdict}"


@dataclass(frozen=True)
class Candidate:
    """A config that was good in training: its trial, its value there, what it reached on the validation scenes, and
    how that is beside the defaults by the first goal."""

    trial: int
    config: Config
    training: tuple[float, ...]
    validation: tuple[float, ...] = ()
    gain: Comparison | None = None


@dataclass(frozen=True)
class Judge:
    """Plays and compares. tell: is told what is being done."""

    plan: Plan
    play: Play
    tell: Tell = field(default=lambda text: None)

    def validated(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """The candidates with what they reach on the validation scenes, the first being the defaults; others that
        cannot be played there are left out."""
        found, goals = list[Candidate](), self.plan.goals
        first: Episodes = ()
        for k, one in enumerate(candidates):
            self.tell(f"validation, {k + 1} of {len(candidates)}")
            episodes = self._all(self.plan.validating, one.config, every_score(self.plan))
            if isinstance(episodes, FlockscopeError):
                if k == 0:
                    raise episodes
                continue
            first = first or episodes
            reached = tuple(goal.mean(episodes) for goal in goals)
            found.append(replace(one, validation=reached, gain=comparison("validation", goals[0], first, episodes)))
        return found

    def simplified(self, config: Config, value: float, order: Sequence[str]) -> tuple[Config, float]:
        """The config with the parameters of `order`, one after the other, back at their defaults where that costs
        nothing on the validation scenes; and what it reaches there."""
        goal = self.plan.goals[0]
        changed = [name for name in order if getattr(config, name) != self.plan.defaults[name]]
        for k, name in enumerate(changed):
            self.tell(f"taking back what brings nothing, {k + 1} of {len(changed)}")
            try:
                simpler = type(config).from_dict({**config.as_dict(), name: self.plan.defaults[name]})
            except FlockscopeError:
                continue
            episodes = self._all(self.plan.validating, simpler, every_score(self.plan))
            if isinstance(episodes, FlockscopeError):
                continue
            reached = goal.mean(episodes)
            if goal.gain(value, reached) >= 0:
                config, value = simpler, reached
        return config, value

    def compared(self, config: Config) -> tuple[list[Comparison], list[str]]:
        """The defaults and this config on every set of test scenes, by the goals and by SHOWN; and where this config
        cannot be played, in words."""
        found, notes = list[Comparison](), list[str]()
        for name, sources in self.plan.testing.items():
            self.tell(f"test on {name}")
            before = self._all(sources, self.plan.base, every=True)
            if isinstance(before, FlockscopeError):
                raise before
            after = self._all(sources, config, every=True)
            if isinstance(after, FlockscopeError):
                notes.append(f"{name}: cannot be played with the new parameters: {after.line()}")
                continue
            found += [c for goal in self._shown() if (c := comparison(name, goal, before, after)) is not None]
        return found, notes

    def _shown(self) -> list[Goal]:
        keys = [goal.key for goal in self.plan.goals]
        return [*self.plan.goals, *(Goal(key) for key in SHOWN if key not in keys)]

    def _all(self, sources: Sequence[Source], config: Config, every: bool) -> list[Episode] | FlockscopeError:
        """All episodes, or the error by which there is one that cannot be played so; errors of who plays are raised."""
        found = []
        for answer in self.play(sources, config.as_dict(), every):
            if isinstance(answer, FlockscopeError):
                return answer
            found.append(answer)
        return found


def comparison(scenes: str, goal: Goal, before: Episodes, after: Episodes) -> Comparison | None:
    """Both on the same sequences; None where the score is nowhere known of both."""
    a, b = (np.array([goal.of(e) for e in episodes]) for episodes in (before, after))
    known = np.isfinite(a) & np.isfinite(b)
    if not known.any():
        return None
    a, b = a[known][:, None], b[known][:, None]
    difference, low, high = (float(end[0]) for end in paired(a, b))
    return Comparison(
        scenes, goal.key, goal.higher, float(a.mean()), float(b.mean()), difference, low, high, int(known.sum())
    )


def front(candidates: Sequence[Candidate], goals: Sequence[Goal]) -> list[Candidate]:
    """Those that no other one beats by all goals, of equals the first; best of the first goal first."""

    def beats(one: Candidate, other: Candidate) -> bool:
        gains = [g.gain(b, a) for g, a, b in zip(goals, one.validation, other.validation, strict=True)]
        return min(gains) >= 0 and max(gains) > 0

    kept = {c.validation: c for c in reversed(candidates) if not any(beats(other, c) for other in candidates)}
    return sorted(kept.values(), key=lambda c: goals[0].gain(c.validation[0], 0.0))
