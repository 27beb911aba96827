"""The study: Optuna's search over a plan's space, in a storage of its own, resumable, shared by processes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import optuna
from optuna.storages import BaseStorage
from optuna.trial import FrozenTrial, TrialState

from scenarios.errors import InputError
from tracking.tuning.goals import Goal
from tracking.tuning.journal import LOCKS, Journal, Locks
from tracking.tuning.pruner import SignedRank
from tracking.tuning.result import Trial
from tracking.tuning.sampler import AGAIN, ERROR, PRUNED, Sampler, distribution, slot
from tracking.tuning.search_plan import Plan

SETTINGS = "settings"
"""The attribute of a study that says what it is about."""

DONE = (TrialState.COMPLETE, TrialState.PRUNED)


class Study:
    """A study that is open. State: Optuna's study; the locks by which processes share its journal, if it has one."""

    def __init__(self, plan: Plan, study: optuna.Study, locks: Locks | None, place: object = None) -> None:
        self.plan, self.optuna, self._locks = plan, study, locks
        self._space = {p.name: distribution(p) for p in plan.space}
        with self._taking():
            _same(plan, study, place)
            if SETTINGS not in study.user_attrs:
                study.set_user_attr(SETTINGS, plan.identity())
            if not study.get_trials(deepcopy=False):
                study.enqueue_trial(dict(plan.defaults))

    def trials(self) -> list[FrozenTrial]:
        """All trials, those given up on in the middle too."""
        return self.optuna.get_trials(deepcopy=False)

    def finished(self) -> list[FrozenTrial]:
        """Those that were played to their end, or pruned."""
        return [t for t in self.trials() if t.state in DONE]

    def ask(self, desperate: bool = False) -> optuna.Trial | None:
        """The next trial to play, None where as many are finished or being played as are wanted.

        Trials whose process has died come first. Where that cannot be known (no journal), all that are not finished
        count as being played by others, or, `desperate`, as left.
        """
        with self._taking():
            for t in self.trials():
                if t.state == TrialState.RUNNING and (desperate if self._locks is None else self._locks.left(t.number)):
                    self._again(t)
            taken = [t for t in self.trials() if t.state in (*DONE, TrialState.RUNNING)]
            if len(taken) >= self.plan.trials:
                return None
            asked = self.optuna.ask(self._space)
            if self._locks is not None:
                self._locks.play(asked.number)
            return asked

    def tell(self, asked: optuna.Trial, values: Sequence[float] | None) -> None:
        """What came of it; None: these parameters cannot be."""
        state = TrialState.PRUNED if values is None else TrialState.COMPLETE
        self.optuna.tell(asked, values, state, skip_if_finished=True)
        if self._locks is not None:
            self._locks.leave(asked.number)

    def slot(self, asked: optuna.Trial) -> int:
        """Its place in the search; 0: the defaults."""
        trials = self.trials()
        return slot(trials, trials[asked.number])

    def told(self) -> list[Trial]:
        """The finished trials, by their places in the search, which a trial that was done again keeps."""
        every = self.trials()
        return sorted((self._told(t, slot(every, t)) for t in self.finished()), key=lambda t: t.number)

    def _told(self, t: FrozenTrial, place: int) -> Trial:
        said = t.user_attrs
        if ERROR in said:
            return Trial(place, (), dict(t.params), 0, error=said[ERROR])
        episodes = said.get(PRUNED, len(self.plan.training))
        return Trial(place, tuple(t.values or ()), dict(t.params), episodes, PRUNED in said)

    def best(self) -> set[int]:
        """The places of those trials that no other one beats by all goals."""
        every = self.trials()
        return {slot(every, t) for t in self.optuna.best_trials}

    def importance(self) -> dict[str, float]:
        """How much each parameter decided about the first goal in training (PED-ANOVA), shares, greatest first."""
        from optuna.importance import get_param_importances

        names = [p.name for p in self.plan.space]
        known = [t.values[0] for t in self.told() if t.values]
        if len(known) < 2 or min(known) == max(known):
            return dict.fromkeys(names, 0.0)
        sign = -1 if self.plan.goals[0].higher else 1  # it asks what makes a target low, and warns of that
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return dict(get_param_importances(self.optuna, params=names, target=lambda t: sign * t.values[0]))

    @property
    def shared(self) -> bool:
        """Can it be known whether others are still at work?"""
        return self._locks is not None

    def _taking(self) -> Any:
        return nullcontext() if self._locks is None else self._locks.taking()

    def _again(self, left: FrozenTrial) -> None:
        """Put a trial that was left back in the queue, in the place that it had."""
        number = left.user_attrs.get(AGAIN, left.number)
        waiting = [t for t in self.trials() if t.user_attrs.get(AGAIN) == number and t.number > left.number]
        if not waiting:
            values = {**left.system_attrs.get("fixed_params", {}), **left.params}
            self.optuna.enqueue_trial(values, user_attrs={AGAIN: number})
        self.optuna.tell(left.number, state=TrialState.FAIL, skip_if_finished=True)


