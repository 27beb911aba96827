"""Boxes that two detectors of people find after training on given pictures; for an environment of its own.

usage: python run_train_there.py JOBS.json FOUND.npz
JOBS: {"test": [file…], "jobs": [{"detector": "hog" | "cnn", "seed", "sets": [[{"file", "boxes", "ignored"}…]…]}…]}
Boxes are left, top, width, height, px. Writes for job k an array "k" (N, 6): number of the test picture, box, score.

hog: histograms of oriented gradients and a linear SVM (Dalal and Triggs 2005), windows of 32 x 64 px in which a person
is 48 px high, negatives found in three rounds; boxes have the median shape of those it was trained on. cnn: a fully
convolutional net of 160,000 weights, which gives for each cell of 4 px how likely a box has its centre there, and its
size (Zhou et al. 2019, CenterNet). Both look for people of 24 to 96 px. Each sample is a crop round a person, zoomed so
that the height is drawn from this range, or round another place, mirrored or not. The sets of a job give equally many.
Needs torch, and opencv-python-headless < 5, as 5 has no HOG.
"""

import json
import sys
import time

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn import functional

LOW, HIGH = 24.0, 96.0  # px: heights of people
OVERLAP = 0.45  # of two boxes, of which the better one stays
WINDOW, PERSON = (32, 64), 48.0  # px
HOG = cv2.HOGDescriptor(WINDOW, (8, 8), (4, 4), (4, 4), 9)
POSITIVES, NEGATIVES, SEARCHED = 2000, 3000, 40  # windows, windows of each round, pictures of each round
ZOOM, CROP, CELL, BATCH, STEPS = 1.5, 192, 4, 8, 450  # the net sees pictures ZOOM times as large


def overlap(boxes, box):
    """Returns the intersection over union (N,) of boxes (N, 4) with a box."""
    inner = np.minimum(boxes[:, :2] + boxes[:, 2:], box[:2] + box[2:]) - np.maximum(boxes[:, :2], box[:2])
    area = np.prod(np.maximum(inner, 0), axis=1)
    return area / (np.prod(boxes[:, 2:], axis=1) + box[2] * box[3] - area)


def best(boxes, scores, most=100):
    """Returns rows (N, 5) of boxes and scores, without those that a better one overlaps."""
    order, kept = np.argsort(-scores, kind="stable"), []
    while len(order) and len(kept) < most:
        kept.append(order[0])
        order = order[1:][overlap(boxes[order[1:]], boxes[order[0]]) < OVERLAP]
    return np.column_stack([boxes[kept], scores[kept]]).reshape(-1, 5)


def crop(picture, centre, zoom, size, mirror):
    """Returns the part (H, W, 3) of a picture round a place, and the matrix (2, 3) that maps into it."""
    side = -zoom if mirror else zoom
    to = np.array([[side, 0, size[0] / 2 - side * centre[0]], [0, zoom, size[1] / 2 - zoom * centre[1]]])
    how = cv2.INTER_AREA if zoom < 0.7 else cv2.INTER_LINEAR
    return cv2.warpAffine(picture, to, size, flags=how, borderMode=cv2.BORDER_REFLECT_101), to


class Pictures:
    """Pictures of the sets of a job, from which samples are drawn."""

    def __init__(self, sets, rng):
        self.rng, self.sets = rng, []
        for one in sets:
            rows = [(cv2.imread(p["file"]), np.reshape(p["boxes"], (-1, 4)), np.reshape(p["ignored"], (-1, 4)))
                    for p in one]  # fmt: skip
            self.sets.append((rows, [(k, i) for k, row in enumerate(rows) for i in range(len(row[1]))]))

    def picture(self):
        """Returns a picture, its boxes and ignored boxes."""
        rows = self.sets[self.rng.integers(len(self.sets))][0]
        return rows[self.rng.integers(len(rows))]

    def person(self):
        """Returns a picture, its boxes and ignored boxes, and one of the boxes."""
        rows, people = self.sets[self.rng.integers(len(self.sets))]
        k, i = people[self.rng.integers(len(people))]
        return *rows[k], rows[k][1][i]


def height(rng):
    return float(np.exp(rng.uniform(np.log(LOW), np.log(HIGH))))


def gradients(picture, box, mirror):
    """Returns the features of the window round a box."""
    middle, zoom = box[:2] + box[2:] / 2, PERSON / box[3]
    return HOG.compute(crop(picture, middle, zoom, WINDOW, mirror)[0]).ravel()


