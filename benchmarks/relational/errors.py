"""Errors of `relational` and `particle`: Fig. 7 of the paper on simulated scenes, and a hidden partner."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from benchmarks.relational.observed import LABELS
from benchmarks.support import chart, tables
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Bools, Context, Detections, Frame, Plane, Sequence, Tracks, Truth
from tracking.filters.assignment import optimal
from tracking.papers.relational.config import ParticleConfig
from tracking.recordings.source import open_source
from tracking.running.prepare import prepare
from tracking.running.tracker_registry import find
from tracking.stats import mean_interval

FILTERS = ("particle", "relational")
DIFFERENCE = "relational − particle"
PRESETS = {"paper": "paper", "default": None}
# People who are less visible are never detected: `sensor.min_visibility`.
HIDDEN = 0.2
# Largest error of a person, and cost of a missing track, m.
CUT = 2.0
# Lengths of the occlusion in mode hidden, s.
LENGTHS = (0.2, 0.5, 1.0, 2.0, 3.0)
# Mode recordings: s from one occlusion to the next, its length, standard deviation of a detection per axis, m.
PERIOD, AWAY, ROUGH = 6.0, 2.0, 0.1
# Mode hidden: frames per second, s before the occlusion, standard deviation of a detection, m.
FPS, SEEN, NOISE = 10.0, 4.0, 0.05
# Modes hidden and recordings: where a filter places a hidden person, also if the person has probably left.
EVERYBODY = "report_existence=0"


def places(truth: Truth) -> tuple[Array, float]:
    """Returns the places (R, 2) of the people of each row, and the unit of a metre: on the ground in m and 1; in the
    image the centres of boxes in px and the scale."""
    if truth.pos is not None:
        return truth.pos[:, :2], 1.0
    assert truth.box is not None
    return truth.box[:, :2] + truth.box[:, 2:] / 2, truth.px_per_m


def errors(truth: Truth, tracks: list[Tracks]) -> Array:
    """Returns the error of each person and frame of the truth, (R,), m."""
    out = np.full(len(truth.id), CUT)
    pos, unit = places(truth)
    for t in tracks:
        rows = truth.rows(t.index)
        away = np.hypot(*(pos[rows][:, None] - t.pos[None, :, :2]).transpose(2, 0, 1)) / unit
        people, found = optimal(away, CUT)
        out[np.arange(rows.start, rows.stop)[people]] = away[people, found]
    return out


def config_of(name: str, count: int, given: argparse.Namespace) -> ParticleConfig:
    """Returns the config of a filter: the preset or the defaults, and the settings; those of relations alone are left
    out for `particle`."""
    kind = find(name).config_class
    config = kind.load(given.params) if given.params else kind()
    known = [text for text in given.set if name == "relational" or text.partition("=")[0] in kind.params()]
    return config.with_set(f"particles={count}", *known)


def run(name: str, config: ParticleConfig, seed: int, sequence: Sequence) -> list[Tracks]:
    """Returns the tracks of a filter of this seed."""
    ready = prepare(name, sequence, params=config, detections="file")
    ready.reset(seed)
    return [ready.step(frame) for frame in ready.frames()]


def particles(given: argparse.Namespace) -> None:
    """Prints a table for each scene: rows are numbers of particles, columns the errors of both filters."""
    panels = []
    for entry in (e for e in resolve("suite:occlusion", LABELS) if not given.entry or e.name in given.entry.split(",")):
        scenes = [simulate(entry.scenario, seed, 0, ()) for seed in given.seeds]
        print(f"\n{entry.name}: error per person and frame, m; seeds {given.seeds.start}:{given.seeds.stop}, "
              f"filter seeds {given.filter_seeds.start}:{given.filter_seeds.stop}")  # fmt: skip
        tables.head(["particles", *(f"{name}, {preset}" for preset in PRESETS for name in (*FILTERS, DIFFERENCE))])
        curves: dict[str, list[Array]] = {}
        for count in given.counts:
            cells = []
            for preset in PRESETS:
                found = {name: _errors_by_seed(name, count, preset, scenes, given) for name in FILTERS}
                cells += [tables.mean_cell(values, "RMSE_pos") for values in found.values()]
                cells.append(_difference(found))
                for name, values in found.items():
                    curves.setdefault(f"{name}, {preset}", []).append(np.maximum(mean_interval(values), 0.0))
            tables.row([str(count), *cells])
        shown = {name: tuple(np.array(values).T) for name, values in curves.items()}
        panels.append(chart.Panel(f"{entry.name}: error, m", given.counts, shown, "particles"))
    if given.chart:
        chart.lines(panels, given.chart)


def _errors_by_seed(name: str, count: int, preset: str, scenes: list[Sequence], given: argparse.Namespace) -> Array:
    """Returns the mean error of each filter seed."""
    config = config_of(name, count, argparse.Namespace(**{**vars(given), "params": PRESETS[preset]}))
    found = [[errors(q.truth, run(name, config, seed, q)) for q in scenes] for seed in given.filter_seeds]
    return np.array([np.concatenate(values).mean() for values in found])


def _difference(values: dict[str, Any]) -> str:
    before, after = (np.array(values[name]) for name in FILTERS)
    return tables.difference_cell(after - before, "RMSE_pos")


def _row(first: str, mean: Mapping[str, Array | list[float]]) -> None:
    values = {name: np.array(x) for name, x in mean.items()}
    cells = [tables.mean_cell(values[name], "RMSE_pos") for name in FILTERS]
    tables.row([first, *cells, _difference(values)])


def pair(seed: int) -> tuple[Array, Iterator[Frame]]:
    """Returns the places (T, 2, 2) of two people who walk together, and the frames of a detector.

    Their common velocity wanders; the second is not detected from SEEN s on, for the longest of LENGTHS.
    """
    rng, dt = np.random.default_rng(seed), 1 / FPS
    count = round((SEEN + max(LENGTHS) + 1) * FPS)
    velocity = np.array([1.3, 0.0]) + np.cumsum(rng.normal(0, 0.25 * dt**0.5, (count, 2)), axis=0)
    middle = np.cumsum(velocity * dt, axis=0)
    sway = 0.05 * np.sin(2 * np.pi * np.arange(count)[:, None, None] * dt / 2 + rng.uniform(0, 6, (1, 2, 2)))
    pos = middle[:, None] + np.array([[0, 0.35], [0, -0.35]]) + sway
    seen = pos + rng.normal(0, NOISE, pos.shape)
    first, last = round(SEEN * FPS), round((SEEN + max(LENGTHS)) * FPS)

    def frames() -> Iterator[Frame]:
        for k in range(last):
            points = seen[k, :1] if k >= first else seen[k]
            found = Detections(k + 1, k * dt, "ground", points, None, None, np.ones(len(points)))
            yield Frame(k + 1, k * dt, detections=found)

    return pos, frames()


def hidden_partner(name: str, seed: int, given: argparse.Namespace) -> Array:
    """Returns the error of the hidden one of two people, (L,), m, when an occlusion of each of LENGTHS would end."""
    tracker = find(name)(config_of(name, given.counts[0], given).with_set(EVERYBODY))
    tracker.reset(Context(FPS, float("nan")), seed)
    (pos, frames), found = pair(seed), []
    last = [round((SEEN + length) * FPS) for length in LENGTHS]
    for frame in frames:
        tracks = tracker.step(frame, frame.detections)
        if frame.index in last:
            true = pos[frame.index - 1]
            away = np.hypot(*(true[:, None] - tracks.pos[None]).transpose(2, 0, 1))
            people, tracked = optimal(away, CUT)
            found.append(dict(zip(people.tolist(), away[people, tracked], strict=True)).get(1, CUT))
    return np.array(found)


def hidden(given: argparse.Namespace) -> None:
    """Prints a table: rows are lengths of the occlusion, columns the error of the hidden person in its last frame."""
    print("\nerror of the hidden one of two people in the last frame of the occlusion, m, at most 2")
    tables.head(["occlusion, s", *FILTERS, DIFFERENCE])
    found = {name: np.array([hidden_partner(name, seed, given) for seed in given.seeds]) for name in FILTERS}
    for k, length in enumerate(LENGTHS):
        _row(f"{length:g}", {name: values[:, k] for name, values in found.items()})
    if given.chart:
        shown = {name: tuple(np.maximum(mean_interval(values), 0.0)) for name, values in found.items()}
        title = "error of a hidden partner, m"
        chart.lines([chart.Panel(title, LENGTHS, shown, "length of the occlusion, s", y_range=(0, 1.6))], given.chart)


def hiding_frames(truth: Truth, seed: int, fps: float) -> tuple[Bools, list[Frame]]:
    """Returns which rows of the truth are hidden, (R,), and the frames of a detector.

    The member of each true group with the highest id is not detected in the last AWAY s of every PERIOD s. Positions
    err by ROUGH m.
    """
    pos, unit = places(truth)
    plane: Plane = "image" if truth.pos is None else "ground"
    rng, hidden, frames = np.random.default_rng(seed), np.zeros(len(truth.id), bool), []
    last = {int(g): int(truth.id[truth.group == g].max()) for g in np.unique(truth.group[truth.group >= 0])}
    chosen = np.array([last.get(g) == p for g, p in zip(truth.group.tolist(), truth.id.tolist(), strict=True)])
    for index in range(1, truth.length + 1):
        rows, t = truth.rows(index), (index - 1) / fps
        hidden[rows] = chosen[rows] & (t % PERIOD >= PERIOD - AWAY)
        points = (pos[rows] + rng.normal(0, ROUGH * unit, (rows.stop - rows.start, 2)))[~hidden[rows]]
        frames.append(Frame(index, t, detections=Detections(index, t, plane, points, score=np.ones(len(points)))))
    return hidden, frames


def recordings(given: argparse.Namespace) -> None:
    """Prints a table: rows are recordings, columns the errors of both filters in hidden and in other rows."""
    tables.head(["recording", "people", *FILTERS, DIFFERENCE])
    for label, path in (("seq_hotel", HOTEL), ("zara01", ZARA), ("Meet_WalkTogether1", WALK_TOGETHER)):
        (q,) = open_source(given.data / path)
        found: dict[str, dict[str, list[float]]] = {
            kind: {name: [] for name in FILTERS} for kind in ("hidden", "others")
        }
        for seed in given.seeds:
            hidden, frames = hiding_frames(q.truth, seed, q.fps)
            for name in FILTERS:
                tracker = find(name)(config_of(name, given.counts[0], given).with_set(EVERYBODY))
                tracker.reset(Context(q.fps, places(q.truth)[1] if q.truth.pos is None else float("nan")), seed)
                away = errors(q.truth, [tracker.step(frame, frame.detections) for frame in frames])
                found["hidden"][name].append(float(away[hidden].mean()))
                found["others"][name].append(float(away[~hidden].mean()))
        for kind, mean in found.items():
            _row(f"{label} | {kind}", mean)
