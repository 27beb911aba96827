"""Mutants: small changes of the mathematics and the decisions, one at a time, which the fast tests must see.

    python -m benchmarks mutants [--count 300] [--seed 1] [--only tracking.filters …] [--jobs 2] [--seconds 30]

Draws --count mutants of all that the operators of cosmic-ray make of the modules in ROOMS: comparisons, arithmetic,
numbers, `and` and `or`, `not`, loops that end at once. Changes that cannot change a result are not drawn: annotations,
blocks of TYPE_CHECKING, and OPTIONS as `cache=True` and `strict=True`.

Each mutant is written into a copy of the tree. There the fast tests run whose file imports the module directly, or
through one or two other modules; those of the module's own name first, then those of its room. They run until one
fails or --seconds of CPU time have passed. A mutant that no test sees survives. A test that fails without the mutant,
too, does not count. The copy has the compiled kernels of the tree (`make test` compiles them); kernels that a mutant
changes are compiled again.

Verdicts are added to --out as they come: a run that was stopped goes on where it was, and --again plays the survivors
again. SURVIVORS names those that no test has to see, with the reason. Needs the extra `mutants`.

Prints a table of rooms (drawn, killed) and one of the survivors; exit code 1 below a share of MUST.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.support.forked_tests import first_failure
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
OPTIONS = ("cache", "frozen", "slots", "eq", "strict", "nogil", "kw_only", "deepcopy", "daemon")  # no result changes
FARTHEST = 3  # imports from a test to the module
BATCHES = (4, 12, 36)  # files of tests that one process collects, then the next one; then all others


@dataclass(frozen=True)
class Mutant:
    """One change of a module."""

    module: str
    change: str  # "line → changed line", as in tables and in SURVIVORS
    operator: str  # of cosmic-ray
    occurrence: int  # of what the operator changes in the module, from 0


def files() -> dict[str, Path]:
    """Returns the paths, relative to the root, of all modules and tests by dotted name."""
    found = [p for package in ("scenarios", "sim", "tracking", "tests") for p in sorted((ROOT / package).rglob("*.py"))]
    parts = {p: p.relative_to(ROOT).with_suffix("").parts for p in found}
    return {".".join(parts[p]).removesuffix(".__init__"): p.relative_to(ROOT) for p in found}


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


@cache
def tests_of(module: str) -> tuple[str, ...]:
    """Returns the test files that import a module through at most FARTHEST imports: its mirror first, then those of
    few imports and many common folders, of these the smallest."""
    every = files()
    distance, reached = {module: 0}, {module}
    for step in range(1, FARTHEST + 1):
        reached = {name for name, path in every.items() if name not in distance and imported(path) & reached}
        distance |= dict.fromkeys(reached, step)
    stem, own = module.rpartition(".")[2].removesuffix("_kernels"), module.split(".")[:-1]

    def rank(name: str) -> tuple[bool, int, int]:
        parts = every[name].parts
        common = sum(a == b for a, b in zip(parts[1:-1], own, strict=False))
        mirror = common == len(own) and stem in parts[-1]
        return not mirror, distance[name] - common, (ROOT / every[name]).stat().st_size

    found = [name for name in distance if every[name].name.startswith("test_")]
    return tuple(str(every[name]) for name in sorted(found, key=rank))


def mutants_of(module: str, path: Path) -> Iterator[tuple[str, str, int]]:
    """Yields module, operator and occurrence of each mutant of a module."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator, operator_names

    nodes = list(ast_nodes(get_ast((ROOT / path).read_text(encoding="utf-8"))))
    for name in operator_names():
        kind = name.partition("/")[2]
        if kind.startswith(KINDS) and not any(word in kind for word in LEFT_OUT):
            operator = get_operator(name)()
            count = sum(len(list(operator.mutation_positions(node))) for node in nodes)
            yield from ((module, name, k) for k in range(count))


def changed(module: str, path: Path, operator: str, occurrence: int) -> tuple[Mutant, str] | None:
    """Returns a mutant and the text of its module; None if it is the same program, as with another annotation."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    text = (ROOT / path).read_text(encoding="utf-8")
    other = mutate_code(text, get_operator(operator)(), occurrence)
    if other is None or bare(other) == bare(text):
        return None
    lines = [line[2:].strip() for line in difflib.ndiff(text.splitlines(), other.splitlines()) if line[0] in "-+"]
    return Mutant(module, f"{lines[0]} → {lines[-1]}", operator, occurrence), other


def bare(text: str) -> str:
    """Returns the tree of a program as text, without what cannot change a result."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = ast.Constant(None)
        elif isinstance(node, ast.Call):
            node.keywords = [k for k in node.keywords if k.arg not in OPTIONS]
        elif isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "not TYPE_CHECKING"):
            node.test = node.body = node.orelse = []
    return ast.dump(tree)


