"""Group ids of a tracker that finds groups of people itself, frame by frame, by the identity rule of the truth."""

from __future__ import annotations

import numpy as np

from sim.truth.identity import Identities
from sim.types import Groups, Ints


def known_groups(identities: Identities, ids: Ints) -> Ints:
    """Returns the id of each person's group, (N,), as `identities` has it, -1 for a person alone; ids (N,)."""
    group_of = {person: group for group, people in identities.groups.items() for person in people}
    return np.array([group_of.get(person, -1) for person in ids.tolist()], np.int64)


def no_groups(group: Ints) -> Groups | None:
    """Returns empty Groups if nobody is in a group, which says so; else None: hulls are derived from the group ids."""
    return Groups.none() if (group < 0).all() else None
