"""Cameras, streams, pipes and growing files as frames that come in while they are tracked.

A picture source is a number (a camera of this machine), an address (rtsp, http, …), a pipe, or with `follow` a video
file that is still being written; it is read in a thread of its own. Boxes come as lines of JSON, from standard input.
"""

from __future__ import annotations

import json
import re
import select
import stat
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from scenarios.errors import FlockscopeError, InputError, WorkError, shortened
from scenarios.limits import FRAME_RATES, PICTURE_SIZES, fits_picture
from sim.types import Image

ADDRESS = re.compile(r"(rtsps?|rtmps?|https?|tcp|udp|srt|rtp)://.+")
STDIN = "-"
PATIENCE = 10.0  # s without an answer, or without a picture, after which a source is lost
AGAIN = 30.0  # s for which a lost stream is asked again
PAUSE = 1.0  # s between two tries
TICK = 0.05  # s between two looks at a pipe or file
WAITING = 4  # pictures that wait at most for a tracker that is too slow
EXACT = 1e-3  # frames; stamps are rounded
LINE = 4 * 2**20  # characters of a line of boxes at most
WhenSlow = Literal["drop", "wait"]


@dataclass(frozen=True)
class LivePicture:
    """A picture (H, W, 3), BGR, of time t, s since the first, which came at the moment `at` of the monotonic clock."""

    t: float
    image: Image
    at: float


def is_live(source: str, follow: bool = False) -> bool:
    """Returns True if a source gives frames while it is read: a camera, an address, a pipe, standard input, or a file
    that grows (`follow`)."""
    if source == STDIN or source.isdecimal() or ADDRESS.fullmatch(source):
        return True
    with suppress(OSError, ValueError):
        mode = Path(source).stat().st_mode
        return stat.S_ISFIFO(mode) or (follow and stat.S_ISREG(mode))
    return False


class LivePictures:
    """The pictures of a camera, stream, pipe or growing file, in the order of their times.

    source: as of `is_live`. fps: frames per second; None: as the source says. when_slow: "drop" leaves out pictures
    that came while the tracker was busy, all but the newest; "wait" lets the source wait; None: pipes and files wait.
    follow: seconds after which a file that does not grow has ended.

    State: fps; dropped, reconnects: numbers of pictures left out and of times the stream was opened again.

    Raises InputError if there is no such source, or its frame rate is unknown.
    """

    def __init__(self, source: str, fps: float | None, when_slow: WhenSlow | None, follow: float | None = None) -> None:
        self.source, self.name, self.follow = source, hidden(source), follow
        lasts = source.isdecimal() or ADDRESS.fullmatch(source)
        self.when_slow: WhenSlow = when_slow or ("drop" if lasts else "wait")
        self.dropped = self.reconnects = 0
        self._queue: deque[LivePicture] = deque()
        self._changed, self._ended, self._stop = threading.Condition(), False, False
        self._error: FlockscopeError | None = None
        self._size: tuple[int, ...] | None = None
        self._seen = time.monotonic()  # when the last picture came
        self._reader = self._opened()
        found = fps or self._reader.fps
        if found is None or not FRAME_RATES[0] <= found <= FRAME_RATES[1]:
            self._reader.close()
            raise self._refused("no frame rate", "frames per second", "give --fps")
        self.fps = float(found)
        self._thread = threading.Thread(target=self._read, name="live pictures", daemon=True)

    def __iter__(self) -> Iterator[LivePicture]:
        """Yields the pictures. Raises InputError or WorkError if the source is lost, or its pictures change their size,
        after the pictures that came before."""
        self._thread.start()
        try:
            while True:
                with self._changed:
                    while not self._queue and not self._ended:
                        self._changed.wait(0.2)
                    if not self._queue:
                        break
                    if self.when_slow == "drop":
                        self.dropped += len(self._queue) - 1
                        picture = self._queue.pop()
                        self._queue.clear()
                    else:
                        picture = self._queue.popleft()
                    self._changed.notify_all()
                yield picture
        finally:
            self._stop = True
            self._reader.stop()
            with self._changed:
                self._changed.notify_all()
            self._thread.join(PATIENCE)
        if self._error is not None:
            raise self._error

    def _opened(self) -> _CameraReader | _StreamReader:
        if self.source.isdecimal():
            return _CameraReader(int(self.source))
        return _StreamReader(self.source, self.follow)

    def _read(self) -> None:
        begun, base, last = time.monotonic(), 0.0, -1
        try:
            while not self._stop:
                first: float | None = None
                try:
                    for stamp, image in self._reader.pictures():
                        now = time.monotonic()
                        first = stamp if first is None else first
                        self._seen = now
                        at = (base + (stamp - first)) * self.fps
                        # Times are not exact: a picture after the last frame gets the next one, even if it is early.
                        # Pictures out of order, and those that there is no frame for, are left out.
                        if at > last + EXACT:
                            last = max(round(at), last + 1)
                            self._put(LivePicture(last / self.fps, self._checked(image), now))
                        else:
                            self.dropped += 1
                        if self._stop:
                            return
                    return
                except WorkError as lost:
                    if not self._reader.lasts:
                        raise
                    self._again(lost)
                    base = max(time.monotonic() - begun, (last + 1) / self.fps)
        except FlockscopeError as error:
            self._error = error
        except Exception as error:  # a thread must not end without a word
            got = f"{type(error).__name__}: {error}"
            self._error = WorkError(file=self.name, got=got, expected="pictures", remedy="report it: it is a bug")
        finally:
            with suppress(Exception):
                self._reader.close()
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _again(self, lost: WorkError) -> None:
        """Opens a stream that was lost again. Raises the loss if that does not work for some time."""
        with suppress(Exception):
            self._reader.close()
        until = max(self._seen + AGAIN, time.monotonic() + PAUSE)
        while not self._stop and time.monotonic() < until:
            time.sleep(PAUSE)
            with suppress(InputError, WorkError):
                self._reader = self._opened()
                self.reconnects += 1
                return
        raise lost

    def _put(self, picture: LivePicture) -> None:
        with self._changed:
            if self.when_slow == "wait":
                while len(self._queue) >= WAITING and not self._stop:
                    self._changed.wait(0.2)
            elif len(self._queue) >= WAITING:
                self._queue.popleft()
                self.dropped += 1
            self._queue.append(picture)
            self._changed.notify_all()

    def _checked(self, image: Image) -> Image:
        if self._size is None:
            self._size = image.shape
        if image.shape != self._size:
            got, expected = ("{1}×{0} px".format(*size) for size in (image.shape, self._size))
            remedy = "what was tracked is kept; track the rest as a run of its own"
            raise InputError(file=self.name, got=f"pictures that change to {got}", expected=expected, remedy=remedy)
        return image

    def _refused(self, got: str, expected: str, remedy: str) -> InputError:
        return InputError(file=self.name, got=got, expected=expected, remedy=remedy)