def fit_svm(x, y, cost=0.02):
    """Returns weights and bias of a linear SVM with squared hinge loss (Fan et al. 2008); y: 1 or -1."""
    x, y = torch.from_numpy(x), torch.from_numpy(y)
    w = torch.zeros(x.shape[1] + 1, requires_grad=True)
    solver = torch.optim.LBFGS([w], max_iter=80, line_search_fn="strong_wolfe")
    share = torch.where(y > 0, 0.5 / (y > 0).sum(), 0.5 / (y < 0).sum()) * len(y)

    def loss():
        solver.zero_grad()
        value = w[:-1].square().sum() / 2 + cost * (share * (1 - y * (x @ w[:-1] + w[-1])).relu().square()).sum()
        value.backward()
        return value

    solver.step(loss)
    return w.detach().numpy()


def windows(picture, weights, shape, least):
    """Returns the boxes (N, 5) of a picture at which the SVM's score is above `least`."""
    HOG.setSVMDetector(weights)
    zoom = PERSON / LOW
    found, scores = HOG.detectMultiScale(
        cv2.resize(picture, None, fx=zoom, fy=zoom), hitThreshold=least, winStride=(4, 4), scale=1.12, groupThreshold=0
    )
    if not len(found):
        return np.zeros((0, 5))
    tall = found[:, 3] * PERSON / WINDOW[1] / zoom
    middle = (found[:, :2] + found[:, 2:] / 2) / zoom
    boxes = np.column_stack([middle[:, 0] - tall * shape / 2, middle[:, 1] - tall / 2, tall * shape, tall])
    return best(boxes[tall <= HIGH], scores.ravel()[tall <= HIGH])


