"""Runs a function over many items: in this process, in local worker processes, or on a dask cluster."""
