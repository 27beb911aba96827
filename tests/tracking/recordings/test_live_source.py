"""Streams on loopback, pipes and growing files: pictures, their times, what is dropped, and how a source is lost."""

from __future__ import annotations

import base64
import os
import threading
import time
from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from itertools import pairwise

import pytest

from scenarios.errors import FlockscopeError, InputError, WorkError
from tests.streams import FPS, frame_of, free_port, send, sender, sent
from tracking.recordings import live_source
from tracking.recordings.live_source import LivePictures, hidden, is_live, lines_of_boxes


def found(pictures, each=lambda: None):
    """(frame by its time, frame modulo 20 by its picture) of each, and the error at the end."""
    seen = []
    try:
        for picture in pictures:
            seen.append((round(picture.t * pictures.fps), frame_of(picture.image)))
            each()
    except FlockscopeError as error:
        return seen, error
    return seen, None


def shown(*frames):
    """The pictures of these frames, each at its time after the first."""
    return [(k - frames[0], k % 20) for k in frames]


@contextmanager
def http(body, *, kind="video/mp2t", name="", hangs=False):
    """An HTTP server that sends a body to everyone, or with a name and password only, or never answers."""
    done = threading.Event()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            if hangs:
                done.wait(30)
                return
            if name and self.headers.get("Authorization") != "Basic " + base64.b64encode(name.encode()).decode():
                self.send_response(401)
                self.send_header("WWW-Authenticate", 'Basic realm="camera"')
                self.end_headers()
                return
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"127.0.0.1:{server.server_port}/video"
    finally:
        done.set()
        server.shutdown()
        server.server_close()


def opened_once_there(port, **options):
    """The pictures of a stream whose sender starts."""
    until = time.monotonic() + 30
    while True:
        try:
            return LivePictures(f"tcp://127.0.0.1:{port}", **options)
        except InputError:
            assert time.monotonic() < until
            time.sleep(0.1)


@pytest.mark.parametrize(
    ("source", "live"),
    [
        ("0", True), ("12", True), ("-", True), ("rtsp://a/b", True), ("http://a", True), ("tcp://a:1", True),
        ("video.mp4", False), ("ftp://a", False), ("-1", False), ("", False), ("a\0b", False),
    ],
)  # fmt: skip
def test_what_is_live(source, live):
    assert is_live(source) == live


def test_a_pipe_is_live_and_a_file_is_if_it_is_followed(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "video.ts").write_bytes(b"")
    assert is_live(str(tmp_path / "pipe"))
    assert not is_live(str(tmp_path / "video.ts"))
    assert is_live(str(tmp_path / "video.ts"), follow=True)


def test_a_video_sent_by_http_is_whole():
    with http(sent(range(40))) as place:
        pictures = LivePictures(f"http://{place}", None, "wait")
        assert pictures.fps == FPS
        assert found(pictures) == (shown(*range(40)), None)
    assert (pictures.dropped, pictures.reconnects) == (0, 0)


def test_a_wrong_password_is_named_but_not_shown():
    with http(sent(range(5)), name="me:right") as place:
        assert found(LivePictures(f"http://me:right@{place}", None, "wait"))[0] == shown(*range(5))
        with pytest.raises(InputError, match="no right to see it") as error:
            LivePictures(f"http://me:wrong@{place}", None, "wait")
    assert "wrong" not in error.value.line()


@pytest.mark.parametrize(
    ("source", "shown"),
    [
        ("rtsp://me:secret@host/1", "rtsp://me:***@host/1"), ("rtsp://me:a@b@host/1", "rtsp://me:***@host/1"),
        ("http://host/video?user=me&pwd=secret", "http://host/video?***"), ("rtsp://host:554/1", "rtsp://host:554/1"),
        ("what?.ts", "what?.ts"),
    ],
)  # fmt: skip
def test_passwords_are_hidden(source, shown):
    assert hidden(source) == shown


def test_an_error_on_the_way_shows_no_password():
    body = sent(range(10)) + sent(range(10), size=(192, 160))
    with http(body, name="me:secret") as place:
        _, error = found(LivePictures(f"http://me:secret@{place}", None, "wait"))
    assert isinstance(error, InputError)
    assert "secret" not in error.line()


