import json
from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import sequence_folder
from sim.store.validate import content_hash
from tests.made_up import make_in_view, make_sequence
from tests.recordings import mot_folder
from tracking.export.coco import coco


def test_coco_has_every_box(tmp_path):
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
    seen = [((t.box[:, :2] < (640, 480)) & (t.box[:, :2] + t.box[:, 2:] > 0)).all(axis=1) for t in truths]
    assert [a["id"] for a in found["annotations"]] == list(range(1, sum(map(sum, seen)) + 1))
    rows = [(a["track_id"], a["group_id"]) for a in found["annotations"]]
    assert rows == [pair for t, s in zip(truths, seen, strict=True) for pair in zip(t.id[s], t.group[s], strict=True)]
    images = {i["id"]: i for i in found["images"]}
    for a in found["annotations"]:
        image = images[a["image_id"]]
        assert image["video_id"] == a["video_id"]
        t = truths[a["video_id"] - 1]
        row = t.rows(image["frame"]).start + t.id[t.rows(image["frame"])].tolist().index(a["track_id"])
        assert a["bbox"] == pytest.approx(t.box[row].tolist(), abs=0.006)
        assert a["area"] == pytest.approx(a["bbox"][2] * a["bbox"][3], abs=0.006)
    assert images[1]["width"] == 640


def test_parts_hold_what_one_file_holds(tmp_path):
    for k in range(5):
        stored(tmp_path / f"data/{k}", replace(make_sequence(k), name=f"s{k}"), k)
    whole = coco(tmp_path / "data", tmp_path / "all.json")
    made = coco(tmp_path / "data", tmp_path / "coco.json", part_size=2)
    assert [path.name for path in made.files] == ["coco-0000.json", "coco-0001.json", "coco-0002.json"]
    assert made.counts == whole.counts
    assert not (tmp_path / "coco.json").exists()
    parts, every = ([json.loads(path.read_bytes()) for path in one.files] for one in (made, whole))
    assert [len(part["videos"]) for part in parts] == [2, 2, 1]
    for name in ("videos", "images", "annotations"):
        assert [row for part in parts for row in part[name]] == every[0][name]
    assert len({part["info"]["content_hash"] for part in parts}) == 3
    for part in parts:
        assert part["categories"] == every[0]["categories"]
        assert {a["image_id"] for a in part["annotations"]} <= {i["id"] for i in part["images"]}
    with pytest.raises(InputError, match=r"coco-0001.json: .*at most 1 part"):
        coco(tmp_path / "data", tmp_path / "coco.json", part_size=5)
    with pytest.raises(InputError, match=r"--part-size: got 0"):
        coco(tmp_path / "data", tmp_path / "other.json", part_size=0)


def test_coco_has_sub_groups(tmp_path):
    live = make_sequence(0)
    truth = live.truth.replace(subgroup=np.arange(len(live.truth.id)))
    sequence_folder.write_sequence(
        tmp_path / "a", replace(live, load_truth=lambda: truth), scenario="schema = 1\n", seed=0
    )
    coco(tmp_path / "a", tmp_path / "coco.json")
    found = {a["subgroup_id"]: a["track_id"] for a in json.loads((tmp_path / "coco.json").read_text())["annotations"]}
    assert found
    assert all(truth.id[row] == person for row, person in found.items())


def stored(folder, sequence, seed=1, **options):
    return sequence_folder.write_sequence(folder, sequence, scenario="schema = 1\n", seed=seed, **options)


def labelled_folder(path, rows, *, pictures=(), ini=""):
    """A MOTChallenge folder; pictures: names below it, of 64 × 48 px."""
    shown = dict.fromkeys(pictures, np.zeros((48, 64, 3), np.uint8))
    mot_folder(path, "\n".join(rows), ini=f"name={path.name}\nframeRate=5\n{ini}", pictures=shown)


def test_several_splits_are_refused(tmp_path):
    """By the seeds of generated sequences, wherever they lie."""
    for seed in (1, 2, 20_001):
        stored(tmp_path / f"data/mixed/s{seed}", replace(make_sequence(seed), name=f"s{seed}"), seed)
    with pytest.raises(InputError, match=r"the splits test, train; .*/data/mixed"):
        coco(tmp_path / "data", tmp_path / "all.json")
    assert not (tmp_path / "all.json").exists()


def test_names_of_pictures_of_recordings_resolve(tmp_path):
    """Another folder and file type than usual, numbers from 0; a frame without a picture is no image."""
    pictures = [f"frames/frame_{k:04d}.png" for k in (0, 1, 3)]
    rows = [f"{k},1,{5 * k},5,9,9,1,1,1" for k in (1, 2, 3, 4)]
    labelled_folder(tmp_path / "set/s", rows, pictures=pictures, ini="imDir=frames\nimExt=.png\nseqLength=4\n")
    for source in (tmp_path / "set", tmp_path / "set/s"):
        with pytest.warns(UserWarning, match="pictures 0 to 3 are taken as frames 1 to 4"):
            path = coco(source, tmp_path / "out/c.json").path
        found = json.loads(path.read_text())
        root = path.parent / found["info"]["root"]
        assert root.resolve() == source
        assert [(root / i["file_name"]).name for i in found["images"]] == [name.split("/")[1] for name in pictures]
        assert all((root / i["file_name"]).is_file() for i in found["images"])
        assert [(a["image_id"], a["bbox"][0]) for a in found["annotations"]] == [(1, 5), (2, 10), (3, 20)]
        assert [i["frame"] for i in found["images"]] == [1, 2, 4]
        assert found["images"][0]["width"] == 64


