"""The candidates of a search: finished trials that are played again on held-out scenes, which the search did not use.

The goals of a search are scores of the catalogue, each with the direction that is better, and speed. A goal turns one
episode into one number, and many episodes into one mean.

Validation scenes come first, then test scenes. `HeldOutEvaluator.validated` plays the best trials on the validation
scenes. `simplified` resets the parameters of the winner that bring nothing there. `compared` measures the gain on the
test scenes, as paired comparisons with the defaults. The study keeps the episodes, so that a search that was killed
after its last trial does not play them again.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scenarios.errors import FlockscopeError, InputError, WorkError, counted
from scenarios.loading.toml_files import did_you_mean
from sim.dataset.generate import LEFT_OUT
from tracking.config import Config
from tracking.episodes.episode import Episode, Source
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import FEWEST, few, mean_of_known, paired

if TYPE_CHECKING:
    import optuna

    from tracking.tuning.episode_player import PlayEpisodes
    from tracking.tuning.search_plan import SearchPlan

SPEED = "frames/s"  # Key of the tracker's speed. It is the only goal that differs between two runs of the same episode.

# Scores that every episode has; other scores need the whole catalogue to be computed.
FAST_KEYS = ("objective", "HOTA", "group_F1")


@dataclass(frozen=True)
class Goal:
    """One score to improve."""

    key: str  # in the catalogue of scores, or "frames/s" for the tracker's speed
    higher: bool = True  # True if greater values are better

    def of(self, episode: Episode) -> float:
        """Returns the score of one episode, nan if the episode does not have it."""
        if self.key == SPEED:
            return episode.frames / episode.seconds_tracking if episode.seconds_tracking else float("nan")
        return episode.scores.get(self.key, float("nan"))

    def mean(self, episodes: Sequence[Episode]) -> float:
        """Returns the mean over the episodes that have the score, nan if none has; for "frames/s" all frames over all
        seconds."""
        if self.key == SPEED:
            seconds = sum(e.seconds_tracking for e in episodes)
            return sum(e.frames for e in episodes) / seconds if seconds else float("nan")
        return mean_of_known(self.of(e) for e in episodes)

    def gain(self, before: float, after: float) -> float:
        """Returns by how much the value `after` is better than `before`, negative if worse, nan if one is nan."""
        return after - before if self.higher else before - after


def goals_of(keys: Iterable[str]) -> tuple[Goal, ...]:
    """Returns one goal per different key, in the order given; the catalogue says which direction is better. Raises
    InputError for an unknown key, or a score of which neither direction is better."""
    found: list[Goal] = []
    allowed = [SPEED, *(key for key, score in CATALOGUE.items() if score.better != "neither")]
    for key in dict.fromkeys(keys):
        if key not in allowed:
            remedy = did_you_mean(key, allowed, "choose another:") + " docs/reference/metrics.md lists them"
            expected = f"a score with a better direction, or {SPEED}"
            raise InputError(place="--objective", got=key, expected=expected, remedy=remedy)
        found.append(Goal(key, key == SPEED or CATALOGUE[key].better == "higher"))
    return tuple(found)


@dataclass(frozen=True)
class TrialRecord:
    """A finished trial of a search: one set of parameters, played on the training scenes."""

    number: int  # its place in the search, 0 for the defaults
    values: tuple[float, ...]  # one per goal; empty if its parameters are impossible
    params: dict[str, Any]  # of each searched parameter by name
    error: str = ""  # why its parameters are impossible


@dataclass(frozen=True)
class Comparison:
    """One score of the defaults and of a tuned config on the same sequences, in the unit of the score."""

    scenes: str  # name of the suite, or "validation"
    key: str
    higher: bool  # True if greater values are better
    before: float  # mean of the defaults over the sequences where both have the score; of "frames/s", of the speeds
    after: float  # likewise of the config
    difference: float  # mean of after - before
    low: float  # of its 95 % interval; nan with fewer than two sequences
    high: float
    sequences: int  # number of these sequences

    @property
    def verdict(self) -> str:
        """How `after` compares: "better" or "worse" if the interval over at least 6 sequences excludes 0, else "no sure
        difference"."""
        if self.indicative or not (self.low > 0 or self.high < 0):
            return "no sure difference"
        return "better" if (self.difference > 0) == self.higher else "worse"

    @property
    def indicative(self) -> bool:
        """True if the interval is only indicative: of fewer than 6 sequences."""
        return bool(few(self.sequences))

    @property
    def difference_words(self) -> str:
        """The difference and its interval as text; "(no interval)" stands for an interval with an unknown end."""
        known = math.isfinite(self.low) and math.isfinite(self.high)
        ends = f" [{self.low:+.4f}, {self.high:+.4f}]" + ", indicative" * self.indicative if known else " (no interval)"
        return f"{self.difference:+.4f}{ends}"

    def line(self) -> str:
        """Returns the comparison as one line: scenes, score, both means, difference, number of sequences, verdict."""
        change = f"{self.before:.4f} → {self.after:.4f}, {self.difference_words}"
        return f"{self.scenes}: {self.key} {change}, {counted(self.sequences, 'sequence')}: {self.verdict}"


