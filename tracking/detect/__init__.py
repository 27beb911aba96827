"""Detectors: from pixels to foreground, blobs and features."""
