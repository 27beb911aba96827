"""People of floor plans in JuPedSim; for an environment of its own (pip install jupedsim numpy shapely).

usage: python run_floor_plans.py < PLANS.json
PLANS: {"model", "dt", "move", "plans": [{"size", "walls", "pillars", "people": [{"enter", "start", "goal", "speed"}…],
"seconds"}…]}

Needs nothing of flockscope. Each person walks alone to an exit round the goal, up to 1.4 m wide. Who has no room at the
start waits. Prints one line per plan: {"people", "left", "still", "crossed", "last", "cpu"}, or {"refused"}.
"""

import json
import logging
import math
import sys
import time

import jupedsim as jps
import shapely
from shapely.ops import unary_union

MODELS = {
    "collision-free speed": (jps.CollisionFreeSpeedModel, jps.CollisionFreeSpeedModelAgentParameters, "desired_speed"),
    "generalised centrifugal force": (
        jps.GeneralizedCentrifugalForceModel,
        jps.GeneralizedCentrifugalForceModelAgentParameters,
        "desired_speed",
    ),
    "social force": (jps.SocialForceModel, jps.SocialForceModelAgentParameters, "desired_speed"),
    "anticipation velocity": (
        jps.AnticipationVelocityModel,
        jps.AnticipationVelocityModelAgentParameters,
        "desired_speed",
    ),
}
HALF_WALL = 0.02  # m, as in ours
LOOK = 0.4  # s between two looks at who stands still


def ground_of(plan):
    """Returns the world of a plan without its walls and pillars."""
    parts = [shapely.LineString([w[:2], w[2:]]).buffer(HALF_WALL, cap_style="flat") for w in plan["walls"]]
    parts += [shapely.Point(x, y).buffer(r, 6) for x, y, r in plan.get("pillars", ())]
    return shapely.box(0, 0, *plan["size"]).difference(unary_union(parts))


def agent_of(model, ways, person):
    """Returns a person as an agent. ways: stage and journey of each goal."""
    _, parameters, speed = MODELS[model]
    stage, journey = ways[tuple(person["goal"])]
    agent = parameters(journey_id=journey, stage_id=stage, position=tuple(person["start"]))
    setattr(agent, speed, person["speed"])
    if hasattr(agent, "radius"):
        agent.radius = 0.2
    return agent


def played(given, plan):
    model = MODELS[given["model"]][0]
    ground = ground_of(plan)
    begin = time.process_time()
    simulation = jps.Simulation(model=model(), geometry=ground, dt=given["dt"])
    ways = {}
    for person in plan["people"]:
        x, y = person["goal"]
        if (x, y) not in ways:
            exits = (shapely.box(x - k, y - k, x + k, y + k) for k in (0.7, 0.5, 0.3))
            stage = simulation.add_exit_stage(next(e for e in exits if ground.contains(e)))
            ways[x, y] = stage, simulation.add_journey(jps.JourneyDescription([stage]))
    coming, seen, still = sorted(plan["people"], key=lambda p: p["enter"]), {}, {}
    while simulation.elapsed_time() < plan["seconds"] and (coming or simulation.agent_count()):
        now, waiting = simulation.elapsed_time(), []
        for person in coming:
            if person["enter"] > now:
                waiting.append(person)
                continue
            try:
                still[simulation.add_agent(agent_of(given["model"], ways, person))] = 0.0
            except RuntimeError:
                waiting.append(person)
        coming = waiting
        simulation.iterate(round(LOOK / given["dt"]))
        now = simulation.elapsed_time()
        for agent in simulation.agents():
            x, y, since = seen.get(agent.id, (math.inf, math.inf, now))
            if math.hypot(agent.position[0] - x, agent.position[1] - y) > given["move"]:
                seen[agent.id] = (*agent.position, now)
            else:
                still[agent.id] = max(still[agent.id], now - since)
    left = simulation.agent_count() + len(coming)
    return {
        "people": len(plan["people"]),
        "left": left,
        "still": list(still.values()),
        "crossed": 0,
        "last": simulation.elapsed_time(),
        "cpu": time.process_time() - begin,
    }


def main():
    logging.disable(logging.CRITICAL)
    given = json.load(sys.stdin)
    for plan in given["plans"]:
        try:
            print(json.dumps(played(given, plan)), flush=True)
        except RuntimeError as error:
            print(json.dumps({"refused": str(error)}), flush=True)


if __name__ == "__main__":
    main()
