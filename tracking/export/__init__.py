"""Writes truth, tracks and datasets for other programs: COCO, YOLO, MOTS, KITTI, WebDataset, tidy tables."""

MIN_VISIBILITY = 0.2  # share of the body: people of whom less is visible are ignored
