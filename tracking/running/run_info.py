"""The content of run.json: which tracker ran, with which config and seed, on which detections, how fast.

`run_info` makes the dict, `input_summary` makes one line of it. Speeds are in frames per second.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from typing import Any

import numpy as np

from sim.hashing import detections_hash, installed
from sim.types import Sequence, Tracks
from tracking.grouping.ground_of_boxes import Ground
from tracking.running.image_scale import ImageScale
from tracking.running.prepare import PreparedTracker

PACKAGES = ("flockscope", "numpy", "scipy")  # Packages whose versions run.json holds.


def run_info(
    prepared: PreparedTracker,
    tracks: SequenceOf[Tracks],
    seed: int,
    sensor: Mapping[str, Any],
    scale: ImageScale,
    ground: Ground,
    speeds: tuple[float, float],
) -> dict[str, Any]:
    """Returns the content of run.json for a run, as a dictionary. Two equal runs differ only in their speeds.

    sensor, scale, ground: the sensor settings, the image scale and the ground that were used. speeds: two numbers of
    frames per second, first of the tracker's checked steps alone, then also counting the reading of frames. Neither
    counts the derivation of groups.
    """
    sample = prepared.context.background
    begins = 1 if sample is None else causal_from(prepared.sequence)
    diagnostics = prepared.diagnostics("after the last frame")
    stored = prepared.given if prepared.mode in ("file", "both") else None
    return {
        "tracker": prepared.name,
        "config": prepared.config.as_dict() if prepared.config else {},
        **({} if prepared.followed is None else {"policy": prepared.followed.policy.as_dict()}),
        "seed": seed,
        "detections": prepared.mode,
        "detections_hash": stored and detections_hash(stored.detections),
        "input": prepared.input,
        "sensor": dict(sensor),
        "background": None if sample is None else prepared.sequence.source.get("background", f"{len(sample)} frames"),
        **facts_of_tracks(prepared.sequence, tracks, scale, ground, begins),
        "frames_per_second": speeds[0],
        "whole_frames_per_second": speeds[1],
        **({} if diagnostics is None else {"diagnostics": diagnostics}),
    }


def facts_of_tracks(
    sequence: Sequence, tracks: SequenceOf[Tracks], scale: ImageScale, ground: Ground, begins: int | None
) -> dict[str, Any]:
    """Returns what run.json tells of tracks, whoever made them: of the sequence, plane, boxes, scale and causality."""
    from sim.store.track_boxes import box_source

    begins = None if begins is None else max(begins, scale.frames, ground.frames)
    return {
        "sequence": sequence.name,
        "plane": tracks[0].plane if len(tracks) else None,
        "boxes": box_source(tracks, sequence.camera),
        "fps": sequence.fps,
        "px_per_m": None if np.isnan(scale.px_per_m) else scale.px_per_m,
        "px_per_m_frames": scale.frames,
        "ground": ground.source,
        "causal": begins is not None,
        "causal_from": begins,
        "frames": len(tracks),
        **({"box_scale": list(sequence.source["box_scale"])} if "box_scale" in sequence.source else {}),
        **({"ids": sequence.source["ids"]} if "ids" in sequence.source else {}),
        "versions": installed(PACKAGES),
    }


def causal_from(sequence: Sequence) -> int | None:
    """Returns the first frame (from 1) from which on the background sample contains no later frame.

    It is 1 if the sample does not come from the sequence's own pictures, and None if the sample contains frames from
    all over the recording.
    """
    from sim.pictures.background_sample import BackgroundSample

    sample = sequence.load_background
    if not isinstance(sample, BackgroundSample) or sample.choice.how == "learn":
        return 1
    return sample.choice.count if sample.choice.how == "first" else None


def input_summary(info: Mapping[str, Any]) -> str:
    """Returns one line with the detection mode, background and sensor settings of a run, from its run.json. Example:
    "truth (noise_m = 0.1)". It is "" if run.json does not tell the mode."""
    mode, background, sensor = (info.get(key) for key in ("detections", "background", "sensor"))
    more = [f"background: {background}"] if background else []
    more += [f"{key} = {value}" for key, value in (sensor or {}).items()]
    return f"{mode} ({', '.join(more)})" if more else str(mode or "")


def input_name(info: Mapping[str, Any]) -> str:
    """Returns a short name of a tracker's input, from the content of its run.json; "" if it is unknown. Examples:
    "pixels", "pixels and boxes", "boxes (file)", "points (truth, noise_m = 0.1, seed 3)"."""
    kind, mode, sensor = (info.get(key) for key in ("input", "detections", "sensor"))
    if kind is None:
        return ""
    more = [*(f"{key} = {value}" for key, value in sensor.items()), f"seed {info.get('seed')}"] if sensor else []
    return str(kind) if mode in ("image", "both") else f"{kind} ({', '.join([str(mode), *more])})"


# Keys of run.json that follow from tracks and sequence, whoever made the tracks.
OF_TRACKS = ("sequence", "plane", "fps", "px_per_m", "px_per_m_frames", "ground", "causal", "causal_from", "frames")
