"""The study: Optuna's record of all trials in a storage, which a search can resume and several processes can share.

`open_study` opens it as a `SearchStudy`, which gives the next trial to play, stores values, and lists finished trials.

The file of a study serves several processes at once, any of which may be killed at any time. It is Optuna's journal
with three differences:

- Locks are system locks (fcntl) on bytes of FILE.locks: byte 0 while a trial is chosen, byte 1 while lines are written,
  byte 2 + n while trial n is played. The system releases the locks of a process that dies, so other processes see that
  its trial was abandoned.
- An incomplete last line is removed before the next line is written.
- Lines are not flushed to the disk one by one. They survive a killed process but not a power cut.

`run_trials` is the loop of a search: one trial (set of parameters) after the other, each played on the training scenes
until it surely loses. It surely loses if the p-value of a paired test against the best trial, after any scene, is below
a limit. It then gets an estimate of its value.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import numpy as np
import optuna
from optuna.exceptions import UpdateFinishedTrialError
from optuna.storages import BaseStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState

from scenarios.errors import FlockscopeError, InputError
from tracking.environment.episodes import Episode
from tracking.stats import mean_of_known
from tracking.tuning.comparison import Goal, TrialRecord
from tracking.tuning.options import Progress
from tracking.tuning.parallel_episodes import PlayEpisodes
from tracking.tuning.sampler import (
    AGAIN,
    ERROR,
    PRUNED,
    HillClimbingSampler,
    SignedRankPruner,
    distribution,
    place_in_search,
)
from tracking.tuning.search_plan import SearchPlan

SUFFIX = ".locks"  # What the name of the lock file adds to the name of the journal.
CHOOSING, WRITING, FIRST_TRIAL = 0, 1, 2  # Bytes of the lock file.
HEAD = b'{"op_code":'  # How every journal begins.


class TrialLocks:
    """Locks on single bytes of the file `path`, shared by the processes of a search; the file is created if missing.

    State: the open file; closing it, or the end of the process, releases every lock.
    """

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)

    def lock(self, byte: int, wait: bool = True) -> None:
        """Locks a byte (offset in the file) for this process. Raises OSError if it is taken and `wait` is False."""
        fcntl.lockf(self._file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)

    def release(self, byte: int) -> None:
        """Releases this process's lock on a byte; does nothing if it holds none."""
        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)

    @contextmanager
    def locked(self, byte: int) -> Iterator[None]:
        """Holds the lock on a byte for the time of the context; waits until it is free."""
        self.lock(byte)
        try:
            yield
        finally:
            self.release(byte)

    def hold_trial(self, number: int) -> None:
        """Locks trial `number` (from 0) for this process until `release_trial` or `close`."""
        self.lock(FIRST_TRIAL + number)

    def release_trial(self, number: int) -> None:
        """Releases this process's lock on trial `number` (from 0); does nothing if it holds none."""
        self.release(FIRST_TRIAL + number)

    def is_abandoned(self, number: int) -> bool:
        """Returns True if no other process holds the lock on trial `number` (from 0)."""
        try:
            self.lock(FIRST_TRIAL + number, wait=False)
        except OSError:
            return False
        self.release_trial(number)
        return True

    def close(self) -> None:
        """Closes the file and so releases every lock."""
        os.close(self._file)


