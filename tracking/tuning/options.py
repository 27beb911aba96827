"""The options of a search: `tracking.tune`, the command `tune` and their checks are derived from these fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tracking.keyword_options import check_ranges, option

if TYPE_CHECKING:
    from sim.types import DetectionMode, Tracker
    from tracking.scoring.people import Similarity

Scenes = str | Path | Sequence[str | Path]  # A suite, a scenario, a TOML file, or a list of these.
# progress(finished, trials, text): called with the number of finished trials, the number planned (None if unknown), and
# what is done now.
Progress = Callable[[int, int | None, str], None]


@dataclass(frozen=True, kw_only=True)
class TuneOptions:
    """The options of a search (`tracking.tune`); the metadata of each field hold its help text and range."""

    # fmt: off
    tracker: str | type[Tracker] = option(
        "Tracker to tune: a name, file.py:Class, module:Class; or `grouping`.", metavar="TRACKER")
    suite: Scenes = option("Suite, scenario or *.toml file to tune on; several may be given.", metavar="NAME")
    trials: int = option("Number of trials to finish, the defaults included.", 100, low=1, metavar="N")
    seeds: range | None = option(
        "Training seeds of each scene, out of 0:10000; for 16 episodes if absent.", None, metavar="A:B")
    validation: range | None = option(
        "Validation seeds, out of 10000:20000; for 48 episodes if absent.", None, metavar="A:B")
    test: range | None = option("Test seeds, out of 20000:30000; for 100 episodes if absent.", None, metavar="A:B")
    check: str | None = option(
        "Second suite to test on; friends-meet or crossing if absent; none (in Python None): no second suite.",
        "", metavar="SUITE")
    objective: str | Iterable[str] = option(
        "Score to improve, or frames/s; several give a Pareto front.", (), metavar="KEY")
    detections: DetectionMode | None = option("Input of the tracker; file if absent and the tracker can use it.", None)
    similarity: Similarity | None = option("How true and tracked people are compared; by the data if absent.", None)
    set: Iterable[str] = option(
        "Fixed values: gate=0.99 of the tracker, scenario.… and sensor.… of scenes.", (), metavar="K=V")
    only: Iterable[str] = option("Parameters to search; all tunable ones if absent.", (), metavar="A,B,…")
    adaptive: int | None = option(
        "Fit a policy, too, which changes parameters by what the tracker sees, from so many configs.", None, low=6,
        metavar="N")
    out: str | Path | None = option(
        "File for the parameters; figures, plots and study lie beside it.", None, metavar="FILE.toml")
    storage: str | Path | None = option(
        "Journal file or Optuna URL of the study; beside --out if absent.", None, metavar="FILE|URL")
    study: str | None = option("Name of the study in its storage; that of --out if absent.", None, metavar="NAME")
    workers: int = option("Processes that play episodes; results do not depend on it.", 1)
    cluster: str | None = option(
        "Scheduler of a dask cluster that plays the episodes.", None, metavar="tcp://HOST:PORT")
    step_timeout: float | None = option(
        "Seconds that a reset or step may take; a longer one makes the trial impossible.", None, metavar="SECONDS")
    finalists: int = option("Number of best trials that validation chooses from.", 5, low=1, metavar="N")
    seed: int = option("Seed of the search.", 0, low=0)
    fresh: bool = option("Ignore and remove what an earlier search stored under this name.", False)
    progress: Progress | None = option("Function that is called as progress(finished, trials, text).", None)
    # fmt: on

    def __post_init__(self) -> None:
        check_ranges(self)
