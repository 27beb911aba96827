// Draws the plan: the ground with its objects, people from above, groups, tracks, detections.

const BODY = { shoulder: 0.24, depth: 0.13, head: 0.1, footprint: 0.25, track: 0.36 };
const MANY = 80;
const FOLLOWED = 2; // times that the plan is enlarged at the head of a report
const zoom = { times: 1, centre: [0, 0], scale: 1, width: 1, height: 1 }; // the plan's, and the size of a pane in px

// Zooms so that the place under a pixel of a pane stays there.
function zoomBy(factor, px, py) {
  const times = Math.min(Math.max(zoom.times * factor, 1), 20), u = px - zoom.width / 2, v = py - zoom.height / 2;
  const next = (zoom.scale * times) / zoom.times;
  zoom.centre = [zoom.centre[0] + u / zoom.scale - u / next, zoom.centre[1] - v / zoom.scale + v / next];
  zoom.times = times;
}

// Zooms to the people of the shown error, or to all people of the frame.
function zoomTo(times) {
  const error = data.errors.find(error => error.start <= state.frame && state.frame <= error.end && error.people.length);
  const shown = sides.filter(side => side.plane === "ground")[0];
  if (!shown) return;
  const rows = [...shown.rows(state.frame)].filter(row => !Number.isNaN(shown.x[row]));
  const own = rows.filter(row => error && !shown.tracked && [...error.people, ...error.others].includes(shown.id[row]));
  const mean = values => values.reduce((a, b) => a + b, 0) / values.length, use = own.length ? own : rows;
  if (use.length) zoom.centre = [mean(use.map(row => shown.x[row])), mean(use.map(row => shown.y[row]))];
  zoom.times = times;
}

// Keeps the people in groups in the middle, until somebody zooms.
function follow() {
  const rows = truth ? [...truth.rows(state.frame)].filter(row => truth.group[row] >= 0) : [];
  const mean = values => rows.reduce((sum, row) => sum + values[row], 0) / rows.length;
  if (rows.length && zoom.times === FOLLOWED) zoom.centre = [mean(truth.x), mean(truth.y)];
}

function listenToZoom(canvas, show) {
  const inPane = event => [event.offsetX % zoom.width, event.offsetY % zoom.height];
  canvas.addEventListener("wheel", event => {
    if (data.opening && !event.ctrlKey) return; // the report scrolls
    event.preventDefault();
    zoomBy(event.deltaY < 0 ? 1.25 : 0.8, ...inPane(event));
    show();
  }, { passive: false });
  canvas.addEventListener("pointermove", event => {
    if (!(event.buttons & 1) || zoom.times === 1) return;
    zoom.centre = [zoom.centre[0] - event.movementX / zoom.scale, zoom.centre[1] + event.movementY / zoom.scale];
    show();
  });
  canvas.addEventListener("dblclick", event => {
    zoomBy(zoom.times > 1 ? 0 : 3, ...inPane(event));
    show();
  });
}

function drawPlan(canvas, frame, options) {
  const [x0, y0, x1, y1] = data.bounds;
  const there = sides.filter(side => options[side.name]);
  const parts = splitPanes(there.filter(side => side.plane === "ground"), options.beside);
  const own = Math.min(Math.max((y1 - y0) / (x1 - x0), 0.35), data.opening ? 0.5 : 1.1);
  const panes = splitPanes(there, options.beside).length;
  const aspect = (hasImage && !data.opening ? data.image[1] / data.image[0] : own) * parts.length / panes;
  drawPanes(canvas, parts.length, aspect, (k, ctx, x, y, w, h) => {
    inPane(ctx, x, y, w, h, paneTitle(parts, parts[k]), taken => planPane(ctx, w, h, parts[k], frame, options, taken));
  });
}

function planPane(ctx, width, height, shown, frame, options, taken) {
  const [x0, y0, x1, y1] = data.bounds;
  const scale = zoom.times * Math.min((width - 16) / (x1 - x0), (height - 16) / (y1 - y0));
  const [cx, cy] = zoom.times > 1 ? zoom.centre : [(x0 + x1) / 2, (y0 + y1) / 2];
  const map = (x, y) => [width / 2 + (x - cx) * scale, height / 2 - (y - cy) * scale];
  const reach = [width / scale / 2, height / scale / 2];
  Object.assign(zoom, { scale, width, height, centre: [cx, cy] });
  ctx.fillStyle = theme.ground;
  ctx.fillRect(0, 0, width, height);
  const plan = { ctx, map, width, height, scale, frame, options, taken };
  drawGrid(plan, [cx - reach[0], cy - reach[1], cx + reach[0], cy + reach[1]]);
  if (data.scene) drawScene(ctx, map, scale);
  const people = shown.filter(side => !side.groupRows), wholeGroups = shown.filter(side => side.groupRows);
  if (options.hulls) for (const side of people) drawPlanHulls(plan, side);
  for (const side of wholeGroups) drawWholeGroups(plan, side, map);
  if (options.trails) for (const side of people) drawTrails(plan, side, map);
  if (options.detections && found && found.plane !== "image") drawPlanDetections(plan);
  for (const side of people) drawPlanPeople(plan, side);
  drawPicked(plan, shown, (side, row) => bodyBox(plan, positionOf(plan, side, row)));
  if (!asking) drawErrorsHere(plan, shown, Math.max(0.6 * scale, 11), (side, row) => [positionOf(plan, side, row)]);
  if (options.ids) drawPersonIds(plan, people.filter(side => side.rows(frame).length <= MANY));
  if (options.ids) for (const side of wholeGroups) drawWholeGroupIds(plan, side, map);
}

