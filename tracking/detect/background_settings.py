"""The parameters of the background model, which the configs of all trackers from pixels inherit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tracking.config import Config, param


@dataclass(frozen=True)
class BackgroundSettings(Config):
    """The parameters of the five-class background model; each field states its own default, range and unit."""

    tracker: ClassVar[str] = "background"

    # fmt: off
    detection_rate: float = param(0.9995, (0.9, 0.999999), "probability",
        "from pixels: share of the sample's background that each threshold leaves background", "log", sees="pixels")
    dark: float = param(0.5, (0.0, 1.0), "",
        "from pixels: relative brightness; a darkened pixel below it is foreground, else shadow; an adaptive "
        "background raises it to the darkest shadow of its sample; raise it if dark clothes are missed", sees="pixels")
    background: str = param("adaptive", ("adaptive", "trained"), "",
        "from pixels: follows light and scene (ours) or stays as trained", "categorical", sees="pixels", online=False)
    background_time: float = param(20.0, (1.0, 1000.0), "s",
        "from pixels: time constant of background that adapts; foreground: ten times (ours)", "log", sees="pixels")
    # fmt: on

    @property
    def adaptive(self) -> bool:
        """True if the model follows light and scene."""
        return self.background == "adaptive"
