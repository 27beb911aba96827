"""Two scenes with three people and a search on them that takes a second, for tests of tuning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.processes import TOY
from tracking.tuning.options import TuneOptions
from tracking.tuning.search_plan import SearchPlan, search_plan

SCENE = """
schema = 1
about = "three people, nothing happens"
duration = 4.0
warmup = 1.0
camera = { kind = "top", fps = 5 }
group = [
  { id = "a", size = 2, start = [4, 4], goal = [12, 4] },
  { id = "b", size = 1, start = [12, 7], goal = [4, %s] },
]
"""


def write_scenes(folder: Path) -> tuple[str, str]:
    """Write a scene to tune on and one to test on; return both paths."""
    for name, goal in (("one", "7"), ("two", "6")):
        (folder / f"{name}.toml").write_text(SCENE % goal)
    return str(folder / "one.toml"), str(folder / "two.toml")


def tune_arguments(folder: Path, **more: Any) -> dict[str, Any]:
    """Arguments of `tune` for a small search on scenes in `folder`."""
    one, two = write_scenes(folder)
    seeds = {"seeds": range(5), "validation": range(10_000, 10_006), "test": range(20_000, 20_006)}
    return {"tracker": TOY, "suite": one, "check": two, "trials": 12, "seed": 1, "objective": "HOTA", **seeds, **more}


def toy_plan(folder: Path, **more: Any) -> SearchPlan:
    """The plan of the same search."""
    return search_plan(TuneOptions(**tune_arguments(folder, **more)))
