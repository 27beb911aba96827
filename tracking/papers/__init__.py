"""One file per tracker, named after its method; each docstring names the paper."""
