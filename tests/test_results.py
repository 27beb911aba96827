"""What README and docs show is what the stored tables say, and no headline is older than the code."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import pytest

import benchmarks
from benchmarks import results
from scenarios.loading.resolve import read_suite, resolve

TABLES = results.tables()
SHOWN = {(page, name): text for page in results.pages() for name, text in results.shown(page).items()}


@pytest.mark.parametrize(("page", "name"), SHOWN, ids=lambda x: getattr(x, "name", x))
def test_a_page_shows_the_stored_table(page, name):
    unmarked = SHOWN[page, name].replace(results.OLDER, "")
    assert unmarked == results.with_tables(unmarked, TABLES)


def test_every_table_is_shown_and_every_file_belongs_to_one():
    assert {name for _, name in SHOWN} == TABLES.keys()
    assert {path.stem for path in results.FOLDER.glob("*.json")} <= TABLES.keys()


@pytest.mark.parametrize("name", [table.name for table in TABLES.values() if table.headline])
def test_a_headline_is_not_older_than_the_code(name):
    assert not results.is_stale(TABLES[name]), f"python -m benchmarks results {name}"


def one(*cells: str) -> list[dict[str, object]]:
    return [{"title": "", "columns": ["", "score", "count"], "rows": [["blob", *cells]]}]


def test_few_seeds_leave_their_bands():
    whole = one("0.800 [0.700, 0.900]", "100")
    assert results.outside(one("0.75", "10"), one("0.84", "10"), whole) == []
    assert results.outside(one("0.75", "10"), one("0.86", "11"), whole) == [
        "blob, score: 0.75 is now 0.86",
        "blob, count: 10 is now 11",
    ]


SUITES = Path(__file__).resolve().parents[1] / "benchmarks" / "tuning_suites"


@pytest.mark.parametrize("path", sorted(SUITES.glob("*.toml")), ids=lambda path: path.stem)
def test_each_can_be_read(path: Path) -> None:
    assert [entry.name for entry in resolve(str(path))] == [line.name for line in read_suite(path).entry]


@pytest.mark.parametrize("name", sorted(m.name for m in pkgutil.walk_packages(benchmarks.__path__, "benchmarks.")))
def test_a_benchmark_finds_what_it_imports(name: str) -> None:
    if not name.endswith("__main__"):
        importlib.import_module(name)
