"""How people walk here beside the literature and a recording, and how close replays are to their recordings.

    python -m benchmarks.realism walking [--seeds 0:40]
    python -m benchmarks.realism flocking [--seeds 0:40]
    python -m benchmarks.realism recording [--data FOLDER] [--seeds 0:40] [--scenarios street …]
    python -m benchmarks.realism replays [--data FOLDER]

walking: free speeds, speeds and shapes of groups that walk alone on open ground, measured from 4 s after the start.
flocking: groups in rows and without formation, with all forces between members (Reynolds 1987) and without each, after
5 to 10 s and 25 to 35 s: median distance to the nearest member, mean distance to the middle, length of the mean of the
unit velocities (1: all walk the same way), spread of the velocities.
recording: seq_hotel (BIWI) and scenarios of the catalogue, sampled at 2.5 frames/s with velocities by central
differences. Printed for each: quantiles (5, 50, 95 %) of the speeds of people who walk (> 0.3 m/s) and of the
closest approach, the least distance of two people of different groups who come within 3 m; then Wasserstein distances
to the recording in speed and closest approach, and the ratio of the 99 % quantiles of the acceleration.
replays: whole recordings replayed at 10 frames/s. `off`: distance of the replay from the labelled position at the time
of the label (50, 99 %, m). Speeds (50, 99 %, m/s) and accelerations (99 %, m/s²) of the recording are differences of
its labels at its own rate, those of the replay at 10 frames/s. Events are measured on the labels and on the replay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import wasserstein_distance

from benchmarks.support.options import HOTEL, PETS, WALK_TOGETHER, add_data, add_seeds, new_parser
from benchmarks.support.tables import head, number, row
from scenarios.loading.resolve import load, names
from scenarios.schema.scenario import ObservationSpec, Scenario
from sim.crowd.world import run
from sim.dataset.replay import on_ground, replay
from sim.types import Array, Bools, Ints, Motion, Sequence, Truth
from tracking.recordings.source import open_source

STEP = 0.4  # s
WALKING = 0.3  # m/s
MEETING = 3.0  # m
QUANTILES = (0.05, 0.5, 0.95)
FORCES = ("separation", "alignment", "cohesion")
OPEN_GROUND = {"schema": 1, "duration": 9.0, "warmup": 4.0, "world": {"size": [60, 20]}}


@dataclass(frozen=True)
class GroupWalk:
    """A group that walks along +x, by seed.

    speed (S,), m/s; places (S, T, n, 2): each member relative to the mean position of the group, m: ahead, to the left.
    """

    speed: Array
    places: Array


def walk_alone(size: int, seeds: range) -> GroupWalk:
    """Returns the walks of a group of `size` people alone on open ground."""
    pos = np.stack([alone_motion(size, seed).pos for seed in seeds])
    middle = pos.mean(axis=2)
    way = np.linalg.norm(middle[:, -1] - middle[:, 0], axis=1)
    return GroupWalk(way / ((pos.shape[1] - 1) / 10), pos - middle[:, :, None])


def alone_motion(size: int, seed: int) -> Motion:
    """Returns the motion of a group of `size` people that walks along +x alone on open ground."""
    group = {"id": "a", "size": size, "start": [20, 10], "goal": [40, 10], "at_goal": "walk"}
    return run(Scenario.model_validate({**OPEN_GROUND, "group": [group]}), seed)


def free_speeds(seeds: range) -> Array:
    """Returns the speeds, m/s, of people who walk alone: twenty per seed, on lanes 10 m apart."""
    group = {"id": "a", "size": 1, "start": [20, 5], "goal": [40, 5], "at_goal": "walk"}
    lanes = [{**group, "id": f"a{k}", "start": [20, 5 + 10 * k], "goal": [40, 5 + 10 * k]} for k in range(20)]
    scenario = Scenario.model_validate({**OPEN_GROUND, "world": {"size": [60, 210]}, "group": lanes})
    pos = np.stack([run(scenario, seed).pos for seed in seeds])
    return np.asarray(np.linalg.norm(pos[:, -1] - pos[:, 0], axis=-1).ravel() / ((pos.shape[1] - 1) / 10))


def neighbours(walk: GroupWalk) -> Array:
    """Returns the distance, m, of each member to its nearest fellow member, for all seeds and frames."""
    d = np.linalg.norm(walk.places[:, :, :, None] - walk.places[:, :, None], axis=-1)
    d[..., np.arange(d.shape[-1]), np.arange(d.shape[-1])] = np.inf
    return np.asarray(d.min(axis=-1).ravel())


def abreast(walk: GroupWalk) -> Array:
    """Returns the angle, degrees, between the line through a pair and its direction of walking; 90 is abreast."""
    d = np.abs(walk.places[:, :, 0] - walk.places[:, :, 1])
    return np.asarray(np.degrees(np.arctan2(d[..., 1], d[..., 0])).ravel())


def middle_behind(walk: GroupWalk) -> Array:
    """Returns how far, m, the middle member of a triad walks behind the mean of the other two, per seed."""
    order = np.argsort(walk.places[..., 1], axis=2)
    ahead = np.take_along_axis(walk.places[..., 0], order, axis=2).mean(axis=1)
    return np.asarray((ahead[:, 0] + ahead[:, 2]) / 2 - ahead[:, 1])


def rows(walk: GroupWalk) -> Array:
    """Returns the number of rows in which the group walks, per seed.

    A new row begins where two successive members differ by more than 0.4 m in how far ahead they walk on average.
    """
    ahead = np.sort(walk.places[..., 0].mean(axis=1), axis=1)
    return np.asarray((np.diff(ahead, axis=1) > 0.4).sum(axis=1) + 1)


def passes_through(size: int, seeds: range) -> Bools:
    """Returns, per seed, True if a stranger who walks towards a group of `size` people passes between two of them.

    The stranger starts up to 0.5 m to the side of the line through the middle of the group.
    """
    found = []
    for seed in seeds:
        off = float(np.random.default_rng(seed).uniform(-0.5, 0.5))
        group = {"id": "a", "size": size, "start": [20, 10], "goal": [50, 10], "at_goal": "walk"}
        other = {"id": "b", "size": 1, "start": [38, 10 + off], "goal": [5, 10 + off], "at_goal": "walk"}
        motion = run(Scenario.model_validate({**OPEN_GROUND, "duration": 14.0, "group": [group, other]}), seed)
        found.append(passes_between(motion.pos))
    return np.array(found)


def passes_between(pos: Array) -> bool:
    """Returns True if the last person of pos (T, P, 2) passed some of the others on the left and some on the right."""
    away = pos[:, :-1] - pos[:, -1:]
    passing = [int(np.argmin(np.abs(x))) for x in away[..., 0].T]
    sides = np.array([away[t, k, 1] > 0 for k, t in enumerate(passing)])
    return bool(sides.any() and not sides.all())


class FlockState(NamedTuple):
    """Means of a group over members, times and seeds; distances in m."""

    neighbour: float  # median distance to the nearest member
    radius: float  # distance to the middle
    polarisation: float  # length of the mean of the unit velocities
    spread: float  # standard deviation of the velocities, m/s


@cache
def flock_walk(size: int, formation: str, seeds: range, off: str | None = None) -> tuple[FlockState, FlockState]:
    """Returns the state of a group of `size` people on open ground after 5 to 10, and 25 to 35 s.

    off: one of the FORCES, which does not act; None: all do.
    """
    group = {"id": "g", "size": size, "formation": formation, "start": [5, 10], "goal": [95, 10], "at_goal": "walk"}
    table = {"schema": 1, "duration": 35.0, "warmup": 0.0, "world": {"size": [100, 20]}, "group": [group]}
    scenario = Scenario.model_validate(table | ({"crowd": {off: 0.0}} if off else {}))
    found = []
    for states in (run(scenario, seed).states() for seed in seeds):
        for ticks in (slice(50, 100), slice(250, 350)):
            pos, vel = states.pos[ticks], states.vel[ticks]
            apart = np.linalg.norm(pos[:, :, None] - pos[:, None], axis=-1) + np.diag(np.full(size, np.inf))
            away = np.linalg.norm(pos - pos.mean(axis=1, keepdims=True), axis=-1)
            same_way = np.linalg.norm((vel / np.linalg.norm(vel, axis=-1, keepdims=True)).mean(axis=1), axis=-1)
            found.append([np.median(apart.min(axis=-1)), away.mean(), same_way.mean(), vel.std(axis=1).mean()])
    early, late = np.reshape(found, (-1, 2, 4)).mean(axis=0)
    return FlockState(*early), FlockState(*late)


def flocking(seeds: range) -> None:
    """Prints what each force between members does."""
    head(["group", "forces", "nearest member, m", "to the middle, m", "polarisation", "spread of velocities, m/s"])
    for formation, words in (("rows", "12 in rows"), ("none", "12 without formation")):
        for off in (None, *FORCES):
            states = flock_walk(12, formation, seeds, off)
            cells = [
                ", ".join(f"{x:.{digits}f}" for x in pair) for *pair, digits in zip(*states, (2, 2, 3, 3), strict=True)
            ]
            row([words, f"without {off}" if off else "all", *cells])


def statistics(pos: Array, label: Ints) -> tuple[Array, Array, Array]:
    """Returns speeds of people who walk (m/s), closest approaches of strangers (m), and accelerations (m/s²).

    pos (T, P, 2) at 2.5 frames/s, nan where absent; label (T, P): group, negative for people alone.
    """
    vel = (pos[2:] - pos[:-2]) / (2 * STEP)
    speed = np.linalg.norm(vel, axis=2).ravel()
    acceleration = np.linalg.norm(np.diff(vel, axis=0) / STEP, axis=2).ravel()
    least = np.full((pos.shape[1],) * 2, np.inf)
    for here, group in zip(pos, label, strict=True):
        there = np.flatnonzero(np.isfinite(here[:, 0]))
        d = np.linalg.norm(here[there, None] - here[None, there], axis=2)
        d[(group[there, None] == group[None, there]) & (group[there, None] >= 0)] = np.inf
        least[np.ix_(there, there)] = np.minimum(least[np.ix_(there, there)], d)
    close = least[np.triu_indices(len(least), 1)]
    return speed[speed > WALKING], close[close < MEETING], acceleration[np.isfinite(acceleration)]


def recording_statistics(folder: str) -> tuple[Array, Array, Array]:
    """Returns the statistics of the labels in a BIWI folder."""
    truth = open_source(folder)[0].truth
    assert truth is not None
    assert truth.pos is not None
    ids, column = np.unique(truth.id, return_inverse=True)
    pos = np.full((truth.length, len(ids), 2), np.nan)
    label = np.full(pos.shape[:2], -1, np.int64)
    pos[truth.frame - 1, column] = truth.pos
    label[truth.frame - 1, column] = truth.group
    return statistics(pos, label)


def scenario_statistics(name: str, seeds: range) -> tuple[Array, Array, Array]:
    """Returns the statistics of a scenario, all seeds together."""
    parts = []
    for seed in seeds:
        motion = run(load(name), seed)
        every = round(motion.fps * STEP)
        parts.append(statistics(np.asarray(motion.pos[::every]), np.asarray(motion.intent[::every])))
    speed, closest, acceleration = (np.concatenate(x) for x in zip(*parts, strict=True))
    return speed, closest, acceleration


def distances(mine: tuple[Array, Array, Array], real: tuple[Array, Array, Array]) -> tuple[float, float, float]:
    """Returns Wasserstein distances in speed (m/s) and closest approach (m), and the ratio of the 99 % accelerations.

    The second distance is nan if nobody approached a stranger.
    """
    near = wasserstein_distance(mine[1], real[1]) if len(mine[1]) else np.nan
    ratio = np.quantile(mine[2], 0.99) / np.quantile(real[2], 0.99)
    return float(wasserstein_distance(mine[0], real[0])), float(near), float(ratio)


def walking(seeds: range) -> None:
    """Prints the habits of people alone and in groups beside the literature."""
    speed = free_speeds(range(seeds.start, seeds.start + max(1, len(seeds) // 4)))
    walks = {n: walk_alone(n, seeds) for n in range(1, 7)}
    slower = -np.polyfit(list(walks), [walks[n].speed.mean() for n in walks], 1)[0]
    near = np.array([np.quantile(neighbours(walks[n]), (0.1, 0.5, 0.9)) for n in range(2, 7)])
    angle = np.quantile(abreast(walks[2]), (0.1, 0.5))
    behind = middle_behind(walks[3])
    through = ", ".join(f"{passes_through(n, seeds).mean():.0%}" for n in (2, 3, 4))
    head(["habit", "literature", "simulator"])
    row(["free speed, m/s", "N(1.34, 0.26) (Weidmann 1993)", f"{speed.mean():.2f} ± {speed.std():.2f}"])
    row(["slower per member, m/s", "0.04–0.08 (Moussaïd et al. 2010)", f"{slower:.3f}"])
    for q, text in zip((10, 50, 90), near.T, strict=True):
        row([f"nearest neighbour, {q} %, groups of 2 to 6, m", "0.6–0.9" if q == 50 else "",
             f"{text.min():.2f}–{text.max():.2f}"])  # fmt: skip
    row(["pairs, angle to the walk (10 %, median)", "abreast: 90°", f"{angle[0]:.0f}°, {angle[1]:.0f}°"])
    row(["triads, middle member behind, m", "slightly (Zanlungo & Kanda 2013)",
         f"{np.median(behind):.2f}, in {np.mean(behind > 0):.0%}"])  # fmt: skip
    row(["rows of groups of 4, 5, 6", "pairs and triads", ", ".join(f"{rows(walks[n]).mean():.1f}" for n in (4, 5, 6))])
    row(["strangers who pass through a group of 2, 3, 4", "seldom", through])


def recording(folder: Path, scenarios: list[str], seeds: range) -> None:
    """Prints scenarios beside seq_hotel."""
    real = recording_statistics(str(folder))
    head(["scene", "speed, m/s (5, 50, 95 %)", "closest approach, m (5, 50, 95 %)", "W of speed, m/s",
          "W of closest approach, m", "acceleration, ratio"])  # fmt: skip
    for name in ("seq_hotel", *scenarios):
        mine = real if name == "seq_hotel" else scenario_statistics(name, seeds)
        cells = [", ".join(f"{x:.2f}" for x in np.quantile(v, QUANTILES)) if len(v) else "–" for v in mine[:2]]
        row([name, *cells, *(number(x, 2) for x in distances(mine, real))])


def label_distances(source: Sequence, made: Sequence) -> Array:
    """Returns the distances, m, between labels and replay at the labels that fall on a frame of the replay."""
    labels, truth, origin = source.truth, made.truth, made.source["origin"]
    assert labels is not None
    assert truth is not None
    assert truth.pos is not None
    places = on_ground(labels, source) + origin["shift"]
    person = {one: k + 1 for k, one in enumerate(origin["people"])}
    at = (labels.frame - 1) / labels.fps * truth.fps
    row = {(f, i): k for k, (f, i) in enumerate(zip(truth.frame.tolist(), truth.id.tolist(), strict=True))}
    pairs = [
        (k, row[key])
        for k, (t, one) in enumerate(zip(at, labels.id.tolist(), strict=True))
        if abs(t - round(t)) < 1e-6 and (key := (round(t) + 1, person.get(one, 0))) in row
    ]
    a, b = np.array(pairs).T
    return np.linalg.norm(places[a] - truth.pos[b], axis=1)


def speeds_and_accelerations(frame: Array, id: Array, pos: Array, fps: float) -> tuple[Array, Array]:
    """Returns speeds (m/s) and accelerations (m/s²) by differences of neighbouring frames."""
    speeds, accelerations = [], []
    for one in np.unique(id):
        f, p = frame[id == one], pos[id == one]
        v, near = np.diff(p, axis=0) * fps, np.diff(f) == 1
        speeds.append(np.linalg.norm(v[near], axis=1))
        accelerations.append(np.linalg.norm(np.diff(v, axis=0)[near[1:] & near[:-1]], axis=1) * fps)
    return np.concatenate(speeds), np.concatenate(accelerations)


def event_counts(truth: Truth) -> str:
    if truth.events is None:
        return "not labelled"
    return ", ".join(f"{n} {kind}" for kind, n in sorted(Counter(e.kind for e in truth.events).items()))


def replays(data: Path) -> None:
    """Prints replays beside their recordings."""
    head(["recording", "", "off, m (50, 99 %)", "speed, m/s (50, 99 %)", "acceleration, m/s² (99 %)", "events"])
    for name in (HOTEL, WALK_TOGETHER, PETS):
        source = open_source(data / name, images=False)[0]
        made = replay(source, ObservationSpec(), streams=())
        labels, truth = source.truth, made.truth
        assert labels is not None
        assert truth is not None
        assert truth.pos is not None
        off = np.quantile(label_distances(source, made), (0.5, 0.99))
        for some, pos, what in ((labels, on_ground(labels, source), "labels"), (truth, truth.pos, "replay")):
            speed, acceleration = speeds_and_accelerations(some.frame, some.id, pos, some.fps)
            fast = ", ".join(f"{x:.2f}" for x in np.quantile(speed, (0.5, 0.99)))
            away = f"{off[0]:.3f}, {off[1]:.3f}" if what == "replay" else ""
            row([Path(name).name, what, away, fast, f"{np.quantile(acceleration, 0.99):.2f}", event_counts(some)])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["walking", "flocking", "recording", "replays"])
    add_seeds(parser, "0:40")
    parser.add_argument("--scenarios", nargs="*", default=names(), help="recording: scenarios to compare")
    add_data(parser)
    args = parser.parse_args()
    if args.mode == "walking":
        walking(args.seeds)
    elif args.mode == "flocking":
        flocking(args.seeds)
    elif args.mode == "recording":
        recording(args.data / HOTEL, args.scenarios, args.seeds)
    else:
        replays(args.data)


if __name__ == "__main__":
    main()
