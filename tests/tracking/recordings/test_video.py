import warnings
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.pictures import video_files
from sim.store.own_files import GENERATOR, is_ours
from sim.types import Camera
from tests.small_videos import SIZE, cut, damage, disc, picture, write_jpegs, write_video
from tracking.recordings.source import open_source

KINDS = {
    "x264.mp4": {}, "long-groups.mp4": {"options": {"g": "250", "bf": "3"}}, "h264-in.avi": {},
    "mpeg4.avi": {"codec": "mpeg4"}, "jpegs.avi": {"codec": "mjpeg", "pix_fmt": "yuvj420p"},
    "mpeg2.mpg": {"codec": "mpeg2video", "rate": 25}, "transport.ts": {"rate": 25}, "bare.h264": {"rate": 25},
    "bare.y4m": {"codec": "wrapped_avframe"}, "media.wmv": {"codec": "wmv2"}, "vp9.webm": {"codec": "libvpx-vp9"},
    "vp8.webm": {"codec": "libvpx"}, "quick.mov": {"audio": True}, "grey.mkv": {"codec": "ffv1", "pix_fmt": "gray"},
    "10-bit.mkv": {"codec": "ffv1", "pix_fmt": "yuv420p10le"},
}  # fmt: skip


def one(path, **options):
    (sequence,) = open_source(path, **options)
    return sequence


@pytest.mark.parametrize("name", KINDS)
def test_every_frame_in_its_place(tmp_path, name):
    more = dict(KINDS[name])
    sequence = one(write_video(tmp_path / name, [picture(k) for k in range(2, 22)], **more))
    assert (sequence.image_size, sequence.fps) == (SIZE, more.get("rate", 10))
    assert sequence.length == 20
    for _ in range(2):
        frames = list(sequence)
        assert [f.index for f in frames] == list(range(1, 21))
        assert [f.t for f in frames] == pytest.approx([k / sequence.fps for k in range(20)])
        assert all(f.image.shape == (SIZE[1], SIZE[0], 3) and f.image.dtype == np.uint8 for f in frames)
        assert [disc(f.image) for f in frames] == pytest.approx([disc(picture(k)) for k in range(2, 22)], abs=1.0)
        assert np.abs(frames[9].image.astype(int) - picture(11)).mean() < 8
    assert sequence.has_images
    assert not sequence.has_right
    assert sequence.truth is None
    assert [(f.index, f.image) for f in sequence.without_pictures()] == [(k, None) for k in range(1, 21)]


def test_rotation_is_undone(tmp_path):
    for degrees in (90, 180):
        path = write_video(tmp_path / f"{degrees}.mp4", [picture(k) for k in range(3)], rotation=degrees)
        sequence = one(path)
        assert sequence.image_size == (SIZE if degrees == 180 else SIZE[::-1])
        other = cv2.VideoCapture(str(path)).read()[1]
        off = np.abs(next(iter(sequence)).image.astype(int) - other).mean()
        assert off < 2, "OpenCV's reader is a grey level darker"
        assert np.abs(next(iter(sequence)).image[::-1, ::-1].astype(int) - other).mean() > 5


ODD_NAMES = (
    "12:30:05", "%03d", "-i", "~", "a#b?c=d&e", "zwei Wörter", "pipe:0", "concat:a|b", "file:x",
    "'quoted'", "back\\slash",
)  # fmt: skip


@pytest.mark.parametrize("name", ODD_NAMES)
def test_a_video_may_have_any_name(tmp_path, monkeypatch, name):
    """Relative, as it is given where it lies, and also as the video that is written."""
    source = write_video(tmp_path / "a.mp4", [picture(k) for k in range(2, 6)])
    monkeypatch.chdir(tmp_path)
    source.rename(f"{name}.mp4")
    sequence = one(f"{name}.mp4")
    assert (sequence.name, sequence.length, len(list(sequence))) == (name, 4, 4)
    with video_files.write_video(Path(f"{name}.out.mp4"), SIZE, 10, comment=GENERATOR) as video:
        video.add(picture(2))
    assert is_ours(Path(f"{name}.out.mp4"))


