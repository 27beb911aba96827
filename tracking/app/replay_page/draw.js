// Colours, shapes, labels and trails that plan, image and whole groups share.

const TRAIL_SECONDS = 3;
const NARROW = 560; // px: panes of a narrower canvas stand one above the other
const darkQuery = matchMedia("(prefers-color-scheme: dark)");
// Colour-blind readers can tell them apart; their contrast to the background is 3 : 1 or more.
const COLOURS = {
  light: ["#0072b2", "#b84a00", "#00805e", "#a33a7a", "#6a51a3", "#8a6d00", "#b2182b", "#20708c", "#4d7c0f", "#7a4a2a"],
  dark: ["#56b4e9", "#f0963c", "#2fc79a", "#e58fc0", "#b3a1f0", "#e0c341", "#ff7b72", "#7fd4e8", "#a3d15c", "#d6a07a"],
};
const THEMES = {
  light: { ground: "#fbfcfd", grid: "#e6eaee", wall: "#2d333b", thing: "#656d76", floor: "#eef1f4", ink: "#1b1f24", halo: "#ffffff", alone: "#656d76", found: "#1b1f24", error: "#d1242f" },
  dark: { ground: "#12171d", grid: "#232b34", wall: "#c5ccd4", thing: "#8b949e", floor: "#1d242c", ink: "#e8ecf1", halo: "#0f1318", alone: "#8b949e", found: "#e8ecf1", error: "#ff6b5e" },
};
let theme = THEMES.light, palette = COLOURS.light;

function chooseTheme() {
  const key = darkQuery.matches ? "dark" : "light";
  theme = THEMES[key];
  palette = COLOURS[key];
}

function colourOf(id) {
  return id < 0 ? theme.alone : palette[id % palette.length];
}

function rowColour(side, row, by) {
  return colourOf(by === "group" ? side.group[row] : side.id[row]);
}

// Convex hull of [x, y] points, in the order that canvas arcs take as increasing angle.
function convexHull(points) {
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  if (sorted.length < 3) return sorted;
  const half = list => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], p) <= 0) chain.pop();
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

function turn(a, b, c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Makes the hull of discs of radius r round the points the current path.
function roundedPath(ctx, points, r) {
  const hull = convexHull(points), n = hull.length;
  ctx.beginPath();
  if (n < 2) {
    if (n) ctx.arc(hull[0][0], hull[0][1], r, 0, 2 * Math.PI);
    return;
  }
  const out = (p, q) => Math.atan2(p[0] - q[0], q[1] - p[1]);
  for (let k = 0; k < n; k++) {
    const before = hull[(k + n - 1) % n], here = hull[k], after = hull[(k + 1) % n];
    ctx.arc(here[0], here[1], r, out(before, here), out(here, after));
  }
  ctx.closePath();
}

function polygonPath(ctx, points) {
  ctx.beginPath();
  points.forEach((p, k) => (k ? ctx.lineTo(p[0], p[1]) : ctx.moveTo(p[0], p[1])));
  ctx.closePath();
}

function strokeLine(ctx, points) {
  ctx.beginPath();
  points.forEach((p, k) => (k ? ctx.lineTo(p[0], p[1]) : ctx.moveTo(p[0], p[1])));
  ctx.stroke();
}

function font(bold, slanted) {
  return `${slanted ? "italic " : ""}${bold ? "700 13px" : "600 11px"} system-ui, sans-serif`;
}

function label(ctx, text, x, y, colour, bold, slanted) {
  ctx.font = font(bold, slanted);
  ctx.textAlign = "center";
  ctx.lineJoin = "round";
  ctx.lineWidth = 3;
  ctx.strokeStyle = theme.halo;
  ctx.setLineDash([]);
  ctx.strokeText(text, x, y);
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}

// Writes a label inside a pane at one of several centres, the preferred first: the one that covers least of the boxes in
// `pane.taken`. spots: takes the label's half width and half height and returns the centres.
function placeLabel(pane, text, spots, colour, slanted, bold) {
  const { ctx, taken, width, height } = pane;
  ctx.font = font(bold, slanted);
  const half = [ctx.measureText(text).width / 2 + 1, bold ? 7 : 6];
  let best = null, least = Infinity;
  for (const spot of spots(half)) {
    const x = clampTo(spot[0], half[0], width), y = clampTo(spot[1], half[1], height);
    const box = [x - half[0], y - half[1], x + half[0], y + half[1]];
    const covered = taken.reduce((sum, other) => sum + overlapArea(box, other), 0);
    if (covered < least) [best, least] = [box, covered];
    if (!least) break;
  }
  taken.push(best);
  label(ctx, text, best[0] + half[0], best[3] - 2, colour, bold, slanted);
}

// The centres for the label of a hull: in its middle x or beside that, at one end y of the hull, else at the other.
function hullSpots(x, ends) {
  return ([w]) => ends.flatMap(y => [[x, y], [x + 2 * w, y], [x - 2 * w, y]]);
}

// The coordinate nearest to x at which something of half width w lies inside 0 to width.
function clampTo(x, w, width) {
  return Math.min(Math.max(x, w), width - w);
}

// Whether a pane shows something of what has these corners.
function shownIn({ width, height }, points) {
  const us = points.map(p => p[0]), vs = points.map(p => p[1]);
  return Math.max(...us) >= 0 && Math.min(...us) <= width && Math.max(...vs) >= 0 && Math.min(...vs) <= height;
}

function overlapArea(a, b) {
  return Math.max(Math.min(a[2], b[2]) - Math.max(a[0], b[0]), 0) * Math.max(Math.min(a[3], b[3]) - Math.max(a[1], b[1]), 0);
}

// Fills and outlines the current path as the region of a group: dashed if tracked, solid if true.
function drawRegion(ctx, colour, tracked, rimmed) {
  ctx.globalAlpha = tracked ? 0.06 : 0.14;
  ctx.fillStyle = colour;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.setLineDash(tracked ? [7, 5] : []);
  ctx.lineWidth = tracked ? 2.2 : 1.6;
  if (rimmed) strokeRim(ctx);
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.setLineDash([]);
}

// Strokes a light edge under the current path, so that colours stand out on pictures.
function strokeRim(ctx) {
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth += 2;
  ctx.stroke();
  ctx.lineWidth -= 2;
}

// Where each person or group of a side was during the last TRAIL_SECONDS. map: x, y to px.
function drawTrails(pane, side, map) {
  const { ctx } = pane, reach = Math.round(TRAIL_SECONDS * data.fps), { tracked } = side;
  ctx.lineCap = "round";
  ctx.lineWidth = tracked ? 1.4 : 2;
  ctx.setLineDash(tracked ? [3, 4] : []);
  ctx.globalAlpha = 0.6;
  for (const row of side.rows(pane.frame)) {
    const points = [];
    for (let k = Math.max(side.first[row], row - reach); k <= row; k++) points.push(map(side.x[k], side.y[k]));
    ctx.strokeStyle = rowColour(side, row, pane.options.by);
    strokeLine(ctx, points.filter(Boolean));
  }
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}

// Sizes the canvas to its place on the page; returns its context, width and height in CSS px.
function prepareCanvas(canvas, aspect) {
  const width = canvas.clientWidth, height = Math.max(Math.round(width * aspect), 60), dpr = devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * dpr) || canvas.height !== Math.round(height * dpr)) {
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * dpr);
    canvas.height = Math.round(height * dpr);
  }
  const ctx = canvas.getContext("2d");
  ctx.setTransform(dpr, 0, 0, dpr, 0, 0);
  ctx.clearRect(0, 0, width, height);
  return [ctx, width, height];
}

