// Draws the timeline: true and tracked events in lanes, and group ids as bars that are linked by merges and splits.

const KINDS = {
  merge: { colour: 0, shape: "M-5,-5 L5,-5 L0,5 Z", word: "merge" },
  split: { colour: 1, shape: "M-5,5 L5,5 L0,-5 Z", word: "split" },
  cross: { colour: 3, shape: "M-5,-5 L5,5 M-5,5 L5,-5", word: "cross" },
  queue: { colour: 2, shape: "M-5,-5 H5 V5 H-5 Z", word: "queue" },
  form: { colour: 4, shape: "M0,-5 L5,0 L0,5 L-5,0 Z", word: "form" },
  dissolve: { colour: 5, shape: "M-3.5,0 A3.5,3.5 0 1 0 3.5,0 A3.5,3.5 0 1 0 -3.5,0", word: "dissolve" },
  enter: { colour: 7, shape: "M0,-5 V5 M0,0 H5", word: "enter" },
  leave: { colour: 9, shape: "M0,-5 V5 M0,0 H-5", word: "leave" },
};
const LANE = 15, BAR = 12, LETTER = 7.2, LEAST = 104, MOST = 150; // px
let gutter = LEAST; // px left of the lanes, for their headings

// The px that headings need, which are a word and "groups".
function gutterOf(words) {
  const longest = Math.max(...words.map(word => word.length)) + " groups".length;
  return Math.min(Math.max(Math.ceil(10 + LETTER * longest), LEAST), MOST);
}

function element(name, attributes, parent, text) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) node.setAttribute(key, attributes[key]);
  if (text !== undefined) node.textContent = text;
  if (parent) parent.append(node);
  return node;
}

function eventWords(event) {
  const list = ids => {
    const alone = ids.filter(id => id < 0).length, named = ids.filter(id => id >= 0);
    const groups = named.map(id => sideOf[event.side].letter + id);
    return (alone ? [alone > 1 ? `${alone} alone` : "alone"] : []).concat(groups).join(" + ");
  };
  const ids = event.before.length || event.after.length ? ` ${list(event.before) || "–"} → ${list(event.after) || "–"}` : "";
  const who = event.members.length ? `; people ${event.members.slice(0, 12).join(", ")}${event.members.length > 12 ? " …" : ""}` : "";
  const reported = event.emitted === null ? "" : `; reported in frame ${event.emitted}`;
  return `${event.kind}${ids}${who}${reported}`;
}

function seconds(frame) {
  return (frame - 1) / data.fps;
}

// Draws the timeline into `box`. Returns `move` (puts the playhead at a frame) and `frameAt` (the frame at an x in px).
function timeline(box, width, seekTo) {
  const svg = element("svg", { role: "img", "aria-label": "Timeline of events and groups; seek with the slider or by clicking" });
  gutter = gutterOf(sides.map(side => side.word));
  const span = Math.max(width - gutter - 14, 50), last = Math.max(data.to - data.from, 1);
  const x = frame => gutter + ((frame - data.from) / last) * span;
  let y = drawAxis(svg, x, width);
  for (const [a, b] of data.unlabelled) drawUnlabelled(svg, x(a), x(b + 1));
  for (const side of sides) y = drawEvents(svg, side, x, y, seekTo);
  for (const side of sides) if (side.tracked) y = drawErrors(svg, side, x, y, seekTo);
  for (const side of sides) y = drawGroupBars(svg, side, x, y, seekTo);
  svg.setAttribute("viewBox", `0 0 ${width} ${y + 4}`);
  svg.setAttribute("height", y + 4);
  for (const rect of svg.querySelectorAll(".shade")) rect.setAttribute("height", y - 18);
  const head = element("line", { y1: 16, y2: y + 2, stroke: "currentColor", "stroke-width": 1.6 }, svg);
  const knob = element("path", { d: "M-5,13 H5 L0,21 Z", fill: "currentColor" }, svg);
  box.replaceChildren(svg);
  return {
    move(frame) {
      head.setAttribute("x1", x(frame));
      head.setAttribute("x2", x(frame));
      knob.setAttribute("transform", `translate(${x(frame)} 0)`);
    },
    frameAt: px => Math.min(Math.max(Math.round(data.from + ((px - gutter) / span) * last), data.from), data.to),
  };
}

