"""Simulates a scenario with a seed as a Sequence.

Its pictures, detections and truth are computed when they are first used, not when the Sequence is made.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np

from sim.clock import check_stride, every_nth
from sim.draws import drawn
from sim.looks import with_looks
from sim.rng import look_seed
from sim.scene.boxes import check_nobody_in_boxes
from sim.scene.camera import px_per_m_at_centre
from sim.scene.camera_motion import cameras_of_frames, place_view
from sim.streams import check_streams
from sim.truth.label import bodies, events_in_view, in_view, label
from sim.truth.order_fulfilment import check_orders

# isort: off
# fmt: off
from sim.types import (
    BACKGROUNDS, OWN_BACKGROUND, Array, Camera, Detections, Frame, FrameTruth, Image, Ints, Motion, PixelTruth,
    Sequence, Truth,
)
# fmt: on
# isort: on

if TYPE_CHECKING:
    from scenarios.schema.scenario import ObservationSpec, Scenario
    from sim.render.renderer import RenderedFrame, Renderer


class LabelledSequence(Sequence):
    """A sequence that is known to have a truth, as simulated ones do."""

    @property
    def truth(self) -> Truth:
        """The truth, computed on first use and then kept."""
        return cast("Truth", super().truth)

    def frame_truth(self, index: int) -> FrameTruth:
        """Returns the truth of frame `index` (from 1); its `pixels` are given if the sequence has `load_pixels`."""
        return cast("FrameTruth", super().frame_truth(index))


def simulate(
    scenario: Scenario, seed: int, repeat: int = 0, streams: Iterable[str] = ("left",), stride: int = 1
) -> LabelledSequence:
    """Returns the sequence that a scenario and a seed define: frames, detections of its sensor, and truth.

    The motion is simulated at once; detections, truth and pictures are computed when they are first used.

    Args:
        scenario: As `scenarios.load` returns it.
        seed: 0 or more.
        repeat: Number of the suite entry's copy, 0 without copies.
        streams: Some of "left", "right", "disparity", "ids", "background". "left" and "right" give frames their
            pictures. With any of the five names the sequence has `background()` and `load_pixels`. () gives no
            pictures.
        stride: Only the camera's frames 1, 1 + stride, 1 + 2 stride, … are in the sequence, numbered from 1 again.

    Returns:
        The sequence.

    Raises:
        InputError: The scenario is impossible (no room for its people, people out of view), or a stream or the
            stride is invalid.
        ValueError: The seed is negative.
        WorkError: A position is not finite. When the truth is read: an order of the script was not fulfilled.
    """
    from sim.crowd.world import run

    return observe(scenario, run(scenario, seed, repeat), streams=streams, stride=stride)


def observe(
    scenario: Scenario | ObservationSpec, motion: Motion, *, people: Mapping[str, tuple[int, ...]] | None = None,
    check: bool = True, streams: Iterable[str] = (), stride: int = 1,
) -> LabelledSequence:  # fmt: skip
    """Returns the sequence in which the camera and sensor of `scenario` observe the given motion.

    people: person ids of each group that `sensor.hide` may name, by the group's name; None: the groups of `scenario`,
    from which the motion was simulated. check: True makes reading the truth raise WorkError if an order of the script
    was not fulfilled. streams, stride: as for `simulate`.
    """
    if getattr(scenario, "draws", None):
        scenario = drawn(cast("Scenario", scenario), motion.seed, motion.repeat)
    check_stride(stride, motion.fps)
    check_nobody_in_boxes(motion)
    motion = with_looks(motion, scenario.looks)
    view = place_view(scenario.camera, motion)
    camera = view if isinstance(view, Camera) else None
    wanted = frozenset(check_streams(streams, "png"))
    renderer: Renderer | None = None
    if wanted:
        from sim.render import renderer as drawing

        renderer = drawing.Renderer(motion, view, scenario.light, scenario.picture)
    if renderer is not None and not wanted.isdisjoint({"right", "disparity"}):
        renderer.check_pair()
    left, right, disparity = ("left" in wanted, "right" in wanted, "disparity" in wanted)
    labels = left and not wanted.isdisjoint({"ids", "disparity"})
    kept = every_nth(motion, stride)

    @cache
    def named() -> Mapping[str, tuple[int, ...]]:
        if people is not None:
            return people
        from scenarios.schema import scenario as schema
        from sim.crowd.population import named_people

        assert isinstance(scenario, schema.Scenario), "only a scenario names groups: give people"
        return named_people(scenario, motion.scene, motion.seed, motion.repeat, motion.orders)

    @cache
    def seen() -> Truth:
        return bodies(motion, view)

    @cache
    def sensed() -> tuple[list[Detections], list[Ints]]:
        from sim.detector.sense import sense_owned

        hidden = named() if any(hide.group is not None for hide in scenario.sensor.hide) else {}
        size = scenario.camera.image
        found, owners = sense_owned(seen(), scenario.sensor, motion.seed, view, size, motion.repeat, hidden)
        return [d.replace(index=k + 1, t=k / kept.fps) for k, d in enumerate(found[::stride])], owners[::stride]

    def bare() -> Iterator[Frame]:
        return (Frame(d.index, d.t, detections=d) for d in sensed()[0])

    # A frame's pixels are usually read right after its pictures.
    @lru_cache(maxsize=1)
    def shown(index: int) -> RenderedFrame:
        assert renderer is not None
        shot = 1 + (index - 1) * stride
        if not left:
            return drawing.RenderedFrame(right=renderer.right(shot) if right else None)
        return renderer.draw(shot, right=right, pixels=labels, disparity=disparity)

    def pixels(index: int) -> PixelTruth:
        assert renderer is not None
        shot, known = 1 + (index - 1) * stride, shown(index).pixels if labels else None
        known = renderer.pixels(shot, disparity=disparity) if known is None else known
        if camera is not None:
            return known
        # As in the truth: without people who are out of view.
        inside, columns = in_view(seen())[seen().rows(shot)], ("visible_px", "amodal_px", "box", "blob")
        return known.replace(**{name: getattr(known, name)[inside] for name in columns})

    def background() -> Image:
        assert renderer is not None
        return np.stack([renderer.background(k) for k in range(BACKGROUNDS)])

    def frames() -> Iterator[Frame]:
        for d in sensed()[0]:
            made = shown(d.index)
            yield Frame(d.index, d.t, made.image, made.right, d)

    def light() -> Array:
        from sim.render.weather import brightness

        return brightness(
            scenario.light, look_seed(motion.seed, motion.name), motion.repeat, kept.fps, len(kept.present)
        )

    def truth() -> Truth:
        found = label(kept, view)
        if check:
            check_orders(kept, found)
        return found if camera is not None else events_in_view(found)

    def cameras() -> tuple[Camera, ...]:
        return cameras_of_frames(view, kept.fps, len(kept.present))

    source = {"kind": "simulated", "seed": motion.seed, "repeat": motion.repeat}
    source |= {} if stride == 1 else {"stride": stride}
    source |= {} if renderer is None else {"background": OWN_BACKGROUND}
    return LabelledSequence(
        name=motion.name, fps=kept.fps, length=len(kept.present), frames=bare if renderer is None else frames,
        load_truth=truth, image_size=scenario.camera.image, camera=camera, scene=motion.scene,
        px_per_m=float("nan") if camera is None else px_per_m_at_centre(camera),
        has_images=left, has_right=right, has_detections=True,
        load_people=named, source=source, bare=bare,
        load_owners=lambda: sensed()[1],
        load_background=None if renderer is None else background, load_pixels=None if renderer is None else pixels,
        load_light=light, load_cameras=None if camera is not None else cameras,
        never_arrive=motion.never_arrive, immobile=motion.immobile,
    )  # fmt: skip
