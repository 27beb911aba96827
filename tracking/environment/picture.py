"""The picture that the environment renders after a step, as an array (H, W, 3) uint8 RGB.

It shows the last frame's image with the tracks or, without images, a plan of the ground (or an empty image plane) with
detections and tracks; above it a line of text with source, seed, frame and score.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections, Frame, Image, Tracks
from tracking.drawing.canvas import FLOOR, THING, TRAIL_SECONDS, Canvas
from tracking.drawing.layer_painting import draw_banner, draw_captions, letter_size, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, plan_layer_of_tracks
from tracking.drawing.plan_view import draw_scene
from tracking.environment.episode_cache import OpenedSource
from tracking.environment.episodes import Rollout

SIZE = (480, 640)  # Height and width of a plan, px.
STRIP = 32  # Height of the text line above the picture, px.
LETTER = 0.5  # Font scale of the text line.


def episode_picture(opened: OpenedSource, rollout: Rollout | None, score: float) -> Image:
    """Returns the last tracked frame with its detections and tracks, uint8 (H, W, 3) RGB, height and width even."""
    frame, tracks = (None, []) if rollout is None else (rollout.last, rollout.tracks)
    canvas = _canvas(opened, frame, tracks)
    if frame is not None:
        if frame.detections is not None and frame.image is None:
            _draw_detections(canvas, frame.detections, tracks[-1].plane)
        layer = _layer(opened, tracks, canvas)
        paint_layer(canvas, layer, frame.index, opened.sequence.fps)
        draw_captions(canvas.image, layer, frame.index, opened.sequence.fps, letter_size(canvas))
    strip = np.zeros((STRIP, canvas.image.shape[1], 3), np.uint8)
    source, done = opened.source, len(tracks)
    words = f"{source.name} {source.seed}   frame {done} of {opened.truth.length}   objective {score:.3f}"
    draw_banner(strip, words, [], LETTER)
    whole = np.concatenate([strip, canvas.image])
    height, width = (n - n % 2 for n in whole.shape[:2])
    return np.ascontiguousarray(whole[:height, :width, ::-1])


def _canvas(opened: OpenedSource, frame: Frame | None, tracks: list[Tracks]) -> Canvas:
    sequence = opened.sequence
    if sequence.has_images and sequence.image_size is not None:
        shown = None if frame is None else frame.image
        empty = np.full((*sequence.image_size[::-1], 3), THING, np.uint8)
        image = empty if shown is None else np.array(shown, np.uint8)
        return Canvas(image, 1.0, np.zeros(2), np.array(sequence.image_size, float), upwards=False)
    image = np.full((*SIZE, 3), FLOOR, np.uint8)
    if _on_ground(opened, tracks):
        low, high = _bounds(opened)
        plan = Canvas.fit(image, low, high, upwards=True)
        draw_scene(plan, sequence.scene)
        return plan
    size = np.array(sequence.image_size, float) if sequence.image_size is not None else _bounds(opened)[1]
    return Canvas.fit(image, np.zeros(2), size, upwards=False)


def _on_ground(opened: OpenedSource, tracks: list[Tracks]) -> bool:
    return tracks[-1].plane != "image" if tracks else opened.truth.pos is not None


def _bounds(opened: OpenedSource) -> tuple[Array, Array]:
    scene = opened.sequence.scene
    if scene is not None:
        return np.zeros(2), scene.size
    places = [f.detections.pos[:, :2] for f in opened.sequence.without_pictures() if f.detections is not None]
    truth = opened.truth
    if not sum(map(len, places)):
        places = [truth.pos] if truth.pos is not None else [truth.box[:, :2]] if truth.box is not None else []
    found = np.concatenate([np.zeros((0, 2)), *places])
    if not len(found):
        return np.zeros(2), np.ones(2)
    return found.min(axis=0) - 1, found.max(axis=0) + 1


def _draw_detections(canvas: Canvas, detections: Detections, plane: str) -> None:
    if detections.plane == plane or detections.plane != "image" != plane:
        for at in detections.pos[:, :2]:
            canvas.disc(at, 2.5, THING)


def _layer(opened: OpenedSource, tracks: list[Tracks], canvas: Canvas) -> Layer:
    recent = tracks[-round(TRAIL_SECONDS * opened.sequence.fps) - 1 :]
    if canvas.upwards:
        return plan_layer_of_tracks(recent)
    return layer_of_tracks(recent, opened.sequence.camera, opened.sequence.scene)
