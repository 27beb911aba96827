"""The options of a search: `tracking.tune`, the command `tune` and their checks are derived from these fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tracking.keyword_options import check_ranges, option

if TYPE_CHECKING:
    from sim.types import DetectionMode, Tracker
    from tracking.scoring.people_comparison import Similarity

Scenes = str | Path | Sequence[str | Path]  # A suite, a scenario, a TOML file, or a list of these.
# progress(finished, trials, text): called with the number of finished trials, the number planned (None if unknown), and
# what is done now.
Progress = Callable[[int, int | None, str], None]


@dataclass(frozen=True, kw_only=True)
class TuneOptions:
    """The options of a search; the metadata of each field hold its help text and range."""

    tracker: str | type[Tracker] = field(
        metadata=option("Tracker to tune: a name, file.py:Class, module:Class; or `grouping`.", metavar="TRACKER")
    )
    suite: Scenes = field(
        metadata=option("Suite, scenario or *.toml file to tune on; several may be given.", metavar="NAME")
    )
    trials: int = field(
        default=100, metadata=option("Number of trials to finish, the defaults included.", low=1, metavar="N")
    )
    seeds: range | None = field(
        default=None,
        metadata=option("Training seeds of each scene, out of 0:10000; for 16 episodes if absent.", metavar="A:B"),
    )
    validation: range | None = field(
        default=None,
        metadata=option("Validation seeds, out of 10000:20000; for 48 episodes if absent.", metavar="A:B"),
    )
    test: range | None = field(
        default=None, metadata=option("Test seeds, out of 20000:30000; for 100 episodes if absent.", metavar="A:B")
    )
    check: str | None = field(
        default="",
        metadata=option("Second suite to test on: friends-meet or crossing if absent, or none.", metavar="SUITE"),
    )
    objective: str | Iterable[str] = field(
        default=(), metadata=option("Score to improve, or frames/s; several give a Pareto front.", metavar="KEY")
    )
    detections: DetectionMode | None = field(
        default=None, metadata=option("Input of the tracker; file if absent and the tracker can use it.")
    )
    similarity: Similarity | None = field(
        default=None, metadata=option("How true and tracked people are compared; by the data if absent.")
    )
    set: Iterable[str] = field(
        default=(),
        metadata=option("Fixed values: gate=0.99 of the tracker, scenario.… and sensor.… of scenes.", metavar="K=V"),
    )
    only: Iterable[str] = field(
        default=(), metadata=option("Parameters to search; all tunable ones if absent.", metavar="A,B,…")
    )
    out: str | Path | None = field(
        default=None,
        metadata=option("File for the parameters; figures, plots and study lie beside it.", metavar="FILE.toml"),
    )
    storage: str | Path | None = field(
        default=None,
        metadata=option("Journal file or Optuna URL of the study; beside --out if absent.", metavar="FILE|URL"),
    )
    study: str | None = field(
        default=None, metadata=option("Name of the study in its storage; that of --out if absent.", metavar="NAME")
    )
    workers: int = field(default=1, metadata=option("Processes that play episodes; results do not depend on it."))
    cluster: str | None = field(
        default=None,
        metadata=option("Scheduler of a dask cluster that plays the episodes.", metavar="tcp://HOST:PORT"),
    )
    step_timeout: float | None = field(
        default=None,
        metadata=option(
            "Seconds that a reset or step may take; a longer one makes the trial impossible.", metavar="SECONDS"
        ),
    )
    prune: float = field(
        default=0.1,
        metadata=option("Stop a trial whose loss has a p-value below this; 0: never.", low=0, below=1, metavar="P"),
    )
    finalists: int = field(
        default=5, metadata=option("Number of best trials that validation chooses from.", low=1, metavar="N")
    )
    seed: int = field(default=0, metadata=option("Seed of the search.", low=0))
    progress: Progress | None = field(
        default=None, metadata=option("Function that is called as progress(finished, trials, text).")
    )

    def __post_init__(self) -> None:
        check_ranges(self)
