"""KITTI export: pictures, true disparities and calibration of generated sequences, named as in KITTI's data.

OUT/<split>/<name>/ of a sequence holds image_2 (left), 8-bit PNG; where they are stored image_3 (right) and disp_noc_0,
16-bit PNG of 256 times the disparity in px, 0 where it is unknown or the right camera does not see the point;
times.txt, the time of each frame in s; and calib.txt of a pinhole camera. Pictures are named for the frame, from
000001.png.

calib.txt has the matrices of KITTI's calibrations row by row, so that tools for its odometry and its object data read
it. P0 to P3 (3 x 4) project points of the left camera's coordinates: there are no grey cameras, so P0 and P2 are the
left picture, P1 and P3 the right one. The world takes the place of the laser scanner and of the IMU: Tr and
Tr_velo_to_cam (3 x 4) map it to the left camera, Tr_imu_to_velo (3 x 4) and R0_rect (3 x 3) are identities. If the
camera moves, all four are identities, and poses.txt has a line per frame, as in KITTI's odometry: the 3 x 4 matrix that
maps the left camera's coordinates to the world, row by row.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from scenarios.errors import reject
from sim.pictures.stored_pictures import StoredPictures
from sim.store.atomic import write_file
from sim.store.camera_files import read_camera, read_cameras
from sim.store.own_files import split_and_name
from sim.store.seal import read_whole_manifest, reject_sealed
from sim.store.sequence_folder import CAMERAS
from sim.types import Array, Camera
from tracking.recordings.source import generated_folders

FOLDERS = {"left": "image_2", "right": "image_3", "disparity": "disp_noc_0"}


def kitti(source: str | Path, out: str | Path) -> list[Path]:
    """Writes the pictures, disparities and calibrations of a generated dataset in KITTI's layout.

    Args:
        source: A sequence or dataset with the stream left; right and disparity are written where stored.
        out: The folder; files of an earlier export are replaced.

    Returns:
        The folders of the sequences.

    Raises:
        InputError: Two sequences share a folder, or it is that of a stored sequence or a run.
    """
    folders = generated_folders(Path(source))
    targets = [Path(out) / split_and_name(folder) for folder in folders]
    reject(len(set(targets)) < len(targets), source, "two sequences of one name", "unique names", "rename one")
    for folder, target in zip(folders, targets, strict=True):
        reject_sealed(target)
        _export(folder, target)
    return targets


def calibration(camera: Camera, moves: bool = False) -> str:
    """Returns the text of calib.txt for a rectified pair.

    camera: the left camera, with its baseline. moves: True leaves its place out.
    """
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    left = np.array([[fx, 0, cx - 0.5, 0], [0, fy, cy - 0.5, 0], [0, 0, 1, 0]])  # KITTI: a pixel's centre is a whole px
    right = left.copy()
    right[0, 3] = -fx * camera.baseline
    pose = np.eye(3, 4) if moves else np.column_stack([camera.rotation, -camera.rotation @ camera.position])
    lines = {"P0": left, "P1": right, "P2": left, "P3": right, "R0_rect": np.eye(3), "Tr_velo_to_cam": pose}
    lines |= {"Tr_imu_to_velo": np.eye(3, 4), "Tr": pose}
    return "".join(f"{name}: {_numbers(matrix)}\n" for name, matrix in lines.items())


def poses(cameras: Sequence[Camera]) -> str:
    """Returns the text of poses.txt of the cameras of all frames."""
    every = (np.column_stack([camera.rotation.T, camera.position]) for camera in cameras)
    return "".join(f"{_numbers(pose)}\n" for pose in every)


def _numbers(matrix: Array) -> str:
    return " ".join(f"{v:.12e}" for v in matrix.ravel().tolist())


def _export(folder: Path, target: Path) -> None:
    stored = StoredPictures(folder, read_whole_manifest(folder))
    remedy = "generate it with --streams left, or left,right,disparity"
    reject("left" not in stored.streams, folder, "no stream left", "pictures of the left camera", remedy)
    about = stored.manifest["sequence"]
    cameras = read_cameras(folder / CAMERAS, about["length"]) if CAMERAS in stored.manifest["files"] else ()
    camera = cameras[0] if cameras else read_camera(folder / "camera.json")
    if camera.kind == "pinhole":
        write_file(target / "calib.txt", calibration(camera, bool(cameras)).encode())
    if cameras:
        write_file(target / "poses.txt", poses(cameras).encode())
    times = "".join(f"{k / about['fps']:.6e}\n" for k in range(about["length"]))
    write_file(target / "times.txt", times.encode())
    for stream, name in FOLDERS.items():
        if stream in stored.streams:
            for k, picture in enumerate(stored.all(stream, about["length"]), 1):
                write_file(target / name / f"{k:06d}.png", cv2.imencode(".png", picture)[1].tobytes())