@contextmanager
def opened(plan: Plan, storage: str | Path | None, name: str) -> Iterator[Study]:
    """The study of that name: in a journal file, at the URL of another of Optuna's storages, or (None) in memory.

    InputError where the storage cannot be used, or holds a study of this name that is about something else.
    """
    with _quiet():
        place = storage if storage is None or "://" in str(storage) else Path(storage)
        locks = _locks(place) if isinstance(place, Path) else None
        try:
            store = _store(place, locks)
            found = optuna.create_study(
                storage=store, study_name=name, load_if_exists=True, sampler=Sampler(plan),
                pruner=_pruner(plan), directions=[_direction(goal) for goal in plan.goals],
            )  # fmt: skip
            yield Study(plan, found, locks, storage)
        finally:
            if locks is not None:
                locks.close()


def _direction(goal: Goal) -> optuna.study.StudyDirection:
    return optuna.study.StudyDirection.MAXIMIZE if goal.higher else optuna.study.StudyDirection.MINIMIZE


def _pruner(plan: Plan) -> optuna.pruners.BasePruner:
    if plan.prune == 0 or len(plan.goals) > 1:
        return optuna.pruners.NopPruner()
    return SignedRank(plan.prune)


def _same(plan: Plan, found: optuna.Study, storage: object) -> None:
    """InputError where the study is about something else."""
    mine, its = plan.identity(), found.user_attrs.get(SETTINGS)
    if its is None and not found.get_trials(deepcopy=False):
        return
    its = its or {}
    different = [key for key in mine if its.get(key) != mine[key]]
    if different:
        key = different[0]
        raise InputError(
            file=storage, place=f"study {found.study_name}", got=f"another search: {', '.join(different)} differ",
            expected=f"{key} {its.get(key)}, not {mine[key]}",
            remedy="choose another --out or --study, or repeat the command that began it",
        )  # fmt: skip


def _locks(path: Path) -> Locks | None:
    """The locks of a journal, None where the system has no such thing."""
    try:
        import fcntl  # noqa: F401
    except ImportError:
        return None
    path.parent.mkdir(parents=True, exist_ok=True)
    return Locks(path.with_name(path.name + LOCKS))


def _store(place: str | Path | None, locks: Locks | None) -> BaseStorage | str | None:
    from optuna.storages import GrpcStorageProxy, JournalStorage
    from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock, JournalRedisBackend

    try:
        if isinstance(place, Path):
            lock = JournalFileOpenLock(str(place))
            return JournalStorage(Journal(place, locks) if locks else JournalFileBackend(str(place), lock_obj=lock))
        if place is not None and place.startswith("redis"):
            return JournalStorage(JournalRedisBackend(place))
        if place is not None and place.startswith("grpc://"):
            url = urlparse(place)
            return GrpcStorageProxy(host=url.hostname or "localhost", port=url.port or 13000)
        return None if place is None else optuna.storages.RDBStorage(place)
    except OSError:
        raise
    except Exception as error:
        got = f"{type(error).__name__}: {error}".partition("\n")[0]
        expected = "a journal file, or the URL of a storage that Optuna knows, its driver installed"
        raise InputError(file=place, place="--storage", got=got, expected=expected, remedy="check it") from error


@contextmanager
def _quiet() -> Iterator[None]:
    """Optuna's own messages and its warnings of what is experimental."""
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)
