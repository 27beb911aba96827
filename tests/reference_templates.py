"""Templates over a mask the slow way: every pixel of every ellipse asked one by one, every move painted anew."""

from __future__ import annotations

import numpy as np

from tracking.papers.blob import new_people_kernels, person_template
from tracking.papers.blob import person_look_kernels as looks
from tracking.papers.blob.person_template_kernels import BARE, ELLIPSE, EXPLAINED, LEAST_INSIDE
from tracking.papers.blob.person_template_search_kernels import FINE_STEPS, MOST_STEPS, STEPS_PER_HEIGHT, SWEEPS


def pixels(shape, x, foot, h, w):
    """(H, W) pixels whose middle lies in the ellipse that fills the box of h x w px on (x, foot)."""
    v, u = np.mgrid[: shape[0], : shape[1]] + 0.5
    return (2 * (u - x) / w) ** 2 + (2 * (v - foot) / h + 1) ** 2 <= 1


def painted(shape, templates):
    """(H, W) how many templates lie over each pixel."""
    return np.sum([pixels(shape, *t) for t in templates], 0, dtype=np.int16) + np.zeros(shape, np.int16)


def area(shape, template):
    """px of a template inside the image, by its box."""
    x, foot, h, w = template
    across, down = min(x + w / 2, shape[1]) - max(x - w / 2, 0), min(foot, shape[0]) - max(foot - h, 0)
    return ELLIPSE * h * w * max(max(across / w, 0) * max(down / h, 0), LEAST_INSIDE)


def worth(foreground, cover, template):
    """Foreground pixels of a template that nothing covers, less half of such background pixels."""
    gain = np.where(foreground, 1.0, -0.5)
    return float(gain[pixels(gain.shape, *template) & (cover == 0)].sum())


def moved(foreground, cover, template, steps, step):
    """The same for the template moved by -steps..steps times step, rows down, columns right."""
    offset = step * np.arange(-steps, steps + 1)
    return np.array([[worth(foreground, cover, np.add(template, (a, b, 0, 0))) for a in offset] for b in offset])


def near_first(templates):
    return np.argsort(-np.asarray(templates)[:, 1], kind="stable")


def settle(foreground, cover, templates, spread, evidence):
    """(K, 4) each in turn, low feet first, to the place of largest evidence * support - d^2 / 2; nothing is painted."""
    found = templates.copy()
    for sweep in range(SWEEPS):
        before = found.copy()
        for k in near_first(templates):
            others = cover + painted(cover.shape, np.delete(found, k, 0))
            found[k] = better(foreground, others, found[k], templates[k], spread[k], evidence, sweep > 0)
        if np.array_equal(found, before):
            break
    return found


def better(foreground, cover, at, expected, spread, evidence, fine):
    """The best place round `at` of one template, on a coarse or a fine grid; `at` where nothing is better."""
    step = max(at[2] / STEPS_PER_HEIGHT, 1.0) / (2 if fine else 1)
    steps = FINE_STEPS if fine else int(np.clip(np.ceil(2.5 * max(spread) / step), FINE_STEPS, MOST_STEPS))
    offset = step * np.arange(-steps, steps + 1)
    away = ((at[:2] - expected[:2])[:, None] + offset) / spread[:, None]
    value = evidence * moved(foreground, cover, at, steps, step) / area(cover.shape, at)
    value = value - (away[0] ** 2 + away[1][:, None] ** 2) / 2
    if value.max() <= value[steps, steps]:
        return at
    i, j = np.unravel_index(value.argmax(), value.shape)
    return at + np.array([offset[j], offset[i], 0.0, 0.0])


def alone(foreground, cover, templates):
    """(K,) support of templates among the others, over what `cover` explains already."""
    return np.array(
        [
            worth(foreground, cover + painted(cover.shape, np.delete(templates, k, 0)), t) / area(cover.shape, t)
            for k, t in enumerate(templates)
        ]
    )


def pieces(foreground, cover, templates):
    """(K,) share of foreground in the pixels that no other template covers; 0 if these are few."""
    found = np.zeros(len(templates))
    for k, t in enumerate(templates):
        own = pixels(cover.shape, *t) & (cover + painted(cover.shape, np.delete(templates, k, 0)) == 0)
        if own.sum() >= BARE * area(cover.shape, t):
            found[k] = foreground[own].mean()
    return found


