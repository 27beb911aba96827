"""The people of a sequence or a run at the places from which their groups are derived, and the evidence about them."""

from __future__ import annotations

import math

from scenarios.errors import InputError
from sim.types import Sequence
from tracking.grouping.belief import Belief
from tracking.grouping.explained_pairs import ExplainedPairs, explain
from tracking.grouping.foot_points import people_in_metres
from tracking.grouping.grouped_tracks import without_groups
from tracking.grouping.known_people import known_people
from tracking.grouping.tracks_table import TracksTable
from tracking.running import image_scale
from tracking.running.run import TrackingRun


def explained_people(sequence: Sequence, run: TrackingRun | None, belief: Belief) -> ExplainedPairs:
    """Returns the evidence about the tracked people of a run, or about the labelled ones of a sequence if it is None.
    Raises InputError as `people_at_places` does."""
    return explain(people_at_places(sequence, run), sequence.fps, belief)


def people_at_places(sequence: Sequence, run: TrackingRun | None) -> TracksTable:
    """Returns the table of the tracked people of a run, or of the labelled ones of a sequence if it is None.

    Raises InputError if there are no people with ids, the tracks are of whole groups, or people lie in the image and
    its scale is unknown.
    """
    tracks = known_people(sequence) if run is None else without_groups(run)  # as before groups were derived
    if not len(tracks) or any(t.unit == "group" for t in tracks):
        file, remedy = sequence.source.get("path", sequence.name), "give labelled people, or tracks of people"
        raise InputError(file=file, got="no tracks of people", expected="people with ids", remedy=remedy)
    learned = None if run is None else run.info.get("px_per_m")
    scale = image_scale.from_tracks(image_scale.before_frames(sequence), learned or math.nan, tracks)
    return people_in_metres(
        tracks, sequence.fps, scale.px_per_m, camera=sequence.camera, scene=sequence.scene,
        image_size=sequence.image_size,
    )  # fmt: skip