// Grid lines over the whole pane, and a scale in its corner.
function drawGrid({ ctx, map, scale, taken }, [x0, y0, x1, y1]) {
  const step = scale > 14 ? 1 : scale > 4 ? 5 : 10;
  ctx.strokeStyle = theme.grid;
  ctx.lineWidth = 1;
  for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) strokeLine(ctx, [map(x, y0), map(x, y1)]);
  for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) strokeLine(ctx, [map(x0, y), map(x1, y)]);
  const [u, v] = map(x0, y0);
  const bar = 5 * scale > 40 ? (scale > 40 ? 1 : 5) : 10;
  ctx.strokeStyle = theme.thing;
  ctx.lineWidth = 2;
  strokeLine(ctx, [[u + 8, v - 8], [u + 8 + bar * scale, v - 8]]);
  label(ctx, `${bar} m`, u + 8 + (bar * scale) / 2, v - 13, theme.thing);
  taken.push([u, v - 26, u + 16 + bar * scale, v]);
}

function drawScene(ctx, map, scale) {
  const { size, walls, pillars, doors, service, stairs } = data.scene;
  ctx.lineWidth = 1;
  ctx.strokeStyle = theme.thing;
  polygonPath(ctx, [map(0, 0), map(size[0], 0), map(size[0], size[1]), map(0, size[1])]);
  ctx.stroke();
  for (const flight of stairs) drawStairs(ctx, map, flight);
  ctx.strokeStyle = theme.wall;
  ctx.lineWidth = Math.max(0.1 * scale, 3);
  for (const [[a, b], [c, d]] of walls) strokeLine(ctx, [map(a, b), map(c, d)]);
  for (const [[a, b], [c, d]] of doors) {
    ctx.strokeStyle = theme.ground;
    ctx.lineWidth = Math.max(0.1 * scale, 3) + 2;
    strokeLine(ctx, [map(a, b), map(c, d)]);
    ctx.strokeStyle = theme.wall;
    ctx.lineWidth = 1;
    ctx.setLineDash([2, 3]);
    strokeLine(ctx, [map(a, b), map(c, d)]);
    ctx.setLineDash([]);
  }
  ctx.fillStyle = theme.thing;
  for (const [x, y, r] of pillars) {
    ctx.beginPath();
    ctx.arc(...map(x, y), r * scale, 0, 2 * Math.PI);
    ctx.fill();
  }
  ctx.strokeStyle = theme.wall;
  ctx.lineWidth = 1.5;
  for (const [x, y] of service) {
    const [u, v] = map(x, y);
    ctx.strokeRect(u - 6, v - 6, 12, 12);
    label(ctx, "service", u, v - 10, theme.thing);
  }
}

function drawStairs(ctx, map, { foot: [fx, fy], head: [hx, hy], width, steps: count, landing }) {
  const length = Math.hypot(hx - fx, hy - fy), ex = (hx - fx) / length, ey = (hy - fy) / length;
  const across = s => [map(fx + ex * s - ey * width / 2, fy + ey * s + ex * width / 2), map(fx + ex * s + ey * width / 2, fy + ey * s - ex * width / 2)];
  ctx.fillStyle = theme.floor;
  polygonPath(ctx, [...across(0), ...across(length + landing).reverse()]);
  ctx.fill();
  for (let k = 0; k <= count; k++) strokeLine(ctx, across((length * k) / count));
}

function positionOf(plan, side, row) {
  return plan.map(side.x[row], side.y[row]);
}

