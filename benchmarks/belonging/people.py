"""Mode `people` of `benchmarks.belonging`: who is on a street, how they arrive, wait and walk.

Parties are groups, and people without a group. People of the first frame of a scene have not arrived. The field of a
scene is the convex hull of all positions in it, its edges are the 1 and 99 % quantiles of their coordinates. Standing:
slower than 0.3 m/s, by chords over 0.5 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from benchmarks.belonging.pair_features import NAMES, STANDING
from benchmarks.belonging.sources import FPS, Source, of_scenes, read
from benchmarks.support.tables import table
from sim.io.formats.group_labels import rows_to_grid
from sim.io.formats.velocity import chords
from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, frames_of
from sim.truth.proximity import stretches
from sim.types import Array, Bools, Ints

WAIT = 3.0  # s: who stands longer waits
TOGETHER = 2.0  # s: who arrive within this time arrive together
INSIDE = 1.5  # m: who are first seen farther than this from the edges of the field appear inside


@dataclass(frozen=True)
class Scene:
    """One scene: P people by T frames.

    pos, vel (T, P, 2): m and m/s, nan where absent or unknown; party (P,): number of the group, or of the person alone;
    first, last (P,): frames, from 0; grouped (P,): True for members of a group.
    """

    pos: Array
    vel: Array
    party: Ints
    first: Ints
    last: Ints
    grouped: Bools


def scene_of(source: Source, number: int) -> Scene:
    """Returns a scene of a source. Who is in several groups counts to the last one."""
    rows = np.flatnonzero(source.scene == number)
    frame, id, length = source.frame[rows], source.id[rows], int(source.length[number])
    people, column = np.unique(id, return_inverse=True)
    group = np.full(len(people), -1)
    labelled = source.group[rows] >= 0
    group[column[labelled]] = source.group[rows][labelled]
    party = np.where(group >= 0, group, group.max(initial=0) + 1 + np.arange(len(people)))
    first, last = np.full(len(people), length), np.zeros(len(people), np.int64)
    np.minimum.at(first, column, frame - 1)
    np.maximum.at(last, column, frame - 1)
    pos = source.pos[rows]
    vel = rows_to_grid(frame, id, chords(frame, id, pos, FPS), length)
    return Scene(rows_to_grid(frame, id, pos, length), vel, party, first, last, group >= 0)


def waits(scene: Scene) -> tuple[Array, Ints]:
    """Returns the duration, s, and the person of each wait: at least WAIT s of standing, 1 s of which may be faster."""
    person, frame = np.nonzero((np.hypot(*np.moveaxis(scene.vel, 2, 0)) < STANDING).T)
    who, begin, end = stretches(person, frame, frames_of(WAIT, FPS), 1 + frames_of(1.0, FPS))
    return (end - begin + 1) / FPS, who


def hard_strangers(source: Source) -> tuple[Array, int]:
    """Returns the durations, s, of stretches in which strangers satisfy the merge rule, and how many of these stand."""
    rows = np.flatnonzero(~source.mates)
    rows = rows[np.lexsort((source.pair_frame[rows], source.b[rows], source.a[rows], source.pair_scene[rows]))]
    x = {name: source.features[rows, NAMES.index(name)] for name in NAMES}
    near = (x["distance, 0.8 s"] < MERGE_DISTANCE) & (x["velocity difference, 0.8 s"] < MERGE_VELOCITY)
    rows, speed = rows[near], x["speed"][near]
    key = np.stack([source.pair_scene[rows], source.a[rows], source.b[rows]])
    pair = np.unique(key, axis=1, return_inverse=True)[1].ravel()
    who, begin, end = stretches(pair, source.pair_frame[rows], frames_of(HOLD_TIME, FPS))
    stand = 0
    for one, low, high in zip(who, begin, end, strict=True):
        here = (pair == one) & (source.pair_frame[rows] >= low) & (source.pair_frame[rows] <= high)
        stand += int(np.nanmedian(speed[here]) < STANDING)
    return (end - begin + 1) / FPS, stand


def arrivals(scene: Scene) -> tuple[Array, Array, Array]:
    """Returns three arrays: gaps, s, between parties that arrive one after the other; and for each person who arrives
    after the first frame, 1 if a stranger arrives within TOGETHER s less than 3 m away, else 0, and the place, m.
    """
    came = np.flatnonzero(scene.first > 0)
    begin = np.array([scene.first[came][scene.party[came] == p].min() for p in np.unique(scene.party[came])])
    place = scene.pos[scene.first, np.arange(len(scene.first))]
    flags = []
    for p in came:
        near = np.abs(scene.first - scene.first[p]) <= TOGETHER * FPS
        others = near & (scene.party != scene.party[p])
        flags.append((others & (np.hypot(*(place - place[p]).T) < 3.0)).any())
    return np.diff(np.sort(begin)) / FPS, np.array(flags, bool), place[came]


def positions(scene: Scene) -> Array:
    """Returns all positions of a scene, (R, 2), m."""
    return scene.pos[np.isfinite(scene.pos[..., 0])]


def density(scene: Scene) -> float:
    """Returns the mean number of people per m² of the field over the frames with people."""
    present = np.isfinite(scene.pos[..., 0]).sum(axis=1)
    return float(present[present > 0].mean() / ConvexHull(positions(scene)).volume)  # in two dimensions the area


def inside(scene: Scene, place: Array) -> Bools:
    """Returns True for each place (K, 2), m, that is more than INSIDE from the edges of the scene's field."""
    low, high = np.quantile(positions(scene), (0.01, 0.99), axis=0)
    return np.asarray((np.minimum(place - low, high - place) > INSIDE).all(axis=1))