@pytest.mark.filterwarnings("ignore:.*1 pictures? beyond frame 2")
def test_pictures_after_the_last_frame_are_no_images(tmp_path):
    pictures = [f"img1/{k:06d}.png" for k in (1, 2, 3)]
    labelled_folder(tmp_path / "s", ["1,1,5,5,9,9,1,1,1"], pictures=pictures, ini="seqLength=2\n")
    path = coco(tmp_path / "s", tmp_path / "c.json").path
    assert [i["frame"] for i in json.loads(path.read_text())["images"]] == [1, 2]


def test_people_outside_the_picture_are_left_out(tmp_path):
    rows = [
        "1,1,-20,5,20,9,1,1,1", "1,2,64,5,9,9,1,1,1", "1,3,5,48,9,9,1,1,1", "1,4,5,-30,9,29,1,1,1",
        "1,5,-4,40,10,20,1,1,0.3", "1,6,10,10,5,5,1,1,0.1",
    ]  # fmt: skip
    labelled_folder(tmp_path / "s", rows, ini="imWidth=64\nimHeight=48\n")
    path = coco(tmp_path / "s", tmp_path / "c.json").path
    found = json.loads(path.read_text())["annotations"]
    assert [a["track_id"] for a in found] == [5, 6]
    assert found[0]["bbox"] == [-4, 40, 10, 20], "amodal and unclipped, as in gt.txt"
    assert "segmentation" not in found[0], "without ids nobody knows the pixels"


def test_hidden_people_are_ignored_regions(tmp_path):
    rows = [f"1,{k},{9 * k},5,8,9,1,1,{share}" for k, share in ((1, 0.3), (2, 0.2), (3, 0.19), (4, 0))]
    labelled_folder(tmp_path / "s", rows, ini="imWidth=64\nimHeight=48\n")
    for least, crowds in ((0.2, [0, 0, 1, 1]), (0, [0, 0, 0, 0]), (1, [1, 1, 1, 1])):
        made = coco(tmp_path / "s", tmp_path / "c.json", min_visibility=least)
        found = json.loads(made.path.read_text())["annotations"]
        assert [a["iscrowd"] for a in found] == crowds
        assert (made.pictures, made.kept, made.ignored) == (1, crowds.count(0), crowds.count(1))


def decoded(segmentation):
    """The mask of uncompressed run lengths as COCO defines them: down the columns, zeros first."""
    height, width = segmentation["size"]
    counts = segmentation["counts"]
    flat = np.repeat(np.arange(len(counts)) % 2, counts)
    assert len(flat) == height * width
    return flat.reshape(width, height).T.astype(bool)


def test_masks_are_the_visible_pixels(tmp_path):
    live = make_in_view(1, ("left", "ids"))
    stored(tmp_path / live.name, live, streams=("left", "ids"))
    path = coco(tmp_path / live.name, tmp_path / "c.json").path
    found = json.loads(path.read_text())
    frames = {i["id"]: i["frame"] for i in found["images"]}
    assert any(a["area"] > 0 for a in found["annotations"])
    for a in found["annotations"]:
        right = live.load_pixels(frames[a["image_id"]]).ids == a["track_id"]
        assert np.array_equal(decoded(a["segmentation"]), right)
        assert a["area"] == right.sum()
        assert a["iscrowd"] == (a["visibility"] < 0.2 or not right.any())


@pytest.mark.parametrize("everybody", [False, True])
@pytest.mark.parametrize("kind", ["bbox", "segm"])
def test_the_truth_is_a_perfect_detector(tmp_path, kind, everybody, capsys):
    """Also one that reports hidden people."""
    evaluation = pytest.importorskip("pycocotools.cocoeval")
    from pycocotools.coco import COCO

    stored(tmp_path / "s", make_in_view(1, ("left", "ids")), streams=("left", "ids"))
    truth = COCO(coco(tmp_path / "s", tmp_path / "c.json").path)
    seen = [a for a in truth.dataset["annotations"] if a["area"] > 0 and (everybody or not a["iscrowd"])]
    shape = {"bbox": lambda a: a["bbox"], "segm": truth.annToRLE}
    field = {"bbox": "bbox", "segm": "segmentation"}[kind]
    found = [{"image_id": a["image_id"], "category_id": 1, "score": 1.0, field: shape[kind](a)} for a in seen]
    score = evaluation.COCOeval(truth, truth.loadRes(found), kind)
    score.evaluate()
    score.accumulate()
    score.summarize()
    assert score.stats[0] == pytest.approx(1.0)