function drawPlanHulls(plan, side) {
  const { ctx, scale } = plan, { tracked } = side;
  for (const [id, rows] of groupsAt(side, plan.frame)) {
    const points = rows.map(row => positionOf(plan, side, row)).filter(p => !Number.isNaN(p[0]));
    if (!points.length) continue;
    roundedPath(ctx, points, Math.max((tracked ? 0.4 : BODY.footprint + 0.05) * scale, 7));
    drawRegion(ctx, colourOf(id), tracked);
    if (!plan.options.ids || !shownIn(plan, points)) continue;
    const mid = points.reduce((a, p) => a + p[0], 0) / points.length;
    const vs = points.map(p => p[1]), ends = [Math.min(...vs) - 0.35 * scale - 12, Math.max(...vs) + 0.45 * scale + 10];
    placeLabel(plan, side.letter + id, hullSpots(mid, tracked ? ends.reverse() : ends), colourOf(id), false, true);
  }
}

function drawPlanDetections(plan) {
  const { ctx } = plan;
  ctx.strokeStyle = theme.found;
  ctx.lineWidth = 1.3;
  for (const row of found.rows(plan.frame)) {
    const [u, v] = plan.map(found.x[row], found.y[row]);
    strokeLine(ctx, [[u - 4, v - 4], [u + 4, v + 4]]);
    strokeLine(ctx, [[u - 4, v + 4], [u + 4, v - 4]]);
  }
}

function drawPlanPeople(plan, side) {
  for (const row of side.rows(plan.frame)) {
    const at = positionOf(plan, side, row);
    if (Number.isNaN(at[0])) continue;
    const colour = rowColour(side, row, plan.options.by);
    addHit("plan", plan.ctx, side, row, bodyBox(plan, at));
    if (side.tracked) drawRing(plan, side, row, at, colour);
    else drawBody(plan, side, row, at, colour);
  }
}

// Left, top, right and bottom of a person, px.
function bodyBox({ scale }, [u, v]) {
  const r = Math.max(BODY.track * scale, 6);
  return [u - r, v - r, u + r, v + r];
}

const LABEL_DIRECTIONS = [[1, 1], [1, -1], [-1, 1], [-1, -1], [0, 1], [1, 0], [-1, 0], [0, -1]];

// Ids beside bodies and rings: true ones upright, tracked ones slanted, each where it covers least.
function drawPersonIds(plan, shown) {
  const r = Math.max(BODY.shoulder * plan.scale, 6), here = [];
  for (const side of shown) for (const row of side.rows(plan.frame)) here.push([side, row, positionOf(plan, side, row)]);
  const seen = here.filter(([, , at]) => !Number.isNaN(at[0]) && shownIn(plan, [at]));
  for (const [, , [u, v]] of seen) plan.taken.push([u - r, v - r, u + r, v + r]);
  for (const [side, row, [u, v]] of seen) {
    const { tracked } = side, sign = tracked ? -1 : 1;
    const spots = half => LABEL_DIRECTIONS.map(([p, q]) => {
      const near = p && q ? 0.75 * r : r + 1;
      return [u + sign * p * (near + half[0]), v + sign * q * (near + half[1])];
    });
    placeLabel(plan, side.id[row], spots, rowColour(side, row, plan.options.by), tracked);
  }
}

function drawBody({ ctx, scale }, side, row, [u, v], colour) {
  const unit = Math.max(scale, 22), angle = side.angle[row], known = !Number.isNaN(angle);
  ctx.save();
  ctx.translate(u, v);
  ctx.rotate(known ? -angle : 0);
  ctx.fillStyle = colour;
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth = 1;
  ctx.beginPath();
  if (known) ctx.ellipse(0, 0, BODY.depth * unit, BODY.shoulder * unit, 0, 0, 2 * Math.PI);
  else ctx.arc(0, 0, 0.19 * unit, 0, 2 * Math.PI);
  ctx.fill();
  ctx.stroke();
  ctx.fillStyle = theme.halo;
  ctx.beginPath();
  ctx.arc(known ? 0.03 * unit : 0, 0, BODY.head * unit, 0, 2 * Math.PI);
  ctx.fill();
  if (known) {
    ctx.fillStyle = colour;
    ctx.beginPath();
    ctx.moveTo(0.34 * unit, 0);
    ctx.lineTo(0.17 * unit, 0.09 * unit);
    ctx.lineTo(0.17 * unit, -0.09 * unit);
    ctx.fill();
  }
  ctx.restore();
}

function drawRing({ ctx, scale }, side, row, [u, v], colour) {
  const r = Math.max(BODY.track * scale, 6), angle = side.angle[row];
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.arc(u, v, r, 0, 2 * Math.PI);
  ctx.stroke();
  if (Number.isNaN(angle)) return;
  strokeLine(ctx, [[u + r * Math.cos(angle), v - r * Math.sin(angle)], [u + 1.6 * r * Math.cos(angle), v - 1.6 * r * Math.sin(angle)]]);
}
