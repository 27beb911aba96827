"""Run a tracker over a whole sequence: `track` returns its tracks of every frame and what run.json holds.

Input: a tracker (name, class or instance) and a sequence. Output: a `TrackingRun`.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from scenarios.errors import InputError
from sim.types import DetectionMode, Sequence, Tracker, Tracks
from tracking import image_scale
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.prepare import Params, prepare
from tracking.run_info import Speed, known_people_info, run_info
from tracking.time_limit import TimeLimited
from tracking.weak_detections import weak_detections

if TYPE_CHECKING:
    from tracking.grouping.pair_probabilities import PairProbabilities

OF_TRACKS = ("sequence", "plane", "fps", "px_per_m", "px_per_m_frames", "frames")
"""Keys of run.json that follow from tracks and sequence, whoever made the tracks."""


@dataclass(frozen=True, eq=False)
class TrackingRun(SequenceOf[Tracks]):
    """The tracks of one run; as a sequence, one `Tracks` per frame in order: item 0 is frame 1, a slice gives a tuple.

    tracks: the `Tracks` of every frame. info: what run.json tells of the run (tracker, config, seed, detections,
    speed), {} by default. `write` adds what it tells of the labels and files.
    """

    tracks: tuple[Tracks, ...]
    info: dict[str, Any] = field(default_factory=dict)

    @overload
    def __getitem__(self, index: int) -> Tracks: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Tracks, ...]: ...
    def __getitem__(self, index: int | slice) -> Tracks | tuple[Tracks, ...]:
        return self.tracks[index]

    def __len__(self) -> int:
        return len(self.tracks)

    def write(self, folder: str | Path, sequence: Sequence, pairs: PairProbabilities | None = None) -> Path:
        """Store the tracks in the folder as `flockscope track` does, and return the folder.

        sequence: what was tracked. run.json gets its truth_hash, so that the tracks are scored with these labels only.
        pairs: probabilities to store, too, in pairs.parquet; None: none.
        Files of an earlier run are replaced. Raises InputError if the folder holds files of another program with names
        of a run's, it cannot be written, or the labels cannot be read; WorkError if the disk is full or an order of a
        simulated script was not fulfilled.
        """
        from sim.io.store.run_seal import tracked_hash
        from sim.io.store.track_files import write_tracks
        from sim.io.store.track_tables import pair_table

        info = {**self.info, "truth_hash": tracked_hash(sequence)}
        table = None if pairs is None else pair_table(pairs.frame, pairs.a, pairs.b, pairs.probability)
        camera, scene = sequence.camera, sequence.scene
        return write_tracks(folder, self, fps=sequence.fps, camera=camera, scene=scene, info=info, pairs=table)


def track(
    tracker: str | type[Tracker] | Tracker | TimeLimited,
    sequence: Sequence,
    *,
    params: Params = None,
    detections: DetectionMode | None = None,
    sensor: Mapping[str, Any] | None = None,
    seed: int = 0,
    grouping: Grouping | str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> TrackingRun:
    """Return the tracker's tracks of every frame of the sequence, completed with groups and events.

    tracker: a registered name, "file.py:Class", "module:Class", a class, an instance, or a TimeLimited
    (tracking.time_limit), which stops a step that hangs. params: a config, values by name, the name of a preset, or a
    TOML file; None for the tracker's defaults. detections: "image", "file" or "truth"; None for the first of them that
    can work. sensor: settings as in a scenario's [sensor] that degrade "truth" (misses, clutter, noise, hiding); None:
    perfect. seed: for the tracker's and the sensor's random numbers. grouping: "belief", "rule", a TOML file of
    either, or the grouping itself, for a tracker that names no groups; None: the belief. If the tracker names groups,
    it has no effect, with a UserWarning. Another one says that the tracker's velocities are too far from its motion to
    derive groups, or that most detections score too low to start a track. If the tracker's first answer with people
    names no groups, later ones are replaced by derived ones, with a UserWarning. progress: called with each frame's
    number, from 1, when the frame is done.

    Raises InputError before the first frame if the arguments are wrong or tracker and sequence do not fit; later for a
    frame whose detections are not finite or whose picture cannot be read; after the last frame if tracks in the image
    have a scale of 0 or below. Raises WorkError if the tracker raises an exception or returns wrong tracks, or in mode
    "truth" if an order of a simulated script was not fulfilled.
    """
    from tracking.grouping.foot_points import can_stand, completed
    from tracking.grouping.grouped_tracks import late_groups, names_groups
    from tracking.grouping.plausibility import velocity_warning

    chosen = grouping_of(grouping) if isinstance(grouping, str | Path) else grouping
    rule = chosen or default_grouping()
    prepared = prepare(tracker, sequence, params=params, detections=detections, sensor=sensor, seed=seed)
    weak = weak_detections(prepared)
    if weak is not None:
        warnings.warn(weak, UserWarning, stacklevel=2)
    prepared.reset(seed)
    reported, spent, begun = [], 0.0, time.perf_counter()
    for frame in prepared.frames():
        start = time.perf_counter()
        reported.append(prepared.step(frame))
        spent += time.perf_counter() - start
        if progress is not None:
            progress(frame.index)
    whole = time.perf_counter() - begun
    scale, pixels = prepared.scale(reported), prepared.mode == "image"
    camera, scene = prepared.context.camera, prepared.context.scene
    tracks = completed(reported, sequence.fps, scale.px_per_m, rule, camera=camera, scene=scene, pixels=pixels)
    named = names_groups(reported)
    if named and chosen is not None:
        warnings.warn(f"{prepared.name} names groups itself: --grouping has no effect", UserWarning, stacklevel=2)
    elif not named:
        late = late_groups(reported)
        if late is not None:
            warnings.warn(
                f"{prepared.name}: names groups from frame {late} on, but not in its first answer with people: its "
                "groups are replaced by derived ones. Report groups = Groups.none() as long as there is no group",
                UserWarning,
                stacklevel=2,
            )
        fault = velocity_warning(prepared.name, reported, sequence.fps, scale.px_per_m, rule)
        if fault is not None and not can_stand(reported, camera, pixels):  # on the ground no velocity is reported
            warnings.warn(fault, UserWarning, stacklevel=2)
    speed = Speed(len(reported) / spent, len(reported) / whole) if reported else Speed()
    info = run_info(prepared, tracks, seed, sensor or {}, scale, speed)
    return TrackingRun(tracks, info if named else {**info, "grouping": rule.as_dict()})


def group(
    sequence: Sequence, run: TrackingRun | None = None, *, grouping: Grouping | str | Path | None = None
) -> TrackingRun:
    """Return the people of a sequence, whose ids are known, with groups and events that follow from their motion.

    run: tracks of people; groups and events in them are replaced. None: the labelled people of the sequence, as
    tracking.grouping.known_people gives them; their group labels are not used. grouping: as of
    `track`. `info` of the result is what run.json tells: that of the run with the new grouping, or of a
    tracker "group".

    Raises InputError if there are no people with ids, the tracks are of whole groups, people lie in the image and its
    scale is unknown or not above 0, or labels or the file of the grouping cannot be read. Raises WorkError if an order
    of a simulated script was not fulfilled. Warns if frame numbers or speeds are hardly right
    (tracking.grouping.plausibility), or velocities are too far from the motion to derive groups.
    """
    from tracking.grouping.foot_points import can_stand, completed
    from tracking.grouping.grouped_tracks import without_groups
    from tracking.grouping.known_people import known_people
    from tracking.grouping.plausibility import implausible, velocity_warning

    rule = (grouping_of(grouping) if isinstance(grouping, str | Path) else grouping) or default_grouping()
    people = known_people(sequence) if run is None else without_groups(run)
    file = sequence.source.get("path", sequence.name)
    if any(t.unit == "group" for t in people):
        got, remedy = "tracks of whole groups", "track with a tracker of people (blob), or give labelled people"
        raise InputError(file=file, got=got, expected="people with ids", remedy=remedy)
    learned = None if run is None else run.info.get("px_per_m")
    scale = image_scale.from_tracks(image_scale.before_frames(sequence), learned or float("nan"), people)
    if any(t.plane == "image" and len(t.id) for t in people) and not np.isfinite(scale.px_per_m):
        got, remedy = "people in the image, without its scale", "give --px-per-m, pixels per metre"
        raise InputError(file=file, got=got, expected="metres, or a scale", remedy=remedy)
    camera, pixels = sequence.camera, run is not None and run.info.get("detections") == "image"
    tracks = completed(people, sequence.fps, scale.px_per_m, rule, camera=camera, scene=sequence.scene, pixels=pixels)
    stands = can_stand(people, camera, pixels)  # then no velocity is used
    fault = None if stands else velocity_warning(sequence.name, people, sequence.fps, scale.px_per_m, rule)
    odd = implausible(sequence.name, people, sequence.fps, scale.px_per_m)
    for text in (*odd, *([] if fault is None else [fault])):
        warnings.warn(text, UserWarning, stacklevel=2)
    info = known_people_info(sequence, tracks, scale)
    if run is not None:
        info = {**run.info, **{key: info[key] for key in OF_TRACKS}}
    return TrackingRun(tracks, {**info, "grouping": rule.as_dict()})


def grouped(tracks: SequenceOf[Tracks], sequence: Sequence) -> tuple[Tracks, ...]:
    """Return one tracker's stored tracks of a sequence, one `Tracks` per frame, with groups and events filled in where
    they are empty.

    The scale in px per m is the camera's at the image centre, else the sequence's. It is the truth's, from all labelled
    boxes, if the sequence states none or took it from the boxes of the first frames; without any, tracks in the image
    are returned unchanged, as are tracks marked as derived, or of groups. Boxes of a calibrated sequence, not from
    pixels, are grouped where they stand on the ground (tracking.grouping.foot_points). Raises InputError if the truth
    cannot be read or tracks in the image have a scale of 0 or below; WorkError if an order of a simulated script was
    not fulfilled.
    """
    from tracking.grouping.foot_points import completed

    known = image_scale.before_frames(sequence)
    truth = sequence.truth if known.frames or not np.isfinite(known.px_per_m) else None
    px_per_m = known.px_per_m if truth is None else truth.px_per_m
    pixels = getattr(tracks, "info", {}).get("detections") == "image"
    return completed(tracks, sequence.fps, px_per_m, camera=sequence.camera, scene=sequence.scene, pixels=pixels)
