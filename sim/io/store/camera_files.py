"""camera.json and scene.json: a Camera and a Scene (the static world) as JSON, read back equal to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE
from sim.io.files import tables
from sim.scene.camera_check import require_camera
from sim.types import Array, Camera, Scene, Stairs


def camera_document(camera: Camera) -> dict[str, Any]:
    """Returns the content of camera.json: the fields of Camera; rotation is world to camera."""
    distortion = {"radial": camera.radial} if camera.radial else {}
    return {
        "format": tables.FORMAT,
        "kind": camera.kind,
        "image": list(camera.image),
        "focal_px": list(camera.focal_px),
        "centre_px": list(camera.centre_px),
        "position": camera.position.tolist(),
        "rotation": camera.rotation.tolist(),
        "baseline": camera.baseline,
        "px_per_m": tables.nan_to_none(camera.px_per_m),
        **distortion,
    }


def read_camera(path: Path) -> Camera:
    """Reads a camera.json; missing baseline and radial are 0, a missing px_per_m is nan."""
    d = tables.read_document(path)
    kind = _key(path, d, "kind")
    if kind not in ("pinhole", "top"):
        raise InputError(file=path, place="kind", got=repr(kind), expected='"pinhole" or "top"', remedy="correct it")
    width, height = _numbers(path, d, "image", (2,))
    if width != round(width) or height != round(height):
        got = f"{width:g}×{height:g}"
        raise InputError(file=path, place="image", got=got, expected="whole numbers of px", remedy="correct it")
    fx, fy = _numbers(path, d, "focal_px", (2,))
    cx, cy = _numbers(path, d, "centre_px", (2,))
    scale = d.get("px_per_m")
    if scale is None and kind == "top":
        raise InputError(file=path, place="px_per_m", got="null", expected="a scale for kind top", remedy="add it")
    camera = Camera(
        kind=kind, image=(int(width), int(height)), focal_px=(float(fx), float(fy)), centre_px=(float(cx), float(cy)),
        position=_numbers(path, d, "position", (3,)), rotation=_numbers(path, d, "rotation", (3, 3)),
        baseline=float(_numbers(path, {"baseline": d.get("baseline", 0.0)}, "baseline", ())),
        px_per_m=float("nan") if scale is None else float(_numbers(path, d, "px_per_m", ())),
        radial=float(_numbers(path, {"radial": d.get("radial", 0.0)}, "radial", ())),
    )  # fmt: skip
    return require_camera(camera, path)


def scene_document(scene: Scene) -> dict[str, Any]:
    """Returns the content of scene.json, all lengths in m: the fields of Scene as lists."""
    stairs = [
        {"foot": s.foot.tolist(), "head": s.head.tolist(), "width": s.width, "rise": s.rise, "steps": s.steps,
         "landing": s.landing}
        for s in scene.stairs
    ]  # fmt: skip
    arrays = {name: getattr(scene, name).tolist() for name in ("size", "walls", "pillars", "doors", "service")}
    heights = {"wall_height": scene.wall_height, "pillar_height": scene.pillar_height}
    return {"format": tables.FORMAT, **arrays, "stairs": stairs, **heights}


def read_scene(path: Path) -> Scene:
    """Reads a scene.json."""
    d = tables.read_document(path)
    stairs = _key(path, d, "stairs")
    if not isinstance(stairs, list) or not all(isinstance(s, dict) for s in stairs):
        got = repr(stairs)
        raise InputError(file=path, place="stairs", got=got, expected="a list of objects", remedy="correct it")

    def flight(k: int, s: dict[str, Any]) -> Stairs:
        place = f"stairs[{k}]."
        one = {f"{place}{name}": value for name, value in s.items()}
        width, rise, steps, landing = (
            float(_numbers(path, one, place + name, ())) for name in ("width", "rise", "steps", "landing")
        )
        foot, head = (_numbers(path, one, place + name, (2,)) for name in ("foot", "head"))
        return Stairs(foot, head, width, rise, int(steps), landing)

    return Scene(
        size=_numbers(path, d, "size", (2,)),
        walls=_numbers(path, d, "walls", (-1, 2, 2)),
        pillars=_numbers(path, d, "pillars", (-1, 3)),
        doors=_numbers(path, d, "doors", (-1, 2, 2)),
        service=_numbers(path, d, "service", (-1, 2)),
        stairs=tuple(flight(k, s) for k, s in enumerate(stairs)),
        wall_height=float(_numbers(path, d, "wall_height", ())),
        pillar_height=float(_numbers(path, d, "pillar_height", ())),
    )


def _key(path: Path, d: dict[str, Any], key: str) -> Any:
    if key not in d:
        raise InputError(file=path, place=key, got="no such key", expected="a value", remedy="add the key")
    return d[key]


def _numbers(path: Path, d: dict[str, Any], key: str, shape: tuple[int, ...]) -> Array:
    """Returns the numbers under `key` as an array of this shape; -1 in front stands for any length."""
    value = _key(path, d, key)
    try:
        a = np.asarray(value)
        a = a.astype(np.float64) if a.dtype.kind in "iuf" else np.array(np.nan)
    except (TypeError, ValueError):
        a = np.array(np.nan)
    free = shape[:1] == (-1,)
    if free and value == []:
        a = np.zeros((0, *shape[1:]))
    fits = a.shape == shape or (free and a.ndim == len(shape) and a.shape[1:] == shape[1:])
    if not fits or not (np.abs(a) <= COORDINATE).all():
        wanted = f"numbers of shape {shape} within {COORDINATE:g}" if shape else f"a number within {COORDINATE:g}"
        raise InputError(file=path, place=key, got=repr(value), expected=wanted, remedy="correct it")
    return a
