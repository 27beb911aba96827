"""Runs a tracker over a whole sequence: `track` returns its tracks of every frame and what run.json holds.

Input: a tracker (name, class or instance) and a sequence. Output: a `TrackingRun`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from scenarios.errors import InputError
from sim.types import DetectionMode, Sequence, Tracker, Tracks
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.running import image_scale
from tracking.running.prepare import Params, prepare
from tracking.running.run_info import OF_TRACKS, facts_of_tracks, run_info
from tracking.running.time_limit import TimeLimited

if TYPE_CHECKING:
    from tracking.export.tidy_tables import TidyTables
    from tracking.grouping.belief import PairProbabilities


@dataclass(frozen=True, eq=False)
class TrackingRun(SequenceOf[Tracks]):
    """The tracks of one run: a Python sequence with one `Tracks` per frame in order, so that item 0 is frame 1.

    Attributes:
        tracks: The `Tracks` of every frame.
        info: The content of run.json (tracker, config, seed, detections, speed, …); `write` adds further keys to the
            file.
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

    def tables(self, places: Mapping[str, Any] | None = None) -> TidyTables:
        """Returns the tables people, people_summary, groups, members, events and counts of the run.

        `run.tables().people.to_arrow()` gives a table of pyarrow, `to_pandas()` a data frame.

        Args:
            places: Lines and zones by name: the two ends (2, 2) of a line, or the K > 2 corners (K, 2) of a zone, in
                the unit of the tracks (m or px). `counts` gets columns with the number of people who cross the line or
                are in the zone. None means neither.
        """
        from tracking.export.tidy_tables import run_tables

        found = {name: np.asarray(corners, float) for name, corners in (places or {}).items()}
        return run_tables(self.tracks, self.info["fps"], found)

    def write(self, folder: str | Path, sequence: Sequence, pairs: PairProbabilities | None = None) -> Path:
        """Writes the tracks to the folder as `flockscope track` does, and returns the folder. sequence: what was
        tracked. pairs: a table of pair probabilities that is written, too; None writes none."""
        from sim.store.seal import tracked_hash
        from sim.store.track_files import pair_table, write_tracks

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
    """Tracks every frame of a sequence, and derives groups and events if the tracker reports none.

    Warns with a UserWarning if `grouping` has no effect because the tracker reports groups itself. Warns, too, if the
    tracker reports groups only after its first frame with people; such groups are replaced by derived ones. Warns, too,
    if each reported group has one member.

    Args:
        tracker: A registered name, "file.py:Class", "module:Class", a class, an instance, or a TimeLimited
            (tracking.running.time_limit), which stops a step that hangs.
        sequence: A `Sequence`, as `sim.simulate` and `tracking.recordings.source.open_source` return.
        params: A config, values by name, the name of a preset, or the path of a TOML file. None takes the tracker's
            defaults; it must be None if `tracker` is an instance.
        detections: "image" (the tracker detects in pictures), "file" (stored detections) or "truth" (detections made
            from labels). None takes the first of these, in this order, that tracker and sequence allow.
        sensor: Settings as in a scenario's [sensor] that degrade the detections of "truth"; None degrades nothing.
        seed: Seed of the random numbers of tracker and sensor.
        grouping: How groups are derived: "belief", "rule", a TOML file of either, or a `Belief` or `LinkRule`. None
            takes the belief.
        progress: Called after each frame with the frame's number, from 1.

    Returns:
        `TrackingRun`, the tracks of every frame and the content of run.json.

    Raises:
        InputError: The arguments are wrong, tracker and sequence do not fit, a picture cannot be read, detections are
            not finite, or tracks in the image have a scale of 0 or below.
        WorkError: The tracker raises an exception or returns wrong tracks, or a simulated person did not carry out an
            order of the scenario's script (mode "truth").
    """
    from sim.compiler import clock
    from tracking.grouping.foot_points import completed
    from tracking.grouping.grouped_tracks import events_at_end, groups_alone, late_groups, names_groups

    chosen = grouping_of(grouping) if isinstance(grouping, str | Path) else grouping
    rule = chosen or default_grouping()
    prepared = prepare(tracker, sequence, params=params, detections=detections, sensor=sensor, seed=seed)
    prepared.reset(seed)
    reported, spent, begun = [], 0.0, clock()
    for frame in prepared.frames():
        start = clock()
        reported.append(prepared.step(frame))
        spent += clock() - start
        if len(reported) == 1:
            prepared.diagnostics(f"frame {frame.index}")
        if progress is not None:
            progress(frame.index)
    whole = clock() - begun
    scale, known = prepared.scale(reported), prepared.context
    tracks, ground = completed(
        reported, sequence.fps, scale.px_per_m, rule, camera=known.camera, scene=known.scene,
        source=prepared.input, image_size=known.image_size,
        moves=bool(getattr(prepared.tracker, "camera_moves", False)),
    )  # fmt: skip
    named, late, odd = names_groups(reported), late_groups(reported), list[str]()
    if named and chosen is not None:
        odd.append(f"{prepared.name} names groups itself: --grouping has no effect")
    if late is not None:
        odd.append(
            f"{prepared.name}: names groups from frame {late} on, but not in its first answer with people: its "
            "groups are replaced by derived ones. Report groups = Groups.none() as long as there is no group"
        )
    if named and groups_alone(reported):
        odd.append(f"{prepared.name}: each of its groups has one member. Give group -1 to people who are alone")
    for text in odd:
        warnings.warn(text, UserWarning, stacklevel=2)
    speeds = (len(reported) / spent, len(reported) / whole) if reported else (0.0, 0.0)
    info = run_info(prepared, tracks, seed, sensor or {}, scale, ground, speeds)
    info["events_at_end"] = events_at_end(reported, tracks, sequence.fps)
    return TrackingRun(tracks, info if named else {**info, "grouping": rule.as_dict()})


