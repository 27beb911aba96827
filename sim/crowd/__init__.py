"""How the simulated crowd moves: who takes part, the script's orders, ways round walls, forces, physics. From a
scenario and a seed it computes a Motion: everybody's position, velocity and group in each frame. Only `world` imports
pymunk."""
