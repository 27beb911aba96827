// Draws the image: true, tracked and detected boxes over the video; without a video, over the projected ground and walls.

function drawImage(canvas, frame, options) {
  const [imageWidth, imageHeight] = data.image;
  const parts = splitPanes(sides.filter(side => options[side.name]), options.beside);
  drawPanes(canvas, parts.length, imageHeight / imageWidth, (k, ctx, x, y, w, h) => {
    inPane(ctx, x, y, w, h, paneTitle(parts, parts[k]), taken => {
      const overPicture = options.video && (player ? player.draw(ctx, w, h) : drawBackground(ctx, w, h));
      imagePane({ ctx, width: w, height: h, scale: w / imageWidth, frame, options, overPicture, taken }, parts[k]);
    });
  });
}

// Draws the picture of the empty scene; returns false if there is none, or not yet.
function drawBackground(ctx, width, height) {
  if (!background || !background.naturalWidth) return false;
  ctx.drawImage(background, 0, 0, width, height);
  return true;
}

function imagePane(pane, shown) {
  if (data.camera && !pane.overPicture) drawGround(pane);
  if (player && player.lost.has(pane.frame)) label(pane.ctx, "lost frame: no picture", 90, 22, theme.found, true);
  const people = shown.filter(side => !side.groupRows);
  const wholeGroups = shown.filter(side => side.groupRows).map(side => [side, toImage(side, pane.scale)]).filter(([, map]) => map);
  if (pane.options.hulls) for (const side of people) drawImageHulls(pane, side);
  for (const [side, map] of wholeGroups) drawWholeGroups(pane, side, map);
  if (pane.options.detections && found) drawImageDetections(pane);
  for (const side of people) if (side.tracked || !data.opening) drawImageBoxes(pane, side);
  if (pane.options.ids) for (const [side, map] of wholeGroups) drawWholeGroupIds(pane, side, map);
  drawPicked(pane, shown, (side, row) => around(cornersOf(side, row, pane.scale)));
  if (!asking) drawErrorsHere(pane, shown, 7, (side, row) => cornersOf(side, row, pane.scale));
}

// The corners, in px, of a box, or of a ring round the feet of somebody without one.
function cornersOf(side, row, scale) {
  const box = boxOf(side, row, scale);
  return box ? [[0, 0], [1, 0], [0, 1], [1, 1]].map(([p, q]) => [box[0] + p * box[2], box[1] + q * box[3]]) : footRing(side, row, scale);
}

// Left, top, right and bottom of points.
function around(points) {
  const us = points.map(p => p[0]), vs = points.map(p => p[1]);
  return [Math.min(...us), Math.min(...vs), Math.max(...us), Math.max(...vs)];
}

// The points, in px, of a ring on the ground round a person's feet; [] where the camera cannot see it.
function footRing(side, row, scale) {
  const turns = Array.from({ length: 25 }, (_, k) => (k * Math.PI) / 12), map = toImage(side, scale);
  const reach = side.plane === "image" ? 0 : BODY.track;
  return map ? mapAll(turns.map(t => [side.x[row] + reach * Math.cos(t), side.y[row] + reach * Math.sin(t)]), map) : [];
}

// A function from x, y in a side's plane to px of the pane, or to null for a point that the camera cannot see.
// null if a camera is needed and there is none.
function toImage(side, scale) {
  if (side.plane === "image") return (x, y) => [x * scale, y * scale];
  if (!data.camera) return null;
  return (x, y) => {
    const at = project(x, y, heightAt(x, y));
    return at && at.map(v => v * scale);
  };
}

function boxOf(source, row, scale) {
  if (!source.box) return null;
  const box = source.box.map(column => column[row] * scale);
  return Number.isNaN(box[0]) ? null : box;
}

function drawImageBoxes(pane, side) {
  const { ctx, scale, frame, options, overPicture } = pane, rows = side.rows(frame), { tracked } = side;
  for (const row of rows) {
    const ids = options.ids && rows.length <= MANY && shownIn(pane, cornersOf(side, row, scale));
    const colour = rowColour(side, row, options.by), box = boxOf(side, row, scale);
    addHit("image", ctx, side, row, around(cornersOf(side, row, scale)));
    ctx.strokeStyle = colour;
    ctx.lineWidth = tracked ? 2.4 : 1.8;
    ctx.setLineDash(tracked ? [6, 4] : []);
    if (box) {
      const hidden = !tracked && side.visible[row] <= 2;
      if (hidden) ctx.setLineDash([1, 3]);
      if (overPicture && !hidden) strokeBoxRim(ctx, box, colour);
      ctx.strokeRect(...box);
      ctx.globalAlpha = tracked || overPicture ? 0 : 0.1;
      ctx.fillStyle = colour;
      ctx.fillRect(...box);
      ctx.globalAlpha = 1;
      const y = tracked ? box[1] + box[3] + 8 : box[1] - 8, away = tracked ? 12 : -12;
      const places = [0.5, 0, 1].map(share => [box[0] + share * box[2], y]);
      const spots = () => [...places, ...places.map(([x]) => [x, y + away])];
      if (ids) placeLabel(pane, side.id[row], spots, colour, tracked);
    } else if (side.plane === "image") {
      ctx.beginPath();
      ctx.arc(side.x[row] * scale, side.y[row] * scale, 6, 0, 2 * Math.PI);
      ctx.stroke();
      if (ids) label(ctx, side.id[row], side.x[row] * scale, side.y[row] * scale - 9, colour);
    } else {
      const ring = footRing(side, row, scale);
      ctx.setLineDash([]);
      ctx.lineWidth = 3;
      for (const look of [theme.halo, colour]) {
        ctx.strokeStyle = look;
        strokeLine(ctx, ring);
        ctx.lineWidth = 2;
      }
      const spots = ([p, q]) => [[0, 1], [1, 0], [-1, 0]].map(([a, b]) => [ring[6][0] + a * (p + 10), ring[18][1] + b * (q + 3)]);
      if (ids) placeLabel(pane, side.id[row], spots, colour, tracked);
    }
  }
  ctx.setLineDash([]);
}

// Strokes a light edge under a box, so that its colour stands out on pictures.
function strokeBoxRim(ctx, box, colour) {
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth += 2;
  ctx.strokeRect(...box);
  ctx.strokeStyle = colour;
  ctx.lineWidth -= 2;
}

function drawImageHulls(pane, side) {
  const { ctx, scale, frame, options } = pane, { tracked } = side;
  for (const [id, rows] of groupsAt(side, frame)) {
    const points = rows.flatMap(row => cornersOf(side, row, scale));
    if (!points.length) continue;
    roundedPath(ctx, points, tracked ? 8 : 5);
    drawRegion(ctx, colourOf(id), tracked);
    if (!options.ids || !shownIn(pane, points)) continue;
    const x = points.reduce((a, p) => a + p[0], 0) / points.length;
    const vs = points.map(p => p[1]), ends = [Math.min(...vs) - 23, Math.max(...vs) + 19];
    placeLabel(pane, side.letter + id, hullSpots(x, tracked ? ends.reverse() : ends), colourOf(id), false, true);
  }
}

function drawImageDetections({ ctx, scale, frame }) {
  ctx.strokeStyle = theme.found;
  ctx.lineWidth = 1;
  ctx.setLineDash([2, 2]);
  for (const row of found.rows(frame)) {
    const box = boxOf(found, row, scale);
    if (box) ctx.strokeRect(...box);
    else if (found.plane === "image") ctx.strokeRect(found.x[row] * scale - 3, found.y[row] * scale - 3, 6, 6);
  }
  ctx.setLineDash([]);
}
