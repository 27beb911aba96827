"""The replay page of `flockscope view`: its data in Python, its scripts in JavaScript."""
