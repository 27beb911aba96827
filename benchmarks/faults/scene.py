"""A simulated scene as arrays of frames and people, and its truth as tracks that can be spoiled."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from scenarios import load
from sim import simulate
from sim.geometry.polygons import footprint_hulls
from sim.render.weather import draw_illumination
from sim.rng import look_seed
from sim.types import EVENT_KINDS, Array, Bools, Groups, Ints, Sequence, Tracks
from tracking.grouping.grouped_tracks import groups_in_frames

NOBODY = -1
Ghost = tuple[int, int, float, float]  # frame from 1, id, x, y in m


@dataclass(frozen=True, eq=False)
class Told:
    """What a tracker reports of P people in T frames."""

    id: Ints  # (T, P) id of each person's track, -1 not tracked
    label: Ints  # (T, P) group, -1 alone
    ghosts: tuple[Ghost, ...] = ()


@dataclass(frozen=True, eq=False)
class FaultScene:
    """The truth of a sequence as arrays of T frames and P people; rows are frames from 1, columns are `people`."""

    sequence: Sequence
    fps: float
    people: Ints  # (P,) ids
    there: Bools  # (T, P)
    pos: Array  # (T, P, 2) m, nan while absent
    vel: Array  # (T, P, 2) m/s
    visibility: Array  # (T, P)
    truncation: Array  # (T, P)
    group: Ints  # (T, P) -1 alone
    nearest: Array  # (T, P) m to the nearest other person, inf without
    switches: tuple[int, ...]  # rows in which the light changes suddenly
    told: Told = field(init=False)

    def __post_init__(self) -> None:
        id = np.where(self.there, self.people[None], NOBODY)
        object.__setattr__(self, "told", Told(id, self.group))

    def frames(self, seconds: float) -> int:
        """Returns a duration in frames, at least 1."""
        return max(round(seconds * self.fps), 1)

    @cached_property
    def clean(self) -> list[Tracks]:
        """The truth as tracks of people."""
        return [self._frame(k, self.told, self.there[k]) for k in range(len(self.there))]

    @cached_property
    def clean_wholes(self) -> list[Tracks]:
        """The truth as tracks of whole groups."""
        return [self._hulls(k, self.group[k]) for k in range(len(self.there))]

    def tracks(self, told: Told, keep: Bools | None = None) -> list[Tracks]:
        """Returns the tracks of people; keep (T, P): those that are reported, None: all."""
        seen = told.id >= 0 if keep is None else (told.id >= 0) & keep
        haunted = {ghost[0] - 1 for ghost in told.ghosts}
        same = (np.where(seen, told.id, NOBODY) == self.told.id).all(axis=1) & (told.label == self.group).all(axis=1)
        return [
            self.clean[k] if same[k] and k not in haunted else self._frame(k, told, seen[k]) for k in range(len(seen))
        ]

    def _frame(self, k: int, told: Told, who: Bools) -> Tracks:
        ghosts = [ghost for ghost in told.ghosts if ghost[0] == k + 1]
        id = np.array([*told.id[k, who], *(ghost[1] for ghost in ghosts)], np.int64)
        group = np.array([*told.label[k, who], *(NOBODY for _ in ghosts)], np.int64)
        pos = np.concatenate([self.pos[k, who], np.array([ghost[2:] for ghost in ghosts]).reshape(-1, 2)])
        vel = np.concatenate([self.vel[k, who], np.full((len(ghosts), 2), np.nan)])
        n = len(id)
        t = Tracks(
            k + 1, k / self.fps, "ground", "person", id, group, pos, vel, np.zeros((n, 4, 4)), None, np.ones(n),
            own_events=EVENT_KINDS,
        )  # fmt: skip
        return t.replace(groups=groups_in_frames([t])[0])

    def wholes(self, label: Ints) -> list[Tracks]:
        """Returns the groups of these labels (T, P) as a tracker of whole groups reports them."""
        same = (label == self.group).all(axis=1)
        return [self.clean_wholes[k] if same[k] else self._hulls(k, label[k]) for k in range(len(label))]

    def _hulls(self, k: int, label: Ints) -> Tracks:
        names = [int(g) for g in np.unique(label[self.there[k]]) if g >= 0]
        own = [self.pos[k, self.there[k] & (label == g)] for g in names]
        hull = footprint_hulls(np.concatenate([np.zeros((0, 2)), *own]), np.array([len(pos) for pos in own], np.int64))
        id = np.array(names, np.int64)
        n = len(id)
        pos = np.array([h.mean(axis=0) for h in hull]).reshape(n, 2)
        two, none = np.full((n, 2), np.nan), np.full((n, 2, 2), np.nan)
        groups = Groups(id, (), pos, two, none, np.full(n, np.nan), tuple(hull))
        cov = np.zeros((n, 4, 4))
        return Tracks(k + 1, k / self.fps, "ground", "group", id, id, pos, two, cov, None, np.ones(n), groups)


def scene(name: str, seed: int, fps: float) -> FaultScene:
    """Returns a scenario of the catalogue as a scene, without pictures."""
    scenario = load(name, [f"camera.fps={fps:g}"])
    sequence = simulate(scenario, seed, streams=())
    truth = sequence.truth
    assert truth is not None
    assert truth.pos is not None
    assert truth.vel is not None
    assert truth.truncation is not None
    people = np.unique(truth.id)
    at, shape = (truth.frame - 1, np.searchsorted(people, truth.id)), (truth.length, len(people))

    def dense(values: Array | Ints, empty: float) -> Array:
        out = np.full((*shape, *values.shape[1:]), empty)
        out[at] = values
        return out

    pos = dense(truth.pos, np.nan)
    distance = np.hypot(*np.moveaxis(pos[:, :, None] - pos[:, None], -1, 0))
    distance[:, np.arange(shape[1]), np.arange(shape[1])] = np.inf
    there = np.isfinite(pos[..., 0])
    return FaultScene(
        sequence, truth.fps, people, there, pos, dense(truth.vel, np.nan), dense(truth.visibility, 1.0),
        dense(truth.truncation, 0.0), dense(truth.group, NOBODY).astype(np.int64),
        np.nan_to_num(distance, nan=np.inf).min(axis=2),
        tuple(int(start * fps) for start, _, _ in draw_illumination(scenario.light, look_seed(seed, name)).switches),
    )  # fmt: skip


def changed(told: Told, rows: slice, column: int | Ints, *, id: int | None = None, label: int | None = None) -> Told:
    """Returns a report with other ids or labels of some people in some frames; the absent stay absent."""
    ids, labels = told.id.copy(), told.label.copy()
    part = np.ix_(np.arange(len(ids))[rows], np.atleast_1d(column))
    if id is not None:
        ids[part] = np.where(told.id[part] >= 0, id, NOBODY)
    if label is not None:
        labels[part] = label
    return replace(told, id=ids, label=labels)
