"""False alarms: how many, how long each stays, at people or elsewhere, of what size.

Unmatched boxes of neighbouring frames that overlap are one alarm (a chain). Of those seen in a frame the share that is
seen again n frames later is seen · exp(-n / (fps life)): a line in its logarithm gives both. A chain that mostly lies
on people is beside the one it lies on most; all others stand or drift on their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.schema.sensor import FalseAlarms
from sim.detector.visible_ground import VisibleGround
from sim.types import Array, Ints
from tracking.fitting.detection_matching import MatchedRecording, intersections, overlaps

LINK = 0.3  # overlap of one alarm with itself in the next frame it is seen
PAUSE = 0.5  # s: unseen for longer, it is another one
AGAIN = 1.5  # s: lags that tell the life
ON = 0.5  # share of an alarm's box that lies on people, in the median, if it is beside one
NEARLY = 0.6  # of the greatest such share: who has less is not the one
FEW = 5  # chains: fewer tell nothing about their kind
PLACES = 32  # at most, of `at`


@dataclass(frozen=True)
class AlarmTrack:
    """One false alarm of recording m: its detections in order; person: the id it is beside, -1 none."""

    m: MatchedRecording
    rows: Ints
    person: int

    @property
    def frame(self) -> Ints:
        """Of each of its detections."""
        return self.m.frame[self.rows]

    @property
    def box(self) -> Array:
        """(L, 4)."""
        return self.m.box[self.rows]


def fit_alarms(recordings: Sequence[MatchedRecording]) -> tuple[float, FalseAlarms | None]:
    """False alarms per frame, and what they are like; None where there are too few to tell."""
    chains = [chain for m in recordings for chain in alarm_tracks(m)]
    frames = sum(m.truth.length for m in recordings)
    rate = sum(len(c.rows) for c in chains) / frames
    if len(chains) < FEW:
        return rate, None
    life, seen = _life(recordings, chains)
    beside = [c for c in chains if c.person >= 0]
    apart = [c for c in chains if c.person < 0]
    near = sum(len(c.rows) for c in beside) / sum(len(c.rows) for c in chains)
    like = {"life": life, "seen": seen, "near": round(near, 4), "aspect": _aspect(chains), "jitter": _jitter(chains)}
    if len(beside) >= FEW:
        like |= _beside(beside)
    if len(apart) >= FEW:
        like |= _apart(apart)
    return rate, FalseAlarms(**like)


def alarm_tracks(m: MatchedRecording) -> list[AlarmTrack]:
    """The alarms of a recording, in the order of their first detection."""
    pause = max(1, round(PAUSE * m.truth.fps))
    made: list[list[int]] = []
    for index in np.unique(m.frame[m.false]).tolist():
        open_ = [c for c in made if m.frame[c[-1]] >= index - pause]
        here = np.flatnonzero(m.false & (m.frame == index))
        like = overlaps(m.box[[c[-1] for c in open_]], m.box[here]) if open_ else np.zeros((0, len(here)))
        taken: set[int] = set()
        used: set[int] = set()
        for flat in np.argsort(-like, axis=None, kind="stable"):
            i, j = divmod(int(flat), len(here))
            if like[i, j] >= LINK and i not in used and j not in taken:
                open_[i].append(int(here[j]))
                used.add(i)
                taken.add(j)
        made += [[int(row)] for j, row in enumerate(here) if j not in taken]
    return [AlarmTrack(m, np.array(rows), _person(m, rows)) for rows in made]


def _person(m: MatchedRecording, rows: list[int]) -> int:
    """Whom an alarm is beside, if people cover ON of its box in the median; -1 nobody.

    Of those it lies on nearly as much as on any, the one against whom it moves least.
    """
    assert m.truth.box is not None
    share: dict[int, float] = {}
    offset: dict[int, list[Array]] = {}
    covered = []
    for row in rows:
        r = m.truth.rows(int(m.frame[row]))
        box, people = m.box[row : row + 1], m.truth.box[r]
        on = intersections(box, people)[0] / (box[0, 2] * box[0, 3])
        covered.append(float(on.sum()))
        away = (box[0, :2] + box[0, 2:] * [0.5, 1.0] - people[:, :2] - people[:, 2:] * [0.5, 1.0]) / people[:, 3:]
        for k in np.flatnonzero(on > 0):
            id = int(m.truth.id[r][k])
            share[id] = share.get(id, 0.0) + float(on[k])
            offset.setdefault(id, []).append(away[k])
    if not share or np.median(covered) < ON:
        return -1
    likely = [id for id, s in share.items() if s >= NEARLY * max(share.values())]
    return min(likely, key=lambda id: (float(np.std(offset[id], axis=0).sum()), -share[id]))


def _life(recordings: Sequence[MatchedRecording], chains: Sequence[AlarmTrack]) -> tuple[float, float]:
    """life s and seen, by how many alarms are seen again after so many frames."""
    lag, share, weight = [], [], []
    for m in recordings:
        mine = [set(c.frame.tolist()) for c in chains if c.m is m]
        for n in range(1, max(2, round(AGAIN * m.truth.fps))):
            before = [(f, c) for c in mine for f in c if f + n <= m.truth.length]
            again = sum(f + n in c for f, c in before)
            if again:
                lag.append(n / m.truth.fps)
                share.append(again / len(before))
                weight.append(again)
    if not lag or max(share) < 0.05:
        return 0.0, 1.0
    if len(lag) == 1:
        return round(float(-lag[0] / np.log(min(share[0], 0.98))), 3), 1.0
    slope, level = np.polyfit(lag, np.log(share), 1, w=np.sqrt(weight))
    if slope > -1.0 / 60.0:
        slope, level = -1.0 / 60.0, float(np.average(np.log(share), weights=weight))
    if level > 0.0:  # seen whenever it is there
        w = np.array(weight) * np.array(lag)
        slope, level = float(w @ np.log(share) / (w @ np.array(lag))), 0.0
    return round(-1.0 / min(float(slope), -1.0 / 60.0), 3), round(float(np.exp(max(level, np.log(0.2)))), 4)


def _weighted(values: Sequence[float], chains: Sequence[AlarmTrack]) -> tuple[float, float]:
    """Middle and spread (median, half of the middle 68 %); chains that are seen often count for more, by the root.

    Not mean and sd: of alarms said to be beside somebody some are not, and the other way round.
    """
    order = np.argsort(values, kind="stable")
    w, v = np.sqrt([len(c.rows) for c in chains])[order], np.array(values)[order]
    low, middle, high = np.interp((0.16, 0.5, 0.84), (np.cumsum(w) - w / 2) / w.sum(), v)
    return round(float(middle), 4), round(float(high - low) / 2, 4)


def _aspect(chains: Sequence[AlarmTrack]) -> tuple[float, float]:
    return _weighted([float(np.log(c.box[:, 2] / c.box[:, 3]).mean()) for c in chains], chains)


def _jitter(chains: Sequence[AlarmTrack]) -> float:
    """sd of edges in heights: of x_(t-1) - 2 x_t + x_(t+1), which knows no steady way, over sqrt 6; by its median."""
    bends = [np.zeros((0, 4))]
    for c in chains:
        edges = np.concatenate([c.box[:, :2], c.box[:, :2] + c.box[:, 2:]], axis=1) / c.box[:, 3].mean()
        steady = (np.diff(c.frame)[1:] == 1) & (np.diff(c.frame)[:-1] == 1)
        bends.append(np.diff(edges, n=2, axis=0)[steady])
    size = np.abs(np.concatenate(bends))
    return round(float(1.4826 * np.median(size) / np.sqrt(6.0)), 4) if len(size) else 0.0


def _beside(chains: Sequence[AlarmTrack]) -> dict[str, tuple[float, float]]:
    """Places and sizes against the persons they are beside."""
    rows = []
    for c in chains:
        truth = c.m.truth
        assert truth.box is not None
        mine = np.flatnonzero(truth.id == c.person)
        at = np.searchsorted(truth.frame[mine], c.frame)
        there = (at < len(mine)) & (truth.frame[mine[np.minimum(at, len(mine) - 1)]] == c.frame)
        who, box = truth.box[mine[at[there]]], c.box[there]
        h = who[:, 3]
        across = (box[:, 0] + box[:, 2] / 2 - who[:, 0] - who[:, 2] / 2) / h
        foot = (box[:, 1] + box[:, 3] - who[:, 1] - h) / h
        rows.append((across.mean(), foot.mean(), np.log(box[:, 3] / h).mean()))
    columns = np.array(rows, dtype=float).T
    return {
        name: _weighted(list(v), chains) for name, v in zip(("across", "foot", "near_height"), columns, strict=True)
    }


def _apart(chains: Sequence[AlarmTrack]) -> dict[str, object]:
    """Sizes against those of people standing there, places, and how fast they drift."""
    height, place, speed = [], [], []
    for c in chains:
        ground = VisibleGround(c.m.truth, c.m.camera, np.array(c.m.size, dtype=float))
        middle, foot = c.box[:, 0] + c.box[:, 2] / 2, c.box[:, 1] + c.box[:, 3]
        usual = [max(ground.usual_height(float(u), float(v)), 1.0) for u, v in zip(middle, foot, strict=True)]
        height.append(float(np.log(c.box[:, 3] / usual).mean()))
        span = np.maximum(ground.high - ground.low, 1.0)
        place += [
            tuple(np.clip((np.array([u, v]) - ground.low) / span, 0, 1)) for u, v in zip(middle, foot, strict=True)
        ]
        seconds = (c.frame[-1] - c.frame[0]) / c.m.truth.fps
        if len(c.rows) >= 4:
            ways = np.array([middle[-1] - middle[0], foot[-1] - foot[0]]) / (c.box[:, 3].mean() * seconds)
            speed.append(ways)
    drift = float(np.sqrt(np.mean(np.square(speed)))) if speed else 0.0
    chosen = np.unique(np.round(np.linspace(0, len(place) - 1, min(PLACES, len(place)))).astype(int))
    at = tuple((round(float(place[k][0]), 3), round(float(place[k][1]), 3)) for k in chosen)
    return {"height": _weighted(height, chains), "drift": round(drift, 4), "at": at}
