"""Tuning by search (docs/tuning.md): `tune` plays whole episodes on simulated scenes, and judges on others."""

from tracking.tuning.tuning import tune

__all__ = ["tune"]
