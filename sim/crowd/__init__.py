"""How the simulated crowd moves: population, orders, ways, forces, physics. Only `world` imports pymunk."""
