"""The `[sensor]` table: the errors of the synthetic detector that makes det/det.txt (misses, false alarms, noise,
scores).

The keys from `by_visibility` on are the measured profile of a detector (`flockscope fit sensor`). They are absent where
nothing was measured; the simpler keys above them then apply.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.schema.schedule import Alarms, Distances, Factors, FrameSteps, Shares
from scenarios.schema.values import Model, Name, NonNegative, Positive, Share, within

Curve = Annotated[tuple[Share, ...], Field(min_length=2)]
MeanAndSd = tuple[float, NonNegative]


class Hide(Model):
    """Artificial occlusion of a group, or of everybody, for some time: the sensor does not detect these people.

    Attributes:
        start: start of the occlusion, s
        end: end of the occlusion, s
        group: name of the group in the script; absent: all people
    """

    start: NonNegative
    end: NonNegative
    group: Name | None = None


class Memory(Model):
    """A part of an error that changes slowly from frame to frame.

    Attributes:
        share: share of the error's variance
        time: time after which the correlation of this part is 0.37, s
    """

    share: Share
    time: Positive


Memories = tuple[Memory, ...]


def _check_shares(memory: Memories | None) -> None:
    """Raises ValueError if the shares of variance of the parts add up to more than 1; None and no part are fine."""
    if sum(part.share for part in memory or ()) > 1 + 1e-9:
        raise ValueError("shares whose sum is at most 1")


class BoxNoise(Model):
    """Errors of detected boxes in proportion to the box height; each is (mean, standard deviation).

    The defaults lie among the profiles of three real detectors (docs/reference/detector-profiles.md).

    Attributes:
        across: error of the middle, to the right: mean, standard deviation; box heights
        foot: error of the lower edge, downwards: mean, standard deviation; box heights
        top: error of the upper edge, downwards: mean, standard deviation; box heights
        width: error of the logarithm of the width: mean, standard deviation
        floor_px: least standard deviation of middle, lower and upper edge, px
        scale: factor of all these errors; 0 = exact boxes
        occluded: each standard deviation is multiplied by 1 + this times the hidden share of the box
        tails: excess kurtosis k of the errors: Student's t with 4 + 6 / k degrees of freedom; 0 = normal
        memory: parts of these errors that change slowly; the rest is drawn anew in each frame
    """

    across: MeanAndSd = (0.0, 0.045)
    foot: MeanAndSd = (0.0, 0.07)
    top: MeanAndSd = (0.0, 0.06)
    width: MeanAndSd = (0.0, 0.18)
    floor_px: Annotated[float, within(0.0, 1000.0, " px")] = 0.3
    scale: Factors = 1.0
    occluded: NonNegative = 0.0
    tails: Annotated[float, Field(ge=0, le=30)] = 0.0
    memory: Memories | None = None

    @model_validator(mode="after")
    def _shares(self) -> Self:
        _check_shares(self.memory)
        return self


class FalseAlarms(Model):
    """False alarms that last, some of them attached to people. Pairs are (mean, standard deviation).

    Attributes:
        life: mean life of a false alarm, s; 0 = one frame
        seen: probability that a living false alarm is detected in a frame
        near: share of false alarms that move with a person (parts of a body, duplicates)
        across: false alarms at a person: middle relative to the person's middle: mean, standard deviation; box heights
        foot: false alarms at a person: lower edge below the person's lower edge: mean, standard deviation; box heights
        near_height: false alarms at a person: logarithm of the height relative to the person's: mean, standard
            deviation
        height: other false alarms: logarithm of the height relative to that of a person standing there: mean, standard
            deviation
        aspect: all false alarms: logarithm of width / height: mean, standard deviation
        drift: other false alarms: standard deviation of the velocity along each axis, box heights per s
        jitter: all false alarms: standard deviation of each edge from frame to frame, box heights
        at: other false alarms: possible foot points x, y as shares of image width and of the rows below the ground's
            furthest row; absent: anywhere
    """

    life: NonNegative = 0.0
    seen: Annotated[float, Field(gt=0, le=1)] = 1.0
    near: Share = 0.0
    across: MeanAndSd = (0.0, 0.3)
    foot: MeanAndSd = (0.0, 0.2)
    near_height: MeanAndSd = (0.0, 0.3)
    height: MeanAndSd = (0.0, 0.2)
    aspect: MeanAndSd = (-0.9, 0.2)
    drift: NonNegative = 0.0
    jitter: NonNegative = 0.0
    at: tuple[tuple[Share, Share], ...] | None = None


class Sensor(Model):
    """The synthetic detector that makes the points and boxes of det/det.txt.

    Raises pydantic.ValidationError for unknown keys, miss_memory together with persistence, quantiles that decrease, or
    shares of miss_memory above 1 in sum.

    Attributes:
        detect_prob: probability that a fully visible person of usual size is detected
        clutter_rate: mean number of false alarms per frame (Poisson)
        every: frames from one look of the detector to the next, without detections in between; absent: every frame
        box_noise: errors of boxes, in box heights
        noise_m: standard deviation of points on the ground along each axis, m
        box: visible: boxes of the visible parts, so that occlusion moves foot points; amodal: boxes of whole people
        points: points on the ground: seen = true position with noise_m, displaced as the foot of the visible part is;
            own = true position with noise_m; foot = below the lower edge of the noisy box
        occlusion_power: the probability of detection is multiplied by the visibility to this power
        min_visibility: people who are less visible are never detected
        small_px: box height at which the probability of detection is halved, px; 0 = no effect
        persistence: correlation of misses 0.1 s apart
        hide: artificial occlusions
        by_visibility: factors of the probability of detection at evenly spaced visibilities from 0 to 1; replaces
            occlusion_power
        miss_memory: parts of the misses of a person that change slowly; replaces persistence
        false_alarms: life, places and sizes of false alarms
        true_scores: evenly spaced quantiles of the scores of true detections, 0 to 1
        false_scores: evenly spaced quantiles of the scores of false alarms, 0 to 1
    """

    detect_prob: Shares = 0.95
    clutter_rate: Alarms = 0.3
    every: FrameSteps | None = None
    box_noise: BoxNoise = BoxNoise()
    noise_m: Distances = 0.05
    box: Literal["visible", "amodal"] = "visible"
    points: Literal["own", "seen", "foot"] = "seen"
    occlusion_power: NonNegative = 1.0
    min_visibility: Share = 0.2
    small_px: NonNegative = 12.0
    persistence: Share = 0.0
    hide: tuple[Hide, ...] = ()
    by_visibility: Curve | None = None
    miss_memory: Memories | None = None
    false_alarms: FalseAlarms | None = None
    true_scores: Curve | None = None
    false_scores: Curve | None = None

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