def group(
    sequence: Sequence, run: TrackingRun | None = None, *, grouping: Grouping | str | Path | None = None
) -> TrackingRun:
    """Finds the groups and events of people whose ids are known, from their motion.

    Warns with a UserWarning if frame numbers, frame rate or unit of length are hardly right.

    Args:
        sequence: The sequence. If `run` is None, its labelled people are grouped; their group labels are not used.
        run: Tracks of people of this sequence that are grouped instead; groups and events in them are replaced.
        grouping: As in `track`.

    Returns:
        `TrackingRun`, the people of every frame with groups and events, and the content of run.json.

    Raises:
        InputError: There are no people with ids, the tracks are of whole groups, people lie in the image and its scale
            is unknown or not above 0, or labels or the file of the grouping cannot be read.
        WorkError: A simulated person did not carry out an order of the scenario's script.
    """
    from tracking.grouping.foot_points import completed, source_of
    from tracking.grouping.grouped_tracks import events_at_end, without_groups
    from tracking.grouping.known_people import known_people
    from tracking.grouping.plausibility import implausible

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
    tracks, ground = completed(
        people, sequence.fps, scale.px_per_m, rule, camera=sequence.camera, scene=sequence.scene,
        source=source_of(run), image_size=sequence.image_size,
    )  # fmt: skip
    for text in implausible(sequence.name, people, sequence.fps, scale.px_per_m):
        warnings.warn(text, UserWarning, stacklevel=2)
    begins = 1 if run is None else run.info.get("causal_from", 1)
    info = facts_of_tracks(sequence, tracks, scale, ground, begins)
    if run is None:
        kind = "boxes" if len(tracks) and tracks[0].plane == "image" else "points"
        info = {"tracker": "group", "config": {}, "seed": None, "detections": "truth", "input": kind, **info}
        info |= {"detections_hash": None, "sensor": {}, "background": None}
    else:
        info = {**run.info, **{key: info[key] for key in OF_TRACKS}}
    at_end = events_at_end(people, tracks, sequence.fps)
    return TrackingRun(tracks, {**info, "events_at_end": at_end, "grouping": rule.as_dict()})


def grouped(tracks: SequenceOf[Tracks], sequence: Sequence) -> tuple[Tracks, ...]:
    """Returns stored tracks of a sequence, one `Tracks` per frame, with groups and events derived where they lack. The
    default grouping is used."""
    from tracking.grouping.foot_points import completed, source_of

    known = image_scale.before_frames(sequence)
    # Labels of all frames tell the scale better than boxes of the first frames.
    truth = sequence.truth if known.frames or not np.isfinite(known.px_per_m) else None
    px_per_m = known.px_per_m if truth is None else truth.px_per_m
    return completed(
        tracks, sequence.fps, px_per_m, camera=sequence.camera, scene=sequence.scene,
        source=source_of(tracks), image_size=sequence.image_size,
    )[0]  # fmt: skip
