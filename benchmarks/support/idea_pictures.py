"""One picture for each tracker that shows its idea, drawn from the tracker's own state in a simulated scene."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from benchmarks.relational.errors import EVERYBODY, FPS, SEEN, pair
from benchmarks.support.chart import COLOURS
from scenarios.loading.resolve import load, resolve
from sim.scene.camera import project
from sim.sequence import simulate
from sim.types import Array, Context, Tracks
from tracking.drawing.layers import ellipse
from tracking.running.prepare import PreparedTracker, prepare
from tracking.running.run import track
from tracking.running.tracker_registry import find

QUIET = "#8a8f98"
CLASSES = np.array([[236, 236, 236], [60, 110, 200], [40, 70, 140], [190, 190, 190], [250, 225, 150]], np.uint8)
"""RGB colours of background, foreground, dark foreground, shadow and highlight."""


def figure_of(columns: int, width: float = 9.0, height: float = 3.3) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(figure.subplots(1, columns, squeeze=False).flat)


def save(figure: Figure, path: Path) -> None:
    """Writes a figure as SVG or as JPEG."""
    options: dict[str, Any] = {"metadata": {"Date": None}} if path.suffix == ".svg" else {"dpi": 100}
    if path.suffix == ".jpg":
        options["pil_kwargs"] = {"quality": 82, "optimize": True}
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "flockscope"}):
        figure.savefig(path, **options)


def plan(axes: Axes, title: str, points: Array, ratio: float, margin: float = 1.2) -> None:
    """Makes axes a plan of the ground that shows some points (N, 2), m; `ratio` times as wide as high."""
    middle, extent = (points.max(0) + points.min(0)) / 2, (points.max(0) - points.min(0)) / 2
    half = (max(extent[0] / ratio, extent[1]) + margin) * np.array([ratio, 1.0])
    low, high = middle - half, middle + half
    axes.set_title(title, fontsize=9.5, loc="left")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=[], yticks=[])
    end, foot = high[0] - 0.06 * half[1], low[1] + 0.06 * half[1]
    axes.plot([end - 1, end], [foot] * 2, color=QUIET, linewidth=2)
    axes.text(end - 1.1, foot, "1 m", va="center", ha="right", fontsize=8, color=QUIET)


def colour(identity: int) -> str:
    return COLOURS[identity % len(COLOURS)]


def stepped(ready: PreparedTracker, last: int, seen: Callable[[Any, Tracks], None] | None = None) -> Tracks:
    """Returns the tracks of frame `last`."""
    ready.reset(0)
    for frame in ready.frames():
        tracks = ready.step(frame)
        if seen is not None:
            seen(frame, tracks)
        if frame.index == last:
            return tracks
    raise AssertionError("the sequence is shorter")


def outline(axes: Axes, polygon: Array, ink: str, style: str = "-", alpha: float = 0.16) -> None:
    if len(polygon):
        axes.add_patch(Polygon(polygon, facecolor=ink, alpha=alpha, linewidth=0))
        axes.add_patch(Polygon(polygon, facecolor="none", edgecolor=ink, linewidth=1.3, linestyle=style))


def blob(path: Path) -> None:
    """The picture, its classes of pixels, and the people that explain the foreground."""
    scene = simulate(load("merge", set=["camera.fps=10", "camera.image=[960, 720]", "camera.focal_px=750"]), 40_001)
    ready, last = prepare("blob", scene, detections="image"), 100
    tracks = stepped(ready, last)
    assert tracks.box is not None
    image = next(frame.image for frame in scene if frame.index == last)
    classes = ready.tracker.updater.foreground.segment(image).classes  # type: ignore[attr-defined]
    middle = np.median(tracks.box[:, :2] + tracks.box[:, 2:] / 2, axis=0)
    figure, axes = figure_of(3, 9.0, 2.7)
    titles = "1  the picture", "2  a class for each pixel", "3  a template for each person"
    for one, title, shown in zip(axes, titles, (image, CLASSES[classes], image), strict=True):
        one.imshow(shown if title[0] == "2" else shown[..., ::-1])
        one.set_title(title, fontsize=9.5, loc="left")
        one.set(xlim=middle[0] + np.array([-130, 130]), ylim=middle[1] + np.array([95, -95]), xticks=[], yticks=[])
    for id, box in zip(tracks.id.tolist(), tracks.box, strict=True):
        axes[2].add_patch(Rectangle(box[:2], *box[2:], fill=False, edgecolor=colour(id), linewidth=1.8))
        axes[2].text(box[0], box[1] - 4, str(id), color=colour(id), fontsize=10, weight="bold", clip_on=True)
    save(figure, path)


def relational(path: Path) -> None:
    """Where the particles of both filters expect a partner who has been hidden for two seconds."""
    figure, axes = figure_of(2, 9.0, 2.6)
    begun, last = round(SEEN * FPS), round((SEEN + 2.0) * FPS)
    for one, name, says in zip(
        axes, ("particle", "relational"), ("goes straight on", "walks with the partner"), strict=True
    ):
        tracker = find(name)(find(name).config_class().with_set(EVERYBODY))
        tracker.reset(Context(FPS, float("nan")), 0)
        true, given = pair(4)
        for frame in given:
            tracks = tracker.step(frame, frame.detections)
            if frame.index == begun:
                hidden = tracks.id[np.hypot(*(tracks.pos - true[begun - 1, 1]).T).argmin()]
            if frame.index == last:
                break
        here = true[last - 1]
        plan(one, f"{name}: the hidden person {says}", true[last - 20 : last + 8].reshape(-1, 2), 1.8, 0.4)
        cloud = tracker.particles.pos[:, int(np.flatnonzero(tracker.slots.id == hidden)[0])]
        one.plot(*cloud.T, ".", color=COLOURS[1], markersize=2, alpha=0.25)
        for ink, way in zip(COLOURS, true.transpose(1, 0, 2), strict=False):
            one.plot(*way[:last].T, color=ink, linewidth=1.2)
        one.plot(*here[0], "o", color=COLOURS[0], markersize=9)
        one.plot(*here[1], "o", markersize=9, markerfacecolor="white", markeredgecolor=COLOURS[1], markeredgewidth=2)
    save(figure, path)


def moments(path: Path, scenario: str, seed: int, kind: str, tracker: str, times: dict[float, str]) -> None:
    """Draws the groups of a tracker on the plan some s after the first event of a kind: detections, hulls, and the
    regions of whole groups."""
    scene = simulate(load(scenario, set=["camera.fps=10"]), seed, 0, ())
    run, frames = track(tracker, scene, detections="file"), list(scene)
    assert scene.truth is not None
    event = next(event for event in scene.truth.events or () if event.kind == kind)
    shown = [event.start - 1 + round(time * scene.fps) for time in times]
    figure, axes = figure_of(len(times), 9.0, 2.7)
    people = [scene.truth.at(k + 1) for k in shown]
    every = np.concatenate([one.pos[np.isin(one.id, event.members)] for one in people])
    for one, k, says in zip(axes, shown, times.values(), strict=True):
        plan(one, says, every, 1.2)
        one.plot(*frames[k].detections.pos[:, :2].T, "o", color="#333", markersize=3)
        tracks, groups = run[k], run[k].groups
        for row, id in enumerate(groups.id.tolist()):
            outline(one, groups.hull[row], colour(id))
            if tracks.unit == "group":
                region = groups.extent[row] + 0.3**2 * np.eye(2)
                outline(one, ellipse(groups.pos[row], region, 3.0), colour(id), "--", 0.05)
            label(one, id, groups.hull[row])
    save(figure, path)


def label(axes: Axes, id: int, around: Array) -> None:
    """Writes a group's id at the upper right of what it surrounds (N, 2)."""
    axes.annotate(f"G{id}", around.max(0), color=colour(id), weight="bold", fontsize=10, clip_on=True)


