"""`flockscope calibrate`: writes the camera of a recording, by points on its ground or by the boxes of its people."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from sim.scene.body import PERSON_HEIGHT
from sim.scene.standing import stature_doubt
from sim.store.camera_files import camera_document
from sim.store.numeric_text import number_or_nan
from sim.store.own_files import output_file
from sim.types import Array, Camera, Ints, Tracks
from sim.types import Sequence as Recording
from tracking.app.command_options import CalibrateOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.sequence_workers import source_of
from tracking.app.stored_tracks import STATED, find_tracks, holds_tracks
from tracking.grouping.ground_of_boxes import FOCAL, LEAST, LONGEST, GroundFit, fit_ground
from tracking.grouping.known_people import people_as_tracks
from tracking.recordings.camera_of_points import camera_of_points, read_points
from tracking.recordings.mot_table import size_doubt
from tracking.recordings.options import refuse_options

MOST = 3000  # boxes by which the camera is found, evenly over the recording
DRAWS, DRAWN = 100, 1000  # draws for the interval, and boxes by which each is made, at most
BLOCKS = 20  # of boxes without ids, drawn as wholes
LEVEL = (5, 95)  # percentiles of the draws


@dataclass(frozen=True)
class Boxes:
    """Boxes (R, 4), px, with the people (R,) that they are of, or blocks of time; what they are; the image scale, px
    per m, nan if unknown."""

    box: Array
    person: Ints
    what: str
    px_per_m: float = float("nan")


def calibrate(options: CalibrateOptions) -> CommandResult:
    """Writes camera.json and returns how sure it is."""
    from sim.store.atomic import write_file
    from sim.store.seal import reject_sealed
    from sim.store.tables import json_document

    out = output_file(options.out, ".json")
    reject_sealed(out.parent)
    recording, tracks = _opened(options)
    image = _picture(options, recording)
    if options.points is None:
        camera, facts, lines = _by_boxes(options, _boxes(options, recording, tracks), image)
    else:
        camera, facts, lines = _by_points(options, _boxes_known(options, recording, tracks), image)
    write_file(out, json_document(camera_document(camera)))
    use = f"use it: --camera {out}"
    return CommandResult({"file": out, "camera": camera, **facts}, "\n".join([f"{out}: {lines[0]}", *lines[1:], use]))


def _opened(options: CalibrateOptions) -> tuple[Recording, Sequence[Tracks] | None]:
    """Returns the one sequence of the source, and its tracks if the source is a run."""
    path = options.source
    stored = holds_tracks(path)
    found = find_tracks(path) if stored else source_of(options, path, images=True).open()
    got = f"{len(found)} {'runs' if stored else 'sequences'}"
    reject(len(found) != 1, path, got, "one, of one camera", "give one of them")
    (first,) = found
    if isinstance(first, Recording):
        return first, None
    if not first.info:  # tracks of another program
        text = first.path / "tracks.txt" if first.path.is_dir() else first.path
        return source_of(options, text).open()[0], None
    refuse_options(vars(options), "person_class box_scale boxes min_score", first.folder, "a run", STATED)
    sequence = first.sequence(options.fps)
    return sequence, first.read(sequence)


def _picture(options: CalibrateOptions, recording: Recording) -> tuple[int, int] | None:
    """Returns width and height of the picture, px, by the recording or `--image-size`; None if neither states it."""
    known, given = recording.image_size, options.image_size
    if given is None:
        return known
    expected, remedy = "none, as the recording states {} × {} px".format(*known or (0, 0)), "leave it out"
    reject(known is not None, "", given, expected, remedy, "--image-size")
    sides = [number_or_nan(word) for word in given.split(",")]
    good = len(sides) == 2 and all(1 <= side <= 32768 and side % 1 == 0 for side in sides)
    reject(not good, "", repr(given), "WIDTH,HEIGHT, px, whole numbers", "give the size of a picture", "--image-size")
    return int(sides[0]), int(sides[1])


def _boxes_known(options: CalibrateOptions, recording: Recording, tracks: Sequence[Tracks] | None) -> Boxes | None:
    """Returns the boxes of a run or labels, else of detections; None without."""
    if tracks is not None:
        return _measured(tracks, "tracked boxes")
    if recording.load_truth is not None and "boxes" not in recording.source:
        truth = recording.truth
        if truth is not None and truth.box is not None and len(truth.box):
            where, why = recording.source.get("path", recording.name), "labels have no scores, or give --boxes"
            refuse_options(vars(options), "min_score", where, "labels", why)
            return _measured(people_as_tracks(truth), "labelled boxes")
    if not recording.has_detections:
        return None
    found = [f.detections.box for f in recording.without_pictures() if f.detections is not None]
    box = np.concatenate([np.zeros((0, 4)), *(each for each in found if each is not None)])
    return Boxes(box, np.arange(len(box)) * BLOCKS // max(len(box), 1), "detected boxes") if len(box) else None


def _measured(tracks: Iterable[Tracks], what: str, px_per_m: float = float("nan")) -> Boxes | None:
    rows = [(t.box[t.measured], t.id[t.measured]) for t in tracks if t.box is not None and len(t.id)]
    if not rows:
        return None
    return Boxes(np.concatenate([b for b, _ in rows]), np.concatenate([i for _, i in rows]), what, px_per_m)


def _boxes(options: CalibrateOptions, recording: Recording, tracks: Sequence[Tracks] | None) -> Boxes:
    found = _boxes_known(options, recording, tracks)
    if found is None and tracks is None and recording.has_images:
        found = _from_pixels(recording)
    if found is None:
        instead = "the recording itself" if tracks is not None else "--boxes FILE"
        raise InputError(
            file=options.source, got="no boxes of people", remedy=f"give {instead}, or --points FILE.csv",
            expected="labels, detections or tracks with boxes, or a video",
        )  # fmt: skip
    return found


def _from_pixels(recording: Recording) -> Boxes | None:
    """Returns the boxes that `blob` finds in the pictures, of at most 60 s from the first on."""
    from tracking.running.prepare import prepare

    ready = prepare("blob", recording, detections="image")
    ready.reset(0)
    found, count, begun = list[Tracks](), 0, np.inf
    with ProgressMeter("calibrate", recording.length) as meter:
        for frame in ready.frames():
            found.append(ready.step(frame))
            meter.step(recording.name)
            count += len(found[-1].id)
            begun = min(begun, frame.t) if count else begun
            if count >= MOST or frame.t > begun + LONGEST:
                break
    return _measured(found, "boxes from pixels", ready.px_per_m(found))


def _by_boxes(
    options: CalibrateOptions, boxes: Boxes, image: tuple[int, int] | None
) -> tuple[Camera, dict[str, Any], list[str]]:
    """Returns the camera, its facts and lines about it."""
    usable = np.isfinite(boxes.box).all(axis=1) & (boxes.box[:, 2:] > 0).all(axis=1)
    box, person = boxes.box[usable], boxes.person[usable]
    doubt = "" if options.image_size is None or image is None or not len(box) else size_doubt(box, image)
    reject(doubt, options.source, options.image_size, "pictures that hold the boxes", doubt, "--image-size")
    step = max(1, -(-len(box) // MOST))
    box, person = box[::step], person[::step]
    points = "give points of the ground: --points FILE.csv"
    reject(len(box) < LEAST, options.source, f"{len(box)} boxes", f"{LEAST} or more", points)
    learned = boxes.px_per_m if np.isfinite(boxes.px_per_m) else float(np.median(box[:, 3])) / PERSON_HEIGHT
    px_per_m = options.px_per_m or learned
    fit = fit_ground(box, px_per_m, image)
    if fit is None or not fit.agrees:
        got = f"{len(box)} boxes that do not show the ground"
        if fit is not None:
            got += f": they differ by {fit.alone:.0%} in height, and by {fit.spread:.0%} on the best ground"
        raise InputError(file=options.source, got=got, expected="boxes that are the higher the nearer", remedy=points)
    if image is None:
        words = "its picture is taken to end with the boxes: --image-size WIDTH,HEIGHT states it"
        warnings.warn(f"{options.source}: {words}", stacklevel=2)
    height, tilt = _intervals(fit, box, person, px_per_m)
    tall, focal = float(np.median(box[:, 3])) / px_per_m, fit.camera.focal_px[0]
    lines = [
        f"height {_height(fit.camera):.2f} m [{height[0]:.2f}, {height[1]:.2f}], "
        f"tilt {_tilt(fit.camera):.0f}° [{tilt[0]:.0f}, {tilt[1]:.0f}]",
        f"from {len(box):,} {boxes.what}: they differ by {fit.alone:.0%} in height, by {fit.spread:.0%} on this ground",
        f"assumed: people {tall:.2f} m tall; focal length {focal:.0f} px, {FOCAL:g} of the picture's width, whose "
        "error the intervals leave out",
        "unknown: place (x = y = 0) and direction (along y) of the camera, roll (none), lens distortion (none)",
    ]
    facts = {
        "by": boxes.what, "boxes": len(box), "height": _height(fit.camera), "height_interval": height,
        "tilt_deg": _tilt(fit.camera), "tilt_interval": tilt, "focal_px": focal, "person_height": tall,
        "spread": fit.spread, "spread_of_heights": fit.alone,
    }  # fmt: skip
    return fit.camera, facts, lines


def _intervals(fit: GroundFit, box: Array, person: Ints, px_per_m: float) -> tuple[list[float], list[float]]:
    """Returns the 90 % intervals of height, m, and tilt, degrees, by draws of people with all their boxes."""
    r, found = np.random.default_rng(0), [(_height(fit.camera), _tilt(fit.camera))]
    ids, of = np.unique(person, return_inverse=True)
    rows = np.split(np.argsort(of, kind="stable"), np.cumsum(np.bincount(of))[:-1])
    for _ in range(DRAWS):
        drawn = np.concatenate([rows[k] for k in r.integers(len(ids), size=len(ids))])
        again = fit_ground(box[drawn[:: -(-len(drawn) // DRAWN)]], px_per_m, fit.camera.image)
        if again is not None:
            found.append((_height(again.camera), _tilt(again.camera)))
    low, high = np.percentile(np.array(found), LEVEL, axis=0)
    return [float(low[0]), float(high[0])], [float(low[1]), float(high[1])]


def _height(camera: Camera) -> float:
    return float(camera.position[2])


def _tilt(camera: Camera) -> float:
    return float(np.degrees(np.arcsin(np.clip(-camera.rotation[2, 2], -1.0, 1.0))))


def _by_points(
    options: CalibrateOptions, boxes: Boxes | None, image: tuple[int, int] | None
) -> tuple[Camera, dict[str, Any], list[str]]:
    """Returns the camera, its facts and lines about it."""
    assert options.points is not None
    refuse_options(vars(options), "px_per_m", options.points, "points", "they are in metres")
    got, remedy = "no size of its pictures", "give --image-size WIDTH,HEIGHT"
    if image is None:
        raise InputError(file=options.source, got=got, expected="a recording that states it", remedy=remedy)
    table = read_points(options.points)
    fit = camera_of_points(table, image)
    worst, camera = int(fit.residual.argmax()), fit.camera
    x, y, _ = camera.position
    lines = [
        f"height {_height(camera):.2f} ± {fit.height_sd:.2f} m, tilt {_tilt(camera):.1f} ± "
        f"{np.degrees(fit.tilt_sd):.1f}°, focal length {camera.focal_px[0]:.0f} ± {fit.focal_sd:.0f} px",
        f"from {len(fit.residual)} points, seen {fit.rms:.2g} px off (root mean square), at most "
        f"{fit.residual[worst]:.2g} px (line {table.line[worst]}); ± is a standard deviation, for at least 1 px",
        f"it stands at x = {x:.2f} m, y = {y:.2f} m",
        "assumed: the lens is over the middle of the picture, and does not distort",
    ]
    if boxes is not None and (doubt := stature_doubt(boxes.box[np.isfinite(boxes.box).all(axis=1)], camera)):
        warnings.warn(f"{options.source}: {doubt.replace('--camera', 'this camera')}", stacklevel=2)
    facts = {
        "by": "points", "points": len(fit.residual), "residual_px": fit.rms, "worst_px": fit.residual[worst],
        "height": _height(camera), "height_sd": fit.height_sd, "tilt_deg": _tilt(camera),
        "tilt_sd": float(np.degrees(fit.tilt_sd)), "focal_px": camera.focal_px[0], "focal_sd": fit.focal_sd,
    }  # fmt: skip
    return camera, facts, lines