class _CameraReader:
    """A camera of this machine. Its pictures have the times at which they came."""

    lasts = True

    def __init__(self, number: int) -> None:
        import cv2

        log = cv2.utils.logging
        level = log.setLogLevel(log.LOG_LEVEL_SILENT)  # its own words would stand beside ours
        self.camera, self.number = cv2.VideoCapture(number), number
        log.setLogLevel(level)
        if not self.camera.isOpened():
            remedy = "check that it is connected, and that no other program uses it"
            raise InputError(file=str(number), got="no camera that answers", expected="a camera", remedy=remedy)
        rate = float(self.camera.get(cv2.CAP_PROP_FPS))
        self.fps = rate if rate > 0 else None

    def pictures(self) -> Iterator[tuple[float, Image]]:
        while True:
            good, image = self.camera.read()
            if not good:
                remedy = "check its cable; what was tracked is kept"
                raise WorkError(file=str(self.number), got="no picture", expected="a camera", remedy=remedy)
            yield time.monotonic(), np.asarray(image, np.uint8)

    def stop(self) -> None:
        pass  # the next picture comes soon

    def close(self) -> None:
        self.camera.release()


class _StreamReader:
    """A stream, pipe or growing file, by libav."""

    def __init__(self, source: str, follow: float | None) -> None:
        import av

        self.name, self.lasts = hidden(source), bool(ADDRESS.fullmatch(source))
        options = {"rtsp_transport": "tcp"} if self.lasts else {}
        if self.lasts and not source.startswith("http"):
            options["fflags"] = "nobuffer"  # begins with the newest picture; a file that is sent begins with its first
        self.file = None if self.lasts else _Growing(Path(source), follow or 0.0)
        given: Any = source if self.file is None else self.file
        try:
            self.container = av.open(given, options=options, timeout=PATIENCE, metadata_errors="ignore")
        except (av.FFmpegError, OSError, ValueError) as error:
            if self.file is not None:
                self.file.close()
            raise self._reason(error) from None
        # A file that is sent by HTTP ends. Of other streams nobody can tell an end from a sender that has died.
        sent_file = source.startswith("http") and self.container.format.name != "mpjpeg"
        self.endless = self.lasts and not sent_file
        streams = self.container.streams.video
        if not streams:
            got = "sound only" if self.container.streams.audio else "no video"
            self.close()
            raise InputError(file=self.name, got=got, expected="a video stream", remedy="check the address")
        self.stream = streams[0]
        self.stream.thread_count = 1
        width, height = self.stream.codec_context.width, self.stream.codec_context.height
        if width and not fits_picture(width, height):
            got = f"{width}×{height} px"
            raise InputError(file=self.name, got=got, expected=PICTURE_SIZES, remedy="take a smaller stream")
        rate = self.stream.average_rate or self.stream.guessed_rate
        self.fps = float(rate) if rate else None

    def pictures(self) -> Iterator[tuple[float, Image]]:
        import av

        from sim.pictures.video_files import picture_of

        count = 0
        try:
            for frame in self.container.decode(self.stream):
                if frame.is_corrupt:
                    continue
                count += 1
                t = frame.time if frame.time is not None else count / (self.fps or 1.0)
                yield float(t), picture_of(frame, self.stream.sample_aspect_ratio)
        except av.EOFError:
            pass
        except (av.FFmpegError, OSError) as error:
            lost = self._reason(error)
            raise WorkError(file=self.name, got=lost.got, expected=lost.expected, remedy=lost.remedy) from None
        if self.endless:
            remedy = "check that the sender runs; what was tracked is kept"
            raise WorkError(file=self.name, got="the end of the stream", expected="more pictures", remedy=remedy)

    def stop(self) -> None:
        """Ends a wait for what a pipe or file has not yet."""
        if self.file is not None:
            self.file.stopped = True

    def close(self) -> None:
        self.container.close()
        if self.file is not None:
            self.file.close()

    def _reason(self, error: Exception) -> InputError:
        import av

        text = str(getattr(error, "strerror", None) or error).partition("\n")[0]
        got, remedy = text, "check the address, and that the sender runs; what was tracked is kept"
        if isinstance(error, av.HTTPUnauthorizedError | av.HTTPForbiddenError):
            got, remedy = f"no right to see it ({text})", "give name and password: rtsp://NAME:PASSWORD@HOST/…"
        elif isinstance(error, av.ExitError | TimeoutError) or "timed out" in text.lower():
            got = f"no answer within {PATIENCE:g} s"
        return InputError(file=self.name, got=got, expected="a stream of pictures", remedy=remedy)


