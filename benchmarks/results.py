"""Tables in README and docs that are made from stored figures: docs/results/NAME.json is the only source of a table.

A page shows a table between `<!-- results:NAME -->` and `<!-- /results:NAME -->`. The JSON holds the figures with their
seeds, command, versions, date, and the hash of the sources that they depend on.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks import trackers

ROOT = Path(__file__).resolve().parents[1]
OLD = "(older than the code)"


@dataclass(frozen=True)
class ResultTable:
    """A table. measure: returns its figures, as JSON can hold them. markdown: the figures as they are shown. page: the
    file that shows it. seeds: of its scenes. sources: patterns of the files that the figures depend on.
    """

    measure: Callable[[], dict[str, Any]]
    markdown: Callable[[dict[str, Any]], str]
    page: str
    seeds: str
    sources: tuple[str, ...]


WORLD = ("scenarios/**/*", "sim/**/*.py")
TRACKING = ("tracking/[!ad]*/**/*", "tracking/detect/**/*", "tracking/*.py")
"""All of `tracking` but the commands (app) and drawing."""

TABLES = {
    "trackers": ResultTable(
        trackers.measure, trackers.markdown, "README.md", trackers.SEEDS, (*WORLD, *TRACKING, "benchmarks/trackers.py")
    )
}


def sources_hash(patterns: tuple[str, ...]) -> str:
    """Returns the hash of the names and bytes of all source files that match; compiled files do not count."""
    found = {path for pattern in patterns for path in ROOT.glob(pattern) if path.suffix != ".pyc" and path.is_file()}
    digest = hashlib.sha256()
    for path in sorted(found):
        content = hashlib.sha256(path.read_bytes()).hexdigest()
        digest.update(f"{path.relative_to(ROOT).as_posix()} {content}\n".encode())
    return digest.hexdigest()


def stored(name: str) -> dict[str, Any]:
    """Returns the content of docs/results/NAME.json."""
    found: dict[str, Any] = json.loads(_file(name).read_text(encoding="utf-8"))
    return found


def block(name: str, content: dict[str, Any]) -> str:
    """Returns what the page shows of the stored content, between the markers, without the mark of old figures."""
    made = ", ".join(f"{package} {number}" for package, number in content["versions"].items())
    origin = f"Made on {content['date']} by `{content['command']}`, seeds {content['seeds']}, {made}."
    return f"{TABLES[name].markdown(content['figures'])}\n\n{origin}"


def shown(name: str) -> str:
    """Returns what stands between the markers of a table on its page. Raises ValueError without markers."""
    page = ROOT / TABLES[name].page
    found = _markers(name).search(page.read_text(encoding="utf-8"))
    if found is None:
        raise ValueError(f"{page}: expected <!-- results:{name} --> and <!-- /results:{name} -->")
    return found[2].strip("\n")


def measure(name: str) -> None:
    """Measures the figures of a table and stores them in docs/results/NAME.json."""
    table = TABLES[name]
    before = sources_hash(table.sources)
    content = {
        "command": f"python -m benchmarks results {name}",
        "seeds": table.seeds,
        "date": datetime.now(UTC).date().isoformat(),
        "versions": {package: version(package) for package in ("flockscope", "numpy", "scipy", "numba")},
        "sources": before,
        "figures": table.measure(),
    }
    _file(name).parent.mkdir(exist_ok=True)
    _file(name).write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def write(name: str) -> None:
    """Writes a table into its page, with a mark if the sources have changed since it was measured."""
    content, page = stored(name), ROOT / TABLES[name].page
    mark = "" if content["sources"] == sources_hash(TABLES[name].sources) else f" {OLD}"
    shown(name)
    text = _markers(name).sub(lambda m: f"{m[1]}\n{block(name, content)}{mark}\n{m[3]}", page.read_text("utf-8"))
    page.write_text(text, encoding="utf-8")


def _file(name: str) -> Path:
    return ROOT / "docs" / "results" / f"{name}.json"


def _markers(name: str) -> re.Pattern[str]:
    return re.compile(rf"(<!-- results:{name} -->)(.*?)(<!-- /results:{name} -->)", re.DOTALL)
