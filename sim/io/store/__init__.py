"""The project's own files: a folder for each sequence (pictures, truth, detections), and the tracks of a tracker's
run."""