def quantiles(x: Array, digits: int = 1) -> str:
    """Returns the 10, 50 and 90 % quantiles of the known values."""
    x = np.asarray(x, float)
    x = x[np.isfinite(x)]
    return ", ".join(f"{q:.{digits}f}" for q in np.quantile(x, (0.1, 0.5, 0.9))) if len(x) else "–"


def share(flags: Bools) -> str:
    return f"{flags.mean():.2f}" if len(flags) else "–"


def mate_places(scenes: Sequence[Scene]) -> tuple[Array, Array, Array, Array]:
    """Returns arrival gap (s) and distance when both are first seen (m) of each two mates; then sideways and lengthwise
    distance (m) of two mates who both walk, per frame."""
    gap, first, across, along = [], [], [], []
    for scene in scenes:
        for p, q in zip(*np.triu_indices(len(scene.party), 1), strict=True):
            if scene.party[p] != scene.party[q]:
                continue
            apart = scene.pos[:, p] - scene.pos[:, q]
            both = np.flatnonzero(np.isfinite(apart[:, 0]))
            if not len(both):
                continue
            if max(scene.first[p], scene.first[q]) > 0:
                gap.append(abs(scene.first[p] - scene.first[q]) / FPS)
                first.append(np.hypot(*apart[both[0]]))
            mean = (scene.vel[both, p] + scene.vel[both, q]) / 2
            pace = np.hypot(*mean.T)
            walk = pace > 2 * STANDING
            unit, d = mean[walk] / pace[walk, None], apart[both][walk]
            across += np.abs(d[:, 0] * unit[:, 1] - d[:, 1] * unit[:, 0]).tolist()
            along += np.abs((d * unit).sum(axis=1)).tolist()
    return np.array(gap), np.array(first), np.array(across), np.array(along)


