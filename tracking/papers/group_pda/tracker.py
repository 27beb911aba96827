"""`group-pda`: groups of people tracked as wholes, from points or from foreground pixels.

Gennari & Hager, "Probabilistic data association methods in visual tracking of groups", CVPR 2004. The steps of a frame
are those of its Fig. 1: predict, gate, associate, update, births, split, merge. docs/trackers/group-pda.md has the
equations with their modules, and the departures.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from sim.arrays import no_ids
from sim.geometry.hull_kernels import convex_hulls
from sim.geometry.polygons import FOOTPRINT
from sim.types import Array, Bools, Context, Detections, Frame, Groups, Ints, Plane, Tracks
from tracking.filters.existence import LIFETIME
from tracking.grouping.whole_groups import GroupIds, WholeGroupEvent, whole_group_tracks
from tracking.papers.group_pda.association import (
    PointClaims,
    associate,
    below_heads,
    claimed,
    gated_distances,
    log_ratio,
    place_density,
    remember,
    search_regions,
    with_missed_members,
)
from tracking.papers.group_pda.births_and_losses import add_newborns, confirm, expected_members, remove_lost
from tracking.papers.group_pda.colours import colour_bins, colour_density, update_histograms
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.from_pixels import ForegroundPoints, sine_tilt
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.merging_and_splitting import GroupChanges, fall_apart, whole_groups
from tracking.papers.group_pda.scaled_parameters import ScaledParameters, scale_parameters
from tracking.running.image_scale import required

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class GroupPda:
    """The tracker `group-pda`: groups of people tracked as wholes, from points or from foreground pixels.

    State: config, which may be replaced between two frames; bank, the groups; ids, which gives the next id; changes,
    the past of pairs that may merge or split; pixels: grid points and background model, None from points; plane:
    "ground" or "image"; context; begin: time of the first observed frame, inf before; interval, last_interval: frames
    since the last observed frame, and from the one before to it. All but config exist after `reset` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "points", "boxes")
    config_class: ClassVar[type[GroupPdaConfig]] = GroupPdaConfig

    def __init__(self, config: GroupPdaConfig | None = None) -> None:
        self.config = config or GroupPdaConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence. With a background sample in the context pixels are tracked, else
        points.

        `seed` has no effect: nothing is random. Until the first detections `plane` is "image" from pixels, or with a
        scale but no camera, else "ground". If pixels are tracked, raises InputError if the scale px_per_m is zero or
        negative, or neither known nor learned from the sample, or if the sample has a wrong shape or dtype, too few
        frames or shows no background.
        """
        self.context = context
        self.bank, self.ids = GroupBank.empty(), GroupIds()
        self.changes = GroupChanges()
        self.pixels = None if context.background is None else ForegroundPoints(self.config, context)
        if self.pixels is not None:
            self.context = context.replace(px_per_m=self.pixels.scale)
        self.begin, self.interval, self.last_interval = np.inf, 0, 1
        flat = context.camera is None and context.px_per_m > 0
        self.plane: Plane = "image" if flat or self.pixels is not None else "ground"
        self.colours = np.zeros(0, np.int64)
        self.usual_box: Array | None = None

    @property
    def px_per_m(self) -> float:
        """Scale of the image in px per metre: the context's, or, from pixels, learned from its background sample; nan
        if unknown."""
        return self.context.px_per_m

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the groups and events of the frame, as Tracks with unit "group"; updates all groups.

        Order: predict; remove lost groups; gate, associate, update, fall apart (Fig. 1), births; split, merge; confirm.
        From points `detections.pos` is used (x, y), from pixels `frame.image`. A frame without them (None), and from
        pixels one with too much foreground, is predicted only; before the first detections the Tracks are empty. A
        config that has replaced `config` since the last frame holds from this frame on; the groups stay.

        Raises InputError if points are in the image and the context has no scale above 0, or if the picture's size or
        dtype is not the background sample's.
        """
        if self.pixels is not None and self.pixels.config is not self.config:
            self.pixels.follow(self.config)
        points, weights = self._points(frame, detections)
        if len(self.bank):
            self.bank.predict(self._scaled_parameters(1))
        self.interval += 1
        events = [] if points is None else list(self._look(points, weights, frame.t))
        tracks = self._report(frame, events, self._about(detections))
        return tracks if self.pixels is None else self.pixels.foreground.in_picture(tracks)

    def _report(self, frame: Frame, events: list[WholeGroupEvent], outline: Array) -> Tracks:
        """Returns the confirmed groups that had points within the last `report_coast` s, by id.

        outline (V, 2): a polygon round the origin, in the plane's unit, that stands for what covers the ground or the
        image about one member's place: a footprint or a usual box; without effect from pixels."""
        t = frame.t - self._no_evidence(self.interval)
        seen = self.bank.confirmed & (t - self.bank.last_seen <= self.config.report_coast + 1e-9)
        bank = whole_groups(self.bank, np.flatnonzero(seen))
        rows = np.argsort(bank.id)
        hulls = convex_hulls(self._outlines(bank, rows, outline))
        x, P, extent = bank.x[rows], bank.P[rows], bank.extent[rows]
        if self.pixels is not None:
            view = self.pixels.view
            J = view.jacobian(x[:, :2])
            both = np.kron(np.eye(2), J)
            P, extent = both @ P @ np.swapaxes(both, 1, 2), J @ extent @ np.swapaxes(J, 1, 2)
            x = np.hstack([view.image(x[:, :2]), np.einsum("gij,gj->gi", J, x[:, 2:])])
            events = [replace(e, pos=tuple(view.image(np.array([e.pos]))[0].tolist())) for e in events]
        groups = Groups(bank.id[rows], (no_ids(),) * len(rows), x[:, :2], x[:, 2:], extent, bank.size[rows], hulls)
        return whole_group_tracks(frame, self.plane, self.context.fps, groups, P, events)

    def _points(self, frame: Frame, detections: Detections | None) -> tuple[Array | None, Array]:
        if self.pixels is not None:
            found = None if frame.image is None else self.pixels.points(frame.image, self.outlines())
            if found is None or frame.image is None:
                return None, np.zeros(0)
            pixels, points, weights = found
            if self.config.appearance > 0:
                self.colours = colour_bins(frame.image, pixels)
            return points, weights
        if detections is None:
            return None, np.zeros(0)
        self.plane = "image" if detections.plane == "image" else "ground"
        points, camera = np.array(detections.pos[:, :2]), self.context.camera
        if self.plane == "ground" and detections.box is not None and camera is not None and camera.kind != "top":
            points = below_heads(points, detections.box, camera)
        return points, np.ones(len(points))

    def _outlines(self, bank: GroupBank, rows: Ints, about: Array) -> list[Array]:
        # The places on their own hull suffice, and are few.
        corners = convex_hulls([bank.positions(r) for r in rows.tolist()])
        if self.pixels is not None:
            return [self.pixels.outline(c) for c in corners]
        return [(c[:, None] + about).reshape(-1, 2) for c in corners]

    def _about(self, detections: Detections | None) -> Array:
        if self.plane == "ground":
            return FOOTPRINT
        if detections is not None and detections.box is not None and len(detections.box):
            self.usual_box = np.median(detections.box[:, 2:], 0)
        return FOOTPRINT * self.context.px_per_m if self.usual_box is None else SQUARE * self.usual_box / 2

    def outlines(self) -> list[Array]:
        """Returns points (V, 2) u, v in px round the places of each confirmed group: corners of columns a person high.

        From points they are the corners of footprints or usual boxes, in the unit of the points.
        """
        return self._outlines(self.bank, np.flatnonzero(self.bank.confirmed), self._about(None))

    def _scaled_parameters(self, frames: int) -> ScaledParameters:
        fps = self.context.fps / frames
        if self.pixels is not None or self.plane == "ground":
            return scale_parameters(self.config, fps, 1.0, pixels=self.pixels is not None)
        return scale_parameters(self.config, fps, required(self.context.px_per_m), sine_tilt(self.context.camera))

    def _look(self, points: Array, weights: Array, t: float) -> Iterator[WholeGroupEvent]:
        """Updates all groups by the points of a frame that was observed, and yields the events.

        The frame stands for the frames since the one observed before, but for no more than that one did."""
        self.begin = min(self.begin, t)
        frames = min(self.interval, self.last_interval)
        self.bank.last_seen += self._no_evidence(self.interval - frames)
        self.interval, self.last_interval = 0, self.interval
        scaled = self._scaled_parameters(frames)
        if self.bank.colour_hist.shape[1] != scaled.colour_bins:
            self.bank.colour_hist = np.zeros((len(self.bank), scaled.colour_bins))
        yield from remove_lost(self.bank, scaled, t)
        self._measure(points, weights, scaled, t)
        yield from self.changes.step(self.bank, scaled, t)
        yield from confirm(self.bank, scaled, t, self.ids, self.begin)

    def _no_evidence(self, frames: int) -> float:
        """Returns the time, s, of so many unobserved frames, less its share in which people leave unseen."""
        return frames / self.context.fps * (1 - self.config.coast_time / LIFETIME)

    def _measure(self, points: Array, weights: Array, scaled: ScaledParameters, t: float) -> None:
        bank, predicted = self.bank, self.bank.x[:, :2].copy()
        region = search_regions(bank, scaled)
        d2 = gated_distances(bank, points, region, scaled)
        claims = with_missed_members(claimed(points, weights, d2, t), bank, scaled, t)
        expected = expected_members(bank, scaled, t)
        ratio, shared = np.zeros(claims.d2.shape), np.flatnonzero(claims.claimants > 1)
        may = np.isfinite(claims.d2[:, shared])
        if self.config.corrections:
            ratio[:, shared] += log_ratio(place_density(bank, claims.points[shared], may, scaled, t), may)
        if scaled.colour_bins:
            ratio[:, shared] += self.config.appearance * log_ratio(colour_density(bank, self.colours[shared]), may)
        mine = associate(bank, claims, region, ratio, scaled, t)
        remember(bank, claims, mine, predicted, scaled, t)
        if scaled.colour_bins:
            update_histograms(bank, mine, claims.claimants, self.colours, claims.weights, scaled)
        self._split(claims, mine, scaled, t)
        free = claims.claimants[: len(points)] == 0
        add_newborns(bank, points[free], weights[free], expected, scaled, t)

    def _split(self, claims: PointClaims, mine: Bools, scaled: ScaledParameters, t: float) -> None:
        bank = self.bank
        due = np.flatnonzero((bank.null_time >= self.config.split_time - 1e-9) & (bank.null_time > 0))
        for row in due.tolist()[::-1]:  # from the last row on, as parts are appended
            fall_apart(bank, row, claims.points[mine[row]], claims.weights[mine[row]], scaled, t, self.ids)
