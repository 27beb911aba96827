// Draws groups of a tracker that reports groups without people: hull, extent, motion, trail, id and size, on the plan and
// in the image. `map` takes x, y in the side's plane to px of the pane, or to null where the camera cannot see them.

const SIGMA_99 = Math.sqrt(9.21); // standard deviations: d'E⁻¹d ≤ 9.21 holds 99 % of a normal distribution in the plane
const ELLIPSE_POINTS = 48;

function drawWholeGroups(pane, side, map) {
  if (pane.options.trails) drawTrails(pane, side, map);
  for (const row of side.rows(pane.frame)) {
    const colour = colourOf(side.id[row]);
    if (pane.options.ellipses) drawExtent(pane, side, row, map, colour);
    if (pane.options.hulls) drawGroupHull(pane, side, row, map, colour);
    drawMotion(pane, side, row, map, colour);
  }
}

// The places [x, y] as px; [] if one of them cannot be seen.
function mapAll(places, map) {
  const points = places.map(([x, y]) => map(x, y));
  return points.every(p => p && !Number.isNaN(p[0])) ? points : [];
}

function hullPoints(side, row, map) {
  return mapAll(side.groupRows.hull[row], map);
}

// The ellipse d'E⁻¹d = 9.21 round a group's centre, as a polygon in px.
function extentPoints(side, row, map) {
  const { long, wide, turn } = side.groupRows, c = Math.cos(turn[row]), s = Math.sin(turn[row]);
  return mapAll(Array.from({ length: ELLIPSE_POINTS }, (_, k) => {
    const t = (2 * Math.PI * k) / ELLIPSE_POINTS, a = SIGMA_99 * long[row] * Math.cos(t), b = SIGMA_99 * wide[row] * Math.sin(t);
    return [side.x[row] + c * a - s * b, side.y[row] + s * a + c * b];
  }), map);
}

function drawExtent({ ctx, overPicture }, side, row, map, colour) {
  const points = extentPoints(side, row, map);
  if (!points.length) return;
  polygonPath(ctx, points);
  setExtentLine(ctx);
  if (overPicture) {
    ctx.lineWidth += 0.6;
    strokeRim(ctx);
  }
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.setLineDash([]);
}

function setExtentLine(ctx) {
  ctx.lineCap = "round";
  ctx.lineWidth = 1.8;
  ctx.setLineDash([0.1, 5]);
}

function drawGroupHull({ ctx, overPicture }, side, row, map, colour) {
  const points = hullPoints(side, row, map);
  if (!points.length) return;
  ctx.lineCap = "butt";
  polygonPath(ctx, points);
  drawRegion(ctx, colour, true, overPicture);
}

// A disc at a group's centre, and an arrow to where the centre is in one second.
function drawMotion({ ctx, overPicture }, side, row, map, colour) {
  const x = side.x[row], y = side.y[row], angle = side.angle[row], speed = side.groupRows.speed[row];
  const known = !Number.isNaN(angle) && !Number.isNaN(speed);
  const [at, to] = [map(x, y), known ? map(x + speed * Math.cos(angle), y + speed * Math.sin(angle)) : null];
  if (!at || Number.isNaN(at[0])) return;
  ctx.lineCap = "round";
  ctx.lineWidth = 2;
  ctx.beginPath();
  if (to) arrowPath(ctx, at, to);
  if (overPicture) strokeRim(ctx);
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.beginPath();
  ctx.arc(...at, 3.2, 0, 2 * Math.PI);
  ctx.lineWidth = 1;
  if (overPicture) strokeRim(ctx);
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

function groupWords(side, row) {
  const size = side.groupRows.size[row];
  return `T${side.id[row]}${Number.isNaN(size) ? "" : ` ≈${Math.round(size * 10) / 10}`}`;
}

// Ids with sizes: of eight places round the hull, each takes the one that covers least.
function drawWholeGroupIds(pane, side, map) {
  const rows = side.rows(pane.frame), { hulls, ellipses } = pane.options;
  if (rows.length > MANY) return;
  for (const row of rows) {
    const shapes = [hulls ? hullPoints(side, row, map) : [], hulls || !ellipses ? [] : extentPoints(side, row, map)];
    const at = map(side.x[row], side.y[row]);
    if (!at || Number.isNaN(at[0])) continue;
    const points = [...shapes.flat(), [at[0] - 5, at[1] - 5], [at[0] + 5, at[1] + 5]];
    const us = points.map(p => p[0]), vs = points.map(p => p[1]);
    const [left, right, top, bottom] = [Math.min(...us), Math.max(...us), Math.min(...vs), Math.max(...vs)];
    const middle = (left + right) / 2, level = (top + bottom) / 2;
    const spots = ([w, h]) => [
      [middle, bottom + h + 4], [middle, top - h - 4], [right + w + 4, level], [left - w - 4, level],
      [right + w, bottom + h], [left - w, bottom + h], [right + w, top - h], [left - w, top - h],
    ];
    placeLabel(pane, groupWords(side, row), spots, colourOf(side.id[row]), false, true);
  }
}

// The key to the marks of groups; empty unless the tracker reports groups without people.
function wholeGroupsKey(box) {
  if (!wholes) return;
  const marks = [
    ["hull of its points", ctx => { polygonPath(ctx, [[3, 16], [10, 2], [36, 2], [45, 16]]); drawRegion(ctx, theme.ink, true); }],
    ["extent: holds 99 % of the group (d² ≤ 9.21)", ctx => {
      ctx.beginPath();
      ctx.ellipse(24, 9, 20, 7.5, 0, 0, 2 * Math.PI);
      setExtentLine(ctx);
      ctx.stroke();
    }],
    ["centre, and where it will be in 1 s", ctx => {
      ctx.lineWidth = 2;
      ctx.beginPath();
      arrowPath(ctx, [6, 9], [40, 9]);
      ctx.stroke();
      ctx.beginPath();
      ctx.arc(6, 9, 3.2, 0, 2 * Math.PI);
      ctx.fill();
    }],
    ["id and estimated number of people", ctx => label(ctx, "T4 ≈3", 24, 14, theme.ink, true)],
  ];
  box.replaceChildren(tag("span", "Tracked groups:"), ...marks.map(([words, draw]) => keyItem(words, draw)));
}

function keyItem(words, draw) {
  const item = document.createElement("span"), canvas = document.createElement("canvas"), dpr = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [48 * dpr, 18 * dpr];
  const ctx = canvas.getContext("2d");
  ctx.scale(dpr, dpr);
  ctx.strokeStyle = ctx.fillStyle = theme.ink;
  draw(ctx);
  item.append(canvas, words);
  return item;
}
