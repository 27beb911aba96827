"""The house rules, read off the source: who may import whom, how long a module may be, which names are forbidden."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from benchmarks import rooms
from tests.processes import ROOT

PACKAGES = ("scenarios", "sim", "tracking")
LINES = 500
SPANNING = 50  # most test files that are not named after a module
# What scoring may import of ours: people use it alone, on their own arrays.
SCORING = (
    "scenarios.limits", "tracking.scoring", "tracking.grouping.grouped_tracks", "tracking.grouping.foot_points",
    "scenarios.errors", "sim.arrays", "sim.hashing", "sim.types", "sim.place", "sim.truth.group_hulls",
    "sim.truth.crossing_events", "sim.truth.queue_detection", "sim.geometry.boxes", "sim.geometry.polygons",
    "sim.scene.camera", "sim.scene.standing", "sim.scene.terrain",
)  # fmt: skip


NUMBA = "sim.compiler"
TRUTH = ("Truth", "FrameTruth", "truth", "load_truth")


@cache
def modules() -> dict[str, Path]:
    found = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in found]
    return dict(zip(names, found, strict=True))


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
def nodes(name: str) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(ast.parse(modules()[name].read_text(encoding="utf-8"))))


@cache
def imports(name: str) -> frozenset[str]:
    """All dotted names that a module imports anywhere, those for the type checker included."""
    return frozenset(dotted for node in nodes(name) for dotted in imported(node))


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
        "tracking.scoring", "tracking.running.detection_mode", "tracking.running.truth_detections", "tracking.app",
        "sim.truth.label", "sim.truth.merge_split_events", "sim.truth.group_hulls", "sim.truth.crossing_events",
        "sim.truth.queue_detection", "sim.store", "sim.sequence", "tracking.recordings", "tracking.export",
    )  # fmt: skip
    assert offences(names, *hidden) == []
    assert offences(names, *(f"sim.types.{word}" for word in TRUTH)) == []
    for name in names:
        read = {node.attr for node in nodes(name) if isinstance(node, ast.Attribute)}
        assert read.isdisjoint(TRUTH), f"{name} reads {read & set(TRUTH)}"


def test_papers_do_not_lean_on_each_other():
    """One package a paper; nothing goes from one to another."""
    papers = sorted({name.split(".")[2] for name in of("tracking.papers") if name != "tracking.papers"})
    assert {"blob", "group_pda", "stereo"} <= set(papers)
    for paper in papers:
        others = [f"tracking.papers.{other}" for other in papers if other != paper]
        assert offences(of(f"tracking.papers.{paper}"), *others) == []


def test_scoring_imports_little():
    ours = offences(of("tracking.scoring"), *PACKAGES)
    assert [line for line in ours if not inside(line.split()[-1], *SCORING)] == []


@pytest.mark.parametrize(("package", "only"), [("pymunk", "sim.crowd.world"), ("numba", NUMBA)])
def test_a_package_is_met_in_its_modules_only(package: str, only: str) -> None:
    """numba's own njit ends with an error where its cache has no place."""
    assert [name for name in modules() if any(inside(dotted, package) for dotted in imports(name))] == only.split()


def test_modules_are_short():
    lengths = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in modules().items()}
    assert {name: length for name, length in lengths.items() if length > LINES} == {}


def test_tests_mirror_the_sources() -> None:
    """tests/PATH/test_MODULE.py, or test_MODULE_ASPECT.py, tests PATH/MODULE.py. Other files span modules of a room."""
    files = [path.relative_to(ROOT / "tests") for path in (ROOT / "tests").rglob("test_*.py")]
    assert {path.parent for path in files if not (ROOT / path.parent).is_dir()} == set()
    sources = tuple(f"{name.replace('.', '/').removesuffix('_kernels')}_" for name in modules())
    sources += tuple(f"{path.relative_to(ROOT).with_suffix('')}_" for path in (ROOT / "benchmarks").rglob("*.py"))
    assert sum(not f"{path.parent / path.stem[5:]}_".startswith(sources) for path in files) <= SPANNING


def test_no_room_has_more_lines_than_its_budget():
    """Who adds lines takes some away; `python -m benchmarks rooms --write` lowers the budgets."""
    allowed = rooms.budget()
    assert {room: lines for room, lines in rooms.weights().items() if lines > allowed.get(room, 0)} == {}


