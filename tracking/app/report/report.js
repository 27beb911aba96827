// The report: draws the charts in the reader's theme, filters the worst moments, and opens their replays.

const $ = id => document.getElementById(id);
const dark = matchMedia("(prefers-color-scheme: dark)");
const items = [...document.querySelectorAll("#list li")];
let open = -1;

// Text and lines of Bokeh's models follow the theme; their colours of data suit both.
function colourCharts() {
  const ink = dark.matches ? "#c9d1d9" : "#3b434b", line = dark.matches ? "#39424d" : "#d0d7de";
  const looks = {
    Axis: { axis_label_text_color: ink, major_label_text_color: ink, axis_line_color: line, major_tick_line_color: line, minor_tick_line_color: null },
    Grid: { grid_line_color: line, grid_line_alpha: 0.6 },
    Legend: { label_text_color: ink, background_fill_alpha: 0, border_line_alpha: 0 },
    Text: { text_color: ink },
  };
  for (const document of Bokeh.documents) for (const model of document._all_models.values()) {
    for (const [kind, look] of Object.entries(looks)) if (model.type.endsWith(kind)) model.setv(look);
  }
}

async function drawCharts() {
  Bokeh.logger.set_level("error");
  for (const [id, item] of Object.entries(JSON.parse($("charts").textContent))) await Bokeh.embed.embed_item(item, id);
  colourCharts();
  dark.addEventListener("change", colourCharts);
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
  const inKeys = event.target.ownerDocument.querySelector("#help[open]"); // Escape closes the list of keys alone
  if (event.key === "Escape" && !inKeys) $("player").close();
}

// The replay with which the report opens: as high as its content; space and arrows reach it from the page around it.
function listenToOpening(frame) {
  const inner = frame.contentDocument;
  new ResizeObserver(() => { frame.style.height = `${inner.body.offsetHeight + 4}px`; }).observe(inner.body);
  document.addEventListener("keydown", event => {
    const { key, shiftKey, target } = event, shown = frame.getBoundingClientRect().bottom > 0;
    if (target !== document.body || !shown || ![" ", "ArrowLeft", "ArrowRight"].includes(key)) return;
    event.preventDefault();
    inner.dispatchEvent(new frame.contentWindow.KeyboardEvent("keydown", { key, shiftKey }));
  });
}

// Tables that are wider than the page say so; in closed parts their width is known when they open.
const widths = new ResizeObserver(entries => {
  for (const { target } of entries) {
    const wide = target.closest(".wide");
    wide.classList.toggle("more", wide.scrollWidth > wide.clientWidth + 1);
  }
});
for (const table of document.querySelectorAll(".wide, .wide > table")) widths.observe(table);

const opening = document.querySelector("#opening iframe");
if (opening) {
  if (opening.contentDocument.getElementById("data") && opening.contentDocument.readyState === "complete") listenToOpening(opening);
  else opening.addEventListener("load", () => listenToOpening(opening));
}
drawCharts();
if (items.length) {
  filter();
  for (const select of document.querySelectorAll("#filters select")) select.addEventListener("change", () => filter());
  for (const item of items) item.firstElementChild.addEventListener("click", event => show(event.currentTarget));
  for (const cell of document.querySelectorAll("[data-cell]")) cell.addEventListener("click", () => {
    filter({ name: cell.dataset.name, scenario: cell.dataset.scenario, kind: "" });
    $("moments").scrollIntoView({ behavior: "smooth" });
    buttons()[0]?.focus({ preventScroll: true });
  });
  $("before").addEventListener("click", () => move(-1));
  $("after").addEventListener("click", () => move(1));
  $("close").addEventListener("click", () => $("player").close());
  $("player").addEventListener("keydown", onKey);
  $("player").addEventListener("close", () => {
    const frame = $("player").querySelector("iframe"), shown = buttons()[open];
    frame.onload = null; // it would take the focus into the empty page
    frame.srcdoc = "";
    shown?.focus();
  });
}
