"""Our own store: one folder per sequence, complete when its manifest.json is there, read back equal to the last bit.

The manifest names every file with its hash, the resolved scenario's hash, versions and the CPU's feature level, and
no time, host or path: the same seed, scenario and versions give the same bytes.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io import tables, truths
from sim.io.atomic import write_folder
from sim.io.cameras import camera_document, read_camera, read_scene, scene_document
from sim.io.events import read_script
from sim.io.sample import Choice
from sim.types import Detections, Frame, Sequence

__all__ = ["is_sequence", "open_sequence", "read_camera", "read_manifest", "sequence_files", "write_sequence"]

SCHEMA = 1
MANIFEST = "manifest.json"
REDO = "run the same `flockscope generate` again"
LIBRARIES = ("numpy", "scipy", "numba", "pymunk", "pyarrow", "pydantic")


def write_sequence(folder: Path, sequence: Sequence, *, scenario: str, seed: int, repeat: int = 0) -> Path:
    """Store a sequence as `folder`, whole or not at all; `scenario` is the resolved scenario's TOML."""
    write_folder(folder, sequence_files(sequence, scenario=scenario, seed=seed, repeat=repeat))
    return folder


def sequence_files(sequence: Sequence, *, scenario: str, seed: int, repeat: int = 0) -> dict[str, bytes]:
    """All files of a sequence by name, the manifest last."""
    frames = list(sequence.without_pictures())
    found = [f.detections for f in frames if f.detections is not None]
    assert len(found) in (0, len(frames)), "a sensor answers every frame or none"
    files = {"scenario.toml": scenario.encode(), "seqinfo.ini": _seqinfo(sequence, len(frames))}
    if sequence.camera is not None:
        files["camera.json"] = tables.document(camera_document(sequence.camera))
    if sequence.scene is not None:
        files["scene.json"] = tables.document(scene_document(sequence.scene))
    if sequence.truth is not None:
        files |= truths.truth_files(sequence.truth)
    if found:
        files |= truths.detection_files(found, sequence.fps, sequence.scene)
    files = dict(sorted(files.items()))
    manifest = _manifest(sequence, found, len(frames), scenario, seed, repeat)
    listed = {name: {"sha256": hashing.file_hash(body), "bytes": len(body)} for name, body in files.items()}
    return {**files, MANIFEST: tables.document(sealed({**manifest, "files": listed}))}


def sealed(manifest: dict[str, Any]) -> dict[str, Any]:
    """The manifest with the hash of all its other fields as `sha256`, so that none can change unnoticed."""
    body = {key: value for key, value in manifest.items() if key != "sha256"}
    return {**body, "sha256": hashing.canonical_hash(body)}


def identity(scenario: str, seed: int, repeat: int) -> dict[str, Any]:
    """What says that a stored sequence is the one asked for."""
    return {
        "format": tables.FORMAT,
        "schema": SCHEMA,
        "engine": hashing.ENGINE,
        "seed": seed,
        "repeat": repeat,
        "scenario_hash": hashing.scenario_hash(scenario),
    }


def _manifest(
    sequence: Sequence, found: list[Detections], length: int, scenario: str, seed: int, repeat: int
) -> dict[str, Any]:
    truth = hashing.truth_hash(scenario, seed, repeat, sequence.truth)
    return {
        **identity(scenario, seed, repeat),
        "truth_hash": truth,
        "content_hash": hashing.content_hash(truth, found),
        "sequence": {
            "name": sequence.name,
            "fps": sequence.fps,
            "length": length,
            "image_size": None if sequence.image_size is None else list(sequence.image_size),
            "px_per_m": tables.finite(sequence.px_per_m),
        },
        "streams": [],
        "cpu": hashing.cpu_level(),
        "versions": versions(),
    }


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of what a sequence's bytes depend on."""
    found = {"python": platform.python_version()}
    for name in ("flockscope", *LIBRARIES):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def _seqinfo(sequence: Sequence, length: int) -> bytes:
    width, height = sequence.image_size or (0, 0)
    lines = [
        f"name={sequence.name}",
        "imDir=img1",
        f"frameRate={str(sequence.fps).removesuffix('.0')}",
        f"seqLength={length}",
    ]
    if sequence.image_size is not None:
        lines += [f"imWidth={width}", f"imHeight={height}", "imExt=.jpg"]
    return "\n".join(["[Sequence]", *lines, ""]).encode()


