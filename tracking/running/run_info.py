"""The content of run.json: which tracker ran, with which config and seed, on which detections, how fast.

`run_info` makes the dict, `input_summary` makes one line of it. Speeds are in frames per second.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.types import Sequence, Tracks
from sim.versions import installed
from tracking.running.detection_mode import input_kind
from tracking.running.image_scale import ImageScale
from tracking.running.prepare import PreparedTracker

PACKAGES = ("flockscope", "numpy", "scipy")  # Packages whose versions run.json holds.

SENSOR_SETTINGS_SHOWN = 6  # Most sensor settings that `input_summary` shows; run.json holds all of them.


@dataclass(frozen=True)
class Speed:
    """Speed of a run in frames per second, 0 if nothing was run."""

    tracker: float = 0.0  # of the tracker's steps alone, with their checks
    whole: float = 0.0  # with the reading of frames, without the derivation of groups


def run_info(
    prepared: PreparedTracker,
    tracks: SequenceOf[Tracks],
    seed: int,
    sensor: Mapping[str, Any],
    scale: ImageScale,
    speed: Speed,
) -> dict[str, Any]:
    """Returns what run.json tells of a run, as a dictionary. Two equal runs differ only in their speeds."""
    sample = prepared.context.background
    begins = 1 if sample is None else causal_from(prepared.sequence)
    diagnostics = getattr(prepared.tracker, "diagnostics", None)
    return {
        "tracker": prepared.name,
        "config": prepared.config.as_dict() if prepared.config else {},
        "seed": seed,
        "detections": prepared.mode,
        "input": input_kind(prepared.tracker.needs, prepared.mode, prepared.sequence, prepared.frames_given or ()),
        "sensor": dict(sensor),
        "background": None if sample is None else prepared.sequence.source.get("background", f"{len(sample)} frames"),
        **_facts(prepared.sequence, tracks, scale, begins),
        "frames_per_second": speed.tracker,
        "whole_frames_per_second": speed.whole,
        **({} if diagnostics is None else {"diagnostics": diagnostics}),
    }


def known_people_info(sequence: Sequence, tracks: SequenceOf[Tracks], scale: ImageScale) -> dict[str, Any]:
    """Returns what run.json tells of the groups of a sequence's labelled people."""
    given: dict[str, Any] = {
        "tracker": "group",
        "config": {},
        "seed": None,
        "detections": "truth",
        "input": "boxes" if len(tracks) and tracks[0].plane == "image" else "points",
        "sensor": {},
        "background": None,
    }
    return {**given, **_facts(sequence, tracks, scale, 1)}


def _facts(sequence: Sequence, tracks: SequenceOf[Tracks], scale: ImageScale, begins: int | None) -> dict[str, Any]:
    """Returns what run.json tells of tracks, whoever made them: of the sequence, plane, boxes, scale and causality."""
    from sim.io.store.track_files import box_source

    begins = None if begins is None else max(begins, scale.frames)
    return {
        "sequence": sequence.name,
        "plane": tracks[0].plane if len(tracks) else None,
        "boxes": box_source(tracks, sequence.camera),
        "fps": sequence.fps,
        "px_per_m": None if np.isnan(scale.px_per_m) else scale.px_per_m,
        "px_per_m_frames": scale.frames,
        "causal": begins is not None,
        "causal_from": begins,
        "frames": len(tracks),
        **({"box_scale": list(sequence.source["box_scale"])} if "box_scale" in sequence.source else {}),
        "versions": installed(PACKAGES),
    }


def causal_from(sequence: Sequence) -> int | None:
    """Returns the first frame (from 1) whose background sample holds no later frame; None if there is no such frame."""
    from sim.io.pictures.background_sample import BackgroundSample

    sample = sequence.load_background
    if not isinstance(sample, BackgroundSample):
        return 1
    return sample.choice.count if sample.choice.how == "first" else None


def input_summary(info: Mapping[str, Any]) -> str:
    """Returns one line on what a tracker was given, from the content of its run.json."""
    mode, background, sensor = (info.get(key) for key in ("detections", "background", "sensor"))
    more = [f"background: {background}"] if background else []
    more += [f"{key} = {value}" for key, value in list((sensor or {}).items())[:SENSOR_SETTINGS_SHOWN]]
    more += [f"{len(sensor) - SENSOR_SETTINGS_SHOWN} more"] if sensor and len(sensor) > SENSOR_SETTINGS_SHOWN else []
    return f"{mode} ({', '.join(more)})" if more else str(mode or "")


def input_name(info: Mapping[str, Any]) -> str:
    """Returns what a tracker worked on, from the content of its run.json, as "pixels" or "boxes (file)"."""
    kind, mode, sensor = (info.get(key) for key in ("input", "detections", "sensor"))
    if kind is None:
        return ""
    more = [*(f"{key} = {value}" for key, value in sensor.items()), f"seed {info.get('seed')}"] if sensor else []
    return str(kind) if mode == "image" else f"{kind} ({', '.join([str(mode), *more])})"