@dataclass(frozen=True)
class Candidate:
    """A config that was good in training, or the defaults."""

    trial: int  # number of its trial, 0 for the defaults
    config: Config
    training: tuple[float, ...]  # values, one per goal
    validation: tuple[float, ...] = ()  # () if not played
    gain: Comparison | None = None  # of the first goal over the defaults in validation; None if not played or unknown


def compare_episodes(scenes: str, goal: Goal, before: Sequence[Episode], after: Sequence[Episode]) -> Comparison | None:
    """Returns the comparison of a goal's values, paired by sequence; None if no pair is finite. before, after: episodes
    of the defaults and of the config on the same sequences, in one order. Pairs that are not finite are left out."""
    a, b = (np.array([goal.of(e) for e in episodes]) for episodes in (before, after))
    known = np.isfinite(a) & np.isfinite(b)
    if not known.any():
        return None
    a, b = a[known][:, None], b[known][:, None]
    ends = [float(end[0]) for end in paired(a, b)]
    cut = CATALOGUE[goal.key].within(np.array(ends), difference=True).tolist() if goal.key in CATALOGUE else ends
    difference, low, high = cut
    return Comparison(
        scenes, goal.key, goal.higher, float(a.mean()), float(b.mean()), difference, low, high, int(known.sum())
    )


def too_few(scenes: int) -> str:
    """Returns why nothing is sure on so few validation scenes, and what helps."""
    known = f"with {counted(scenes, 'validation scene')}, fewer than {FEWEST}"
    return f"{known}, no gain is sure; give more --validation seeds"


def pareto_front(candidates: Sequence[Candidate], goals: Sequence[Goal]) -> list[Candidate]:
    """Returns the candidates that no other dominates on the validation scenes, sorted by the first goal, best first. Of
    candidates with equal values the first counts; candidates with a value of nan are left out."""
    known = [c for c in candidates if not np.isnan(c.validation).any()]  # nothing is known of the others' rank

    def dominates(one: Candidate, other: Candidate) -> bool:
        gains = [g.gain(b, a) for g, a, b in zip(goals, one.validation, other.validation, strict=True)]
        return min(gains) >= 0 and max(gains) > 0

    kept = {c.validation: c for c in reversed(known) if not any(dominates(other, c) for other in known)}
    return sorted(kept.values(), key=lambda c: goals[0].gain(c.validation[0], 0.0))


# Scores that are compared on the test scenes beside the goals.
COMPARED_KEYS = ("objective", "HOTA", "group_F1", "pairwise_F1", "event_F1")

STORED = "judged "  # Prefix of the study attributes in which episodes are stored.


