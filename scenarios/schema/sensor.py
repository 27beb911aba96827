"""The `[sensor]` table: the errors of the synthetic detector that makes det/det.txt (misses, false alarms, noise,
scores).

The keys from `by_visibility` on are the measured profile of a detector (`flockscope fit sensor`). They are absent where
nothing was measured; the simpler keys above them then apply.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.limits import DETECTIONS
from scenarios.schema.values import Model, Name, NonNegative, Positive, Share, within

Curve = Annotated[tuple[Share, ...], Field(min_length=2)]
MeanAndSd = tuple[float, NonNegative]


class Hide(Model):
    """Artificial occlusion of a group, or of everybody, for some time: the sensor does not detect these people.

    start, end: s, 0 = frame 1; from start on and before end. group: name of the group in the script; None: no person at
    all is detected.
    """

    start: NonNegative = Field(description="start of the occlusion, s")
    end: NonNegative = Field(description="end of the occlusion, s")
    group: Name | None = Field(None, description="name of the group in the script; absent: all people")


class Memory(Model):
    """A part of an error that changes slowly from frame to frame.

    share: its share of the error's variance, 0 to 1. time: time after which its correlation is 0.37 (1/e), s.
    """

    share: Share = Field(description="share of the error's variance")
    time: Positive = Field(description="time after which the correlation of this part is 0.37, s")


Memories = tuple[Memory, ...]


def _check_shares(memory: Memories | None) -> None:
    """Raises ValueError if the shares of variance of the parts add up to more than 1; None and no part are fine."""
    if sum(part.share for part in memory or ()) > 1 + 1e-9:
        raise ValueError("shares whose sum is at most 1")


class BoxNoise(Model):
    """Errors of detected boxes in proportion to the box height; each is (mean, standard deviation).

    - across: middle, to the right; foot, top: lower and upper edge, downwards; all in box heights.
    - width: logarithm of the width.
    - floor_px: least standard deviation of middle, foot and top, px.
    - scale: factor of all errors, means and floor included; 0 = exact boxes.
    - occluded: each standard deviation, but not the floor, is multiplied by 1 + this × hidden share of the box.
    - tails: excess kurtosis of the errors, 0 to 30; 0 = normal.
    - memory: parts that change slowly; None: all errors are drawn anew in each frame. Shares above 1 in sum raise
      pydantic.ValidationError.

    The defaults lie among the profiles of three real detectors (docs/reference/detector-profiles.md).
    """

    across: MeanAndSd = Field(
        (0.0, 0.045), description="error of the middle, to the right: mean, standard deviation; box heights"
    )
    foot: MeanAndSd = Field(
        (0.0, 0.07), description="error of the lower edge, downwards: mean, standard deviation; box heights"
    )
    top: MeanAndSd = Field(
        (0.0, 0.06), description="error of the upper edge, downwards: mean, standard deviation; box heights"
    )
    width: MeanAndSd = Field((0.0, 0.18), description="error of the logarithm of the width: mean, standard deviation")
    floor_px: Annotated[float, within(0.0, 1000.0, " px")] = Field(
        0.3, description="least standard deviation of middle, lower and upper edge, px"
    )
    scale: Annotated[float, within(0.0, 20.0)] = Field(1.0, description="factor of all these errors; 0 = exact boxes")
    occluded: NonNegative = Field(
        0.0, description="each standard deviation is multiplied by 1 + this times the hidden share of the box"
    )
    tails: Annotated[float, Field(ge=0, le=30)] = Field(
        0.0, description="excess kurtosis k of the errors: Student's t with 4 + 6 / k degrees of freedom; 0 = normal"
    )
    memory: Memories | None = Field(
        None, description="parts of these errors that change slowly; the rest is drawn anew in each frame"
    )

    @model_validator(mode="after")
    def _shares(self) -> Self:
        _check_shares(self.memory)
        return self


class FalseAlarms(Model):
    """False alarms that last, some of them attached to people. Pairs are (mean, standard deviation).

    - life: mean life, s; 0 = one frame. seen: probability that a living one is detected in a frame. So many live that
      the mean number detected per frame is the sensor's clutter_rate.
    - near: share that moves with a person. Of these: across, foot: place relative to the person, box heights;
      near_height: logarithm of the height relative to the person's.
    - Of all others: height: logarithm of the height relative to a person there; drift: standard deviation of the
      velocity per axis, box heights per s; at: possible foot points x, y as shares of image width and of the rows
      below the ground's furthest row, met with a standard deviation of 0.03; None: anywhere there.
    - Of all: aspect: logarithm of width / height; jitter: standard deviation of each edge per frame, box heights.
    """

    life: NonNegative = Field(0.0, description="mean life of a false alarm, s; 0 = one frame")
    seen: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0, description="probability that a living false alarm is detected in a frame"
    )
    near: Share = Field(0.0, description="share of false alarms that move with a person (parts of a body, duplicates)")
    across: MeanAndSd = Field(
        (0.0, 0.3),
        description="false alarms at a person: middle relative to the person's middle: mean, standard deviation; "
        "box heights",
    )
    foot: MeanAndSd = Field(
        (0.0, 0.2),
        description="false alarms at a person: lower edge below the person's lower edge: mean, standard deviation; "
        "box heights",
    )
    near_height: MeanAndSd = Field(
        (0.0, 0.3),
        description="false alarms at a person: logarithm of the height relative to the person's: mean, "
        "standard deviation",
    )
    height: MeanAndSd = Field(
        (0.0, 0.2),
        description="other false alarms: logarithm of the height relative to that of a person standing there: mean, "
        "standard deviation",
    )
    aspect: MeanAndSd = Field(
        (-0.9, 0.2), description="all false alarms: logarithm of width / height: mean, standard deviation"
    )
    drift: NonNegative = Field(
        0.0, description="other false alarms: standard deviation of the velocity along each axis, box heights per s"
    )
    jitter: NonNegative = Field(
        0.0, description="all false alarms: standard deviation of each edge from frame to frame, box heights"
    )
    at: tuple[tuple[Share, Share], ...] | None = Field(
        None,
        description="other false alarms: possible foot points x, y as shares of image width and of the rows below the "
        "ground's furthest row; absent: anywhere",
    )


class Sensor(Model):
    """The synthetic detector that makes the points and boxes of det/det.txt.

    - detect_prob: probability that a fully visible person of usual size is detected. It is multiplied by visibility ^
      occlusion_power and by min(1, box height in px / (2 small_px)), which is 1 if small_px is 0. Below min_visibility
      it is 0.
    - persistence: correlation of misses 0.1 s apart. clutter_rate: mean number of false alarms per frame.
    - box_noise: errors of boxes, in box heights. noise_m: standard deviation of points along each axis, m.
    - box: "visible" (boxes of the visible parts) or "amodal" (of whole people). hide: artificial occlusions.
    - points: "seen" (true position with noise_m, displaced by as much as the visible part's foot is from the whole
      body's on the ground), "own" (true position with noise_m), or "foot" (below the noisy box). Without camera or
      boxes all are "own".
    - by_visibility: factors at evenly spaced visibilities from 0 to 1, linear between them, for occlusion_power; below
      min_visibility the probability is 0 all the same. miss_memory: slow parts of the misses, for persistence. Both are
      measured and replace the simpler key; None: they do not.
    - false_alarms: life, places and sizes; None: one frame, anywhere.
    - true_scores, false_scores: evenly spaced quantiles of the scores of true detections and false alarms; None: not
      measured.

    Raises pydantic.ValidationError for unknown keys, miss_memory together with persistence, quantiles that decrease, or
    shares of miss_memory above 1 in sum.
    """

    detect_prob: Share = Field(0.95, description="probability that a fully visible person of usual size is detected")
    clutter_rate: Annotated[float, within(0.0, DETECTIONS / 5, " false alarms per frame")] = Field(
        0.3, description="mean number of false alarms per frame (Poisson)"
    )
    box_noise: BoxNoise = Field(BoxNoise(), description="errors of boxes, in box heights")
    noise_m: Annotated[float, within(0.0, 1000.0, " m")] = Field(
        0.05, description="standard deviation of points on the ground along each axis, m"
    )
    box: Literal["visible", "amodal"] = Field(
        "visible",
        description="visible: boxes of the visible parts, so that occlusion moves foot points; amodal: boxes "
        "of whole people",
    )
    points: Literal["own", "seen", "foot"] = Field(
        "seen",
        description="points on the ground: seen = true position with noise_m, displaced as the foot of the visible "
        "part is; own = true position with noise_m; foot = below the lower edge of the noisy box",
    )
    occlusion_power: NonNegative = Field(
        1.0, description="the probability of detection is multiplied by the visibility to this power"
    )
    min_visibility: Share = Field(0.2, description="people who are less visible are never detected")
    small_px: NonNegative = Field(
        12.0, description="box height at which the probability of detection is halved, px; 0 = no effect"
    )
    persistence: Share = Field(0.0, description="correlation of misses 0.1 s apart")
    hide: tuple[Hide, ...] = Field((), description="artificial occlusions")
    by_visibility: Curve | None = Field(
        None,
        description="factors of the probability of detection at evenly spaced visibilities from 0 to 1; "
        "replaces occlusion_power",
    )
    miss_memory: Memories | None = Field(
        None, description="parts of the misses of a person that change slowly; replaces persistence"
    )
    false_alarms: FalseAlarms | None = Field(None, description="life, places and sizes of false alarms")
    true_scores: Curve | None = Field(
        None, description="evenly spaced quantiles of the scores of true detections, 0 to 1"
    )
    false_scores: Curve | None = Field(
        None, description="evenly spaced quantiles of the scores of false alarms, 0 to 1"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Returns the model; raises ValueError for miss_memory together with persistence, true_scores or false_scores
        that decrease, or shares of miss_memory that add up to more than 1.
        """
        if self.miss_memory is not None and self.persistence:
            raise ValueError("either miss_memory or persistence, not both")
        for scores in (self.true_scores, self.false_scores):
            if scores is not None and any(b < a for a, b in pairwise(scores)):
                raise ValueError("quantiles that do not decrease")
        _check_shares(self.miss_memory)
        return self