def prune(foreground, cover, templates, least, by_pieces):
    """Rows that have `least` when the others are taken away, the weakest first."""
    rows = np.arange(len(templates))
    while len(rows):
        value = (pieces if by_pieces else alone)(foreground, cover, templates[rows])
        if value.min() >= least:
            break
        rows = np.delete(rows, value.argmin())
    return rows


def shown(cover, templates):
    """(K,) share of each template that none with a lower foot, and nothing explained, covers."""
    hidden, share = cover >= EXPLAINED, np.zeros(len(templates))
    for k in near_first(templates):
        own = pixels(cover.shape, *templates[k])
        share[k] = min((own & ~hidden).sum() / area(cover.shape, templates[k]), 1.0)
        hidden = hidden | own
    return share


def enter(foreground, cover, guesses, person, support):
    """The templates that explain most for their number, out of a list of guesses for 1, 2, ... newcomers."""
    best, most = np.zeros((0, 4)), 0.0
    for guess in guesses:
        spread = np.maximum(person_template.ROAM * guess[:, 2:3], 1.0) * np.ones(2)
        at = settle(foreground, cover, guess, spread, new_people_kernels.EVIDENCE)
        union = (painted(cover.shape, at) > 0) & (cover == 0)
        value = np.where(foreground, 1.0, -0.5)[union].sum() / person - len(guess) * support
        if value > most and alone(foreground, cover, at).min() >= support:
            best, most = at, value
    return best


def guesses(region, most, size):
    """Templates side by side over a region's (H, W) pixels, each with as many, standing where these end."""
    rows, columns = np.nonzero(region)
    order, found = np.argsort(columns, kind="stable"), []
    for count in range(1, most + 1):
        parts = np.array_split(order, count)
        foot = np.array([[columns[p].mean() + 0.5, np.quantile(rows[p], 0.98) + 1] for p in parts])
        found.append(np.column_stack([foot, size.at(foot)]))
    return found


def points(template):
    """(POINTS, 2) x, y of the points of a template: rows from the top, each as wide as the ellipse."""
    x, foot, h, w = template
    down = (np.arange(looks.ROWS) + 0.5) / looks.ROWS
    aside = (2 * np.arange(looks.COLUMNS) + 1) / looks.COLUMNS - 1
    half = w / 2 * np.sqrt(1 - (2 * down - 1) ** 2)
    u = x + half[:, None] * aside
    return np.column_stack([u.ravel(), np.repeat(foot - h + down * h, looks.COLUMNS)])


def seen_at(cover, templates, k, template):
    """Row and column, -1 if the point is outside or hidden, of template k's points when it is at `template`."""
    order = near_first(templates).tolist()
    front = templates[order[: order.index(k)]]
    hidden = (cover >= EXPLAINED) | (painted(cover.shape, front) > 0)
    column, row = np.floor(points(template)).astype(int).T
    inside = (row >= 0) & (row < cover.shape[0]) & (column >= 0) & (column < cover.shape[1])
    inside[inside] = ~hidden[row[inside], column[inside]]
    return np.where(inside, row, -1), np.where(inside, column, -1)


def fits(image, cover, templates, k, look, steps, step):
    """The fit of a look at each place of a grid round template k, rows down, columns right."""
    offset, found = step * np.arange(-steps, steps + 1), []
    var = np.clip(look[:, 3], looks.LEAST_VAR, looks.ANY_VAR)
    for b in offset:
        for a in offset:
            row, column = seen_at(cover, templates, k, np.add(templates[k], (a, b, 0, 0)))
            away = np.square(image[row, column].astype(float) - look[:, :3]).sum(1)
            ratio = np.maximum(-away / (2 * var) - 1.5 * np.log(var / looks.ANY_VAR), looks.WORST_FIT)
            found.append(ratio[(row >= 0) & (look[:, 4] >= looks.LEAST_SEEN)].sum() / looks.POINTS)
    return np.reshape(found, (len(offset), len(offset)))