@dataclass(frozen=True)
class HeldOutEvaluator:
    """Plays configs on the validation and test scenes, which the search did not use.

    State: scenes, the keys of all scenes counted so far; left_out, by key, one line for each scene that was left out
    because its script did not come true.
    """

    plan: SearchPlan
    play: PlayEpisodes
    study: optuna.Study
    report: Callable[[str], None] = field(default=lambda text: None)
    scenes: set[object] = field(default_factory=set)
    left_out: dict[object, str] = field(default_factory=dict)

    def validated(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Returns the candidates that can be played, with `validation` (values) and `gain` filled in. The first
        candidate must be the defaults; gains are over them. Raises their error if they cannot be played."""
        found = list[Candidate]()
        defaults: Sequence[Episode] = ()
        for k, candidate in enumerate(candidates):
            self.report(f"validation, {k + 1} of {len(candidates)}")
            episodes = self._validation(candidate.config)
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
        """Returns the config with changed parameters reset to the default where validation is no worse, and its value.
        value: the config's mean of the first goal on the validation scenes. order: names in the order to try."""
        goal = self.plan.goals[0]
        changed = [name for name in order if getattr(config, name) != self.plan.defaults[name]]
        for k, name in enumerate(changed):
            self.report(f"resetting changes without gain, {k + 1} of {len(changed)}")
            try:
                simpler = type(config).from_dict({**config.as_dict(), name: self.plan.defaults[name]})
            except FlockscopeError:
                continue
            episodes = self._validation(simpler)
            if not isinstance(episodes, FlockscopeError) and goal.gain(value, goal.mean(episodes)) >= 0:
                config, value = simpler, goal.mean(episodes)
        return config, value

    def compared(self, config: Config) -> tuple[list[Comparison], list[str]]:
        """Returns the comparisons of the config with the defaults on the test scenes, one per suite and score. Also
        returns notes: one text for each suite that cannot be played with the config."""
        found, notes = list[Comparison](), list[str]()
        keys = [goal.key for goal in self.plan.goals]
        goals = [*self.plan.goals, *(Goal(key) for key in COMPARED_KEYS if key not in keys)]
        for name, sources in self.plan.tests.items():
            self.report(f"test on {name}")
            before = self._episodes(sources, self.plan.base, every_score=True)
            if isinstance(before, FlockscopeError):
                raise before
            after = self._episodes(sources, config, every_score=True)
            if isinstance(after, FlockscopeError):
                notes.append(f"{name}: cannot be played with the new parameters: {after.line()}")
                continue
            made = [compare_episodes(name, goal, before, after) for goal in goals]
            found += [comparison for comparison in made if comparison is not None]
        return found, notes

    def episodes(self, sources: Sequence[Source], config: Config) -> list[Episode] | FlockscopeError:
        """Returns the config's episodes on the validation scenes or those of a test; or the error of a config that
        cannot be played."""
        return self._episodes(sources, config, sources != self.plan.validation or self.plan.needs_every_score)

    def _validation(self, config: Config) -> list[Episode] | FlockscopeError:
        return self._episodes(self.plan.validation, config, self.plan.needs_every_score)

    def _episodes(
        self, sources: Sequence[Source], config: Config, every_score: bool
    ) -> list[Episode] | FlockscopeError:
        """Returns one episode per source, stored in the study; or the error of a config that cannot be played."""
        parts = ([source.key for source in sources], config.as_dict(), every_score)
        key = STORED + hashlib.sha256(json.dumps(parts, default=str).encode()).hexdigest()[:16]
        found = [Episode(*fields) for fields in self.study.user_attrs.get(key, ())]
        if not found:
            kept = {*COMPARED_KEYS, *(goal.key for goal in self.plan.goals)}
            for result in self.play(sources, config.as_dict(), every_score):
                if isinstance(result, FlockscopeError):
                    return result
                found.append(replace(result, scores={k: v for k, v in result.scores.items() if k in kept}))
            self.study.set_user_attr(key, [astuple(episode) for episode in found])
        self.count(sources, [episode.left_out for episode in found])
        return found

    def count(self, sources: Sequence[Source], reasons: Sequence[str]) -> None:
        """Counts the sources as scenes; reasons: for each source why it was left out, "" if it was not."""
        self.scenes.update(source.key for source in sources)
        for source, reason in zip(sources, reasons, strict=True):
            if reason:
                self.left_out[source.key] = f"{source.name} seed {source.seed}: {reason}"

    def require_most(self) -> None:
        """Raises WorkError if more than 5 % of the counted scenes were left out."""
        if len(self.left_out) > LEFT_OUT * len(self.scenes):
            first = next(iter(self.left_out.values()))
            raise WorkError(
                place="--suite", got=f"{len(self.left_out)} of {len(self.scenes)} scenes without their events: {first}",
                expected="at most 5 % of the scenes left out", remedy="mend these scenes, or choose another suite",
            )  # fmt: skip
