"""Distributions and links in places of fixed values, and what is refused of them before anything is simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.loading.toml_files import dump, toml_value

NIGHT = "draw.night={choice=[0, 1]}"
WRONG = [
    (["camera.tilt_deg={uniform=[30, 95]}"], "camera.tilt_deg", "95"),
    (["camera.tilt_deg={choice=[30, 95]}"], "camera.tilt_deg", "95"),
    (["camera.tilt_deg={uniform=[3, 1]}"], "camera.tilt_deg", "uniform"),
    (["camera.tilt_deg={uniform=[3, 4], choice=[3]}"], "camera.tilt_deg", "'uniform', 'choice'"),
    (["camera.tilt_deg={choice=['steep']}"], "camera.tilt_deg", "'steep'"),
    (["camera.image={choice=[[640, 480], [640]]}"], "camera.image", "640"),
    (["picture.jpeg={uniform=[50, 120]}"], "picture.jpeg", "120"),
    (["picture.samples={choice=[1, 1.5]}"], "picture.samples", "1.5"),
    (["duration={uniform=[10, 40]}"], "event.q1.when", "12 s at the earliest"),
    (["world.size={choice=[[16, 10], [12, 10]]}"], "group.w.start", "x = 13"),
    ([NIGHT, "camera.tilt_deg={link='nigt'}"], "camera.tilt_deg", "a link to 'nigt'"),
    ([NIGHT, "camera.tilt_deg={link='night', values=[30]}"], "camera.tilt_deg", "1 values for 0 to 1"),
    ([NIGHT, "camera.tilt_deg={link='night', values=30}"], "camera.tilt_deg", "values = 30"),
    ([NIGHT, "camera.tilt_deg={link='night', values=[30, 95]}"], "camera.tilt_deg", "95"),
    (["draw.night={choice=[]}"], "draw.night", "[]"),
    (["draw=3"], "draw", "3"),
    (["draws={}"], "draws", "unknown key"),
]


@pytest.mark.parametrize(("settings", "place", "got"), WRONG)
def test_wrong(path: Path, settings: list[str], place: str, got: str) -> None:
    with pytest.raises(InputError) as caught:
        load(path, settings)
    assert place in f"{caught.value.place}"
    assert got in f"{caught.value.place} {caught.value.got} {caught.value.expected}"
    assert str(path) == str(caught.value.file)


GOOD = [
    "camera.tilt_deg={normal=[40, 2], clip=[30, 50]}", "camera.image={choice=[[640, 480], [320, 240]]}",
    "camera.kind={choice=['pinhole', 'top']}", "camera.height={uniform=[4, 5]}", "camera.crop={choice=[true, false]}",
    "camera.position={choice=[[1, 2], [3, 4]]}", "picture.jpeg={uniform=[50, 90]}",
    "duration={uniform=[20, 40]}", "world.size.0={uniform=[16, 18]}", "group.w.repeat={poisson=3, clip=[2, 5]}",
    NIGHT, "light.shadow={link='night', values=[0.4, 0.0]}", "group.a.speed={link='night', values=[1.2, 1.0]}",
]  # fmt: skip


def test_a_scenario_with_draws_is_written_as_it_was_read(path: Path, tmp_path: Path) -> None:
    scenario = load(path, GOOD)
    assert len(scenario.draws or {}) == len(GOOD) - 1, "all but draw.night"
    file = tmp_path / "written.toml"
    file.write_text(dump(scenario))
    assert load(file) == scenario
    assert "image = { choice = [[640, 480], [320, 240]] }" in file.read_text()


@pytest.mark.parametrize("order", [1, -1])
def test_a_draw_of_the_base_is_replaced_as_a_whole(path: Path, tmp_path: Path, order: int) -> None:
    link, uniform = [{"link": "night", "values": [0.4, 0.0]}, {"uniform": [0.1, 0.2]}][::order]
    base, above = tmp_path / "base.toml", tmp_path / "above.toml"
    base.write_text(dump(load(path, [NIGHT, f"light.shadow={toml_value(link)}"])))
    above.write_text(f'extends = "base.toml"\nlight = {{ shadow = {toml_value(uniform)} }}\n')
    assert load(above).draws == {"light.shadow": uniform}


def test_a_distribution_that_is_drawn_for_each_person_stays(path: Path) -> None:
    scenario = load(path, ["group.a.speed={uniform=[1.0, 1.2]}", "crowd.height={uniform=[1.5, 1.7]}"])
    assert scenario.draws is None
