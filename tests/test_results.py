"""Tables in README and docs are what their stored figures say."""

from __future__ import annotations

import json

import pytest

from benchmarks import results
from benchmarks.results import OLD, TABLES, block, shown, sources_hash, stored, write


@pytest.mark.parametrize("name", TABLES)
def test_a_page_shows_what_is_stored(name: str) -> None:
    text = shown(name).removesuffix(f" {OLD}")
    assert text == block(name, stored(name)), "make it with: python -m benchmarks results"


def test_old_figures_are_marked(tmp_path, monkeypatch) -> None:
    (name,), content = TABLES, stored("trackers")
    (tmp_path / "docs" / "results").mkdir(parents=True)
    (tmp_path / "sim").mkdir()
    (tmp_path / "sim" / "world.py").write_text("G = 1\n")
    page = tmp_path / TABLES[name].page
    page.write_text(f"before\n<!-- results:{name} -->\n<!-- /results:{name} -->\nafter\n")
    monkeypatch.setattr(results, "ROOT", tmp_path)
    content["sources"] = sources_hash(TABLES[name].sources)
    (tmp_path / "docs" / "results" / f"{name}.json").write_text(json.dumps(content))
    write(name)
    new = page.read_text()
    assert new.startswith(f"before\n<!-- results:{name} -->\nFrom ")
    assert new.endswith(f"<!-- /results:{name} -->\nafter\n")
    assert OLD not in new
    (tmp_path / "sim" / "world.py").write_text("G = 2\n")
    write(name)
    assert page.read_text() == new.replace("\n<!-- /", f" {OLD}\n<!-- /")
    write(name)
    assert page.read_text().count(OLD) == 1
    page.write_text("no markers\n")
    with pytest.raises(ValueError, match="results:trackers"):
        write(name)
    assert page.read_text() == "no markers\n"
