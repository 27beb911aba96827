"""Replay a recording: its people as the motion of a simulated sequence, so real motion with exact labels.

The labelled positions on the ground (m) are smoothed and resampled to the camera's frame rate
(sim.dataset.trajectories). Boxes without positions are first projected to the ground by a calibration. Each person gets
a body drawn from the seed. The given camera and sensor then observe the motion like a simulated one. Groups are those
that the recording labels; when they merge and split is measured from the motion. The scene has no walls and obstacles,
unless the source is a simulated sequence with a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.resolve import load_observation
from scenarios.schema.scenario import ObservationSpec, ReplayOrigin, ReplaySpec
from sim.crowd.heading import facings, headings
from sim.dataset.splits import is_real
from sim.dataset.trajectories import Trajectories, nearest_row, resample
from sim.hashing import canonical_hash
from sim.rng import draw, rng
from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE
from sim.sequence import observe
from sim.types import Array, Camera, Ints, Motion, Scene, Sequence, Truth

MARGIN = 1.0  # m of ground around all positions
LONGEST = 3600.0  # s, the longest duration of a scenario
FLAT = ("caviar",)  # recordings whose image, divided by its scale, is taken as the ground without a calibration


@dataclass(frozen=True)
class Cut:
    """The part of a recording to replay."""

    start: float = 0.0  # s after the recording's frame 1, 0 or more
    duration: float | None = None  # s; None means to the recording's end. A duration beyond the end is cut off there.


WHOLE = Cut()


def replay(
    source: str | Path | Sequence,
    camera: str | Path | ObservationSpec | None = None,
    seed: int = 20_000,
    *,
    cut: Cut = WHOLE,
    calibration: Camera | str | Path | None = None,
    streams: Iterable[str] = ("left",),
) -> Sequence:
    """Returns the labelled people of a recording as a simulated sequence: real motion, seen by our camera and sensor.

    The ground is moved so that the least x and y are 1 m, unless a simulated source has a scene, which is then kept.

    Args:
        source: A sequence with truth, or the path of one.
        camera: Camera, sensor, light and picture, or their TOML file.
        seed: For bodies, looks and sensor.
        cut: The part to replay.
        calibration: Camera, or its file, of a recording with boxes alone: maps the boxes' feet to the ground.
        streams: Pictures: some of "left", "right", "disparity", "ids", "background".

    Returns:
        The sequence; `source["origin"]` describes the recording.

    Raises:
        InputError: The source has no labelled people or no way to the ground, the cut is outside it, or people leave
            the camera's view.
    """
    from sim.io.source import open_source

    if not isinstance(source, Sequence):
        found = open_source(source, images=False)
        if len(found) != 1:
            raise InputError(
                file=source, got=f"{len(found)} sequences", expected="one", remedy="give the path of one of them"
            )
        source = found[0]
    view = camera if isinstance(camera, ObservationSpec) else load_observation(camera)
    return resolve_replay(source, view, seed, cut=cut, calibration=calibration, streams=streams)[0]


def resolve_replay(
    source: Sequence,
    view: ObservationSpec,
    seed: int,
    *,
    cut: Cut = WHOLE,
    calibration: Camera | str | Path | None = None,
    streams: Iterable[str] = (),
) -> tuple[Sequence, ReplaySpec]:
    """Returns the sequence that `replay` returns, and the ReplaySpec that describes it.

    The latter, with all defaults, takes the place of the scenario in stored files and hashes.
    """
    truth = _labels(source)
    places = on_ground(truth, source, _calibrated(calibration, source))
    moving = _moving(places, truth, source, view.camera.fps, cut)
    # A simulated scene stays where it is; recordings may have any origin.
    low, whole = np.nanmin(moving.pos, axis=(0, 1)), source.scene if not is_real(source) else None
    shift = np.zeros(2) if whole is not None else MARGIN - low
    origin = _origin(source, truth, places, moving, cut, view.camera.fps, shift)
    motion = _motion(moving, truth, replay_name(source.name, cut), view.camera.fps, cut, seed, shift)
    made = observe(view, motion if whole is None else motion.replace(scene=whole), people={}, streams=streams)
    if truth.labelled is None or not truth.labelled.any():
        made = replace(made, load_truth=_without_groups(made))
    described = {**made.source, "kind": "replayed", "origin": origin.model_dump()}
    form = ReplaySpec(
        name=motion.name, replay=origin, **{name: getattr(view, name) for name in ObservationSpec.model_fields}
    )
    return replace(made, source=described), form


def _labels(source: Sequence) -> Truth:
    truth = source.truth
    if truth is None or not len(truth.id):
        raise InputError(
            file=source.source.get("path", source.name), got="no labelled people", expected="trajectories",
            remedy="give a BIWI folder, a CAVIAR file, a MOTChallenge folder with gt, or a generated sequence",
        )  # fmt: skip
    return truth


def on_ground(truth: Truth, source: Sequence, calibration: Camera | None = None) -> Array:
    """Returns the positions (R, 2) m of the rows of a truth, nan where unknown.

    They are its own, or the feet of its boxes as seen by the calibration or the source's camera, or, of CAVIAR, the
    boxes' centres over the image scale.
    """
    if truth.pos is not None:
        if calibration is not None:
            raise InputError(
                file=source.source.get("path", source.name), place="--calibration", got="a calibration",
                expected="none for labels that are on the ground already", remedy="leave it out",
            )  # fmt: skip
        return truth.pos
    assert truth.box is not None, "labels have positions or boxes"
    camera = calibration or source.camera
    if camera is not None:
        from sim.scene.camera import foot_points

        return foot_points(truth.box, np.zeros(len(truth.box)), camera)
    if source.source.get("kind") in FLAT:
        centre = truth.box[:, :2] + truth.box[:, 2:] / 2
        return np.asarray(np.stack([centre[:, 0], -centre[:, 1]], axis=1) / truth.px_per_m)
    raise InputError(
        file=source.source.get("path", source.name), got="labels in the image alone",
        expected="places on the ground",
        remedy="give its calibration with --calibration FILE; without one it cannot be replayed",
    )  # fmt: skip


def _calibrated(calibration: Camera | str | Path | None, source: Sequence) -> Camera | None:
    from sim.io.formats.calibration import read_calibration, scaled_to_image

    if calibration is None or isinstance(calibration, Camera):
        return calibration
    return scaled_to_image(
        read_calibration(Path(calibration)), source.image_size, Path(str(source.source.get("path", "")))
    )


def _moving(places: Array, truth: Truth, source: Sequence, fps: float, cut: Cut) -> Trajectories:
    file, whole = source.source.get("path", source.name), (truth.length - 1) / truth.fps
    last = whole if cut.duration is None else min(whole, cut.start + cut.duration - 1 / fps)
    if not 0 <= cut.start <= last <= cut.start + LONGEST:
        part = "the rest" if cut.duration is None else f"{cut.duration:g} s"
        raise InputError(
            file=file, place="--start, --duration", got=f"{cut.start:g} s, {part}",
            expected=f"a part of its {whole:.1f} s, of an hour at most", remedy="correct --start or --duration",
        )  # fmt: skip
    known = np.isfinite(places).all(axis=1)
    moving = resample(truth.frame[known], truth.id[known], places[known], truth.fps, fps, cut.start, last)
    if not len(moving.id):
        got = f"nobody from {cut.start:g} to {last:g} s"
        raise InputError(
            file=file, place="--start, --duration", got=got, expected="people", remedy="choose another part"
        )
    return moving


def _origin(
    source: Sequence, truth: Truth, places: Array, moving: Trajectories, cut: Cut, fps: float, shift: Array
) -> ReplayOrigin:
    labels = {"frame": truth.frame, "id": truth.id, "group": truth.group, "places": places, "fps": truth.fps}
    first = source.source.get("origin") or {}  # of a replay of a replay
    return ReplayOrigin(
        kind=str(first.get("kind", source.source.get("kind", "unknown"))), name=str(first.get("name", source.name)),
        real=is_real(source), people=tuple(int(one) for one in moving.id), start=cut.start,
        duration=round(len(moving.present) / fps, 6), smoothing=moving.smoothing,
        shift=(float(shift[0]), float(shift[1])), motion=canonical_hash(labels),
    )  # fmt: skip


def _motion(moving: Trajectories, truth: Truth, name: str, fps: float, cut: Cut, seed: int, shift: Array) -> Motion:
    intent = _intent(moving, truth, fps, cut)
    pos = moving.pos + shift
    height = _heights(moving.id, truth, seed)
    return Motion(
        name=name, seed=seed, repeat=0, fps=fps, pos=pos, vel=moving.vel,
        heading=headings(facings(pos, moving.vel, moving.present, intent, fps)), present=moving.present, intent=intent,
        height=height, width=SHOULDER_SHARE * height, depth=DEPTH_SHARE * height,
        free_speed=np.nanmedian(np.linalg.norm(moving.vel, axis=2), axis=0),
        scene=Scene(np.nanmax(pos, axis=(0, 1)) + MARGIN),
    )  # fmt: skip


def _intent(moving: Trajectories, truth: Truth, fps: float, cut: Cut) -> Ints:
    """Returns the group that each person is meant to be in, (T, P), by the label nearest in time; -1 while absent."""
    t = cut.start + np.arange(len(moving.present)) / fps
    label = truth.group[nearest_row(truth.frame, truth.id, moving.id, truth.fps, t)]
    # A person alone is a group of its own, numbered above all others.
    alone = int(truth.group.max(initial=0)) + 1 + np.arange(len(moving.id))
    return np.where(moving.present, np.where(label >= 0, label, alone), -1).astype(np.int64)


def _heights(people: Ints, truth: Truth, seed: int) -> Array:
    from scenarios.schema.scenario import CrowdSpec

    # As in simulated crowds, where the recording does not tell.
    drawn = [draw(CrowdSpec().height, rng(seed, "person", int(one))) for one in people]
    if truth.height is None:
        return np.array(drawn)
    first = [int(np.argmax(truth.id == one)) for one in people]
    return np.where(np.isfinite(truth.height[first]), truth.height[first], drawn)


def replay_name(name: str, cut: Cut) -> str:
    """Returns the replay's name: that of the recording with harmless characters, and the start of the cut."""
    clean = "".join(c if c.isalnum() or c in "_.-" else "-" for c in name)
    clean = clean if clean[:1].isalpha() else f"replay-{clean}"
    return f"{clean}-t{cut.start:g}" if cut.start else clean


def _without_groups(sequence: Sequence) -> Callable[[], Truth]:
    def truth() -> Truth:
        assert sequence.load_truth is not None
        found = sequence.load_truth()
        alone, nowhere = np.full(len(found.id), -1, np.int64), np.zeros(found.length, bool)
        return found.replace(group=alone, groups=None, groups_px=None, events=None, near=None, labelled=nowhere)

    return truth
