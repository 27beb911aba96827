"""Writes truth, tracks and datasets for other programs: COCO, KITTI, WebDataset, tidy CSV and Parquet tables."""
