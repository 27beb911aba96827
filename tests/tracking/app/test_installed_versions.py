"""A library that brought other versions along is refused at the start, by name, with what to install."""

from __future__ import annotations

import re
from importlib.metadata import requires, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from tests.processes import ROOT, python
from tracking.app.installed_versions import within

VERSIONS = ("1.26.4", "2", "2.0", "2.0.1", "2.4.6", "3", "3.0.0", "3.1", "10.2", "0.67.9", "0.68", "0.68.1", "0.69.0")


@pytest.mark.parametrize("limits", ["<3,>=2.0", ">=0.68,<0.69", ">=13.7,<16", ">=2", "<2.0.1"])
def test_limits_mean_what_packaging_says(limits: str) -> None:
    assert [within(got, limits) for got in VERSIONS] == [got in SpecifierSet(limits) for got in VERSIONS]


def test_all_limits_of_the_project_are_understood() -> None:
    wanted = [text for text in requires("flockscope") or () if ";" not in text]
    assert len(wanted) > 10
    for text in wanted:
        one = Requirement(text)
        assert within(version(one.name), text)
        ends = re.findall(r"(<|>=)([\d.]+)", text)
        assert SpecifierSet(",".join(sign + end for sign, end in ends)) == one.specifier


def test_other_versions_are_refused_with_their_names(tmp_path: Path) -> None:
    # as `pip install norfair` leaves them
    for name, got in (("numpy", "1.26.4"), ("filterpy", "1.4.5"), ("rich", "14.3.4")):
        folder = tmp_path / f"{name}-{got}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {got}\n")
    command = ("-m", "tracking.app.cli", "scenarios")
    run = python(*command, PYTHONPATH=f"{ROOT}:{tmp_path}")
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    for text in ("numpy 1.26.4", "filterpy 1.4.5", "--no-deps", '"numpy<3,>=2.0"'):
        assert text in run.stderr
    assert "rich" not in run.stderr  # 14 is one that works
    for name in ("numpy-1.26.4", "filterpy-1.4.5"):
        (tmp_path / f"{name}.dist-info").rename(tmp_path / name)
    assert python(*command, PYTHONPATH=f"{ROOT}:{tmp_path}").returncode == 0
