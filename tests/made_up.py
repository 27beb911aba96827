"""Random truths, tracks and sequences, with every field in use, and a strict comparison."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from sim.scene.camera import camera_rotation
from sim.types import (
    Camera,
    Detections,
    Frame,
    GroupEvent,
    Groups,
    Near,
    Order,
    PixelTruth,
    Scene,
    Sequence,
    Stairs,
    Tracks,
    Truth,
)


def same(a: Any, b: Any, place: str = "") -> None:
    """Equal kinds, shapes and bits, all the way down."""
    assert type(a) is type(b), f"{place}: {type(a)} {type(b)}"
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype, place
        assert a.shape == b.shape, f"{place}: {a.shape} {b.shape}"
        assert np.array_equal(a, b, equal_nan=a.dtype.kind == "f"), place
    elif is_dataclass(a):
        for f in fields(a):
            if not callable(getattr(a, f.name)) and f.name not in ("source", "load_people", "load_light"):
                same(getattr(a, f.name), getattr(b, f.name), f"{place}.{f.name}")
    elif isinstance(a, (tuple, list)):
        assert len(a) == len(b), place
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            same(x, y, f"{place}[{k}]")
    else:
        assert a == b or (a != a and b != b), f"{place}: {a} {b}"


def groups(r: np.random.Generator, id: np.ndarray, group: np.ndarray, scale: float = 1.0) -> Groups:
    names = np.unique(group[group >= 0])
    n = len(names)
    return Groups(
        names, tuple(id[group == g] for g in names), r.normal(size=(n, 2)) * scale, r.normal(size=(n, 2)) * scale,
        r.normal(size=(n, 2, 2)), np.array([float((group == g).sum()) for g in names]),
        tuple(r.normal(size=(int(r.integers(3, 9)), 2)) * scale for _ in names),
    )  # fmt: skip


def event(r: np.random.Generator, length: int, emitted: int | None = None) -> GroupEvent:
    start = int(r.integers(1, length + 1))
    pos = (float(r.normal()), float("nan") if r.random() < 0.2 else float(r.normal()))
    return GroupEvent("merge", start, length, emitted, (-1, 2), (2,), (1, 2, 3), pos)


def truth(r: np.random.Generator, length: int = 12, people: int = 5) -> Truth:
    here = r.random((length, people)) < 0.8
    frame, column = (a.astype(np.int64) for a in np.nonzero(here))
    frame, id, n = frame + 1, column + 1, len(frame)
    group = np.where(id <= 2, 1, np.where(id <= 4, 7, -1))
    box = np.c_[r.normal(size=(n, 2)) * 100, r.uniform(5, 50, (n, 2))]
    cut = [np.flatnonzero(frame == f) for f in range(1, length + 1)]
    visible = box.copy()
    visible[::3] = np.nan
    labelled = np.ones(length, bool)
    labelled[: length // 4] = False
    return Truth(
        name="fake", fps=10.0, length=length, px_per_m=float(r.uniform(20, 60)), frame=frame, id=id, group=group,
        pos=r.normal(size=(n, 2)), vel=r.normal(size=(n, 2)), box=box, visibility=r.random(n), z=r.random(n),
        heading=r.normal(size=n), height=r.uniform(1.5, 1.9, n), truncation=r.random(n), visible_box=visible,
        groups=tuple(groups(r, id[c], group[c]) for c in cut),
        groups_px=tuple(groups(r, id[c], group[c], 100.0) for c in cut),
        labelled=labelled, events=tuple(event(r, length) for _ in range(3)),
        near=Near(*np.sort(r.integers(1, length + 1, (2, 4)), axis=0), *r.integers(1, length + 1, (2, 4))),
        orders=(
            Order("m1", "merge", 1, ((1, 2), (3,)), ((1, 2, 3),)),
            Order("s1", "split", None, ((1, 2),), ((1,), (2,))),
        ),
    )  # fmt: skip


def detections(r: np.random.Generator, index: int, fps: float = 10.0) -> Detections:
    m = int(r.integers(0, 5))
    box = np.c_[r.normal(size=(m, 2)) * 100, r.uniform(5, 50, (m, 2))]
    return Detections(index, (index - 1) / fps, "ground", r.normal(size=(m, 2)), None, box, r.random(m))


def make_sequence(seed: int, length: int = 12) -> Sequence:
    r = np.random.default_rng(seed)
    found = truth(r, length)
    camera = Camera(
        "pinhole", (640, 480), (500.1, 500.2), (320.0, 240.0), np.array([*r.normal(size=2), 5.1]),
        camera_rotation(0.6, float(r.normal())), 0.12,
    )  # fmt: skip
    stairs = (Stairs(np.array([-1.0, 0.0]), np.array([1.0, 0.5]), 2.0, 1.5, 10, 4.0),)
    scene = Scene(
        np.array([16.0, 10.0]), r.normal(size=(2, 2, 2)), r.normal(size=(1, 3)), stairs=stairs, wall_height=2.4
    )  # fmt: skip
    every = [detections(r, k) for k in range(1, length + 1)]
    return Sequence(
        name="fake-s00001", fps=10.0, length=length,
        frames=lambda: (Frame(d.index, d.t, detections=d) for d in every),
        load_truth=lambda: found, image_size=(640, 480), camera=camera, scene=scene, px_per_m=found.px_per_m,
        has_detections=True,
    )  # fmt: skip


SIZE = (64, 48)


def pixel_truth(r: np.random.Generator, rows: int, stereo: bool) -> PixelTruth:
    ids = r.choice([-2, 0, 1, 2, 999], (SIZE[1], SIZE[0]), p=[0.1, 0.6, 0.1, 0.1, 0.1])
    far = r.integers(1, 5000, ids.shape) / 64
    box = np.c_[r.uniform(0, 40, (rows, 2)), r.uniform(1, 9, (rows, 2))]
    box[::4] = np.nan
    return PixelTruth(
        ids, np.where(r.random(ids.shape) < 0.1, np.nan, far) if stereo else None,
        np.floor(r.uniform(0, 90, rows)), np.floor(r.uniform(90, 99, rows)), box, r.integers(-1, 3, rows),
    )  # fmt: skip


def make_pictured(seed: int, streams: tuple[str, ...], length: int = 12) -> Sequence:
    """A sequence with random soft pictures: each a function of seed and frame alone."""
    plain = make_sequence(seed, length)
    truth = plain.truth

    def picture(kind: int, k: int) -> np.ndarray:
        small = np.random.default_rng([seed, kind, k]).integers(0, 255, (3, 4, 3))
        return np.kron(small, np.ones((16, 16, 1))).astype(np.uint8)

    def frames() -> Iterator[Frame]:
        for f in plain:
            left = picture(0, f.index) if "left" in streams else None
            yield f.replace(image=left, right=picture(1, f.index) if "right" in streams else None)

    def pixels(index: int) -> PixelTruth:
        rows = truth.rows(index)
        return pixel_truth(np.random.default_rng([seed, 2, index]), rows.stop - rows.start, "disparity" in streams)

    return replace(
        plain, frames=frames, bare=plain.frames, image_size=SIZE, has_images="left" in streams,
        has_right="right" in streams, load_pixels=pixels if streams else None,
        load_background=(lambda: np.stack([picture(3, k) for k in range(50)])) if streams else None,
    )  # fmt: skip


def make_in_view(seed: int, streams: tuple[str, ...], length: int = 12) -> Sequence:
    """As `make_pictured`, with all boxes near the picture or in it."""
    live = make_pictured(seed, streams, length)
    box = np.random.default_rng([seed, 4]).uniform((-8, -8, 5, 5), (64, 48, 20, 30), (len(live.truth.id), 4))
    truth = live.truth.replace(box=box)
    return replace(live, load_truth=lambda: truth)


def make_tracks(
    seed: int, length: int = 9, plane: str = "ground", unit: str = "person", boxed: bool = True
) -> list[Tracks]:
    r = np.random.default_rng(seed)
    d = 3 if plane == "space" else 2
    found = []
    for index in range(1, length + 1):
        n = int(r.integers(0, 5))
        id = r.permutation(10)[:n].astype(np.int64)
        group = id.copy() if unit == "group" else r.integers(-1, 3, n)
        known = groups(r, id, group)
        known = known.replace(members=()) if unit == "group" else known
        box = np.c_[r.normal(size=(n, 2)) * 100, r.uniform(5, 50, (n, 2))] if boxed and index != 3 else None
        found.append(
            Tracks(
                index, (index - 1) / 10, plane, unit, id, group, r.normal(size=(n, d)), r.normal(size=(n, d)),
                r.normal(size=(n, 2 * d, 2 * d)), box, r.random(n), known if index != 2 else None,
                (event(r, length, index),) if index % 4 == 0 else (), seen=id % 2 == 0,
            )
        )  # fmt: skip
    return found
