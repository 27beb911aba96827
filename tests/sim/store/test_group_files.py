"""The small files of a truth, cameras and scenes: exact round trips; what is refused names its place."""

import json

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.camera import camera_rotation
from sim.store.camera_files import camera_document, read_camera, read_scene, scene_document
from sim.store.group_files import read_events, read_groups_csv, read_near, read_script
from sim.store.track_files import tracks_files
from sim.types import Box, Camera, Groups, Scene
from tests.made_up import make_sequence, make_tracks, same

EVENT = {"kind": "merge", "start": 1, "end": 3, "emitted": None, "before": [-1, 2], "after": [2], "members": [1, 2],
         "pos": [1.5, None]}  # fmt: skip
ORDER = {"id": "m", "kind": "merge", "fired": 2, "before": [[1], [2]], "after": [[1, 2]]}
SCENE = {"format": 1, "size": [16, 10], "walls": [], "pillars": [], "doors": [], "service": [], "stairs": [],
         "wall_height": 2.5, "pillar_height": 2.5}  # fmt: skip


READERS = {
    "events": (read_events, {"format": 1, "events": [EVENT]}),
    "orders": (read_script, {"orders": [ORDER]}),
    "stairs": (read_scene, SCENE),
}
WRONG = {
    "events": [
        [EVENT | change]
        for change in [
            {"pos": [1.5]}, {"pos": ["1", 2]}, {"pos": [1e300, 0]}, {"pos": None}, {"start": 0}, {"start": 1.0},
            {"end": 80_000_000}, {"emitted": -1}, {"before": [-2]}, {"members": [-1]}, {"members": 3}, {"after": "ab"},
            {"kind": []}, {"members": [2**63]}, {"frame": 0}, {"frame": "2"},
        ]
    ],
    "orders": [
        *([ORDER | change] for change in [{"fired": "now"}, {"fired": 0}, {"before": [["1"]]}, {"after": 1}]),
        [ORDER | {"before": [[-1]]}], {"a": 1}, ["m"],
    ],
    "stairs": [{"a": 1}, [1], "none", None, [{"foot": [1], "head": [1, 2]}], [{}]],
}  # fmt: skip


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
def test_values_that_cannot_be(key, value, tmp_path):
    (read, document), path = READERS[key], tmp_path / "a.json"
    path.write_text(json.dumps(document))
    read(path)
    path.write_text(json.dumps(document | {key: value}))
    with pytest.raises(InputError, match=f"{key}|64 bits"):
        read(path)


@pytest.mark.parametrize(
    "line", ["1,3,1,2,1,3,1,2", "1,3,1", "1,3,1,9223372036854775808", "1,3,1,²", "0,3,1,2", "3,1,1,2", "1,3,-1,2"]
)
def test_pairs(line, tmp_path):
    path = tmp_path / "near.csv"
    path.write_text(f"start,end,a,b\n1,3,1,2\n{line}\n1,3,1,2\n")
    with pytest.raises(InputError, match="line 3"):
        read_near(path)


GROUP_ROWS = [
    "1,1,1 -2,,,,2", "1,1,9223372036854775808,,,,", "1,1,1_0,,,,", "²,1,1,,,,", "1,1,1,1e200,0,,", "1,1,1,0,inf,,",
    '1,1,1,0,0,"POLYGON ((1e200 0, 1 1, 0 1))",', "1,1,1,0,0,,-2", "1,1,1,0,0,,inf", '1,1,"1' + "x" * 200_000 + '"',
]  # fmt: skip


@pytest.mark.parametrize("row", GROUP_ROWS)
def test_groups(row, tmp_path):
    path = tmp_path / "groups.csv"
    path.write_text(f"frame,group,members,x,y,hull,size\n2,1,1 2,,,,2\n{row}\n")
    with pytest.raises(InputError) as error:
        read_groups_csv(path, 3)
    assert error.value.place.startswith("line ")


@pytest.mark.parametrize(
    "hull", ["POLYGON (())", "POLYGON EMPTY", "", "POLYGON((0 0, 2 0, 1 1, 0 0))", "POLYGON ((0 0, 2 0, 1 1,))"]
)
def test_hulls_of_other_programs(hull, tmp_path):
    (tmp_path / "groups.csv").write_text(f'frame,group,members,x,y,hull\n1,1,1 2,,,"{hull}"\n')
    same(
        read_groups_csv(tmp_path / "groups.csv", 1)[0].hull,
        (np.array([[0.0, 0], [2, 0], [1, 1]])[: 3 * ("0" in hull)],),
    )


def test_cameras_and_scenes_come_back_exactly(tmp_path):
    down = camera_rotation(np.pi / 2, 0.3)
    top = Camera("top", (640, 480), (1.0, 1.0), (320.0, 240.0), np.array([1.7, -2.3, 20.0]), down, 0.0, 40.3)
    for camera in (top, make_sequence(1).camera):
        (tmp_path / "camera.json").write_text(json.dumps(camera_document(camera)))
        same(camera, read_camera(tmp_path / "camera.json"))
    box = Box(np.array([1.0, 2.0, 0.5]), np.ones(3), 30.0, -5.0, np.array([200.0, 100.0, 0.0]), "checks", 0.2, 0.5)
    boxes = Scene(np.array([3.0, 4.0]), boxes=(box, box))
    for scene in (Scene(np.array([3.0, 4.0])), make_sequence(1).scene, boxes):
        (tmp_path / "scene.json").write_text(json.dumps(scene_document(scene)))
        same(scene, read_scene(tmp_path / "scene.json"))


def test_first_frames_without_groups_know_no_plane():
    """As of a tracker in space, before anybody is there."""
    deep = [with_z(t) for t in make_tracks(1, 6, "space")]
    first = deep[0].keep(np.zeros(len(deep[0].id), bool)).replace(groups=Groups.none())
    assert "groups.parquet" in tracks_files([first, *deep[1:]], fps=10.0)


def with_z(t):
    """The tracks with groups in space."""
    if t.groups is None:
        return t
    pos, vel = (np.pad(a, ((0, 0), (0, 1))) for a in (t.groups.pos, t.groups.vel))
    return t.replace(groups=t.groups.replace(pos=pos, vel=vel))
