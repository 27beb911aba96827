"""What browsers need of a video, and what they are told of it."""

from pathlib import Path

import av
import pytest

from scenarios.errors import InputError
from sim.io.pictures.video_encoding import BT601, NARROW, write_video
from tests.small_videos import SIZE, picture


def made(path: Path, fps: float = 10.0) -> Path:
    with write_video(path, SIZE, fps) as film:
        for k in range(25):
            film.add(picture(k))
    return path


def test_form_and_colours_are_told(tmp_path):
    """yuv420p; the matrix and range that the colours were converted by; a key frame each second; the index in front."""
    path = made(tmp_path / "a.mp4")
    with av.open(str(path)) as container:
        context = container.streams.video[0].codec_context
        frames = list(container.decode(video=0))
        assert (context.name, context.pix_fmt, context.color_range, context.colorspace) == (
            "h264",
            "yuv420p",
            NARROW,
            BT601,
        )
        assert [k for k, frame in enumerate(frames) if frame.key_frame] == [0, 10, 20]
        assert {(frame.color_range, frame.colorspace) for frame in frames} == {(NARROW, BT601)}
    body = path.read_bytes()
    assert body.index(b"moov") < body.index(b"mdat")


def test_the_same_pictures_give_the_same_bytes(tmp_path):
    assert made(tmp_path / "a.mp4", 29.97).read_bytes() == made(tmp_path / "b.mp4", 29.97).read_bytes()


@pytest.mark.parametrize("size", [(95, 64), (96, 63)])
def test_odd_sizes_are_refused(tmp_path, size):
    with pytest.raises(InputError, match="even"), write_video(tmp_path / "a.mp4", size, 10.0):
        raise AssertionError("no film of that size")
    assert not (tmp_path / "a.mp4").exists()
