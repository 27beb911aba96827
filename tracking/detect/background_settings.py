"""The parameters of the background models.

The config of a tracker from pixels inherits `BackgroundSettings`, or has fields of the same names.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scenarios.errors import InputError
from tracking.config import Config, param

NEVER = 1e9
"""s: a time that switches off what would happen after it."""


@dataclass(frozen=True)
class BackgroundSettings(Config):
    """The parameters of the five-class background model; each field states its own default, range and unit.

    detection_rate (probability): share of background pixels that each noise threshold leaves background. dark, bright
    (brightness relative to the background): a darker pixel than `dark` is dark foreground, not shadow; a brighter one
    than `bright` is foreground, not highlight. background_time, foreground_time (s): time constants with which
    background pixels and all others adapt. gain: "global" or "none", whether the brightness of each frame is corrected.

    Raises InputError if a value is not allowed or foreground_time is shorter than background_time.
    """

    tracker: ClassVar[str] = "background"

    detection_rate: float = param(
        0.9995,
        (0.9, 0.999999),
        "probability",
        "from pixels: share of the training sample's background pixels that each threshold leaves background",
        "log",
        sees="pixels",
    )
    dark: float = param(
        0.5,
        (0.0, 1.0),
        "",
        "from pixels: relative brightness; a darkened pixel below it is dark foreground, above it shadow",
        sees="pixels",
    )
    bright: float = param(
        1.3,
        (1.0, 100.0),
        "",
        "from pixels: relative brightness; a brightened pixel above it is foreground, below it highlight (ours)",
        "log",
        sees="pixels",
    )
    background_time: float = param(
        20.0,
        (1.0, 1e6),
        "s",
        "from pixels: time constant with which pixels classified as background adapt (ours)",
        "log",
        sees="pixels",
    )
    foreground_time: float = param(
        200.0,
        (1.0, 1e9),
        "s",
        "from pixels: time constant with which all other pixels adapt, except protected ones (ours)",
        "log",
        sees="pixels",
    )
    ghost_time: float = param(
        1.0,
        (0.1, NEVER),
        "s",
        "from pixels: a region that has stood still for this time and shows what left, not what came, becomes "
        "background; 1e9: never (ours)",
        "log",
        sees="pixels",
        online=False,
    )
    gain: str = param(
        "global",
        ("global", "none"),
        "",
        "from pixels: global: the brightness of each frame is estimated and corrected per colour (ours); none: not so",
        "categorical",
        sees="pixels",
        online=False,
    )

    def check(self) -> None:
        """Raises InputError if foreground_time is shorter than background_time (both in s); returns nothing."""
        if self.foreground_time < self.background_time:
            raise InputError(
                place="foreground_time",
                got=f"{self.foreground_time:g}",
                expected=f"at least background_time = {self.background_time:g}",
                remedy="raise foreground_time or lower background_time",
            )