// The sides of each pane: all in one pane, or one pane per side if two sides are shown side by side. Two trackers are
// both shown with the truth.
function splitPanes(shown, beside) {
  if (!beside || shown.length < 2) return [shown];
  const runs = shown.filter(side => side.tracked);
  return runs.length > 1 ? runs.map(run => [...shown.filter(side => !side.tracked), run]) : shown.map(side => [side]);
}

function paneTitle(parts, shown) {
  if (parts.length < 2) return "";
  return other ? shown[shown.length - 1].word : shown[0].name;
}

// Divides a canvas into panes: side by side, on a narrow page one above the other. aspect: of a pane. draw is called for
// each pane with its number and size.
function drawPanes(canvas, count, aspect, draw) {
  const down = count > 1 && canvas.clientWidth < NARROW, across = down ? 1 : count;
  const [ctx, width, height] = prepareCanvas(canvas, aspect * (down ? count : 1 / count));
  const w = width / across, h = height / (down ? count : 1);
  for (let k = 0; k < count; k++) draw(k, ctx, down ? 0 : k * w, down ? k * h : 0, w, h);
}

// The dearest errors of a side that are shown at a frame, each at least for a second; at most two.
function errorsAt(side, frame) {
  return data.errors
    .filter(error => error.side === side.name && error.start <= frame && frame <= Math.max(error.end, error.start + data.fps))
    .sort((a, b) => (b.cost || 0) - (a.cost || 0) || b.start - a.start).slice(0, 2);
}

// Draws a line round the people, or the ghost, of each error of the shown tracks. reach: the points in px of [side, row]
// that the line goes round, at a distance of r px.
function drawErrorsHere({ ctx, frame }, shown, r, reach) {
  ctx.strokeStyle = theme.error;
  ctx.lineWidth = 3;
  for (const run of shown.filter(side => side.tracked)) for (const { people, after } of errorsAt(run, frame)) {
    const side = people.length ? shown.find(one => !one.tracked) : run, ids = people.length ? people : [after];
    const points = side ? [...side.rows(frame)].filter(row => ids.includes(side.id[row])).flatMap(row => reach(side, row)) : [];
    roundedPath(ctx, points.filter(p => !Number.isNaN(p[0])), r);
    ctx.stroke();
  }
}

// Draws a pane and its title. draw: takes the list of boxes that labels keep clear of, which is that of the title.
function inPane(ctx, x, y, width, height, title, draw) {
  ctx.save();
  ctx.beginPath();
  ctx.rect(x, y, width, height);
  ctx.clip();
  ctx.translate(x, y);
  ctx.font = font(true);
  const wide = ctx.measureText(title).width;
  draw(title ? [[0, 0, wide + 16, 26]] : []);
  if (title) {
    label(ctx, title, 10 + wide / 2, 19, theme.ink, true);
    ctx.fillStyle = theme.thing;
    ctx.fillRect(x ? 0 : width - 1, 0, 1, height);
  }
  ctx.restore();
}
