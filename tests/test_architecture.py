"""The house rules, read off the source: who may import whom, how long a module may be, which names are forbidden."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("scenarios", "sim", "tracking")
LINES = 500
SCORING = (
    "scenarios.limits", "tracking.scoring", "tracking.grouping.grouped_tracks", "tracking.grouping.foot_points",
    "scenarios.errors", "sim.arrays", "sim.types", "sim.truth.group_hulls", "sim.truth.crossing_events",
    "sim.truth.queue_detection", "sim.geometry.polygons", "sim.scene.camera", "sim.scene.terrain",
)  # fmt: skip
"""What scoring may import of ours: people use it alone, on their own arrays."""


TRUTH = ("Truth", "FrameTruth", "truth", "load_truth")


@cache
def modules() -> dict[str, Path]:
    found = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in found]
    return dict(zip(names, found, strict=True))


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(modules()[name].read_text(encoding="utf-8"))


def imported(node: ast.AST, names: bool = True) -> Iterator[str]:
    """Dotted names that an import statement brings: `from a import b` is both a and a.b."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports are absolute"
        assert node.module is not None
        yield node.module
        if names:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@cache
def imports(name: str) -> frozenset[str]:
    """All dotted names that a module imports anywhere, those for the type checker included."""
    return frozenset(dotted for node in ast.walk(tree(name)) for dotted in imported(node))


def inside(dotted: str, *packages: str) -> bool:
    return any(dotted == package or dotted.startswith(package + ".") for package in packages)


def of(*packages: str) -> list[str]:
    return [name for name in modules() if inside(name, *packages)]


def offences(names: list[str], *forbidden: str) -> list[str]:
    return [
        f"{name} imports {dotted}" for name in names for dotted in sorted(imports(name)) if inside(dotted, *forbidden)
    ]


def test_imports_go_one_way():
    assert offences(of("scenarios"), "sim", "tracking") == []
    assert offences(of("sim"), "tracking") == []


def test_trackers_and_detectors_see_neither_truth_nor_scores():
    names = of("tracking.papers", "tracking.detect")
    assert names
    hidden = (
        "tracking.scoring", "tracking.running.detection_mode", "tracking.app", "sim.truth.label",
        "sim.truth.merge_split_events", "sim.truth.group_hulls", "sim.truth.crossing_events",
        "sim.truth.queue_detection", "sim.io", "sim.sequence",
    )  # fmt: skip
    assert offences(names, *hidden) == []
    assert offences(names, *(f"sim.types.{word}" for word in TRUTH)) == []
    for name in names:
        read = {node.attr for node in ast.walk(tree(name)) if isinstance(node, ast.Attribute)}
        assert read.isdisjoint(TRUTH), f"{name} reads {read & set(TRUTH)}"


def test_papers_do_not_lean_on_each_other():
    """One package a paper; nothing goes from one to another."""
    papers = sorted({name.split(".")[2] for name in of("tracking.papers") if name != "tracking.papers"})
    assert {"blob", "group_pda", "stereo"} <= set(papers)
    for paper in papers:
        others = [f"tracking.papers.{other}" for other in papers if other != paper]
        assert offences(of(f"tracking.papers.{paper}"), *others) == []


def test_scoring_imports_little():
    names = of("tracking.scoring")
    ours = [
        f"{n} imports {d}"
        for n in names
        for d in sorted(imports(n))
        if inside(d, *PACKAGES) and not inside(d, *SCORING)
    ]
    assert ours == []


@pytest.mark.parametrize(("package", "only"), [("pymunk", "sim.crowd.world"), ("numba", "sim.compiler")])
def test_a_package_is_met_in_one_module(package: str, only: str) -> None:
    """numba's own njit ends with an error where its cache has no place."""
    assert [name for name in modules() if any(inside(dotted, package) for dotted in imports(name))] == [only]


def test_modules_are_short():
    lengths = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in modules().items()}
    assert {name: length for name, length in lengths.items() if length > LINES} == {}
