// Picks two people by clicks or lists, marks them, and shows why they are taken as together: the panel beside the plan.

const picked = { side: null, ids: [] };
const NEAR_CLICK = { mouse: 12, touch: 26 }; // px
const hits = { plan: [], image: [] }; // where people are drawn: [side, row, left, top, right, bottom], px of the canvas
const CHART = { gutter: 42, right: 12, gap: 16 }; // px
let pairLine = null;

// Remembers that a person is drawn in a box of the current pane.
function addHit(where, ctx, side, row, [left, top, right, bottom]) {
  const { e, f } = ctx.getTransform(), dpr = devicePixelRatio || 1, x = e / dpr, y = f / dpr;
  if (pairsOf[side.name]) hits[where].push([side, row, left + x, top + y, right + x, bottom + y]);
}

// The [side, id] at a click, or null. People of the side that is picked from already come first, then tracked ones.
function personAt(where, event) {
  const x = event.offsetX, y = event.offsetY, reach = NEAR_CLICK[event.pointerType] || NEAR_CLICK.mouse;
  const near = hits[where].map(([side, row, l, t, r, b]) => {
    const outside = Math.hypot(Math.max(l - x, 0, x - r), Math.max(t - y, 0, y - b));
    const later = picked.ids.length === 1 && picked.side !== side ? 1000 : side.tracked ? 0 : 6;
    return { side, row, outside, rank: Math.hypot((l + r) / 2 - x, (t + b) / 2 - y) + later };
  }).filter(hit => hit.outside <= reach);
  const best = near.sort((p, q) => p.rank - q.rank)[0];
  return best ? [best.side, best.side.id[best.row]] : null;
}

// A second click on a person lets go; a third person takes the place of the second.
function pick(side, id) {
  if (picked.side !== side) Object.assign(picked, { side, ids: [id] });
  else if (picked.ids.includes(id)) picked.ids = picked.ids.filter(one => one !== id);
  else picked.ids = [...picked.ids.slice(0, 1), id];
  layOutPair();
  show();
}

function letGo() {
  picked.ids = [];
  layOutPair();
  show();
}

function listenToPicks() {
  for (const where of ["plan", "image"]) {
    let down = null;
    $(where).addEventListener("pointerdown", event => { down = [event.clientX, event.clientY]; });
    $(where).addEventListener("click", event => {
      if (asking || (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 6)) return;
      const found = personAt(where, event);
      if (found) pick(...found);
    });
  }
  $("pair-a").addEventListener("change", () => {
    const [name, id] = $("pair-a").value.split(":");
    Object.assign(picked, name ? { side: sideOf[name], ids: [Number(id)] } : { ids: [] });
    layOutPair();
    show();
  });
  $("pair-b").addEventListener("change", () => {
    picked.ids = [picked.ids[0], ...($("pair-b").value ? [Number($("pair-b").value)] : [])];
    layOutPair();
    const pairs = pairsOf[picked.side.name], stints = picked.ids.length < 2 ? [] : stintsOf(pairs, picked.ids);
    // where the two are near each other, if they are not now
    if (stints.length && pairRowAt(pairs, stints, state.frame) < 0) jump(stints[0].step * pairs.size + 1);
    else show();
  });
  $("pair-clear").addEventListener("click", letGo);
}

// Fills the lists of people; the second has those who come near the first, the most probable first.
function fillLists() {
  const groups = Object.keys(pairsOf).map(name => {
    const group = Object.assign(document.createElement("optgroup"), { label: `${sideOf[name].word} people` });
    for (const id of [...new Set(sideOf[name].id)].sort((a, b) => a - b)) group.append(new Option(id, `${name}:${id}`));
    return group;
  });
  $("pair-a").replaceChildren(new Option("person", ""), ...groups);
}

function showChoice() {
  const [a, b] = picked.ids, partners = a === undefined ? [] : partnersOf(pairsOf[picked.side.name], a);
  $("pair-a").value = a === undefined ? "" : `${picked.side.name}:${a}`;
  const options = partners.map(([id, most]) => new Option(`${id} (up to ${percent(most)})`, id));
  if (b !== undefined && !partners.some(([id]) => id === b)) options.push(new Option(b, b));
  $("pair-b").replaceChildren(new Option(a === undefined || partners.length ? "and person" : "nobody came near", ""), ...options);
  $("pair-b").value = b === undefined ? "" : b;
  $("pair-b").disabled = a === undefined;
  $("pair-clear").hidden = a === undefined;
}

// Draws the charts of the picked pair anew.
function layOutPair() {
  if (!Object.keys(pairsOf).length) return;
  showChoice();
  $("pair").hidden = picked.ids.length < 2;
  pairLine = null;
  if (picked.ids.length < 2) return;
  const pairs = pairsOf[picked.side.name], stints = stintsOf(pairs, picked.ids);
  $("pair-chart").replaceChildren();
  if (stints.length) pairLine = pairChart($("pair-chart"), Math.max($("pair-chart").clientWidth, 240), pairs, stints);
  $("pair-note").textContent = pairs.note;
}