def test_pictures_that_change_their_size_end_the_run():
    with http(sent(range(10)) + sent(range(10), size=(192, 160))) as place:
        seen, error = found(LivePictures(f"http://{place}", None, "wait"))
    assert seen == shown(*range(len(seen)))
    assert len(seen) >= 9
    assert isinstance(error, InputError)
    assert "change to 192×160 px; expected 160×120 px" in error.line()


def test_a_server_that_never_answers_is_lost(monkeypatch):
    monkeypatch.setattr(live_source, "PATIENCE", 0.5)
    begun = time.monotonic()
    with http(b"", hangs=True) as place, pytest.raises(InputError, match=r"no answer within 0\.5 s"):
        LivePictures(f"http://{place}", None, "wait")
    assert time.monotonic() - begun < 20


def test_sound_only_is_refused():
    with http(sent([], sound=True)) as place, pytest.raises(InputError, match="sound only"):
        LivePictures(f"http://{place}", None, "wait")


def test_nobody_there_is_refused():
    with pytest.raises(InputError, match="refused"):
        LivePictures(f"tcp://127.0.0.1:{free_port()}", None, "wait")


def test_what_is_no_video_is_refused(tmp_path):
    (tmp_path / "text.ts").write_text("hello\n" * 100)
    with pytest.raises(InputError, match=r"text\.ts"):
        LivePictures(str(tmp_path / "text.ts"), None, None, 0.1)


@pytest.mark.slow
def test_a_sender_that_dies_and_comes_back(monkeypatch):
    monkeypatch.setattr(live_source, "PAUSE", 0.05)
    port, began = free_port(), time.monotonic()
    with sender(port, 200, "--paced"):
        pictures, seen, gap = opened_once_there(port, fps=None, when_slow="wait"), [], 0.0
        iterator = iter(pictures)
        seen += [next(iterator) for _ in range(20)]
    stopped = time.monotonic()
    with sender(port, 200, "--paced"):
        while pictures.reconnects == 0:
            seen.append(next(iterator))
        gap = time.monotonic() - stopped
        seen += [next(iterator) for _ in range(10)]
    iterator.close()
    frames = [round(picture.t * FPS) for picture in seen]
    assert frames == sorted(set(frames))
    steps = [b - a for a, b in pairwise(frames)]
    assert max(steps) > 0.5 * gap * FPS, "the time without pictures is kept"
    assert pictures.reconnects == 1
    assert time.monotonic() - began < 60


@pytest.mark.slow
def test_a_sender_that_does_not_come_back(monkeypatch):
    monkeypatch.setattr(live_source, "AGAIN", 0.5)
    port = free_port()
    with sender(port, 80):
        seen, error = found(opened_once_there(port, fps=None, when_slow="wait"))
    assert seen
    assert isinstance(error, WorkError)
    assert "the end of the stream" in error.line()


def written(path, chunks, pause=0.02):
    with path.open("ab", buffering=0) as file:
        for chunk in chunks:
            file.write(chunk)
            time.sleep(pause)


def pieces(body, size=4000):
    return [body[k : k + size] for k in range(0, len(body), size)]


def test_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(target=written, args=(tmp_path / "pipe", pieces(sent(range(60)))))
    writer.start()
    pictures = LivePictures(str(tmp_path / "pipe"), None, None)
    assert found(pictures) == (shown(*range(60)), None)
    assert pictures.dropped == 0
    writer.join()


def test_a_file_that_grows(tmp_path):
    path, chunks = tmp_path / "video.ts", pieces(sent(range(60)))
    path.write_bytes(b"".join(chunks[:3]))
    writer = threading.Thread(target=written, args=(path, chunks[3:]))
    writer.start()
    pictures = LivePictures(str(path), None, None, 3.0)
    assert found(pictures) == (shown(*range(60)), None)
    writer.join()


def test_a_pause_of_the_writer_is_waited_for(tmp_path, monkeypatch):
    """A pipe that pauses for longer than a stream may."""
    monkeypatch.setattr(live_source, "PATIENCE", 0.2)
    os.mkfifo(tmp_path / "pipe")
    body = sent(range(60))
    half = len(body) // 2
    writer = threading.Thread(target=written, args=(tmp_path / "pipe", [body[:half], body[half:]], 0.6))
    writer.start()
    assert found(LivePictures(str(tmp_path / "pipe"), None, None)) == (shown(*range(60)), None)
    writer.join()


