"""The places in `places.toml`: where the parts of the pages come from."""

from __future__ import annotations

import tomllib
from pathlib import Path

PLACES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
DOCSTRINGS, CONFIGS, NAMES = PLACES["docstrings"], PLACES["configs"], PLACES["names"]
