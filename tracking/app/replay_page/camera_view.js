// Projects the world into the image: points, the ground's grid, walls and pillars.

// The px of a point in the world, as sim.scene.camera computes them; null if the camera cannot see it.
function project(x, y, z) {
  const { kind, focal_px: f, centre_px: c, position: C, rotation: R, px_per_m: scale, radial: k } = data.camera;
  const p = [x - C[0], y - C[1], z - C[2]];
  const [a, b, d] = R.map(r => r[0] * p[0] + r[1] * p[1] + r[2] * p[2]);
  if (kind === "top") return [a * scale + c[0], b * scale + c[1]];
  if (d < 0.05) return null;
  const bend = distortion(Math.hypot(a, b) / d, k);
  return Number.isNaN(bend) ? null : [(bend * f[0] * a) / d + c[0], (bend * f[1] * b) / d + c[1]];
}

// The factor by which a lens of radial distortion k moves a point at distance q of an ideal image (sim.scene.lens).
function distortion(q, k) {
  if (!k || !q) return 1;
  const root = Math.sqrt(3 * Math.abs(k)), arc = 1.5 * q * root;
  return ((k > 0 ? Math.sinh(Math.asinh(arc) / 3) : Math.sin(Math.asin(arc) / 3)) * 2) / (root * q);
}

// The height of the ground in m, as sim.scene.terrain computes it: 0 except on stairs.
function heightAt(x, y) {
  let height = 0;
  for (const { foot: [fx, fy], head: [hx, hy], width, rise, steps: n, landing } of (data.scene || { stairs: [] }).stairs) {
    const length = Math.hypot(hx - fx, hy - fy), ex = (hx - fx) / length, ey = (hy - fy) / length;
    const along = (x - fx) * ex + (y - fy) * ey, across = Math.abs((y - fy) * ex - (x - fx) * ey);
    if (!(along > 0 && along <= length + landing && across <= width / 2)) continue;
    const k = Math.min(along / length, 1) * n, h = (rise / n) * (k - Math.sin(2 * Math.PI * k) / (2 * Math.PI));
    if (Math.abs(h) > Math.abs(height)) height = h;
  }
  return height;
}

function worldLine(ctx, scale, from, to) {
  const n = Math.max(2, Math.ceil(Math.hypot(to[0] - from[0], to[1] - from[1])));
  let before = null;
  for (let k = 0; k <= n; k++) {
    const p = project(...from.map((v, i) => v + ((to[i] - v) * k) / n));
    if (p && before) strokeLine(ctx, [before.map(v => v * scale), p.map(v => v * scale)]);
    before = p;
  }
}

function drawGround({ ctx, scale }) {
  const [x0, y0, x1, y1] = data.scene ? [0, 0, ...data.scene.size] : data.bounds || [0, 0, 0, 0];
  const step = x1 - x0 > 40 ? 5 : 1;
  ctx.strokeStyle = theme.grid;
  ctx.lineWidth = 1;
  for (let x = x0; x <= x1; x += step) worldLine(ctx, scale, [x, y0, 0], [x, y1, 0]);
  for (let y = y0; y <= y1; y += step) worldLine(ctx, scale, [x0, y, 0], [x1, y, 0]);
  if (!data.scene) return;
  const { walls, wall_height: wallHeight, pillars, pillar_height: pillarHeight } = data.scene;
  ctx.fillStyle = theme.thing;
  ctx.globalAlpha = 0.3;
  for (const [[a, b], [c, d]] of walls) fillWorld(ctx, scale, [[a, b, 0], [c, d, 0], [c, d, wallHeight], [a, b, wallHeight]]);
  ctx.globalAlpha = 0.55;
  for (const [x, y, r] of pillars) {
    const ringAt = z => Array.from({ length: 16 }, (_, k) => [x + r * Math.cos((k * Math.PI) / 8), y + r * Math.sin((k * Math.PI) / 8), z]);
    fillWorld(ctx, scale, [...ringAt(0), ...ringAt(pillarHeight)]);
  }
  ctx.globalAlpha = 1;
}

function fillWorld(ctx, scale, corners) {
  const points = corners.map(p => project(...p)).filter(Boolean).map(p => p.map(v => v * scale));
  if (points.length < corners.length) return;
  polygonPath(ctx, convexHull(points));
  ctx.fill();
}
