"""Mode `degraded` of `benchmarks.blob`: bare video whose pictures are spoilt in one of KINDS of ways.

Scenes of the catalogue (480 x 360, 10 frames/s, tilts of 15 and 20 degrees); the background sample is spread over the
video. The same frames are spoilt in each way, so that differences are paired.
Columns: HOTA, IDF1 (means over videos), IDSW and tracks of nobody per video, boxes reported over boxes labelled, CPU
milliseconds per frame (decoding left out). A track of nobody has not one box with an IoU of 0.5 with a label.
Rows "without …": one cure is switched off, on the videos that it is for; last cell: HOTA less that with the cure.

grey: grey pictures, noise of each channel, compressed as colour. tinted: the same, brownish. mpeg2, mpeg4, h264: at low
rates of bits. interlaced: the rows of a picture are of two moments. flicker: bands of lamps at 100 Hz run through it.
exposure: steps of brightness. dusk: low light, of which shot noise is most.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

import tracking
from benchmarks.support.in_memory import truth_in_view
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, head, row
from scenarios.loading.resolve import load
from sim.geometry.boxes import box_iou
from sim.pictures.background_sample import BackgroundChoice
from sim.sequence import simulate
from sim.types import Frame, Image, Tracks, Truth
from sim.types import Sequence as Recording
from tracking.detect import background, foreground
from tracking.running.run import track

SCENES = (("street", 20), ("cross", 15), ("mixed", 15), ("crowd", 20))
VIEW = ("image=[480,360]", "fps=20", "focal_px=600", "crop=true", "baseline=0")
FPS, SECONDS = 10, 12  # of the videos; they are rendered at twice the rate, for the second field
LEAST_IOU = 0.5
Pictures = list[Image]


def coded(pictures: Pictures, codec: str, rate: int, noise: float = 0.0, tint: Any = (1, 1, 1)) -> Pictures:
    """Returns the pictures after compression. rate: kbit/s. noise: standard deviation added to each channel, grey
    levels; tint (3,): factors of the channels."""
    import av

    r, file = np.random.default_rng(0), io.BytesIO()
    high, wide = pictures[0].shape[:2]
    with av.open(file, "w", format="matroska") as container:
        options = {"preset": "veryfast", "mbtree": "0"} if codec == "libx264" else {}  # same pictures, same bytes
        fps = Fraction(FPS if codec != "mpeg2video" else 25)  # MPEG-2 has no 10 frames/s
        stream: Any = container.add_stream(codec, rate=fps, options=options)
        stream.width, stream.height, stream.pix_fmt, stream.bit_rate = wide, high, "yuv420p", 1000 * rate
        stream.codec_context.thread_count, stream.codec_context.gop_size = 1, 12
        for picture in pictures:
            noisy = picture * np.asarray(tint, float) + noise * r.normal(size=picture.shape)
            seen = av.VideoFrame.from_ndarray(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), format="bgr24")
            container.mux(stream.encode(seen))
        container.mux(stream.encode(None))
    file.seek(0)
    with av.open(file) as container:
        return [frame.to_ndarray(format="bgr24") for frame in container.decode(video=0)]


def grey(pictures: Pictures, tint: Any = (1, 1, 1)) -> Pictures:
    return coded([np.repeat(p.mean(-1, keepdims=True), 3, -1) for p in pictures], "libx264", 900, 3.0, tint)


def flicker(pictures: Pictures) -> Pictures:
    rows = np.arange(len(pictures[0]))[:, None, None] / len(pictures[0])
    waves = [1 + 0.08 * np.sin(2 * np.pi * (1.5 * rows + 0.37 * k)) for k in range(len(pictures))]
    return [np.clip(np.rint(p * wave), 0, 255).astype(np.uint8) for p, wave in zip(pictures, waves, strict=True)]


def exposure(pictures: Pictures) -> Pictures:
    r = np.random.default_rng(0)
    gains = np.repeat(r.uniform(0.7, 1.3, len(pictures) // 15 + 1), 15)
    return [np.clip(np.rint(p * gain), 0, 255).astype(np.uint8) for p, gain in zip(pictures, gains, strict=False)]


def dusk(pictures: Pictures) -> Pictures:
    r = np.random.default_rng(0)  # 0.6 electrons per grey level
    return [np.clip(np.rint(r.poisson(0.6 * p) / 0.6), 0, 255).astype(np.uint8) for p in pictures]


def woven(pictures: Pictures, later: Pictures) -> Pictures:
    found = [p.copy() for p in pictures]
    for picture, second in zip(found, later, strict=True):
        picture[1::2] = second[1::2]
    return found


KINDS: dict[str, Callable[[Pictures], Pictures]] = {
    "as rendered": lambda pictures: pictures,
    "grey": grey,
    "tinted": partial(grey, tint=(0.7, 0.9, 1.05)),
    "mpeg2": partial(coded, codec="mpeg2video", rate=500, noise=3.0),
    "mpeg4": partial(coded, codec="mpeg4", rate=200),
    "h264": partial(coded, codec="libx264", rate=80),
    "interlaced": lambda pictures: pictures,
    "flicker": flicker,
    "exposure": exposure,
    "dusk": dusk,
}
# Cures by name, the code that switches each off, and the kinds of pictures that it is for.
CURES: dict[str, tuple[list[Replacement], tuple[str, ...]]] = {
    "learned shadows": ([(background, "darkest_shadow", lambda *_: None)], ("as rendered", "grey", "tinted")),
    "smoothing": ([(foreground, "window", lambda _: 1)], ("dusk",)),
}


@dataclass(frozen=True)
class Video:
    """A rendered video: pictures of its frames, pictures half a frame later, and the sequence with its truth."""

    sequence: Recording
    pictures: Pictures
    later: Pictures

    def spoilt(self, kind: str) -> Recording:
        """Returns the sequence with the pictures of a kind, and a background sample spread over them."""
        pictures = woven(self.pictures, self.later) if kind == "interlaced" else KINDS[kind](self.pictures)
        assert len(pictures) == len(self.pictures)

        def frames() -> Iterator[Frame]:
            return (Frame(k, (k - 1) / FPS, image=p) for k, p in enumerate(pictures, 1))

        chosen = BackgroundChoice().indices(len(pictures))
        sample = np.stack([pictures[k - 1] for k in chosen])
        return replace(self.sequence, frames=frames, load_background=lambda: sample)


def rendered(name: str, tilt: int, seed: int) -> Video:
    scenario = load(name, set=[f"camera.{s}" for s in (f"tilt_deg={tilt}", *VIEW)])
    pictures = []
    for frame in simulate(scenario, seed).frames():
        if frame.index > 2 * FPS * SECONDS:
            break
        assert frame.image is not None
        pictures.append(frame.image)
    shown, later = pictures[: len(pictures) // 2 * 2 : 2], pictures[1::2]
    live = simulate(scenario, seed, stride=2)
    truth = truth_in_view(live, len(shown))
    bare = replace(
        live, length=len(shown), load_truth=lambda: truth, bare=None, load_pixels=None, camera=None, scene=None,
        px_per_m=float("nan"),
    )  # fmt: skip
    return Video(bare, shown, later)


def measured(sequence: Recording) -> list[float]:
    """Returns HOTA, IDF1, IDSW, tracks of nobody, boxes reported over boxes labelled, CPU ms per frame."""
    begun = time.process_time()
    run = track("blob", sequence, detections="image")
    spent = (time.process_time() - begun) / len(run) * 1000
    truth = sequence.truth
    assert truth is not None
    scores = tracking.evaluate(truth, run, similarity="boxes")
    boxes = sum(len(t.id) for t in run) / max(len(truth.frame), 1)
    return [*(float(scores[k]) for k in ("HOTA", "IDF1", "IDSW")), tracks_of_nobody(truth, run), boxes, spent]


def tracks_of_nobody(truth: Truth, tracks: Iterable[Tracks]) -> int:
    """Returns the number of tracks without a box that has an IoU of LEAST_IOU with a labelled box."""
    every, right = set[int](), set[int]()
    assert truth.box is not None
    for found in tracks:
        assert found.box is not None
        every.update(found.id.tolist())
        near = box_iou(found.box[:, None], truth.box[truth.frame == found.index]) >= LEAST_IOU
        right.update(found.id[near.any(1)].tolist())
    return len(every - right)


def degraded(kinds: list[str], seeds: range) -> None:
    """Prints a row for each kind of pictures, and one for each cure that is for it."""
    videos = [rendered(name, tilt, seed) for name, tilt in SCENES for seed in seeds]
    head([f"{len(videos)} videos", "HOTA", "IDF1", "IDSW", "tracks of nobody", "boxes", "CPU ms", "HOTA less"])
    for kind in kinds or KINDS:
        made = [video.spoilt(kind) for video in videos]
        base = np.array([measured(sequence) for sequence in made])
        row([kind, *cells(base), ""])
        for name, (changes, of) in CURES.items():
            if kind in of:
                with replaced_code(changes):
                    found = np.array([measured(sequence) for sequence in made])
                row([f"{kind}, without {name}", *cells(found), difference_cell(found[:, 0] - base[:, 0])])


def cells(found: Any) -> list[str]:
    return [f"{v:.{digits}f}" for v, digits in zip(found.mean(0), (3, 3, 1, 1, 2, 1), strict=True)]
