"""What browsers need of a video, and what they are told of it."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.pictures.video_files import WRITTEN_COLOURS, WRITTEN_RANGE, write_video
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
            "h264", "yuv420p", WRITTEN_RANGE, WRITTEN_COLOURS,
        )  # fmt: skip
        assert [k for k, frame in enumerate(frames) if frame.key_frame] == [0, 10, 20]
        assert {(frame.color_range, frame.colorspace) for frame in frames} == {(WRITTEN_RANGE, WRITTEN_COLOURS)}
    body = path.read_bytes()
    assert body.index(b"moov") < body.index(b"mdat")


@pytest.mark.parametrize("shape", [(48, 64, 3), (65, 96, 3), (63, 95, 3)])
def test_a_picture_of_another_size_is_refused(tmp_path, shape):
    with write_video(tmp_path / "a.mp4", SIZE, 10.0) as film:
        film.add(picture(0))
        with pytest.raises(InputError, match=r"picture 2: got .* px; expected 96×64 px"):
            film.add(np.zeros(shape, np.uint8))
