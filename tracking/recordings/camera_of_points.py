"""A pinhole camera from points on the ground whose place in the picture is known (`calibrate --points`).

The file has a row u, v, x, y for each point: its place in the picture, px, from the upper left corner, and on the
ground, m, with y to the left of x as seen from above. The camera has square pixels, its centre is that of the picture,
and its lens does not distort. Its focal length, rotation and position (7 numbers) are those with the least squares of
the distances in the picture: Zhang's calibration (2000) with one view, by `cv2.calibrateCamera`. Its minima are local,
so it begins at several focal lengths.

The standard deviations follow from the Jacobian J of the 2 N coordinates: S = s² (JᵀJ)⁻¹. s is that of the residuals,
and at least 1 px, as few points may fit exactly by chance. The bits of the camera depend on OpenCV and the processor;
runs read the numbers that were written.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.errors import reject
from scenarios.limits import COORDINATE
from sim.scene.camera import project, require_camera
from sim.store.numeric_text import CORRECT, OFFSET, NumericTable, is_number_text, read_rows
from sim.types import Array, Camera

COLUMNS = ("u", "v", "x", "y")
LEAST, UNKNOWNS = 4, 7
STARTS = np.geomspace(0.3, 6.0, 9)  # focal lengths, widths of the picture, from which the search begins
ON_LINE = 0.01  # points nearer to one line than this share of their extent are on it
OPEN = 0.3  # greatest standard deviation of the focal length, as a share of it
FARTHEST = 0.03  # greatest root mean square residual, as a share of the picture's width


@dataclass(frozen=True)
class PointFit:
    """A camera, the distances (N,), px, of the points from where it sees them, and the standard deviations of its
    height, m, tilt, rad, and focal length, px."""

    camera: Camera
    residual: Array
    height_sd: float
    tilt_sd: float
    focal_sd: float

    @property
    def rms(self) -> float:
        """The root mean square of the residuals, px."""
        return float(np.sqrt((self.residual**2).mean()))


def read_points(path: Path) -> NumericTable:
    """Returns the rows u, v, x, y of a text; a first line with these names may give another order."""
    rows, order = read_rows(path, heading=True), list(range(4))
    cells = [cell.strip().strip('"').lower() for cell in next(rows.cells(), [])]
    named = bool(cells) and not any(map(is_number_text, cells))
    if named:
        reject(sorted(cells) != sorted(COLUMNS), path, ",".join(cells), "u,v,x,y", "correct the names", "line 1")
        order = [cells.index(name) for name in COLUMNS]
    table = rows.numbers((4,), first=int(named), layout="u,v,x,y: px in the picture, m on the ground")
    table = NumericTable(path, table.values[:, order], table.line, table.layout)
    far = (np.abs(table.values) > COORDINATE).any(axis=1)
    table.reject(far, f"numbers within {COORDINATE:g}", CORRECT, OFFSET)
    return table


def camera_of_points(points: NumericTable, image: tuple[int, int]) -> PointFit:
    """Returns the camera that sees the points. image: width and height of the picture, px. Raises InputError if the
    points do not determine it, or no camera sees them so."""
    uv, xy, size = points.values[:, :2], points.values[:, 2:], np.array(image, float)
    _require_area(points, image)
    middle = xy.mean(axis=0)
    rotation, shift, focal = _fitted(uv, xy - middle, size)
    position = -rotation.T @ shift + [*middle, 0.0]
    camera = Camera("pinhole", image, (focal, focal), (image[0] / 2, image[1] / 2), position, rotation)
    seen, _ = project(camera, np.column_stack([xy, np.zeros(len(xy))]))
    residual = np.sqrt(((seen - uv) ** 2).sum(axis=1))
    fit = PointFit(camera, residual, *_deviations(xy - middle, rotation, shift, focal, residual))
    _require_fit(fit, points)
    return fit


def _require_area(points: NumericTable, image: tuple[int, int]) -> None:
    uv, xy, file = points.values[:, :2], points.values[:, 2:], points.file
    remedy = "add points that are spread over the ground"
    reject(len(uv) < LEAST, file, f"{len(uv)} points", f"{LEAST} or more, better 6", remedy, "points")
    outside = ((uv < 0) | (uv > image)).any(axis=1)
    points.reject(outside, "a point in the picture of {} × {} px".format(*image), "correct u and v, in px")
    for where, at in (("picture", uv), ("ground", xy)):
        wrong = _on_line(at)
        reject(wrong, file, f"points on one line on the {where}", "points that span an area", remedy, "points")


def _require_fit(fit: PointFit, points: NumericTable) -> None:
    """Raises InputError if the camera does not see the points, if they leave it open, or if it cannot be used."""
    file, focal, most = points.file, fit.camera.focal_px[0], FARTHEST * fit.camera.image[0]
    worst = int(np.nan_to_num(fit.residual, nan=np.inf).argmax())
    far = f"a point {fit.residual[worst]:.0f} px from where the best camera sees it ({fit.rms:.0f} px in the mean)"
    got = far if np.isfinite(fit.residual[worst]) else "a point behind the camera that fits best"
    expected, place = f"points that one camera sees, to {most:.0f} px in the mean", f"line {points.line[worst]}"
    remedy = "correct the row, or its columns: u,v px, x,y m; y left of x"
    reject(not fit.rms <= most, file, got, expected, remedy, place)
    got, expected = "points that leave the focal length open", f"points that tell it to {OPEN:.0%}"
    reject(not fit.focal_sd <= OPEN * focal, file, got, expected, "add points nearer and farther", "points")
    below = not fit.camera.position[2] > 0
    got, expected = "points seen from below the ground", "a camera above the ground"
    reject(below, file, got, expected, "let y be left of x, as seen from above: negate all y", "points")
    require_camera(fit.camera, file)


def _on_line(at: Array) -> bool:
    long, short = np.linalg.svd(at - at.mean(axis=0), compute_uv=False)[:2]
    return bool(short <= ON_LINE * long)


def _fitted(uv: Array, xy: Array, size: Array) -> tuple[Array, Array, float]:
    """Returns rotation (3, 3), shift (3,) and focal length of the camera with the least squares, x_cam = R x + T."""
    import cv2

    # OpenCV's pixel coordinates begin at the centre of the first pixel, ours at its corner.
    ground, seen = np.column_stack([xy, np.zeros(len(xy))]).astype(np.float32), (uv - 0.5).astype(np.float32)
    fixed = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_FIX_PRINCIPAL_POINT
    fixed |= cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    found = []
    for focal in STARTS * size[0]:
        guess = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
        rms, lens, _, turns, shifts = cv2.calibrateCamera(
            [ground], [seen], tuple(size.astype(int).tolist()), guess, np.zeros(5), flags=fixed
        )
        if np.isfinite(rms):
            turn, shift = (np.asarray(each[0], float)[:, 0] for each in (turns, shifts))
            found.append((float(rms), float(lens[0, 0]), turn, shift))
    _, focal, turn, shift = min(found, key=lambda each: each[:2])
    return np.asarray(cv2.Rodrigues(turn)[0], float), shift, focal


def _deviations(xy: Array, rotation: Array, shift: Array, focal: float, residual: Array) -> tuple[float, float, float]:
    """Returns the standard deviations of height, tilt and focal length; inf if the points leave them open."""
    import cv2

    turn, lens = cv2.Rodrigues(rotation)[0][:, 0], np.diag([focal, focal, 1.0])
    J = cv2.projectPoints(np.column_stack([xy, np.zeros(len(xy))]), turn, shift, lens, None)[1]
    J = np.column_stack([J[:, :6], J[:, 6] + J[:, 7]])
    unit = np.array([*np.ones(3), *np.full(3, np.sqrt((shift**2).sum())), focal])  # of each unknown
    _, values, axes = np.linalg.svd(J * unit, full_matrices=False)
    if values[-1] <= 1e-9 * values[0]:
        return np.inf, np.inf, np.inf
    freedom = max(2 * len(xy) - UNKNOWNS, 1)
    noise = max(1.0, float(np.sqrt((residual**2).sum() / freedom)))
    root = noise * axes.T / values * unit[:, None]  # S = root rootᵀ

    def height_tilt(p: Array) -> Array:
        R = cv2.Rodrigues(p[:3])[0]
        return np.array([-(R.T @ p[3:6])[2], np.arcsin(np.clip(-R[2, 2], -1, 1))])

    p = np.array([*turn, *shift, focal])
    step = 1e-6 * unit
    slope = np.array([(height_tilt(p + e) - height_tilt(p - e)) / (2 * e.sum()) for e in np.diag(step)]).T
    height, tilt = np.sqrt(((slope @ root) ** 2).sum(axis=1)).tolist()
    return height, tilt, float(np.sqrt((root[-1] ** 2).sum()))
