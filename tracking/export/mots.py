"""Writes the masks of people as MOTS: a text of run lengths and 16-bit pictures of ids, with the camera's pictures.

OUT/MOTS-<split>/<name>/ of a sequence has img1/ (pictures), gt/gt.txt, instances/ (PNG) and seqinfo.ini;
OUT/seqmaps/MOTS-<split>.txt lists the sequences. TrackEval reads this with GT_FOLDER=OUT, SPLIT_TO_EVAL=<split>.

A line of gt.txt is `frame id class height width mask`, apart by blanks: frames from 1, pedestrians of class 2 with ids
2000 + person id, masks as COCO's compressed run lengths. The visible pixels of all ignored people of a frame are one
ignored region, class 10 with id 10000. instances/ has the same ids in each pixel, and 0 elsewhere.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenarios.errors import reject
from sim.pictures.stored_pictures import encoded
from sim.store.atomic import write_inside
from sim.store.own_files import output_paths
from sim.streams import PERSON
from tracking.export import MIN_VISIBILITY
from tracking.export.coco import run_lengths
from tracking.export.labelled_pictures import (
    Exported,
    LabelledPictures,
    PicturePeople,
    in_turn,
    labelled_pictures,
    new_export,
)

CLASS, IGNORED = 1000, 10  # id // CLASS is the class; that of ignored regions


def mots(source: str | Path, out: str | Path, *, min_visibility: float = MIN_VISIBILITY) -> Exported:
    """Writes the masks of a generated dataset with the streams left and ids as MOTS.

    Args:
        source: A sequence or dataset.
        out: The folder; only an earlier export is replaced.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible are an ignored region.

    Returns:
        The folder with the numbers of its pictures, masks of people, and ignored people.

    Raises:
        InputError: A sequence has no pictures or no ids, two have one name, or `out` holds other files.
    """
    labelled = labelled_pictures(Path(source), min_visibility, pictured=True)
    remedy = "generate with --streams left,ids"
    for each in labelled:
        got = "no stream ids" if each.sequence.load_pixels is None else ""
        reject(got, each.sequence.source["path"], got, "the streams left and ids", remedy)
    folders = [f"MOTS-{each.split}" for each in labelled]
    names = [path.name for path in output_paths("", [each.sequence.name for each in labelled], source=source)]
    counts = np.zeros(3, np.int64)
    with new_export(Path(out)) as root:
        for each, folder, name in zip(in_turn(labelled), folders, names, strict=True):
            counts += _write(each, root / folder / name, name)
        for folder in sorted(set(folders)):
            listed = [name for other, name in zip(folders, names, strict=True) if other == folder]
            write_inside(root / f"seqmaps/{folder}.txt", "\n".join(["name", *listed, ""]).encode())
    pictures, kept, ignored = counts.tolist()
    return Exported(Path(out), pictures, kept, ignored, min_visibility)


def _write(labelled: LabelledPictures, target: Path, name: str) -> tuple[int, int, int]:
    """Writes one sequence; returns the numbers of its pictures, kept and ignored people."""
    lines, count, kept, ignored, kind = list[str](), 0, 0, 0, "jpg"
    width, height = labelled.size
    for index, body, kind in labelled.pictures():
        people = labelled.people(index)
        codes = instances(people)
        for code in np.unique(codes[codes > 0]).tolist():
            mask = compressed(run_lengths(codes == code))
            lines.append(f"{index} {code} {code // CLASS} {height} {width} {mask}\n")
        write_inside(target / f"img1/{index:06d}.{kind}", body)
        write_inside(target / f"instances/{index:06d}.png", encoded(codes, "png"))
        count, hidden = count + 1, int(people.ignored.sum())
        kept, ignored = kept + len(people.id) - hidden, ignored + hidden
    info = [f"name={name}", "imDir=img1", f"frameRate={labelled.sequence.fps:g}", f"seqLength={count}"]
    info += [f"imWidth={width}", f"imHeight={height}", f"imExt=.{kind}"]
    write_inside(target / "seqinfo.ini", "\n".join(["[Sequence]", *info, ""]).encode())
    write_inside(target / "gt/gt.txt", "".join(lines).encode())
    return count, kept, ignored


def instances(people: PicturePeople) -> np.ndarray[tuple[int, ...], np.dtype[np.uint16]]:
    """Returns the ids (H, W) of MOTS: 2000 + id for people, 10000 for those who are ignored, 0 elsewhere."""
    assert people.ids is not None
    shown = np.isin(people.ids, people.id)
    hidden = np.isin(people.ids, people.id[people.ignored])
    codes = np.where(hidden, IGNORED * CLASS, np.where(shown, people.ids + PERSON, 0))
    return codes.astype(np.uint16)


def compressed(lengths: list[int]) -> str:
    """Returns run lengths in COCO's compressed form, as pycocotools reads it.

    From the fourth on, a length is replaced by its difference to the last but one. Each number is written as characters
    of 5 bits each, the lowest first, with a sixth bit while more follow, from "0" on.
    """
    found = []
    for k, length in enumerate(lengths):
        number, more = length - (lengths[k - 2] if k > 2 else 0), True
        while more:
            bits = number & 0x1F
            number >>= 5
            more = number != (-1 if bits & 0x10 else 0)
            found.append(chr(48 + bits + 0x20 * more))
    return "".join(found)
