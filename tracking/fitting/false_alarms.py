"""Fits false alarms: how many, how long each lasts, whether it moves with a person, and its position and size.

Unmatched detections are linked over time to alarm tracks. Of the alarms detected in a frame, the share detected again n
frames later is seen · exp(-n / (fps life)): seen is the probability that an alarm that still lasts is detected in a
frame, life its mean life in s, fps the frames per s. A line fitted to the logarithm of this share gives seen and life.
An alarm that mostly lies on people belongs to one person; all others stand or drift on their own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.schema.sensor import FalseAlarms
from sim.detector.visible_ground import VisibleGround
from sim.geometry.boxes import box_intersections, box_iou
from sim.types import Array, Ints
from tracking.fitting.detection_matching import MatchedRecording

LINK = 0.3  # least IoU of two successive detections of one alarm
PAUSE = 0.5  # s: an alarm that is not detected for longer ends
AGAIN = 1.5  # s: longest lag used for the mean life
LEAST_AGAIN = 0.05  # with smaller shares of alarms detected again, every alarm lasts one frame
LONGEST = 60.0  # s: greatest mean life
ON = 0.5  # an alarm belongs to a person if people cover this share of its box, in the median over its detections
FEW = 5  # with fewer alarm tracks of a kind, nothing is fitted for this kind
PLACES = 32  # greatest number of foot points in `at`


@dataclass(frozen=True)
class AlarmTrack:
    """One false alarm over time."""

    recording: MatchedRecording  # where it occurred
    rows: Ints  # (L,): indices of its detections in the recording, in order of time
    person: int  # id of the labelled person it belongs to, -1 none

    @property
    def frame(self) -> Ints:
        """Frame number of each detection of the alarm, from 1, (L,)."""
        return self.recording.frame[self.rows]

    @property
    def box(self) -> Array:
        """Box of each detection of the alarm, (L, 4): left, top, width, height in px."""
        return self.recording.box[self.rows]


def fit_false_alarms(recordings: Sequence[MatchedRecording]) -> tuple[float, FalseAlarms | None]:
    """Returns the mean number of false alarms per frame, and their profile (None with fewer than 5 alarm tracks)."""
    tracks = [track for m in recordings for track in alarm_tracks(m)]
    frames = sum(m.truth.length for m in recordings)
    rate = sum(len(t.rows) for t in tracks) / max(frames, 1)
    if len(tracks) < FEW:
        return rate, None
    life, seen = _life_and_seen(recordings, tracks)
    at_people, elsewhere = [t for t in tracks if t.person >= 0], [t for t in tracks if t.person < 0]
    near = sum(len(t.rows) for t in at_people) / sum(len(t.rows) for t in tracks)
    aspect = _robust_spread([float(np.log(t.box[:, 2] / t.box[:, 3]).mean()) for t in tracks], tracks)
    found = {"life": life, "seen": seen, "near": round(near, 4), "aspect": aspect, "jitter": _jitter(tracks)}
    if len(at_people) >= FEW:
        found |= _fit_at_people(at_people)
    if len(elsewhere) >= FEW:
        found |= _fit_elsewhere(elsewhere)
    return rate, FalseAlarms(**found)


def alarm_tracks(m: MatchedRecording) -> list[AlarmTrack]:
    """Returns the false alarms of a recording as tracks over time, in the order of their first detection."""
    pause = max(1, round(PAUSE * m.truth.fps))
    found: list[list[int]] = []
    open_: list[list[int]] = []
    alarms = np.flatnonzero(m.false)
    alarms = alarms[np.argsort(m.frame[alarms], kind="stable")]
    for here in np.split(alarms, np.flatnonzero(np.diff(m.frame[alarms])) + 1) if len(alarms) else []:
        open_ = [rows for rows in open_ if m.frame[rows[-1]] >= m.frame[here[0]] - pause]
        iou = box_iou(m.box[[rows[-1] for rows in open_], None], m.box[here]) if open_ else np.zeros((0, len(here)))
        linked: set[int] = set()
        while iou.size and iou.max() >= LINK:
            i, j = divmod(int(iou.argmax()), len(here))
            open_[i].append(int(here[j]))
            iou[i], iou[:, j] = -1.0, -1.0
            linked.add(j)
        new = [[int(row)] for j, row in enumerate(here) if j not in linked]
        found += new
        open_ += new
    return [AlarmTrack(m, np.array(rows), _person_of_alarm(m, rows)) for rows in found]


def _person_of_alarm(m: MatchedRecording, rows: list[int]) -> int:
    """Returns the id of the labelled person that an alarm belongs to, -1 none."""
    assert m.truth.box is not None
    share, covered = Counter[int](), []
    for row in rows:
        r = m.truth.rows(int(m.frame[row]))
        on = box_intersections(m.box[row], m.truth.box[r]) / (m.box[row, 2] * m.box[row, 3])
        covered.append(float(on.sum()))
        share.update(dict(zip(m.truth.id[r].tolist(), on.tolist(), strict=True)))
    return share.most_common(1)[0][0] if np.median(covered) >= ON else -1


def _life_and_seen(recordings: Sequence[MatchedRecording], tracks: Sequence[AlarmTrack]) -> tuple[float, float]:
    """Returns the mean life of a false alarm, s, and the probability that a living one is detected in a frame."""
    found = []
    for m in recordings:
        frames_of_tracks = [set(t.frame.tolist()) for t in tracks if t.recording is m]
        for n in range(1, max(2, round(AGAIN * m.truth.fps))):
            before = [(f, frames) for frames in frames_of_tracks for f in frames if f + n <= m.truth.length]
            again = sum(f + n in frames for f, frames in before)
            if again:
                found.append((n / m.truth.fps, again / len(before), again))
    lag, share, weight = np.array(found).reshape(-1, 3).T
    if not len(lag) or share.max() < LEAST_AGAIN:
        return 0.0, 1.0
    if len(lag) == 1:
        return round(float(-lag[0] / np.log(min(share[0], 0.98))), 3), 1.0
    # share = seen · exp(-lag / life)
    slope, level = np.polyfit(lag, np.log(share), 1, w=np.sqrt(weight))
    return round(-1.0 / min(float(slope), -1.0 / LONGEST), 3), round(float(np.clip(np.exp(level), 0.2, 1.0)), 4)


def _robust_spread(values: Sequence[float], tracks: Sequence[AlarmTrack]) -> tuple[float, float]:
    """Returns the weighted median and half the width of the middle 68 %: some alarms get a wrong person."""
    order = np.argsort(values, kind="stable")
    w, v = np.sqrt([len(t.rows) for t in tracks])[order], np.array(values)[order]
    low, middle, high = np.interp((0.16, 0.5, 0.84), (np.cumsum(w) - w / 2) / w.sum(), v)
    return round(float(middle), 4), round(float(high - low) / 2, 4)


def _jitter(tracks: Sequence[AlarmTrack]) -> float:
    """Returns the standard deviation of an alarm box's edge from frame to frame, in mean box heights."""
    second_differences = [np.zeros((0, 4))]
    for t in tracks:
        edges = np.concatenate([t.box[:, :2], t.box[:, :2] + t.box[:, 2:]], axis=1) / t.box[:, 3].mean()
        steady = (np.diff(t.frame)[1:] == 1) & (np.diff(t.frame)[:-1] == 1)
        # steady motion leaves second differences at 0; 1.4826 and sqrt 6 make their median the standard deviation
        second_differences.append(np.diff(edges, n=2, axis=0)[steady])
    size = np.abs(np.concatenate(second_differences))
    return round(float(1.4826 * np.median(size) / np.sqrt(6.0)), 4) if len(size) else 0.0


