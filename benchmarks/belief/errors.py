"""Positions as cameras measure them: errors correlated over time, larger along the line of sight, misses, switched ids.

The error of a person is a first-order autoregressive process e_t = a e_(t-1) + sqrt(1 - a²) n_t over the person's rows,
a = exp(-dt / time), n normal with the standard deviations `across` and `along`. Both functions of time run by rows, so
that a gap does not age the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sim.types import Truth

ROWS = (
    "frame", "id", "group", "subgroup", "pos", "vel", "box", "visible_box", "visibility", "truncation", "z", "heading",
    "height",
)  # fmt: skip
SWITCHING = 2.0  # m: people nearer than this to each other may switch ids


@dataclass(frozen=True)
class Errors:
    """Errors of positions, m: standard deviations across and along the line of sight."""

    across: float
    along: float
    time: float = 1.0  # correlation time, s; 0: of each frame its own
    turn_deg: float = 0.0  # of the line of sight, from y to the left

    @property
    def text(self) -> str:
        """The two standard deviations as in "0.1/0.3"."""
        return f"{self.across:g}/{self.along:g}"


SIZES = (Errors(0.0, 0.0), Errors(0.1, 0.3), Errors(0.15, 0.6), Errors(0.2, 1.0))


def with_errors(truth: Truth, errors: Errors, seed: int) -> Truth:
    """Returns a truth whose positions err; without velocities and boxes."""
    assert truth.pos is not None
    stay = np.exp(-1 / (truth.fps * errors.time)) if errors.time else 0.0
    sd = np.array([errors.across, errors.along])
    new = np.random.default_rng(seed).normal(size=truth.pos.shape) * sd
    for id in np.unique(truth.id):
        own = np.flatnonzero(truth.id == id)
        new[own[1:]] *= np.sqrt(1 - stay**2)
        new[own] = lfilter([1.0], [1.0, -stay], new[own], axis=0)
    turn = np.radians(errors.turn_deg)
    turned = new @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return truth.replace(pos=truth.pos + turned, vel=None, box=None, visible_box=None)


def of_rows(truth: Truth, rows: np.ndarray) -> Truth:
    """Returns a truth of some of its rows, an index or flags, in an order by frame."""
    return truth.replace(**{name: value[rows] for name in ROWS if (value := getattr(truth, name)) is not None})


def missed(truth: Truth, share: float, seed: int) -> Truth:
    """Returns a truth of which this share of the rows is missing."""
    return of_rows(truth, np.random.default_rng(seed).random(len(truth.id)) >= share)


def switched(truth: Truth, seconds: float, seed: int) -> Truth:
    """Returns a truth in which any two people within 2 m of each other switch ids once in `seconds` on average. The
    tracks of both then jump by their distance; labels stay with the people."""
    assert truth.pos is not None
    r, id = np.random.default_rng(seed), truth.id.copy()
    name = {own: own for own in np.unique(id).tolist()}
    for index in range(1, truth.length + 1):
        rows = truth.rows(index)
        own, pos = truth.id[rows].tolist(), truth.pos[rows]
        i, j = np.triu_indices(len(own), 1)
        near = np.flatnonzero(np.hypot(*(pos[i] - pos[j]).T) < SWITCHING)
        for k in near[r.random(len(near)) < 1 / (seconds * truth.fps)]:
            a, b = own[i[k]], own[j[k]]
            name[a], name[b] = name[b], name[a]
        id[rows] = [name[each] for each in own]
    return of_rows(truth.replace(id=id), np.lexsort((id, truth.frame)))


def each_second(truth: Truth) -> Truth:
    """Returns a truth of one frame a second: straight between the two nearest frames in which a person is there."""
    assert truth.pos is not None
    length = int((truth.length - 1) / truth.fps) + 1
    at = np.arange(length) * truth.fps + 1
    size = int(truth.id.max()) + 1
    key = truth.frame * size + truth.id
    people = np.unique(truth.id)
    low, id = (x.ravel() for x in np.meshgrid(np.floor(at).astype(np.int64), people, indexing="ij"))
    second, part = np.repeat(np.arange(length), len(people)), np.repeat(at - np.floor(at), len(people))
    first, last = (np.searchsorted(key, frame * size + id) for frame in (low, low + (part > 0)))
    ends = [np.append(key, -1)[row] == frame * size + id for row, frame in ((first, low), (last, low + (part > 0)))]
    there = ends[0] & ends[1]
    first, last, part = first[there], last[there], part[there, None]
    pos = (1 - part) * truth.pos[first] + part * truth.pos[last]
    fresh = of_rows(truth, first)
    return fresh.replace(frame=second[there] + 1, pos=pos, vel=None, fps=1.0, length=length)
