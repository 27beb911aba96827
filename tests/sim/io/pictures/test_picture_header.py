"""Pictures that declare more than memory holds are not decoded; samples of large pictures fit."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.pictures.background_sample import BackgroundChoice, parse_choice
from sim.io.pictures.picture_folder import read_picture
from sim.io.pictures.picture_header import declared_size, is_bearable


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif", "tiff", "jpeg"])
@pytest.mark.parametrize("shape", [(48, 64, 3), (5, 7), (1, 300, 3)])
def test_headers(suffix, shape):
    image = np.random.default_rng(0).integers(0, 255, shape, np.uint8)
    body = cv2.imencode(f".{suffix}", image)[1].tobytes()
    assert declared_size(body) == (shape[1], shape[0])
    assert is_bearable(body)
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
    assert declared_size(bomb(30_000)) == (30_000, 30_000)


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
