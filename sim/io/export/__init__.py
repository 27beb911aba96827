"""Stored datasets in other forms: COCO, WebDataset."""
