"""The study: Optuna's record of all trials in a storage, which a search can resume and several processes can share.

`open_study` opens it as a `SearchStudy`, which gives the next trial to play, stores values, and lists finished trials.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from urllib.parse import urlparse

import optuna
from optuna.storages import BaseStorage
from optuna.trial import FrozenTrial, TrialState

from scenarios.errors import InputError
from tracking.tuning.comparison import TrialRecord
from tracking.tuning.goals import Goal
from tracking.tuning.journal import SUFFIX, LockedJournal, TrialLocks
from tracking.tuning.pruner import SignedRankPruner
from tracking.tuning.sampler import AGAIN, ERROR, PRUNED, HillClimbingSampler, distribution, place_in_search
from tracking.tuning.search_plan import SearchPlan

SETTINGS = "settings"  # Attribute of a study that holds the identity of its plan.

# States of a finished trial. PRUNED means impossible parameters; one stopped early is COMPLETE with an estimate.
FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)


class SearchStudy:
    """An open study of a search (Optuna's record of its trials), which several processes can share.

    A new study gets the defaults as its first trial. Without a journal file, `locks` is None.
    """

    def __init__(self, plan: SearchPlan, study: optuna.Study, locks: TrialLocks | None, storage: object = None) -> None:
        self.plan, self.optuna, self._locks = plan, study, locks
        self._space = {p.name: distribution(p) for p in plan.space}
        with self._choosing():
            _check_identity(plan, study, storage)
            if SETTINGS not in study.user_attrs:
                study.set_user_attr(SETTINGS, plan.identity())
            if not study.get_trials(deepcopy=False):
                study.enqueue_trial(dict(plan.defaults))

    def trials(self) -> list[FrozenTrial]:
        """Returns all of Optuna's trials in the order of their numbers."""
        return self.optuna.get_trials(deepcopy=False)

    def finished(self) -> list[FrozenTrial]:
        """Returns the finished trials by number: complete, stopped early, or with impossible parameters."""
        return [t for t in self.trials() if t.state in FINISHED]

    def ask(self, retry_unfinished: bool = False) -> optuna.Trial | None:
        """Returns the next trial to play, locked for this process."""
        with self._choosing():
            for t in self.trials():
                if t.state == TrialState.RUNNING and (
                    retry_unfinished if self._locks is None else self._locks.is_abandoned(t.number)
                ):
                    self._repeat(t)
            taken = [t for t in self.trials() if t.state in (*FINISHED, TrialState.RUNNING)]
            if len(taken) >= self.plan.options.trials:
                return None
            trial = self.optuna.ask(self._space)
            if self._locks is not None:
                self._locks.hold_trial(trial.number)
            return trial

    def tell(self, trial: optuna.Trial, values: Sequence[float] | None) -> None:
        """Stores the values of a trial, one per goal, and releases its lock."""
        state = TrialState.PRUNED if values is None else TrialState.COMPLETE
        self.optuna.tell(trial, values, state, skip_if_finished=True)
        if self._locks is not None:
            self._locks.release_trial(trial.number)

    def place(self, trial: optuna.Trial) -> int:
        """Returns the place of a trial in the search, 0 for the defaults."""
        trials = self.trials()
        return place_in_search(trials, trials[trial.number])

    def records(self) -> list[TrialRecord]:
        """Returns the finished trials in the order of the search, numbered by their place in it, 0 for the defaults."""
        trials = self.trials()
        return sorted((self._record(t, place_in_search(trials, t)) for t in self.finished()), key=lambda r: r.number)

    def _record(self, t: FrozenTrial, place: int) -> TrialRecord:
        if ERROR in t.user_attrs:
            return TrialRecord(place, (), dict(t.params), 0, error=t.user_attrs[ERROR])
        episodes = t.user_attrs.get(PRUNED, len(self.plan.training))
        return TrialRecord(place, tuple(t.values or ()), dict(t.params), episodes, PRUNED in t.user_attrs)

    def best(self) -> set[int]:
        """Returns the places in the search of the best trials, or of the Pareto front, pruned ones included."""
        trials = self.trials()
        return {place_in_search(trials, t) for t in self.optuna.best_trials}

    def importance(self) -> dict[str, float]:
        """Returns the share (0 to 1) of each parameter in the first goal's training values (PED-ANOVA)."""
        from optuna.importance import get_param_importances

        names = [p.name for p in self.plan.space]
        known = [t.values[0] for t in self.records() if t.values]
        if len(known) < 2 or min(known) == max(known):
            return dict.fromkeys(names, 0.0)
        sign = -1 if self.plan.goals[0].higher else 1  # PED-ANOVA explains low values, and warns about a custom target
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return dict(get_param_importances(self.optuna, params=names, target=lambda t: sign * t.values[0]))

    @property
    def knows_running_trials(self) -> bool:
        """True if it is known which running trials other processes still play."""
        return self._locks is not None

    def _choosing(self) -> AbstractContextManager[None]:
        return nullcontext() if self._locks is None else self._locks.choosing()

    def _repeat(self, abandoned: FrozenTrial) -> None:
        number = abandoned.user_attrs.get(AGAIN, abandoned.number)
        repeated = any(t.user_attrs.get(AGAIN) == number and t.number > abandoned.number for t in self.trials())
        if not repeated:
            values = {**abandoned.system_attrs.get("fixed_params", {}), **abandoned.params}
            self.optuna.enqueue_trial(values, user_attrs={AGAIN: number})
        self.optuna.tell(abandoned.number, state=TrialState.FAIL, skip_if_finished=True)


@contextmanager
def open_study(plan: SearchPlan, storage: str | Path | None, name: str) -> Iterator[SearchStudy]:
    """Opens or creates the study `name` for the time of the context, and yields it as a `SearchStudy`."""
    with _quiet_optuna():
        place = storage if storage is None or "://" in str(storage) else Path(storage)
        locks = _trial_locks(place) if isinstance(place, Path) else None
        try:
            study = _create(plan, place, _optuna_storage(place, locks), name)
            yield SearchStudy(plan, study, locks, storage)
        finally:
            if locks is not None:
                locks.close()


def _create(plan: SearchPlan, place: str | Path | None, storage: BaseStorage | str | None, name: str) -> optuna.Study:
    try:
        return optuna.create_study(
            storage=storage, study_name=name, load_if_exists=True, sampler=HillClimbingSampler(plan),
            pruner=_pruner(plan), directions=[_direction(goal) for goal in plan.goals],
        )  # fmt: skip
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        got = f"{type(error).__name__}: {error}".partition("\n")[0]
        expected = "a storage that `flockscope tune` wrote"
        raise InputError(
            file=place, place="--storage", got=got, expected=expected, remedy="choose another --out or --storage"
        ) from error


def _direction(goal: Goal) -> optuna.study.StudyDirection:
    return optuna.study.StudyDirection.MAXIMIZE if goal.higher else optuna.study.StudyDirection.MINIMIZE


def _pruner(plan: SearchPlan) -> optuna.pruners.BasePruner:
    if plan.options.prune == 0 or len(plan.goals) > 1:
        return optuna.pruners.NopPruner()
    return SignedRankPruner(plan.options.prune)


def _check_identity(plan: SearchPlan, study: optuna.Study, storage: object) -> None:
    mine, stored = plan.identity(), study.user_attrs.get(SETTINGS)
    if stored is None and not study.get_trials(deepcopy=False):
        return
    stored = stored or {}
    different = [key for key in mine if stored.get(key) != mine[key]]
    if different:
        key = different[0]
        raise InputError(
            file=storage, place=f"study {study.study_name}", got=f"another search: {', '.join(different)} differ",
            expected=f"{key} {stored.get(key)}, not {mine[key]}",
            remedy="choose another --out or --study, or repeat the command that began it",
        )  # fmt: skip


def _trial_locks(journal: Path) -> TrialLocks | None:
    try:
        import fcntl  # noqa: F401
    except ImportError:
        return None
    journal.parent.mkdir(parents=True, exist_ok=True)
    return TrialLocks(journal.with_name(journal.name + SUFFIX))


def _optuna_storage(place: str | Path | None, locks: TrialLocks | None) -> BaseStorage | str | None:
    from optuna.storages import GrpcStorageProxy, JournalStorage
    from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock, JournalRedisBackend

    try:
        if isinstance(place, Path):
            lock = JournalFileOpenLock(str(place))
            return JournalStorage(
                LockedJournal(place, locks) if locks else JournalFileBackend(str(place), lock_obj=lock)
            )
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
        expected = "a journal file, or the URL of a storage that Optuna knows, with its driver installed"
        raise InputError(file=place, place="--storage", got=got, expected=expected, remedy="check it") from error


@contextmanager
def _quiet_optuna() -> Iterator[None]:
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)
