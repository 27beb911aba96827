"""A scenario in words and as SVG."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from scenarios.drawing.plan import svg
from scenarios.drawing.words import number, text
from scenarios.loading.resolve import load, names
from scenarios.schema.values import Distribution

SVG = "{http://www.w3.org/2000/svg}"


def words_of(drawing: str) -> list[str]:
    return [element.text or "" for element in ET.fromstring(drawing).iter(f"{SVG}text")]


def test_text_says_who_what_and_when(path: Path) -> None:
    said = text(load(path))
    for words in ("1.2 ± 0.1 m/s", "from (11, 3 to 5) past (9, 4)", "merge a + b → ab", "after m1, 4 s later", "95%"):
        assert words in said


def test_text_says_how_often_a_value_is_chosen() -> None:
    choices = {(1, 1, 2, 1): "1 (75%) or 2 (25%)", (3, 2, 3, 2): "3 or 2", (4,): "4"}
    assert [number(Distribution(choice=choice)) for choice in choices] == list(choices.values())


def test_svg_is_well_formed_and_names_groups_and_orders(path: Path) -> None:
    drawing = svg(load(path, ['about="<b> & \\"x\\""']))
    words = words_of(drawing)
    assert '<b> & "x"' in words
    for name in ("a (3)", "b (2)", "w ×3 (1)", "ab", "c", "d", "1", "2", "3", "door"):
        assert name in words
    for value in ET.fromstring(drawing).iter():
        assert "nan" not in str(value.attrib)
    assert svg(load(path)) == svg(load(path))


def test_every_catalogue_scenario_is_drawn() -> None:
    for name in names():
        scenario = load(name)
        assert scenario.about in text(scenario)
        assert name in words_of(svg(scenario))


def test_boxes_are_counted_and_drawn(path: Path) -> None:
    plain, box = load(path), "{ at = [8, 5, 1], size = [2, 1, 0.5], tilt_deg = 30 }"
    boxes = load(path, [f"world.boxes=[{box}, {box}]"])
    assert "2 boxes" in text(boxes)
    assert "1 box" in text(load(path, [f"world.boxes=[{box}]"]))
    drawn = [len(list(ET.fromstring(svg(scenario)).iter(f"{SVG}path"))) for scenario in (plain, boxes)]
    assert drawn[1] == drawn[0] + 2
