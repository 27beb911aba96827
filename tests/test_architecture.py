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
    "scenarios.limits",
    "tracking.scoring",
    "tracking.grouping.grouped_tracks",
    "tracking.grouping.foot_points",
    "scenarios.errors",
    "sim.arrays",
    "sim.types",
    "sim.truth.group_hulls",
    "sim.truth.crossing_events",
    "sim.truth.queue_detection",
    "sim.geometry.polygons",
    "sim.scene.camera",
    "sim.scene.terrain",
)
"""What scoring may import of ours: people use it alone, on their own arrays."""

LIGHT = ("cv2", "pymunk", "numba", "pyarrow", "pydantic", "filterpy", "av", "gymnasium")
"""What scoring, and all of ours that it imports, may not."""

TRUTH = ("Truth", "FrameTruth", "truth", "load_truth")
LEGACY = (
    "seed",
    "rand",
    "randn",
    "random",
    "normal",
    "uniform",
    "choice",
    "shuffle",
    "permutation",
    "poisson",
    "randint",
)


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


def test_there_is_a_house():
    assert len(of("scenarios")) > 10
    assert len(of("sim")) > 30
    assert len(of("tracking")) > 20
    assert "sim.types" in imports("tracking.running.run")


def test_imports_go_one_way():
    assert offences(of("scenarios"), "sim", "tracking") == []
    assert offences(of("sim"), "tracking") == []


def test_nothing_of_ours_is_imported_that_is_not_there():
    """A module that was renamed or taken away leaves no import behind."""
    missing = []
    for name in modules():
        for node in ast.walk(tree(name)):
            for dotted in imported(node, names=False):
                if inside(dotted, *PACKAGES) and dotted not in modules():
                    missing.append(f"{name} imports {dotted}")
    assert missing == []


def test_trackers_and_detectors_see_neither_truth_nor_scores():
    names = of("tracking.papers", "tracking.detect")
    assert names
    hidden = (
        "tracking.scoring",
        "tracking.running.detection_mode",
        "tracking.app",
        "sim.truth.label",
        "sim.truth.merge_split_events",
        "sim.truth.group_hulls",
        "sim.truth.crossing_events",
        "sim.truth.queue_detection",
        "sim.io",
        "sim.sequence",
    )
    assert offences(names, *hidden) == []
    assert offences(names, *(f"sim.types.{word}" for word in TRUTH)) == []
    for name in names:
        read = {node.attr for node in ast.walk(tree(name)) if isinstance(node, ast.Attribute)}
        assert read.isdisjoint(TRUTH), f"{name} reads {read & set(TRUTH)}"


def test_one_function_makes_paths_of_names():
    """Names of sequences are labels; `sim.io.files.output_paths` alone turns one into a part of a path."""
    paths_of_paths = {"sim.io.files.atomic", "sim.io.store.validate"}  # target.name, split.name: of a Path
    found = [
        f"{name}, line {node.lineno}: {ast.unparse(node)}"
        for name in modules().keys() - paths_of_paths
        for node in ast.walk(tree(name))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div)
        for inner in ast.walk(node.right)
        if isinstance(inner, ast.Attribute) and inner.attr == "name"
    ]
    assert found == []


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


def test_what_scoring_loads_is_light():
    """All of ours that an import of scoring loads: none of it imports cv2, pymunk, numba and the like at its top."""

    def loaded(name: str) -> list[str]:
        return [dotted for node in tree(name).body for dotted in imported(node)]

    reached, waiting = set(), of("tracking.scoring")
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += [dotted for dotted in loaded(name) if dotted in modules()]
    assert {"sim.types", "tracking.grouping.belief"} <= reached
    assert [
        f"{name} loads {dotted}" for name in sorted(reached) for dotted in loaded(name) if inside(dotted, *LIGHT)
    ] == []


def run_time_imports(name: str) -> set[str]:
    """Our modules that a module imports at any time when it runs: at its top or inside a function, type-only excepted.

    `from package import module` counts as an import of the module.
    """

    def statements(node: ast.AST) -> Iterator[ast.AST]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and dotted_name(child.test).endswith("TYPE_CHECKING"):
                continue
            yield child
            yield from statements(child)

    found = set()
    for node in statements(tree(name)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            dotted = {f"{node.module}.{alias.name}": str(node.module) for alias in node.names}
            found |= {full if full in modules() else module for full, module in dotted.items()}
    return {dotted for dotted in found if dotted in modules() and dotted != name}


def circles(graph: dict[str, set[str]]) -> list[tuple[str, ...]]:
    """The sets of modules that reach each other along imports, sorted (strongly connected components, naively)."""

    def reached(start: str) -> set[str]:
        seen, waiting = set(), [start]
        while waiting:
            for name in graph[waiting.pop()] - seen:
                seen.add(name)
                waiting.append(name)
        return seen

    reach = {name: reached(name) for name in graph}
    return sorted({tuple(sorted(b for b in reach[a] if a in reach[b])) for a in graph if a in reach[a]})


def test_circles_are_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set()}
    assert circles(graph) == [("b", "c")]


def test_no_import_circles():
    """Imports inside functions count; imports for the type checker alone do not."""
    found = circles({name: run_time_imports(name) for name in modules()})
    assert found == []


