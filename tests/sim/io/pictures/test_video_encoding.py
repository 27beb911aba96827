"""What browsers need of a video, and what they are told of it."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim.io.pictures import video_files as video_encoding
from sim.io.pictures.video_files import WRITTEN_COLOURS, WRITTEN_RANGE, write_video
from tests.small_videos import SIZE, picture


def made(path: Path, fps: float = 10.0, shown: Callable[[int], np.ndarray] = picture) -> Path:
    with write_video(path, SIZE, fps) as film:
        for k in range(25):
            film.add(shown(k))
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
            WRITTEN_RANGE,
            WRITTEN_COLOURS,
        )
        assert [k for k, frame in enumerate(frames) if frame.key_frame] == [0, 10, 20]
        assert {(frame.color_range, frame.colorspace) for frame in frames} == {(WRITTEN_RANGE, WRITTEN_COLOURS)}
    body = path.read_bytes()
    assert body.index(b"moov") < body.index(b"mdat")


def test_the_same_pictures_give_the_same_bytes(tmp_path):
    first = made(tmp_path / "a.mp4", 29.97).read_bytes()
    for _ in range(12):
        used = [np.random.default_rng(k).bytes(60_000) for k in range(20)]  # memory that holds something else each time
        assert made(tmp_path / "b.mp4", 29.97).read_bytes() == first, len(used)


@pytest.mark.parametrize("size", [(95, 64), (96, 63)])
def test_odd_sizes_are_refused(tmp_path, size):
    with pytest.raises(InputError, match="even"), write_video(tmp_path / "a.mp4", size, 10.0):
        raise AssertionError("no film of that size")
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.parametrize("shape", [(48, 64, 3), (65, 96, 3), (63, 95, 3)])
def test_a_picture_of_another_size_is_refused(tmp_path, shape):
    with write_video(tmp_path / "a.mp4", SIZE, 10.0) as film:
        film.add(picture(0))
        with pytest.raises(InputError, match=r"picture 2: got .* px; expected 96×64 px"):
            film.add(np.zeros(shape, np.uint8))


def noise(k: int) -> np.ndarray:
    return np.random.default_rng(k).integers(0, 255, (SIZE[1], SIZE[0], 3), dtype=np.uint8)


def test_a_video_that_lacks_pictures_is_an_error(tmp_path, monkeypatch):
    """Whatever has swallowed them: the written file is counted."""
    counted = video_encoding._pictures_in(made(tmp_path / "a.mp4"))
    assert counted == 25
    monkeypatch.setattr(video_encoding, "_pictures_in", lambda path: 24)
    with pytest.raises(WorkError, match="got 24 of 25 pictures"):
        made(tmp_path / "b.mp4")


def test_a_video_without_pictures_is_no_error(tmp_path):
    with write_video(tmp_path / "a.mp4", SIZE, 10.0):
        pass
    assert (tmp_path / "a.mp4").is_file()


@pytest.mark.parametrize("kilobytes", range(8, 64, 8))
def test_a_real_disk_that_fills_up(tmp_path, kilobytes):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", disk]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a small disk")
    try:
        with pytest.raises((OSError, WorkError)):
            made(disk / "a.mp4", shown=noise)
    finally:
        subprocess.run(["umount", disk], check=True)
