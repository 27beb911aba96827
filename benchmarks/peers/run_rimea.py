"""Paths of the people of plans in one model of JuPedSim; for an environment of its own (see run_floor_plans.py).

usage: python run_rimea.py PLANS.json PATHS.npz
PLANS: {"model", "dt", "rate", "plans": [{"size", "walls", "people": [{"enter", "start", "goal", "speed"}…],
"seconds"}…]}
Writes for plan k an array "k" (T, P, 2): x, y in m, `rate` times per s, nan while absent. A plan is left out if the
model refuses it or puts people into walls. Who has no room at the start waits.
"""

import json
import logging
import sys

import jupedsim as jps
import numpy as np
import shapely
from run_floor_plans import MODELS, agent_of, ground_of


def part_with_people(plan):
    ground, start = ground_of(plan), shapely.Point(plan["people"][0]["start"])
    return next(part for part in getattr(ground, "geoms", [ground]) if part.contains(start))


def paths(given, plan):
    model = MODELS[given["model"]][0]
    simulation = jps.Simulation(model=model(), geometry=part_with_people(plan), dt=given["dt"])
    ways, numbers, coming = {}, {}, dict(enumerate(plan["people"]))
    for x, y in {tuple(person["goal"]) for person in plan["people"]}:
        stage = simulation.add_exit_stage(shapely.box(x - 0.7, y - 0.7, x + 0.7, y + 0.7))
        ways[x, y] = stage, simulation.add_journey(jps.JourneyDescription([stage]))
    found = np.full((round(plan["seconds"] * given["rate"]), len(coming), 2), np.nan)
    for tick, here in enumerate(found):
        for number, person in list(coming.items()):
            if person["enter"] <= tick / given["rate"]:
                try:
                    numbers[simulation.add_agent(agent_of(given["model"], ways, person))] = number
                    del coming[number]
                except RuntimeError:
                    continue
        for agent in simulation.agents():
            here[numbers[agent.id]] = agent.position
        if not coming and not simulation.agent_count():
            break
        simulation.iterate(round(1 / given["dt"] / given["rate"]))
    return found


def main():
    logging.disable(logging.CRITICAL)
    with open(sys.argv[1]) as file:
        given = json.load(file)
    found = {}
    for k, plan in enumerate(given["plans"]):
        try:
            found[str(k)] = paths(given, plan)
        except RuntimeError as error:
            print(f"{given['model']}: plan {k} is left out: {error}", file=sys.stderr)
    np.savez(sys.argv[2], **found)


if __name__ == "__main__":
    main()
