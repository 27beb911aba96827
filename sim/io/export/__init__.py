"""Exports of stored datasets: COCO, WebDataset."""
