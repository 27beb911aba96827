"""The study: Optuna's record of all trials in a storage, which a search can resume and several processes can share.

`open_study` opens it as a `SearchStudy`, which gives the next trial to play, stores values, and lists finished trials.

Several processes may share a journal or an SQLite file, and any of them may be killed at any time. The lock FILE.lock
is held while a trial is chosen and while lines are written. The lock FILE.trial-N.lock is held while trial N is played.
The system releases the locks of a process that dies, so another process sees that its trial was abandoned, and plays
it.

`run_trials` is the loop of a search: one trial (set of parameters) after the other, each played on the training scenes.
"""

from __future__ import annotations

import os
import re
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any, cast

import optuna
from filelock import FileLock, Timeout
from optuna.exceptions import UpdateFinishedTrialError
from optuna.samplers import RandomSampler
from optuna.storages import JournalStorage, get_storage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState

from scenarios.errors import FlockscopeError, InputError
from tracking.episodes.episode import Episode
from tracking.running.used_files import UsedFiles, changes, relative
from tracking.tuning.candidates import STORED, TrialRecord
from tracking.tuning.episode_player import PlayEpisodes
from tracking.tuning.options import Progress
from tracking.tuning.sampler import distribution, propose
from tracking.tuning.search_plan import SearchPlan

SQLITE = re.compile(r"sqlite(?:\+\w+)?:///(?!:memory:)([^?]+)(?:\?.*)?")  # URL of a file, which gets locks, too
HEAD = b'{"op_code":'  # How every journal begins.


class StudyLocks:
    """The locks of a study that is stored in `file`, shared by the processes of a search. Without a file (None) nothing
    is locked.

    State: `study`, the lock of the study, which this process may take again while it holds it; the locks of the trials
    that this process plays, by number.
    """

    def __init__(self, file: Path | None) -> None:
        self.study: AbstractContextManager[object] = nullcontext()
        self.file, self._trials = file, dict[int, FileLock]()
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            self.study = FileLock(f"{file}.lock")

    def take_trial(self, number: int) -> bool:
        """Locks a trial and returns True; returns False if it is locked already, or without a file."""
        if self.file is not None:
            lock = FileLock(f"{self.file}.trial-{number}.lock", blocking=False)
            with suppress(Timeout):
                lock.acquire()
                self._trials[number] = lock
        return number in self._trials

    def release_trial(self, number: int) -> None:
        """Releases the lock of a finished trial and removes its file; does nothing if this process does not hold it."""
        if number in self._trials:
            self._trials.pop(number).release()
            Path(f"{self.file}.trial-{number}.lock").unlink(missing_ok=True)

    def close(self) -> None:
        """Releases the locks of all trials, whose files stay for the processes that take these trials over."""
        for lock in self._trials.values():
            lock.release()


def _journal(file: Path, lock: object) -> JournalStorage:
    """Returns the storage in a journal, without an incomplete last line, which a killed process leaves. Raises
    ValueError if the file is no journal."""
    content = file.read_bytes() if file.exists() else b""
    if not HEAD.startswith(content[: len(HEAD)]):
        raise ValueError("no journal of Optuna")
    if content[-1:] not in (b"", b"\n"):
        os.truncate(file, content.rfind(b"\n") + 1)
    return JournalStorage(JournalFileBackend(str(file), cast(Any, lock)))


SETTINGS = "settings"  # Attribute of a study that holds the identity of its plan.
USED = "used"  # Attribute of a study that holds what its tracker has used, as `used_files.used`.
# Attributes of a trial: why its parameters are impossible; of the first trial: for each scene why it was left out.
ERROR, LEFT_OUT = "error", "left out"

# States of a finished trial. PRUNED means impossible parameters.
FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)