def test_frames_before_a_cut_without_decoding(tmp_path):
    """A cut by stream copy keeps the packets from the key frame before it, which the edit list leaves out."""
    whole = write_video(tmp_path / "whole.mp4", [picture(k) for k in range(1, 41)], options={"g": "10", "bf": "0"})
    with av.open(str(whole)) as source, av.open(
        str(tmp_path / "cut.mp4"), "w", options={"avoid_negative_ts": "disabled"}
    ) as cut_out:  # fmt: skip
        stream = cut_out.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.size:
                shift = round(0.7 / packet.time_base)  # frames 1 to 7 lie before 0
                packet.pts, packet.dts, packet.stream = packet.pts - shift, packet.dts - shift, stream
                cut_out.mux(packet)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sequence = one(tmp_path / "cut.mp4")
    assert sequence.length == 33
    seen = [round(disc(frame.image) / 4) for frame in sequence]
    assert seen[:12] == list(range(8, 20))
    wanted = [1, 3, 4, 14, 33]
    index = video_files.index_packets(tmp_path / "cut.mp4")
    found = dict(video_files.decode_frames(tmp_path / "cut.mp4", index, wanted))
    assert [(k, round(disc(found[k]) / 4)) for k in found] == [(k, seen[k - 1]) for k in wanted]


WRONG_RATES = [
    ("a.mkv", {"stamps": [100 * k for k in range(20)], "rate": 1000}, 10.0, "10 by its time stamps"),
    ("b.mp4", {"stamps": [40 * k for k in range(20)], "rate": 1000}, 25.0, "25 by its time stamps"),
    ("c.mkv", {"stamps": [round(k * 1000 / 29.97) for k in range(20)], "rate": 90}, 29.97, "by its time stamps"),
    ("d.avi", {"codec": "mjpeg", "pix_fmt": "yuvj420p", "rate": 1000}, 25.0, "25 .the container says 1000"),
]


@pytest.mark.parametrize(("name", "more", "rate", "said"), WRONG_RATES)
def test_a_container_that_lies_about_its_rate(tmp_path, name, more, rate, said):
    path = write_video(tmp_path / name, [picture(k) for k in range(20)], **more)
    with pytest.warns(UserWarning, match=said):
        sequence = one(path)
    assert sequence.fps == pytest.approx(rate, abs=0.06)
    given = one(path, fps=12.5)
    assert (given.fps, given.source["fps"]) == (12.5, "12.5, as given")
    assert next(f for f in given if f.index == 3).t == pytest.approx(2 / 12.5)


def test_what_cannot_be_decoded_is_a_lost_frame(tmp_path):
    path = write_video(tmp_path / "a.mp4", [picture(k) for k in range(40)], options={"g": "10", "bf": "0"})
    whole = list(one(path))
    damage(path, 0.5)
    sequence = one(path)
    assert sequence.length == 40
    with pytest.warns(UserWarning, match="no readable picture") as told:
        frames = list(sequence)
    assert len(told) == 1
    lost = [f.index for f in frames if f.image is None]
    assert lost
    assert [f.index for f in frames] == list(range(1, 41))
    for frame, right in zip(frames, whole, strict=True):
        if frame.index < lost[0] or frame.index > lost[-1] + 10:
            assert np.array_equal(frame.image, right.image)


def test_a_video_cut_off_ends_there_with_a_warning(tmp_path):
    path = cut(write_video(tmp_path / "a.mp4", [picture(k) for k in range(40)], options={"g": "10", "bf": "0"}), 0.7)
    with pytest.warns(UserWarning, match="of the 40 frames it promises"):
        sequence = one(path)
    assert 5 < sequence.length < 40
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert len(list(sequence)) == sequence.length


