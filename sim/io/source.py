"""Whatever a command is given as SOURCE, as Sequences: one recording, or every sequence of a dataset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from scenarios.errors import InputError
from sim.io import biwi, caviar, mot_folder, store
from sim.types import Camera, Sequence

KINDS = "a generated sequence or dataset, a MOTChallenge folder or text, a BIWI folder, a CAVIAR XML"
VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov", ".mpg", ".mpeg", ".webm")
DEPTH = 3


def open_source(
    path: str | Path,
    *,
    fps: float | None = None,
    px_per_m: float | None = None,
    camera: Camera | str | Path | None = None,
    images: bool = False,
    background: str | None = None,
) -> list[Sequence]:
    """The Sequences of a path, a dataset's in the order of their paths.

    fps, px_per_m and camera (or its file) stand in for what a recording does not know; a generated sequence knows
    and refuses them. images: let frames carry the pictures of a MOTChallenge folder. background: which frames a
    background model is trained on, "first:N" or "spread:N" (spread:50 if nothing is said). InputError for anything else.
    """
    path = Path(path)
    for option, value in (("--fps", fps), ("--px-per-m", px_per_m)):
        if value is not None and not 0 < value < float("inf"):
            raise InputError(place=option, got=value, expected="a number above 0", remedy=f"correct {option}")
    if isinstance(camera, str | Path):
        camera = store.read_camera(Path(camera))
    if not path.exists():
        raise InputError(file=path, got="nothing there", expected=KINDS, remedy="check the path")
    if path.is_file():
        return [_open_file(path, fps, px_per_m, camera)]
    found = list(_find(path, DEPTH))
    if not found:
        raise InputError(file=path, got="a folder without sequences", expected=KINDS, remedy="check the path")
    return [_open_folder(p, fps, px_per_m, camera, images) for p in found]


def _open_file(path: Path, fps: float | None, px_per_m: float | None, camera: Camera | None) -> Sequence:
    suffix = path.suffix.lower()
    if suffix == ".xml":
        _refuse(path, "a CAVIAR recording", "its truth is in the image alone", {"--camera": camera})
        return caviar.open_file(path, fps=fps, px_per_m=px_per_m)
    if path.name == "obsmat.txt":
        return _open_folder(path.parent, fps, px_per_m, camera, images=False)
    if suffix in VIDEO_SUFFIXES:
        raise InputError(file=path, got="a video", expected=KINDS, remedy="videos are not read yet; give boxes")
    if suffix in (".txt", ".csv"):
        return mot_folder.open_text(path, fps=fps, px_per_m=px_per_m, camera=camera)
    raise InputError(file=path, got=f"a {suffix or 'nameless'} file", expected=KINDS, remedy="check the path")


def _kind(folder: Path) -> str | None:
    if store.is_sequence(folder):
        return "generated"
    if (folder / "obsmat.txt").is_file():
        return "biwi"
    parts = ("seqinfo.ini", "gt/gt.txt", "det/det.txt", "img1")
    return "mot" if any((folder / part).exists() for part in parts) else None


def _find(folder: Path, depth: int) -> list[Path]:
    """Folders of sequences below (and files of CAVIAR in) a folder, sorted."""
    if _kind(folder) is not None:
        return [folder]
    if depth == 0:
        return []
    found = [p for p in sorted(folder.iterdir()) if not p.name.startswith(".")]
    deeper = [q for p in found if p.is_dir() for q in _find(p, depth - 1)]
    return deeper + [p for p in found if p.suffix.lower() == ".xml" and caviar.is_caviar(p)]


def _open_folder(
    path: Path, fps: float | None, px_per_m: float | None, camera: Camera | None, images: bool
) -> Sequence:
    if path.is_file():
        return _open_file(path, fps, px_per_m, camera)
    match _kind(path):
        case "generated":
            options = {"--fps": fps, "--px-per-m": px_per_m, "--camera": camera}
            _refuse(path, "a generated sequence", "it knows its own", options)
            return store.open_sequence(path)
        case "biwi":
            _refuse(path, "a BIWI recording", "it is in metres", {"--px-per-m": px_per_m, "--camera": camera})
            return biwi.open_folder(path, fps=fps)
        case _:
            return mot_folder.open_folder(path, fps=fps, px_per_m=px_per_m, camera=camera, images=images)


def _refuse(path: Path, kind: str, why: str, options: Mapping[str, object]) -> None:
    """InputError for options that would be without effect."""
    given = [option for option, value in options.items() if value is not None]
    if given:
        remedy = f"leave {'it' if len(given) == 1 else 'them'} out: {why}"
        raise InputError(file=path, got=" and ".join(given), expected=f"none for {kind}", remedy=remedy)
