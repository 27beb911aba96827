"""Writes a video of a sequence with tracks, truth or both drawn over its pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.io.files.atomic import new_file
from sim.io.files.own_files import GENERATOR
from sim.io.pictures.video_files import write_video
from sim.types import Frame, Image, Sequence, Tracks
from tracking.app.replay_page.video import even_size, refuse_source
from tracking.drawing.canvas import Canvas
from tracking.drawing.layer_painting import LayerStyle, draw_banner, draw_captions, draw_label, letter_size, paint_layer
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.running.run import grouped

TruthPlacement = Literal["beside", "over", "only"]
Panel = list[tuple[Layer, LayerStyle]]  # The layers that are drawn over one copy of the picture, the lowest first.

LOW = 400  # px: pictures less high than this are shown at twice their size.

BANNER_HEIGHT = 32
GREY = (128, 128, 128)
PANEL_NAME_COLOUR = (60, 51, 45)


def write_overlay(
    sequence: Sequence,
    tracks: SequenceOf[Tracks] | None,
    out: str | Path,
    truth: TruthPlacement | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> Path:
    """Writes the MP4 and returns its path. The file is complete, or is not written at all."""
    if not sequence.has_images:
        raise InputError(
            file=sequence.name, got="a sequence without pictures", expected="one with pictures",
            remedy="flockscope view shows it on plain ground",
        )  # fmt: skip
    path = Path(out)
    refuse_source(sequence, path)
    panels = _panels(sequence, tracks, truth)
    with new_file(path) as partial:
        _write(partial, sequence, panels, step)
    return path


def _panels(sequence: Sequence, tracks: SequenceOf[Tracks] | None, placement: TruthPlacement | None) -> list[Panel]:
    if tracks is None or placement is not None:
        if sequence.truth is None:
            got = "a sequence without labels" if tracks is not None else "neither tracks nor labels"
            remedy = "leave --truth out" if tracks is not None else "give what `flockscope track` wrote"
            raise InputError(file=sequence.name, got=got, expected="something to draw", remedy=remedy)
        true = layer_of_truth(sequence.truth)
    if tracks is None or placement == "only":
        return [[(true, LayerStyle())]]
    tracked = layer_of_tracks(grouped(tracks, sequence), sequence.camera, sequence.scene)
    if placement == "beside":
        return [[(true, LayerStyle())], [(tracked, LayerStyle())]]
    if placement == "over":
        return [[(true, LayerStyle(plain=True)), (tracked, LayerStyle())]]
    return [[(tracked, LayerStyle())]]


def _write(path: Path, sequence: Sequence, panels: list[Panel], step: Callable[[str], None]) -> None:
    pictures = overlay_pictures(sequence, panels)
    first = next(pictures, None)
    if first is None:
        raise InputError(file=sequence.name, got="no frame", expected="one or more", remedy="give a longer sequence")
    with write_video(path, (first.shape[1], first.shape[0]), sequence.fps, comment=GENERATOR) as video:
        video.add(first)
        step(sequence.name)
        for picture in pictures:
            video.add(picture)
            step(sequence.name)


def overlay_pictures(sequence: Sequence, panels: list[Panel]) -> Iterator[Image]:
    """Yields the video's pictures, BGR uint8, one per frame, of even width and height."""
    last: Image | None = None
    for frame in sequence:
        if frame.image is not None:
            last = frame.image
        drawn = [_draw_panel(last, sequence, frame.index, panel) for panel in panels]
        if len(drawn) > 1:
            for image, panel in zip(drawn, panels, strict=True):
                draw_label(image, panel[0][0].name, (image.shape[1] / 2 - 30, 30), 0.7, PANEL_NAME_COLOUR)
        body = np.concatenate(drawn, axis=1)
        banner = np.zeros((BANNER_HEIGHT, body.shape[1], 3), np.uint8)
        draw_banner(banner, banner_words(sequence, frame, panels), _warnings(sequence, frame), 0.55)
        yield even_size(np.concatenate([banner, body]))


def _draw_panel(picture: Image | None, sequence: Sequence, index: int, panel: Panel) -> Image:
    assert sequence.image_size is not None, "pictures have a size"
    width, height = sequence.image_size
    shown = np.full((height, width, 3), GREY, np.uint8) if picture is None else picture
    factor = 2 if height < LOW else 1
    image = np.array(cv2.resize(shown, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR), np.uint8)
    canvas = Canvas(image, factor, np.zeros(2), np.array([width, height], float), upwards=False)
    for layer, style in panel:
        paint_layer(canvas, layer, index, sequence.fps, style)
    draw_captions(image, panel[-1][0], index, sequence.fps, letter_size(canvas))
    return image


def banner_words(sequence: Sequence, frame: Frame, panels: list[Panel]) -> str:
    """Returns the banner's text: sequence, frame, time in s, and how many people or groups each layer has."""
    of = "" if sequence.length is None else f" of {sequence.length}"
    marks = {layer.name: layer.at(frame.index) for panel in panels for layer, _ in panel}
    count = "".join(f"   {name} {len(m.id)}{' groups' * m.whole_groups}" for name, m in marks.items())
    return f"{sequence.name}   frame {frame.index}{of}   {frame.t:.2f} s{count}"


def _warnings(sequence: Sequence, frame: Frame) -> list[str]:
    lost = ["lost frame"] if frame.image is None else []
    empty = frame.detections is None or not len(frame.detections.pos)
    return lost + (["no detections"] if sequence.has_detections and empty else [])