def test_lines_of_code():
    text = '"""Doc\n\nmore."""\nimport os\n\n# why\nx = 1\n\n\ndef f():\n    """Doc."""\n    return """a\nb"""\n'
    assert rooms.lines_of_code(text) == 4


def dotted_name(node: ast.AST) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted_name(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def test_no_global_state_of_chance_and_time():
    """Randomness comes as a Generator (sim.rng), time from frames."""
    for name in modules():
        assert not any(inside(dotted, "random") for dotted in imports(name)), f"{name} imports random"
        read = {dotted_name(node) for node in nodes(name) if isinstance(node, ast.Attribute)}
        clocks = {"time.time", "datetime.now", "datetime.datetime.now"}
        assert inside(name, "tracking.app") or read.isdisjoint(clocks), name


# What decides motion, truth and detections: the same bits on every processor.
DECIDING = (
    "sim.crowd", "sim.truth", "sim.scene", "sim.detector", "sim.geometry", "sim.rng", "sim.clock", "sim.elementary",
)  # fmt: skip

# Functions of numpy, BLAS and the C library whose code is chosen by processor; `sim.elementary` has their equals.
BY_PROCESSOR = {
    "np": {
        *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "sinh", "cosh", "tanh"),
        *("arcsin", "arccos", "arctan", "arctan2", "arcsinh", "arccosh", "arctanh", "hypot", "power", "float_power"),
        *("cbrt", "logaddexp", "linalg", "dot", "vdot", "inner", "matmul", "tensordot", "einsum", "convolve"),
        *("correlate", "cov", "corrcoef", "polyfit", "interp", "argpartition", "unwrap", "angle", "deg2rad", "rad2deg"),
    },
    "math": {
        *("exp", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
        *("sinh", "cosh", "tanh", "hypot", "dist", "pow", "cbrt", "erf", "erfc", "gamma", "lgamma", "sumprod", "fma"),
    },
}

# Methods of numpy's generators that call the C library or may be contracted; `sim.rng` has their equals.
DRAWS = {
    "normal", "standard_normal", "exponential", "poisson", "gamma", "beta", "lognormal", "uniform", "choice",
    "binomial",
}  # fmt: skip

# Of scipy only what adds and compares, or proposes.
WITHOUT_ARITHMETIC = {
    "scipy.ndimage.label", "scipy.optimize.linear_sum_assignment", "scipy.sparse.coo_array",
    "scipy.sparse.csgraph.connected_components", "scipy.sparse.csgraph.dijkstra", "scipy.spatial.cKDTree",
}  # fmt: skip


def by_processor(node: ast.AST) -> str | None:
    """What in an expression depends on the processor; None if nothing does."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
        return "@"
    if (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, ast.Pow)
        and not isinstance(node.left, (ast.Constant, ast.UnaryOp))
    ):
        return "**"
    if isinstance(node, ast.Attribute) and node.attr in BY_PROCESSOR.get(getattr(node.value, "id", ""), ()):
        return ast.unparse(node)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if node.func.attr in DRAWS:
            return f".{node.func.attr}(...)"
        if node.func.attr == "argsort" and not any(k.arg == "kind" for k in node.keywords):
            return "an unstable argsort"
    if isinstance(node, ast.ImportFrom) and node.module:
        names = {f"{node.module}.{alias.name}" for alias in node.names}
        if node.module == "math" and not BY_PROCESSOR["math"].isdisjoint(alias.name for alias in node.names):
            return f"from math import {', '.join(alias.name for alias in node.names)}"
        if node.module.split(".")[0] in ("scipy", "cv2") and not names <= WITHOUT_ARITHMETIC:
            return ", ".join(names)
    return None


def test_nothing_that_decides_the_truth_depends_on_the_processor() -> None:
    for name in of(*DECIDING):
        found = [f"{name}:{node.lineno}: {what}" for node in nodes(name) if (what := by_processor(node))]
        kernels = name.endswith("_kernels")  # numba's argsort is code of its own, the same everywhere
        assert [f for f in found if not (kernels and "argsort" in f)] == []