function drawAxis(svg, x, width) {
  const first = seconds(data.from), total = seconds(data.to), steps = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600];
  const step = steps.find(s => (total - first) / s <= Math.max((width - gutter) / 70, 2)) || 7200;
  for (let t = Math.ceil(first / step) * step; t <= total + 1e-9; t += step) {
    const u = x(1 + t * data.fps);
    element("text", { x: u, y: 10, "text-anchor": "middle", fill: theme.thing }, svg, `${t} s`);
    element("line", { x1: u, x2: u, y1: 14, y2: 20, stroke: theme.thing }, svg);
  }
  return 20;
}

function drawUnlabelled(svg, from, to) {
  const rect = element("rect", { class: "shade", x: from, y: 18, width: Math.max(to - from, 1), fill: theme.thing, opacity: 0.18 }, svg);
  element("title", {}, rect, "groups are not labelled here");
}

function drawHeading(svg, y, text) {
  const [word, what] = text.split(/ (?=\S+$)/), most = Math.floor((gutter - 10) / LETTER) - what.length;
  const short = word.length > most ? `…${word.slice(1 - most)}` : word;
  element("title", {}, element("text", { x: gutter - 10, y: y + 11, "text-anchor": "end" }, svg, `${short} ${what}`), text);
}

// Markers that would overlap are put in different lanes.
function drawEvents(svg, side, x, y, seekTo) {
  drawHeading(svg, y, `${side.word} events`);
  const ends = [];
  for (const event of side.events.slice().sort((a, b) => a.start - b.start)) {
    const u = x(event.start), kind = KINDS[event.kind] || KINDS.form;
    const end = x(Math.min(Math.max(event.end, event.emitted || 0), data.to));
    let lane = ends.findIndex(e => e < u - 12);
    if (lane < 0) lane = ends.length < 6 ? ends.length : 5;
    ends[lane] = u;
    const v = y + 8 + lane * LANE, colour = palette[kind.colour];
    const mark = element("g", { transform: `translate(${u} ${v})`, style: "cursor:pointer" }, svg);
    if (end - u > 6) element("line", { x1: 0, x2: end - u, y1: 0, y2: 0, stroke: colour, "stroke-width": 2, opacity: 0.45 }, mark);
    const open = event.kind === "cross" || event.kind === "enter" || event.kind === "leave" || event.kind === "dissolve";
    element("path", { d: kind.shape, fill: open ? "none" : colour, stroke: colour, "stroke-width": open ? 2.4 : 1 }, mark);
    element("title", {}, mark, `${seconds(event.start).toFixed(1)} s: ${eventWords(event)}`);
    mark.addEventListener("pointerdown", e => { e.stopPropagation(); seekTo(event.start); });
  }
  return y + Math.max(ends.length, 1) * LANE + 5;
}

// Errors that would overlap are put in different lanes; errors of groups are hollow.
function drawErrors(svg, side, x, y, seekTo) {
  const errors = data.errors.filter(error => error.side === side.name), ends = [];
  if (!errors.length) return y;
  drawHeading(svg, y, `${side.word} errors`);
  for (const error of errors) {
    const u = x(error.start), end = Math.max(x(error.end), u + 6);
    let lane = ends.findIndex(e => e < u - 2);
    if (lane < 0) lane = ends.length < 8 ? ends.length : 7;
    ends[lane] = end;
    const mark = element("rect", { x: u, y: y + 3 + lane * 10, width: end - u, height: 7, rx: 2, class: `error ${error.of}` }, svg);
    element("title", {}, mark, errorWords(error));
    mark.addEventListener("pointerdown", e => { e.stopPropagation(); seekTo(error.start); });
  }
  return y + Math.max(ends.length, 1) * 10 + 8;
}