@pytest.mark.filterwarnings("ignore:.*frames per second taken as")
def test_packets_that_are_never_shown_are_no_frames(tmp_path):
    whole = write_video(tmp_path / "a.webm", [picture(k) for k in range(20)], codec="libvpx")
    with av.open(str(whole)) as read, av.open(str(tmp_path / "b.webm"), "w") as made:
        stream = made.add_stream_from_template(read.streams.video[0])
        for k, packet in enumerate(p for p in read.demux(video=0) if p.size):
            other = av.Packet(bytes([bytes(packet)[0] & (0xEF if k == 10 else 0xFF)]) + bytes(packet)[1:])
            other.pts, other.dts, other.time_base = packet.pts, packet.dts, packet.time_base
            other.is_keyframe, other.stream = packet.is_keyframe, stream
            made.mux(other)
    sequence = one(tmp_path / "b.webm")
    assert sequence.length == 19
    assert [disc(f.image) for f in sequence] == pytest.approx([4.0 * k for k in range(20) if k != 10], abs=5)


def test_a_container_that_breaks_within_is_told(tmp_path):
    path = write_video(tmp_path / "a.y4m", [picture(k) for k in range(20)], codec="wrapped_avframe")
    with pytest.warns(UserWarning, match=r"a\.y4m: breaks off after \d+ frames \(Invalid data"):
        sequence = one(damage(path, 0.5, 9000))
    assert 5 < sequence.length < 15
    assert [disc(frame.image) for frame in sequence][:5] == pytest.approx([4.0 * k for k in range(5)], abs=5)


VARYING_RATES = [
    ("phone.mp4", [33] * 25 + [67] * 9 + [100] * 25, 1000 * 59 / (33 * 25 + 67 * 9 + 100 * 25)),
    ("dark.mkv", [33] * 30 + [67] * 29, 1000 * 59 / (33 * 30 + 67 * 29)),
    ("pause.mkv", [40] * 29 + [9000] + [80] * 29, 1000 * 58 / (40 * 29 + 80 * 29)),
]


