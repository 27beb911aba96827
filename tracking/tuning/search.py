"""The whole search of `tracking.tune`: plan, trials on training scenes, choice on validation scenes, test, files.

    found = tracking.tune("blob", "crossing", trials=100)
    print(found)                       # the gain on test scenes, and on a suite that was not tuned on
    found.write("blob.toml")
    tracks = tracking.track("blob", sequence, params=found.config)

docs/reference/tuning.md describes the method and what may be concluded from its results.

Candidates are then played on held-out scenes, which the search did not use: validation scenes first, then test scenes.
`HeldOutEvaluator.validated` plays the best trials on the validation scenes. `simplified` resets the parameters of the
winner that bring nothing there. `compared` measures the gain on the test scenes. The study keeps the episodes, so that
a search that was killed after its last trial does not play them again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenarios.errors import FlockscopeError, InputError, WorkError, counted
from sim.dataset.generate import LEFT_OUT
from sim.io.files.own_files import Marks, output_file, refuse_foreign_file
from sim.types import Tracker
from tracking.config import Config
from tracking.environment.episodes import Episode, Source
from tracking.keyword_options import documented, from_keywords
from tracking.tuning.comparison import Candidate, Comparison, Goal, TrialRecord, compare_episodes, pareto_front
from tracking.tuning.options import Scenes, TuneOptions
from tracking.tuning.parallel_episodes import PlayEpisodes, episode_player
from tracking.tuning.result import TuningResult
from tracking.tuning.search_plan import SearchPlan, search_plan

if TYPE_CHECKING:
    import optuna

    from tracking.tuning.study import SearchStudy


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


JOURNAL = ".journal"  # Suffix of the journal beside `--out`.

# What every .json file of a search has.
RESULT_MARKS: Marks = {"settings": dict, "counts": dict, "left_out": list}


@documented(TuneOptions, positional=3)
def tune(tracker: str | type[Tracker], suite: Scenes, trials: int = TuneOptions.trials, **options: Any) -> TuningResult:
    """Searches parameters on simulated scenes, and measures their gain on other scenes.

    The same call resumes a search that was interrupted, if `out` or `storage` is given.

    Args:
        tracker: A name, file.py:Class, module:Class, a class (then workers must be 1), or "grouping".
        suite: Names of suites or scenarios, or TOML files, to tune on.
        trials: Number of sets of parameters to play, the defaults included.

    Returns:
        `TuningResult`: the best config and its comparison with the defaults on the test scenes. If `out` is given, it
        is also written to files.

    Raises:
        InputError: An option is unknown or wrong, options contradict each other, the study in the storage is about
            another search, or Optuna is not installed.
        WorkError: Workers are lost, or the tracker fails with its defaults.
    """
    given = {"tracker": tracker, "suite": suite, "trials": trials, **options}
    return _search(from_keywords(TuneOptions, "tracking.tune", given))


def _search(options: TuneOptions) -> TuningResult:
    require_optuna("tune")
    from tracking.tuning.study import open_study, run_trials

    plan = search_plan(options)
    progress = options.progress or (lambda finished, trials, text: None)
    most = options.finalists + 1 if len(plan.goals) > 1 else 0
    target = None if options.out is None else _checked_target(Path(options.out), most)
    storage = options.storage if options.storage is not None or target is None else target.with_suffix(JOURNAL)
    name = options.study or (target.stem if target is not None else "flockscope")
    with (
        open_study(plan, storage, name) as study,
        episode_player(plan.tracker, plan.detections, options.workers, options.cluster, options.similarity) as play,
    ):
        run_trials(study, play, progress)
        report = partial(progress, options.trials, options.trials)
        evaluator = HeldOutEvaluator(plan, play, study.optuna, report)
        evaluator.count(plan.training, study.left_out())
        found = _evaluated(plan, study, evaluator)
    if target is not None:
        found.write(target)
    evaluator.require_most()
    return found


def require_optuna(place: str) -> None:
    """Raises InputError if Optuna is missing; place: what needs it."""
    try:
        import optuna  # noqa: F401
    except ImportError:
        remedy = 'in the folder of the sources: pip install -c constraints.txt -e ".[tune]"'
        raise InputError(place=place, got="no optuna", expected="the package optuna", remedy=remedy) from None


def _checked_target(out: Path, candidates: int) -> Path:
    """Returns `out` if neither it nor the figures and the front beside it are somebody else's. candidates: the most
    candidates of a front."""
    refuse_foreign_file(output_file(out, ".toml").with_suffix(".json"), RESULT_MARKS)
    for k in range(1, candidates + 1):
        refuse_foreign_file(out.with_suffix(f".front-{k}.toml"))
    return out


def _evaluated(plan: SearchPlan, study: SearchStudy, evaluator: HeldOutEvaluator) -> TuningResult:
    candidates = evaluator.validated(_candidates(plan, study))
    importance, default, goal = study.importance(), candidates[0], plan.goals[0]
    front = tuple(pareto_front(candidates, plan.goals)) if len(plan.goals) > 1 else ()
    better = [c for c in candidates if c.gain is not None and c.gain.verdict == "better"]
    best = front[0] if front else max([default, *better], key=lambda c: goal.gain(0.0, c.validation[0]))
    config, values = best.config, best.validation
    if len(plan.goals) == 1 and best is not default:
        config, value = evaluator.simplified(config, values[0], sorted(importance, key=lambda name: importance[name]))
        values = (value,)
    comparisons, notes = evaluator.compared(config) if config != plan.base else ([], _why_defaults(candidates, goal))
    return TuningResult(
        plan, config, front, tuple(candidates), tuple(study.records()), importance, tuple(comparisons),
        (default.validation, values), tuple(notes), tuple(evaluator.left_out.values()),
    )  # fmt: skip


def _why_defaults(candidates: list[Candidate], goal: Goal) -> list[str]:
    gains = [c.gain for c in candidates[1:] if c.gain is not None]
    if not gains:
        return ["the defaults stay: no trial was better in training"]
    best = max(gains, key=lambda c: goal.gain(c.before, c.after))
    if best.sequences < 2:
        return ["the defaults stay: one validation scene says nothing of others; give more --validation seeds"]
    ends = f"{best.difference_words}, {counted(best.sequences, 'sequence')}"
    return [f"the defaults stay: nothing is surely better on the validation scenes; at best {goal.key} {ends}"]


def _candidates(plan: SearchPlan, study: SearchStudy) -> list[Candidate]:
    played = [t for t in study.records() if not t.pruned and not t.error]
    defaults, goal, finalists = played[0], plan.goals[0], plan.options.finalists
    ranked = sorted(played, key=lambda t: goal.gain(t.values[0], 0.0))
    if len(plan.goals) > 1:
        front = {t.number for t in study.optuna.best_trials}
        ranked = _spread([t for t in ranked if t.number in front], finalists)
    found = [Candidate(defaults.number, plan.base, defaults.values)]
    for trial in ranked:
        config = plan.config(trial.params)
        if len(found) <= finalists and config not in [c.config for c in found]:
            found.append(Candidate(trial.number, config, trial.values))
    return found


def _spread(ranked: list[TrialRecord], count: int) -> list[TrialRecord]:
    if len(ranked) <= count:
        return ranked
    return [ranked[round(k * (len(ranked) - 1) / max(count - 1, 1))] for k in range(count)]
