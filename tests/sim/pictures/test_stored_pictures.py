import json
from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim import streams
from sim.hashing import file_hash
from sim.store import sequence_folder
from sim.store.seal import with_hash
from sim.store.validate import validate
from tests.made_up import make_pictured, same
from tracking.recordings.source import open_source

SCENARIO = 'schema = 1\nname = "fake"\n'
ALL = ("left", "right", "disparity", "ids", "background")


def stored(folder, sequence, wanted=ALL, images="jpg"):
    sequence_folder.write_sequence(folder, sequence, scenario=SCENARIO, seed=3, streams=wanted, images=images)
    return open_source(folder)[0]


def manifest(folder):
    return json.loads((folder / "manifest.json").read_text())


def names(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_png_comes_back_exactly(tmp_path):
    live = make_pictured(3, ALL)
    read = stored(tmp_path / "a", live, images="png")
    same(live, read)
    same(list(live), list(read))
    same(list(read), list(read))
    same(live.background(), read.background())
    for index in range(1, live.length + 1):
        same(live.load_pixels(index), read.load_pixels(index))
        same(live.frame_truth(index), read.frame_truth(index))
    assert [f.image for f in read.without_pictures()] == [None] * 12
    assert (read.has_images, read.has_right) == (True, True)
    assert validate(tmp_path / "a") == []


@pytest.mark.parametrize(("images", "off"), [("jpg", 4.0), ("mp4", 12.0)])
def test_jpg_and_mp4_come_back_nearly(tmp_path, images, off):
    live = make_pictured(3, ALL)
    read = stored(tmp_path / "a", live, images=images)
    for a, b in zip(live, read, strict=True):
        assert np.abs(a.image.astype(int) - b.image).mean() < off
        assert np.abs(a.right.astype(int) - b.right).mean() < off
        same(a.detections, b.detections)
    assert np.abs(live.background().astype(int) - read.background()).mean() < off
    assert read.background().shape == (50, 48, 64, 3)
    same(live.load_pixels(7), read.load_pixels(7))
    assert validate(tmp_path / "a") == []


def test_where_pictures_lie(tmp_path):
    live = make_pictured(3, ALL)
    stored(tmp_path / "jpg", live)
    found = names(tmp_path / "jpg")
    for folder, kind, count in (
        ("img1", "jpg", 12), ("img1_right", "jpg", 12), ("disparity", "png", 12), ("ids", "png", 12),
        ("background", "jpg", 50),
    ):  # fmt: skip
        assert [n for n in found if n.startswith(f"{folder}/")] == [
            f"{folder}/{k:06d}.{kind}" for k in range(1, count + 1)
        ]
    assert "imExt=.jpg" in (tmp_path / "jpg/seqinfo.ini").read_text()
    stored(tmp_path / "png", live, ("left",), "png")
    assert "imExt=.png" in (tmp_path / "png/seqinfo.ini").read_text()
    stored(tmp_path / "mp4", live, images="mp4")
    assert [n for n in names(tmp_path / "mp4") if n.endswith(".mp4")] == ["background.mp4", "left.mp4", "right.mp4"]
    assert manifest(tmp_path / "mp4")["images"] == "mp4"
    assert manifest(tmp_path / "png")["streams"] == ["left", "background"]


def test_codes_there_and_back():
    ids = np.array([[0, 1, 999], [-2, 2, 0]])
    assert np.array_equal(streams.decode_ids(streams.encode_ids(ids)), ids)
    with pytest.raises(WorkError, match="person 1000"):
        streams.encode_ids(np.array([[1000]]))
    d = np.array([[np.nan, 1e-6, 0.5, 100.01, 255.998]])
    assert streams.encode_disparity(d)[0].tolist() == [0, 1, 128, 25603, 65535]
    assert streams.decode_disparity(streams.encode_disparity(d))[0] == pytest.approx(d[0], abs=1 / 256, nan_ok=True)
    with pytest.raises(WorkError, match="256 px"):
        streams.encode_disparity(np.array([[256.0]]))


def test_one_content_however_it_is_stored(tmp_path):
    """The content hash and the pixels' hashes are of what was drawn; truth_hash does not know of pictures."""
    seen = {}
    for images in ("jpg", "png", "mp4"):
        stored(tmp_path / images, make_pictured(3, ALL), images=images)
        seen[images] = manifest(tmp_path / images)
    for key in ("truth_hash", "content_hash", "pixels"):
        assert seen["jpg"][key] == seen["png"][key] == seen["mp4"][key]
    assert list(seen["jpg"]["pixels"]) == list(ALL)
    stored(tmp_path / "none", make_pictured(3, ()), ())
    bare = manifest(tmp_path / "none")
    assert (bare["streams"], bare["images"], bare["pixels"]) == ([], None, {})
    assert bare["truth_hash"] == seen["jpg"]["truth_hash"]
    assert bare["content_hash"] != seen["jpg"]["content_hash"]
    other = make_pictured(3, ALL)
    dark = replace(other, frames=lambda: (f.replace(image=f.image // 2) for f in make_pictured(3, ALL)))
    stored(tmp_path / "dark", dark)
    assert manifest(tmp_path / "dark")["content_hash"] != seen["jpg"]["content_hash"]
    assert manifest(tmp_path / "dark")["pixels"]["right"] == seen["jpg"]["pixels"]["right"]


@pytest.mark.parametrize("images", ["jpg", "png", "mp4"])
def test_pictures_are_checked_when_they_are_read(tmp_path, images):
    stored(tmp_path / "a", make_pictured(3, ALL), images=images)
    every = names(tmp_path / "a")
    for name in [n for n in every if n.endswith(("left.mp4", "img1/000005.jpg", "img1/000005.png"))]:
        path = tmp_path / "a" / name
        whole = path.read_bytes()
        path.write_bytes(whole[:-9] + bytes(9))
        (sequence,) = open_source(tmp_path / "a")
        with pytest.raises(InputError, match="altered") as error:
            list(sequence)
        assert error.value.file == str(path)
        assert [p.file for p in validate(tmp_path / "a")] == [str(path)]
        for body in (whole[:-9], None):
            path.write_bytes(body) if body else path.unlink()
            with pytest.raises(InputError, match="truncated" if body else "missing"):
                open_source(tmp_path / "a")
        path.write_bytes(whole)
    assert validate(tmp_path / "a") == []


IMPOSSIBLE = [
    ({}, ("right",), "jpg", "right"), ({}, ("right",), "mp4", "right"), ({}, ("disparity",), "jpg", "disparity"),
    ({"load_background": None}, ("left",), "mp4", "background"),
    ({"image_size": (65, 48)}, ("left",), "mp4", "even width"),
    ({}, ("top",), "jpg", "--streams"), ({}, ("left",), "gif", "--images"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "wanted", "images", "words"), IMPOSSIBLE)
def test_streams_that_are_not_there(tmp_path, changes, wanted, images, words):
    with pytest.raises(InputError, match=words):
        stored(tmp_path / "a", replace(make_pictured(3, ("left", "background")), **changes), wanted, images)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("images", ["jpg", "mp4"])
def test_a_renderer_that_fails_leaves_nothing(tmp_path, images):
    live = make_pictured(3, ALL)

    def failing():
        for frame in live:
            if frame.index == 7:
                raise RuntimeError("no paint")
            yield frame

    with pytest.raises(RuntimeError, match="no paint"):
        stored(tmp_path / "a", replace(live, frames=failing), images=images)
    assert list(tmp_path.iterdir()) == []


def test_another_sample_than_its_own(tmp_path):
    live = make_pictured(3, ("left",))
    own = stored(tmp_path / "a", live, ("left",), "png")
    assert own.source["background"] == "50 empty frames before frame 1"
    (read,) = open_source(tmp_path / "a", background="first:3")
    assert read.source["background"] == "first 3 frames (causal from frame 3)"
    assert np.array_equal(read.background(), np.stack([f.image for f in live][:3]))
    stored(tmp_path / "m", live, ("left",), "mp4")
    (read,) = open_source(tmp_path / "m", background="spread:4")
    every = [f.image for f in read]
    assert np.array_equal(read.background(), np.stack([every[k - 1] for k in (2, 5, 8, 11)]))
    with pytest.raises(InputError, match="recording of 12 frames"):
        open_source(tmp_path / "a", background="first:13")
    stored(tmp_path / "none", make_pictured(3, ()), ())
    with pytest.raises(InputError, match="without pictures"):
        open_source(tmp_path / "none", background="first:3")


def relisted(folder, change):
    """The manifest with another list of files or other facts, its hash computed anew."""
    whole = manifest(folder)
    change(whole)
    (folder / "manifest.json").write_text(json.dumps(with_hash(whole)))


@pytest.mark.parametrize("images", ["jpg", "png", "mp4"])
def test_reading_counts_and_measures(tmp_path, images):
    def refused(words):
        with pytest.raises(InputError, match=words):
            (open_source(folder)[0].background(), list(open_source(folder)[0]))

    folder = tmp_path / "a"
    stored(folder, make_pictured(3, ("left",)), ("left",), images)
    relisted(folder, lambda m: m["sequence"].update(image_size=[32, 48]))
    refused("64×48")
    relisted(folder, lambda m: m["sequence"].update(image_size=[64, 48]))
    assert validate(folder) == []
    if images == "mp4":
        movie = folder / "background.mp4"
        movie.write_bytes((folder / "left.mp4").read_bytes())
        facts = {"sha256": file_hash(movie.read_bytes()), "bytes": movie.stat().st_size}
        relisted(folder, lambda m: m["files"].update({"background.mp4": facts}))
        refused("12 pictures")
    else:
        name = f"img1/000012.{images}"
        (folder / name).unlink()
        relisted(folder, lambda m: m["files"].pop(name))
        refused(name)
