"""The pages of docs/reference hold the tables of parameters that the configs print."""

from __future__ import annotations

from pathlib import Path

import pytest

from tracking.config import Config
from tracking.detect.background_settings import BackgroundSettings
from tracking.grouping.link_rule import LinkRule
from tracking.papers.blob.config import BlobConfig
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.joint.config import JointConfig
from tracking.papers.relational.config import RelationalConfig
from tracking.papers.stereo.config import StereoConfig

REFERENCE = Path(__file__).resolve().parents[2] / "docs" / "reference"


PAGES = [
    (LinkRule, "grouping.md"),
    (BackgroundSettings, "foreground.md"),
    (BlobConfig, "trackers/blob.md"),
    (GroupPdaConfig, "trackers/group-pda.md"),
    (RelationalConfig, "trackers/relational.md"),
    (JointConfig, "trackers/joint.md"),
    (StereoConfig, "trackers/stereo.md"),
]


@pytest.mark.parametrize(("config", "page"), PAGES)
def test_the_page_holds_the_table(config: type[Config], page: str) -> None:
    assert config.table() in (REFERENCE / page).read_text(encoding="utf-8"), (
        f"put {config.__name__}.table() into {page}"
    )
