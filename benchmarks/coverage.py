"""How often 95 % intervals hold the truth, on simulated recordings.

    python -m benchmarks.coverage recordings [--scenes plaza street quiet] [--seeds 20000:20008]

recordings: stationary scenes of 5 minutes, in which people pass by and groups meet, stand and part at random times.
Each is tracked once from its sensor's detections, by `blob` and `group-pda`, and scored as five recordings of 1 minute,
two of 2 minutes and one of 5 minutes. The truth is the mean score over all recordings of a scene, tracker and length.
Columns: share of intervals that hold the truth, with Wilson's interval; mean width of an interval; number of
recordings without an interval. Seeds on which an order fails are left out and printed.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.options import add_seeds, new_parser, one_thread
from benchmarks.support.tables import head, number, row, share
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Tracks, Truth
from tracking.recording_ranking import SCALES, presence
from tracking.running.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer
from tracking.stats import block_intervals

KEYS = ("HOTA", "IDF1", "MOTA", "IDSW", "group_F1_hull", "event_F1")
MORE = ("AssA", "GOSPA", "pairwise_F1", "group_HOTA", "group_IDSW", "lineage_accuracy")
TRACKERS = ("blob", "group-pda")
FPS, LEAD, SECONDS, TAIL = 5, 25, 300, 30  # of LEAD + SECONDS + TAIL seconds the middle ones are scored
MINUTES = (1, 2, 5)
DRAWS = 200
SIZE = 24.0  # m


@dataclass(frozen=True)
class Scene:
    """A stationary scene. arrivals, meetings: seconds from one to the next, on average; sides: of the square on which
    people arrive; detect_prob, clutter: of the sensor.
    """

    arrivals: float
    meetings: float
    sides: int
    detect_prob: float
    clutter: float


SCENES = {
    "plaza": Scene(6, 14, 4, 0.85, 0.5),
    "street": Scene(6, 14, 2, 0.85, 0.5),
    "quiet": Scene(10, 10, 4, 0.95, 0.1),
}


def scenario_text(scene: Scene, seed: int) -> str:
    """Returns a scenario file: groups that pass by, and groups that meet, stand and part, all at random times."""
    r = np.random.default_rng([17, seed])
    duration = LEAD + SECONDS + TAIL
    groups, events = [], []
    for k in range(r.poisson(duration / scene.arrivals)):
        a, b = r.uniform(2, SIZE - 2, 2)
        ways = [((a, 0.7), (b, SIZE - 0.7)), ((a, SIZE - 0.7), (b, 0.7)), ((0.7, a), (SIZE - 0.7, b))]
        ways.append(((SIZE - 0.7, a), (0.7, b)))
        start, goal = ways[int(r.integers(scene.sides))]
        groups.append(
            f'{{ id = "p{k}", size = {r.choice([1, 1, 2, 3])}, enter = {r.uniform(0, duration - 1):.2f}, '
            f'start = {_near(start, 1.5)}, goal = {_point(goal)}, at_goal = "leave" }}'
        )
    for k, t in enumerate(np.sort(r.uniform(0, duration - 28, r.poisson(duration / scene.meetings)))):
        place, along, apart = r.uniform(7, SIZE - 7, 2), _direction(r), _direction(r)
        sizes = r.choice([1, 2, 2, 3]), r.choice([1, 1, 2])
        for name, size, side in (("a", sizes[0], -1), ("b", sizes[1], 1)):
            start, goal = place + side * 3.5 * along, place + side * 2.7 * along
            groups.append(
                f'{{ id = "{name}{k}", size = {size}, enter = {t:.2f}, '
                f"start = {_near(start, 1)}, goal = {_point(goal)} }}"
            )
        ends = [_point(np.clip(place + side * 30 * apart, 0.7, SIZE - 0.7)) for side in (1, -1)]
        events.append(
            f'{{ id = "m{k}", type = "merge", groups = ["a{k}", "b{k}"], into = "ab{k}", '
            f"when = {{ time = {t + r.uniform(0.5, 2):.2f} }} }}"
        )
        events.append(
            f'{{ id = "s{k}", type = "split", group = "ab{k}", parts = [{{ id = "c{k}", '
            f'size = {r.integers(1, sum(sizes))}, goal = {ends[0]}, at_goal = "leave" }}, {{ id = "d{k}", '
            f'goal = {ends[1]}, at_goal = "leave" }}], when = {{ after = "m{k}", delay = {r.uniform(2, 6):.2f} }} }}'
        )
    return "\n".join(
        [
            'schema = 1\nabout = "people pass by, groups meet and part, at random times"',
            f"duration = {duration}\nworld = {{ size = [{SIZE}, {SIZE}] }}",
            f'camera = {{ kind = "top", fps = {FPS}, image = [640, 640] }}',
            f"sensor = {{ detect_prob = {scene.detect_prob}, clutter_rate = {scene.clutter} }}",
            f"group = [\n{_rows(groups)}]\nevent = [\n{_rows(events)}]",
        ]
    )


def _direction(r: np.random.Generator) -> np.ndarray:
    angle = r.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def _point(p: Sequence[float]) -> str:
    return "[" + ", ".join(f"{v:.2f}" for v in p) + "]"


def _near(p: Sequence[float], reach: float) -> str:
    ends = [(max(1.0, v - reach), min(SIZE - 1.0, v + reach)) for v in p]
    return "[" + ", ".join(f"{{ uniform = [{min(a, b):.2f}, {max(a, b):.2f}] }}" for a, b in ends) + "]"


def _rows(rows: Sequence[str]) -> str:
    return "".join(f"  {text},\n" for text in rows)


# One recording: scene, seed, tracker, minutes, part, and by key (score, low, high).
Row = dict[str, Any]


def rows_of(name: str, seed: int) -> Iterator[Row]:
    """Yields the rows of one scene and seed. Raises FlockscopeError if an order fails."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.toml"
        file.write_text(scenario_text(SCENES[name], seed), encoding="utf-8")
        sequence = simulate(load(file), seed, streams=())
    truth = sequence.truth
    assert truth is not None
    for tracker in TRACKERS:
        answers = tuple(track(tracker, sequence, detections="file"))
        for minutes in MINUTES:
            length = minutes * 60 * FPS
            for part in range(SECONDS // 60 // minutes):
                first = LEAD * FPS + 1 + part * length
                found = intervals(truth, answers, range(first, first + length))
                yield {"scene": name, "seed": seed, "tracker": tracker, "minutes": minutes, "part": part, **found}


def intervals(truth: Truth, answers: Sequence[Tracks], frames: range) -> dict[str, tuple[float, float, float]]:
    """Returns score, low and high end of each key of KEYS and MORE, of a recording that is some frames of another."""
    scorer = Scorer(truth).compare([answers], frames=frames)[0].weighted_scores("hull")
    at = [list(CATALOGUE).index(key) for key in (*KEYS, *MORE)]

    def score(weights: np.ndarray) -> np.ndarray:
        every = np.zeros((len(weights), truth.length))
        every[:, frames.start - 1 : frames.stop - 1] = weights
        return scorer(every)[:, at]

    likeness = presence(truth.id[(truth.frame >= frames.start) & (truth.frame < frames.stop)])
    ends = block_intervals(score, len(frames), truth.fps, likeness, DRAWS, [SCALES[k] for k in at])
    return dict(zip((*KEYS, *MORE), zip(*(end.tolist() for end in ends), strict=True), strict=True))


def measured(seeds: range, scenes: Sequence[str]) -> list[Row]:
    """Returns the rows of all scenes and seeds."""
    rows: list[Row] = []
    for seed in seeds:
        for name in scenes:
            try:
                rows += rows_of(name, seed)
            except FlockscopeError as error:
                print(f"{name}, seed {seed}, left out: {error.line()}", flush=True)
    return rows


def recordings(rows: list[Row]) -> None:
    """Prints for each score how often intervals hold the truth, over all scenes and trackers, by length."""
    head(["score", *(f"{m} min: {what}" for m in MINUTES for what in ("held", "width", "none"))])
    for key in (*KEYS, *MORE):
        row([key, *(cell for m in MINUTES for cell in cells(rows, key, m))])
    print("\nby scene and tracker, share held")
    parts = sorted({(r["scene"], r["tracker"]) for r in rows})
    head(["score", *(f"{scene}, {tracker}, {m} min" for scene, tracker in parts for m in MINUTES)])
    for key in KEYS:
        found = ([r for r in rows if (r["scene"], r["tracker"]) == part] for part in parts)
        row([key, *(cells(some, key, m)[0].split(" ")[0] for some in found for m in MINUTES)])


def cells(rows: list[Row], key: str, minutes: int) -> list[str]:
    """Returns share held, mean width and number of recordings without interval, of one score and length."""
    held = count = none = 0
    width = 0.0
    for part in {(r["scene"], r["tracker"]) for r in rows}:
        own = [r[key] for r in rows if (r["scene"], r["tracker"]) == part and r["minutes"] == minutes]
        values, low, high = np.array(own, float).T
        if not np.isfinite(values).any():
            continue
        truth, known = np.nanmean(values), np.isfinite(low)
        held += int(((low <= truth) & (truth <= high))[known].sum())
        width += float((high - low)[known].sum())
        count, none = count + int(known.sum()), none + int((~known).sum())
    return [share(held, count), number(width / count if count else float("nan")), str(none)]


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["recordings"])
    parser.add_argument("--scenes", nargs="+", default=[*SCENES], metavar="NAME")
    add_seeds(parser, "20000:20008")
    args = parser.parse_args()
    one_thread()
    recordings(measured(args.seeds, args.scenes))


if __name__ == "__main__":
    main()
