"""Tuning by search: the parameters of a tracker, found on simulated scenes, judged on others.

    found = tracking.tune("blob", "crossing", trials=100)
    print(found)                       # what was gained on test scenes, and on a suite that was not used
    found.write("blob.toml")
    tracks = tracking.track("blob", sequence, params=found.config)

docs/tuning.md says how the search goes and what holds of its results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from sim.types import DetectionMode, Tracker
from tracking.tuning import scenes
from tracking.tuning.goals import Goal
from tracking.tuning.judge import Candidate, Judge, front
from tracking.tuning.parallel_episodes import Play, players
from tracking.tuning.result import Trial, Tuned
from tracking.tuning.search_plan import Plan, plan

if TYPE_CHECKING:
    from tracking.tuning.study import Study

__all__ = ["Tuned", "tune"]

JOURNAL = ".journal"
Progress = Callable[[int, int | None, str], None]


def tune(
    tracker: str | type[Tracker],
    suite: scenes.Scenes,
    trials: int = 100,
    *,
    seeds: range | None = None,
    validation: range | None = None,
    test: range | None = None,
    check: str | None = "",
    objective: str | Iterable[str] = (),
    detections: DetectionMode | None = None,
    set: Iterable[str] = (),
    only: Iterable[str] = (),
    out: str | Path | None = None,
    storage: str | Path | None = None,
    study: str | None = None,
    workers: int = 1,
    cluster: str | None = None,
    prune: float = 0.1,
    finalists: int = 5,
    seed: int = 0,
    progress: Progress | None = None,
) -> Tuned:
    """Search the tunable parameters of a tracker over whole episodes of simulated scenes.

    tracker: a name ("grouping" is the baseline rule of groups), "file.py:Class", "module:Class" or (one worker) a
    class. suite: a suite, scenario, TOML file, or a list of these. seeds, validation, test: of 0:10000, 10000:20000
    and 20000:30000; by default as many as make 16, 48 and 100 episodes. check: a suite that was not used, "" for a
    usual one, None for none. objective: score keys of docs/metrics.md or "frames/s"; of several, a Pareto front; by
    default "objective". set: "gate=0.99" holds a parameter, "scenario.…" and "sensor.…" are of the scenes. only:
    the parameters to search. out: where to write the result; beside it lies the study, by which the same call goes
    on, unless `storage` names another journal file or an Optuna storage's URL (without either it is in memory).
    study: its name there. workers: processes that play episodes, or cluster: a scheduler's address; the result does
    not depend on them. prune: p below which a trial that loses on the same scenes is given up, 0 for never.
    finalists: how many of the best are judged on validation scenes. progress(done, all, what) is called as it goes.

    InputError for wishes that cannot be, before anything is played; errors of the defaults themselves are raised.
    """
    _optuna()
    from tracking.tuning.judgement_memory import remembering
    from tracking.tuning.study import opened
    from tracking.tuning.trials import search

    made = plan(
        tracker, suite, trials, seeds=seeds, validation=validation, test=test, check=check, objective=objective,
        detections=detections, set=set, only=only, prune=prune, finalists=finalists, seed=seed,
    )  # fmt: skip
    tell: Progress = progress or (lambda done, total, what: None)
    target = None if out is None else _target(Path(out))
    place = storage if storage is not None or target is None else target.with_suffix(JOURNAL)
    name = study or (target.stem if target is not None else "flockscope")
    with opened(made, place, name) as own, players(made.subject, made.detections, workers, cluster) as play:
        search(own, play, tell)
        found = _judged(made, own, remembering(own, play), lambda what: tell(made.trials, made.trials, what))
    if target is not None:
        found.write(target)
    return found


def _optuna() -> None:
    """InputError where the search library is missing."""
    try:
        import optuna  # noqa: F401
    except ImportError:
        remedy = 'install the extra: pip install "flockscope[tune]"'
        raise InputError(place="tune", got="no optuna", expected="optuna, which searches", remedy=remedy) from None


def _target(out: Path) -> Path:
    if out.suffix != ".toml" or out.is_dir():
        remedy = "choose a name that ends in .toml"
        raise InputError(file=out, place="--out", got=out.name, expected="a file, *.toml", remedy=remedy)
    return out


def _judged(made: Plan, study: Study, play: Play, tell: Callable[[str], None]) -> Tuned:
    """The winner of a study that is finished, and what it gained."""
    judge = Judge(made, play, tell)
    candidates = judge.validated(_candidates(made, study))
    importance = study.importance()
    default, several = candidates[0], len(made.goals) > 1
    kept = front(candidates, made.goals) if several else []
    goal = made.goals[0]
    sure = [c for c in candidates if c.gain is not None and c.gain.verdict == "better"]
    best = kept[0] if several else max([default, *sure], key=lambda c: goal.gain(0.0, c.validation[0]))
    config, reached = best.config, best.validation
    if not several and best is not default:
        order = sorted(importance, key=lambda name: importance[name])
        config, value = judge.simplified(best.config, best.validation[0], order)
        reached = (value,)
    before = made.base.as_dict()
    back = [n for n, v in best.config.as_dict().items() if v != before[n] and config.as_dict()[n] == before[n]]
    comparisons, notes = judge.compared(config) if config != made.base else ([], _why_none(candidates, goal))
    return Tuned(
        made, config, tuple(kept), tuple(candidates), tuple(study.told()), importance, tuple(comparisons), tuple(back),
        (default.validation, reached), tuple(notes), study.optuna.study_name,
    )  # fmt: skip


def _why_none(candidates: list[Candidate], goal: Goal) -> list[str]:
    """Why the defaults stay."""
    others = [c.gain for c in candidates[1:] if c.gain is not None]
    if not others:
        return ["the defaults stay: no trial was better in training"]
    best = max(others, key=lambda c: goal.gain(c.before, c.after))
    if best.sequences < 2:
        return ["the defaults stay: one validation scene says nothing of others; give more --validation seeds"]
    ends = f"{best.difference:+.4f} [{best.low:+.4f}, {best.high:+.4f}], {best.sequences} sequences"
    return [f"the defaults stay: nothing is surely better on the validation scenes; at best {goal.key} {ends}"]


def _candidates(made: Plan, study: Study) -> list[Candidate]:
    """The defaults, and the best of training that were played to their end, each config once."""
    whole = [t for t in study.told() if not t.pruned and not t.error]
    first, goal = next(t for t in whole if t.params == made.defaults), made.goals[0]
    if len(made.goals) > 1:
        best = study.best()
        whole = [t for t in whole if t.number in best]
    ranked = sorted(whole, key=lambda t: goal.gain(t.values[0], 0.0))
    ranked = _spread(ranked, made.finalists) if len(made.goals) > 1 else ranked
    found = [Candidate(first.number, made.base, first.values)]
    for trial in ranked:
        config = made.config(trial.params)
        if len(found) <= made.finalists and config not in [c.config for c in found]:
            found.append(Candidate(trial.number, config, trial.values))
    return found


def _spread(ranked: list[Trial], count: int) -> list[Trial]:
    """So many of a front, from end to end."""
    if len(ranked) <= count:
        return ranked
    return [ranked[round(k * (len(ranked) - 1) / max(count - 1, 1))] for k in range(count)]
