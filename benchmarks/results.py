"""Makes the tables and charts that README and docs show, and tells which are older than the code.

    python -m benchmarks results [NAME …]      make these tables (default: all that are missing or stale)
    python -m benchmarks results --all         make all of them
    python -m benchmarks results --quick       make the headlines on few seeds; exit code 1 outside their bands
    python -m benchmarks results --list        name, age and cost of each table
    python -m benchmarks results --show        write the stored tables into the pages again

docs/results/tables.toml names each table and the benchmark that prints it. The table is stored in
docs/results/NAME.json with command, date, versions and a hash of the sources that decide it, and is shown between
`<!-- results: NAME -->` and `<!-- end -->` in any page. The sources of a table are the modules that its benchmark
imports, without docstrings and comment lines, and all scenario files; `trackers` leaves out those of other trackers. A
table is stale if its sources have changed. --quick compares tables of few seeds with those of the same seeds when the
table was made. If they agree, the hash of the present sources is stored, too: the table is confirmed.
"""

from __future__ import annotations

import ast
import datetime
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.support.options import new_parser
from sim.hashing import versions
from sim.workers.calls import THREAD_VARIABLES

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "results"
PACKAGES = ("benchmarks", "scenarios", "sim", "tracking")
BLOCK = re.compile(r"(<!-- results: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")
OLDER = ", older than the code"  # follows the date of a table that is stale
INTERVAL = re.compile(r"\[([-+]?[\d.]+), ([-+]?[\d.]+)\]")


@dataclass(frozen=True)
class Table:
    """An entry of tables.toml.

    run: words after `python -m benchmarks`, {chart} for docs/results/NAME.svg. quick: options for few seeds, which
    replace those of `run`. trackers: those whose sources count; () for all. headline: the fast tests refuse it when it
    is stale. timing: its figures depend on the machine.
    """

    name: str
    run: str
    quick: str = ""
    trackers: tuple[str, ...] = ()
    headline: bool = False
    timing: bool = False

    @property
    def file(self) -> Path:
        """The file of the stored table."""
        return FOLDER / f"{self.name}.json"

    @property
    def module(self) -> str:
        """The benchmark's module."""
        return f"benchmarks.{shlex.split(self.run)[0]}"

    def words(self, quick: bool = False) -> list[str]:
        """Returns the command line after `python -m benchmarks`; options of `quick` replace those of `run`."""
        folder = tempfile.gettempdir() if quick else "docs/results"  # a chart of few seeds is not shown
        words = shlex.split(self.run.replace("{chart}", f"{folder}/{self.name}.svg"))
        few = shlex.split(self.quick) if quick else []
        for k in (k for k, word in enumerate(few) if word.startswith("--")):
            if few[k] in words:
                at = words.index(few[k])
                del words[at : at + 2]
        return words + few


def tables() -> dict[str, Table]:
    """Returns all entries of tables.toml by name."""
    found = tomllib.loads((FOLDER / "tables.toml").read_text(encoding="utf-8"))
    return {k: Table(k, **{**v, "trackers": tuple(v.get("trackers", ()))}) for k, v in found.items()}


def stored(table: Table) -> dict[str, Any]:
    """Returns the content of a table's file, {} without a file."""
    return json.loads(table.file.read_text(encoding="utf-8")) if table.file.is_file() else {}


def store(table: Table, content: dict[str, Any]) -> None:
    """Writes the file of a table."""
    table.file.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def lacks(table: Table) -> str:
    """Returns the environment variable that the command needs and that is not set, "" if there is none."""
    return next((word for word in table.words() if os.path.expandvars(word).startswith("$")), "")


def is_stale(table: Table) -> bool:
    """Returns True if the table is missing, or its sources have changed since it was made or confirmed."""
    content = stored(table)
    return not content or sources_hash(table) not in (content["sources"], content.get("confirmed"))


