"""The benchmark of injected faults on two small scenes: each fault is listed, named, explained and repaired."""

from __future__ import annotations

from functools import cache

import pytest

from benchmarks.faults.__main__ import COLUMNS, measure
from benchmarks.faults.groups import FAULTS
from benchmarks.faults.scene import FaultScene, scene

FPS = 5.0
SCENE_OF = {
    "fragment in changing light": "lights",
    "late split": "split",
    "strangers joined": "crowd",
    "false group": "crowd",
}


@cache
def made(name: str) -> FaultScene:
    return scene(name, 20000, FPS)


@pytest.mark.parametrize(
    ("fault", "whole"),
    [*((fault, False) for fault in FAULTS), ("missed group", True), ("engulfed group", True)],
)
def test_a_fault(fault: str, whole: bool) -> None:
    found = measure([made(SCENE_OF.get(fault, "merge"))], fault, 2, 0, whole)
    assert found["cases"] > 0
    for column in COLUMNS:
        assert found[column] == found[f"of {column}"], (column, dict(found))
