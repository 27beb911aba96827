// Groups that a tracker follows as wholes: hull, ellipse of its extent, velocity, trail, id and size, on the plan and in
// the image. `map` takes places in the side's plane to px of the pane, or to null where they cannot be seen.

const WIDE = Math.sqrt(9.21); // standard deviations: d'E⁻¹d ≤ 9.21 holds 99 % of a plane's normal distribution
const ROUNDS = 48;

function drawWholes(pane, side, map) {
  if (pane.options.trails) trails(pane, side, map);
  for (const row of side.rows(pane.frame)) {
    const colour = colourOf(side.id[row]);
    if (pane.options.ellipses) extentOf(pane, side, row, map, colour);
    if (pane.options.hulls) wholeHull(pane, side, row, map, colour);
    wayOfWhole(pane, side, row, map, colour);
  }
}

// All of some places as px, or none where one cannot be seen.
function seen(places, map) {
  const points = places.map(([x, y]) => map(x, y));
  return points.every(p => p && !Number.isNaN(p[0])) ? points : [];
}

function hullOf(side, row, map) {
  return seen(side.wholes.hull[row], map);
}

// d'E⁻¹d = 9.21 round a group's place, as a polygon.
function ringOf(side, row, map) {
  const { long, wide, turn } = side.wholes, c = Math.cos(turn[row]), s = Math.sin(turn[row]);
  return seen(Array.from({ length: ROUNDS }, (_, k) => {
    const t = (2 * Math.PI * k) / ROUNDS, a = WIDE * long[row] * Math.cos(t), b = WIDE * wide[row] * Math.sin(t);
    return [side.x[row] + c * a - s * b, side.y[row] + s * a + c * b];
  }), map);
}

function extentOf({ ctx, pictured }, side, row, map, colour) {
  const points = ringOf(side, row, map);
  if (!points.length) return;
  polygonPath(ctx, points);
  extentLine(ctx);
  if (pictured) {
    ctx.lineWidth += 0.6;
    rimPath(ctx);
  }
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.setLineDash([]);
}

function extentLine(ctx) {
  ctx.lineCap = "round";
  ctx.lineWidth = 1.8;
  ctx.setLineDash([0.1, 5]);
}

function wholeHull({ ctx, pictured }, side, row, map, colour) {
  const points = hullOf(side, row, map);
  if (!points.length) return;
  ctx.lineCap = "butt";
  polygonPath(ctx, points);
  region(ctx, colour, true, pictured);
}

// A group's place, and an arrow to where it is in a second.
function wayOfWhole({ ctx, pictured }, side, row, map, colour) {
  const x = side.x[row], y = side.y[row], angle = side.angle[row], speed = side.wholes.speed[row];
  const known = !Number.isNaN(angle) && !Number.isNaN(speed);
  const [at, to] = [map(x, y), known ? map(x + speed * Math.cos(angle), y + speed * Math.sin(angle)) : null];
  if (!at || Number.isNaN(at[0])) return;
  ctx.lineCap = "round";
  ctx.lineWidth = 2;
  ctx.beginPath();
  if (to) arrowPath(ctx, at, to);
  if (pictured) rimPath(ctx);
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.beginPath();
  ctx.arc(...at, 3.2, 0, 2 * Math.PI);
  ctx.lineWidth = 1;
  if (pictured) rimPath(ctx);
  ctx.fillStyle = colour;
  ctx.fill();
}

function arrowPath(ctx, [u, v], [p, q]) {
  const far = Math.hypot(p - u, q - v), angle = Math.atan2(q - v, p - u), head = Math.min(6, far / 2);
  ctx.moveTo(u, v);
  ctx.lineTo(p, q);
  for (const turn of [2.5, -2.5]) {
    ctx.moveTo(p, q);
    ctx.lineTo(p + head * Math.cos(angle + turn), q + head * Math.sin(angle + turn));
  }
}

function wholeWords(side, row) {
  const size = side.wholes.size[row];
  return `T${side.id[row]}${Number.isNaN(size) ? "" : ` ≈${Math.round(size * 10) / 10}`}`;
}

// Ids with sizes under hulls, or beside them where there is more room.
function nameWholes(pane, side, map) {
  const rows = side.rows(pane.frame), { hulls, ellipses } = pane.options;
  if (rows.length > MANY) return;
  for (const row of rows) {
    const shapes = [hulls ? hullOf(side, row, map) : [], hulls || !ellipses ? [] : ringOf(side, row, map)];
    const at = map(side.x[row], side.y[row]);
    if (!at || Number.isNaN(at[0])) continue;
    const points = [...shapes.flat(), [at[0] - 5, at[1] - 5], [at[0] + 5, at[1] + 5]];
    const us = points.map(p => p[0]), vs = points.map(p => p[1]);
    const [left, right, top, bottom] = [Math.min(...us), Math.max(...us), Math.min(...vs), Math.max(...vs)];
    const middle = (left + right) / 2, level = (top + bottom) / 2;
    const spots = ([w, h]) => [
      [middle, bottom + h + 4], [middle, top - h - 4], [right + w + 4, level], [left - w - 4, level],
      [right + w, bottom + h], [left - w, bottom + h], [right + w, top - h], [left - w, top - h],
    ].map(([x, y]) => [within(x, w, pane.width), within(y, h, pane.height)]);
    name(pane.ctx, pane.taken, wholeWords(side, row), spots, colourOf(side.id[row]), false, true);
  }
}

// The place nearest to x at which something of half width w lies inside.
function within(x, w, width) {
  return Math.min(Math.max(x, w), width - w);
}

// What the marks of groups mean; nothing where none are tracked as wholes.
function wholesKey(box) {
  if (!(tracks && tracks.wholes)) return;
  const marks = [
    ["hull of its points", ctx => { polygonPath(ctx, [[3, 16], [10, 2], [36, 2], [45, 16]]); region(ctx, theme.ink, true); }],
    ["where 99 % of it is, by its extent (d² ≤ 9.21)", ctx => {
      ctx.beginPath();
      ctx.ellipse(24, 9, 20, 7.5, 0, 0, 2 * Math.PI);
      extentLine(ctx);
      ctx.stroke();
    }],
    ["middle, and where it will be in 1 s", ctx => {
      ctx.lineWidth = 2;
      ctx.beginPath();
      arrowPath(ctx, [6, 9], [40, 9]);
      ctx.stroke();
      ctx.beginPath();
      ctx.arc(6, 9, 3.2, 0, 2 * Math.PI);
      ctx.fill();
    }],
    ["id and estimated people", ctx => label(ctx, "T4 ≈3", 24, 14, theme.ink, true)],
  ];
  box.replaceChildren(tag("span", "Tracked groups:"), ...marks.map(([words, draw]) => swatch(words, draw)));
}

function swatch(words, draw) {
  const item = document.createElement("span"), canvas = document.createElement("canvas"), dpr = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [48 * dpr, 18 * dpr];
  const ctx = canvas.getContext("2d");
  ctx.scale(dpr, dpr);
  ctx.strokeStyle = ctx.fillStyle = theme.ink;
  draw(ctx);
  item.append(canvas, words);
  return item;
}
