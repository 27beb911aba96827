"""The strict form of scenario files: pydantic models of a scenario, its sensor and its camera; SI units."""
