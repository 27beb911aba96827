"""The command line: it may import every other package, and no other package imports it."""
