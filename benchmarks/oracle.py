"""The oracle of every scenario and suite, and of real recordings: the scores that the detections allow.

    python -m benchmarks.oracle [--seeds 20000:20005] [--data FOLDER] [scenario, suite or recordings …]

The oracle has the true id of each detection that matches a person, and no false alarm (`tracking.oracle`). HOTA is
the mean over seeds, of a suite over its entries; the lowest entry stands beside it. Columns: by distance on the ground
and by boxes (IoU), first with all errors of the sensor, then with those of the boxes alone: everybody is detected, the
boxes are those of whole people, nothing is a false alarm, and points on the ground are those below the boxes.
Height: median and 5 % quantile of the labelled boxes, px. Hidden: share of people of whom less than three quarters are
visible. Of copies of an entry the first counts.

recordings: HOTA by boxes of the oracle and of `blob` with the detections of det.txt, and blob's share of the oracle's.
Without names: the whole catalogue, all suites, and the recordings.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.support.options import (
    CAMPUS,
    PETS,
    TOWN_CENTRE,
    add_data,
    add_seeds,
    new_parser,
    one_thread,
    seeds_text,
)
from benchmarks.support.tables import head, number, row
from scenarios.loading.resolve import Entry, names, resolve, suite_names
from sim.crowd.world import run
from sim.sequence import observe
from sim.types import Sequence as Recording
from tracking.oracle import oracle
from tracking.recordings.source import open_source
from tracking.running.run import track
from tracking.scoring.evaluation import Scorer
from tracking.scoring.people import Similarity

RECORDINGS = "recordings"
REAL = (PETS, CAMPUS, TOWN_CENTRE)
BOX_ERRORS_ALONE = {
    "detect_prob": 1.0, "occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0, "persistence": 0.0,
    "clutter_rate": 0.0, "box": "amodal", "noise_m": 0.0, "by_visibility": None, "miss_memory": None, "hide": (),
    "points": "foot",
}  # fmt: skip
COLUMNS = ("ground", "boxes", "ground, box errors", "boxes, box errors", "height", "5 %", "hidden")
BOXES = COLUMNS.index("boxes, box errors")


def oracle_hota(sequence: Recording, similarity: Similarity) -> float:
    """Returns HOTA of the oracle with the sequence's own detections."""
    truth = sequence.truth
    assert truth is not None
    return Scorer(truth).evaluate(oracle(sequence, {}, similarity).tracks, similarity=similarity)["HOTA"]


def figures(entry: Entry, seed: int) -> np.ndarray:
    """Returns the figures of COLUMNS of one sequence."""
    scenario, motion = entry.scenario, run(entry.scenario, seed, entry.repeat)
    made = observe(scenario, motion, check=False)
    truth = made.truth
    assert truth is not None
    assert truth.box is not None
    alone = scenario.model_copy(update={"sensor": scenario.sensor.model_copy(update=BOX_ERRORS_ALONE)})
    exact = replace(observe(alone, motion, check=False), load_truth=lambda: truth)
    scores = [oracle_hota(s, by) for s in (made, exact) for by in ("ground", "boxes")]
    height = truth.box[:, 3]
    return np.array([*scores, np.median(height), np.quantile(height, 0.05), np.mean(truth.visibility < 0.75)])


def rows_of(name: str, seeds: range, known: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Yields name and mean figures of each entry; `known` holds those of scenarios that were measured before."""
    for entry in resolve(name):
        if entry.repeat > 1:
            continue
        key = f"{entry.repeat} {entry.scenario.model_dump_json(exclude={'name', 'about'})}"
        if key not in known:
            known[key] = np.mean([figures(entry, seed) for seed in seeds], axis=0)
        yield entry.name, known[key]


def cells(mean: np.ndarray) -> list[str]:
    return [*(number(v) for v in mean[:4]), *(f"{v:.0f}" for v in mean[4:6]), f"{mean[6]:.1%}"]


def synthetic(wanted: Sequence[str], seeds: range, every: bool) -> None:
    """Prints one row for each scenario and each suite; every: and one for each entry of the suites."""
    print(f"\nOracle, seeds {seeds_text(seeds)}")
    head(["scenario or suite", *COLUMNS, "lowest entry, boxes, box errors"])
    known: dict[str, np.ndarray] = {}
    for name in wanted:
        found = dict(rows_of(name, seeds, known))
        if every and len(found) > 1:
            for one, mean in found.items():
                row([f"{name}: {one}", *cells(mean), ""])
        lowest = min(found, key=lambda one: found[one][BOXES])
        worst = f"{number(found[lowest][BOXES])} {lowest}" if len(found) > 1 else ""
        row([name, *cells(np.mean(list(found.values()), axis=0)), worst])


def recordings(data: Path) -> None:
    """Prints one row for each recording that is there, and why a row is missing for each other one."""
    print("\nReal recordings, det.txt")
    head(["recording", "oracle, boxes", "blob, boxes", "blob's share", "height", "5 %"])
    for path in REAL:
        if not (data / path).is_dir():
            row([Path(path).name, f"left out: {data / path} is absent", *[""] * 4])
            continue
        sequence = open_source(data / path, images=False)[0]
        truth = sequence.truth
        assert truth is not None
        assert truth.box is not None
        best = oracle_hota(sequence, "boxes")
        blob = Scorer(truth).evaluate(track("blob", sequence, detections="file").tracks, similarity="boxes")["HOTA"]
        heights = (f"{q:.0f}" for q in np.quantile(truth.box[:, 3], (0.5, 0.05)))
        row([Path(path).name, number(best), number(blob), number(blob / best), *heights])


def main() -> None:
    one_thread()
    parser = new_parser(__doc__)
    add_seeds(parser, "20000:20005")
    add_data(parser)
    parser.add_argument("--every", action="store_true", help="also a row for each entry of a suite")
    parser.add_argument("names", nargs="*", help="scenarios, suites, or recordings")
    args = parser.parse_args()
    warnings.simplefilter("ignore")  # TUD-Campus states no frame rate
    wanted = args.names or [*names(), *(f"suite:{name}" for name in suite_names()), RECORDINGS]
    if simulated := [name for name in wanted if name != RECORDINGS]:
        synthetic(simulated, args.seeds, args.every)
    if RECORDINGS in wanted:
        recordings(args.data)


if __name__ == "__main__":
    main()
