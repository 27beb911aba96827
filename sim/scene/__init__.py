"""Geometry of what a camera sees: cameras, people's bodies, ground, ray casting, visibility."""