class SearchStudy:
    """An open study of a search (Optuna's record of its trials), which several processes can share.

    A new study gets the defaults as its first trial.
    """

    def __init__(self, plan: SearchPlan, study: optuna.Study, locks: StudyLocks, storage: object = None) -> None:
        self.plan, self.optuna, self.locks, self._used = plan, study, locks, UsedFiles()
        self._folder = plan.tracker.folder
        self._space = {p.name: distribution(p) for p in plan.space}
        with self.locks.study:
            if not self.trials() and SETTINGS not in study.user_attrs:
                study.set_user_attr(SETTINGS, plan.identity())
            _check_identity(plan, study, storage)
            self._used.update(study.user_attrs.get(USED, {}))
            if not self.trials():
                study.enqueue_trial(dict(plan.defaults))

    def note(self, used: Mapping[str, str]) -> None:
        """Stores what the tracker has used in an episode; a search that goes on needs all of it unchanged."""
        used = relative(used, self._folder)  # so that the study can be moved with the tracker
        if used.items() <= self._used.items():
            return
        with self.locks.study:
            self._used.add(self.plan.tracker_name, used)
            self._used.update(self.optuna.user_attrs.get(USED, {}))
            self.optuna.set_user_attr(USED, dict(self._used))

    def taken_over(self) -> dict[str, Any]:
        """Returns the number of finished trials and of episodes on held-out scenes that are stored, and when the last
        trial ended, None if there is none."""
        finished, attributes = self.finished(), self.optuna.user_attrs
        ends = [trial.datetime_complete for trial in finished if trial.datetime_complete is not None]
        episodes = sum(len(value) for key, value in attributes.items() if key.startswith(STORED))
        stored = f"{max(ends):%Y-%m-%d %H:%M}" if ends else None
        return {"trials": len(finished), "episodes": episodes, "stored": stored}

    def trials(self) -> list[FrozenTrial]:
        """Returns all of Optuna's trials in the order of their numbers."""
        return self.optuna.get_trials(deepcopy=False)

    def finished(self) -> list[FrozenTrial]:
        """Returns Optuna's finished trials, sorted by number: complete or impossible ones."""
        return [t for t in self.trials() if t.state in FINISHED]

    def ask(self, take_running: bool = False) -> optuna.Trial | None:
        """Returns the next trial to play, locked for this process; None if enough trials were begun.

        A trial that another process began and abandoned comes first. take_running: True takes running trials for
        abandoned if the study has no locks.
        """
        with self.locks.study:
            trials = self.trials()
            begun = [t for t in trials if t.state in (*FINISHED, TrialState.RUNNING)]
            for t in begun:
                if t.state == TrialState.RUNNING and (take_running or self.locks.take_trial(t.number)):
                    trial = optuna.Trial(self.optuna, t._trial_id)
                    for name, choices in self._space.items():  # the process may have ended before it had stored all
                        trial._suggest(name, choices)
                    return trial
            if len(begun) >= self.plan.options.trials:
                return None
            if not any(t.state == TrialState.WAITING for t in trials):
                propose(self.plan, self.optuna, len(trials))
            trial = self.optuna.ask(self._space)
            self.locks.take_trial(trial.number)
            return trial

    def tell(self, trial: optuna.Trial, values: Sequence[float] | None) -> None:
        """Stores the values of a trial, one per goal, and releases its lock; None: the parameters are impossible."""
        state = TrialState.PRUNED if values is None else TrialState.COMPLETE
        self.optuna.tell(trial, values, state, skip_if_finished=True)
        self.locks.release_trial(trial.number)

    def records(self) -> list[TrialRecord]:
        """Returns the finished trials, sorted by number; number 0 is the defaults."""
        return [self._record(t) for t in self.finished()]

    def _record(self, t: FrozenTrial) -> TrialRecord:
        return TrialRecord(t.number, tuple(t.values or ()), dict(t.params), t.user_attrs.get(ERROR, ""))

    def left_out(self) -> list[str]:
        """Returns for each training scene, in order, why it was left out, "" if it was not."""
        return list(self.trials()[0].user_attrs[LEFT_OUT])

    def importance(self) -> dict[str, float]:
        """Returns by parameter the share (0 to 1) of the first goal's training values that it explains (PED-ANOVA). All
        shares are 0 with fewer than two different values."""
        from optuna.importance import get_param_importances

        names = [p.name for p in self.plan.space]
        known = [t.values[0] for t in self.records() if t.values]
        if len(known) < 2 or min(known) == max(known):
            return dict.fromkeys(names, 0.0)
        sign = -1 if self.plan.goals[0].higher else 1  # PED-ANOVA explains low values, and warns about a custom target
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return dict(get_param_importances(self.optuna, params=names, target=lambda t: sign * t.values[0]))


