"""Where groups start and which stops they plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.schema.groups import Stop
from sim.crowd.population import draw_stops
from sim.crowd.world import run

SCENE = """
schema = 1
duration = 4.0
world = {{ size = [30, 20] }}
camera = {{ kind = "top", crop = true, px_per_m = 20, position = [15, 10] }}
group = [
  {{ id = "a", size = 3, start = [5, 10], goal = [27, 10] }},
  {{ id = "b", size = 3, start = {start}, goal = [27, 12] }},
]
"""


@pytest.mark.parametrize(("start", "free"), [("[5, 10]", False), ("[5, 14]", True)])
def test_groups_that_are_there_from_the_beginning_do_not_start_at_one_place(
    start: str, free: bool, tmp_path: Path
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(start=start))
    if free:
        assert run(load(tmp_path / "scene.toml"), 1).present.all()
    else:
        with pytest.raises(InputError, match="a place in a wall, a pillar or another group"):
            run(load(tmp_path / "scene.toml"), 1)


def test_height_and_clothes_of_one_group_change_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(start="[5, 14]"))
    settings = [
        "group.a.height={ uniform = [1.1, 1.3] }",
        "group.a.clothes=['red', '#0102ff']",
        "group.b.trousers=black",
    ]
    any_, own = run(load(tmp_path / "scene.toml"), 1), run(load(tmp_path / "scene.toml", settings), 1)
    assert np.array_equal(any_.pos, own.pos)
    assert np.array_equal(any_.height[3:], own.height[3:])
    assert ((own.height[:3] >= 1.1) & (own.height[:3] <= 1.3)).all()
    assert len(set(own.height[:3])) == 3
    red, blue = [0xC0, 0x20, 0x20], [1, 2, 255]
    assert all(own.clothes[p, 0].tolist() in (red, blue) for p in range(3))
    assert own.clothes[3:, 1].tolist() == [[0x1A, 0x1A, 0x1C]] * 3
    assert np.isnan(own.clothes[:3, 1]).all()
    assert np.isnan(own.clothes[3:, 0]).all()


STOPS = [
    ({"stay": 3.0}, (0, 1, 2)), ({"until": (2.0,)}, (0, 1, 2)), ({"stay": 3.0, "members": 3}, (0, 1, 2)),
    ({"stay": 3.0, "members": 0}, None), ({}, None), ({"members": 2}, None),
]  # fmt: skip


@pytest.mark.parametrize(("given", "members"), STOPS)
def test_stops_without_members_or_time_are_left_out(given, members) -> None:
    stops = draw_stops((Stop(at=(1.0, 2.0), **given),), 3, np.array, np.random.default_rng(0))
    assert [stop.members for stop in stops] == ([] if members is None else [members])
    assert [stop.whole for stop in stops] == [True] * len(stops)
