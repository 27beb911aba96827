"""Plays candidates on held-out scenes, which the search did not use: validation scenes first, then test scenes.

`HeldOutEvaluator.validated` plays the best trials on the validation scenes. `simplified` resets the parameters of the
winner that bring nothing there. `compared` measures the gain on the test scenes. `stored_in_study` keeps the episodes
in the study, so that a search that was killed after its last trial does not play them again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Generator, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from scenarios.errors import FlockscopeError
from tracking.config import Config
from tracking.environment.episodes import Episode, Source
from tracking.tuning.comparison import Candidate, Comparison, compare_episodes
from tracking.tuning.goals import Goal
from tracking.tuning.parallel_episodes import EpisodeOrError, PlayEpisodes
from tracking.tuning.search_plan import SearchPlan

if TYPE_CHECKING:
    from tracking.tuning.study import SearchStudy

# Scores that are compared on the test scenes beside the goals.
COMPARED_KEYS = ("objective", "HOTA", "group_F1", "pairwise_F1", "event_F1")

STORED = "judged "  # Prefix of the study attributes in which episodes are stored.


@dataclass(frozen=True)
class HeldOutEvaluator:
    """Plays configs on the validation and test scenes, which the search did not use."""

    plan: SearchPlan
    play: PlayEpisodes
    report: Callable[[str], None] = field(default=lambda text: None)

    def validated(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Returns the candidates that can be played, with validation values and gain over the first, the defaults."""
        found = list[Candidate]()
        defaults: Sequence[Episode] = ()
        for k, candidate in enumerate(candidates):
            self.report(f"validation, {k + 1} of {len(candidates)}")
            episodes = self._episodes(self.plan.validation, candidate.config, self.plan.needs_every_score)
            if isinstance(episodes, FlockscopeError):
                if k == 0:
                    raise episodes
                continue
            defaults = defaults or episodes
            values = tuple(goal.mean(episodes) for goal in self.plan.goals)
            gain = compare_episodes("validation", self.plan.goals[0], defaults, episodes)
            found.append(replace(candidate, validation=values, gain=gain))
        return found

    def simplified(self, config: Config, value: float, order: Sequence[str]) -> tuple[Config, float]:
        """Returns the config without changes that bring nothing in validation, tried in `order`, and its value."""
        goal = self.plan.goals[0]
        changed = [name for name in order if getattr(config, name) != self.plan.defaults[name]]
        for k, name in enumerate(changed):
            self.report(f"resetting changes without gain, {k + 1} of {len(changed)}")
            try:
                simpler = type(config).from_dict({**config.as_dict(), name: self.plan.defaults[name]})
            except FlockscopeError:
                continue
            episodes = self._episodes(self.plan.validation, simpler, self.plan.needs_every_score)
            if isinstance(episodes, FlockscopeError):
                continue
            reached = goal.mean(episodes)
            if goal.gain(value, reached) >= 0:
                config, value = simpler, reached
        return config, value

    def compared(self, config: Config) -> tuple[list[Comparison], list[str]]:
        """Returns the comparisons of the config with the defaults, suite by suite of the tests, and notes (texts)."""
        found, notes = list[Comparison](), list[str]()
        for name, sources in self.plan.tests.items():
            self.report(f"test on {name}")
            before = self._episodes(sources, self.plan.base, every_score=True)
            if isinstance(before, FlockscopeError):
                raise before
            after = self._episodes(sources, config, every_score=True)
            if isinstance(after, FlockscopeError):
                notes.append(f"{name}: cannot be played with the new parameters: {after.line()}")
                continue
            made = [compare_episodes(name, goal, before, after) for goal in self._compared_goals()]
            found += [comparison for comparison in made if comparison is not None]
        return found, notes

    def _compared_goals(self) -> list[Goal]:
        keys = [goal.key for goal in self.plan.goals]
        return [*self.plan.goals, *(Goal(key) for key in COMPARED_KEYS if key not in keys)]

    def _episodes(
        self, sources: Sequence[Source], config: Config, every_score: bool
    ) -> list[Episode] | FlockscopeError:
        found = []
        for result in self.play(sources, config.as_dict(), every_score):
            if isinstance(result, FlockscopeError):
                return result
            found.append(result)
        return found


def stored_in_study(study: SearchStudy, play: PlayEpisodes) -> PlayEpisodes:
    """Returns a function like `play` that stores complete sets of episodes in the study and takes them from there."""
    kept = {*COMPARED_KEYS, *(goal.key for goal in study.plan.goals)}

    def stored(
        sources: Sequence[Source], values: dict[str, Any], every_score: bool
    ) -> Generator[EpisodeOrError, None, None]:
        key = STORED + _digest([source.key for source in sources], values, every_score)
        known = study.optuna.user_attrs.get(key)
        if known is not None:
            yield from (Episode(*fields) for fields in known)
            return
        played = []
        for result in play(sources, values, every_score):
            if isinstance(result, FlockscopeError):
                yield result
                return
            played.append(replace(result, scores={k: v for k, v in result.scores.items() if k in kept}))
            yield played[-1]
        study.optuna.set_user_attr(key, [astuple(episode) for episode in played])

    return stored


def _digest(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, default=str).encode()).hexdigest()[:16]
