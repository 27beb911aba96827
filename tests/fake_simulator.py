"""A fake simulator for tests of datasets: random sequences in the place of simulated ones, made at once."""

from __future__ import annotations

import types
from pathlib import Path
from typing import Any

from scenarios.schema.scenario import Scenario
from tests.made_up import make_pictured, make_sequence

__all__ = ["FakeSimulator", "content", "make_pictured", "make_sequence", "scenario"]


class FakeSimulator(types.ModuleType):
    """Stands in for the module sim.sequence. asked: (seed, streams) of each call. wrong: what is raised for a seed."""

    def __init__(self) -> None:
        super().__init__("sim.sequence")
        self.asked: list[tuple[int, tuple[str, ...]]] = []
        self.wrong: dict[int, BaseException] = {}

    @property
    def made(self) -> list[int]:
        return [seed for seed, _ in self.asked]

    def simulate(
        self, scenario: Scenario, seed: int, repeat: int, streams: tuple[str, ...] = (), stride: int = 1
    ) -> Any:
        self.asked.append((seed, streams))
        if seed in self.wrong:
            raise self.wrong[seed]
        return make_pictured(seed + 100 * repeat, streams) if streams else make_sequence(seed + 100 * repeat)


def scenario(**more: Any) -> Scenario:
    """The smallest scenario: one person who walks."""
    return Scenario.model_validate({"schema": 1, "group": [{"id": "a", "start": [1, 1], "goal": [2, 2]}], **more})


def content(folder: Path) -> dict[str, bytes]:
    """Every file below the folder, by name."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
