"""Exports stored datasets to formats of other programs: COCO (one JSON file) and WebDataset (tar files)."""
