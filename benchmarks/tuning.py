"""Tuning by search: what it gains on scenes that were not searched, and on recordings that nothing was tuned on.

    PYTHONPATH=. python benchmarks/tuning.py search [blob] [group-pda] [grouping] --out FOLDER [--trials N] …
    PYTHONPATH=. python benchmarks/tuning.py real --out FOLDER [--data FOLDER]       after `search`
    PYTHONPATH=. python benchmarks/tuning.py workers|overhead

search: on the suites of benchmarks/tuning_suites (or --suite), training seeds; default → tuned on test seeds, and on
friends-meet or crossing, which share no scenario with them. A search that was interrupted goes on. --sensor: detections
err as this profile says (`flockscope fit sensor`), with --half in every second scene, for trackers of boxes.
real: first defaults (tracking/frozen), present defaults and what `search` found, on recordings: `blob` on PETS09-S2L1
(200 frames) and TUD-Campus from their det/det.txt, HOTA; on seq_hotel and CAVIAR Meet_WalkTogether1, from labelled
people, `group-pda` by group scores and the rule of groups by pairwise F1; of several goals the whole front. Intervals
by moving blocks, of the value and of the difference to the present defaults.
workers: seconds of one search by 1 and 2 processes. overhead: what a trial costs beside its episodes.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios import sensor_settings
from scenarios.loading.suites import read_entries
from sim.io.files.atomic import write_file
from sim.io.source import open_source
from sim.types import Ints, Sequence, Tracks
from tracking.config import Config
from tracking.environment.episodes import Episode, Source
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.link_rule import LinkRule
from tracking.run import track
from tracking.scoring.block_resampling import resampled_scorer
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import moving_blocks
from tracking.tracker_registry import find
from tracking.tuning import tune
from tracking.tuning.grouping_episodes import people_as_tracks
from tracking.tuning.options import TuneOptions
from tracking.tuning.search_plan import search_plan
from tracking.tuning.study import open_study
from tracking.tuning.trials import run_trials

SUITES = Path(__file__).parent / "tuning_suites"
DRAWS = 200


@dataclass(frozen=True)
class Search:
    """What is searched where, and by what it is tuned."""

    tracker: str
    suite: str
    objective: str
    detections: str
    seeds: int  # of each scene in training
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
    "blob": (("mot/PETS09-S2L1-first200", "file"), ("mot/TUD-Campus", "file")),
    "group-pda": (("biwi/seq_hotel", "truth"), ("caviar/mwt1gt.xml", "truth")),
    "grouping": (("biwi/seq_hotel", "truth"), ("caviar/mwt1gt.xml", "truth")),
}
KEYS = {
    "blob": ("HOTA", "MOTA", "IDF1"),
    "group-pda": ("group_F1_hull", "group_1-FP", "group_1-FN", "group_GDSR", "group_MOTP"),
    "grouping": ("pairwise_F1", "pairwise_precision", "pairwise_recall"),
}


def search(given: argparse.Namespace) -> None:
    for name in given.names or SEARCHES:
        wanted = SEARCHES[name]
        begun, suite = time.perf_counter(), given.suite or SUITES / wanted.suite
        if given.half:
            suite = half_sensed(suite, given.sensor, given.out)
        found = tune(
            wanted.tracker, suite, given.trials or 60, objective=given.objective or wanted.objective,
            detections=wanted.detections, workers=given.workers, out=given.out / f"{name}.toml", only=given.only,
            finalists=given.finalists,
            seeds=range(wanted.seeds), validation=range(10_000, 10_000 + (given.validation or wanted.validation)),
            test=range(20_000, 20_013), progress=said(),
            set=sensor_settings(given.sensor) if given.sensor and not given.half else (),
        )  # fmt: skip
        print(found)
        for key, (old, new) in found.changed.items():
            print(f"  {key}: {old} → {new}")
        print(f"  {time.perf_counter() - begun:.0f} s\n", flush=True)


def half_sensed(suite: Path, sensor: Path, out: Path) -> Path:
    """The suite with this detector in every second scene, the first one included."""
    rows = []
    for k, line in enumerate(read_entries(suite)):
        settings = (*line.settings, *(sensor_settings(sensor) if k % 2 == 0 else ()))
        name, scenario, more = map(json.dumps, (line.name, line.scenario, settings))
        rows.append(f"  {{ name = {name}, scenario = {scenario}, set = {more} }},")
    path = out / f"{suite.stem}-half-{sensor.stem}.toml"
    write_file(path, "\n".join(["entry = [", *rows, "]", ""]).encode())
    return path


def said() -> Callable[[int, int | None, str], None]:
    """Progress, at most once in 30 s."""
    last = [0.0]

    def tell(done: int, total: int | None, what: str) -> None:
        if time.monotonic() - last[0] > 30:
            last[0] = time.monotonic()
            print(f"  … {done} of {total} {what}", flush=True)

    return tell


def real(given: argparse.Namespace) -> None:
    for name in given.names or RECORDINGS:
        for path, mode in RECORDINGS[name]:
            (sequence,) = open_source(given.data / path, images=False)
            compared(name, sequence, mode, configs(name, given.out))


def configs(name: str, folder: Path) -> dict[str, Config]:
    """First defaults, present ones, what the search found: of several goals the whole front."""
    kind = LinkRule if name == "grouping" else find(name).config_class
    files = sorted(folder.glob(f"{name}.front-*.toml"), key=lambda path: (len(path.name), path))
    files = files or [folder / f"{name}.toml"]
    found = {path.stem.rpartition(".")[2] if len(files) > 1 else "tuned": kind.from_toml(path) for path in files}
    return {"first": kind.frozen(), "present": kind(), **found}


def compared(name: str, sequence: Sequence, mode: str, chosen: dict[str, Config]) -> None:
    """A table of the recording: values with intervals, and differences to the present defaults."""
    truth = sequence.truth
    assert truth is not None
    every = list(CATALOGUE)
    at = [every.index(key) for key in KEYS[name]]
    draws = {who: resampled_scorer(truth, answers(name, sequence, mode, c), None, "hull") for who, c in chosen.items()}

    def score(places: Ints) -> np.ndarray:
        values = {who: np.asarray(draw(places))[at] for who, draw in draws.items()}
        return np.concatenate([*values.values(), *(values[who] - values["present"] for who in values)])

    whole, low, high = moving_blocks(score, truth.length, truth.fps, DRAWS)
    size, count = len(at), len(chosen)
    print(f"{name} on {sequence.name}, {truth.length / truth.fps:.0f} s, {mode}; less the present defaults'")
    for k, who in enumerate(chosen):
        cells = []
        for j, key in enumerate(KEYS[name]):
            v, d = k * size + j, (count + k) * size + j
            less = "" if who == "present" else f" ({whole[d]:+.3f} [{low[d]:+.3f}, {high[d]:+.3f}])"
            cells.append(f"{key} {whole[v]:.3f}{less}")
        print(f"  {who:8} " + "   ".join(cells), flush=True)


def answers(name: str, sequence: Sequence, mode: str, config: Config) -> list[Tracks]:
    truth = sequence.truth
    assert truth is not None
    if isinstance(config, LinkRule):
        return derive(people_as_tracks(truth), truth.fps, truth.px_per_m, config)
    return list(track(name, sequence, params=config, detections=mode))


def overhead(given: argparse.Namespace) -> None:
    """CPU milliseconds of a trial of 16 episodes that cost nothing: asking, testing, storing."""
    made = search_plan(TuneOptions(tracker="blob", suite="crossing", trials=given.trials or 200, check=None))
    r = np.random.default_rng(0)

    def play(sources: list[Source], values: dict[str, Any], every: bool) -> Iterator[Episode]:
        for s in sources:
            value = 0.5 + 0.04 * (s.seed % 10) - 0.1 * r.random()
            yield Episode(s.name, s.seed, value, {"objective": value}, 1, 1.0, 0.0)

    for kind in ("memory", "journal"):
        with tempfile.TemporaryDirectory() as folder:
            begun = time.process_time()
            with open_study(made, None if kind == "memory" else Path(folder) / "journal", "x") as study:
                run_trials(study, play, lambda done, total, what: None)
            print(f"{kind}: {1000 * (time.process_time() - begun) / made.options.trials:.1f} ms")


def workers(given: argparse.Namespace) -> None:
    """Seconds of one search by one process and by two, taken in turns; the same is found."""
    best: dict[int, float] = {}
    for _ in range(2):
        for count in (1, 2):
            with tempfile.TemporaryDirectory() as folder:
                out, begun = Path(folder) / "blob.toml", time.perf_counter()
                tune(
                    "blob", "crossing", given.trials or 20, seeds=range(4), validation=range(10_000, 10_004),
                    test=range(20_000, 20_004), check=None, workers=count, out=out,
                )  # fmt: skip
                best[count] = min(best.get(count, np.inf), time.perf_counter() - begun)
                print(f"{count} workers: {best[count]:.1f} s, {hash(out.read_bytes())}", flush=True)
    print(f"two are {best[1] / best[2]:.2f} times as fast as one")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    parser.add_argument("mode", choices=["search", "real", "workers", "overhead"])
    parser.add_argument("names", nargs="*", choices=[*SEARCHES, []])
    parser.add_argument("--out", type=Path, default=Path("tuned"))
    parser.add_argument("--trials", type=int)
    parser.add_argument("--validation", type=int, help="seeds of each scene")
    parser.add_argument("--suite", type=Path, help="search: another one than the tracker's own")
    parser.add_argument("--objective", action="append", help="search: another goal than the tracker's own, or several")
    parser.add_argument("--only", action="append", default=[], help="search: this parameter and others so named, alone")
    parser.add_argument("--finalists", type=int, default=5, help="search: how many are judged on validation scenes")
    parser.add_argument("--sensor", type=Path)
    parser.add_argument("--half", action="store_true", help="--sensor in every second scene only")
    parser.add_argument("--workers", type=int, default=1, help="search: processes, which change nothing that is found")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FLOCKSCOPE_DATA", beside)))
    given = parser.parse_args()
    if given.half and given.sensor is None:
        parser.error("--half needs --sensor")
    {"search": search, "real": real, "workers": workers, "overhead": overhead}[given.mode](given)


if __name__ == "__main__":
    main()
