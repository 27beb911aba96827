"""A video of a sequence with what a tracker says, what is true, or both drawn over its pictures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.io.files.atomic import staged_path
from sim.io.pictures.video_encoding import write_video
from sim.types import Frame, Image, Sequence, Tracks
from tracking.app.replay_page.video import even, refuse_source
from tracking.drawing.canvas import Canvas
from tracking.drawing.layer_painting import LayerStyle, draw_banner, draw_captions, draw_label, letter_size, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.run import grouped

HowTrue = Literal["beside", "over", "only"]
LEAST = 400
"""px: pictures lower than that are shown at twice their size."""

GREY = (128, 128, 128)


def overlay(
    sequence: Sequence,
    tracks: SequenceOf[Tracks] | None,
    out: str | Path,
    truth: HowTrue | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> Path:
    """Writes the MP4, whole or not at all, and returns its path.

    Without tracks the truth is drawn; with them it stands `beside` them, as white boxes `over` the same picture, or
    alone (`only`). step: called after each frame. InputError where the sequence has no pictures, or no truth that is
    asked for.
    """
    if not sequence.has_images:
        raise InputError(
            file=sequence.name, got="a sequence without pictures", expected="one with pictures",
            remedy="flockscope view shows it on plain ground",
        )  # fmt: skip
    path = Path(out)
    refuse_source(sequence, path)
    layers = _layers(sequence, tracks, truth)
    with staged_path(path) as partial:
        _write(partial, sequence, layers, step)
        os.replace(partial, path)
    return path


def _layers(
    sequence: Sequence, tracks: SequenceOf[Tracks] | None, how: HowTrue | None
) -> list[list[tuple[Layer, LayerStyle]]]:
    """What is drawn in each of the pictures that stand beside each other."""
    if tracks is None or how is not None:
        if sequence.truth is None:
            got = "a sequence without labels" if tracks is not None else "neither tracks nor labels"
            remedy = "leave --truth out" if tracks is not None else "give what `flockscope track` wrote"
            raise InputError(file=sequence.name, got=got, expected="something to draw", remedy=remedy)
        true = layer_of_truth(sequence.truth)
    if tracks is None or how == "only":
        return [[(true, LayerStyle())]]
    said = layer_of_tracks(grouped(tracks, sequence), sequence.camera, sequence.scene)
    if how == "beside":
        return [[(true, LayerStyle())], [(said, LayerStyle())]]
    return [[(true, LayerStyle(plain=True)), (said, LayerStyle())] if how == "over" else [(said, LayerStyle())]]


def _write(
    path: Path, sequence: Sequence, layers: list[list[tuple[Layer, LayerStyle]]], step: Callable[[str], None]
) -> None:
    pictures = compose(sequence, layers)
    first = next(pictures)
    with write_video(path, (first.shape[1], first.shape[0]), sequence.fps) as film:
        film.add(first)
        step(sequence.name)
        for picture in pictures:
            film.add(picture)
            step(sequence.name)


def compose(sequence: Sequence, layers: list[list[tuple[Layer, LayerStyle]]]) -> Iterator[Image]:
    """The pictures of the video, of even width and height."""
    last: Image | None = None
    for frame in sequence:
        if frame.image is not None:
            last = frame.image
        panels = [_panel(last, sequence, frame.index, sides) for sides in layers]
        if len(panels) > 1:
            for panel, sides in zip(panels, layers, strict=True):
                draw_label(panel, sides[0][0].name, (panel.shape[1] / 2 - 30, 30), 0.7, (60, 51, 45))
        body = np.concatenate(panels, axis=1)
        strip = np.zeros((32, body.shape[1], 3), np.uint8)
        draw_banner(strip, _words(sequence, frame, layers), _marks(sequence, frame), 0.55)
        yield even(np.concatenate([strip, body]))


def _panel(picture: Image | None, sequence: Sequence, index: int, sides: list[tuple[Layer, LayerStyle]]) -> Image:
    assert sequence.image_size is not None, "pictures have a size"
    width, height = sequence.image_size
    shown = np.full((height, width, 3), GREY, np.uint8) if picture is None else picture
    factor = 2 if height < LEAST else 1
    canvas = np.array(cv2.resize(shown, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR), np.uint8)
    view = Canvas(canvas, factor, np.zeros(2), np.array([width, height], float), upwards=False)
    for side, style in sides:
        paint_layer(view, side, index, sequence.fps, style)
    draw_captions(view.image, sides[-1][0], index, sequence.fps, letter_size(view))
    return view.image


def _words(sequence: Sequence, frame: Frame, layers: list[list[tuple[Layer, LayerStyle]]]) -> str:
    of = "" if sequence.length is None else f" of {sequence.length}"
    now = {side.name: side.at(frame.index) for sides in layers for side, _ in sides}
    count = "".join(f"   {name} {len(marks.id)}{' groups' * marks.whole_groups}" for name, marks in now.items())
    return f"{sequence.name}   frame {frame.index}{of}   {frame.t:.2f} s{count}"


def _marks(sequence: Sequence, frame: Frame) -> list[str]:
    """What this frame lacks."""
    lost = ["lost frame"] if frame.image is None else []
    empty = frame.detections is None or not len(frame.detections.pos)
    return lost + (["no detections"] if sequence.has_detections and empty else [])
