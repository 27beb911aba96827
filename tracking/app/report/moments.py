"""The worst moments of a report: which runs are shown, from which error on, and the data of their replays."""

from __future__ import annotations

import base64
import warnings
from collections.abc import Callable
from collections.abc import Sequence as SequenceOf
from dataclasses import replace

import cv2

from scenarios.errors import InputError
from sim.types import Image, Sequence
from tracking.app.replay_page.page import Run, page_data, script_json
from tracking.app.report.content import Moment, Played
from tracking.errors.found import CauseRow, FoundError, RunErrors, errors_of_run, sums_by_cause
from tracking.errors.groups import GroupError
from tracking.running.run import TrackingRun

COSTS = 8  # longest errors of a run, of which the dearest is shown
MOST = 12  # moments in a report
BYTES = 7_000_000  # of all their replays
AROUND = 6.0  # s that a replay shows before and after an error
LONGEST = 40.0  # s of a replay
JPEG_QUALITY = 60


Runs = Callable[[Played, str], tuple[Sequence, list[Run]]]  # the sequence, its run, and that of a rival, "" without


def chosen(played: SequenceOf[Played], most: int = MOST) -> list[Played]:
    """Returns at most `most` runs to show. The trackers take turns; each time a tracker's worst run that is left is
    taken, if possible of a scenario not yet shown for it. Each scene is shown once, by its worst run. Runs that are no
    worse than the oracle are left out."""
    waiting: dict[str, dict[str, Played]] = {}  # by tracker and scene, worst first
    bad = [one for one in played if not one.why and one.shortfall > 0]
    for one in sorted(bad, key=lambda one: -one.shortfall):
        waiting.setdefault(one.name, {}).setdefault(one.scene, one)
    shown: list[Played] = []
    while len(shown) < most and any(waiting.values()):
        for name, left in waiting.items():
            if left and len(shown) < most:
                seen = {one.scenario for one in shown if one.name == name}
                new = next((one for one in left.values() if one.scenario not in seen), next(iter(left.values())))
                shown.append(left.pop(new.scene))
    return sorted(shown, key=lambda one: -one.shortfall)


def moments(played: SequenceOf[Played], runs: Runs) -> list[Moment]:
    """Returns one `Moment` for each of the worst runs (`chosen`); once the replays exceed a size, `replay` is None.

    runs: a function of a run and the name of its rival ("" without one) to the sequence, the run with errors and their
    costs, and the rival's run. The rival is the best other tracker on the sequence.
    """
    found, size = [], 0
    for one in chosen(played):
        others = [p for p in played if p.sequence == one.sequence and p.name != one.name and not p.why]
        rival = max(others, key=lambda other: other.score, default=None)
        moment = _moment(one, *runs(one, "" if rival is None else rival.name))
        size += len(moment.replay or "")
        found.append(moment if size <= BYTES else replace(moment, replay=None))
    return found


def _moment(one: Played, sequence: Sequence, runs: list[Run]) -> Moment:
    dearest = dearest_error(runs[0].errors)
    length = sequence.length or len(runs[0].tracks)
    first, last = (1, length) if dearest is None else (dearest.error.start, dearest.error.end)
    around, longest = round(AROUND * sequence.fps), round(LONGEST * sequence.fps)
    low = max(first - around, 1)
    span = low, min(last + around, low + longest, length)
    start = max(first - round(sequence.fps), low)
    data = page_data(sequence, runs, span, start)
    data["background"], data["video"] = _background(sequence), None
    kind, words = ("", "") if dearest is None else (dearest.error.kind, _words(dearest))
    return Moment(one, (first - 1) / sequence.fps, kind, words, script_json(data))


def dearest_error(errors: SequenceOf[FoundError]) -> FoundError | None:
    """Returns the error whose repair alone adds most, None without errors."""
    return max(errors, key=lambda error: error.cost or 0.0, default=None)


def cause_rows(found: SequenceOf[tuple[str, RunErrors]]) -> list[tuple[str, CauseRow]]:
    """Returns pairs of a tracker and a `CauseRow`: what each kind and cause of errors costs it, as the mean over its
    runs. found: for each run, the tracker's name and its errors."""
    names = sorted({name for name, _ in found})
    runs = {name: [errors for other, errors in found if other == name and errors.scores] for name in names}
    return [(name, row) for name in names for row in sums_by_cause(runs[name])]


def _words(error: FoundError) -> str:
    score = "group_F1" if isinstance(error.error, GroupError) else "HOTA"
    costs = f", costs {error.cost:.3f} {score}" if error.cost else ""
    return f"{error.error.kind}: {error.who} ({error.cause.text or error.cause.name}){costs}"


def shown_errors(sequence: Sequence, run: TrackingRun, costs: int = 0, causes: bool = False) -> RunErrors:
    """Returns the errors of a run, without labels none; if tracks and labels cannot be compared, none and a warning.
    costs, causes: as of `find_errors`."""
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
    return data_address(pictures[-1])


def data_address(picture: Image) -> str:
    """Returns the address of a picture as JPEG that holds its bytes."""
    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg.tobytes()).decode()}"