class LockedJournal(JournalFileBackend):
    """Optuna's journal file at `path`, written under `locks`, without incomplete last lines."""

    def __init__(self, path: Path, locks: TrialLocks) -> None:
        self._path, self._locks = path, locks
        super().__init__(str(path))
        with locks.locked(WRITING):
            self._check_head()
            self._remove_incomplete_line()

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Appends one JSON line per log (a dict); removes an incomplete last line first. No logs append nothing."""
        text = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        with self._locks.locked(WRITING):
            self._remove_incomplete_line()
            with open(self._path, "ab") as file:
                file.write(text.encode())

    def _check_head(self) -> None:
        with open(self._path, "rb") as file:
            head = file.read(len(HEAD))
        if not HEAD.startswith(head):
            raise ValueError("no journal of Optuna")

    def _remove_incomplete_line(self) -> None:
        with open(self._path, "r+b") as file:
            size = file.seek(0, os.SEEK_END)
            if size == 0:
                return
            file.seek(size - 1)
            if file.read(1) != b"\n":
                file.seek(0)
                file.truncate(file.read().rfind(b"\n") + 1)


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
        return nullcontext() if self._locks is None else self._locks.locked(CHOOSING)

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
    with quiet_optuna():
        place = storage if storage is None or "://" in str(storage) else Path(storage)
        locks = TrialLocks(place.with_name(place.name + SUFFIX)) if isinstance(place, Path) else None
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


def _optuna_storage(place: str | Path | None, locks: TrialLocks | None) -> BaseStorage | str | None:
    from optuna.storages import GrpcStorageProxy, JournalStorage
    from optuna.storages.journal import JournalRedisBackend

    try:
        if isinstance(place, Path):
            assert locks is not None, "a journal file has locks"
            return JournalStorage(LockedJournal(place, locks))
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
def quiet_optuna() -> Iterator[None]:
    """Keeps Optuna from printing for the time of the context."""
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)


PAUSE = 0.5  # Seconds between two looks at whether other processes have finished.

LEAST_LOSS = 1e-12  # Least difference between the best value and the estimate of a pruned trial.


def run_trials(study: SearchStudy, play: PlayEpisodes, progress: Progress) -> None:
    """Plays trials until the study has as many finished ones as planned, by this process or by others."""
    retry_unfinished, planned = False, study.plan.options.trials
    while True:
        progress(len(study.finished()), planned, _best_so_far(study))
        trial = study.ask(retry_unfinished)
        if trial is not None:
            _play_trial(study, trial, play)
        elif len(study.finished()) >= planned:
            return
        elif study.knows_running_trials:
            time.sleep(PAUSE)
        else:
            retry_unfinished = True


def _best_so_far(study: SearchStudy) -> str:
    known = len(study.plan.goals) == 1 and any(t.value is not None for t in study.finished())
    return f"(best in training {study.optuna.best_value:.4f})" if known else ""


def _play_trial(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> None:
    with suppress(UpdateFinishedTrialError):
        values = _trial_values(study, trial, play)
        if isinstance(values, FlockscopeError):
            if study.place(trial) == 0:
                raise values
            trial.set_user_attr(ERROR, values.line())
        study.tell(trial, None if isinstance(values, FlockscopeError) else values)


def _trial_values(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> list[float] | FlockscopeError:
    plan, played = study.plan, dict[int, Episode]()
    try:
        config = plan.config(trial.params).as_dict()
    except FlockscopeError as error:
        return error
    # Each trial has an order of its own, so that no few scenes decide about all trials.
    order = np.random.default_rng([plan.options.seed, study.place(trial)]).permutation(len(plan.training)).tolist()
    with closing(play([plan.training[k] for k in order], config, plan.needs_every_score)) as results:
        for k, result in zip(order, results, strict=True):
            if isinstance(result, FlockscopeError):
                return result
            played[k] = result
            if _should_prune(trial, k, result, plan) and len(played) < len(order):
                trial.set_user_attr(PRUNED, len(played))
                return [_estimate(study.optuna.best_trial, plan.goals[0], played)]
    values = [goal.mean([played[k] for k in sorted(played)]) for goal in plan.goals]
    unknown = [goal.key for goal, value in zip(plan.goals, values, strict=True) if value != value]
    if unknown:
        got, remedy = f"{unknown[0]} unknown in every training scene", "choose another score, suite or tracker"
        return InputError(place="--objective", got=got, expected="scenes that have this score", remedy=remedy)
    return values


def _should_prune(trial: optuna.Trial, scene: int, episode: Episode, plan: SearchPlan) -> bool:
    value = plan.goals[0].of(episode)
    if len(plan.goals) > 1 or value != value:
        return False
    trial.report(value, scene)
    return trial.should_prune()


def _estimate(best: optuna.trial.FrozenTrial, goal: Goal, played: dict[int, Episode]) -> float:
    assert best.value is not None
    pairs = [(goal.of(e), best.intermediate_values[k]) for k, e in played.items() if k in best.intermediate_values]
    gain = mean_of_known(goal.gain(theirs, own) for own, theirs in pairs)
    gain = min(gain, -LEAST_LOSS) if gain == gain else -LEAST_LOSS
    return best.value + gain if goal.higher else best.value - gain
