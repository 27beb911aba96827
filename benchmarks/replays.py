"""Replays beside the recordings they show: places, speeds, accelerations, groups and events.

    PYTHONPATH=. python benchmarks/replays.py [--data FOLDER]    or $FLOCKSCOPE_DATA

`off`: how far the replay is from the labelled place at the label's time (50, 99 %, m). Speeds (50, 99 %, m/s) and
accelerations (99 %, m/s²) of the recording are of its labels as they are, read at its own rate; those of the replay at
10 frames/s. Events by kind: as measured on the labels, and on the replay.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from pathlib import Path

import numpy as np

from scenarios.schema.observation import ObservationSpec
from sim.dataset.replay import on_ground, replay
from sim.io.source import open_source
from sim.types import Array, Sequence, Truth

RECORDINGS = ("biwi/seq_hotel", "caviar/mwt1gt.xml", "mot/PETS09-S2L1-first200")


def off(source: Sequence, made: Sequence) -> Array:
    """Distances between labels and replay, m, where a frame of the replay is at a label's time."""
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


def motion(frame: Array, id: Array, pos: Array, fps: float) -> tuple[Array, Array]:
    """Speeds and accelerations by differences of neighbouring frames."""
    speeds, accelerations = [], []
    for one in np.unique(id):
        f, p = frame[id == one], pos[id == one]
        v, near = np.diff(p, axis=0) * fps, np.diff(f) == 1
        speeds.append(np.linalg.norm(v[near], axis=1))
        accelerations.append(np.linalg.norm(np.diff(v, axis=0)[near[1:] & near[:-1]], axis=1) * fps)
    return np.concatenate(speeds), np.concatenate(accelerations)


def events(truth: Truth) -> str:
    if truth.events is None:
        return "not labelled"
    return ", ".join(f"{n} {kind}" for kind, n in sorted(Counter(e.kind for e in truth.events).items()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FLOCKSCOPE_DATA", default)))
    args = parser.parse_args()
    for name in RECORDINGS:
        source = open_source(args.data / name, images=False)[0]
        start = time.perf_counter()
        made = replay(source, ObservationSpec(), streams=())
        labels, truth = source.truth, made.truth
        spent = time.perf_counter() - start
        assert labels is not None
        assert truth is not None
        assert truth.pos is not None
        away = np.quantile(off(source, made), (0.5, 0.99))
        print(f"\n{name}: {made.length} frames, {len(made.source['origin']['people'])} people, {spent:.1f} s to make")
        print(f"  smoothing {made.source['origin']['smoothing']:g} s, off {away[0]:.3f}, {away[1]:.3f} m")
        pairs = ((labels, on_ground(labels, source), "recording"), (truth, truth.pos, "replay"))
        for some, pos, what in pairs:
            speed, acceleration = motion(some.frame, some.id, pos, some.fps)
            q = (*np.quantile(speed, (0.5, 0.99)), np.quantile(acceleration, 0.99))
            print(f"  {what:9}  speed {q[0]:.2f}, {q[1]:.2f} m/s, acceleration {q[2]:.2f} m/s²; {events(some)}")


if __name__ == "__main__":
    main()
