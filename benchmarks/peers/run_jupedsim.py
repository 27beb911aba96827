"""CPU seconds of JuPedSim's collision-free speed model; for an environment of its own (pip install jupedsim numpy).

usage: python run_jupedsim.py < LAYOUT.json
LAYOUT: {"start": [[x, y]…], "goal", "speed", "size", "margin", "dt", "steps", "episodes"}

Needs nothing of flockscope. The scene is an open square with a wall `margin` m round it, in which each person walks to
a goal of their own. All positions are read into an array after every step. Prints {"people", "steps", "seconds"}: CPU
seconds in the loop of steps, without building the scene.
"""

import json
import logging
import sys
import time

import numpy as np


def build(scene):
    import jupedsim

    low, high = -scene["margin"], scene["size"] + scene["margin"]
    square = [(low, low), (high, low), (high, high), (low, high)]
    simulation = jupedsim.Simulation(model=jupedsim.CollisionFreeSpeedModel(), geometry=square, dt=scene["dt"])
    stage = simulation.add_direct_steering_stage()
    journey = simulation.add_journey(jupedsim.JourneyDescription([stage]))
    for start, goal, speed in zip(scene["start"], scene["goal"], scene["speed"], strict=True):
        parameters = jupedsim.CollisionFreeSpeedModelAgentParameters(
            journey_id=journey, stage_id=stage, position=tuple(start), desired_speed=speed, radius=0.2
        )
        agent = simulation.add_agent(parameters)
        simulation.agent(agent).target = tuple(goal)
    return simulation


def main():
    logging.disable(logging.CRITICAL)
    scene, seconds = json.load(sys.stdin), 0.0
    for _ in range(scene["episodes"]):
        simulation = build(scene)
        simulation.iterate()
        begin = time.process_time()
        for _ in range(scene["steps"]):
            simulation.iterate()
            positions = np.array([agent.position for agent in simulation.agents()])
        seconds += time.process_time() - begin
    print(json.dumps({"people": len(positions), "steps": scene["steps"] * scene["episodes"], "seconds": seconds}))


if __name__ == "__main__":
    main()
