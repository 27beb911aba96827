"""`relational` and `particle`: the paper's Fig. 7 with simulated scenes, and a hidden partner.

    python -m benchmarks.relational MODE [--seeds a:b] [--counts 500,1000,…] [--set k=v]… [--params PRESET]

particles  error of both filters against the number of particles, on two scenes with occlusion: people who walk in
           groups past each other (cross) and past a pillar. The detections are those of the simulated detector, whose
           foot points are displaced by partial occlusion
hidden     error of one of two people who walk together while nobody sees this one, against the length of the occlusion

The error of a frame is the sum, over the true people, of the distance to the track that an optimal assignment gives
them, at most 2 m, which is also the cost of a missing track; the table has its mean per person and frame. Both filters
have the same detections and the same seeds; the filter's seed is that of the scene. Differences are paired, with 95 %
intervals of means over seeds.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.support import tables
from benchmarks.support.options import add_seeds, new_parser, one_thread
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Array, Context, Detections, Frame, Tracks, Truth
from tracking.filters.assignment import optimal
from tracking.papers.relational.config import ParticleConfig
from tracking.prepare import prepare
from tracking.stats import mean_interval, paired
from tracking.tracker_registry import find

FILTERS = ("particle", "relational")
SCENES = ("cross", "pillar")
CUT = 2.0
"""Largest error of a person, and cost of a missing track, m."""
LENGTHS = (0.2, 0.5, 1.0, 2.0, 3.0)
"""Lengths of the occlusion in mode hidden, s."""
FPS, SEEN, NOISE = 10.0, 4.0, 0.05
"""Mode hidden: frames per second, s before the occlusion, standard deviation of a detection, m."""


def errors(truth: Truth, tracks: Sequence[Tracks]) -> Array:
    """Returns the error of each person and frame of the truth, (R,), m."""
    out = np.full(len(truth.id), CUT)
    assert truth.pos is not None
    for t in tracks:
        rows = truth.rows(t.index)
        away = np.hypot(*(truth.pos[rows][:, None] - t.pos[None, :, :2]).transpose(2, 0, 1))
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


def particles(given: argparse.Namespace) -> None:
    """Prints a table for each scene: rows are numbers of particles, columns both filters and their difference."""
    for scene in SCENES:
        sequences = [simulate(load(scene), seed, 0, ()) for seed in given.seeds]
        print(f"\n{scene}: mean error per person and frame, m; seeds {given.seeds.start}:{given.seeds.stop}\n")
        tables.head(
            ["particles", *FILTERS, "relational − particle", "frames with all weights 0 (particle, relational)"]
        )
        for count in given.counts:
            mean, vanished = {name: [] for name in FILTERS}, dict.fromkeys(FILTERS, 0)
            for seed, sequence in zip(given.seeds, sequences, strict=True):
                for name in FILTERS:
                    config = config_of(name, count, given)
                    ready = prepare(name, sequence, params=config, detections="file")
                    ready.reset(seed)
                    tracks = [ready.step(frame) for frame in ready.frames()]
                    mean[name].append(errors(sequence.truth, tracks).mean())
                    vanished[name] += ready.tracker.vanished
            _row(str(count), mean, f"{vanished['particle']}, {vanished['relational']}")


def _row(first: str, mean: dict[str, list[float]], last: str = "") -> None:
    values = {name: np.array(x) for name, x in mean.items()}
    cells = [tables.interval(*map(float, mean_interval(values[name]))) for name in FILTERS]
    difference = tables.signed(*map(float, paired(values["particle"], values["relational"])))
    tables.row([first, *cells, difference, *([last] if last else [])])


def pair(seed: int, length: float) -> tuple[Array, Iterator[Frame]]:
    """Returns the places (T, 2, 2) of two people who walk together, and the frames of a detector.

    Their common velocity wanders; the second is not detected from SEEN s on, for `length` s. The walk and the errors of
    a seed do not depend on the length.
    """
    rng, dt = np.random.default_rng(seed), 1 / FPS
    count = round((SEEN + max(LENGTHS) + 1) * FPS)
    velocity = np.array([1.3, 0.0]) + np.cumsum(rng.normal(0, 0.25 * dt**0.5, (count, 2)), axis=0)
    middle = np.cumsum(velocity * dt, axis=0)
    sway = 0.05 * np.sin(2 * np.pi * np.arange(count)[:, None, None] * dt / 2 + rng.uniform(0, 6, (1, 2, 2)))
    pos = middle[:, None] + np.array([[0, 0.35], [0, -0.35]]) + sway
    seen = pos + rng.normal(0, NOISE, pos.shape)
    first, last = round(SEEN * FPS), round((SEEN + length) * FPS)

    def frames() -> Iterator[Frame]:
        for k in range(last):
            points = seen[k, :1] if k >= first else seen[k]
            found = Detections(k + 1, k * dt, "ground", points, None, None, np.ones(len(points)))
            yield Frame(k + 1, k * dt, detections=found)

    return pos, frames()


def hidden(given: argparse.Namespace) -> None:
    """Prints a table: rows are lengths of the occlusion, columns the error of the hidden person in its last frame."""
    print("\nerror of the hidden one of two people in the last frame of the occlusion, m, at most 2\n")
    tables.head(["occlusion, s", *FILTERS, "relational − particle"])
    for length in LENGTHS:
        mean = {name: [] for name in FILTERS}
        for seed in given.seeds:
            for name in FILTERS:
                tracker = find(name)(config_of(name, given.counts[0], given))
                tracker.reset(Context(FPS, float("nan")), seed)
                pos, frames = pair(seed, length)
                for frame in frames:
                    tracks = tracker.step(frame, frame.detections)
                true = pos[frame.index - 1]
                away = np.hypot(*(true[:, None] - tracks.pos[None]).transpose(2, 0, 1))
                people, found = optimal(away, CUT)
                mean[name].append(dict(zip(people.tolist(), away[people, found], strict=True)).get(1, CUT))
        _row(f"{length:g}", mean)


def main() -> None:
    parser = new_parser(__doc__)
    modes = {"particles": particles, "hidden": hidden}
    parser.add_argument("mode", choices=modes)
    add_seeds(parser, "20000:20030")
    parser.add_argument("--counts", type=lambda x: [int(n) for n in x.split(",")], default=[500, 1000, 2000, 4000])
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="parameters of both filters")
    parser.add_argument("--params", help="preset of both filters, as paper")
    given = parser.parse_args()
    modes[given.mode](given)


if __name__ == "__main__":
    one_thread()
    main()
