"""Geometry of what a camera sees, from a scene, people's positions and a camera: people's bodies as ellipsoids, ground
and stairs, projection into the image, ray casting, visibility."""
