"""Suites: order, names, settings, repeats, and what is wrong in them."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load, resolve, rows, suite_names
from sim.draws import drawn


def suite(path: Path, text: str) -> str:
    file = path.with_name("mine.toml")
    file.write_text(text)
    return str(file)


def test_entries_expand_in_order(path: Path) -> None:
    file = suite(
        path,
        """
        about = "two"
        entry = [
          { name = "long", scenario = "tour.toml", set = ["duration=60"] },
          { name = "many", scenario = "tour.toml", repeat = 3 },
        ]
        """,
    )
    entries = resolve(file)
    assert [(e.name, e.repeat) for e in entries] == [("long", 0), ("many-1", 1), ("many-2", 2), ("many-3", 3)]
    assert [e.scenario.name for e in entries] == [e.name for e in entries]
    assert [e.scenario.duration for e in entries] == [60, 30, 30, 30]
    assert [e.scenario.duration for e in resolve(file, ["duration=70"])] == [70] * 4
    assert resolve(f"suite:{file}") == entries


def test_a_suite_is_made_of_suites(path: Path) -> None:
    """Two of them may have entries of one name; the sequences are those of the suites, with their copies."""
    text = "entry = [{ scenario = 'tour.toml' }, { name = 'many', scenario = 'tour.toml', repeat = 2 }]"
    (path.parent / "part").mkdir()
    (path.parent / "part/small.toml").write_text(text)
    (path.parent / "part/tour.toml").write_text(path.read_text().replace("duration = 30.0", "duration = 31.0"))
    file = suite(
        path,
        """
        entry = [
          { suite = "part/small.toml", set = ["camera.fps=7"] },
          { name = "again", suite = "part/small.toml" },
          { suite = "occlusion" },
          { scenario = "tour.toml" },
        ]
        """,
    )
    entries = resolve(file)
    parts = ["tour", "many-1", "many-2"]
    occlusion = resolve("occlusion")
    names = [f"{whole}-{part}" for whole in ("small", "again") for part in parts]
    assert [e.name for e in entries] == [*names, *(f"occlusion-{e.name}" for e in occlusion), "tour"]
    assert [(e.repeat, e.scenario.duration) for e in entries[:6]] == [(0, 31), (1, 31), (2, 31)] * 2
    assert [e.scenario.camera.fps for e in entries[:6]] == [7] * 3 + [10] * 3
    assert entries[-1].scenario.duration == 30
    for entry, own in zip(entries[6:], occlusion, strict=False):
        assert entry.scenario.model_copy(update={"name": own.name}) == own.scenario
    assert {row.name for row in rows(file)} >= {"small-tour", "again-tour", "tour"}


WRONG = [
    ("entry = []", "entry", "[]"),
    ("entrys = []", "entrys", "unknown key"),
    ("entry = [{ name = 'a' }]", "entry.0", "neither scenario nor suite"),
    ("entry = [{ scenario = 'tour.toml', suite = 'quick' }]", "entry.0", "scenario and suite"),
    ("entry = [{ suite = 'quick', repeat = 2 }]", "entry.0", "repeat"),
    ("entry = [{ suite = 'quick' }, { suite = 'quick' }]", "entry", "two entries named 'quick-"),
    ("entry = [{ suite = 'mine.toml' }]", "entry", "mine.toml → mine.toml"),
    ("entry = [{ scenario = 'tour.toml', repet = 2 }]", "entry.0.repet", "unknown key"),
    ("entry = [{ scenario = 'tour.toml', repeat = 0 }]", "entry.0.repeat", "0"),
    ("entry = [{ scenario = 'tour.toml', repeat = 1000000000 }]", "entry.0.repeat", "1000000000"),
    ("entry = [{ scenario = 'tour.toml', repeat = true }]", "entry.0.repeat", "true"),
    ("entry = [{ scenario = 'tour.toml', set = [3] }]", "entry.0.set.0", "3"),
    ("entry = [{ scenario = 'tour.toml' }, { scenario = 'tour.toml' }]", "entry", "two entries"),
    ("entry = [3]", "entry.0", "3"),
    ("entry = [{ scenario = 'tour.toml', name = 'a b' }]", "entry.0.name", "'a b'"),
]


@pytest.mark.parametrize(("text", "place", "got"), WRONG)
def test_wrong(path: Path, text: str, place: str, got: str) -> None:
    file = suite(path, text)
    with pytest.raises(InputError) as caught:
        resolve(f"suite:{file}")
    assert (caught.value.file, caught.value.place) == (file, place)
    assert got in caught.value.got


def test_an_error_inside_an_entry_names_suite_and_entry(path: Path) -> None:
    file = suite(path, "entry = [{ scenario = 'tour.toml', name = 'x', set = ['duratoin=3'] }]")
    with pytest.raises(InputError, match="duration") as caught:
        resolve(file)
    assert file in caught.value.file
    assert "entry x" in caught.value.file


@pytest.mark.parametrize("name", [*suite_names(), "cross"])
def test_rows_are_the_entries_without_copies(name: str) -> None:
    """A row loaded is what its entry is, from any working folder."""
    entries = {entry.name.removesuffix(f"-{entry.repeat}"): entry.scenario for entry in resolve(name, ["camera.fps=4"])}
    found = {row.name: load(row.scenario, (*row.settings, "camera.fps=4")) for row in rows(name)}
    for row, scenario in found.items():
        assert scenario.model_dump(exclude={"name"}) == entries[row].model_dump(exclude={"name"})
    contents = {scenario.model_dump_json(exclude={"name"}) for scenario in entries.values()}
    assert {scenario.model_dump_json(exclude={"name"}) for scenario in found.values()} == contents


def test_no_two_sequences_of_the_suite_looks_are_alike() -> None:
    entries = resolve("suite:looks")
    made = [drawn(entry.scenario, 0, entry.repeat) for entry in entries[::10]]
    assert len(entries) == 200
    assert len({scenario.picture for scenario in made}) == len({scenario.light for scenario in made}) == 20
    assert len({scenario.camera.height for scenario in made}) > 5
