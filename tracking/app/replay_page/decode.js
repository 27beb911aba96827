// Decodes the page's data (page_data.py, person_rows.py) into typed arrays, and finds the rows of a frame.

const NIL = -99999;
const data = JSON.parse(document.getElementById("data").textContent);

function decodeSums(deltas, scale) {
  const out = new Float32Array(deltas.length);
  let total = 0;
  for (let k = 0; k < deltas.length; k++) {
    total += deltas[k];
    out[k] = total === NIL ? NaN : total / scale;
  }
  return out;
}

function decodeRuns(pairs, n) {
  const out = new Int32Array(n);
  for (let k = 0, at = 0; k < pairs.length; k += 2) {
    out.fill(pairs[k], at, at + pairs[k + 1]);
    at += pairs[k + 1];
  }
  return out;
}

// A function from a frame to the indices of its rows. Rows of frame f are order[offset[f]] … order[offset[f + 1] - 1].
function byFrame(frame, length) {
  const offset = new Int32Array(length + 3), order = new Int32Array(frame.length);
  for (const f of frame) offset[f + 1]++;
  for (let f = 1; f < offset.length; f++) offset[f] += offset[f - 1];
  const next = offset.slice();
  for (let k = 0; k < frame.length; k++) order[next[frame[k]]++] = k;
  return f => order.subarray(offset[f], offset[f + 1]);
}

// One side of the page: the truth or the tracks of a tracker. word: what texts call it.
function decodeSide(raw, name, word) {
  if (!raw) return null;
  const n = raw.x.length;
  const id = new Int32Array(n), frame = new Int32Array(n), first = new Int32Array(n);
  let row = 0;
  for (const [person, start, count] of raw.stints) {
    const begin = row;
    for (let k = 0; k < count; k++, row++) {
      id[row] = person;
      frame[row] = start + k;
      first[row] = begin;
    }
  }
  const box = raw.box.length ? raw.box.map(column => decodeSums(column, 2)) : null;
  const events = raw.events.map(([kind, start, end, emitted, before, after, members, pos]) =>
    ({ kind, start, end, emitted, before, after, members, pos, side: name }));
  return {
    name, word, n, id, frame, first, box, events,
    tracked: name !== "truth", letter: name === "truth" ? "G" : "T",
    plane: raw.plane,
    x: decodeSums(raw.x, raw.scale),
    y: decodeSums(raw.y, raw.scale),
    angle: decodeSums(raw.a, 180 / Math.PI),
    group: decodeRuns(raw.group, n),
    visible: decodeRuns(raw.vis, n),
    groupRows: decodeGroupRows(raw),
    bars: raw.bars.map(([id, start, end, lane, size]) => ({ id, start, end, lane, size })),
    links: raw.links.map(([frame, a, b]) => ({ frame, a, b })),
    rows: byFrame(frame, data.length),
  };
}

// For rows that are groups: size, speed, ellipse (long and short standard deviation, direction) and hull of each row.
// null if the rows are people.
function decodeGroupRows({ wholes, plane, scale }) {
  if (!wholes) return null;
  const [long, wide, turn] = wholes.ellipse;
  return {
    size: decodeSums(wholes.size, 10),
    speed: decodeSums(wholes.speed, plane === "image" ? 1 : 10),
    long: decodeSums(long, scale), wide: decodeSums(wide, scale), turn: decodeSums(turn, 180 / Math.PI),
    hull: wholes.hull.map(steps => decodeCorners(steps, scale)),
  };
}

// The first corner and the steps to each next corner as [[x, y], …].
function decodeCorners(steps, scale) {
  const list = [];
  for (let k = 0, x = 0, y = 0; k < steps.length; k += 2) {
    x += steps[k];
    y += steps[k + 1];
    list.push([x / scale, y / scale]);
  }
  return list;
}

function decodeDetections(raw) {
  if (!raw) return null;
  const frame = new Int32Array(raw.x.length);
  let row = 0;
  for (const [index, count] of raw.frames) {
    frame.fill(index, row, row + count);
    row += count;
  }
  const box = raw.box.length ? raw.box.map(column => decodeSums(column, 1)) : null;
  return { plane: raw.plane, x: decodeSums(raw.x, raw.scale), y: decodeSums(raw.y, raw.scale), box, rows: byFrame(frame, data.length) };
}

// The groups of a frame as id → rows of its members. Groups of one person are left out; rows that are groups are kept.
function groupsAt(side, frame) {
  const groups = new Map();
  for (const row of side.rows(frame)) {
    if (side.group[row] < 0) continue;
    if (!groups.has(side.group[row])) groups.set(side.group[row], []);
    groups.get(side.group[row]).push(row);
  }
  if (!side.groupRows) for (const [id, rows] of groups) if (rows.length < 2) groups.delete(id);
  return groups;
}

const truth = decodeSide(data.truth, "truth", "true");
const tracks = decodeSide(data.tracks, "tracks", data.other ? data.tracker : "tracked");
const other = data.other && decodeSide(data.other.tracks, "other", data.other.tracker);
const found = decodeDetections(data.detections);
const sides = [truth, tracks, other].filter(Boolean);
const sideOf = Object.fromEntries(sides.map(side => [side.name, side]));
const hasPlan = Boolean(data.bounds);
const hasImage = Boolean(data.image) &&
  (Boolean(data.video || data.background) || sides.some(side => side.box || side.plane === "image") || Boolean(found && (found.box || found.plane === "image")));
