"""The table `looks` of a scenario file: figures of people, what they carry, and things that are nobody."""

from __future__ import annotations

from typing import Annotated, Literal

from scenarios.schema.values import Model, Share, Value, within

Count = Annotated[Value, within(0.0, 200.0)]


class Carry(Model):
    """Shares of the people who carry something; each is drawn for each person, independently of the others.

    What is worn is part of the person. What is held is a thing: it hides people, the one who holds it too, and is part
    of nobody's box or mask.

    Attributes:
        coat: share with a coat over the thighs, worn
        bag: share with a bag at the side, worn
        rucksack: share with a rucksack, worn
        hat: share with a hat, worn
        umbrella: share with an open umbrella, held
        trolley: share with a trolley case, held
        pram: share with a pram, held
    """

    coat: Share = 0.0
    bag: Share = 0.0
    rucksack: Share = 0.0
    hat: Share = 0.0
    umbrella: Share = 0.0
    trolley: Share = 0.0
    pram: Share = 0.0


class Distractors(Model):
    """Mean numbers of things that are nobody: they are drawn, hide people, and are not labelled.

    The number is rounded up with the probability of its fraction, else down.

    Attributes:
        dog: dogs; two of three walk
        bicycle: parked bicycles
        car: cars; half of them pass
        bollard: bollards
        bin: litter bins
        poster: boards with a poster
        sign: signs on poles
    """

    dog: Count = 0.0
    bicycle: Count = 0.0
    car: Count = 0.0
    bollard: Count = 0.0
    bin: Count = 0.0
    poster: Count = 0.0
    sign: Count = 0.0


class LooksSpec(Model):
    """How people look in pictures, and what else is in the scene; it changes pictures, boxes and who hides whom.

    Attributes:
        figure: ellipsoids: a person is body and head; limbs: with legs and arms that swing as the person walks
        colours: share of the garments whose colour is any, not one of the usual ones; not of garments with given
            colours
    """

    figure: Literal["ellipsoids", "limbs"] = "ellipsoids"
    colours: Share = 0.0
    carry: Carry = Carry()
    distractors: Distractors = Distractors()
