"""The whole search of `tracking.tune`: plan, trials on training scenes, choice on validation scenes, test, files.

    found = tracking.tune("blob", "crossing", trials=100)
    print(found)                       # the gain on test scenes, and on a suite that was not tuned on
    found.write("blob.toml")
    tracks = tracking.track("blob", sequence, params=found.config)

docs/reference/tuning.md describes the method and what may be concluded from its results.
Candidates are played on validation and test scenes by `tracking.tuning.candidates`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenarios.errors import counted, extra_needed
from sim.store.own_files import Marks, output_file, refuse_foreign_file
from sim.types import Tracker
from tracking.keyword_options import documented
from tracking.tuning.adaptive_search import adapted, online_space
from tracking.tuning.candidates import Candidate, Goal, HeldOutEvaluator, TrialRecord, pareto_front, too_few
from tracking.tuning.episode_player import episode_player
from tracking.tuning.options import Scenes, TuneOptions
from tracking.tuning.result import TuningResult
from tracking.tuning.search_plan import SearchPlan, search_plan

if TYPE_CHECKING:
    from tracking.tuning.study import SearchStudy


JOURNAL = ".journal"  # Suffix of the journal beside `--out`.

# What every .json file of a search has.
RESULT_MARKS: Marks = {"settings": dict, "counts": dict, "left_out": list}


@documented(TuneOptions)
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
        InputError: An option is wrong, options contradict each other, the study in the storage is about
            another search, or Optuna is not installed.
        WorkError: Workers are lost, or the tracker fails with its defaults.
    """
    return _search(TuneOptions(tracker=tracker, suite=suite, trials=trials, **options))


def _search(options: TuneOptions) -> TuningResult:
    require_optuna("tune")
    from tracking.tuning.study import open_study, run_trials

    plan = search_plan(options)
    if options.adaptive is not None:
        online_space(plan)
    progress = options.progress or (lambda finished, trials, text: None)
    most = options.finalists + 1 if len(plan.goals) > 1 else 0
    target = None if options.out is None else _checked_target(Path(options.out), most)
    storage = options.storage if options.storage is not None or target is None else target.with_suffix(JOURNAL)
    name = options.study or (target.stem if target is not None else "flockscope")
    with (
        open_study(plan, storage, name) as study,
        episode_player(
            plan.tracker, plan.detections, options.workers, options.cluster, options.similarity, study.note
        ) as play,
    ):
        taken_over = study.taken_over()
        run_trials(study, play, progress)
        report = partial(progress, options.trials, options.trials)
        evaluator = HeldOutEvaluator(plan, play, study.optuna, report)
        left_out = study.left_out()
        evaluator.count(plan.training, left_out)
        found = replace(_evaluated(plan, study, evaluator), taken_over=taken_over)
        if options.adaptive is not None:
            training = [source for source, why in zip(plan.training, left_out, strict=True) if not why]
            found = replace(found, adapted=adapted(plan, found.config, training, options.adaptive, evaluator))
    if target is not None:
        found.write(target)
    evaluator.require_most()
    return found


def require_optuna(place: str) -> None:
    """Raises InputError if Optuna or filelock is missing; place: what needs them."""
    with extra_needed("tune", place):
        import filelock  # noqa: F401
        import optuna  # noqa: F401


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
    if best.indicative:
        return [f"the defaults stay: {too_few(best.sequences)}"]
    ends = f"{best.difference_words}, {counted(best.sequences, 'sequence')}"
    return [f"the defaults stay: nothing is surely better on the validation scenes; at best {goal.key} {ends}"]


def _candidates(plan: SearchPlan, study: SearchStudy) -> list[Candidate]:
    played = [t for t in study.records() if not t.error]
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
