"""The keys of scenario files: pydantic models of a scenario, its world, camera, sensor and pictures; SI units."""
