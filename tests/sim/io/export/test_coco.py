import json
from dataclasses import replace

import pytest

from scenarios.errors import InputError
from sim.io.export.coco import coco
from sim.io.store import sequence_folder
from sim.io.store.validate import content_hash


def test_coco_has_every_box(tmp_path, make_sequence):
    for k, name in enumerate(("a", "b")):
        live = replace(make_sequence(k), name=name)
        sequence_folder.write_sequence(tmp_path / "data" / name, live, scenario="schema = 1\n", seed=k)
    coco(tmp_path / "data", tmp_path / "coco.json")
    first = (tmp_path / "coco.json").read_bytes()
    coco(tmp_path / "data", tmp_path / "coco.json")
    assert (tmp_path / "coco.json").read_bytes() == first
    found = json.loads(first)
    truths = [make_sequence(k).truth for k in (0, 1)]
    assert [c["name"] for c in found["categories"]] == ["person"]
    assert found["info"]["content_hash"] == content_hash(tmp_path / "data")
    assert [i["id"] for i in found["images"]] == list(range(1, 25))
    assert [a["id"] for a in found["annotations"]] == list(range(1, sum(len(t.id) for t in truths) + 1))
    assert [a["track_id"] for a in found["annotations"]] == [i for t in truths for i in t.id.tolist()]
    assert [a["group_id"] for a in found["annotations"]] == [g for t in truths for g in t.group.tolist()]
    images = {i["id"]: i for i in found["images"]}
    for a in found["annotations"]:
        image = images[a["image_id"]]
        assert image["video_id"] == a["video_id"]
        t = truths[a["video_id"] - 1]
        row = t.rows(image["frame"]).start + t.id[t.rows(image["frame"])].tolist().index(a["track_id"])
        assert a["bbox"] == pytest.approx(t.box[row].tolist(), abs=0.006)
        assert a["area"] == pytest.approx(a["bbox"][2] * a["bbox"][3], abs=0.006)
    assert images[1]["width"] == 640


def test_nothing_to_export(tmp_path):
    (tmp_path / "a.txt").write_text("1,-1,0,0,4,6,1,-1,-1,-1\n")
    with pytest.warns(UserWarning, match="25 fps"), pytest.raises(InputError, match="no labelled boxes"):
        coco(tmp_path / "a.txt", tmp_path / "coco.json")
    assert not (tmp_path / "coco.json").exists()


@pytest.mark.parametrize(
    ("images", "name"), [("jpg", "img1/000002.jpg"), ("png", "img1/000002.png"), ("mp4", "left.mp4")]
)
def test_coco_names_the_pictures_that_are_there(tmp_path, make_pictured, images, name):
    live = make_pictured(1, ("left",))
    folder = tmp_path / "data" / live.name
    sequence_folder.write_sequence(folder, live, scenario="schema = 1\n", seed=1, streams=("left",), images=images)
    coco(tmp_path / "data", tmp_path / "coco.json")
    image = json.loads((tmp_path / "coco.json").read_text())["images"][1]
    assert (image["file_name"], image["frame"]) == (f"{live.name}/{name}", 2)
    assert (tmp_path / "data" / image["file_name"]).is_file()


def test_the_way_to_a_dataset_is_no_part_of_its_names(tmp_path, make_sequence):
    """The content hash is by <split>/<name>: the same from a path with `..` in it."""
    live = replace(make_sequence(1), name="a")
    sequence_folder.write_sequence(tmp_path / "train" / "a", live, scenario="schema = 1\n", seed=1)
    assert content_hash(tmp_path / "train" / "a" / "..") == content_hash(tmp_path / "train")
