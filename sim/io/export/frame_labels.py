"""What is true of a stored sequence frame by frame, and what its sensor saw, as JSON: for samples of one frame."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sim.io.files import tables
from sim.io.store.sequence_folder import open_sequence
from sim.types import Array, Detections, FrameTruth, Groups


def labels(folder: Path, manifest: dict[str, Any]) -> Iterator[bytes]:
    """One JSON object per frame.

    sequence, frame, t, fps, image_size; people: id, group (-1 alone), x, y, vx, vy (ground, m and m/s), box (ltwh px,
    amodal), visibility; groups: id, members, and hull (ground, m); detections: box or x, y, score. null where unknown.
    """
    sequence = open_sequence(folder)
    truth = sequence.truth
    about = {"sequence": sequence.name, "fps": sequence.fps, "image_size": manifest["sequence"]["image_size"]}
    for frame in sequence.without_pictures():
        row: dict[str, Any] = {**about, "frame": frame.index, "t": frame.t}
        if truth is not None:
            here = truth.at(frame.index)
            row |= {"people": list(_people(here)), "groups": _groups(here.groups)}
        if frame.detections is not None:
            row["detections"] = list(_detections(frame.detections))
        yield tables.json_text(row).encode()


def _people(truth: FrameTruth) -> Iterator[dict[str, Any]]:
    assert truth.pos is not None, "simulated people have places"
    for k, (number, group) in enumerate(zip(truth.id.tolist(), truth.group.tolist(), strict=True)):
        row = {"id": number, "group": group, "box": None if truth.box is None else _finite(truth.box[k])}
        row |= dict(zip(("x", "y"), _finite(truth.pos[k]), strict=True))
        if truth.vel is not None:
            row |= dict(zip(("vx", "vy"), _finite(truth.vel[k]), strict=True))
        yield {**row, "visibility": tables.nan_to_none(float(truth.visibility[k]))}


def _groups(groups: Groups | None) -> list[dict[str, Any]] | None:
    if groups is None:
        return None
    rows = zip(groups.id.tolist(), groups.members, groups.hull, strict=True)
    return [{"id": number, "members": members.tolist(), "hull": hull.tolist()} for number, members, hull in rows]


def _detections(found: Detections) -> Iterator[dict[str, Any]]:
    for k, score in enumerate(found.score.tolist()):
        row = {"score": score, "box": None if found.box is None else _finite(found.box[k])}
        yield {**row, "plane": found.plane, **dict(zip("xyz", _finite(found.pos[k]), strict=False))}


def _finite(row: Array) -> list[float | None]:
    return [tables.nan_to_none(value) for value in row.tolist()]