// The words about the shown moment.
function showPair(frame) {
  if (picked.ids.length < 2) return;
  const pairs = pairsOf[picked.side.name], stints = stintsOf(pairs, picked.ids), row = pairRowAt(pairs, stints, frame);
  const [a, b] = picked.ids;
  if (pairLine) pairLine(frame);
  $("pair-title").textContent = `${a} and ${b}${row < 0 ? "" : `: together with probability ${percent(pairs.probability[row])}`}`;
  $("pair-now").textContent = row < 0 ? absence(pairs, stints, frame) : momentWords(pairs, row, frame);
  $("pair-about").hidden = row < 0;
  if (row < 0) return $("pair-reasons").replaceChildren();
  const { named, rest } = reasonsOf(pairs, stints, row);
  const lines = [...named, [rest, "all else"], [pairs.bias[row], "before any evidence: most pairs are strangers"]];
  $("pair-reasons").replaceChildren(...lines.flatMap(([value, words]) => {
    const number = tag("dt", signed(value));
    number.style.color = palette[value < 0 ? 1 : 0];
    return [number, tag("dd", words)];
  }));
}

function signed(value) {
  const text = Math.abs(value).toFixed(1);
  return Number(text) === 0 ? "0.0" : `${value < 0 ? "−" : "+"}${text}`;
}

// What holds at a moment: when together counts, and why a group is not as this says.
function momentWords(pairs, row, frame) {
  const { side, ids } = picked, threshold = pairs.threshold[row], before = Math.floor((frame - 1) / pairs.size) * pairs.size;
  const held = heldWords(pairs.held, pairs.probability[row], threshold, inOneGroup(side, ids, before), inOneGroup(side, ids, frame));
  return `At ${seconds(frame).toFixed(1)} s. Positions err by about ${errorOfPositions(pairs.noise[row])}; together counts above ${percent(threshold)}. ${held}`;
}

function absence(pairs, stints, frame) {
  const meanwhile = pairs.held && inOneGroup(picked.side, picked.ids, frame) ? " They stay in one group meanwhile." : "";
  if (stints.length) return `At this moment they are not within 4 m of each other, or one of them is not seen.${meanwhile}`;
  const left = pairs.left_out ? `, or they are one of the ${pairs.left_out} least probable pairs, which this page leaves out` : "";
  return `They never came within 4 m of each other${left}.`;
}

// Charts over the time in which the two are near each other. Returns the function that puts the playhead at a frame.
function pairChart(box, width, pairs, stints) {
  const last = stints[stints.length - 1], from = Math.max(stints[0].step * pairs.size + 1, data.from);
  const to = Math.min(Math.max((last.step + last.count) * pairs.size, from + Math.ceil(data.fps)), data.to);
  const svg = element("svg", { role: "img", "aria-label": "Evidence about the two over time; click to go to a moment" });
  const span = width - CHART.gutter - CHART.right, x = frame => CHART.gutter + ((frame - from) / Math.max(to - from, 1)) * span;
  const frameOf = step => step * pairs.size + 1 + (pairs.size - 1) / 2;
  const lines = names => names.map(([name, words, dash, colour]) => ({ column: pairs.values[name] || pairs[name], words, dash, colour }));
  const place = { svg, x, stints, frameOf, width };
  let y = 14;
  y = pairPlot(place, y, 64, [0, 2, 4], "m", lines([["distance", "distance", "", 0], ["sideways", "sideways", "5 3", 1], ["lengthwise", "lengthwise", "1 3", 3]]));
  y = pairPlot(place, y, 44, [0, 1, 2], "m/s", lines([["velocity difference", "velocity difference", "", 2]]));
  y = pairPlot(place, y, 60, [0, 0.5, 1], "", [...lines([["probability", "probability", "", 4]]), { column: pairs.threshold, words: "threshold", dash: "2 3" }]);
  for (const [words, holds, colour] of pairLanes(from, to)) {
    element("text", { x: CHART.gutter, y: y + 4, fill: theme.thing }, svg, words);
    for (const [a, b] of stretchesOf(from, to, holds)) {
      element("rect", { class: "lane", x: x(a), y: y + 8, width: Math.max(x(Math.min(b + 1, to)) - x(a), 2), height: 8, rx: 3, fill: palette[colour] }, svg);
    }
    y += 32;
  }
  pairAxis(svg, x, from, to, y, span);
  svg.setAttribute("viewBox", `0 0 ${width} ${y + 18}`);
  svg.setAttribute("height", y + 18);
  const head = element("line", { y1: 6, y2: y, stroke: "currentColor", "stroke-width": 1.6 }, svg);
  const frameAt = event => Math.round(from + ((event.clientX - svg.getBoundingClientRect().left - CHART.gutter) / span) * (to - from));
  const go = event => event.buttons & 1 && jump(Math.min(Math.max(frameAt(event), from), to));
  svg.addEventListener("pointerdown", go);
  svg.addEventListener("pointermove", go);
  box.replaceChildren(svg);
  return frame => {
    head.setAttribute("visibility", from <= frame && frame <= to ? "visible" : "hidden");
    head.setAttribute("x1", x(frame));
    head.setAttribute("x2", x(frame));
  };
}

