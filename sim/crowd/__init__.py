"""How the simulated crowd moves: who takes part, orders, ways, forces. Only `world` imports pymunk."""
