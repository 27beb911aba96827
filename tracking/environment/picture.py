"""What the environment shows: the last picture, or a plan of the ground, with detections, tracks and their past."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections, Frame, Image, Tracks
from tracking.drawing.canvas import FLOOR, THING, TRAIL_SECONDS, Canvas
from tracking.drawing.layer_painting import draw_banner, draw_captions, letter_size, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, plan_layer_of_tracks
from tracking.drawing.plan_view import draw_scene
from tracking.environment.episode_cache import Held
from tracking.environment.episodes import Rollout

SIZE = (480, 640)
"""px, height and width, of a plan."""
STRIP = 32
"""px, height of the line of facts."""
LETTER = 0.5


def picture(held: Held, rollout: Rollout | None, score: float) -> Image:
    """(H, W, 3) RGB of even height and width: the frame answered last, or what stands still before the first."""
    frame, answers = (None, []) if rollout is None else (rollout.last, rollout.answers)
    view = _view(held, frame, answers)
    if frame is not None:
        if frame.detections is not None and not _on_picture(frame):
            _dots(view, frame.detections, answers[-1].plane)
        side = _side(held, answers, view)
        paint_layer(view, side, frame.index, held.sequence.fps)
        draw_captions(view.image, side, frame.index, held.sequence.fps, letter_size(view))
    strip = np.zeros((STRIP, view.image.shape[1], 3), np.uint8)
    source, done = held.source, len(answers)
    words = f"{source.name} {source.seed}   frame {done} of {held.truth.length}   objective {score:.3f}"
    draw_banner(strip, words, [], LETTER)
    whole = np.concatenate([strip, view.image])
    tall, wide = (n - n % 2 for n in whole.shape[:2])
    return np.ascontiguousarray(whole[:tall, :wide, ::-1])


def _on_picture(frame: Frame | None) -> bool:
    return frame is not None and frame.image is not None


def _view(held: Held, frame: Frame | None, answers: list[Tracks]) -> Canvas:
    """A canvas with what stands still, and how the world is mapped to it."""
    sequence = held.sequence
    if sequence.has_images and sequence.image_size is not None:
        shown = None if frame is None else frame.image
        empty = np.full((*sequence.image_size[::-1], 3), THING, np.uint8)
        canvas = empty if shown is None else np.array(shown, np.uint8)
        return Canvas(canvas, 1.0, np.zeros(2), np.array(sequence.image_size, float), upwards=False)
    canvas = np.full((*SIZE, 3), FLOOR, np.uint8)
    if _flat(held, answers):
        low, high = _bounds(held)
        view = Canvas.fit(canvas, low, high, upwards=True)
        draw_scene(view, sequence.scene)
        return view
    size = np.array(sequence.image_size, float) if sequence.image_size is not None else _bounds(held)[1]
    return Canvas.fit(canvas, np.zeros(2), size, upwards=False)


def _flat(held: Held, answers: list[Tracks]) -> bool:
    """Are places metres on the ground?"""
    return answers[-1].plane != "image" if answers else held.truth.pos is not None


def _bounds(held: Held) -> tuple[Array, Array]:
    """Where people are: the scene, else all that is detected, or labelled where nothing is."""
    scene = held.sequence.scene
    if scene is not None:
        return np.zeros(2), scene.size
    places = [f.detections.pos[:, :2] for f in held.sequence.without_pictures() if f.detections is not None]
    truth = held.truth
    if not sum(map(len, places)):
        places = [truth.pos] if truth.pos is not None else [truth.box[:, :2]] if truth.box is not None else []
    found = np.concatenate([np.zeros((0, 2)), *places])
    if not len(found):
        return np.zeros(2), np.ones(2)
    return found.min(axis=0) - 1, found.max(axis=0) + 1


def _dots(view: Canvas, detections: Detections, plane: str) -> None:
    """Small grey discs where something was detected."""
    if detections.plane == plane or detections.plane != "image" != plane:
        for at in detections.pos[:, :2]:
            view.disc(at, 2.5, THING)


def _side(held: Held, answers: list[Tracks], view: Canvas) -> Layer:
    """The answers of the last seconds as marks in the view's unit."""
    recent = answers[-round(TRAIL_SECONDS * held.sequence.fps) - 1 :]
    if view.upwards:
        return plan_layer_of_tracks(recent)
    return layer_of_tracks(recent, held.sequence.camera, held.sequence.scene)
