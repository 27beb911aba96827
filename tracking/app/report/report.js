// The report: draws the curves in the reader's theme, filters the worst moments, and opens their replays.

const $ = id => document.getElementById(id);
const items = [...document.querySelectorAll("#list li")];
let open = -1;

// A new element of an SVG; words: its text, or of a shape what is shown where the mouse rests.
function drawn(parent, kind, looks, words) {
  const made = parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", kind));
  for (const [name, value] of Object.entries(looks)) made.setAttribute(name, value);
  if (kind === "text") made.textContent = words;
  else if (words) drawn(made, "title", {}).textContent = words;
  return made;
}

// About five round numbers from low to high.
function ticks(low, high) {
  const unit = 10 ** Math.floor(Math.log10((high - low) / 4)), step = [1, 2, 5, 10].map(k => k * unit).find(s => (high - low) / s <= 6);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(6)));
}

// The curves, easy end of the axis to the left; a gap where a value is unknown.
function drawCurves() {
  const { axis, by, values, curves } = JSON.parse($("curves-data").textContent);
  const wide = $("chart-curves").clientWidth, high = 380, left = 52, right = wide - 14, top = 26, bottom = high - 46;
  const known = curves.flatMap(c => [...c.mean, ...c.low, ...c.high]).filter(v => v !== null);
  const low = Math.min(...known, 1), most = Math.max(...known, low + 0.05);
  const first = values[0], last = values[values.length - 1];
  const x = v => left + (v - first) / (last - first) * (right - left), y = v => bottom - (v - low) / (most - low) * (bottom - top);
  const at = keys => values.flatMap((v, k) => keys.every(c => c[k] !== null) ? [k] : []);
  $("chart-curves").replaceChildren();
  const svg = drawn($("chart-curves"), "svg", { width: wide, height: high, role: "img" });
  for (const v of ticks(low, most)) {
    drawn(svg, "path", { class: "grid", d: `M${left} ${y(v)}H${right}` });
    drawn(svg, "text", { x: left - 8, y: y(v) + 4, "text-anchor": "end" }, v);
  }
  for (const v of ticks(Math.min(first, last), Math.max(first, last))) {
    drawn(svg, "path", { class: "grid", d: `M${x(v)} ${top}V${bottom}` });
    drawn(svg, "text", { x: x(v), y: bottom + 18, "text-anchor": "middle" }, v);
  }
  drawn(svg, "text", { x: left, y: 14 }, by);
  drawn(svg, "text", { x: (left + right) / 2, y: high - 6, "text-anchor": "middle" }, axis);
  curves.forEach((c, k) => {
    const part = drawn(svg, "g", { fill: c.colour, stroke: c.colour }), dash = ["", "8 5", "8 4 2 4", "2 4"][k % 4];
    const line = (indices, key) => indices.map(i => `${x(values[i])} ${y(c[key][i])}`).join("L");
    const ends = at([c.low, c.high]), means = at([c.mean]);
    if (ends.length) drawn(part, "path", { d: `M${line(ends, "low")}L${line(ends.reverse(), "high")}Z`, opacity: 0.14, stroke: "none" });
    if (means.length) drawn(part, "path", { d: `M${line(means, "mean")}`, fill: "none", "stroke-width": 2.4, "stroke-dasharray": dash });
    for (const i of means) {
      drawn(part, "circle", { cx: x(values[i]), cy: y(c.mean[i]), r: 4 }, `${c.name}\n${values[i]}: ${by} ${c.mean[i].toFixed(3)}`);
    }
    const after = means.findIndex((i, n) => n > 0 && (values[means[n - 1]] - c.at) * (values[i] - c.at) <= 0);
    if (c.at !== null && after > 0) {
      const a = means[after - 1], b = means[after], share = (c.at - values[a]) / (values[b] - values[a]);
      const cx = x(c.at), cy = y(c.mean[a] + share * (c.mean[b] - c.mean[a]));
      drawn(part, "path", { d: `M${cx - 7} ${cy - 7}l14 14m0 -14l-14 14`, "stroke-width": 3 }, `${c.name} breaks at ${c.at.toPrecision(3)}`);
    }
    part.toggleAttribute("hidden", $("curve-names").children[k]?.ariaPressed === "false");
  });
}

function nameCurves() {
  JSON.parse($("curves-data").textContent).curves.forEach(({ name, colour }, k) => {
    const button = $("curve-names").appendChild(document.createElement("button"));
    button.append(document.createElement("span"), name);
    button.firstChild.style.background = colour;
    button.ariaPressed = "true";
    button.addEventListener("click", () => {
      button.ariaPressed = String(button.ariaPressed === "false");
      drawCurves();
    });
  });
  drawCurves();
  addEventListener("resize", drawCurves);
}

function filter(choice = {}) {
  for (const select of document.querySelectorAll("#filters select")) {
    if (select.dataset.field in choice) select.value = choice[select.dataset.field];
  }
  const wanted = [...document.querySelectorAll("#filters select")].filter(select => select.value);
  for (const item of items) item.hidden = wanted.some(select => item.dataset[select.dataset.field] !== select.value);
  const count = items.filter(item => !item.hidden).length;
  $("shown").value = `${count} of ${items.length}`;
  $("none").hidden = count > 0;
}

function buttons() {
  return items.filter(item => !item.hidden).map(item => item.querySelector("[data-moment]")).filter(Boolean);
}

function show(button) {
  open = buttons().indexOf(button);
  if (open < 0) return;
  if (!$("player").open) $("player").showModal();
  $("close").focus(); // keys work while the page loads
  const frame = $("player").querySelector("iframe");
  const page = $("replay-page").textContent.replaceAll("<\\/script", "</script");
  frame.srcdoc = page.replace("@@DATA@@", () => $(`moment-${button.dataset.moment}`).textContent);
  frame.onload = () => {
    frame.contentWindow.focus();
    frame.contentWindow.addEventListener("keydown", onKey);
  };
  $("which").textContent = button.querySelector("strong").textContent + ": " + button.lastChild.textContent.trim();
  $("before").disabled = open === 0;
  $("after").disabled = open === buttons().length - 1;
}

function move(by) {
  const next = buttons()[open + by];
  if (next) show(next);
}

function onKey(event) {
  if (event.key === "]") move(1);
  if (event.key === "[") move(-1);
  if (event.key === "Escape") $("player").close();
}

if ($("curves-data")) nameCurves();
if (items.length) {
  filter();
  for (const select of document.querySelectorAll("#filters select")) select.addEventListener("change", () => filter());
  for (const item of items) item.firstElementChild.addEventListener("click", event => show(event.currentTarget));
  for (const cell of document.querySelectorAll("[data-cell]")) cell.addEventListener("click", () => {
    filter({ name: cell.dataset.name, scenario: cell.dataset.scenario, kind: "" });
    $("moments").scrollIntoView({ behavior: "smooth" });
  });
  $("before").addEventListener("click", () => move(-1));
  $("after").addEventListener("click", () => move(1));
  $("close").addEventListener("click", () => $("player").close());
  $("player").addEventListener("keydown", onKey);
  $("player").addEventListener("close", () => { $("player").querySelector("iframe").srcdoc = ""; });
}
