"""The pages of docs/reference hold the tables of parameters that the configs print."""

from __future__ import annotations

from pathlib import Path

import pytest

from tracking.config import Config
from tracking.constants_table import constants_table
from tracking.detect.background_settings import BackgroundSettings
from tracking.grouping.link_rule import LinkRule
from tracking.papers.blob.config import BlobConfig
from tracking.papers.group_pda.config import GroupPdaConfig

REFERENCE = Path(__file__).resolve().parents[2] / "docs" / "reference"


PAGES = [
    (LinkRule, "grouping.md"),
    (BackgroundSettings, "foreground.md"),
    (BlobConfig, "trackers/blob.md"),
    (GroupPdaConfig, "trackers/group-pda.md"),
]


@pytest.mark.parametrize(("config", "page"), PAGES)
def test_the_page_holds_the_table(config: type[Config], page: str) -> None:
    assert config.table() in (REFERENCE / page).read_text(encoding="utf-8"), (
        f"put {config.__name__}.table() into {page}"
    )


def test_the_page_of_group_pda_holds_its_constants() -> None:
    assert constants_table("group_pda") in (REFERENCE / "trackers" / "group-pda.md").read_text(encoding="utf-8"), (
        "put the output of python -m tracking.constants_table group_pda into the page"
    )
