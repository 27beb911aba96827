"""The parameters of the background models; a tracker's config may inherit them or hold fields of the same names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scenarios.errors import InputError
from tracking.config import Config, param


@dataclass(frozen=True)
class BackgroundSettings(Config):
    """Thresholds, bounds of shadows and highlights, and rates of adaptation."""

    tracker: ClassVar[str] = "background"

    detection_rate: float = param(
        0.9995,
        (0.9, 0.999999),
        "probability",
        "share of background pixels inside each threshold, by training",
        "log",
        sees="pixels",
    )
    dark: float = param(
        0.5, (0.0, 1.0), "", "brightness, relative, below which a pixel is dark foreground, no shadow", sees="pixels"
    )
    bright: float = param(
        1.3,
        (1.0, 100.0),
        "",
        "brightness, relative, above which a pixel is foreground, no highlight (ours)",
        "log",
        sees="pixels",
    )
    background_time: float = param(
        20.0, (1.0, 1e6), "s", "time constant of adaptation where background is seen", "log", sees="pixels"
    )
    foreground_time: float = param(
        200.0, (1.0, 1e9), "s", "the same where it is not, outside protected places (ours)", "log", sees="pixels"
    )
    gain: str = param(
        "global",
        ("global", "none"),
        "",
        "follow the brightness of the whole frame per channel (ours)",
        "categorical",
        sees="pixels",
        online=False,
    )

    def check(self) -> None:
        """Foreground adapts no faster than background."""
        if self.foreground_time < self.background_time:
            raise InputError(
                place="foreground_time",
                got=f"{self.foreground_time:g}",
                expected=f"at least background_time = {self.background_time:g}",
                remedy="give the foreground the longer time",
            )
