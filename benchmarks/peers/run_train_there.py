"""Boxes that two detectors of people find after training on given pictures; for an environment of its own.

usage: python run_train_there.py JOBS.json FOUND.npz
JOBS: {"test": [file…], "jobs": [{"detector": "hog" | "cnn", "seed", "sets": [[{"file", "boxes", "ignored"}…]…]}…]}
Boxes are left, top, width, height, px. Writes for job k an array "k" (N, 6): number of the test picture, box, score.

hog: histograms of oriented gradients and a linear SVM (Dalal and Triggs 2005), windows of 32 x 64 px in which a person
is 48 px high, negatives found in three rounds; boxes have the median shape of those it was trained on. cnn: a fully
convolutional net of 140,000 weights, which says for each cell of 4 px how likely it holds the middle of a box, and the
box (Zhou et al. 2019, CenterNet). Both look for people of 24 to 96 px. Each sample is a crop round a person, zoomed so
that the height is drawn from this range, or round another place, mirrored or not. The sets of a job give equally many.
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
WINDOW, PERSON = (32, 64), 48.0  # px
HOG = cv2.HOGDescriptor(WINDOW, (8, 8), (4, 4), (4, 4), 9)
POSITIVES, NEGATIVES, SEARCHED = 2000, 3000, 30  # windows, windows of each round, pictures of each round
ZOOM, CROP, CELL, BATCH, STEPS = 1.5, 192, 4, 8, 600  # the net sees pictures ZOOM times as large


def best(boxes, scores):
    """Returns rows (N, 5) of at most 100 boxes and scores, without those that a better one overlaps by 0.45."""
    kept = list(cv2.dnn.NMSBoxes(boxes.tolist(), (scores + 9).tolist(), 0, 0.45))[:100]
    return np.column_stack([boxes, scores])[kept].reshape(-1, 5)


def overlap(boxes, box):
    """Returns the intersection over union (N,) of boxes (N, 4) with a box."""
    sides = np.minimum(boxes[:, :2] + boxes[:, 2:], box[:2] + box[2:]) - np.maximum(boxes[:, :2], box[:2])
    shared = np.prod(np.maximum(sides, 0), axis=1)
    return shared / (np.prod(boxes[:, 2:], axis=1) + box[2] * box[3] - shared)


def crop(picture, middle, zoom, size, mirror):
    """Returns the part (H, W, 3) of a picture round a place, and the matrix (2, 3) that maps into it."""
    side = -zoom if mirror else zoom
    to = np.array([[side, 0, size[0] / 2 - side * middle[0]], [0, zoom, size[1] / 2 - zoom * middle[1]]])
    return cv2.warpAffine(picture, to, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101), to


class Pictures:
    """Pictures of the sets of a job, each with boxes and ignored boxes (N, 4), from which samples are drawn."""

    def __init__(self, sets, rng):
        def read(p):
            return cv2.imread(p["file"]), np.reshape(p["boxes"], (-1, 4)), np.reshape(p["ignored"], (-1, 4))

        self.rng, self.sets = rng, [[read(p) for p in one] for one in sets]
        people = ([(*row, box) for row in one for box in row[1]] for one in self.sets)
        self.people = [one for one in people if one]

    def drawn(self, sets):
        """Returns an entry of one of the sets."""
        one = sets[self.rng.integers(len(sets))]
        return one[self.rng.integers(len(one))]

    def height(self):
        """Returns a height of people, px."""
        return float(np.exp(self.rng.uniform(np.log(LOW), np.log(HIGH))))


def fit_svm(x, cost=0.02):
    """Returns weights and bias of a linear SVM with squared hinge loss; both classes weigh the same."""
    x, y = torch.from_numpy(np.array(x)), torch.ones(len(x))
    y[POSITIVES:] = -1
    share = torch.where(y > 0, 0.5 / (y > 0).sum(), 0.5 / (y < 0).sum()) * len(y)
    w = torch.zeros(x.shape[1] + 1, requires_grad=True)
    solver = torch.optim.LBFGS([w], max_iter=80, line_search_fn="strong_wolfe")

    def loss():
        solver.zero_grad()
        value = w[:-1].square().sum() / 2 + cost * (share * (1 - y * (x @ w[:-1] + w[-1])).relu().square()).sum()
        value.backward()
        return value

    solver.step(loss)
    return w.detach().numpy()


def windows(picture, weights, shape, least):
    """Returns the boxes and scores (N, 5) of a picture whose score is above `least`; shape: width / height."""
    HOG.setSVMDetector(weights)
    large = cv2.resize(picture, None, fx=PERSON / LOW, fy=PERSON / LOW)
    found, scores = HOG.detectMultiScale(large, hitThreshold=least, winStride=(4, 4), scale=1.12, groupThreshold=0)
    found = np.reshape(found, (-1, 4)) * LOW / PERSON
    tall = found[:, 3:] * PERSON / WINDOW[1]
    size = tall * [shape, 1]
    boxes, low = np.column_stack([found[:, :2] + found[:, 2:] / 2 - size / 2, size]), tall[:, 0] <= HIGH
    return best(boxes[low], np.reshape(scores, -1)[low])


def train_hog(pictures):
    """Returns a function from a picture to boxes and scores (N, 5)."""
    rng, x = pictures.rng, []
    shape = float(np.median([box[2] / box[3] for one in pictures.people for *_, box in one]))

    def add(picture, box, *others, mirror=False):
        """Adds the features of the window round a box that overlaps none of the others by 0.3."""
        if not any((overlap(other, box) > 0.3).any() for other in others):
            x.append(HOG.compute(crop(picture, box[:2] + box[2:] / 2, PERSON / box[3], WINDOW, mirror)[0]).ravel())

    for _ in range(POSITIVES):
        picture, _, _, box = pictures.drawn(pictures.people)
        add(picture, box + box[3] * np.append(rng.normal(0, 0.02, 2), [0, 0]), mirror=rng.random() < 0.5)
    while len(x) < POSITIVES + NEGATIVES:
        picture, *others = pictures.drawn(pictures.sets)
        tall = pictures.height()
        add(picture, np.append(rng.uniform([0, 0], picture.shape[1::-1]), [tall * shape, tall]), *others)
    weights = fit_svm(x)
    for _ in range(2):
        for picture, *others in [pictures.drawn(pictures.sets) for _ in range(SEARCHED)]:
            for found in windows(picture, weights, shape, -0.7)[: NEGATIVES // SEARCHED]:
                add(picture, found[:4], *others)
        weights = fit_svm(x)
    return lambda picture: windows(picture, weights, shape, -1.0)


def block(a, b, stride=1, apart=1):
    """Returns a layer from a to b channels, whose taps are so many cells apart."""
    layer = nn.Conv2d(a, b, 3, stride, apart, apart, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(b), nn.ReLU())


class Net(nn.Module):
    """For each cell of pictures (B, 3, H, W): logit that it holds a middle, place of the middle in cells from the
    cell's corner, and logarithm of the size in px, of the box: (B, 5, H / 4, W / 4)."""

    def __init__(self):
        super().__init__()
        self.near = nn.Sequential(block(3, 16, 2), block(16, 32, 2), block(32, 32))
        self.far = nn.Sequential(block(32, 64, 2), block(64, 64, 1, 2), block(64, 64, 1, 3))  # sees 111 px
        self.head = nn.Sequential(block(96, 32), nn.Conv2d(32, 5, 1))
        self.head[1].bias.data[:] = torch.tensor([-4.0, 0, 0, 2.8, 4.0])

    def forward(self, x):  # noqa: D102
        near = self.near((x - 112) / 64)
        far = functional.interpolate(self.far(near), size=near.shape[2:])
        return self.head(torch.cat([near, far], 1))


