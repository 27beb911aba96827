"""Mutants: small changes of the mathematics and the decisions, one at a time, which the fast tests must see.

    python -m benchmarks mutants [--count 300] [--seed 1] [--only tracking.filters …] [--jobs 2] [--seconds 90]

Draws --count mutants of all that the operators of cosmic-ray make of the modules in ROOMS: comparisons, arithmetic,
numbers, `and` and `or`, `not`, loops that end at once. Each is written into a copy of the tree, where the fast tests
run that import its module, those of the module's own name first, until one fails or --seconds of CPU time have passed
for the tests. A mutant that no test sees survives. SURVIVORS names the known ones with the reason why none has to.
Kernels are compiled again for a mutant of a kernel. Needs the extra `mutants`.

Prints a table of rooms (drawn, killed) and one of the survivors that are not named; exit code 1 below a share of MUST.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import Queue

import numpy as np

from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row

ROOT = Path(__file__).resolve().parents[1]
SURVIVORS = ROOT / "benchmarks" / "survivors.toml"
MUST = 0.85  # of the mutants die
ROOMS = (
    "sim.crowd", "sim.truth", "sim.detector", "sim.scene", "sim.geometry", "sim.workers", "tracking.filters",
    "tracking.detect", "tracking.grouping", "tracking.papers", "tracking.running", "tracking.scoring",
    "tracking.errors", "tracking.stress", "tracking.tuning", "tracking.episodes", "tracking.stats", "tracking.ranking",
    "tracking.recording_ranking", "tracking.oracle",
)  # fmt: skip
# `|` stands in annotations for the most part, and `**` in calls.
KINDS = (
    "ReplaceComparisonOperator", "ReplaceBinaryOperator", "ReplaceUnaryOperator", "ReplaceAndWithOr",
    "ReplaceOrWithAnd", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "AddNot", "NumberReplacer",
    "ZeroIterationForLoop",
)  # fmt: skip
LEFT_OUT = ("BitOr", "BitAnd", "BitXor", "Shift", "Pow", "Invert")
MEMORY = 6 * 2**30  # bytes of a process of tests
PYTEST = ("-q", "-x", "-m", "not slow", "-p", "no:randomly", "--no-header", "-n", "0", "--disable-warnings")


@dataclass(frozen=True)
class Mutant:
    """One change of a module: where it is, and both versions of its line."""

    module: str
    before: str
    after: str
    text: str  # the whole module, changed

    @property
    def change(self) -> str:
        """The change as it stands in a table and in SURVIVORS."""
        return f"{self.before.strip()} → {self.after.strip()}"


def files() -> dict[str, Path]:
    """Returns the paths, relative to the root, of all modules and tests by dotted name."""
    found = [p for package in ("scenarios", "sim", "tracking", "tests") for p in sorted((ROOT / package).rglob("*.py"))]
    return {".".join(p.relative_to(ROOT).with_suffix("").parts): p.relative_to(ROOT) for p in found}


@cache
def imported(path: Path) -> frozenset[str]:
    """Returns the dotted names that a file imports."""
    names = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return frozenset(names)


def tests_of(module: str, every: dict[str, Path]) -> list[Path]:
    """Returns the test files that import a module, or a module that imports it: its mirror first, the nearest next."""
    tests = {name: path for name, path in every.items() if path.parts[0] == "tests" and path.name.startswith("test_")}
    users = {name for name, path in every.items() if path.parts[0] != "tests" and module in imported(path)}
    stem = module.rpartition(".")[2].removesuffix("_kernels")

    def rank(path: Path) -> tuple[bool, bool, int, int]:
        common = sum(a == b for a, b in zip(path.parts[1:-1], module.split(".")[:-1], strict=False))
        return stem not in path.stem, module not in imported(path), -common, (ROOT / path).stat().st_size

    return sorted((p for p in tests.values() if imported(p) & {module, *users} or stem in p.stem), key=rank)


def mutants_of(module: str, path: Path) -> Iterator[tuple[str, int]]:
    """Yields operator and occurrence of each mutant of a module."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator, operator_names

    tree = get_ast((ROOT / path).read_text(encoding="utf-8"))
    for name in operator_names():
        kind = name.partition("/")[2]
        if kind.startswith(KINDS) and not any(word in kind for word in LEFT_OUT):
            operator = get_operator(name)()
            count = sum(len(list(operator.mutation_positions(node))) for node in ast_nodes(tree))
            yield from ((name, k) for k in range(count))