def train_hog(pictures):
    """Returns a function from a picture to boxes and scores (N, 5)."""
    rng = pictures.rng
    sizes = np.concatenate([boxes for rows, _ in pictures.sets for _, boxes, _ in rows])
    shape = float(np.median(sizes[:, 2] / sizes[:, 3]))
    x, n = [], NEGATIVES
    for _ in range(POSITIVES):
        picture, _, _, box = pictures.person()
        box = box + box[3] * np.append(rng.normal(0, 0.02, 3), 0) * [1, 1, 0, 0]
        x.append(gradients(picture, box, rng.random() < 0.5))
    while len(x) < POSITIVES + n:
        picture, boxes, ignored, tall = *pictures.picture(), height(rng)
        box = np.append(rng.uniform([0, 0], picture.shape[1::-1]), [tall * shape, tall])
        if not any((overlap(known, box) > 0.3).any() for known in (boxes, ignored)):
            x.append(gradients(picture, box, False))
    weights = fit_svm(np.array(x), np.repeat(np.float32([1, -1]), [POSITIVES, n]))
    for _ in range(2):
        for _ in range(SEARCHED):
            picture, boxes, ignored = pictures.picture()
            rows = windows(picture, weights, shape, -0.7)[: n // SEARCHED, :4]
            far = [r for r in rows if not any((overlap(known, r) > 0.3).any() for known in (boxes, ignored))]
            x += [gradients(picture, row, False) for row in far]
        weights = fit_svm(np.array(x), np.repeat(np.float32([1, -1]), [POSITIVES, len(x) - POSITIVES]))
    return lambda picture: windows(picture, weights, shape, -1.0)


def block(a, b, stride=1):
    return nn.Sequential(nn.Conv2d(a, b, 3, stride, 1, bias=False), nn.GroupNorm(8, b), nn.ReLU())


class Net(nn.Module):
    """Heat of centres, offset and logarithm of the size of the box for each cell of a picture: (B, 5, H / 4, W / 4)."""

    def __init__(self):
        super().__init__()
        self.near = nn.Sequential(block(3, 16, 2), block(16, 32, 2), block(32, 32))
        self.far = nn.Sequential(block(32, 64, 2), block(64, 64), block(64, 64))
        self.head = nn.Sequential(block(96, 48), nn.Conv2d(48, 5, 1))
        self.head[1].bias.data[:] = torch.tensor([-4.0, 0, 0, 2.8, 4.0])

    def forward(self, x):
        x = (x - x.mean((2, 3), keepdim=True)) / (x.std((1, 2, 3), keepdim=True) + 1e-3)
        near = self.near(x)
        far = functional.interpolate(self.far(near), size=near.shape[2:], mode="nearest")
        return self.head(torch.cat([near, far], 1))


def sample(pictures):
    """Returns a crop (H, W, 3), its heat (h, w), weight of the heat, size targets (4, h, w) and where they count."""
    rng = pictures.rng
    picture, boxes, ignored, box = pictures.person()
    if rng.random() < 0.25:
        picture, boxes, ignored = pictures.picture()
        middle, zoom = rng.uniform([0, 0], picture.shape[1::-1]), rng.uniform(0.8, 1.6) * ZOOM
    else:
        middle = box[:2] + box[2:] / 2
        zoom = height(rng) * ZOOM / box[3]
        middle = middle + rng.uniform(-0.4, 0.4, 2) * CROP / zoom
    part, to = crop(picture, middle, zoom, (CROP, CROP), rng.random() < 0.5)
    part = part * rng.uniform(0.7, 1.3, 3) + rng.normal(0, rng.uniform(0, 8), part.shape)
    cells = CROP // CELL
    at = np.arange(cells)
    heat, weight = np.zeros((cells, cells)), np.ones((cells, cells))
    target, there = np.zeros((4, cells, cells)), np.zeros((cells, cells))
    for left, top, wide, tall in ignored:
        (x, y), (w, h) = to[:, :2] @ [left + wide / 2, top + tall / 2] + to[:, 2], (wide * zoom, tall * zoom)
        inside = (np.abs(at - x / CELL) < w / 2 / CELL + 1) & (np.abs(at - y / CELL) < h / 2 / CELL + 1)[:, None]
        weight[inside] = 0
    for left, top, wide, tall in boxes:
        (x, y), (w, h) = to[:, :2] @ [left + wide / 2, top + tall / 2] + to[:, 2], (wide * zoom, tall * zoom)
        i, j = int(x // CELL), int(y // CELL)
        if 0 <= i < cells and 0 <= j < cells:
            spread = np.maximum([w / CELL / 6, h / CELL / 10], 0.5)
            peak = np.exp(-(((at - i) / spread[0]) ** 2) / 2 - (((at - j) / spread[1]) ** 2)[:, None] / 2)
            heat = np.maximum(heat, peak)
            here = (np.abs(at - i) < 2) & (np.abs(at - j) < 2)[:, None]
            rows, columns = np.nonzero(here)
            size = np.full((2, len(rows)), np.log([[w], [h]]))
            target[:, here] = np.concatenate([[x / CELL - columns, y / CELL - rows], size])
            there[here] = weight[j, i] = 1
    return part, heat, weight, target, there


def train_cnn(pictures):
    """Returns a function from a picture to boxes and scores (N, 5)."""
    torch.manual_seed(int(pictures.rng.integers(2**31)))
    net = Net()
    solver = torch.optim.AdamW(net.parameters(), 3e-3, weight_decay=1e-3)
    pace = torch.optim.lr_scheduler.OneCycleLR(solver, 4e-3, STEPS, pct_start=0.15)
    for _ in range(STEPS):
        parts = [torch.from_numpy(np.array(a, np.float32)) for a in zip(*(sample(pictures) for _ in range(BATCH)))]
        x, heat, weight, target, there = parts
        out = net(x.permute(0, 3, 1, 2))
        p = out[:, 0].sigmoid().clamp(1e-4, 1 - 1e-4)
        cost = -torch.where(heat == 1, (1 - p) ** 2 * p.log(), (1 - heat) ** 4 * p**2 * (1 - p).log())
        size = ((out[:, 1:] - target).abs().sum(1) * there).sum() / there.sum().clamp(min=1)
        loss = (weight * cost).sum() / (heat == 1).sum().clamp(min=1) + size
        solver.zero_grad()
        loss.backward()
        solver.step()
        pace.step()
    return lambda picture: centres(net.eval(), picture)


@torch.no_grad()
def centres(net, picture):
    """Returns the boxes and scores (N, 5) of a picture."""
    large = cv2.resize(picture, None, fx=ZOOM, fy=ZOOM)
    out = net(torch.from_numpy(large).float().permute(2, 0, 1)[None])
    heat = out[:, :1].sigmoid()
    peak = (heat[0, 0] > 0.02) & (heat == functional.max_pool2d(heat, 3, 1, 1))[0, 0]
    j, i = (one.numpy() for one in torch.where(peak))
    x, y, w, h = out[0, 1:, j, i].numpy().astype(float)
    middle, size = np.column_stack([i + x, j + y]) * CELL / ZOOM, np.exp(np.column_stack([w, h])) / ZOOM
    return best(np.column_stack([middle - size / 2, size]), heat[0, 0, j, i].numpy())


TRAIN = {"hog": train_hog, "cnn": train_cnn}


def main():
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    with open(sys.argv[1]) as file:
        given = json.load(file)
    test, found = [cv2.imread(file) for file in given["test"]], {}
    for k, job in enumerate(given["jobs"]):
        start = time.process_time()
        finder = TRAIN[job["detector"]](Pictures(job["sets"], np.random.default_rng(job["seed"])))
        between = time.process_time()
        rows = [(n, *row) for n, picture in enumerate(test) for row in finder(picture)]
        found[str(k)] = np.reshape(rows, (-1, 6))
        print(f"{job['detector']} {k}: {between - start:.0f} + {time.process_time() - between:.0f} s", file=sys.stderr)
    np.savez(sys.argv[2], **found)


if __name__ == "__main__":
    main()
