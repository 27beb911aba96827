"""Decode a video file: an index of its packets, and its pictures with their frame numbers.

Decoding uses one thread, so that every machine gets the same pictures. The number of a frame is the rank of its time
stamp if the stamps can be trusted. Otherwise decoded pictures are counted, and a packet that cannot be decoded counts
as one.

Writes H.264 videos that browsers can play and seek: mp4, yuv420p, a key frame each second, the index in front.

One thread is used and no date is written, so the same pictures give the same bytes. libav ignores a write that fails
or takes only a part, as on a full disk, so the pictures of the finished video are counted.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, WorkError, reject
from scenarios.limits import FRAMES, PICTURE_SIZES, fits_picture
from scenarios.reading import require_regular
from sim.pictures.picture_folder import require_size
from sim.store.own_files import media_url
from sim.types import Array, Image

COVER = "attached_pic"
SHOWN = 0x10  # bit of the first byte of a VP8 packet, 0 in those that are never shown
BT601, NARROW = (2, 5, 6), (0, 1)  # libav's numbers of colour matrices (2: unknown) and ranges (0: unknown)
EXACT = 2 | 0x2000 | 0x40000  # swscale flags: bilinear, full chroma, accurate rounding
REMEDY = "give a video that a player plays to its end"


@dataclass(frozen=True)
class PacketIndex:
    """The packets of a video stream, in the order of the file."""

    # when each packet is shown, in units of time_base (a fraction of a second), None if unknown
    stamps: tuple[int | None, ...]
    # which group of packets that can be decoded by itself each is of, from 1, as all packets of the stream are counted
    group: tuple[int, ...]
    time_base: Fraction
    rate: float  # frames per second;
    promised: int  # number of frames shown; these two by the header, 0 if missing
    broken: str  # why reading stopped before the end of the file, "" if it did not
    reorders: bool  # True if packets may be stored in another order than they are shown
    aspect: Fraction = Fraction(1)  # width / height of a stored pixel, 1 if unknown

    def times(self) -> Array:
        """Returns the distinct times at which frames are shown, s, ascending."""
        return np.array(sorted({s for s in self.stamps if s is not None}), float) * float(self.time_base)

    def ranks(self) -> dict[int, int] | None:
        """Returns the frame (from 1) of each time stamp, by stamp; None if the stamps cannot be trusted."""
        known = [s for s in self.stamps if s is not None]
        # Packets that may be reordered, and yet have ascending stamps: the container made them up.
        ascending = known == sorted(known)
        if len(set(known)) < len(self.stamps) or (self.reorders and ascending):
            return None
        return {stamp: k for k, stamp in enumerate(sorted(known), 1)}

    def groups(self, wanted: set[int]) -> set[int] | None:
        """Returns the numbers (from 1) of the packet groups that hold the frames `wanted`; None if unknown."""
        ranks = self.ranks()
        if ranks is None:
            return None
        packets = zip(self.group, self.stamps, strict=True)
        return {group for group, stamp in packets if stamp is not None and ranks[stamp] in wanted}


@contextmanager
def open_stream(path: Path) -> Iterator[tuple[Any, Any]]:
    """Yields (libav container, first video stream) of a file, set to decode in one thread."""
    import av

    size = require_regular(path)
    try:
        container = av.open(media_url(path), metadata_errors="ignore")
    except (av.FFmpegError, OSError, ValueError) as error:
        got = "an empty file" if size == 0 else f"no readable video ({_reason(error)})"
        raise InputError(file=path, got=got, expected="a whole video file", remedy=REMEDY) from None
    with container:
        streams = [s for s in container.streams.video if COVER not in str(getattr(s, "disposition", "")).lower()]
        got = "an unknown codec" if streams else "no video stream"
        reject(not streams or streams[0].codec_context is None, path, got, "a video stream, as of H.264", REMEDY)
        stream = streams[0]
        width, height = stream.codec_context.width, stream.codec_context.height
        if not fits_picture(width, height) or not fits_picture(*square_size(width, height, _aspect(stream))):
            got = f"{width}×{height} px" + (f" of shape {aspect}" if (aspect := _aspect(stream)) != 1 else "")
            raise InputError(file=path, got=got, expected=PICTURE_SIZES, remedy="give a smaller video")
        # The same pictures on every machine.
        stream.codec_context.thread_count = 1
        yield container, stream


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error).partition("\n")[0]


def index_packets(path: Path) -> PacketIndex:
    """Returns the packet index of a video without decoding it; of a damaged one, up to the damage."""
    import av

    found, broken, group, hidden = [], "", 0, 0
    with open_stream(path) as (container, stream):
        context = stream.codec_context
        vp8 = context.name == "vp8"
        try:
            for p in container.demux(stream):
                group += p.is_keyframe
                hidden += p.is_discard  # as of the frames before a cut, which only an edit list leaves out
                if p.size and not p.is_discard and (not vp8 or bytes(p)[0] & SHOWN):
                    found.append((p.pts, group))
                reject(len(found) > FRAMES, path, f"more than {FRAMES} frames", f"at most {FRAMES}", "cut the video")
        except av.FFmpegError as error:
            broken = _reason(error)
        return PacketIndex(
            tuple(pts for pts, _ in found), tuple(group for _, group in found), stream.time_base or Fraction(1, 1000),
            float(stream.average_rate or 0), max(int(stream.frames) - hidden, 0), broken,
            bool(context.has_b_frames), _aspect(stream),
        )  # fmt: skip


def _aspect(stream: Any) -> Fraction:
    return stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio or Fraction(1)


def square_size(width: int, height: int, aspect: Fraction) -> tuple[int, int]:
    """Returns the (width, height) that a picture gets when its pixels, of width / height `aspect`, are made square."""
    return (round(width * aspect), height) if aspect >= 1 else (width, round(height / aspect))


def decode_frames(path: Path, index: PacketIndex, wanted: list[int] | None = None) -> Iterator[tuple[int, Image]]:
    """Yields (frame, picture) in the order of showing; frames count from 1. wanted: only these frames; None: all."""
    ranks, last, count = index.ranks(), max(wanted or [0]), 0
    some = None if wanted is None else set(wanted)
    groups = None if some is None else index.groups(some)
    with open_stream(path) as (container, stream):
        for frame in _decoded(container, stream, groups):
            count += 1
            number = count if ranks is None or frame is None else ranks.get(frame.pts, 0)
            if frame is not None and not frame.is_corrupt and number and (some is None or number in some):
                yield number, picture_of(frame, index.aspect)
            if some is not None and number >= last:
                return


def _decoded(container: Any, stream: Any, groups: set[int] | None) -> Iterator[Any]:
    """Yields the decoded libav frames as shown, None for a packet that cannot be decoded, of these packet groups."""
    import av

    group, running = 0, False
    # Up to the first packet that cannot be read; the last, empty one flushes the decoder.
    with suppress(av.FFmpegError):
        for packet in container.demux(stream):
            group += packet.is_keyframe
            if not packet.size or groups is None or group in groups:
                running = True
                yield from _decode_packet(stream, packet)
            elif running:
                yield from _decode_packet(stream, None)
                stream.codec_context.flush_buffers()
                running = False


def _decode_packet(stream: Any, packet: Any) -> list[Any]:
    import av

    try:
        return list(stream.codec_context.decode(packet))
    except av.FFmpegError:
        return [None]


def picture_of(frame: Any, aspect: Fraction | None) -> Image:
    """Returns a decoded libav frame as a picture (H, W, 3), BGR, with square pixels. aspect: width / height of a stored
    pixel; None: 1."""
    import cv2

    # OpenCV is ten times as fast as swscale's exact conversion; swscale's default darkens by one or two grey levels.
    usual = frame.format.name == "yuv420p" and frame.colorspace in BT601 and frame.color_range in NARROW
    if usual and frame.width % 2 == 0 and frame.height % 2 == 0:
        image = np.asarray(cv2.cvtColor(frame.to_ndarray(), cv2.COLOR_YUV2BGR_I420), np.uint8)
    else:
        image = frame.reformat(format="bgr24", interpolation=EXACT).to_ndarray()
    size = square_size(frame.width, frame.height, aspect or Fraction(1))
    if size != (frame.width, frame.height):
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    turns = round(frame.rotation / 90) % 4
    return np.ascontiguousarray(np.rot90(image, turns)) if turns else image


QUALITY = 18  # x264's constant rate factor: visually near the original
WRITTEN_COLOURS, WRITTEN_RANGE = 6, 1  # libav's numbers of the colour matrix and range that OpenCV converts to


def rate_of(fps: float) -> Fraction:
    """Returns `fps` as the nearest fraction with a denominator up to 1001."""
    return Fraction(fps).limit_denominator(1001)


@contextmanager
def write_video(
    path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY, comment: str = ""
) -> Iterator[VideoWriter]:
    """Yields a VideoWriter for an H.264 mp4 file, which is complete after the block.

    size: (width, height) px, both even. quality: x264's constant rate factor, lower is better. Raises OSError if the
    file cannot be written, and WorkError if the finished video lacks pictures.
    """
    import av

    got, remedy = "pictures of {}×{} px".format(*size), "take --images jpg or png, or another camera.image"
    reject(size[0] % 2 or size[1] % 2, "", got, "an even width and height", remedy, "--images mp4")
    path.write_bytes(b"")  # libav makes no file without pictures
    with av.open(media_url(path), "w", format="mp4", options={"movflags": "faststart"}) as container:
        if comment:
            container.metadata["comment"] = comment
        made = VideoWriter(path, container, size, fps, quality)
        yield made
        container.mux(made.stream.encode(None))
    written = 0
    with suppress(av.FFmpegError, IndexError), av.open(media_url(path)) as container:
        written = sum(packet.size > 0 and not packet.is_corrupt for packet in container.demux(video=0))
    if made.count and written != made.count:
        got = f"{written} of {made.count} pictures in the finished video"
        raise WorkError(file=path, got=got, expected="all of them", remedy="free room on the disk, then run again")


class VideoWriter:
    """A video that is being written; made by `write_video`, which also ends and closes it.

    State: libav's open container and stream, and `count`, the number of pictures added.
    """

    def __init__(self, path: Path, container: Any, size: tuple[int, int], fps: float, quality: int):
        self.count, self._path, self._container = 0, path, container
        group = str(max(1, round(fps)))
        # x264's macroblock tree reads memory that it never wrote where pictures are not a multiple of 128 px wide, and
        # the same pictures give other bytes now and then.
        options = {"crf": str(quality), "preset": "veryfast", "g": group, "bf": "2", "threads": "1", "mbtree": "0"}
        self.stream = container.add_stream("libx264", rate=rate_of(fps), options=options)
        self.stream.width, self.stream.height = size
        self.stream.pix_fmt = "yuv420p"
        context = self.stream.codec_context
        # The same pictures give the same bytes.
        context.thread_count = 1
        context.color_range = WRITTEN_RANGE
        context.colorspace = context.color_primaries = context.color_trc = WRITTEN_COLOURS

    def add(self, picture: Image) -> None:
        """Appends a picture (H, W, 3) BGR uint8."""
        import av
        import cv2

        size = self.stream.width, self.stream.height
        require_size(picture, size, self._path, f"picture {self.count + 1}")
        planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), np.uint8)
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.color_range, frame.colorspace = WRITTEN_RANGE, WRITTEN_COLOURS
        self._container.mux(self.stream.encode(frame))
        self.count += 1
