"""Geometry of what a camera sees: cameras, people's bodies as ellipsoids, ground and stairs, ray casting,
visibility."""
