"""The pictures and labels that training data is made of: which frames have a picture, and who is in it.

A person is *in* a picture if the box overlaps it. A person is *ignored* if less of the body is visible than a given
share, or if the stream ids is stored and no pixel shows the person: a detector cannot be asked to report such a person,
nor be blamed for it. Each format states this in its own way, or leaves the person out.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, reject
from sim.dataset.splits import split_of
from sim.pictures.stored_pictures import StoredPictures, encoded
from sim.scene.visibility import image_size_of_boxes
from sim.store import atomic, tables
from sim.store.own_files import is_side_file
from sim.store.seal import read_whole_manifest, reject_sealed
from sim.streams import file_name
from sim.types import Array, Bools, Camera, Ints, Sequence, Truth
from tracking.export import MIN_VISIBILITY
from tracking.recordings.mot_folder import left_pictures
from tracking.recordings.source import open_source

SEAL = "export.json"


@dataclass(frozen=True)
class Exported:
    """What an export wrote. path: the file or folder. pictures: number of pictures. kept, ignored: numbers of labels of
    people who are to be found, and of people who are ignored. min_visibility: the share that divides them. files: the
    files written, if `path` is the name of several."""

    path: Path
    pictures: int
    kept: int
    ignored: int
    min_visibility: float
    files: tuple[Path, ...] = ()

    @property
    def counts(self) -> dict[str, Any]:
        """The numbers by name."""
        return {name: getattr(self, name) for name in ("pictures", "kept", "ignored", "min_visibility")}

    @property
    def text(self) -> str:
        """The numbers in one line."""
        ignored = f"ignored {self.ignored} with visibility under {self.min_visibility:g}"
        return f"{counted(self.pictures, 'picture')}; people: kept {self.kept}, {ignored}"


@dataclass(frozen=True, eq=False)
class PicturePeople:
    """The people in the picture of one frame: N rows, sorted by id.

    rows (N,): their rows in the truth. id, group (N,): as in the truth. box (N, 4): left, top, width, height in px, of
    the whole body, unclipped. part (N, 4): left, top, right, bottom in px, rounded to 0.01, of the part of the box
    inside the picture. visibility (N,): share of the body. ignored (N,): True for people who are ignored. ids (H, W):
    who is in each pixel, as of `PixelTruth`, column by column in memory; None without the stream ids.
    """

    rows: Ints
    id: Ints
    group: Ints
    box: Array
    part: Array
    visibility: Array
    ignored: Bools
    ids: Ints | None


@dataclass(frozen=True)
class LabelledPictures:
    """The labelled pictures of a sequence with true boxes. min_visibility: people of whom less is visible are
    ignored."""

    sequence: Sequence
    min_visibility: float

    @property
    def truth(self) -> Truth:
        """The truth of the sequence."""
        assert self.sequence.truth is not None
        return self.sequence.truth

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, px; of a sequence without pictures those that its boxes show."""
        assert self.truth.box is not None
        return self.sequence.image_size or image_size_of_boxes(self.truth.box)

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera of each frame if it moves, else ()."""
        return () if self.sequence.load_cameras is None else self.sequence.load_cameras()

    @property
    def split(self) -> str:
        """The split of a generated sequence by its seed; train for a recording."""
        facts = self.sequence.source
        generated = facts.get("kind") == "generated"
        return split_of(range(facts["seed"], facts["seed"] + 1)) if generated else "train"

    def people(self, index: int) -> PicturePeople:
        """Returns the people in the picture of frame `index` (from 1)."""
        truth, load = self.truth, self.sequence.load_pixels
        assert truth.box is not None
        # masks are read down the columns
        ids = None if load is None else np.asfortranarray(load(index).ids)
        rows = np.arange(*truth.rows(index).indices(len(truth.id)))
        box = truth.box[rows]
        corners = np.concatenate([box[:, :2], box[:, :2] + box[:, 2:]], axis=1)
        part = np.round(np.clip(corners, 0, [*self.size, *self.size]), 2)
        inside = (part[:, 2] > part[:, 0]) & (part[:, 3] > part[:, 1])  # False also for nan
        rows, box, part = rows[inside], box[inside], part[inside]
        visibility = truth.visibility[rows]
        shown = visibility if ids is None else np.where(np.isin(truth.id[rows], ids), visibility, 0.0)
        ignored = shown < self.min_visibility
        return PicturePeople(rows, truth.id[rows], truth.group[rows], box, part, visibility, ignored, ids)

    def files(self) -> dict[int, Path]:
        """Returns the files of the pictures by frame; one video may hold all. Empty for a sequence without pictures."""
        sequence, length = self.sequence, self.sequence.length or 0
        if not sequence.has_images:
            return {}
        folder = Path(sequence.source["path"])
        if sequence.source["kind"] == "mot":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # said when the sequence was opened
                return {k: path for k, path in left_pictures(folder).files.items() if k <= length}
        images = sequence.source["images"] or "jpg"
        return {index: folder / file_name("left", images, index) for index in range(1, length + 1)}

    def pictures(self) -> Iterator[tuple[int, bytes, str]]:
        """Yields frame, content and type ("jpg", "png", …) of each picture's file. Frames of a video become jpg.

        Raises InputError if a picture of a stored sequence differs from its hash.
        """
        if self.sequence.source["kind"] == "mot":
            for index, path in sorted(self.files().items()):
                yield index, path.read_bytes(), path.suffix[1:].lower()
            return
        folder, length = Path(self.sequence.source["path"]), self.sequence.length or 0
        stored = StoredPictures(folder, read_whole_manifest(folder))
        if stored.images == "mp4":
            yield from ((k, encoded(picture, "jpg"), "jpg") for k, picture in enumerate(stored.all("left", length), 1))
        else:
            yield from ((k, *stored_picture(stored, k)) for k in range(1, length + 1))


def stored_picture(stored: StoredPictures, index: int) -> tuple[bytes, str]:
    """Returns content and type of the left picture of frame `index` (from 1); a frame of a video becomes jpg."""
    if stored.images == "mp4":
        (picture,) = stored.all("left", index, [index])
        return encoded(picture, "jpg"), "jpg"
    return stored.check(file_name("left", stored.images, index), whole=True), stored.images


def labelled_pictures(
    source: Path, min_visibility: float = MIN_VISIBILITY, *, person_class: int | str | None = None,
    pictured: bool = False, one_split: bool = False,
) -> list[LabelledPictures]:  # fmt: skip
    """Returns the sequences of a source that have true boxes.

    person_class: as of `open_source`. pictured: True leaves out those without pictures. Raises InputError if none is
    left, if `one_split` and generated ones are of several splits, or if `min_visibility` is no share.
    """
    share = 0 <= min_visibility <= 1
    reject(not share, "", f"{min_visibility:g}", "a share from 0 to 1", "correct it", "--min-visibility")
    sequences = open_source(source, person_class=person_class)
    # of copies: each keeps the truth that it has loaded
    truths = ((s, replace(s).truth) for s in sequences)
    sequences = [s for s, truth in truths if truth is not None and truth.box is not None]
    reject(not sequences, source, "no labelled boxes", "a dataset with boxes", "give a generated dataset")
    made = [s.source for s in sequences if s.source.get("kind") == "generated"]
    splits = sorted({split_of(range(facts["seed"], facts["seed"] + 1)) for facts in made})
    if one_split and len(splits) > 1:
        got, remedy = f"the splits {', '.join(splits)}", f"export each by itself, as {Path(made[0]['path']).parent}"
        raise InputError(file=source, got=got, expected="one split in a file", remedy=remedy)
    if pictured:
        sequences = [s for s in sequences if s.has_images]
        expected, remedy = "pictures and labelled boxes", "generate with --streams left"
        reject(not sequences, source, "no pictures", expected, remedy)
    return [LabelledPictures(sequence, min_visibility) for sequence in sequences]


def in_turn(labelled: list[LabelledPictures]) -> Iterator[LabelledPictures]:
    """Yields each sequence; its truth is freed after its turn, as those of a large dataset would fill the memory."""
    for each in labelled:
        yield replace(each, sequence=replace(each.sequence))


@contextmanager
def new_export(out: Path) -> Iterator[Path]:
    """Yields a temporary folder that becomes the folder `out` when the block ends. export.json lists the files in it.

    An earlier export is replaced. Raises InputError if `out` holds a file that no export.json there lists, or lies in
    the folder of a stored sequence or a run.
    """
    out = out.absolute()

    def refuse() -> bool:
        others = sorted(_files(out) - _listed(out / SEAL)) if out.is_dir() else [out.name] * out.exists()
        got, expected = f"{next(iter(others), '')}, a file that flockscope did not write", "a new folder, or an export"
        reject(others, out, got, expected, "move it away, or choose another --out", "--out")
        return False

    for folder in (out, *out.parents):
        reject_sealed(folder)
    refuse()
    with atomic.new_folder(out, refuse) as partial:
        yield partial
        document = {"format": tables.FORMAT, "files": sorted({*_files(partial), SEAL})}
        atomic.write_inside(partial / SEAL, tables.json_document(document))


def _files(folder: Path) -> set[str]:
    found = (p.relative_to(folder) for p in folder.rglob("*") if p.is_symlink() or not p.is_dir())
    return {path.as_posix() for path in found if not is_side_file(path)}


def _listed(seal: Path) -> set[str]:
    with suppress(InputError):
        files = tables.read_json(seal).get("files") if seal.is_file() else None
        return set(filter(lambda name: isinstance(name, str), files if isinstance(files, list) else ()))
    return set()