def drawn(count: int, seed: int, only: tuple[str, ...]) -> dict[Mutant, str]:
    """Returns `count` mutants and the texts of their modules, drawn without replacement from all of the rooms."""
    every = files()
    modules = [name for name in every if f"{name}.".startswith(tuple(f"{room}." for room in only))]
    whole = [mutant for name in modules for mutant in mutants_of(name, every[name])]
    order = (whole[k] for k in np.random.default_rng(seed).permutation(len(whole)))
    found = (changed(name, every[name], *which) for name, *which in order)
    return dict(islice(filter(None, found), count))


class Player:
    """Plays mutants in copies of the tree; state: the unchanged copy, and what is known of the tests there."""

    def __init__(self, folder: Path, seconds: float) -> None:
        self.tree, self.seconds = folder / "tree", seconds
        self.good, self.bad = set[str](), set[str]()  # tests that pass and fail without a mutant
        line = ["git", "ls-files", "-zco", "--exclude-standard"]
        names = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
        paths = [ROOT / name for name in filter(None, names)]
        for folder in {path.parent for path in paths}:
            paths += (folder / "__pycache__").glob("*")
        for path in filter(Path.is_file, paths):
            copy = self.tree / path.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, copy)

    def seen_by(self, module: str, text: str) -> tuple[str, str]:
        """Returns the test that fails with the changed text of a module and passes without, "" if there is none; and
        why it fails."""
        tests, path, left, end = tests_of(module), files()[module], self.seconds, 0
        with tempfile.TemporaryDirectory(dir=self.tree.parent) as folder:
            tree = Path(folder, "tree")
            shutil.copytree(self.tree, tree, copy_function=os.link)
            (tree / path).unlink()
            (tree / path).write_text(text, encoding="utf-8")
            for size in (*BATCHES, len(tests)):
                batch, end = tests[end : end + size], end + size
                if not batch or left <= 0:
                    break
                failed, why, spent = first_failure(tree, batch, self.bad, left)
                while failed and not self.passes(failed):
                    failed, why, spent = first_failure(tree, batch, self.bad, left)
                if failed:
                    return failed, why
                left -= spent
        return "", ""

    def passes(self, test: str) -> bool:
        """Returns True if a test passes without a mutant; it is left out from now on if it does not."""
        if not test.startswith("tests") or test in self.good:  # a signal needs no second look
            return True
        seconds = self.seconds if "::" in test else 0.0  # of a file that cannot be imported no test runs
        fails = bool(first_failure(self.tree, [test], (), seconds)[0])
        (self.bad if fails else self.good).add(test)
        return not fails


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--count", type=int, default=300, help="mutants")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--only", nargs="+", default=ROOMS, help="dotted names of rooms or modules")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--seconds", type=float, default=30.0, help="CPU time of the tests of a mutant")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "mutants.jsonl", help="file of the verdicts")
    parser.add_argument("--again", action="store_true", help="plays the survivors in --out again")
    given: argparse.Namespace = parser.parse_args()
    mutants = drawn(given.count, given.seed, tuple(given.only))
    given.out.parent.mkdir(parents=True, exist_ok=True)
    lines = given.out.read_text(encoding="utf-8").splitlines() if given.out.is_file() else []
    rows = [json.loads(line) for line in lines]
    before = {Mutant(*(row[f.name] for f in fields(Mutant))): row["by"] for row in rows if row["by"] or not given.again}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(given.jobs) as pool:
        player, lock = Player(Path(folder), given.seconds), threading.Lock()

        def play(mutant: Mutant) -> str:
            if mutant in before:
                return before[mutant]
            by, why = player.seen_by(mutant.module, mutants[mutant])
            with lock, given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps({**asdict(mutant), "by": by, "why": why}, ensure_ascii=False) + "\n")
            print(f"{by or 'SURVIVED'}: {mutant.module}: {mutant.change}", file=sys.stderr, flush=True)
            return by

        verdicts = dict(zip(mutants, pool.map(play, mutants), strict=True))
    report(verdicts)
    return int(sum(map(bool, verdicts.values())) < MUST * len(verdicts))


def report(verdicts: dict[Mutant, str]) -> None:
    """Prints the tables. verdicts: of each mutant the test that saw it, "" if none did."""
    of_room = {mutant: ".".join(mutant.module.split(".")[:2]) for mutant in verdicts}
    found, died = Counter(of_room.values()), Counter(of_room[mutant] for mutant, by in verdicts.items() if by)
    head(["room", "drawn", "killed", "share"])
    for room in sorted(found):
        row([room, str(found[room]), str(died[room]), f"{died[room] / found[room]:.2f}"])
    row(["all", str(len(verdicts)), str(died.total()), f"{died.total() / max(len(verdicts), 1):.2f}"])
    reasons = tomllib.loads(SURVIVORS.read_text(encoding="utf-8"))
    print("\nSurvivors")
    head(["module", "change", "reason"])
    for mutant in (mutant for mutant, by in verdicts.items() if not by):
        reason = reasons.get(mutant.module, {}).get(mutant.change, "–")
        row([mutant.module, f"`{mutant.change.replace('|', '¦')}`", reason])


if __name__ == "__main__":
    sys.exit(main())