def test_workers_and_sequences_stand_below_files():
    assert offences(of("sim.workers"), "tracking", "sim.io", "sim.dataset") == []
    assert offences(["sim.sequence"], "sim.io") == []
    for name in of("sim.workers"):
        text = modules()[name].read_text(encoding="utf-8")
        assert "tracking" not in text, f"{name} names a package above it"


def test_nothing_imports_the_commands():
    others = [name for name in modules() if not inside(name, "tracking.app")]
    assert offences(others, "tracking.app") == []


def test_pymunk_is_met_in_one_module():
    assert [name for name in modules() if any(inside(dotted, "pymunk") for dotted in imports(name))] == [
        "sim.crowd.world"
    ]


@pytest.mark.parametrize("name", modules())
def test_modules_are_short(name):
    assert len(modules()[name].read_text(encoding="utf-8").splitlines()) <= LINES


@pytest.mark.parametrize("name", modules())
def test_modules_say_what_they_are(name):
    assert ast.get_docstring(tree(name)), "a first line that tells a newcomer whether to open it"
    assert name.rpartition(".")[2] not in ("utils", "helpers", "common", "base")


def dotted_name(node: ast.AST) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted_name(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.parametrize("name", modules())
def test_no_global_state_of_chance_and_time(name):
    """Randomness comes as a Generator (sim.rng), time from frames."""
    assert not any(inside(dotted, "random") for dotted in imports(name)), "the random module"
    read = {dotted_name(node) for node in ast.walk(tree(name)) if isinstance(node, ast.Attribute)}
    assert read.isdisjoint({f"np.random.{word}" for word in LEGACY})
    if not inside(name, "tracking.app"):
        assert read.isdisjoint({"time.time", "datetime.now", "datetime.datetime.now"})


@pytest.mark.parametrize("name", modules())
def test_classes_share_no_mutable_state(name):
    """No list, dict or set as a class attribute: ids and counters would live on between sequences."""
    for node in ast.walk(tree(name)):
        if isinstance(node, ast.ClassDef):
            values = [s.value for s in node.body if isinstance(s, ast.Assign | ast.AnnAssign) and s.value is not None]
            assert not any(isinstance(v, ast.List | ast.Dict | ast.Set) for v in values), node.name


MOST_ARGUMENTS = 8


def arguments(function: ast.FunctionDef) -> int:
    given = function.args
    names = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


@pytest.mark.parametrize("name", [name for name in modules() if not name.endswith("_kernels")])
def test_functions_take_few_arguments(name):
    """Kernels excepted: numba takes arrays one by one."""
    functions = [node for node in ast.walk(tree(name)) if isinstance(node, ast.FunctionDef)]
    assert [f.name for f in functions if arguments(f) > MOST_ARGUMENTS] == []


def test_public_class_names_are_unique():
    homes: dict[str, list[str]] = {}
    for name in modules():
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(name)
    assert {name: found for name, found in homes.items() if len(found) > 1} == {}


DECIDING = (
    "sim.crowd",
    "sim.truth",
    "sim.scene",
    "sim.detector",
    "sim.geometry",
    "sim.rng",
    "sim.clock",
    "sim.elementary",
)
"""What decides motion, truth and detections: the same bits on every processor."""

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
"""Functions of numpy, BLAS and the C library whose code is chosen by processor; `sim.elementary` has their equals."""

DRAWS = {
    "normal",
    "standard_normal",
    "exponential",
    "poisson",
    "gamma",
    "beta",
    "lognormal",
    "uniform",
    "choice",
    "binomial",
}
"""Methods of numpy's generators that call the C library or may be contracted; `sim.rng` has their equals."""

WITHOUT_ARITHMETIC = {"scipy.optimize.linear_sum_assignment", "scipy.sparse.csgraph.connected_components"}
"""Of scipy only what adds and compares."""


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
        if node.module.split(".")[0] in ("scipy", "cv2") and not names <= WITHOUT_ARITHMETIC | {
            "scipy.sparse.coo_array"
        }:
            return ", ".join(names)
    return None


@pytest.mark.parametrize("name", [name for name in modules() if inside(name, *DECIDING)])
def test_nothing_that_decides_the_truth_depends_on_the_processor(name: str) -> None:
    found = [f"{name}:{node.lineno}: {what}" for node in ast.walk(tree(name)) if (what := by_processor(node))]
    kernels = name.endswith("_kernels")  # numba's argsort is code of its own, the same everywhere
    assert [f for f in found if not (kernels and "argsort" in f)] == []


@pytest.mark.parametrize(
    "code", ["a @ b", "x**0.5", "np.exp(x)", "np.linalg.norm(x)", "math.sin(x)", "r.normal()", "np.argsort(x)",
             "from math import exp", "from scipy.special import ndtr"],
)  # fmt: skip
def test_such_code_is_found(code: str) -> None:
    assert any(by_processor(node) for node in ast.walk(ast.parse(code)))


@pytest.mark.parametrize("name", modules())
def test_digits_of_texts_are_0_to_9(name: str) -> None:
    r"""`\d` in a pattern and `str.isdigit` also take the digits of other scripts."""
    words = [node.value for node in ast.walk(tree(name)) if isinstance(node, ast.Constant)]
    methods = {node.attr for node in ast.walk(tree(name)) if isinstance(node, ast.Attribute)}
    assert [word for word in words if isinstance(word, str) and "\\d" in word] == []
    assert methods.isdisjoint({"isdigit", "isnumeric", "isdecimal"})
