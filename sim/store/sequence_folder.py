"""Writes and reads sequences in the project's own format: one folder per sequence.

A sequence that is read back equals the one written to the last bit, except pictures in a lossy file type (jpg, mp4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, printable, reject
from sim import hashing
from sim.hashing import versions
from sim.pictures.background_sample import BackgroundChoice
from sim.pictures.stored_pictures import StoredPictures, write_pictures
from sim.rng import look_seed
from sim.store import atomic, seal, tables, truth_files
from sim.store.camera_files import camera_document, cameras_table, read_camera, read_cameras, read_scene, scene_document
from sim.store.group_files import IMMOBILE, NEVER_ARRIVES
from sim.store.own_files import is_side_file
from sim.store.recorded_sequence import recorded_sequence
from sim.store.seal import MANIFEST, REDO, is_own_sequence, read_manifest
from sim.streams import check_streams, coding, is_picture
from sim.types import Array, Detections, Sequence, Truth

NOTHING: Mapping[str, Any] = {}
CAMERAS = "gt/cameras.parquet"


def write_sequence(
    folder: Path, sequence: Sequence, *, scenario: str, seed: int, repeat: int = 0, streams: Iterable[str] = (),
    images: str = "jpg", background: bool = True, keep: Callable[[], bool] = lambda: False,
) -> Path:  # fmt: skip
    """Writes a sequence as a folder, complete or not at all.

    Args:
        folder: Folder to write; a sequence in it is replaced.
        sequence: The sequence to write.
        scenario: TOML text of the resolved scenario.
        seed: Seed of the simulation.
        repeat: Number of the suite entry's copy, 0 without copies.
        streams: Pictures to store: "left", "right", "disparity", "ids", "background".
        images: File type of the pictures, "jpg", "png" or "mp4".
        background: True adds the stream "background" to "left" and "right".
        keep: Called before an existing folder is replaced; if it returns True, that folder stays.

    Returns:
        The folder.

    Raises:
        InputError: A stream is unknown or missing, or a file that flockscope did not write would be lost.
        WorkError: The disk is full, an order of the script failed, or a stream cannot hold an id or disparity.
    """
    wanted, names = check_streams(streams, images, background), set[str]()
    with atomic.new_folder(folder, lambda: keep() or _refuse_foreign(folder, names)) as partial:
        truth = sequence.truth  # raises for a failed script before a picture is drawn
        assert truth is None or truth.length == sequence.length
        pixels = write_pictures(partial, sequence, wanted, images)
        pictures = {path.relative_to(partial).as_posix(): path for path in partial.rglob("*") if path.is_file()}
        files = sequence_files(sequence, scenario, seed, repeat, images, pixels, pictures)
        for name, body in files.items():
            atomic.write_inside(partial / name, body)
        names |= {*files, *pictures}
    return folder


def _refuse_foreign(folder: Path, names: set[str]) -> bool:
    ours = names if is_own_sequence(folder) else set()
    with suppress(InputError):  # a damaged or missing manifest lists nothing
        ours = ours | read_manifest(folder)["files"].keys()
    found = sorted(path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    for path in found if folder.is_dir() else [folder]:
        inside = path.relative_to(folder)
        if inside.as_posix() not in ours and not is_side_file(inside):
            got, expected = f"{path}, a file that flockscope did not write", "its own files only"
            raise InputError(file=folder, got=got, expected=expected, remedy="move it away, or choose another --out")
    return False


def sequence_files(
    sequence: Sequence, scenario: str, seed: int, repeat: int = 0, images: str = "jpg",
    pixels: Mapping[str, str] = NOTHING, pictures: Mapping[str, Path] = NOTHING,
) -> dict[str, bytes]:  # fmt: skip
    """Returns the files of a sequence except its pictures: content by name, the manifest last.

    images: file type of the pictures. pixels: what `write_pictures` returned. pictures: the files that it wrote.
    """
    frames = list(sequence.without_pictures())
    found = [f.detections for f in frames if f.detections is not None]
    assert len(found) in (0, len(frames)), "a sensor gives detections for every frame or for none"
    files = {"scenario.toml": scenario.encode(), "seqinfo.ini": _seqinfo(sequence, len(frames), coding(pixels, images))}
    if sequence.camera is not None:
        files["camera.json"] = tables.json_document(camera_document(sequence.camera))
    if sequence.load_cameras is not None:
        files[CAMERAS] = cameras_table(sequence.load_cameras())
    if sequence.scene is not None:
        files["scene.json"] = tables.json_document(scene_document(sequence.scene))
    if sequence.truth is not None:
        files |= truth_files.truth_files(sequence.truth)
    if sequence.never_arrive:
        files[NEVER_ARRIVES] = tables.json_list("groups", map(asdict, sequence.never_arrive))
    if sequence.immobile:
        files[IMMOBILE] = tables.json_list("people", map(asdict, sequence.immobile))
    if found:
        files |= truth_files.detection_files(found, sequence.fps, sequence.scene)
    if found and sequence.load_owners is not None:
        files["gt/det_ids.txt"] = truth_files.owner_text(sequence.load_owners())
    files = dict(sorted(files.items()))
    truth = hashing.truth_hash(scenario, seed, repeat, sequence.truth)
    manifest: dict[str, Any] = {
        **seal.identity(scenario, seed, repeat, pixels, images),
        **{key: sequence.source[key] for key in ("origin", "stride") if key in sequence.source},
        "pixels": dict(pixels), "truth_hash": truth, "content_hash": hashing.content_hash(truth, found, pixels),
        "sequence": {
            "name": sequence.name, "fps": sequence.fps, "length": len(frames),
            "image_size": None if sequence.image_size is None else list(sequence.image_size),
            "px_per_m": tables.plain(sequence.px_per_m),
        },
        "versions": versions(bool(pixels)), "files": seal.file_facts({**files, **pictures}),
    }  # fmt: skip
    return {**files, MANIFEST: tables.json_document(seal.with_hash(manifest))}


def _seqinfo(sequence: Sequence, length: int, images: str | None) -> bytes:
    # imDir is always img1, so that MOTChallenge tools accept it.
    lines = ["[Sequence]", f"name={printable(sequence.name)}", "imDir=img1"]
    lines += [f"frameRate={str(sequence.fps).removesuffix('.0')}", f"seqLength={length}"]
    if sequence.image_size is not None:
        width, height = sequence.image_size
        lines += [f"imWidth={width}", f"imHeight={height}", f"imExt={'.png' if images == 'png' else '.jpg'}"]
    return "\n".join([*lines, ""]).encode()


def open_sequence(folder: Path, *, background: BackgroundChoice | None = None) -> Sequence:
    """Returns the stored sequence in a folder, equal to the one written, except for its `source`.

    background: which frames `background()` gives for background models; None: the stored empty ones. Pictures are
    compared with their hashes when they are read, all other files now (InputError).
    """
    manifest = read_manifest(folder)
    pictured = tuple(filter(is_picture, manifest["files"]))  # their hash is checked when they are read
    for error in seal.damaged_files(folder, manifest["files"], size_only=pictured):
        raise error
    about, has, pictures = manifest["sequence"], manifest["files"].keys(), StoredPictures(folder, manifest)
    size, length = about["image_size"], about["length"]
    load_background, words = pictures.background(background)

    def require_length(name: str, found: int) -> None:
        reject(found != length, folder / name, f"{found} frames", f"{length} frames, as manifest.json says", REDO)

    @lru_cache(maxsize=1)
    def detections() -> list[Detections]:
        found = truth_files.read_detections(folder / "det" / "det.parquet")
        require_length("det/det.parquet", len(found))
        return found

    def truth() -> Truth:
        found = truth_files.read_truth(folder)
        require_length("gt/truth.parquet", found.length)
        return found

    source: dict[str, Any] = {
        "kind": "generated", "path": str(folder), "seed": manifest["seed"], "repeat": manifest["repeat"],
        "truth_hash": manifest["truth_hash"], "streams": list(pictures.streams), "images": manifest.get("images"),
        **words, **{key: manifest[key] for key in ("origin", "stride") if key in manifest},
    }  # fmt: skip
    return recorded_sequence(
        source, about["name"], about["fps"], length,
        detections=(lambda index: detections()[index - 1]) if "det/det.parquet" in has else None,
        left=partial(pictures.all, "left", length) if "left" in pictures.streams else None,
        right=partial(pictures.all, "right", length) if "right" in pictures.streams else None,
        load_truth=truth if "gt/truth.parquet" in has else None,
        load_owners=(lambda: truth_files.read_owners(folder, detections())) if "gt/det_ids.txt" in has else None,
        image_size=None if size is None else (size[0], size[1]),
        camera=read_camera(folder / "camera.json") if "camera.json" in has else None,
        scene=read_scene(folder / "scene.json") if "scene.json" in has else None,
        px_per_m=tables.none_to_nan(about["px_per_m"]), load_background=load_background,
        load_pixels=pictures.pixel_loader() if {"ids"} <= set(pictures.streams) else None,
        load_light=lambda: _light(folder, manifest),
        load_cameras=(lambda: read_cameras(folder / CAMERAS, length)) if CAMERAS in has else None,
    )  # fmt: skip


def _light(folder: Path, manifest: dict[str, Any]) -> Array:
    # Drawn again from the stored scenario; imported here, as few readers need it.
    from scenarios.loading.toml_files import parse
    from scenarios.schema.pictures import Light
    from sim.render.weather import brightness

    table, about = parse(folder / "scenario.toml"), manifest["sequence"]
    light, seed = Light.model_validate(table.get("light", {})), look_seed(manifest["seed"], table["name"])
    return brightness(light, seed, manifest["repeat"], about["fps"], about["length"])
