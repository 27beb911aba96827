"""The functions of `sim.elementary` compiled for scalars, to be called by other kernels."""

from __future__ import annotations

from sim import elementary
from sim.compiler import njit

exp = njit(cache=True)(elementary.exp)
sin = njit(cache=True)(elementary.sin)
cos = njit(cache=True)(elementary.cos)
atan2 = njit(cache=True)(elementary.atan2)