function errorWords(error) {
  const times = [error.start, error.end].map(frame => seconds(frame).toFixed(1));
  return `${[...new Set(times)].join("–")} s  ${other ? `${sideOf[error.side].word}, ` : ""}${error.kind}: ${error.who} (${error.detail || error.cause})`;
}

function drawGroupBars(svg, side, x, y, seekTo) {
  if (!side.bars.length) return y;
  drawHeading(svg, y, `${side.word} groups`);
  const middle = bar => y + 3 + bar.lane * (BAR + 5) + BAR / 2;
  const alive = (id, frame) => side.bars.find(bar => bar.id === id && bar.start - 1 <= frame && bar.end + 1 >= frame)
    || side.bars.filter(bar => bar.id === id).sort((p, q) => Math.abs(p.start - frame) - Math.abs(q.start - frame))[0];
  for (const { frame, a, b } of side.links) {
    const from = alive(a, frame - 1), to = alive(b, frame + 1);
    if (!from || !to || from === to) continue;
    const u = x(frame), dy = [middle(from), middle(to)];
    element("path", { d: `M${u - 9},${dy[0]} C${u},${dy[0]} ${u},${dy[1]} ${u + 9},${dy[1]}`, fill: "none", stroke: colourOf(a), "stroke-width": 3.5 }, svg);
  }
  for (const bar of side.bars) {
    const from = x(bar.start), wide = Math.max(x(bar.end + 1) - from, 3), colour = colourOf(bar.id);
    const group = element("g", { style: "cursor:pointer" }, svg);
    const { tracked } = side;
    element("rect", { x: from, y: middle(bar) - BAR / 2, width: wide, height: BAR, rx: 4, fill: colour, "fill-opacity": tracked ? (bar.size < 2 ? 0.12 : 0.35) : 0.9, stroke: colour, "stroke-dasharray": tracked ? "4 3" : "none" }, group);
    const name = side.letter + bar.id;
    if (wide > 8 * name.length + 6) element("text", { x: from + 5, y: middle(bar) + 4, "font-size": 11, "font-weight": 650, fill: tracked ? theme.ink : theme.halo, style: "pointer-events:none" }, group, name);
    element("title", {}, group, `${name}: ${seconds(bar.start).toFixed(1)} to ${seconds(bar.end).toFixed(1)} s, up to ${side.groupRows ? "≈" : ""}${bar.size} people`);
    group.addEventListener("dblclick", () => seekTo(bar.start));
  }
  return y + Math.max(...side.bars.map(bar => bar.lane + 1)) * (BAR + 5) + 8;
}

function legend(box) {
  const kinds = Object.keys(KINDS).filter(kind => sides.some(side => side.events.some(event => event.kind === kind)));
  box.replaceChildren(...kinds.map(kind => {
    const item = document.createElement("span"), colour = palette[KINDS[kind].colour];
    const svg = element("svg", { width: 14, height: 14, viewBox: "-7 -7 14 14", "aria-hidden": "true" });
    const open = ["cross", "enter", "leave", "dissolve"].includes(kind);
    element("path", { d: KINDS[kind].shape, fill: open ? "none" : colour, stroke: colour, "stroke-width": open ? 2.4 : 1 }, svg);
    item.append(svg, KINDS[kind].word);
    return item;
  }));
  if (!data.unlabelled.length) return;
  const item = document.createElement("span");
  const svg = element("svg", { width: 14, height: 14, "aria-hidden": "true" });
  element("rect", { width: 14, height: 14, fill: theme.thing, opacity: 0.18 }, svg);
  item.append(svg, "groups not labelled");
  box.append(item);
}
