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

SETTINGS = "settings"
"""Attribute of a study that holds the identity of its plan."""

FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)
"""States of a finished trial. PRUNED means impossible parameters; one stopped early is COMPLETE with an estimate."""


class SearchStudy:
    """An open study of a search (Optuna's record of its trials), which several processes can share.

    A new study gets the defaults as its first trial. plan: the search; study (kept as `optuna`): Optuna's study; locks:
    locks by which processes share its journal file, None without them; storage: names it in errors. Raises InputError
    if the study is about another search.
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
        """Returns all of Optuna's trials in the order of their numbers; running, waiting, failed and abandoned ones are
        included. They are not copies: do not change them.
        """
        return self.optuna.get_trials(deepcopy=False)

    def finished(self) -> list[FrozenTrial]:
        """Returns the finished trials by number: complete, stopped early, or with impossible parameters.

        The state of the first two is COMPLETE, that of the last PRUNED.
        """
        return [t for t in self.trials() if t.state in FINISHED]

    def ask(self, retry_unfinished: bool = False) -> optuna.Trial | None:
        """Returns the next trial to play, locked for this process; None if as many as planned are finished or running.

        With locks, an abandoned trial (running, but its process is gone) is repeated first. Without locks it is not
        known which trials are abandoned: running ones count as played by others, or, with `retry_unfinished`, as
        abandoned (which has no effect with locks). Abandoned trials are marked as failed.
        """
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
        """Stores the values of a trial, one per goal, and releases its lock; None means that its parameters are
        impossible (state PRUNED).

        A trial that is finished already keeps its values. Raises ValueError if the number of values differs from that
        of the goals or a value is nan.
        """
        state = TrialState.PRUNED if values is None else TrialState.COMPLETE
        self.optuna.tell(trial, values, state, skip_if_finished=True)
        if self._locks is not None:
            self._locks.release_trial(trial.number)

    def place(self, trial: optuna.Trial) -> int:
        """Returns the place of a trial in the search, 0 for the defaults.

        A repeated trial has the place of its first try.
        """
        trials = self.trials()
        return place_in_search(trials, trials[trial.number])

    def records(self) -> list[TrialRecord]:
        """Returns the finished trials in the order of the search, numbered by their place in it, 0 for the defaults.

        A repeated trial has the place of its first try. Pruned and impossible trials are included.
        """
        trials = self.trials()
        return sorted((self._record(t, place_in_search(trials, t)) for t in self.finished()), key=lambda r: r.number)

    def _record(self, t: FrozenTrial, place: int) -> TrialRecord:
        if ERROR in t.user_attrs:
            return TrialRecord(place, (), dict(t.params), 0, error=t.user_attrs[ERROR])
        episodes = t.user_attrs.get(PRUNED, len(self.plan.training))
        return TrialRecord(place, tuple(t.values or ()), dict(t.params), episodes, PRUNED in t.user_attrs)

    def best(self) -> set[int]:
        """Returns the places in the search of the best trial, or, with several goals, of the trials of the Pareto
        front.

        Estimates of pruned trials take part. Of one goal, all trials with the best value are returned. Empty if no
        trial is complete.
        """
        trials = self.trials()
        return {place_in_search(trials, t) for t in self.optuna.best_trials}

    def importance(self) -> dict[str, float]:
        """Returns the share (0 to 1) of each parameter in the first goal's training values (PED-ANOVA), a dict by name,
        greatest first.

        Estimates of pruned trials take part. All shares are 0 if fewer than two trials have values, or all values are
        equal.
        """
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
        """True if it is known which running trials other processes still play.

        This is so with a journal file on a system with fcntl.
        """
        return self._locks is not None

    def _choosing(self) -> AbstractContextManager[None]:
        return nullcontext() if self._locks is None else self._locks.choosing()

    def _repeat(self, abandoned: FrozenTrial) -> None:
        """Marks an abandoned trial as failed and queues its parameters again under its place; only marks it if that was
        done before.
        """
        number = abandoned.user_attrs.get(AGAIN, abandoned.number)
        repeated = any(t.user_attrs.get(AGAIN) == number and t.number > abandoned.number for t in self.trials())
        if not repeated:
            values = {**abandoned.system_attrs.get("fixed_params", {}), **abandoned.params}
            self.optuna.enqueue_trial(values, user_attrs={AGAIN: number})
        self.optuna.tell(abandoned.number, state=TrialState.FAIL, skip_if_finished=True)


@contextmanager
def open_study(plan: SearchPlan, storage: str | Path | None, name: str) -> Iterator[SearchStudy]:
    """Opens or creates the study `name` for the time of the context, and yields it as a `SearchStudy`; then releases
    its locks.

    plan: the search. storage: a journal file, the URL of an Optuna storage, or None for memory. The folder and the lock
    file of a journal are created. Optuna's messages are silenced meanwhile. Raises InputError if the storage cannot be
    used, or holds a study of this name that is about another search; OSError if a file cannot be opened.
    """
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
    """Creates the study `name` in Optuna's storage, or loads it; InputError if what is stored there is damaged.

    place: of the storage, for the message.
    """
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
    """Raises InputError if the study was begun with other settings than the plan's; a study without trials and settings
    fits every plan.

    storage: names the study's place in the error.
    """
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
    """Returns the locks of a journal file, None if the system has no fcntl. Creates the folder and the lock file.

    Raises OSError if these cannot be created.
    """
    try:
        import fcntl  # noqa: F401
    except ImportError:
        return None
    journal.parent.mkdir(parents=True, exist_ok=True)
    return TrialLocks(journal.with_name(journal.name + SUFFIX))


def _optuna_storage(place: str | Path | None, locks: TrialLocks | None) -> BaseStorage | str | None:
    """Returns Optuna's storage for `place`: a journal file (Path), a URL (str) or memory (None, which is returned).

    locks: under which the journal is written, None for Optuna's own lock file. Raises InputError if Optuna cannot open
    it, OSError if a file cannot be opened.
    """
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
    """Silences Optuna's messages and its warnings about experimental features, for the time of the context."""
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)