def made(module: str, path: Path, operator: str, occurrence: int) -> Mutant | None:
    """Returns a mutant; None if it is the same program, as where only an annotation has changed."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    text = (ROOT / path).read_text(encoding="utf-8")
    changed = mutate_code(text, get_operator(operator)(), occurrence)
    if changed is None or bare(changed) == bare(text):
        return None
    lines = [line for line in difflib.ndiff(text.splitlines(), changed.splitlines()) if line[0] in "-+"]
    return Mutant(module, lines[0][2:], lines[-1][2:], changed)


def bare(text: str) -> str:
    """Returns the tree of a program without annotations, as text."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = ast.Constant(None)
    return ast.dump(tree)


def drawn(count: int, seed: int, only: tuple[str, ...]) -> list[Mutant]:
    """Returns `count` mutants, drawn without replacement from all mutants of the rooms."""
    every = files()
    modules = [name for name in every if f"{name}.".startswith(tuple(f"{room}." for room in only))]
    whole = [(name, *mutant) for name in modules for mutant in mutants_of(name, every[name])]
    found = list[Mutant]()
    for k in np.random.default_rng(seed).permutation(len(whole)):
        name, operator, occurrence = whole[k]
        mutant = made(name, every[name], operator, occurrence)
        found += [] if mutant is None else [mutant]
        if len(found) == count:
            break
    return found


def killed(mutant: Mutant, tree: Path, seconds: float) -> bool:
    """Returns True if a test fails in a copy of the tree that has the mutant, and passes in one that has not."""
    every = files()
    path = tree / every[mutant.module]
    kept = path.read_text(encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    if mutant.module.endswith("_kernels"):  # callers have compiled it into their own code
        environment["NUMBA_CACHE_DIR"] = str(tree / ".kernels-of-mutant")

    def limits() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))

    def played(tests: list[str]) -> tuple[int, list[str]]:
        line = [sys.executable, "-m", "pytest", *PYTEST, *tests]
        run = subprocess.run(
            line, cwd=tree, env=environment, capture_output=True, text=True, preexec_fn=limits, check=False
        )
        return run.returncode, re.findall(r"^(?:FAILED|ERROR) (\S+)", run.stdout, re.MULTILINE)

    tests = [str(p) for p in tests_of(mutant.module, every)]
    try:
        path.write_text(mutant.text, encoding="utf-8")
        code, failed = played(tests)
    finally:
        path.write_text(kept, encoding="utf-8")
    shutil.rmtree(tree / ".kernels-of-mutant", ignore_errors=True)
    if code in (0, 5):  # all passed, no test
        return False
    # Ended by its limit of time: a loop without end, if the same tests end without the mutant.
    without = played(failed or tests)[0]
    if failed and without:
        raise SystemExit(f"{failed[0]} fails without a mutant")
    return without == 0


def copied(folder: Path) -> Path:
    """Returns the root of a copy of the tracked files."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    return folder


def known() -> dict[str, dict[str, str]]:
    """Returns the reasons of SURVIVORS: by module, then by change."""
    return tomllib.loads(SURVIVORS.read_text(encoding="utf-8")) if SURVIVORS.is_file() else {}


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--count", type=int, default=300, help="mutants")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--only", nargs="+", default=ROOMS, help="dotted names of rooms or modules")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--seconds", type=float, default=90.0, help="CPU time of the tests of a mutant")
    given: argparse.Namespace = parser.parse_args()
    mutants = drawn(given.count, given.seed, tuple(given.only))
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(given.jobs) as pool:
        trees = Queue[Path]()
        for k in range(given.jobs):
            trees.put(copied(Path(folder, str(k))))

        def play(mutant: Mutant) -> bool:
            tree = trees.get()
            try:
                found = killed(mutant, tree, given.seconds)
            finally:
                trees.put(tree)
            print(f"{'killed' if found else 'SURVIVED'}: {mutant.module}: {mutant.change}", file=sys.stderr, flush=True)
            return found

        verdicts = list(pool.map(play, mutants))
    report(mutants, verdicts)
    return int(sum(verdicts) < MUST * len(mutants))


def report(mutants: list[Mutant], verdicts: list[bool]) -> None:
    """Prints the tables."""
    rooms = [".".join(m.module.split(".")[:2]) for m in mutants]
    drawn_in, died = Counter(rooms), Counter(room for room, dead in zip(rooms, verdicts, strict=True) if dead)
    head(["room", "drawn", "killed", "share"])
    for room in sorted(drawn_in):
        row([room, str(drawn_in[room]), str(died[room]), f"{died[room] / drawn_in[room]:.2f}"])
    row(["all", str(len(mutants)), str(sum(verdicts)), f"{sum(verdicts) / max(len(mutants), 1):.2f}"])
    reasons = known()
    print("\nSurvivors")
    head(["module", "change", "reason"])
    for mutant, dead in zip(mutants, verdicts, strict=True):
        if not dead:
            reason = reasons.get(mutant.module, {}).get(mutant.change, "–")
            row([mutant.module, f"`{mutant.change.replace('|', '¦')}`", reason])


if __name__ == "__main__":
    sys.exit(main())