def _fit_at_people(tracks: Sequence[AlarmTrack]) -> dict[str, tuple[float, float]]:
    """Returns across, foot and near_height of `FalseAlarms`, relative to the alarm's person."""
    rows = []
    for t in tracks:
        truth = t.recording.truth
        assert truth.box is not None
        own = np.flatnonzero(truth.id == t.person)
        at = np.searchsorted(truth.frame[own], t.frame)
        present = (at < len(own)) & (truth.frame[own[np.minimum(at, len(own) - 1)]] == t.frame)
        person, box = truth.box[own[at[present]]], t.box[present]
        h = person[:, 3]
        across = (box[:, 0] + box[:, 2] / 2 - person[:, 0] - person[:, 2] / 2) / h
        foot = (box[:, 1] + box[:, 3] - person[:, 1] - h) / h
        rows.append((across.mean(), foot.mean(), np.log(box[:, 3] / h).mean()))
    columns = np.array(rows, dtype=float).T
    names = ("across", "foot", "near_height")
    return {name: _robust_spread(list(v), tracks) for name, v in zip(names, columns, strict=True)}


def _fit_elsewhere(tracks: Sequence[AlarmTrack]) -> dict[str, object]:
    """Returns height, drift and at of `FalseAlarms`, of alarms that belong to no person."""
    height, place, velocity = [], list[Array](), []
    for t in tracks:
        ground = VisibleGround(t.recording.truth, t.recording.camera, np.array(t.recording.size, dtype=float))
        foot = t.box[:, :2] + t.box[:, 2:] * [0.5, 1.0]
        usual = [max(ground.usual_height(u, v), 1.0) for u, v in foot.tolist()]
        height.append(float(np.log(t.box[:, 3] / usual).mean()))
        place += [*np.clip((foot - ground.low) / np.maximum(ground.high - ground.low, 1.0), 0, 1)]
        if len(t.rows) >= 4:
            seconds = (t.frame[-1] - t.frame[0]) / t.recording.truth.fps
            velocity.append((foot[-1] - foot[0]) / (t.box[:, 3].mean() * seconds))
    drift = float(np.sqrt(np.mean(np.square(velocity)))) if velocity else 0.0
    chosen = np.unique(np.round(np.linspace(0, len(place) - 1, min(PLACES, len(place)))).astype(int))
    at = tuple(tuple(np.round(place[k], 3).tolist()) for k in chosen)
    return {"height": _robust_spread(height, tracks), "drift": round(drift, 4), "at": at}