def is_sequence(folder: Path) -> bool:
    """Whether a folder is, or was meant to be, a stored sequence of ours."""
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest; InputError where it is missing, broken, altered or of another format."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(file=path, got="missing", expected="the manifest of a complete sequence", remedy=REDO)
    manifest = tables.read_json(path)
    if manifest.get("format") != tables.FORMAT:
        raise InputError(
            file=path, place="format", got=manifest.get("format"), expected=tables.FORMAT, remedy="use the same version"
        )
    missing = {"sequence", "files", "seed", "repeat", "scenario_hash", "truth_hash", "content_hash", "sha256"}
    missing -= manifest.keys()
    if missing:
        raise InputError(file=path, got=f"no {', '.join(sorted(missing))}", expected="all keys", remedy=REDO)
    if manifest["sha256"] != sealed(manifest)["sha256"]:
        raise InputError(file=path, got="altered fields", expected="those that its sha256 names", remedy=REDO)
    return manifest


def altered(folder: Path, manifest: dict[str, Any]) -> Iterator[InputError]:
    """Each file that is missing or not the one of the manifest."""
    for name, facts in manifest["files"].items():
        path = folder / name
        wanted = f"the file of {facts['bytes']} bytes that manifest.json names"
        try:
            body = path.read_bytes()
        except OSError:
            yield InputError(file=path, got="missing", expected=wanted, remedy=REDO)
            continue
        if hashing.file_hash(body) != facts["sha256"]:
            kind = "truncated" if len(body) < facts["bytes"] else "altered"
            yield InputError(file=path, got=f"{kind}: {len(body)} bytes", expected=wanted, remedy=REDO)


def open_sequence(folder: Path, *, background: Choice | None = None) -> Sequence:
    """A stored sequence, equal to the one written; InputError about the first file that is missing or altered."""
    manifest = read_manifest(folder)
    for error in altered(folder, manifest):
        raise error
    about, has = manifest["sequence"], manifest["files"].keys()
    size, length, fps = about["image_size"], about["length"], about["fps"]

    @lru_cache(maxsize=1)
    def detections() -> list[Detections]:
        return truths.read_detections(folder / "det" / "det.parquet")

    def frames() -> Iterator[Frame]:
        for index in range(1, length + 1):
            here = detections()[index - 1] if "det/det.parquet" in has else None
            yield Frame(index, (index - 1) / fps, detections=here)

    return Sequence(
        name=about["name"], fps=fps, length=length, frames=frames,
        load_truth=(lambda: truths.read_truth(folder)) if "gt/truth.parquet" in has else None,
        image_size=None if size is None else (size[0], size[1]),
        camera=read_camera(folder / "camera.json") if "camera.json" in has else None,
        scene=read_scene(folder / "scene.json") if "scene.json" in has else None,
        px_per_m=tables.number(about["px_per_m"]),
        has_detections="det/det.parquet" in has,
        load_people=(lambda: _people(folder, manifest)) if "gt/script.json" in has else None,
        source={
            "kind": "generated", "path": str(folder), "seed": manifest["seed"], "repeat": manifest["repeat"],
            "truth_hash": manifest["truth_hash"],
        },
    )  # fmt: skip


def _people(folder: Path, manifest: dict[str, Any]) -> dict[str, tuple[int, ...]]:
    """Ids of the people of each group of the script, cast anew from the stored scenario and seed."""
    from scenarios import load
    from sim.sequence import named_people

    scene, orders = read_scene(folder / "scene.json"), read_script(folder / "gt" / "script.json")
    return named_people(load(folder / "scenario.toml"), scene, manifest["seed"], manifest["repeat"], orders)