def figures(source: Source) -> dict[str, str]:
    """Returns all figures of a source as text, by name."""
    scenes = [scene_of(source, k) for k in range(len(source.length))]
    minutes = source.length.sum() / FPS / 60
    present = np.concatenate([np.isfinite(s.pos[..., 0]).sum(axis=1) for s in scenes])
    came = np.concatenate([s.first > 0 for s in scenes])
    came_in = [arrivals(s) for s in scenes]
    gaps, beside = (np.concatenate([x[k] for x in came_in]) for k in (0, 1))
    appear = np.concatenate([inside(s, place) for s, (_, _, place) in zip(scenes, came_in, strict=True)])
    crowded = np.array([density(s) for s in scenes])
    sizes = np.concatenate([np.unique(s.party, return_counts=True)[1] for s in scenes])
    speed = np.concatenate([np.hypot(*np.moveaxis(s.vel, 2, 0)).ravel() for s in scenes])
    grouped = np.concatenate([s.grouped for s in scenes])
    mean_speed = np.concatenate([_walking_speed(s) for s in scenes])
    waited = [waits(s) for s in scenes]
    wait = np.concatenate([w for w, _ in waited])
    waiting = sum(len(np.unique(who)) for _, who in waited)
    waiting_grouped = sum(int(s.grouped[np.unique(who)].sum()) for s, (_, who) in zip(scenes, waited, strict=True))
    gap, first, across, along = mate_places(scenes)
    hard, stand = hard_strangers(source)
    near, pace = source.features[:, NAMES.index("distance, 0.8 s")], source.features[:, NAMES.index("speed")]
    alike = (near < MERGE_DISTANCE) & (source.features[:, NAMES.index("velocity difference, 0.8 s")] < MERGE_VELOCITY)
    people = sum(len(s.party) for s in scenes)
    parties = sum(len(np.unique(s.party[s.first > 0])) for s in scenes)
    return {
        "scenes; minutes; people": f"{len(scenes)}; {minutes:.1f}; {people}",
        "people present (10, 50, 90 %)": quantiles(present, 0),
        "people per m² (10, 50, 90 % of scenes)": quantiles(crowded, 3),
        "… least, greatest": f"{crowded.min():.3f}, {crowded.max():.3f}",
        "frames without people": share(present == 0),
        "people present in the first frame, of all": share(~came),
        "arrivals per minute: people; parties": f"{came.sum() / minutes:.1f}; {parties / minutes:.1f}",
        "gap between arriving parties, s": quantiles(gaps),
        "… its standard deviation / mean": f"{gaps.std() / gaps.mean():.2f}" if len(gaps) else "–",
        "arrivals with a stranger within 2 s and 3 m": share(beside),
        "arrivals in the first frame after frames without people": share(np.concatenate([*map(_restarts, scenes)])),
        "people who stand when first seen": share(np.concatenate([*map(_first_speed, scenes)]) < STANDING),
        "arrivals more than 1.5 m inside the field": share(appear),
        "time in view, s": quantiles(np.concatenate([(s.last - s.first + 1) / FPS for s in scenes])),
        "share of people in groups": share(grouped),
        "share of parties of 1, 2, 3, 4, more": ", ".join(
            share(np.minimum(sizes, 5) == n) for n in range(1, 6)
        ),
        "speed of people alone who walk, m/s": quantiles(mean_speed[~grouped], 2),
        "speed of members who walk, m/s": quantiles(mean_speed[grouped], 2),
        "rows slower than 0.3 m/s": share(speed[np.isfinite(speed)] < STANDING),
        "people who wait for 3 s or more; of these in groups": f"{waiting / people:.2f}; "
        f"{waiting_grouped / max(waiting, 1):.2f}",
        "duration of waits, s": quantiles(wait),
        "gap between arrivals of mates, s": quantiles(gap),
        "share of mates who arrive in the same frame": share(gap == 0),
        "distance of mates at first sight, m": quantiles(first, 2),
        "mates who walk: sideways, m": quantiles(across, 2),
        "mates who walk: lengthwise, m": quantiles(along, 2),
        "share of mates among two within 1.5 m who stand": share(source.mates[alike & (pace < STANDING)]),
        "share of mates among two within 1.5 m who walk alike": share(source.mates[alike & (pace >= STANDING)]),
        "strangers who move alike within 1.5 m for 2 s, per person": f"{len(hard) / people:.2f}",
        "… of these who stand": f"{stand / max(len(hard), 1):.2f}",
        "… duration, s": quantiles(hard),
    }  # fmt: skip


def _restarts(scene: Scene) -> Bools:
    """Returns, for each person who arrives after the first frame, True if nobody is present in the frame before."""
    present = np.asarray(np.isfinite(scene.pos[..., 0]).any(axis=1))
    came = scene.first[scene.first > 0]
    return np.asarray(~present[came - 1])


def _first_speed(scene: Scene) -> Array:
    """Returns the first known speed, m/s, of each person who has one."""
    speed = np.hypot(*np.moveaxis(scene.vel, 2, 0))
    known = np.isfinite(speed)
    return np.asarray(speed[known.argmax(axis=0), np.arange(speed.shape[1])][known.any(axis=0)])


def _walking_speed(scene: Scene) -> Array:
    """Returns the median speed, m/s, of each person while walking (P,); nan for people who never walk."""
    speed = np.hypot(*np.moveaxis(scene.vel, 2, 0))
    walks = np.asarray(speed > STANDING)
    out = np.full(speed.shape[1], np.nan)
    for p in np.flatnonzero(walks.any(axis=0)):
        out[p] = np.median(speed[walks[:, p], p])
    return out


def sparse(source: Source, most: float) -> Source:
    """Returns the scenes of a source with less than `most` people per m²."""
    scenes = range(len(source.length))
    return of_scenes(source, np.array([k for k in scenes if density(scene_of(source, k)) < most], np.int64))


def people(folder: Path, scenes: Sequence[str], recordings: Sequence[str], most: float | None) -> None:
    """most: people per m² below which the scenes of a suite have a column of their own; None: no such column."""
    found = {name: figures(read(folder, name)) for name in (*recordings, *scenes)}
    for name in scenes if most is not None else ():
        thin = sparse(read(folder, name), most)
        if 0 < len(thin.length) < len(read(folder, name).length):
            found[f"{name}, below {most:g} per m²"] = figures(thin)
    rows = {figure: [one[figure] for one in found.values()] for figure in next(iter(found.values()))}
    table("people", "", list(found), rows)
