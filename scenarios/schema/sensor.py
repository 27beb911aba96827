"""The `[sensor]` table: how the detector behind det/det.txt errs.

The keys from `by_visibility` on are a detector's measured profile (`flockscope fit sensor`); they are absent where
nothing was measured, and then do nothing.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.schema.values import Model, Name, NonNegative, Positive, Share

Curve = Annotated[tuple[Share, ...], Field(min_length=2)]
Spread = tuple[float, NonNegative]


class Hide(Model):
    """Artificial occlusion: nothing is detected of these people in this window."""

    start: NonNegative = Field(description="s")
    end: NonNegative = Field(description="s")
    group: Name | None = Field(None, description="people of this script group; everybody where absent")


class Memory(Model):
    """A part of an error that stays alike for a while."""

    share: Share = Field(description="of the error's variance")
    time: Positive = Field(description="its correlation falls to 0.37 after so long, s")


Memories = tuple[Memory, ...]


class BoxNoise(Model):
    """Errors of boxes in proportion to their size: [mean, sd] each, in heights of the box."""

    across: Spread = Field((0.0, 0.0), description="of the middle, to the right: mean, sd; box heights")
    foot: Spread = Field((0.0, 0.0), description="of the lower edge, downwards: mean, sd; box heights")
    top: Spread = Field((0.0, 0.0), description="of the upper edge, downwards: mean, sd; box heights")
    width: Spread = Field((0.0, 0.0), description="of the width's logarithm: mean, sd")
    occluded: NonNegative = Field(0.0, description="each sd times 1 + this times the hidden share")
    tails: Annotated[float, Field(ge=0, le=30)] = Field(
        0.0, description="excess kurtosis: Student's t of 4 + 6 / this degrees of freedom; 0 = normal"
    )
    memory: Memories | None = Field(
        None, description="parts of these errors that stay alike; the rest is new each frame"
    )

    @model_validator(mode="after")
    def _shares(self) -> Self:
        _check_shares(self.memory)
        return self


class FalseAlarms(Model):
    """False alarms that stay for a while, some of them at people."""

    life: NonNegative = Field(0.0, description="how long one stays (mean), s; 0 = a frame")
    seen: Annotated[float, Field(gt=0, le=1)] = Field(1.0, description="chance of a frame to show one that stays")
    near: Share = Field(0.0, description="share that sticks to a person: parts of bodies, doubles")
    across: Spread = Field((0.0, 0.3), description="middle of those beside the person's: mean, sd; box heights")
    foot: Spread = Field((0.0, 0.2), description="lower edge of those below the person's: mean, sd; box heights")
    near_height: Spread = Field((0.0, 0.3), description="logarithm of their height over the person's: mean, sd")
    height: Spread = Field((0.0, 0.2), description="of all others, over that of a person standing there; logarithm")
    aspect: Spread = Field((-0.9, 0.2), description="logarithm of width over height, of all: mean, sd")
    drift: NonNegative = Field(0.0, description="sd of the others' velocity along each axis, box heights per s")
    jitter: NonNegative = Field(0.0, description="sd of each edge from frame to frame, box heights")
    at: tuple[tuple[Share, Share], ...] | None = Field(
        None, description="where the others' feet are: x, y from the ground's furthest row on; everywhere where absent"
    )


class Sensor(Model):
    """The point and box sensor behind det/det.txt."""

    detect_prob: Share = Field(0.95, description="chance that a fully visible person of usual size is detected")
    clutter_rate: NonNegative = Field(0.3, description="false alarms per frame, Poisson")
    noise_px: NonNegative = Field(1.5, description="sd of each edge of a box, px")
    noise_m: NonNegative = Field(0.05, description="sd of points on the ground, per axis, m")
    box: Literal["visible", "amodal"] = Field("visible", description="visible: occlusion moves foot points")
    occlusion_power: NonNegative = Field(1.0, description="detection chance times visibility to this power")
    min_visibility: Share = Field(0.2, description="less visible people are never detected")
    small_px: NonNegative = Field(12.0, description="box height at which detection is half as likely; 0 = no effect")
    persistence: Share = Field(0.0, description="correlation of misses from frame to frame")
    hide: tuple[Hide, ...] = Field((), description="artificial occlusions")
    by_visibility: Curve | None = Field(
        None, description="detection chance times this, at evenly spaced visibilities from 0 to 1; for occlusion_power"
    )
    miss_memory: Memories | None = Field(
        None, description="how alike a person's luck stays from frame to frame; for persistence"
    )
    box_noise: BoxNoise | None = Field(None, description="errors in proportion to the box; for noise_px")
    points: Literal["own", "foot"] | None = Field(
        None,
        description="foot: points on the ground lie under the noisy box's lower edge; own: noise_m around the truth",
    )
    false_alarms: FalseAlarms | None = Field(None, description="how clutter stays, where and how large it is")
    true_scores: Curve | None = Field(None, description="evenly spaced quantiles of true detections' scores, 0 to 1")
    false_scores: Curve | None = Field(None, description="evenly spaced quantiles of false alarms' scores, 0 to 1")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.miss_memory is not None and self.persistence:
            raise ValueError("either miss_memory or persistence, not both")
        for scores in (self.true_scores, self.false_scores):
            if scores is not None and any(b < a for a, b in pairwise(scores)):
                raise ValueError("quantiles that do not fall")
        _check_shares(self.miss_memory)
        return self


def _check_shares(memory: Memories | None) -> None:
    if sum(part.share for part in memory or ()) > 1 + 1e-9:
        raise ValueError("shares of at most 1 together")
