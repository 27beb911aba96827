"""Tuning by search: what it gains on scenes that were not searched, and on recordings that nothing was tuned on.

    python -m benchmarks.tuning search [blob] [group-pda] [grouping] --out FOLDER [--trials N] …
    python -m benchmarks.tuning real [blob] [group-pda] [grouping] --out FOLDER [--data FOLDER]       after `search`

search: on the suites of benchmarks/tuning_suites (or --suite), training seeds. Printed: defaults and tuned parameters
on test seeds, and on friends-meet or crossing, which share no scenario with the suites. An interrupted search continues
when it is started again. --sensor: detections err as this profile says (`flockscope fit sensor`), for trackers of
boxes.
real: present defaults and the parameters that `search` found, on recordings: `blob`
on PETS09-S2L1 (200 frames) and TUD-Campus from their det/det.txt; `group-pda` and the baseline grouping rule on
seq_hotel and CAVIAR Meet_WalkTogether1 from labelled people. With several objectives the whole front is compared.
Intervals are by moving blocks, of the differences from the present defaults.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.support.options import CAMPUS, HOTEL, PETS, WALK_TOGETHER, add_data, new_parser
from scenarios import sensor_settings
from sim.io.source import open_source
from sim.types import Array, Sequence, Tracks
from tracking.config import Config
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule
from tracking.ranking import presence_in
from tracking.running.run import track
from tracking.running.tracker_registry import find
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import weighted_scorers
from tracking.stats import block_intervals
from tracking.tuning import tune

SUITES = Path(__file__).parent / "tuning_suites"
DRAWS = 200


@dataclass(frozen=True)
class Search:
    """Tracker, suite of training scenes, objective, detections, and seeds per scene in training and validation."""

    tracker: str
    suite: str
    objective: str
    detections: str
    seeds: int
    validation: int


SEARCHES = {
    s.tracker: s
    for s in (
        Search("blob", "detectors.toml", "HOTA", "file", 3, 5),
        Search("group-pda", "labelled.toml", "objective", "file", 3, 5),
        Search("grouping", "groups.toml", "pairwise_F1", "truth", 8, 16),
    )
}
RECORDINGS = {
    "blob": ((PETS, "file"), (CAMPUS, "file")),
    "group-pda": ((HOTEL, "truth"), (WALK_TOGETHER, "truth")),
    "grouping": ((HOTEL, "truth"), (WALK_TOGETHER, "truth")),
}
KEYS = {
    "blob": ("HOTA", "MOTA", "IDF1"),
    "group-pda": ("group_F1_hull", "group_1-FP", "group_1-FN", "group_GDSR", "group_MOTP"),
    "grouping": ("pairwise_F1", "pairwise_precision", "pairwise_recall"),
}


def _difference(first: Callable[[Array], Array], second: Callable[[Array], Array], weights: Array) -> Array:
    return first(weights) - second(weights)


def search(given: argparse.Namespace) -> None:
    for name in given.names or SEARCHES:
        wanted = SEARCHES[name]
        begun, suite = time.perf_counter(), given.suite or SUITES / wanted.suite
        found = tune(
            wanted.tracker, suite, given.trials or 60, objective=given.objective or wanted.objective,
            detections=wanted.detections, workers=given.workers, out=given.out / f"{name}.toml", only=given.only,
            finalists=given.finalists,
            seeds=range(wanted.seeds), validation=range(10_000, 10_000 + (given.validation or wanted.validation)),
            test=range(20_000, 20_013), progress=progress_printer(),
            set=sensor_settings(given.sensor) if given.sensor else (),
        )  # fmt: skip
        print(found)
        for key, (old, new) in found.changed.items():
            print(f"  {key}: {old} → {new}")
        print(f"  {time.perf_counter() - begun:.0f} s\n", flush=True)


def progress_printer() -> Callable[[int, int | None, str], None]:
    """Returns a function that prints progress at most once in 30 s."""
    last = [0.0]

    def print_progress(done: int, total: int | None, what: str) -> None:
        if time.monotonic() - last[0] > 30:
            last[0] = time.monotonic()
            print(f"  … {done} of {total} {what}", flush=True)

    return print_progress


def real(given: argparse.Namespace) -> None:
    for name in given.names or RECORDINGS:
        for path, mode in RECORDINGS[name]:
            (sequence,) = open_source(given.data / path, images=False)
            print_comparison(name, sequence, mode, compared_configs(name, given.out))


def compared_configs(name: str, folder: Path) -> dict[str, Config]:
    """Returns present defaults and what the search found; of several objectives the whole front."""
    kind = LinkRule if name == "grouping" else find(name).config_class
    files = sorted(folder.glob(f"{name}.front-*.toml"), key=lambda path: (len(path.name), path))
    files = files or [folder / f"{name}.toml"]
    found = {path.stem.rpartition(".")[2] if len(files) > 1 else "tuned": kind.from_toml(path) for path in files}
    return {"present": kind(), **found}


def print_comparison(name: str, sequence: Sequence, mode: str, chosen: dict[str, Config]) -> None:
    """Prints the scores on a recording, and differences from the present defaults with intervals."""
    truth = sequence.truth
    assert truth is not None
    every = list(CATALOGUE)
    at = [every.index(key) for key in KEYS[name]]
    runs = [tracks_of(name, sequence, mode, c) for c in chosen.values()]
    scorers = dict(zip(chosen, weighted_scorers(truth, runs), strict=True))
    print(
        f"{name} on {sequence.name}, {truth.length / truth.fps:.0f} s, {mode}; in brackets minus the present defaults"
    )
    for which, scorer in scorers.items():
        whole = scorer(np.ones((1, truth.length)))[0]
        less, low, high = block_intervals(
            partial(_difference, scorer, scorers["present"]), truth.length, truth.fps, presence_in(truth), DRAWS
        )
        cells = []
        for k, key in zip(at, KEYS[name], strict=True):
            ends = "" if which == "present" else f" ({less[k]:+.3f} [{low[k]:+.3f}, {high[k]:+.3f}])"
            cells.append(f"{key} {whole[k]:.3f}{ends}")
        print(f"  {which:8} " + "   ".join(cells), flush=True)


def tracks_of(name: str, sequence: Sequence, mode: str, config: Config) -> list[Tracks]:
    truth = sequence.truth
    assert truth is not None
    if isinstance(config, LinkRule):
        return derive(people_as_tracks(truth), truth.fps, truth.px_per_m, config)
    return list(track(name, sequence, params=config, detections=mode))


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["search", "real"])
    parser.add_argument("names", nargs="*", choices=[*SEARCHES, []])
    parser.add_argument("--out", type=Path, default=Path("tuned"))
    parser.add_argument("--trials", type=int)
    parser.add_argument("--validation", type=int, help="seeds of each scene")
    parser.add_argument("--suite", type=Path, help="search: instead of the tracker's own suite")
    parser.add_argument("--objective", action="append", help="search: instead of the tracker's own; may be repeated")
    parser.add_argument("--only", action="append", default=[], help="search: only this parameter; may be repeated")
    parser.add_argument("--finalists", type=int, default=5, help="search: trials that are played on validation scenes")
    parser.add_argument("--sensor", type=Path)
    parser.add_argument("--workers", type=int, default=1, help="search: processes; the result does not depend on it")
    add_data(parser)
    given = parser.parse_intermixed_args()
    {"search": search, "real": real}[given.mode](given)


if __name__ == "__main__":
    main()
