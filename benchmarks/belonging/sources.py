"""Streets, real and simulated, sampled at 2.5 frames/s: who was where when, and the features of pairs.

A source is a recording, or all entries and seeds of a scenario or suite. `write` stores a source as FOLDER/NAME.npz,
which benchmarks/peers/classify_pairs.py reads without flockscope; `read` reads it back.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from benchmarks.belonging.pair_features import NAMES, Pairs, pair_features
from scenarios.loading.resolve import Entry, resolve
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Array, Bools, Ints, Truth
from tracking.tuning.grouping_episodes import SURVEYED, with_label_errors

FPS = 2.5
BLOCKS = 10  # of a recording
PAIR_FIELDS = ("pair_scene", "pair_frame", "a", "b", "features", "mates", "part", "drawn")
SCENE_ROWS = 2_000  # of pairs, at most, of a simulated scene


@dataclass(frozen=True)
class Source:
    """All scenes of a source: rows of people, then rows of pairs (see `Pairs`).

    length (S,): frames of each scene. scene, frame (from 1), id, group (-1: alone) (R,), pos (R, 2) in m: one row per
    person and frame. pair_scene, pair_frame, a, b (K,): of each row of a pair; features (K, 21): columns
    `pair_features.NAMES`; mates (K,): True if the two have one group label in this frame. part (K,): number of the
    scene; in a recording the tenth of its frames in which the pair is first seen together. Rows of one pair have one
    part. drawn (K,): True for all rows of a recording, and for at most SCENE_ROWS of each simulated scene.
    """

    length: Ints
    scene: Ints
    frame: Ints
    id: Ints
    group: Ints
    pos: Array
    pair_scene: Ints
    pair_frame: Ints
    a: Ints
    b: Ints
    features: Array
    mates: Bools
    part: Ints
    drawn: Bools


def sample(truth: Truth) -> Truth:
    """Returns every n-th frame of a truth, so that it has 2.5 frames/s: frames, ids, groups and positions.

    People more than half outside the image are left out.
    """
    assert truth.pos is not None
    every = round(truth.fps / FPS)
    rows = (truth.frame - 1) % every == 0
    if truth.truncation is not None:
        rows &= truth.truncation <= 0.5
    return Truth(
        name=truth.name, fps=FPS, length=(truth.length - 1) // every + 1, px_per_m=truth.px_per_m,
        frame=(truth.frame[rows] - 1) // every + 1, id=truth.id[rows], group=truth.group[rows], pos=truth.pos[rows],
        vel=None, box=None, visibility=truth.visibility[rows],
    )  # fmt: skip


def source_of(truths: Iterable[Truth], *, recording: bool) -> Source:
    """Returns the rows of people and pairs of truths at 2.5 frames/s."""
    scenes = [_rows(number, truth, None if recording else number) for number, truth in enumerate(truths)]
    return Source(**{name: np.concatenate([rows[name] for rows in scenes]) for name in scenes[0]})


def _rows(number: int, truth: Truth, part: int | None) -> dict[str, np.ndarray]:
    """Returns the fields of `Source` for one scene; part: None stands for the tenths of a recording."""
    assert truth.pos is not None
    pairs = pair_features(truth.frame, truth.id, truth.pos, FPS)
    ids = np.unique(truth.id)
    a, b = (np.searchsorted(ids, person) for person in (pairs.a, pairs.b))
    _, met, pair = np.unique(a * len(ids) + b, return_index=True, return_inverse=True)
    tenth = (pairs.frame[met][pair] - 1) * BLOCKS // truth.length
    rank = np.random.default_rng(number).permutation(len(a))
    return {
        "length": np.array([truth.length]), "scene": np.full(len(truth.frame), number), "frame": truth.frame,
        "id": truth.id, "group": truth.group, "pos": truth.pos, "pair_scene": np.full(len(a), number),
        "pair_frame": pairs.frame, "a": pairs.a, "b": pairs.b, "features": pairs.features,
        "mates": are_mates(truth, pairs), "part": tenth if part is None else np.full(len(a), part),
        "drawn": (rank < SCENE_ROWS) | (part is None),
    }  # fmt: skip


def are_mates(truth: Truth, pairs: Pairs) -> Bools:
    """Returns flags (K,): True if the two of a row of pairs have one group label in its frame."""
    ids, column = np.unique(truth.id, return_inverse=True)
    label = np.full((truth.length + 1, len(ids)), -1, np.int64)
    label[truth.frame, column] = truth.group
    a, b = (label[pairs.frame, np.searchsorted(ids, person)] for person in (pairs.a, pairs.b))
    return np.asarray((a >= 0) & (a == b))


def recorded(folder: Path) -> Source:
    """Returns a recording with labelled groups. Raises InputError if it cannot be read."""
    truth = open_source(folder)[0].truth
    assert truth is not None, f"{folder} has labels"
    return source_of([sample(truth)], recording=True)


def simulated(name: str, seeds: range, label_errors: bool) -> Source:
    """Returns all entries and seeds of a scenario, suite or *.toml file.

    label_errors: the positions get the errors of a labeller (`SURVEYED`, 0.02 m).
    """
    truths = (_sampled(entry, seed, label_errors) for entry in resolve(name) for seed in seeds)
    return source_of(truths, recording=False)


def _sampled(entry: Entry, seed: int, label_errors: bool) -> Truth:
    truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
    assert truth is not None
    return sample(with_label_errors(truth, SURVEYED, seed, entry.repeat) if label_errors else truth)


def of_scenes(source: Source, kept: Ints) -> Source:
    """Returns the scenes of a source whose numbers are in kept (K,), numbered from 0 in this order."""
    number = np.full(len(source.length), -1)
    number[kept] = np.arange(len(kept))
    people, pairs = number[source.scene] >= 0, number[source.pair_scene] >= 0
    rows = {f.name: getattr(source, f.name)[pairs if f.name in PAIR_FIELDS else people] for f in fields(Source)[1:]}
    rows |= {name: number[rows[name]] for name in ("scene", "pair_scene")}
    return Source(length=source.length[kept], **rows)


def write(folder: Path, name: str, source: Source) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    rows = {field.name: getattr(source, field.name) for field in fields(Source)}
    np.savez(folder / f"{name}.npz", **rows, names=np.array(NAMES))


def read(folder: Path, name: str) -> Source:
    """Returns a source that was written. Raises SystemExit if it was not, or has other features."""
    path = folder / f"{name}.npz"
    if not path.is_file():
        raise SystemExit(f"{path}: no such file; write it with: python -m benchmarks.belonging pairs --out {folder}")
    with np.load(path) as file:
        if tuple(file["names"]) != NAMES:
            raise SystemExit(f"{path}: other features than these; write it again: python -m benchmarks.belonging pairs")
        return Source(**{field.name: file[field.name] for field in fields(Source)})
