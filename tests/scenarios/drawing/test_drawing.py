"""A scenario in words and as SVG."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from scenarios.drawing.plan import COLOURS, _colours, middle, order_marks, spread, svg
from scenarios.drawing.words import number, order, text, trigger
from scenarios.loading.resolve import load, names
from scenarios.schema.geometry import queue_places
from scenarios.schema.values import Distribution

SVG = "{http://www.w3.org/2000/svg}"


def words_of(drawing: str) -> list[str]:
    return [element.text or "" for element in ET.fromstring(drawing).iter(f"{SVG}text")]


def test_text_says_who_what_and_when(path: Path) -> None:
    said = text(load(path))
    for words in (
        "merge, split and queue",
        "16 × 10 m: 1 wall, 1 door, 1 pillar",
        "3 people from (5, 5) to (11, 5), at 1.2 ± 0.1 m/s",
        "from (11, 3 to 5) past (9, 4)",
        "3 groups of 1 person",
        "merge a + b → ab, to (8, 6)",
        "when they are closer than 1.5 m",
        "split ab → c (3) to (14, 5), d (2) to (8, 8)",
        "after m1, 4 s later",
        "queue w-*, c at (12, 7), served about 3 s each",
        "detects 95%",
    ):
        assert words in said


def test_stops_and_scatter_in_words(path: Path) -> None:
    stops = "[{ at = [9, 4], until = [4, 8], stay = 1 }, { at = [8, 4], stay = { uniform = [2, 3] }, members = 1 }]"
    said = text(load(path, [f"group.a.stops={stops}", "group.a.scatter=0.5", "group.a.enter=-1"]))
    assert "stopping at (9, 4) [until 4, 8 s, for 1 s], (8, 4) [for 2 to 3 s, only 1 member]" in said
    assert "scattered by 0.5 m, entering at -1 s" in said


def test_svg_is_well_formed_and_names_groups_and_orders(path: Path) -> None:
    drawing = svg(load(path, ['about="<b> & \\"x\\""']))
    words = words_of(drawing)
    assert '<b> & "x"' in words
    for name in ("a (3)", "b (2)", "w ×3 (1)", "ab", "c", "d", "1", "2", "3", "door"):
        assert name in words
    for value in ET.fromstring(drawing).iter():
        assert "nan" not in str(value.attrib)
    assert svg(load(path)) == svg(load(path))


def test_a_scenario_without_orders(path: Path) -> None:
    scenario = load(path, ["event=[]"])
    assert "Orders\n  none" in text(scenario)
    assert "a (3)" in words_of(svg(scenario))


def test_every_catalogue_scenario_is_drawn() -> None:
    for name in names():
        scenario = load(name)
        assert scenario.about in text(scenario)
        assert name in words_of(svg(scenario))


def test_stairs_service_and_turn(path: Path) -> None:
    scenario = load(
        path,
        [
            "world.stairs=[{foot=[6, 1], head=[9, 1]}]",
            "world.service=[[15, 8]]",
            "turn_deg={uniform=[0, 360]}",
            "mirror=true",
            "lead=2",
        ],
    )
    assert "turned by 0 to 360°, mirrored by a coin, 2 s further on" in text(scenario)
    assert {"stairs, +1.5 m", "service"} <= set(words_of(svg(scenario)))


def test_marks_follow_the_script(path: Path) -> None:
    scenario = load(path)
    merge, split, queue = order_marks(scenario)
    assert (merge.before, merge.after) == (("a", "b"), ("ab",))
    assert merge.ways["ab"][-1] == (8, 6)
    assert [way[-1] for way in split.ways.values()] == [(14, 5), (8, 8)]
    assert queue.before == ("w-1", "w-2", "w-3", "c")
    assert len(queue.slots) == 4  # those inside the world
    assert queue_places(scenario.event[2], 2)[1] == pytest.approx((12, 7.8))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "words", "mid", "half"),
    [
        (3.0, "3 s", 3, 0),
        (Distribution(normal=(2, 0.5)), "2 ± 0.5 s", 2, 1),
        (Distribution(normal=(2, 0.5), clip=(1.5, 2.5)), "2 ± 0.5 s (1.5 to 2.5)", 2, 0.5),
        (Distribution(uniform=(1, 5)), "1 to 5 s", 3, 2),
        (Distribution(choice=(-1, 1)), "-1 or 1 s", 0, 1),
        (Distribution(choice=(1, 1, 1, 2)), "1 (75 %) or 2 (25 %) s", 1.25, 0.5),
        (Distribution(exponential=3), "about 3 s", 3, 6),
        (Distribution(poisson=1.1, clip=(2, 6)), "about 1.1 s (2 to 6)", 2, 2),
    ],
)
def test_values_in_words_and_their_extent(value, words, mid, half) -> None:  # type: ignore[no-untyped-def]
    assert (number(value, "s"), middle(value), spread(value)) == (words, mid, half)


def test_every_trigger_in_words(path: Path) -> None:
    def of(when: str) -> str:
        return trigger(load(path, [f"event.m1.when={when}"]).event[0].when)

    assert of("{ time = { uniform = [1, 2] } }") == "at 1 to 2 s"
    assert of("{ reach = { group = 'a' }, delay = 2 }") == "when a comes within 1 m of its goal, 2 s later"
    assert of("{ reach = { group = 'a', at = [8, 5], radius = 2 } }") == "when a comes within 2 m of (8, 5)"
    assert "to meet and stand" in order(load(path, ["event.m1.goal=meet"]).event[0])


def test_each_of_twelve_groups_has_the_next_of_ten_colours(tmp_path: Path) -> None:
    rows = "".join(f'[[group]]\nid = "g{k}"\nstart = [1, {k + 1}]\ngoal = [9, {k + 1}]\n' for k in range(12))
    (tmp_path / "many.toml").write_text(f"schema = 1\nduration = 5\nworld.size = [20, 20]\n{rows}")
    scenario = load(tmp_path / "many.toml")
    colour = _colours(scenario, order_marks(scenario))
    assert [colour[f"g{k}"] for k in range(12)] == [*COLOURS, COLOURS[0], COLOURS[1]]
