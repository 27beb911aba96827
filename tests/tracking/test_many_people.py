"""The cost of many people is that of their neighbours: memory and time grow with the people, not with their square."""

from __future__ import annotations

import numpy as np

from benchmarks.many_people import FPS, frames
from sim.types import Context
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.tracker import Joint
from tracking.papers.relational.config import RelationalConfig
from tracking.papers.relational.tracker import Relational


def after(tracker, people, count):
    """The tracker after some frames of a crowd."""
    tracker.reset(Context(FPS, float("nan")), 0)
    for frame in frames(tracker.config.tracker, people, count):
        tracker.step(frame, frame.detections)
    return tracker


def test_relations_are_kept_of_neighbours_only():
    """Twice the people have twice the pairs, and not four times."""
    few, many = (after(Relational(RelationalConfig(particles=50)), people, 8) for people in (150, 300))
    assert many.particles.people == 300
    assert len(few.particles.pairs) > 150
    assert len(many.particles.pairs) < 2.6 * len(few.particles.pairs)
    assert len(many.belief.pair) < 2.6 * len(few.belief.pair)
    assert many.belief.means.total.shape[0] == len(many.belief.pair)


def test_the_belief_forgets_pairs_of_people_who_left():
    tracker = after(Joint(JointConfig(particles=5, partitions=5)), 40, 8)
    pairs, left = len(tracker.belief.pair), np.arange(40) < 20
    there = np.isin(tracker.belief.pair // 2**31, tracker.belief.number[left])
    there &= np.isin(tracker.belief.pair % 2**31, tracker.belief.number[left])
    tracker.belief.keep(left)
    assert 0 < len(tracker.belief.pair) == there.sum() < pairs
