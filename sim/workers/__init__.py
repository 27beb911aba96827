"""Running a function over many items: in this process, in spawned processes, or on a dask cluster."""
