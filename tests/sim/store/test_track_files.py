import json

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.body import PERSON_HEIGHT
from sim.store.track_boxes import WIDTH, upright_boxes
from sim.store.track_files import tracks_files, write_tracks
from sim.types import Camera
from tests.made_up import make_tracks, same
from tests.sealing import seal_again
from tracking.recordings.track_texts import read_tracks

# Level, at (0, 0, 1.7), looking along +y: x right, z down, y forward.
LEVEL = Camera(
    "pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([0.0, 0.0, 1.7]),
    np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
)  # fmt: skip


def test_upright_people_on_stairs_are_seen_higher_up():
    from sim.types import Scene, Stairs

    flight = Stairs(np.array([0.0, 9.0]), np.array([0.0, 11.0]), 4.0, 1.0, 4)
    scene = Scene(np.array([20.0, 20.0]), stairs=(flight,))
    live = [t.replace(pos=np.tile([0.0, 10.0], (len(t.id), 1))) for t in make_tracks(1, boxed=False)]
    text = tracks_files(live, fps=10.0, camera=LEVEL, scene=scene)["tracks.txt"].decode().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in text])
    assert rows[:, 9] == pytest.approx(0.5)
    np.testing.assert_allclose(rows[:, 2:6], upright_boxes(LEVEL, np.tile([0.0, 10.0, 0.5], (len(rows), 1))), atol=0.01)


def test_boxes_of_upright_people():
    """At 10 m the horizon cuts the head, feet are 500 * 1.7 / 10 px below, and the width is seen at about 10 m."""
    boxes = upright_boxes(LEVEL, np.array([[0.0, 10.0], [2.0, 20.0], [0.0, -10.0]]))
    left, top, width, height = boxes[0]
    assert top == pytest.approx(240, abs=1e-9)
    assert height == pytest.approx(500 * PERSON_HEIGHT / (10 - WIDTH / 2))
    assert width == pytest.approx(500 * WIDTH / 10, rel=0.01)
    assert left + width / 2 == pytest.approx(320)
    assert boxes[1, 0] > left + width
    assert boxes[1, 3] < height * 0.52
    assert np.isnan(boxes[2]).all(), "behind"
    assert upright_boxes(LEVEL, np.zeros((0, 2))).shape == (0, 4)


def test_a_tracker_without_boxes_gets_them_in_text_only(tmp_path):
    live = [t.replace(pos=t.pos + np.array([0, 10])) for t in make_tracks(2, boxed=False)]
    write_tracks(tmp_path, live, fps=10.0, camera=LEVEL)
    assert json.loads((tmp_path / "run.json").read_text())["boxes"] == "projected"
    assert all(t.box is None for t in read_tracks(tmp_path))
    first = (tmp_path / "tracks.mot.txt").read_text().splitlines()[0].split(",")
    assert float(first[4]) > 0
    assert b"-1,-1,-1,-1" in tracks_files(live, fps=10.0)["tracks.txt"]


@pytest.mark.parametrize("plane", ["ground", "space", "image"])
@pytest.mark.parametrize("unit", ["person", "group"])
@pytest.mark.parametrize("boxed", [True, False])
def test_tracks_come_back_equal(tmp_path, plane, unit, boxed):
    live = make_tracks(1, plane=plane, unit=unit, boxed=boxed)
    write_tracks(tmp_path / "t", live, fps=10.0)
    same(live, read_tracks(tmp_path / "t"))
    same(live, read_tracks(tmp_path / "t" / "tracks.txt"))


def test_no_tracks_at_all(tmp_path):
    write_tracks(tmp_path / "t", [], fps=10.0)
    assert read_tracks(tmp_path / "t") == []
    bare = [t.replace(groups=None, events=()) for t in make_tracks(1)]
    write_tracks(tmp_path / "t", bare, fps=10.0)
    same(bare, read_tracks(tmp_path / "t"))
    assert not (tmp_path / "t" / "groups.csv").exists()


def test_whether_groups_and_events_were_derived_is_kept(tmp_path):
    tracks = make_tracks(1)
    for derived in (True, False):
        write_tracks(tmp_path, [t.replace(derived=derived) for t in tracks], fps=10.0)
        assert {t.derived for t in read_tracks(tmp_path)} == {derived}


def test_what_an_earlier_run_left_goes_away_but_no_more(tmp_path):
    write_tracks(tmp_path / "t", make_tracks(1), fps=10.0)
    (tmp_path / "t" / "mine.txt").write_text("x")
    write_tracks(tmp_path / "t", [t.replace(groups=None) for t in make_tracks(1)], fps=10.0, info={"tracker": "blob"})
    assert not (tmp_path / "t" / "groups.parquet").exists()
    assert (tmp_path / "t" / "mine.txt").exists()
    run = json.loads((tmp_path / "t" / "run.json").read_text())
    kept = {key: run[key] for key in run if key not in ("files", "sha256")}
    assert kept == {"format": 1, "tracker": "blob", "boxes": "measured"}


