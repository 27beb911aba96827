"""Writes a video of a sequence with tracks, truth or both drawn over its pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.pictures.video_files import write_video
from sim.store.atomic import new_file
from sim.store.own_files import GENERATOR
from sim.types import Frame, Image, Sequence, Tracks
from tracking.app.replay_page.video import even_size, refuse_source, shown_pictures
from tracking.drawing.canvas import FLOOR, Canvas, colour, draw_label, text
from tracking.drawing.layer_painting import ALARM, draw_captions, letter_size, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.running.run import grouped

LOW = 400  # px: pictures less high than this are shown at twice their size.

BANNER_HEIGHT, LETTERS = 32, 0.55  # px, and size of the letters: of the line above each picture


def write_overlay(
    sequence: Sequence,
    tracks: SequenceOf[Tracks] | None,
    out: str | Path,
    truth: Literal["over"] | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> Path:
    """Writes the MP4, complete or not at all, and returns its path.

    truth: "over" draws the truth over the tracks. If `tracks` is None, the truth is drawn alone. step: called with the
    name of each step of the work. Raises InputError without pictures.
    """
    if not sequence.has_images:
        raise InputError(
            file=sequence.name, got="a sequence without pictures", expected="one with pictures",
            remedy="flockscope view shows it on plain ground",
        )  # fmt: skip
    path = Path(out)
    refuse_source(sequence, path)
    layers = _layers(sequence, tracks, truth is not None)
    pictures = overlay_pictures(sequence, layers)
    first = next(pictures, None)
    if first is None:
        raise InputError(file=sequence.name, got="no frame", expected="one or more", remedy="give a longer sequence")
    size = first.shape[1], first.shape[0]
    with new_file(path) as partial, write_video(partial, size, sequence.fps, comment=GENERATOR) as video:
        for picture in chain([first], pictures):
            video.add(picture)
            step(sequence.name)
    return path


def _layers(sequence: Sequence, tracks: SequenceOf[Tracks] | None, with_truth: bool) -> list[Layer]:
    """Returns what is drawn over the pictures, the lowest first."""
    layers = []
    if tracks is None or with_truth:
        if sequence.truth is None:
            got = "a sequence without labels" if tracks is not None else "neither tracks nor labels"
            remedy = "leave --truth out" if tracks is not None else "give what `flockscope track` wrote"
            raise InputError(file=sequence.name, got=got, expected="something to draw", remedy=remedy)
        layers.append(replace(layer_of_truth(sequence.truth), plain=tracks is not None))
    if tracks is not None:
        layers.append(layer_of_tracks(grouped(tracks, sequence), sequence.camera, sequence.scene))
    return layers


def overlay_pictures(sequence: Sequence, layers: SequenceOf[Layer]) -> Iterator[Image]:
    """Yields the video's pictures, BGR uint8, one per frame, of even width and height."""
    for frame, picture in shown_pictures(sequence):
        body = drawn(picture, sequence.fps, frame.index, layers)
        banner = np.full((BANNER_HEIGHT, body.shape[1], 3), FLOOR, np.uint8)
        text(banner, banner_words(sequence, frame, layers), (6, BANNER_HEIGHT / 2 + 5), LETTERS)
        if frame.image is None:
            draw_label(banner, "lost frame", (body.shape[1], BANNER_HEIGHT / 2 + 10), LETTERS, colour(ALARM))
        yield even_size(np.concatenate([banner, body]))


def drawn(picture: Image, fps: float, index: int, layers: SequenceOf[Layer]) -> Image:
    """Returns the picture of frame `index` with the layers drawn over it, at twice its size if it is less than LOW."""
    factor = 2 if len(picture) < LOW else 1
    image = np.array(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR), np.uint8)
    size = np.array(picture.shape[1::-1], float)
    canvas = Canvas(image, factor, np.zeros(2), size, upwards=False)
    for layer in layers:
        paint_layer(canvas, layer, index, fps)
    draw_captions(image, layers[-1], index, fps, letter_size(canvas))
    return image


def banner_words(sequence: Sequence, frame: Frame, layers: SequenceOf[Layer]) -> str:
    """Returns the banner's text: sequence, frame, time in s, and how many people or groups each layer has."""
    of = "" if sequence.length is None else f" of {sequence.length}"
    marks = {layer.name: layer.at(frame.index) for layer in layers}
    count = "".join(f"   {name} {len(m.id)}{' groups' * m.whole_groups}" for name, m in marks.items())
    return f"{sequence.name}   frame {frame.index}{of}   {frame.t:.2f} s{count}"
