"""The rooms of the house: lines of code against their budget, and which rooms import which.

    python -m benchmarks rooms [--write]

Prints a row for each folder of the three packages, and one for each package's own modules, tests and benchmarks: lines
of code (without blank lines, imports, comments and docstrings), its budget, modules, and the rooms that it imports.
Then the least path: how many modules of ours a script loads that simulates `cross`, tracks it with `blob` on boxes, and
scores the tracks. benchmarks/budget.toml holds the budgets; tests/test_architecture.py refuses a room above its own:
who adds lines takes some away. --write lowers the budgets to the present lines, and never raises one.

"""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path

from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row

ROOT = Path(__file__).resolve().parents[1]
BUDGET = ROOT / "benchmarks" / "budget.toml"
PACKAGES = ("scenarios", "sim", "tracking")
BESIDE = ("tests", "benchmarks")
LEAST_PATH = """
import sys, scenarios, sim, tracking
sequence = sim.simulate(scenarios.load("cross", set=["duration=2"]), seed=1, streams=())
tracking.evaluate(sequence.truth, tracking.track("blob", sequence, detections="file"))
print(sum(name.partition(".")[0] in {"scenarios", "sim", "tracking"} for name in sys.modules))
"""


def room_of(path: Path) -> str:
    """Returns the room of a module: its package and the folder in it, or the package alone; `tests`, `benchmarks`."""
    package, *inside = path.parts
    return package if package in BESIDE or len(inside) < 2 else f"{package}.{inside[0]}"


def lines_of_code(text: str) -> int:
    """Returns the lines of a module that are neither blank, import, comment nor docstring."""
    left_out = set[int]()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node, clean=False
        ):
            left_out.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    lines = ((k, line.strip()) for k, line in enumerate(text.splitlines(), 1))
    return sum(k not in left_out and bool(line) and not line.startswith(("#", "import ", "from ")) for k, line in lines)


@cache
def modules() -> dict[Path, str]:
    """Returns the text of each module of the packages, tests and benchmarks, by its path relative to the root."""
    found = [path for folder in (*PACKAGES, *BESIDE) for path in sorted((ROOT / folder).rglob("*.py"))]
    return {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in found}


def weights() -> dict[str, int]:
    """Returns the lines of code of each room."""
    total = Counter[str]()
    for path, text in modules().items():
        total[room_of(path)] += lines_of_code(text)
    return dict(total)


def budget() -> dict[str, int]:
    """Returns the lines of code that each room may have."""
    return dict(tomllib.loads(BUDGET.read_text(encoding="utf-8"))["rooms"])


def arrows() -> dict[str, Counter[str]]:
    """Returns by room the number of its modules that import from each other room of the packages."""
    found = dict[str, Counter[str]]()
    for path, text in modules().items():
        used = set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] in PACKAGES:
                base = Path(*node.module.split("."))
                files = [base / f"{alias.name}.py" for alias in node.names]
                module = base.with_suffix(".py") if base.with_suffix(".py") in modules() else base / "__init__.py"
                used |= {room_of(file if file in modules() else module) for file in files}
        found.setdefault(room_of(path), Counter()).update(used - {room_of(path)})
    return found


def loaded() -> int:
    """Returns the number of modules of ours that the least path loads."""
    run = subprocess.run([sys.executable, "-c", LEAST_PATH], cwd=ROOT, capture_output=True, text=True, check=True)
    return int(run.stdout)


def write(now: dict[str, int], allowed: dict[str, int]) -> None:
    """Writes the budgets: none rises; a room that is new gets its present lines."""
    lines = [f'"{room}" = {min(count, allowed.get(room, count))}' for room, count in sorted(now.items())]
    text = "# Lines of code that each room may have: python -m benchmarks rooms --write lowers them, and raises none.\n"
    BUDGET.write_text(f"{text}[rooms]\n" + "\n".join(lines) + "\n", encoding="utf-8")


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--write", action="store_true", help="lower the budgets to the present lines")
    given = parser.parse_args()
    now, allowed = weights(), budget() if BUDGET.is_file() else {}
    if given.write:
        write(now, allowed)
        allowed = budget()
    count = Counter(map(room_of, modules()))
    head(["room", "lines of code", "budget", "modules", "imports"])
    every = arrows()
    for room, lines in sorted(now.items()):
        imports = ", ".join(sorted(every.get(room, ()))) if room not in BESIDE else ""
        row([room, f"{lines:,}", f"{allowed.get(room, 0):,}", str(count[room]), imports or "–"])
    product = sum(lines for room, lines in now.items() if room not in BESIDE)
    row(["the three packages", f"{product:,}", f"{sum(v for k, v in allowed.items() if k not in BESIDE):,}",
         str(sum(v for k, v in count.items() if k not in BESIDE)), "–"])  # fmt: skip
    print(f"\nmodules of ours on the least path: {loaded()}")
    return int(any(lines > allowed.get(room, 0) for room, lines in now.items()))


if __name__ == "__main__":
    sys.exit(main())