@cache
def _module_files() -> dict[str, Path]:
    found = {}
    for path in (p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def _module_facts(name: str) -> tuple[str, frozenset[str]]:
    """Returns a module's lines without docstrings, comments and blank lines, and the names of our modules it uses."""
    text = _module_files()[name].read_text(encoding="utf-8")
    tree, used, left_out = ast.parse(text), set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                left_out.update(range(first.lineno, (first.end_lineno or 0) + 1))
        if isinstance(node, ast.Import):
            used |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            used |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            used.add(node.value.partition(":")[0])  # as in the registry of trackers
    lines = (line.strip() for k, line in enumerate(text.splitlines(), 1) if k not in left_out)
    code = "\n".join(line for line in lines if line and not line.startswith("#"))
    return code, frozenset(used & _module_files().keys())


def sources_of(table: Table) -> list[str]:
    """Returns the names of the modules that decide a table, sorted."""
    others = tuple(f"tracking.papers.{p.name}." for p in (ROOT / "tracking" / "papers").iterdir() if table.trackers
                   and p.name.replace("_", "-") not in table.trackers)  # fmt: skip
    name = table.module if table.module in _module_files() else f"{table.module}.__main__"
    found, waiting = set(), [name, f"{name}.__main__"]
    while waiting:
        name = waiting.pop()
        if name in _module_files() and name not in found and not f"{name}.".startswith(others or "/"):
            found.add(name)
            waiting += _module_facts(name)[1]
    return sorted(found)


def sources_hash(table: Table) -> str:
    """Returns a hash of the command, of the sources of a table and of all scenario files."""
    h = hashlib.sha256(table.run.encode())
    for name in sources_of(table):
        h.update(f"{name}\n{_module_facts(name)[0]}\n".encode())
    for path in (p for package in PACKAGES[1:] for p in sorted((ROOT / package).rglob("*.toml"))):
        h.update(json.dumps(tomllib.loads(path.read_text(encoding="utf-8")), sort_keys=True, default=str).encode())
    return h.hexdigest()[:16]


def printed_tables(text: str) -> list[dict[str, Any]]:
    """Returns the Markdown tables of a text: title (the text line before, or ""), columns, rows of cells."""
    found: list[dict[str, Any]] = []
    title, inside = "", False
    for line in text.splitlines():
        if not line.startswith("|"):
            title, inside = (line.strip() or title), False
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not inside:
            found.append({"title": title, "columns": cells, "rows": []})
            title, inside = "", True
        elif set(line) - set("|-: "):
            found[-1]["rows"].append(cells)
    return found


def made(table: Table, quick: bool = False) -> list[dict[str, Any]]:
    """Runs the benchmark of a table and returns what it printed. Raises SystemExit if it fails or prints no table."""
    words = [os.path.expandvars(word) for word in table.words(quick)]
    environment = {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1"), "PYTHONPATH": str(ROOT)}
    line = [sys.executable, "-m", "benchmarks", *words]
    run = subprocess.run(line, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    found = printed_tables(run.stdout)
    if run.returncode or not found:
        raise SystemExit(f"{shlex.join(words)}: exit code {run.returncode}\n{run.stdout[-600:]}")
    return found


def make(table: Table) -> None:
    """Makes a table, and that of few seeds to compare with later; writes both."""
    begun, before = time.monotonic(), sources_hash(table)
    content = {
        "command": " ".join(["python -m benchmarks", *table.words()]), "tables": made(table),
        "quick": made(table, quick=True) if table.quick else [],
        "date": datetime.date.today().isoformat(), "minutes": round((time.monotonic() - begun) / 60, 1),
        "versions": versions(drawn=True), "sources": before,
    }  # fmt: skip
    store(table, content)


def markdown(content: dict[str, Any]) -> str:
    """Returns what a page shows of a stored table."""
    parts = []
    for one in content["tables"]:
        title = f"{one['title']}\n\n" if one["title"] else ""
        lines = [one["columns"], ["---"] * len(one["columns"]), *one["rows"]]
        parts.append(title + "\n".join("| " + " | ".join(cells) + " |" for cells in lines))
    return "\n\n".join([*parts, f"`{content['command']}`, {content['date']}"])


def pages() -> Iterator[Path]:
    """Yields all pages that may show tables."""
    yield ROOT / "README.md"
    yield from sorted((ROOT / "docs").rglob("*.md"))


def shown(page: Path) -> dict[str, str]:
    """Returns the text of each block of a page by the name of its table."""
    return {m[2]: m[0] for m in BLOCK.finditer(page.read_text(encoding="utf-8"))}


def with_tables(text: str, every: dict[str, Table], mark: bool = False) -> str:
    """Returns the text of a page with its blocks written anew. mark: adds OLDER to stale tables. Raises KeyError if a
    block names no table."""

    def block(m: re.Match[str]) -> str:
        content = stored(every[m[2]])
        old = OLDER if mark and content and is_stale(every[m[2]]) else ""
        return f"{m[1]}\n{markdown(content)}{old}\n\n{m[3]}" if content else f"{m[1]}{m[3]}"

    return BLOCK.sub(block, text)


def show(every: dict[str, Table]) -> None:
    """Writes the stored tables into all pages."""
    for page in pages():
        text = page.read_text(encoding="utf-8")
        if (new := with_tables(text, every, mark=True)) != text:
            page.write_text(new, encoding="utf-8")


def outside(old: list[dict[str, Any]], new: list[dict[str, Any]], whole: list[dict[str, Any]]) -> list[str]:
    """Returns the cells of few seeds that have left their bands, as text.

    old, new: the tables of few seeds when the table was made, and now. whole: the table itself. The band of a cell is
    half the width of its interval in `whole`, else 5 % of its value, and at least 0.02.
    """
    found = []
    for before, after, full in zip(old, new, whole, strict=True):
        for a, b, c in zip(before["rows"], after["rows"], full["rows"], strict=True):
            for column, x, y, z in zip(before["columns"][1:], a[1:], b[1:], c[1:], strict=True):
                u, v, ends = NUMBER.search(x), NUMBER.search(y), INTERVAL.search(z)
                if u is None or v is None:
                    continue
                band = (float(ends[2]) - float(ends[1])) / 2 if ends else 0.05 * abs(float(u[0]))
                if abs(float(u[0]) - float(v[0])) > max(band, 0.02):
                    found.append(f"{a[0]}, {column}: {x} is now {y}")
    return found


def confirm(table: Table) -> list[str]:
    """Makes the table of few seeds again; returns what has left its bands. If nothing has, the table is confirmed."""
    content = stored(table)
    if not content:
        return ["not made yet"]
    before = content["quick"] or content["tables"]
    found = [] if table.timing else outside(before, made(table, quick=True), content["tables"])
    if not found:
        store(table, content | {"confirmed": sources_hash(table)})
    return found


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="tables")
    parser.add_argument("--all", action="store_true", help="all tables")
    parser.add_argument("--quick", action="store_true", help="few seeds of the headlines, compared with their bands")
    parser.add_argument("--list", action="store_true", help="list the tables")
    parser.add_argument("--show", action="store_true", help="write the stored tables into the pages")
    given, every = parser.parse_args(), tables()
    if unknown := set(given.names) - every.keys():
        parser.error(f"no table {', '.join(sorted(unknown))}; tables: {', '.join(every)}")
    if given.list:
        for table in every.values():
            content = stored(table)
            age = "missing" if not content else "stale" if is_stale(table) else "current"
            print(f"{table.name}: {age}, {content.get('date', '–')}, {content.get('minutes', '–')} min, {table.run}")
        return 0
    code = 0
    chosen = [every[name] for name in given.names] or list(every.values())
    if given.quick:
        for table in (t for t in chosen if given.names or t.headline):
            found = confirm(table)
            code |= bool(found)
            print(f"{table.name}: {'; '.join(found) or 'within its bands'}", flush=True)
    elif not given.show:
        for table in (t for t in chosen if given.names or given.all or is_stale(t)):
            if lacking := lacks(table):
                print(f"{table.name}: left as it is, as {lacking} is not set", flush=True)
                continue
            print(f"{table.name}: {shlex.join(table.words())}", flush=True)
            make(table)
            show(every)
    show(every)
    return code


if __name__ == "__main__":
    sys.exit(main())
