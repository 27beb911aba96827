"""Replay a recording: its people as the motion of a simulated sequence, so real motion with exact labels.

The labelled positions on the ground (m) are smoothed and resampled to the camera's frame rate
(sim.dataset.replay). Boxes without positions are first projected to the ground by a calibration. Each person gets
a body drawn from the seed. The given camera and sensor then observe the motion like a simulated one. Groups are those
that the recording labels; when they merge and split is measured from the motion. The scene has no walls and obstacles,
unless the source is a simulated sequence with a scene.

Smooth labelled positions of people and resample them to another frame rate.

Each gap-free segment of a person's positions y (m) becomes the smoothing spline f that minimises Σ |y - f|² + (tau⁴ /
dt) ∫ |f''|², with dt the time between labels in s and tau a time constant in s. It keeps motion slower than tau and
removes faster motion, that is, label jitter. tau is the smallest of TIMES (0.05 to 1 s) for which the 99 % quantile of
all accelerations is at most LIMIT (2.5 m/s²), since people do not walk with more; the largest of TIMES if none
satisfies it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.resolve import load_observation
from scenarios.schema.scenario import ObservationSpec
from scenarios.schema.values import Model, NonNegative, Positive
from sim.crowd.heading import facings, headings
from sim.dataset.splits import is_real
from sim.geometry.boxes import centres
from sim.hashing import canonical_hash
from sim.rng import draw, rng
from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE
from sim.sequence import observe
from sim.types import Array, Bools, Camera, Ints, Motion, Scene, Sequence, Truth

TIMES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)  # s, candidates for tau
LIMIT = 2.5  # m/s²
GAP = 2.0  # s without label after which a person counts as absent


@dataclass(frozen=True)
class Trajectories:
    """Resampled motion of P people in T frames."""

    id: Ints  # (P,) person ids, ascending; column k belongs to id[k]
    # (T, P, 2) x, y in m, and vel (T, P, 2): m/s, the derivative of the smoothed positions; both nan while absent
    pos: Array
    vel: Array
    present: Bools  # (T, P) True while present
    smoothing: float  # the chosen time constant tau in s; faster motion was removed


Curve = Callable[[Array], Array]
Segment = tuple[int, Array, Curve, Curve]


def resample(frame: Ints, id: Ints, pos: Array, rate: float, fps: float, first: float, last: float) -> Trajectories:
    """Returns the smoothed motion of labelled people at the times first, first + 1/fps, … last (s).

    frame (from 1), id (R,), pos (R, 2) m: labelled rows in any order, each id once in a frame. rate: label frames per
    s. fps: frames per s of the result. People are absent in gaps of more than 2 s, and before and after their labels. A
    label without another one within 2 s is ignored.
    """
    t = first + np.arange(int(np.floor((last - first) * fps + 1e-6)) + 1) / fps
    for tau in TIMES:
        segments = [s for one in np.unique(id) for s in _segments(frame, id, pos, int(one), rate, tau)]
        if _acceleration(segments, fps) <= LIMIT:
            break
    people = np.array(sorted({s[0] for s in segments if _inside(s[1], t).any()}), np.int64)
    pos, vel = np.full((len(t), len(people), 2), np.nan), np.full((len(t), len(people), 2), np.nan)
    for one, times, place, velocity in segments:
        here = _inside(times, t)
        if here.any():
            column = int(np.searchsorted(people, one))
            pos[here, column], vel[here, column] = place(t[here]), velocity(t[here])
    return Trajectories(people, pos, vel, np.isfinite(pos[:, :, 0]), tau)


def _inside(times: Array, t: Array) -> Bools:
    return np.asarray((t >= times[0] - 1e-9) & (t <= times[-1] + 1e-9))


def _rows_of(frame: Ints, id: Ints, one: int) -> Ints:
    rows = np.flatnonzero(id == one)
    return np.asarray(rows[np.argsort(frame[rows])])


def _segments(frame: Ints, id: Ints, pos: Array, one: int, rate: float, tau: float) -> list[Segment]:
    from scipy.interpolate import CubicSpline

    rows = _rows_of(frame, id, one)
    cuts = np.flatnonzero(np.diff(frame[rows]) > GAP * rate) + 1
    made: list[Segment] = []
    for part in np.split(rows, cuts):
        # A single label tells no motion.
        if len(part) >= 2:
            times = (frame[part] - 1) / rate
            f = CubicSpline(times, smoothing_spline(times, pos[part], tau**4 * rate), bc_type="natural")
            made.append((one, times, f, f.derivative()))
    return made


def smoothing_spline(t: Array, y: Array, weight: float) -> Array:
    """Returns the values f (N, 2) at its knots t (N,) of the natural cubic spline of least Σ |y - f|² + weight ∫
    |f''|².

    Reinsch (1967): f = y - weight Q γ with (R + weight Qᵀ Q) γ = Qᵀ y. γ (N - 2,) is f'' at the inner knots. Qᵀ forms
    differences of slopes at the inner knots; R holds the integrals of products of hat functions there.
    """
    from scipy.linalg import solveh_banded

    if len(t) < 3:
        return y
    h = np.diff(t)
    a, c = 1.0 / h[:-1], 1.0 / h[1:]
    b = -a - c  # column j of Q: a_j, b_j, c_j in rows j, j + 1, j + 2
    bands = np.zeros((3, len(t) - 2))
    bands[0] = (h[:-1] + h[1:]) / 3.0 + weight * (a**2 + b**2 + c**2)
    bands[1, :-1] = h[1:-1] / 6.0 + weight * (b[:-1] * a[1:] + c[:-1] * b[1:])
    bands[2, :-2] = weight * c[:-2] * a[2:]
    bend = a[:, None] * y[:-2] + b[:, None] * y[1:-1] + c[:, None] * y[2:]
    gamma = weight * solveh_banded(bands, bend, lower=True)
    f = np.array(y, dtype=float)
    f[:-2] -= a[:, None] * gamma
    f[1:-1] -= b[:, None] * gamma
    f[2:] -= c[:, None] * gamma
    return f


def _acceleration(segments: list[Segment], fps: float) -> float:
    """Returns the 99 % quantile of the accelerations, m/s²."""
    size = [np.zeros(1)]
    for _, times, _, velocity in segments:
        t = np.arange(times[0], times[-1], 1 / fps)
        size.append(np.linalg.norm(np.diff(velocity(t), axis=0), axis=1) * fps)
    return float(np.quantile(np.concatenate(size), 0.99))


def nearest_row(frame: Ints, id: Ints, people: Ints, rate: float, t: Array) -> Ints:
    """Returns the index of the label row nearest in time, for each time and person, (T, P).

    frame (from 1), id (R,): the label rows. people (P,): person ids, of which each has a row. rate: label frames per s.
    t (T,): s after frame 1. Of two equally near rows the earlier one is taken.
    """
    out = np.zeros((len(t), len(people)), np.int64)
    for column, one in enumerate(people):
        rows = _rows_of(frame, id, int(one))
        times = (frame[rows] - 1) / rate
        after = np.clip(np.searchsorted(times, t), 1, max(len(rows) - 1, 1))
        before = after - 1
        after = np.minimum(after, len(rows) - 1)
        out[:, column] = rows[np.where(np.abs(times[after] - t) < np.abs(t - times[before]), after, before)]
    return out


class ReplayOrigin(Model):
    """The recording whose motion a replay shows.

    - kind, name: format ("biwi", "mot", …) and name of the recording. real: it shows real people, so nothing may be
      tuned on it.
    - people: the recording's ids of persons 1, 2, … of the replay, in this order.
    - start, duration: the part that is replayed, s. shift: positions in the replay minus those in the recording, x, y,
      m.
    - smoothing: movements of the labels that are quicker than this are removed as jitter, s; 0: none.
    - motion: SHA-256 of the recording's labelled positions, ids and groups.
    """

    kind: str
    name: str
    real: bool
    people: tuple[int, ...]
    start: NonNegative
    duration: Positive
    smoothing: NonNegative
    shift: tuple[float, float]
    motion: str


class ReplaySpec(ObservationSpec):
    """A replay with all defaults filled in, as stored in its scenario.toml."""

    name: str
    replay: ReplayOrigin


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
    source: Sequence, camera: str | Path | ObservationSpec | None = None, seed: int = 20_000, *,
    cut: Cut = WHOLE, calibration: Camera | None = None, streams: Iterable[str] = ("left",),
) -> Sequence:  # fmt: skip
    """Returns the labelled people of a recording as a simulated sequence: real motion, seen by our camera and sensor.

    The ground is moved so that the least x and y of people are 1 m. A simulated source keeps its ground and scene.

    Args:
        source: A sequence with truth (`tracking.recordings.source.open_source` opens recordings).
        camera: Camera, sensor, light and picture, or their TOML file.
        seed: For bodies, looks and sensor.
        cut: The part to replay.
        calibration: Camera of a recording with boxes alone: maps the boxes' feet to the ground.
        streams: Pictures: some of "left", "right", "disparity", "ids", "background".

    Returns:
        The sequence; `source["origin"]` describes the recording.

    Raises:
        InputError: The source has no labelled people or no way to the ground, the cut is outside it, or people leave
            the camera's view.
    """
    view = camera if isinstance(camera, ObservationSpec) else load_observation(camera)
    return resolve_replay(source, view, seed, cut=cut, calibration=calibration, streams=streams)[0]


def resolve_replay(
    source: Sequence, view: ObservationSpec, seed: int, *, cut: Cut = WHOLE,
    calibration: Camera | None = None, streams: Iterable[str] = (),
) -> tuple[Sequence, ReplaySpec]:  # fmt: skip
    """Returns the sequence that `replay` returns, and the ReplaySpec that describes it.

    The ReplaySpec, with all defaults, takes the place of the scenario in stored files and hashes. Arguments as for
    `replay`.
    """
    truth = _labels(source)
    places = on_ground(truth, source, calibration)
    moving = _moving(places, truth, source, view.camera.fps, cut)
    # A simulated scene stays where it is; recordings may have any origin.
    low, whole = np.nanmin(moving.pos, axis=(0, 1)), source.scene if not is_real(source) else None
    shift = np.zeros(2) if whole is not None else MARGIN - low
    origin = _origin(source, truth, places, moving, cut, view.camera.fps, shift)
    motion = _motion(moving, truth, replay_name(source.name, cut), view.camera.fps, cut, seed, shift)
    made = observe(view, motion if whole is None else motion.replace(scene=whole), people={}, streams=streams)
    if truth.labelled is None or not truth.labelled.any():
        made = replace(made, load_truth=partial(_without_groups, made))
    described = {**made.source, "kind": "replayed", "origin": origin.model_dump()}
    form = ReplaySpec(
        name=motion.name, replay=origin, **{name: getattr(view, name) for name in ObservationSpec.model_fields}
    )
    return replace(made, source=described), form


def _labels(source: Sequence) -> Truth:
    truth = source.truth
    if truth is None or not len(truth.id):
        remedy = "give a BIWI folder, a CAVIAR file, a MOTChallenge folder with gt, or a generated sequence"
        raise _wrong(source, "", "no labelled people", "trajectories", remedy)
    return truth


def _wrong(source: Sequence, place: str, got: str, expected: str, remedy: str) -> InputError:
    file = source.source.get("path", source.name)
    return InputError(file=file, place=place, got=got, expected=expected, remedy=remedy)


def on_ground(truth: Truth, source: Sequence, calibration: Camera | None = None) -> Array:
    """Returns the positions (R, 2) m of the rows of a truth, nan where unknown.

    They are the truth's own positions if it has any; a calibration is then an InputError. Else they are the feet of the
    boxes on the ground, by the calibration or the source's camera. CAVIAR without a calibration: the boxes' centres
    divided by the image scale, y upwards. Raises InputError if there is none of these.
    """
    if truth.pos is not None:
        if calibration is not None:
            expected = "none for labels that are on the ground already"
            raise _wrong(source, "--calibration", "a calibration", expected, "leave it out")
        return truth.pos
    assert truth.box is not None, "labels have positions or boxes"
    camera = calibration or source.camera
    if camera is not None:
        from sim.scene.camera import foot_points, scaled_to_image

        camera = scaled_to_image(camera, source.image_size, str(source.source.get("path", "")))

        return foot_points(truth.box, np.zeros(len(truth.box)), camera)
    if source.source.get("kind") in FLAT:
        return np.asarray(centres(truth.box) * (1, -1) / truth.px_per_m)
    remedy = "give its calibration with --calibration FILE; without one it cannot be replayed"
    raise _wrong(source, "", "labels in the image alone", "places on the ground", remedy)


def _moving(places: Array, truth: Truth, source: Sequence, fps: float, cut: Cut) -> Trajectories:
    place, whole = "--start, --duration", (truth.length - 1) / truth.fps
    last = whole if cut.duration is None else min(whole, cut.start + cut.duration - 1 / fps)
    if not 0 <= cut.start <= last <= cut.start + LONGEST:
        part = "the rest" if cut.duration is None else f"{cut.duration:g} s"
        expected = f"a part of its {whole:.1f} s, of an hour at most"
        raise _wrong(source, place, f"{cut.start:g} s, {part}", expected, "correct --start or --duration")
    known = np.isfinite(places).all(axis=1)
    moving = resample(truth.frame[known], truth.id[known], places[known], truth.fps, fps, cut.start, last)
    if not len(moving.id):
        raise _wrong(source, place, f"nobody from {cut.start:g} to {last:g} s", "people", "choose another part")
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
    """Returns the name of a replay, such as "hotel-t30" for a cut of the recording `name` that starts at 30 s.

    Characters other than letters, digits, "_", "." and "-" become "-". A name that does not begin with a letter gets
    "replay-" in front.
    """
    clean = "".join(c if c.isalnum() or c in "_.-" else "-" for c in name)
    clean = clean if clean[:1].isalpha() else f"replay-{clean}"
    return f"{clean}-t{cut.start:g}" if cut.start else clean


def _without_groups(sequence: Sequence) -> Truth:
    assert sequence.load_truth is not None
    found = sequence.load_truth()
    alone, nowhere = np.full(len(found.id), -1, np.int64), np.zeros(found.length, bool)
    return found.replace(group=alone, groups=None, groups_px=None, events=None, near=None, labelled=nowhere)
