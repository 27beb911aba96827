import struct
import warnings
import zlib

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.pictures import picture_folder as pictures
from sim.pictures.background_sample import BackgroundChoice, parse_choice, with_copies
from sim.pictures.picture_folder import declared_size, read_picture
from tests.recordings import mot_folder
from tests.small_videos import SIZE, picture
from tracking.recordings.source import open_source


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif"])
@pytest.mark.parametrize("shape", [(48, 64, 3), (5, 7), (1, 300, 3)])
def test_headers(suffix, shape):
    image = np.random.default_rng(0).integers(0, 255, shape, np.uint8)
    body = cv2.imencode(f".{suffix}", image)[1].tobytes()
    assert declared_size(body) == (shape[1], shape[0])
    for cut in range(0, min(len(body), 200), 7):
        declared_size(body[:cut])


def bomb(side):
    """A PNG of some hundred bytes that declares side × side px, with too little in it."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")
    )


def test_a_bomb_is_no_readable_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was decoded"))
    (tmp_path / "b.png").write_bytes(bomb(30_000))
    assert read_picture(tmp_path / "b.png") is None


def test_samples_of_large_pictures(tmp_path):
    small, large = (1920, 1080), (7680, 4320)
    assert BackgroundChoice().of(1000, tmp_path, small).count == 50
    assert BackgroundChoice().of(1000, tmp_path, large).count == 20
    assert BackgroundChoice().of(7, tmp_path, large).count == 7
    assert parse_choice("first:20").of(1000, tmp_path, large).count == 20
    with pytest.raises(InputError, match="ask for 20 or fewer"):
        parse_choice("first:21").of(1000, tmp_path, large)
    with pytest.raises(InputError, match="a recording of 7 frames"):
        parse_choice("first:21").of(7, tmp_path, small)


ROWS = "1,1,10,10,8,16,1,-1,-1,-1\n9,1,10,10,8,16,1,-1,-1,-1\n"


def folder(tmp_path, names, *, gt="", det="", ini="", size=SIZE):
    """A MOTChallenge folder whose k-th picture shows disc k."""
    (tmp_path / "img1").mkdir(parents=True)
    shown = {f"img1/{name}": picture(k, size) for k, name in enumerate(names)}
    return mot_folder(tmp_path, gt or None, det or None, f"frameRate=10\n{ini}", shown)


def shown(path, **options):
    """Number of the picture that each frame shows, None for lost ones."""
    (sequence,) = open_source(path, images=True, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frames = list(sequence)
    assert [f.index for f in frames] == list(range(1, sequence.length + 1))
    every = {k: picture(k) for k in range(30)}
    pictures = [f.image for f in frames]
    return [None if p is None else min(every, key=lambda k: np.abs(every[k].astype(int) - p).mean()) for p in pictures]


NUMBERED = [
    (["000001.jpg", "000002.jpg", "000003.jpg"], {}, [0, 1, 2]),
    (["000001.png", "000002.jpg", "000004.png"], {"gt": ROWS}, [0, 1, None, 2, None, None, None, None, None]),
    (["000001.jpg", "000003.jpg"], {"ini": "seqLength=4\n"}, [0, None, 1, None]),
    (["000000.jpg", "000001.jpg", "000003.jpg"], {}, [0, 1, None, 2]),
    (["000000.jpg", "000001.jpg", "000002.jpg"], {"ini": "seqLength=3\n"}, [0, 1, 2]),
    (["in000470.jpg", "in000471.jpg", "in000473.jpg"], {}, [0, 1, None, 2]),
    (["000500.jpg", "000501.jpg", "000502.jpg"], {"ini": "seqLength=3\n"}, [0, 1, 2]),
    (["000003.jpg", "000004.jpg"], {"det": ROWS.replace(",1,", ",-1,", 1)}, [None, None, 0, 1, *[None] * 5]),
    (["9.jpg", "10.jpg", "11.jpg"], {}, [0, 1, 2]),
    (["000004.jpg", "000010.jpg", "000022.jpg"], {}, [0, *[None] * 5, 1, *[None] * 11, 2]),
    (["a.jpg", "b.jpg", "c.jpg"], {}, [0, 1, 2]),
    (["a1.jpg", "b1.jpg", "c7.jpg"], {}, [0, 1, 2]),
    (["1600000000100.jpg", "1600000000200.jpg", "1600000000900.jpg"], {}, [0, 1, 2]),
]


@pytest.mark.parametrize(("names", "more", "right"), NUMBERED)
def test_pictures_are_frames_by_their_numbers(tmp_path, names, more, right):
    assert shown(folder(tmp_path / "a", names, **more)) == right


def test_every_nth_picture_is_counted_in_order(tmp_path):
    path = folder(tmp_path / "a", names(range(1, 14, 6)))
    with pytest.warns(UserWarning, match="1 to 13 in steps of 6 are taken as frames 1 to 3; --fps is that of these"):
        assert shown(path) == [0, 1, 2]
    alike = folder(tmp_path / "b", names(range(1, 14, 6)), det=rows(1, 7, 13))
    assert shown(alike) == [0, *[None] * 5, 1, *[None] * 5, 2]


def test_two_pictures_of_a_frame_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"000001.jpg and 000001.png"):
        open_source(folder(tmp_path / "a", ["000001.jpg", "000001.png"]))


def rows(*frames):
    return "".join(f"{frame},1,10,10,8,16,1,-1,-1,-1\n" for frame in frames)


def names(numbers):
    return [f"{k:06d}.jpg" for k in numbers]


LABELLED = [
    (names(range(4)), range(1, 5), "", [0, 1, 2, 3], "0 to 3 are taken as frames 1 to 4"),
    (names(range(7, 10)), range(1, 4), "", [0, 1, 2], "7 to 9 are taken as frames 1 to 3"),
    (names(range(7, 10)), range(1, 3), "seqLength=3\n", [0, 1, 2], "7 to 9 are taken as frames 1 to 3"),
    (names(range(0, 40, 10)), range(1, 5), "", [0, 1, 2, 3], "0 to 30 in steps of 10"),
    (names(range(2, 5)), (2, 4), "", [None, 0, 1, 2], ""),
    (names(range(2, 9, 2)), (2, 6), "", [None, 0, None, 1, None, 2, None, 3], ""),
    (names(range(1, 5)), (2,), "", [0, 1, 2, 3], ""),
    (["b.jpg", "a.jpg"], (1, 2), "", [1, 0], "in the order of their names"),
    (["1_left.jpg", "2_left.jpg", "10_left.jpg"], (1, 10), "", [0, 1, *[None] * 7, 2], ""),
    (["cam2_0001_rgb.jpg", "cam2_0002_rgb.jpg"], (1, 2), "", [0, 1], ""),
    (names(range(0, 40, 10)), (), "seqLength=4\n", [0, 1, 2, 3], ""),
]


@pytest.mark.parametrize(("files", "frames", "ini", "right", "said"), LABELLED)
def test_labelled_frames_decide_which_frame_a_picture_is(tmp_path, files, frames, ini, right, said):
    path = folder(tmp_path / "a", files, gt=rows(*frames), ini=ini)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        open_source(path)
    assert [said in str(w.message) for w in found] == [True] * bool(said)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert shown(path) == right


SHIFTED = [
    (names(range(5)), range(1, 5), "", "5 pictures numbered 0 to 4, and labels of frames 1 to 4"),
    (names(range(5)), range(1, 5), "seqLength=5\n", "5 pictures numbered 0 to 4"),
    (names(range(5, 20)), range(1, 9), "", "15 pictures numbered 5 to 19, and labels of frames 1 to 8"),
    (names(range(50, 60)), range(1, 30), "", "10 pictures numbered 50 to 59"),
    (names((1, 2, 4, 7)), range(1, 5), "", "4 pictures numbered 1 to 7, and labels of frames 1 to 4"),
    (names((1, 2, 9)), (), "seqLength=4\n", "000009.jpg among 3 pictures"),
    ([*names((1, 2)), "000001 (1).jpg"], (1, 2), "", r"000001 \(1\).jpg beside 000001.jpg"),
    ([*names((1, 2)), "000001 copy.jpg", "x.jpg"], (), "", "000001 copy.jpg and 1 more beside 000001.jpg"),
]


@pytest.mark.parametrize(("files", "frames", "ini", "got"), SHIFTED)
def test_pictures_that_may_be_shifted_against_labels_are_refused(tmp_path, files, frames, ini, got):
    with pytest.raises(InputError, match=got):
        open_source(folder(tmp_path / "a", files, gt=rows(*frames), ini=ini))


def test_side_files_are_ignored(tmp_path):
    """Files of macOS, Windows and network disks: beside pictures, sequences, videos and their folders."""
    path = folder(tmp_path / "data/a", names(range(1, 4)), gt=rows(1, 2, 3))
    for name in ("._000001.jpg", "Thumbs.db", ".DS_Store"):
        (path / "img1" / name).write_bytes(b"\0\5\x16\7")
    for inside in ("__MACOSX/a/img1", "@eaDir/img1"):
        (tmp_path / "data" / inside).mkdir(parents=True)
        (tmp_path / "data" / inside / "000001.jpg").write_bytes(b"")
    (tmp_path / "data/._a.mp4").write_bytes(b"")
    assert [s.name for s in open_source(tmp_path / "data")] == ["a"]
    assert shown(path) == [0, 1, 2]


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_a_lost_picture_is_told_once(tmp_path, capfd, suffix):
    """By us alone: libraries do not grumble on stderr."""
    path = folder(tmp_path / "a", [f"{k:06d}{suffix}" for k in range(1, 9)])
    (path / f"img1/000003{suffix}").unlink()
    (path / f"img1/000005{suffix}").write_bytes((path / f"img1/000005{suffix}").read_bytes()[:400])
    (path / f"img1/000006{suffix}").write_bytes(b"no picture")
    (path / f"img1/000008{suffix}").write_bytes(b"")
    (sequence,) = open_source(path, images=True)
    with pytest.warns(UserWarning, match="frame 3 has no readable picture") as told:
        frames = list(sequence)
    assert len(told) == 1
    assert [f.index for f in frames if f.image is None] == [3, 5, 6, 8]
    assert capfd.readouterr().err == ""


def test_a_dead_link_is_a_lost_frame(tmp_path):
    path = folder(tmp_path / "a", ["a.png", "b.png", "c.png"])
    (path / "img1/b.png").unlink()
    (path / "img1/b.png").symlink_to(tmp_path / "nowhere")
    assert shown(path) == [0, None, 2]


def test_pictures_cost_nothing_where_nobody_asks(tmp_path, monkeypatch):
    path = folder(tmp_path / "a", ["000001.jpg", "000002.jpg"], ini="imWidth=96\nimHeight=64\n")
    monkeypatch.setattr(pictures, "read_picture", None)
    (sequence,) = open_source(path, images=False)
    assert not sequence.has_images
    assert [f.image for f in sequence] == [None, None]
    assert sequence.image_size == SIZE


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".tif"])
def test_grey_16_bit_and_transparent_pictures(tmp_path, suffix):
    image = picture(3)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    kinds = [grey]
    if suffix in (".png", ".tif"):
        kinds += [grey.astype(np.uint16) * 257, image.astype(np.uint16) * 257]
    if suffix == ".png":
        kinds.append(np.dstack([image, np.full(grey.shape, 9, np.uint8)]))
    for kind in kinds:
        path = tmp_path / f"a{suffix}"
        cv2.imwrite(str(path), kind)
        read = read_picture(path)
        assert (read.shape, read.dtype) == ((SIZE[1], SIZE[0], 3), np.uint8)
        right = np.dstack([grey] * 3) if kind.ndim == 2 else image
        assert np.abs(read.astype(int) - right).mean() <= (1 if suffix == ".jpg" else 0)


def test_another_size_is_one_line(tmp_path):
    path = folder(tmp_path / "a", [f"{k:06d}.jpg" for k in range(1, 5)])
    cv2.imwrite(str(path / "img1/000003.jpg"), picture(0, (48, 32)))
    (sequence,) = open_source(path, images=True)
    assert sequence.image_size == open_source(path, images=False)[0].image_size == SIZE
    with pytest.raises(InputError, match=r"000003.jpg: got 48×32 px; expected 96×64 px"):
        list(sequence)
    (path / "seqinfo.ini").write_text("[Sequence]\nframeRate=10\nimWidth=960\nimHeight=640\n")
    with pytest.raises(InputError, match=r"seqinfo.ini: imWidth, imHeight: got 960 × 640"):
        open_source(path, images=True)
    assert open_source(path, images=False)[0].image_size == (960, 640)


def test_no_picture_that_can_be_read_is_one_line(tmp_path):
    path = folder(tmp_path / "a", ["000001.jpg", "000002.jpg"])
    for name in ("000001.jpg", "000002.jpg"):
        (path / "img1" / name).write_text("version https://git-lfs.github.com/spec/v1\n")
    (sequence,) = open_source(path, images=True)
    for reading in (lambda: list(sequence), sequence.background):
        with pytest.raises(InputError, match=r"2 pictures, none of which can be read"):
            reading()
    assert len(list(sequence.without_pictures())) == 2


def test_a_folder_without_pictures(tmp_path):
    path = folder(tmp_path / "a", [], gt=ROWS)
    (sequence,) = open_source(path, images=True)
    assert not sequence.has_images
    assert sequence.background() is None
    assert [f.image for f in sequence] == [None] * 9
    with pytest.raises(InputError, match="without pictures"):
        open_source(path, images=True, background="first:3")
    (tmp_path / "a.txt").write_text(ROWS)
    with pytest.raises(InputError, match="--background"):
        open_source(tmp_path / "a.txt", background="first:3")


def test_the_sample_of_a_folder(tmp_path):
    path = folder(tmp_path / "a", [f"{k:06d}.png" for k in range(1, 13)])
    (path / "img1/000002.png").unlink()
    (sequence,) = open_source(path, images=True, background="first:3")
    assert sequence.source["background"] == "first 3 frames (causal from frame 3)"
    assert np.array_equal(sequence.background(), np.stack([picture(0), picture(2)]))
    (sequence,) = open_source(path, background="spread:3")
    assert np.array_equal(sequence.background(), np.stack([picture(k) for k in (2, 6, 10)]))
    (sequence,) = open_source(path, images=True)
    assert len(sequence.background()) == 11
    with pytest.raises(InputError, match="recording of 12 frames"):
        open_source(path, images=True, background="spread:13")


def test_more_pictures_than_frames_are_told(tmp_path):
    path = folder(tmp_path / "a", names(range(1, 6)), ini="seqLength=3\n")
    with pytest.warns(UserWarning, match=r"2 pictures beyond frame 3 \(seqLength\) are not read"):
        open_source(path)


def test_an_empty_picture_has_the_majority_of_a_sample():
    sample = np.zeros((5, 4, 6, 3), np.uint8)
    whole = with_copies(sample, np.full((4, 6, 3), 9, np.uint8))
    assert len(whole) == 11
    assert (np.median(whole, axis=0) == 9).all()
    assert not whole[:5].any()