@contextmanager
def open_study(plan: SearchPlan, storage: str | Path | None, name: str) -> Iterator[SearchStudy]:
    """Context manager: opens or creates the study `name`, and yields it as a `SearchStudy`. storage: a journal file, a
    URL (with "://"), or None for memory. Raises InputError if it cannot be opened or is of another search."""
    url = str(storage) if "://" in str(storage) else None
    file = Path(storage) if storage is not None and url is None else None
    database = SQLITE.fullmatch(url or "")
    with quiet_optuna(), closing(StudyLocks(Path(database[1]) if database else file)) as locks:
        try:
            with locks.study:
                place = get_storage(url) if file is None else _journal(file, locks.study)
                if plan.options.fresh:
                    with suppress(KeyError):  # there is no such study
                        optuna.delete_study(study_name=name, storage=place)
                study = optuna.create_study(
                    storage=place, study_name=name, load_if_exists=True,
                    directions=["maximize" if goal.higher else "minimize" for goal in plan.goals],
                    sampler=RandomSampler(0),  # draws nothing: all trials are enqueued
                )  # fmt: skip
        except OSError:
            raise
        except Exception as error:  # each database has its own
            raise InputError(
                file=storage, place="--storage", got=f"{type(error).__name__}: {error}".partition("\n")[0],
                expected="a journal that `flockscope tune` wrote, or the URL of a database, with its driver installed",
                remedy="correct it, or choose another --out or --storage",
            ) from error  # fmt: skip
        yield SearchStudy(plan, study, locks, storage)


def _check_identity(plan: SearchPlan, study: optuna.Study, storage: object) -> None:
    mine, stored = plan.identity(), study.user_attrs.get(SETTINGS, {})
    remedy = "begin anew with --fresh, or choose another --out or --study"
    if different := [key for key in {**mine, **stored} if stored.get(key) != mine.get(key)]:
        key, got = different[0], f"another search: {', '.join(different)} differ"
        expected = f"{key} {stored.get(key)}, not {mine.get(key)}"
        remedy = f"{remedy}, or repeat the command that began it"
    elif changed := changes(study.user_attrs.get(USED, {}), plan.tracker.folder):
        got, expected = f"trials made before {', '.join(changed)} changed", "the tracker as it was"
    else:
        return
    raise InputError(file=storage, place=f"study {study.study_name}", got=got, expected=expected, remedy=remedy)


@contextmanager
def quiet_optuna() -> Iterator[None]:
    """Context manager: keeps Optuna from printing messages, except errors, while the block runs."""
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)


PAUSE = 0.5  # Seconds between two looks at whether other processes have finished.


def run_trials(study: SearchStudy, play: PlayEpisodes, progress: Progress) -> None:
    """Plays trials until the study has as many finished ones as planned, by this process or by others."""
    take_running, planned = False, study.plan.options.trials
    while True:
        progress(len(study.finished()), planned, _best_so_far(study))
        trial = study.ask(take_running)
        if trial is not None:
            with suppress(UpdateFinishedTrialError):  # another process plays it, too, and was faster
                _play_trial(study, trial, play)
        elif len(study.finished()) >= planned and study.trials()[0].state.is_finished():
            return
        elif study.locks.file is not None:
            time.sleep(PAUSE)
        else:
            take_running = True


def _best_so_far(study: SearchStudy) -> str:
    known = len(study.plan.goals) == 1 and any(t.value is not None for t in study.finished())
    return f"(best in training {study.optuna.best_value:.4f})" if known else ""


def _play_trial(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> None:
    values = _trial_values(study, trial, play)
    if isinstance(values, FlockscopeError):
        if trial.number == 0:
            raise values
        trial.set_user_attr(ERROR, values.line())
    study.tell(trial, None if isinstance(values, FlockscopeError) else values)


def _trial_values(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> list[float] | FlockscopeError:
    plan, played = study.plan, list[Episode]()
    try:
        config = plan.config(trial.params).as_dict()
    except FlockscopeError as error:
        return error
    with closing(play(plan.training, config, plan.needs_every_score)) as results:
        for result in results:
            if isinstance(result, FlockscopeError):
                return result
            played.append(result)
    if trial.number == 0:
        trial.set_user_attr(LEFT_OUT, [episode.left_out for episode in played])
    values = [goal.mean(played) for goal in plan.goals]
    unknown = [goal.key for goal, value in zip(plan.goals, values, strict=True) if value != value]
    if unknown:
        got, remedy = f"{unknown[0]} unknown in every training scene", "choose another score, suite or tracker"
        return InputError(place="--objective", got=got, expected="scenes that have this score", remedy=remedy)
    return values