def test_a_slow_consumer_drops_or_lets_the_source_wait(tmp_path):
    path = tmp_path / "video.ts"
    path.write_bytes(sent(range(40)))
    slow = partial(time.sleep, 0.02)
    waiting = LivePictures(str(path), None, "wait", 0.1)
    assert found(waiting, slow) == (shown(*range(40)), None)
    assert waiting.dropped == 0
    dropping = LivePictures(str(path), None, "drop", 0.1)
    seen, error = found(dropping, slow)
    assert error is None
    assert dropping.dropped > 0
    assert len(seen) + dropping.dropped == 40
    assert all(frame % 20 == shown for frame, shown in seen), "times are kept"


def test_files_and_pipes_wait_and_streams_drop(tmp_path):
    path = tmp_path / "video.ts"
    path.write_bytes(sent(range(5)))
    pictures = LivePictures(str(path), None, None, 0.1)
    assert pictures.when_slow == "wait"
    assert len(found(pictures)[0]) == 5
    with http(sent(range(5))) as place:
        assert LivePictures(f"http://{place}", None, None).when_slow == "drop"


class Reader:
    """Pictures at these times, s, which tell their place in the order."""

    lasts, fps = False, 10.0

    def __init__(self, times):
        self.times = times

    def pictures(self):
        from tests.streams import picture

        for k, t in enumerate(self.times):
            yield t, picture(k)

    def stop(self):
        pass

    def close(self):
        pass


def frames_of(monkeypatch, times):
    monkeypatch.setattr(LivePictures, "_opened", lambda _: Reader(times))
    pictures = LivePictures("tcp://a", None, "wait")
    return found(pictures)[0], pictures.dropped


def test_pictures_out_of_order_and_of_the_same_time_are_left_out(monkeypatch):
    assert frames_of(monkeypatch, [5.0, 5.1, 5.3, 5.2, 5.3, 5.4]) == ([(0, 0), (1, 1), (3, 2), (4, 5)], 2)


def test_times_that_are_not_exact_lose_no_picture(monkeypatch):
    """As of a camera, whose pictures come a little early or late."""
    times = [0.1 * k + 0.045 * (-1) ** (k // 2) for k in range(40)]
    seen, dropped = frames_of(monkeypatch, times)
    assert dropped == 0
    assert [k for _, k in seen] == [k % 20 for k in range(40)]
    assert all(abs(frame - k) <= 1 for k, (frame, _) in enumerate(seen))


def test_more_pictures_than_frames_are_left_out_evenly(monkeypatch):
    seen, dropped = frames_of(monkeypatch, [k / 20 for k in range(45)])
    assert [frame for frame, _ in seen] == list(range(23))
    assert len(seen) + dropped == 45


@pytest.mark.parametrize("fps", [None, 2000.0])
def test_a_source_without_a_frame_rate_is_refused(monkeypatch, fps):
    reader = Reader([0.0])
    reader.fps = fps
    monkeypatch.setattr(LivePictures, "_opened", lambda _: reader)
    with pytest.raises(InputError, match="give --fps"):
        LivePictures("tcp://me:secret@a", None, "wait")
    assert LivePictures("tcp://a", 10.0, "wait").fps == 10.0


def test_no_camera_is_refused():
    with pytest.raises(InputError, match="no camera that answers"):
        LivePictures("99", None, None)


def test_lines_of_boxes():
    lines = b'{"t": 0, "boxes": [[1, 2, 3, 4]]}\n\n{"frame": 2, "points": []}\n'
    assert [*lines_of_boxes(BytesIO(lines))] == [{"t": 0, "boxes": [[1, 2, 3, 4]]}, {"frame": 2, "points": []}]


@pytest.mark.parametrize(
    "line", [b"x", b"[]", b"{}", b'{"t": 1}', b'{"boxes": [], "box": 1}', b"\xff", b'{"boxes": ' + b"[" * 2000]
)
def test_a_wrong_line_is_named(line):
    with pytest.raises(InputError, match=r"line 2: .*expected a line of JSON"):
        list(lines_of_boxes(BytesIO(b'{"boxes": []}\n' + line)))


def test_send_can_write_files():
    file = BytesIO()
    send(file, range(3))
    assert len(file.getvalue()) > 1000
