"""camera.json and scene.json: a Camera and a Scene (the static world) as JSON, read back equal to the last bit.

A camera that moves has no camera.json, so that nobody projects with a wrong one, but a table of its poses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from scenarios.errors import reject
from sim.scene.camera import require_camera
from sim.store import tables
from sim.store.tables import Number, Pair, Triple
from sim.types import Camera, Scene

Pixels = Annotated[float, Field(strict=True, multiple_of=1)]


def camera_document(camera: Camera) -> dict[str, Any]:
    """Returns the content of camera.json: the fields of Camera; rotation is world to camera."""
    document = {"format": tables.FORMAT, **tables.plain(camera)}
    if not camera.radial:
        del document["radial"]
    return document


def read_camera(path: Path) -> Camera:
    """Returns the Camera in a camera.json; missing baseline and radial are 0, a missing px_per_m is nan."""
    found = tables.read_values(
        path, "correct it", "give a camera.json", kind=Literal["pinhole", "top"], image=tuple[Pixels, Pixels],
        focal_px=Pair, centre_px=Pair, position=Triple, rotation=tuple[Triple, Triple, Triple],
        baseline=(Number, 0.0), px_per_m=(Number | None, None), radial=(Number, 0.0),
    )  # fmt: skip
    reject(found.px_per_m is None and found.kind == "top", path, "null", "a scale for kind top", "add it", "px_per_m")
    camera = Camera(
        found.kind, (int(found.image[0]), int(found.image[1])), found.focal_px, found.centre_px,
        np.array(found.position), np.array(found.rotation), found.baseline, tables.none_to_nan(found.px_per_m),
        found.radial,
    )  # fmt: skip
    return require_camera(camera, path)


POSE = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))  # the rotation, row by row


def cameras_table(cameras: tuple[Camera, ...]) -> bytes:
    """Returns the content of gt/cameras.parquet, a row per frame: position, m, and rotation, world to camera. The lens,
    which is that of all frames, is in its metadata."""
    columns: tables.Columns = {
        "frame": np.arange(1, len(cameras) + 1), tables.AXES: np.array([c.position for c in cameras]).reshape(-1, 3),
        POSE: np.array([c.rotation.ravel() for c in cameras]).reshape(-1, 9),
    }  # fmt: skip
    first = cameras[0]
    facts = {key: tables.plain(getattr(first, key)) for key in ("image", "focal_px", "centre_px", "baseline")}
    return tables.table_bytes(columns, facts, tables.units_of("m"))


def read_cameras(path: Path, length: int) -> tuple[Camera, ...]:
    """Returns the Camera of each of the frames 1 … length in a gt/cameras.parquet."""
    table = tables.read_table(path)
    lens = table.facts_as(image=tuple[Pixels, Pixels], focal_px=Pair, centre_px=Pair, baseline=Number)
    frame, place, pose = table.ints("frame"), table.floats(*tables.AXES), table.floats(*POSE)
    whole = bool(np.array_equal(frame, np.arange(1, length + 1)))
    table.reject(not whole, "frame", f"{len(frame)} rows", f"a row for each of the frames 1 to {length}")
    size = int(lens.image[0]), int(lens.image[1])
    return tuple(
        require_camera(Camera("pinhole", size, lens.focal_px, lens.centre_px, p, r.reshape(3, 3), lens.baseline), path)
        for p, r in zip(place, pose, strict=True)
    )


def scene_document(scene: Scene) -> dict[str, Any]:
    """Returns the content of scene.json, all lengths in m: the fields of Scene as lists."""
    document = {"format": tables.FORMAT, **tables.plain(scene)}
    if not scene.boxes:
        del document["boxes"]
    return document


class _Stairs(BaseModel):
    foot: Pair
    head: Pair
    width: Number
    rise: Number
    steps: Number
    landing: Number


class _Box(BaseModel):
    at: Triple
    size: Triple
    turn_deg: Number
    tilt_deg: Number
    colour: Triple
    pattern: Literal["grain", "plain", "stripes", "checks"]
    period: Number
    gloss: Number


def read_scene(path: Path) -> Scene:
    """Returns the Scene in a scene.json."""
    segments = list[tuple[Pair, Pair]]
    found = tables.read_values(
        path, "correct it", size=Pair, walls=segments, pillars=list[Triple], doors=segments, service=list[Pair],
        stairs=list[_Stairs], wall_height=Number, pillar_height=Number, boxes=(list[_Box], ()),
    )  # fmt: skip
    return Scene.of(found, found.walls, found.doors)