@pytest.mark.parametrize(("name", "steps", "rate"), VARYING_RATES)
def test_a_rate_that_varies_is_frames_over_time(tmp_path, name, steps, rate):
    """Each frame has the time that the file states; --fps replaces it. A reported gap counts for the times only."""
    stamps = [0, *np.cumsum(steps).tolist()]
    path = write_video(tmp_path / name, [picture(k) for k in range(60)], rate=1000, stamps=stamps)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        sequence = one(path)
    assert any("by its time stamps, which vary" in str(w.message) for w in told)
    assert sequence.fps == pytest.approx(rate, abs=0.001)
    assert [f.t for f in sequence] == pytest.approx(np.array(stamps) / 1000, abs=1e-6)
    assert [f.t for f in sequence.without_pictures()] == pytest.approx(np.array(stamps) / 1000, abs=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert [f.t for f in one(path, fps=10)] == pytest.approx([k / 10 for k in range(60)])


def test_a_steady_rate_with_jitter_stays_steady(tmp_path):
    stamps = [round(k * 1000 / 30) + (7 * k % 5) for k in range(40)]
    path = write_video(tmp_path / "a.mkv", [picture(k) for k in range(40)], rate=30, stamps=stamps)
    sequence = one(path)
    assert sequence.fps == 30
    assert [f.t for f in sequence] == pytest.approx([k / 30 for k in range(40)])


@pytest.mark.parametrize(("aspect", "size"), [(Fraction(16, 11), (140, 64)), (Fraction(8, 9), (96, 72))])
def test_pictures_have_square_pixels(tmp_path, aspect, size):
    """A round thing stays round: the shorter side of a pixel grows. ffmpeg's players show the first as 140×64."""
    path = write_video(tmp_path / "a.mp4", [picture(k) for k in range(2, 5)], aspect=aspect)
    with pytest.warns(
        UserWarning, match=f"{aspect.numerator}:{aspect.denominator} are made square: pictures of {size[0]}×"
    ):
        sequence = one(path)
    assert sequence.image_size == size
    images = [f.image for f in sequence]
    assert [image.shape[1::-1] for image in images] == [size] * 3
    assert [disc(image) for image in images] == pytest.approx([4.0 * k * size[0] / SIZE[0] for k in (2, 3, 4)], abs=3)


def test_a_calibration_of_stored_pixels_serves_square_ones(tmp_path):
    path = write_video(tmp_path / "a.mp4", [picture(0)], aspect=Fraction(16, 11))
    camera = Camera(
        kind="pinhole", image=SIZE, focal_px=(80.0, 80.0 * 16 / 11), centre_px=(48.0, 32.0),
        position=np.array([0.0, 0.0, 3.0]), rotation=np.diag([1.0, -1.0, -1.0]),
    )  # fmt: skip
    with pytest.warns(UserWarning, match="made square"):
        found = one(path, camera=camera).camera
    assert found.image == (140, 64)
    assert found.focal_px == pytest.approx((80 * 140 / 96, 80 * 16 / 11))
    with pytest.warns(UserWarning, match="made square"), pytest.raises(InputError, match="a calibration for 96×96 px"):
        one(path, camera=camera.replace(image=(96, 96)))


def empty(path):
    path.write_bytes(b"")


def text(path):
    path.write_text("no video\n" * 100)


def sound_alone(path):
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def without_index(path):
    write_video(path.with_suffix(".mov"), [picture(k) for k in range(9)])
    whole = path.with_suffix(".mov").read_bytes()
    path.write_bytes(whole[whole.index(b"mdat") - 4 :])


NO_VIDEOS = [
    (empty, "an empty file"),
    (text, "no readable video"),
    (sound_alone, "no video stream"),
    (without_index, "no readable video"),
]


@pytest.mark.parametrize(("make", "got"), NO_VIDEOS)
def test_no_video_is_one_line(tmp_path, make, got):
    path = tmp_path / "a.mp4"
    make(path)
    with pytest.raises(InputError, match=got) as error:
        open_source(path)
    assert error.value.file == str(path)
    with pytest.raises(InputError, match="nothing there"):
        open_source(tmp_path / "none.mp4")


def test_pictures_of_another_size_are_one_line(tmp_path):
    path = write_jpegs(tmp_path / "a.avi", [picture(0), picture(1), picture(2, (48, 32)), picture(3)])
    sequence = one(path)
    with pytest.raises(InputError, match=r"frame 3: got 48×32 px; expected 96×64 px"):
        list(sequence)


SAMPLES = [
    (None, [int((k + 0.5) * 60 / 50) + 1 for k in range(50)], "50 frames spread over the recording (not causal)"),
    ("spread:3", [11, 31, 51], "3 frames spread over the recording (not causal)"),
    ("first:4", [1, 2, 3, 4], "first 4 frames (causal from frame 4)"),
]


@pytest.mark.parametrize("name", ["long-groups.mp4", "mpeg2.mpg"])
@pytest.mark.parametrize(("asked", "wanted", "words"), SAMPLES)
def test_the_background_sample(tmp_path, name, asked, wanted, words):
    path = write_video(tmp_path / name, [picture(k) for k in range(60)], **KINDS[name])
    sequence = one(path, background=asked)
    frames = [f.image for f in sequence]
    assert sequence.source["background"] == words
    assert np.array_equal(sequence.background(), np.stack([frames[k - 1] for k in wanted]))


def test_a_folder_of_videos(tmp_path):
    for name in ("b.mp4", "a.avi"):
        write_video(tmp_path / name, [picture(k) for k in range(3)])
    (tmp_path / "notes.md").write_text("…")
    assert [s.name for s in open_source(tmp_path)] == ["a", "b"]