def group_pda(path: Path) -> None:
    """Two groups that cross: their regions overlap, and they keep their ids."""
    words = {-2.0: "two groups", 0.7: "their regions overlap", 3.5: "each group has kept its id"}
    moments(path, "cross", 40_001, "cross", "group-pda", words)


def joint(path: Path) -> None:
    """People who come together: their partition changes."""
    words = {-3.0: "two groups", 0.5: "they meet", 3.5: "one group"}
    moments(path, "merge", 40_001, "merge", "joint", words)


def stereo(path: Path) -> None:
    """Features of people in the left picture, and in space with the groups that they make."""
    entry = next(one for one in resolve("suite:subtraction-stereo") if "cross" in one.name)
    scene = simulate(entry.scenario, 40_000, 0, ("left", "right"))
    assert scene.truth is not None
    last = next(event.start for event in scene.truth.events or () if event.kind == "cross") - 20
    ready, kept = prepare("stereo", scene, detections="image"), list[Any]()

    def look(frame: Any, _: Tracks) -> None:
        if frame.index == last - 1:
            pictures = ready.tracker.pictures  # type: ignore[attr-defined]
            found = pictures.points
            pictures.points = lambda *pair: kept.append(found(*pair)) or kept[-1]
        if frame.index == last:
            kept.append(frame.image)

    tracks = stepped(ready, last, look)
    points, image = kept[0].pos, kept[1]
    owner = tracks.id[np.linalg.norm(points[:, None, :2] - tracks.pos[None, :, :2], axis=2).argmin(1)]
    inks = [colour(id) for id in owner.tolist()]
    figure, axes = figure_of(2, 9.0, 3.2)
    axes[0].imshow(image[..., ::-1])
    axes[0].set(xticks=[], yticks=[])
    axes[0].set_title("features of people in the left picture", fontsize=9.5, loc="left")
    seen, _ = project(scene.camera, points)
    axes[0].scatter(seen[:, 0], seen[:, 1], s=9, c=inks, linewidths=0)
    plan(axes[1], "the same in space, seen from above, with their groups", points[:, :2], 1.5)
    axes[1].scatter(points[:, 0], points[:, 1], s=7, c=inks, linewidths=0)
    for row, id in enumerate(tracks.id.tolist()):
        region = tracks.groups.extent[row] + 0.15**2 * np.eye(2)
        around = ellipse(tracks.pos[row, :2], region, 2.5)
        outline(axes[1], around, colour(id))
        label(axes[1], id, around)
    save(figure, path)


PICTURES = {
    "blob.jpg": blob,
    "group-pda.svg": group_pda,
    "joint.svg": joint,
    "relational.jpg": relational,
    "stereo.jpg": stereo,
}
"""What draws each picture of docs/trackers."""
