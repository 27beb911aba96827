import pytest

from sim.truth.group_ids_and_changes import group_changes, identify


def parts(*words):
    return [frozenset(map(int, w)) for w in words]


def kept(old, born, new):
    found = identify({g: frozenset(map(int, w)) for g, w in old.items()}, parts(*new), born)
    return {"".join(map(str, sorted(p))): g for p, g in found.items()}


HEIRS = [
    ({5: "123", 6: "45"}, {5: 9, 6: 0}, ["12345"], {"12345": 5}),  # most members
    ({5: "12", 6: "45"}, {5: 9, 6: 0}, ["1245"], {"1245": 6}),  # tie: older
    ({5: "12", 6: "45"}, {5: 0, 6: 0}, ["1245"], {"1245": 5}),  # tie of age: smaller id
    ({5: "12345"}, {5: 0}, ["12", "345"], {"12": None, "345": 5}),  # split: most members
    ({5: "1234"}, {5: 0}, ["34", "12"], {"12": 5, "34": None}),  # tie of children: smaller person
    ({5: "123"}, {5: 0}, ["12", "3"], {"12": 5}),
    ({5: "12"}, {5: 0}, ["1", "2"], {}),  # left by all but one: ends
    ({5: "12"}, {5: 0}, ["13"], {"13": None}),  # one in common is not the same group
    ({5: "123", 6: "456"}, {5: 0, 6: 0}, ["12", "3456"], {"12": 5, "3456": 6}),
    ({}, {}, ["12"], {"12": None}),
]


@pytest.mark.parametrize(("old", "born", "new", "expected"), HEIRS)
def test_who_keeps_the_id(old, born, new, expected):
    assert kept(old, born, new) == expected


def change(old, new, before, now):
    people = [frozenset(map(int, w)) for w in (before, now)]
    groups = [{g: frozenset(map(int, w)) for g, w in side.items()} for side in (old, new)]
    return [(c.kind, c.before, c.after, c.members) for c in group_changes(*groups, *people)]


CHANGES = [
    ({}, {1: "12"}, [("form", (-1, -1), (1,), (1, 2))]),
    ({1: "12"}, {1: "123"}, [("merge", (-1, 1), (1,), (1, 2, 3))]),
    ({1: "12", 2: "34"}, {1: "1234"}, [("merge", (1, 2), (1,), (1, 2, 3, 4))]),
    ({1: "12"}, {}, [("dissolve", (1,), (-1, -1), (1, 2))]),
    ({1: "1234"}, {1: "12", 2: "34"}, [("split", (1,), (1, 2), (1, 2, 3, 4))]),
    ({1: "123"}, {1: "12"}, [("split", (1,), (-1, 1), (1, 2, 3))]),
    ({1: "12", 2: "34"}, {1: "12", 2: "34"}, []),
    (
        {1: "123", 2: "45"},
        {1: "12", 2: "345"},
        [("split", (1,), (1, 2), (1, 2, 3)), ("merge", (1, 2), (2,), (3, 4, 5))],
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), CHANGES)
def test_what_happened(old, new, expected):
    assert change(old, new, "12345", "12345") == expected


def test_coming_and_going_is_no_merge_or_split():
    assert change({}, {1: "12"}, "", "12") == [("enter", (), (1,), (1, 2))]
    assert change({}, {1: "12"}, "1", "12") == [("enter", (-1,), (1,), (1, 2))]
    assert change({1: "12"}, {1: "123"}, "12", "123") == []
    assert change({1: "123"}, {1: "12"}, "123", "12") == []
    assert change({1: "12"}, {}, "12", "3") == [("leave", (1,), (), (1, 2))]
    assert change({1: "12"}, {}, "12", "2") == [("leave", (1,), (-1,), (1, 2))]
