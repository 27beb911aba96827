"""Groups that never reach their goal: by the free space, by standing still, in generate and validate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.crowd.arrival import has_way, stands
from sim.crowd.navigation import scene_of
from sim.crowd.world import run as simulated
from sim.store.group_files import read_never_arrives
from tracking.app.cli import run

SCENE = """
schema = 1
duration = {duration}
world = {{ size = [20, 12], walls = {walls}, doors = {doors}, pillars = {pillars} }}
camera = {{ kind = "top", fps = 5 }}
group = [ {{ id = "a", size = 2, start = [4, 6], goal = [17, 6], speed = 1.5 }} ]
"""
CLOSED = [[10, 0, 10, 12]]
ROOM = [[15, 4, 19, 4], [19, 4, 19, 8], [19, 8, 15, 8], [15, 8, 15, 4]]


def scene(folder: Path, walls=(), doors="[]", pillars=(), duration=30.0) -> Path:
    path = folder / "s.toml"
    path.write_text(SCENE.format(walls=list(walls), doors=doors, pillars=list(pillars), duration=duration))
    return path


def door(width: float) -> str:
    return f"[{{ at = [10, 6], width = {width} }}]"


NO_WAY = {
    "a door of 0.4 m": ((CLOSED, door(0.4)), "the door of 0.40 m at [10.0, 6.0]"),
    "no door": ((CLOSED,), "the wall [10.0, 0.0, 10.0, 12.0]"),
    "a closed room": ((ROOM,), "the wall [15.0, 8.0, 15.0, 4.0]"),
    "a gap": (([[10, 0, 10, 5.8], [10, 6.2, 10, 12]],), "others"),
    "a pillar in the door": ((CLOSED, door(1.2), [[10, 6, 0.45]]), "the pillar [10.0, 6.0, 0.45]"),
    "pillars for a wall": (([], "[]", [[10, y / 2, 0.2] for y in range(25)]), "the pillar [10.0, 6.0, 0.2]"),
}


@pytest.mark.parametrize(("parts", "words"), NO_WAY.values(), ids=NO_WAY)
@pytest.mark.parametrize("duration", [4.0, 30.0])
def test_no_way(parts, words: str, duration: float, tmp_path: Path) -> None:
    """Whether the people have come to the obstacle or not."""
    (one,) = simulated(load(scene(tmp_path, *parts, duration=duration)), 0).never_arrive
    assert (one.group, one.people, one.goal, one.no_way) == ("a", (1, 2), (17.0, 6.0), True)
    assert one.obstacle == words or words == "others"
    assert one.words.startswith("group a never arrives: ")


OPEN = {
    "a door": (CLOSED, door(0.9)),
    "a narrow door": (CLOSED, door(0.6)),
    "round the end": ([[10, 0, 10, 10.5]],),
    "a pillar beside the door": (CLOSED, door(1.2), [[11.5, 9, 0.5]]),
}


@pytest.mark.parametrize("parts", OPEN.values(), ids=OPEN)
@pytest.mark.parametrize("duration", [4.0, 40.0])
def test_open_ways(parts, duration: float, tmp_path: Path) -> None:
    assert simulated(load(scene(tmp_path, *parts, duration=duration)), 0).never_arrive == ()


def test_the_width_of_a_body_decides() -> None:
    """A gap of 0.4 m is as wide as a body, and bodies and walls keep some clearance: 0.38 is too narrow, 0.5 is not."""
    for width, open_ in ((0.38, False), (0.4, False), (0.5, True), (0.8, True)):
        for turn in np.linspace(0, np.pi / 2, 7):
            ends = np.array([[0, -9], [0, -width / 2], [0, width / 2], [0, 9.0]])
            ends = 10 + ends @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            world = load("merge").world.model_copy(
                update={"size": (20.0, 20.0), "walls": ((*ends[0], *ends[1]), (*ends[2], *ends[3])), "doors": ()}
            )
            across = 0.5 * np.array([np.cos(turn), np.sin(turn)])
            pocket = scene_of(world.model_copy(update={"walls": (*world.walls, *ring(ends))}))
            assert has_way(pocket, (10 - across)[None], 10 + across) == open_, (width, turn)


def ring(ends: np.ndarray) -> list[tuple[float, ...]]:
    """A wall round both sides, through the outer ends of the two walls."""
    middle, reach = ends[[0, 3]].mean(axis=0), np.linalg.norm(ends[0] - ends[3]) / 2
    angles = np.arctan2(*(ends[0] - middle)[::-1]) + np.linspace(0, 2 * np.pi, 41)
    points = middle + reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [(*a, *b) for a, b in zip(points[:-1].tolist(), points[1:].tolist(), strict=True)]


def test_who_stands() -> None:
    still = np.zeros((120, 2, 4))
    assert stands(still, 10.0)
    assert not stands(still[:100], 10.0), "10 s have 101 ticks"
    walks, comes = still.copy(), still.copy()
    walks[:, 1, 0] = 0.06 * np.arange(120) / 10
    comes[:30, 0] = np.nan
    assert not stands(walks, 10.0), "0.6 m in 10 s"
    assert not stands(comes, 10.0)
    still[-1, 0, 0] = 0.2
    assert not stands(still, 10.0), "on the way again"


def test_generate_and_validate_say_it_and_the_remedy_helps(tmp_path: Path, capsys) -> None:
    made = ["generate", "--seeds", "0:2", "--streams", "none", "--out"]
    bad = scene(tmp_path, CLOSED, door(0.4), duration=25.0)
    assert run([*made, f"{tmp_path}/bad", str(bad)]) == 0
    err = capsys.readouterr().err
    assert "warning: s-s00000: group a never arrives: " in err
    assert "2 groups in 2 sequences" in err
    assert run([*made, f"{tmp_path}/packed", "--pack", str(bad)]) == 0
    assert capsys.readouterr().err.splitlines()[-2:] == err.splitlines()[-2:]
    assert run(["validate", f"{tmp_path}/bad", "--json"]) == 1
    out, err = capsys.readouterr()
    assert "warning: s-s00001: person 1 stood still for " in err
    problems = json.loads(out)["problems"]
    assert [p["got"].split(":")[0] for p in problems] == ["group a never arrives"] * 2
    folder = next(Path(tmp_path, "bad").glob("*/s-s00000"))
    (read,) = read_never_arrives(folder)
    assert read == simulated(load(bad), 0).never_arrive[0]
    good = scene(tmp_path, CLOSED, door(1.0), duration=12.0)
    assert run([*made, f"{tmp_path}/good", str(good)]) == 0
    assert "never arrives" not in capsys.readouterr().err
    assert run(["validate", f"{tmp_path}/good"]) == 0