def test_text_alone(tmp_path):
    live = make_tracks(4)
    files = tracks_files(live, fps=10.0)
    (tmp_path / "tracks.txt").write_bytes(files["tracks.txt"])
    (tmp_path / "groups.csv").write_bytes(files["groups.csv"])
    read = read_tracks(tmp_path, fps=10.0, length=len(live))
    assert len(read) == len(live)
    for a, b in zip(live, read, strict=True):
        order = np.argsort(a.id)
        assert np.array_equal(a.id[order], b.id)
        assert b.plane == "ground"
        np.testing.assert_allclose(a.pos[order], b.pos, atol=6e-4)
        known = a.groups.id if a.groups is not None else []
        assert np.array_equal(known, b.groups.id)


def test_groups_in_a_column_of_a_text_are_the_tracker_s_own(tmp_path):
    (tmp_path / "x.csv").write_text("frame,id,x,y,group\n1,1,0,0,-1\n2,1,0,0,4\n2,2,1,0,4\n")
    first, second = read_tracks(tmp_path / "x.csv")
    assert len(first.groups.id) == 0, "nobody is in a group, which is no reason to derive groups"
    assert second.group.tolist() == [4, 4]


def test_a_text_of_kitti(tmp_path):
    (tmp_path / "0.txt").write_text("0 5 Pedestrian 0 0 -10 10 20 40 60 -1 -1 -1 -1 -1 -1 -10 0.9\n")
    (tracks,) = read_tracks(tmp_path / "0.txt")
    assert (tracks.id.tolist(), tracks.box.tolist()) == ([5], [[10, 20, 30, 40]])


def test_seven_columns_are_boxes_in_the_image(tmp_path):
    (tmp_path / "x.txt").write_text("1,5,10,20,30,40,0.5\n3,5,14,20,30,40,0.5\n")
    first, empty, last = read_tracks(tmp_path / "x.txt", fps=10.0)
    assert (first.plane, len(empty.id)) == ("image", 0)
    assert first.pos.tolist() == [[25, 40]]
    assert last.vel.tolist() == [[20, 0]]
    assert last.score.tolist() == [0.5]


EVENT = '"kind": "merge", "before": [1, 2], "after": [1], "members": [1, 2], "pos": [0, 0]'


@pytest.mark.parametrize("frames", ['"start": 1, "end": 2, "emitted": 99', '"start": 1, "end": 99, "emitted": null'])
def test_events_that_no_frame_can_hold_are_one_line(tmp_path, frames):
    ours, others = write_tracks(tmp_path / "ours", make_tracks(1), fps=10.0), tmp_path / "others"
    others.mkdir()
    (others / "tracks.txt").write_bytes((ours / "tracks.txt").read_bytes())
    for folder in (ours, others):
        (folder / "events.json").write_text(f'{{"format": 1, "events": [{{{EVENT}, {frames}}}]}}')
    seal_again(ours)
    for folder in (ours, others):
        with pytest.raises(InputError) as error:
            read_tracks(folder, fps=10.0, length=9)
        assert error.value.place.startswith("events[0]")


def test_a_text_of_others_with_places_and_boxes(tmp_path):
    """Without a run.json of ours the boxes of a text are what somebody measured."""
    (tmp_path / "tracks.txt").write_text("1,5,10,20,30,40,0.5,1,2,0\n")
    (tmp_path / "run.json").write_text("{}")
    (only,) = read_tracks(tmp_path, fps=10.0)
    assert (only.plane, only.pos.tolist(), only.box.tolist()) == ("ground", [[1, 2]], [[10, 20, 30, 40]])


def test_one_unknown_place_moves_nobody_to_the_image(tmp_path):
    (tmp_path / "x.txt").write_text("1,5,10,20,30,40,0.5,1,2,0\n2,5,10,20,30,40,0.5,1,2,-1\n")
    with pytest.raises(InputError, match="z other than -1") as error:
        read_tracks(tmp_path / "x.txt", fps=10.0)
    assert error.value.place == "line 2"


def test_a_text_without_a_row(tmp_path):
    (tmp_path / "x.txt").write_text("\n")
    with pytest.raises(InputError, match="no row"):
        read_tracks(tmp_path / "x.txt", fps=10.0)
    with pytest.warns(UserWarning, match="no row"):
        assert len(read_tracks(tmp_path / "x.txt", fps=10.0, length=3)) == 3


def test_nothing_there(tmp_path):
    with pytest.raises(InputError, match="no tracks"):
        read_tracks(tmp_path)
    (tmp_path / "tracks.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match="incomplete"):
        read_tracks(tmp_path)
    (tmp_path / "tracks.parquet").unlink()
    write_tracks(tmp_path, [], fps=10.0)
    (tmp_path / "tracks.parquet").write_bytes(b"PAR1")
    seal_again(tmp_path)
    with pytest.raises(InputError, match="Parquet"):
        read_tracks(tmp_path)
