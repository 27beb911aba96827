"""Pictures painted by hand: people as body and head on a mottled ground, with shadows, posts and noise."""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterable, Sequence

import numpy as np

from sim.types import Context, Frame, Tracker, Tracks
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracker import Blob

# px, frames per second, and how high a person is.
HIGH, WIDE, FPS, TALL = 240, 320, 10.0, 68.0

# Middle and lower edge of the box, and height, px.
Person = tuple[float, float, float]


@functools.cache
def ground(seed: int = 0) -> np.ndarray:
    """(H, W, 3) a mottled ground in three greys, so that no shift of it is the same."""
    r = np.random.default_rng(seed)
    rough = r.uniform(90, 170, (HIGH // 8 + 1, WIDE // 8 + 1, 3))
    return np.kron(rough, np.ones((8, 8, 1)))[:HIGH, :WIDE].astype(np.float32)


def inside(x: float, y: float, across: float, up: float) -> np.ndarray:
    """(H, W) pixels of an ellipse with these half axes."""
    v, u = np.arange(HIGH)[:, None] + 0.5, np.arange(WIDE) + 0.5
    return ((u - x) / across) ** 2 + ((v - y) / up) ** 2 <= 1


def shape(person: Person) -> np.ndarray:
    """(H, W) pixels of body and head."""
    x, foot, h = person
    return inside(x, foot - 0.44 * h, 0.15 * h, 0.44 * h) | inside(x, foot - 0.92 * h, 0.06 * h, 0.08 * h)


def box(person: Person) -> np.ndarray:
    """ltwh of body and head."""
    x, foot, h = person
    return np.array([x - 0.15 * h, foot - h, 0.3 * h, h])


COLOURS = ((30, 20, 190), (190, 30, 20), (20, 170, 40), (20, 20, 25))


def picture(
    people: Sequence[Person], r: np.random.Generator, *, shadow: float = 0.0, post: float | None = None, seed: int = 0
) -> np.ndarray:
    """(H, W, 3) uint8. shadow: how much darker the ground is beside each; post: the middle of one 6 px wide."""
    image = ground(seed).copy()
    for x, foot, h in people:
        if shadow:
            image[inside(x + 0.4 * h, foot - 2, 0.4 * h, 0.08 * h)] *= 1 - shadow
    for k in sorted(range(len(people)), key=lambda k: people[k][1]):
        image[shape(people[k])] = COLOURS[k % len(COLOURS)]
    if post is not None:
        image[:, int(post) - 3 : int(post) + 3] = (60, 90, 60)
    image += 2 * r.standard_normal(image.shape, np.float32)
    made = np.clip(image, 0, 255, out=image).astype(np.uint8)
    made.setflags(write=False)  # as in frames; kernels are compiled anew for what can be written
    return made


def sample(r: np.random.Generator, frames: int = 20, people: Sequence[Person] = (), **kind) -> np.ndarray:
    """(K, H, W, 3) pictures of the empty ground, or with one of these people in each in turn."""
    return np.stack([picture([people[k % len(people)]] if people else [], r, **kind) for k in range(frames)])


def spread(height: float = TALL) -> list[Person]:
    """People all over the picture, one at a time, for a sample that shows how high they are."""
    return [(30.0 + 20 * k, 100.0 + 6 * k, height) for k in range(14)]


def watched(tracker: Tracker, frames: Iterable[Sequence[Person]], scale: float, sample: np.ndarray) -> list[Tracks]:
    """What a tracker says of pictures of these people; scale: px per m, as it is told."""
    r = np.random.default_rng(1)
    tracker.reset(Context(FPS, scale, image_size=(WIDE, HIGH), background=sample), 0)
    pictures = (picture(people, r) for people in frames)
    return [tracker.step(Frame(k + 1, k / FPS, image=image), None) for k, image in enumerate(pictures)]


@functools.cache
def learned(config, people: tuple[Person, ...], seed: int, size, **still) -> tuple[Blob, np.random.Generator]:
    """A tracker that knows the ground, and what draws the noise of the pictures after its sample; to be copied."""
    r, tracker = np.random.default_rng(seed), Blob(config)
    tracker.reset(Context(FPS, TALL / 1.7, image_size=size, background=sample(r, 14, people, **still)), 0)
    return tracker, r


def track(
    frames: Sequence[Sequence[Person] | np.ndarray | None],
    config: BlobConfig | None = None,
    *,
    people: Sequence[Person] | None = None,
    seed: int = 0,
    watch=None,
    size: tuple[int, int] | None = (WIDE, HIGH),
    **kind,
) -> list[Tracks]:
    """Tracks of `blob` on pictures, or on people to be painted; None is a lost frame.

    people: those in the sample; size: what the tracker is told of the image.
    """
    shown = spread() if people is None else people
    still = {k: v for k, v in kind.items() if k != "shadow"}
    tracker, r = copy.deepcopy(learned(config, tuple(shown), seed, size, **still))
    made = []
    for k, people_or_image in enumerate(frames):
        image = people_or_image
        if image is not None and not isinstance(image, np.ndarray):
            image = picture(image, r, **kind)
        made.append(tracker.step(Frame(k + 1, k / FPS, image=image), None))
        if watch is not None:
            watch(tracker, made[-1])
    return made


def ids(tracks: Iterable[Tracks]) -> set[int]:
    """All ids that are reported."""
    return {int(i) for t in tracks for i in t.id}


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """IoU of two boxes ltwh."""
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[:2] + a[2:], b[:2] + b[2:])
    shared = np.prod(np.maximum(high - low, 0))
    return float(shared / (np.prod(a[2:]) + np.prod(b[2:]) - shared))
