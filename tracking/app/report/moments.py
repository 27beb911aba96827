"""The worst moments of a report: which runs are shown, from which error on, and the data of their replays."""

from __future__ import annotations

import base64
import math
import warnings
from collections.abc import Callable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace

import cv2

from scenarios.errors import InputError
from sim.types import Sequence
from tracking.app.replay_page.page import Run, page_data, script_json
from tracking.app.report.content import CauseBar, Moment
from tracking.errors.found import FoundError, RunErrors, errors_of_run, sums_by_cause
from tracking.errors.groups import GroupError
from tracking.running.run import TrackingRun

GAINS = ("HOTA", "group_F1")
COSTS = 8  # longest errors of a run, of which the dearest is shown
MOST = 12  # moments in a report
BYTES = 7_000_000  # of all their replays
AROUND = 6.0  # s that a replay shows before and after an error
LONGEST = 40.0  # s of a replay
JPEG_QUALITY = 60


@dataclass(frozen=True)
class Candidate:
    """A run of one sequence that may be shown."""

    name: str
    scenario: str
    sequence: str
    score: float
    best: float  # the oracle's score
    rival: str  # the best other tracker there, "" without one
    command: str = ""  # generates the sequence

    @property
    def shortfall(self) -> float:
        """What the run lacks beside the oracle."""
        return (1.0 if self.best != self.best else self.best) - self.score


Runs = Callable[[Candidate], tuple[Sequence, Run, Run | None]]  # the sequence, its run, the rival's


def chosen(candidates: SequenceOf[Candidate], most: int = MOST) -> list[Candidate]:
    """Returns the runs that are shown, worst first: in turn each tracker's worst, of another scenario if it can be."""
    waiting: dict[str, list[Candidate]] = {}
    for one in sorted((one for one in candidates if one.shortfall > 0), key=lambda one: -one.shortfall):
        waiting.setdefault(one.name, []).append(one)
    shown: list[Candidate] = []
    while len(shown) < most and any(waiting.values()):
        for name, left in waiting.items():
            if left and len(shown) < most:
                seen = {one.scenario for one in shown if one.name == name}
                new = next((one for one in left if one.scenario not in seen), left[0])
                left.remove(new)
                shown.append(new)
    return sorted(shown, key=lambda one: -one.shortfall)


def moments(candidates: SequenceOf[Candidate], runs: Runs) -> list[Moment]:
    """Returns the worst moments, with replays as far as the report stays small; runs: with costs of their errors."""
    found, size = [], 0
    for one in chosen(candidates):
        moment = _moment(one, *runs(one))
        size += len(moment.replay or "")
        found.append(moment if size <= BYTES else replace(moment, replay=None))
    return found


def _moment(one: Candidate, sequence: Sequence, run: Run, rival: Run | None) -> Moment:
    dearest = max(run.errors, key=lambda error: error.cost or 0.0, default=None)
    length = sequence.length or len(run.tracks or ())
    first, last = (1, length) if dearest is None else (dearest.error.start, dearest.error.end)
    around, longest = round(AROUND * sequence.fps), round(LONGEST * sequence.fps)
    low = max(first - around, 1)
    span = low, min(last + around, low + longest, length)
    start = max(first - round(sequence.fps), low)
    data = page_data(sequence, run, rival, span=span, start=start)
    data["background"], data["video"] = _background(sequence), None
    kind, words = ("", "") if dearest is None else (dearest.error.kind, _words(dearest))
    known = (one.name, one.scenario, one.sequence, one.score, one.best)
    return Moment(*known, (first - 1) / sequence.fps, kind, words, script_json(data), one.command)


def cause_bars(found: SequenceOf[tuple[str, RunErrors]]) -> list[CauseBar]:
    """Returns what each kind and cause of errors costs each tracker, mean over its runs; found: trackers and runs."""
    bars = []
    for name in sorted({name for name, _ in found}):
        for row in sums_by_cause([errors for other, errors in found if other == name and errors.scores]):
            gains = {key: 0.0 if math.isnan(row.gains[key]) else row.gains[key] for key in GAINS}
            bars.append(CauseBar(name, row.kind, row.cause, row.errors, row.seconds, gains))
    return bars


def _words(error: FoundError) -> str:
    score = "group_F1" if isinstance(error.error, GroupError) else "HOTA"
    costs = f", costs {error.cost:.3f} {score}" if error.cost else ""
    return f"{error.error.kind}: {error.who} ({error.cause.text or error.cause.name}){costs}"


def shown_errors(sequence: Sequence, run: TrackingRun, costs: int = 0, causes: bool = False) -> RunErrors:
    """Returns the errors of a run; none, with a warning, where tracks and labels cannot be compared."""
    none = RunErrors([], {}, [], {})
    if sequence.truth is None:
        return none
    try:
        return errors_of_run(sequence, run, costs=costs, causes=causes)
    except InputError as error:
        warnings.warn(f"{sequence.name}: the page shows no errors: {error.got}", stacklevel=2)
        return none


def _background(sequence: Sequence) -> str | None:
    """Returns the picture of the empty scene as a data address; None without pictures."""
    pictures = sequence.background() if sequence.has_images else None
    if pictures is None or not len(pictures):
        return None
    _, jpeg = cv2.imencode(".jpg", pictures[-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg.tobytes()).decode()}"
