"""A FIFO, a device, a socket, a folder or a circle of links in place of a file is refused before it is opened."""

import os
import shutil
import socket

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.reading import read_regular
from tests.damaged.readers import READERS
from tests.damaged.specimens import TEXTS, write_texts
from tests.recordings import mot_folder
from tracking.recordings.source import open_source

# settings are no files, and these readers leave out what is beside the tracks and is no regular file
LEFT_OUT = ("setting/", "tracker-setting/", "eth/walk.groups", "tracks-text/groups", "tracks-text/events")
FILES = [
    name for name in sorted(str(p.relative_to(TEXTS)) for p in TEXTS.rglob("*.*")) if not name.startswith(LEFT_OUT)
]


def put(path, what):
    path.unlink()
    if what == "FIFO":
        os.mkfifo(path)
    elif what == "socket":
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(os.path.relpath(path))
    elif what == "device":
        path.symlink_to("/dev/zero")
    elif what == "folder":
        path.mkdir()
    else:
        path.symlink_to(path)


@pytest.mark.parametrize("what", ["FIFO", "socket", "folder"])
@pytest.mark.parametrize("file", FILES)
def test_no_reader_opens_it(file, what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    kind = file.partition("/")[0]
    folder = write_texts(tmp_path)[kind]
    put(tmp_path / file, what)
    with pytest.raises(InputError):
        READERS[kind](folder)


@pytest.mark.parametrize("what", ["FIFO", "device", "folder", "circle"])
def test_among_pictures(what, tmp_path):
    mot_folder(tmp_path, pictures=dict.fromkeys((f"img1/{k}.png" for k in (1, 2, 3)), np.zeros((8, 8, 3), np.uint8)))
    put(tmp_path / "img1" / "2.png", what)
    with pytest.raises(InputError, match=r"2\.png"):
        open_source(tmp_path, fps=5)


def test_videos(tmp_path):
    for suffix in ("mp4", "xml", "txt"):
        os.mkfifo(tmp_path / f"a.{suffix}")
        with pytest.raises(InputError, match="FIFO"):
            open_source(tmp_path / f"a.{suffix}")
    shutil.copy("/dev/null", tmp_path / "empty.mp4")
    with pytest.raises(InputError, match="an empty file"):
        open_source(tmp_path / "empty.mp4")


def test_large_files_are_not_read(tmp_path):
    path = tmp_path / "large.txt"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(InputError, match="1,099,511,627,776"):
        read_regular(path, 2**28)
