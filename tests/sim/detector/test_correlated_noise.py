import numpy as np
import pytest

from scenarios.schema.sensor import Memory
from sim.detector.draws import correlated_normals


def drawn(memory: list[Memory], frames: int = 4000, first: int = 1, id: int = 1) -> np.ndarray:
    fresh = np.random.default_rng(id).standard_normal((frames, 3))
    return correlated_normals(fresh, memory, first, 10.0, 7, id, 0)


def test_without_memory_all_is_new() -> None:
    fresh = np.random.default_rng(0).standard_normal((5, 2))
    assert np.array_equal(correlated_normals(fresh, [], 1, 10.0, 7, 1, 0), fresh)


def test_correlation_is_the_sum_of_the_parts() -> None:
    memory = [Memory(share=0.3, time=0.3), Memory(share=0.5, time=2.0)]
    z = np.stack([drawn(memory, id=k) for k in range(40)])
    assert z.mean() == pytest.approx(0.0, abs=0.03)
    assert z.std() == pytest.approx(1.0, abs=0.02)
    for lag in (1, 3, 10, 30):
        wanted = sum(m.share * np.exp(-lag / (10 * m.time)) for m in memory)
        assert (z[:, lag:] * z[:, :-lag]).mean() == pytest.approx(wanted, abs=0.025)


def test_who_enters_later_meets_the_same_numbers() -> None:
    memory = [Memory(share=1.0, time=1.0)]
    assert np.array_equal(drawn(memory, 50)[20:], drawn(memory, 30, first=21))
    assert np.array_equal(drawn(memory, 50)[:30], drawn(memory, 30))