// When the two are reported, and truly, in one group: [words, condition on a frame, colour].
function pairLanes(from, to) {
  const unlabelled = data.unlabelled.some(([a, b]) => a <= from && to <= b);
  const words = side => `${side.word}: ${side === truth && unlabelled ? "groups are not labelled" : "in one group"}`;
  const { side, ids } = picked, lanes = [[words(side), frame => inOneGroup(side, ids, frame), side.tracked ? 5 : 0]];
  for (const rest of sides) {
    if (rest === side || rest.groupRows || rest.plane !== side.plane || side.plane !== "ground") continue;
    lanes.push([words(rest), frame => inOneGroupOf(rest, side, ids, frame), rest.tracked ? 5 : 0]);
  }
  return lanes;
}

function pairPlot({ svg, x, stints, frameOf, width }, top, height, ticks, unit, lines) {
  const most = ticks[ticks.length - 1], y = value => top + 18 + height * (1 - Math.min(value, most) / most);
  for (const tick of ticks) {
    element("line", { x1: CHART.gutter, x2: width - CHART.right, y1: y(tick), y2: y(tick), stroke: theme.grid }, svg);
    element("text", { x: CHART.gutter - 6, y: y(tick) + 4, "text-anchor": "end", fill: theme.thing }, svg, `${tick}${tick === most && unit ? ` ${unit}` : ""}`);
  }
  let at = CHART.gutter;
  for (const { column, words, dash, colour } of lines) {
    const stroke = colour === undefined ? theme.ink : palette[colour];
    element("line", { x1: at, x2: at + 18, y1: top + 6, y2: top + 6, stroke, "stroke-width": 2.4, "stroke-dasharray": dash }, svg);
    element("text", { x: at + 23, y: top + 10 }, svg, words);
    at += 40 + 7 * words.length;
    for (const stint of stints) {
      let d = "", open = false;
      for (let k = 0; k < stint.count; k++) {
        const value = column[stint.row + k];
        if (Number.isNaN(value)) open = false;
        else {
          d += `${open ? "L" : "M"}${x(frameOf(stint.step + k)).toFixed(1)},${y(value).toFixed(1)}`;
          if (!open) d += "h0.1";
          open = true;
        }
      }
      if (d) element("path", { d, fill: "none", stroke, "stroke-width": 2, "stroke-dasharray": dash, "stroke-linecap": "round" }, svg);
    }
  }
  return top + 18 + height + CHART.gap;
}

function pairAxis(svg, x, from, to, y, span) {
  const total = seconds(to) - seconds(from), step = [0.5, 1, 2, 5, 10, 20, 60, 120, 300, 600].find(s => total / s <= span / 60) || 1200;
  for (let t = Math.ceil(seconds(from) / step) * step; t <= seconds(to) + 1e-9; t += step) {
    element("text", { x: x(1 + t * data.fps), y: y + 12, "text-anchor": "middle", fill: theme.thing }, svg, `${t} s`);
  }
}

// Rings round the picked people, or round those of the question, and a line between them. boxOf: corners in px of a row.
function drawPicked(pane, shown, boxOf) {
  const { ctx, frame } = pane, { side, ids } = asking ? askedPair() : picked;
  if (!shown.includes(side) || !ids.length) return;
  const rows = [...side.rows(frame)].filter(row => ids.includes(side.id[row]));
  const middles = rows.map(row => boxOf(side, row)).filter(box => box.every(Number.isFinite)).map(([l, t, r, b]) => {
    for (const [colour, wide] of [[theme.halo, 5], [theme.ink, 2.4]]) {
      ctx.strokeStyle = colour;
      ctx.lineWidth = wide;
      ctx.beginPath();
      ctx.ellipse((l + r) / 2, (t + b) / 2, (r - l) / 2 + 6, (b - t) / 2 + 6, 0, 0, 2 * Math.PI);
      ctx.stroke();
    }
    return [(l + r) / 2, (t + b) / 2];
  });
  if (middles.length < 2) return;
  ctx.lineWidth = 1.4;
  ctx.setLineDash([3, 3]);
  strokeLine(ctx, middles);
  ctx.setLineDash([]);
}