def hidden(source: str) -> str:
    """Returns an address without its password, and without the values after ?, which may be passwords, too."""
    if not ADDRESS.fullmatch(source):
        return source
    return re.sub(r"\?.*", "?***", re.sub(r"(://[^/:@]*):[^/]*@", r"\1:***@", source))


class _Growing:
    """A pipe, or a file that is read while it grows: it ends once it has not grown for some seconds. A pipe that has a
    writer does not end, however long the writer pauses.

    State: stopped, True if it shall end now. Raises InputError if it cannot be opened.
    """

    def __init__(self, path: Path, seconds: float) -> None:
        try:
            # without a buffer, which would wait until it is full
            self.file = path.open("rb", buffering=0)
        except OSError as error:
            remedy = "check path and rights"
            raise InputError(file=path, got=error.strerror or "", expected="a file", remedy=remedy) from None
        self.seconds, self.stopped = seconds, False

    def read(self, size: int = -1) -> bytes:
        until = time.monotonic() + self.seconds
        while not self.stopped:
            if select.select([self.file], [], [], TICK)[0]:
                found = self.file.read(size)
                if found or time.monotonic() >= until:
                    return found or b""
                time.sleep(TICK)
        return b""

    def close(self) -> None:
        self.file.close()


def lines_of_boxes(file: BinaryIO) -> Iterator[dict[str, Any]]:
    """Yields the frames of a detector, one for each line of JSON: {"t": s or "frame": from 1, "boxes": [[left, top,
    width, height], …] or "points": [[x, y], …], "scores": […]}. "scores", and "t" and "frame" can be left out. Raises
    InputError with the number of a line that is wrong."""
    keys = {"t", "frame", "boxes", "points", "scores"}
    for number, line in enumerate(iter(lambda: file.readline(LINE + 1), b""), 1):
        if not line.strip():
            continue
        found: Any = None
        with suppress(ValueError, RecursionError):
            found = json.loads(line) if len(line) <= LINE else None
        wrong = not isinstance(found, dict) or not found.keys() <= keys or found.keys().isdisjoint({"boxes", "points"})
        if wrong:
            expected = 'a line of JSON, such as {"t": 0.04, "boxes": [[10, 20, 30, 80]], "scores": [0.9]}'
            got = shortened(line.decode("utf-8", "replace").strip(), 60)
            raise InputError(file="stdin", place=f"line {number}", got=got, expected=expected, remedy="correct it")
        yield found