def sample(pictures):
    """Returns a crop, and by cell: heat of middles, its weight, boxes (4, h, w) as of Net, where they count."""
    rng = pictures.rng
    picture, boxes, ignored, box = pictures.drawn(pictures.people)
    zoom = pictures.height() * ZOOM / box[3]
    middle = box[:2] + box[2:] / 2 + rng.uniform(-0.4, 0.4, 2) * CROP / zoom
    if rng.random() < 0.25:
        picture, boxes, ignored = pictures.drawn(pictures.sets)
        middle, zoom = rng.uniform([0, 0], picture.shape[1::-1]), rng.uniform(0.8, 1.6) * ZOOM
    part, to = crop(picture, middle, zoom, (CROP, CROP), rng.random() < 0.5)
    part = part * rng.uniform(0.7, 1.3, 3) + rng.normal(0, rng.uniform(0, 8), part.shape)
    y, x = np.mgrid[: CROP // CELL, : CROP // CELL]
    heat, weight, there, target = np.zeros(x.shape), np.ones(x.shape), np.zeros(x.shape), np.zeros((4, *x.shape))
    for k, box in enumerate([*ignored, *boxes]):
        (u, v), (w, h) = (to[:, :2] @ (box[:2] + box[2:] / 2) + to[:, 2]) / CELL, box[2:] * zoom / CELL
        if k < len(ignored):
            weight[(np.abs(x - u) < w / 2 + 1) & (np.abs(y - v) < h / 2 + 1)] = 0
            continue
        across, down = x - np.floor(u), y - np.floor(v)
        heat = np.maximum(heat, np.exp(-((across / max(w / 6, 0.5)) ** 2) / 2 - (down / max(h / 10, 0.5)) ** 2 / 2))
        here = (np.abs(across) < 2) & (np.abs(down) < 2)
        sides = np.full((2, here.sum()), np.log([[w * CELL], [h * CELL]]))
        target[:, here] = np.concatenate([[u - x[here], v - y[here]], sides])
        weight[here] = there[here] = 1
    return part, heat, weight, target, there


def misfit(found, true):
    """Returns 1 - intersection over union + distance of the middles as a share of the height; boxes as of Net."""
    far = (found[:, :2] - true[:, :2]).abs() * CELL
    a, b = found[:, 2:].exp(), true[:, 2:].exp()
    shared = torch.minimum(torch.minimum(a, b), (a + b) / 2 - far).clamp(min=0).prod(1)
    return 1 - shared / (a.prod(1) + b.prod(1) - shared) + far.sum(1) / b[:, 1]


def train_cnn(pictures):
    """Returns a function from a picture to boxes and scores (N, 5)."""
    torch.manual_seed(int(pictures.rng.integers(2**31)))
    net = Net()
    solver = torch.optim.AdamW(net.parameters(), weight_decay=1e-3)
    pace = torch.optim.lr_scheduler.OneCycleLR(solver, 4e-3, STEPS, pct_start=0.15)
    for _ in range(STEPS):
        samples = zip(*(sample(pictures) for _ in range(BATCH)), strict=True)
        x, heat, weight, target, there = (torch.from_numpy(np.array(one, np.float32)) for one in samples)
        out = net(x.permute(0, 3, 1, 2))
        p = out[:, 0].sigmoid().clamp(1e-4, 1 - 1e-4)
        cost = -torch.where(heat == 1, (1 - p) ** 2 * p.log(), (1 - heat) ** 4 * p**2 * (1 - p).log())
        loss = (weight * cost).sum() / (heat == 1).sum().clamp(min=1)
        loss = loss + (there * misfit(out[:, 1:], target)).sum() / there.sum().clamp(min=1)
        solver.zero_grad()
        loss.backward()
        solver.step()
        pace.step()
    net.eval()
    return lambda picture: centres(net, picture)


@torch.no_grad()
def centres(net, picture):
    """Returns the boxes and scores (N, 5) of a picture."""
    large = cv2.resize(picture, None, fx=ZOOM, fy=ZOOM)
    out = net(torch.from_numpy(large).float().permute(2, 0, 1)[None])[0]
    heat = out[0].sigmoid()
    j, i = torch.where((heat > 0.02) & (heat == functional.max_pool2d(heat[None], 3, 1, 1)[0]))
    box = out[1:, j, i].T
    middle, size = (torch.stack([i, j], 1) + box[:, :2]) * CELL / ZOOM, box[:, 2:].exp() / ZOOM
    return best(torch.cat([middle - size / 2, size], 1).numpy(), heat[j, i].numpy())


def main():
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    with open(sys.argv[1]) as file:
        given = json.load(file)
    test, found = [cv2.imread(file) for file in given["test"]], {}
    for k, job in enumerate(given["jobs"]):
        train, start = {"hog": train_hog, "cnn": train_cnn}[job["detector"]], time.process_time()
        finder = train(Pictures(job["sets"], np.random.default_rng(job["seed"])))
        rows = [(n, *row) for n, picture in enumerate(test) for row in finder(picture)]
        found[str(k)] = np.reshape(rows, (-1, 6))
        print(f"{job['detector']} {k}: {time.process_time() - start:.0f} s", file=sys.stderr)
    np.savez(sys.argv[2], **found)


if __name__ == "__main__":
    main()
