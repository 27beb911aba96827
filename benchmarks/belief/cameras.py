"""Simulated people as six cameras see them: boxes with the errors of detectors that were fitted to recordings."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE
from scenarios.loading.resolve import Entry
from scenarios.schema.sensor import Sensor
from sim.crowd.world import run
from sim.sequence import LabelledSequence, observe
from sim.types import Ints, Tracks, Truth
from tracking.fitting.sensor import fit_sensor
from tracking.grouping.grouped_tracks import groups_in_frames
from tracking.grouping.known_people import people_as_tracks
from tracking.recordings.source import open_source

IMAGE, FOCAL = (1280, 720), 1000.0  # px


@dataclass(frozen=True)
class View:
    """A camera, and the recording whose detector its boxes are like."""

    height: float  # m
    tilt_deg: float
    recording: str

    @property
    def name(self) -> str:
        """The place of the camera, as a row of a table."""
        return f"{self.height:g} m, {self.tilt_deg:g}°, {Path(self.recording).name.split('-')[0]}"


VIEWS = (
    View(2.5, 4.0, CAMPUS), View(2.5, 12.0, PETS), View(4.0, 12.0, TOWN_CENTRE), View(4.0, 25.0, CAMPUS),
    View(8.0, 30.0, PETS), View(20.0, 50.0, TOWN_CENTRE),
)  # fmt: skip


@cache
def detector(path: Path) -> Sensor:
    """Returns the profile that is fitted to the detections of a recording."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # TUD-Campus states no frame rate, TownCentre's detections come a frame late
        return fit_sensor(open_source(path, images=False))


def seen_by(view: View, entry: Entry, seed: int, data: Path) -> LabelledSequence:
    """Returns the sequence of an entry as the camera sees it, without pictures. It stands where all are in view."""
    place = {"kind": "pinhole", "image": IMAGE, "focal_px": FOCAL, "tilt_deg": view.tilt_deg, "height": view.height}
    free = {"position": None, "yaw_deg": None, "px_per_m": None, "crop": True}
    spec, sensor = entry.scenario.camera.model_copy(update={**place, **free}), detector(data / view.recording)
    scenario = entry.scenario.model_copy(update={"camera": spec, "sensor": sensor})
    return observe(scenario, run(entry.scenario, seed, entry.repeat))


def known_boxes(sequence: LabelledSequence) -> list[Tracks]:
    """Returns the detected boxes of people as tracks in the image with the ids of the people; false alarms left out."""
    assert sequence.load_owners is not None
    found = []
    for frame, owner in zip(sequence.without_pictures(), sequence.load_owners(), strict=True):
        assert frame.detections is not None
        assert frame.detections.box is not None
        own = np.flatnonzero(owner >= 0)
        found.append(Tracks.of_boxes(frame, owner[own], frame.detections.box[own], frame.detections.score[own]))
    return found


def at_true_places(truth: Truth, tracks: Sequence[Tracks]) -> list[Tracks]:
    """Returns tracks with known ids at the true places of the people, with their groups and events: what is scored is
    the grouping, and no error of places."""
    moved = []
    for true, own in zip(people_as_tracks(truth), tracks, strict=True):
        order = np.argsort(own.id)
        row = np.flatnonzero(np.isin(true.id, own.id))
        group, events = own.group[order][np.isin(own.id[order], true.id)], own.events
        moved.append(true.keep(row).replace(group=group, events=events, derived=True))
    return [t.replace(groups=groups) for t, groups in zip(moved, groups_in_frames(moved), strict=True)]


def at_most(truth: Truth, tracks: Sequence[Tracks]) -> float:
    """Returns the pairwise F1 of the true groups if only the people of `tracks`, with known ids, are reported; nan
    without true pairs."""
    size = int(truth.id.max(initial=0)) + 1
    reported = np.concatenate([t.index * size + t.id for t in tracks])
    there = np.isin(truth.frame * size + truth.id, reported)
    grouped = truth.group >= 0
    key = truth.frame * (int(truth.group.max(initial=0)) + 1) + truth.group
    true, seen = (_pairs(key[rows]) for rows in (grouped, grouped & there))
    return 2 * seen / (true + seen) if true else float("nan")


def truly_grouped(truth: Truth, tracks: Sequence[Tracks]) -> list[Tracks]:
    """Returns tracks of people with known ids in their true groups."""
    size = int(truth.id.max(initial=0)) + 1
    key = truth.frame * size + truth.id
    return [t.replace(group=truth.group[np.searchsorted(key, t.index * size + t.id)]) for t in tracks]


def _pairs(key: Ints) -> int:
    """Returns the number of pairs of rows with the same key."""
    count = np.unique(key, return_counts=True)[1]
    return int((count * (count - 1) // 2).sum())
