// The page: its state, its controls and keys, and the texts about the shown frame.

const $ = id => document.getElementById(id);
const state = { frame: data.start, playing: false, speed: 1, clock: 0, then: 0 };
const options = { truth: true, tracks: true, other: true, detections: false, hulls: true, ellipses: true, trails: true, ids: true, beside: Boolean(other), video: true, by: "person" };
const player = makePlayer(data.video, onVideoChange);
const wholes = sides.some(side => side.groupRows);
const background = data.background && Object.assign(new Image(), { src: data.background, onload: () => show() });
const TOGGLES = [
  ["truth", "Truth", "t", truth], ["tracks", other ? tracks.word : "Tracks", "k", tracks],
  ["other", other && other.word, "o", other], ["beside", "Side by side", "b", sides.length > 1],
  ["detections", "Detections", "d", found], ["hulls", "Groups", "h", true],
  ["ellipses", "Extents", "e", wholes], ["trails", "Trails", "l", hasPlan || wholes],
  ["video", player ? "Video" : "Picture", "v", player || background], ["ids", "Ids", "i", true],
];
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];
const KEYS = [
  ["space", "play, pause"], ["← →", "one frame back, on"], ["shift ← →", "one second"], ["Home End", "first, last frame"],
  ["n p", "next, previous event"], ["+ −", "faster, slower"], ["c", "colour by person or group"], ["1 … 4", "plan: whole, larger; also the wheel"],
  ...TOGGLES.filter(toggle => toggle[3]).map(([, word, key]) => [key, word.toLowerCase()]), ["?", "this list"],
];
if (data.errors.length) KEYS.push(["x z", "next, previous error"]);
if (Object.keys(pairsOf).length) KEYS.push(["click", "a person, then another: why together"], ["Esc", "let go of them"]);
const events = sides.flatMap(side => side.events).sort((a, b) => a.start - b.start);
let line = null, eventButtons = [], errorButtons = [];

function seekTo(frame) {
  state.frame = Math.min(Math.max(Math.round(frame), data.from), data.to);
  show();
}

function show() {
  const frame = state.frame;
  $("stages").classList.toggle("beside", options.beside && sides.filter(side => options[side.name]).length > 1);
  if (data.opening) follow();
  hits.plan = [];
  if (hasPlan) drawPlan($("plan"), frame, options);
  showImage();
  if (line) line.move(frame);
  $("seek").value = frame;
  $("seek").setAttribute("aria-valuetext", `frame ${frame}, ${seconds(frame).toFixed(1)} seconds`);
  showErrors(frame);
  $("clock").value = `${frame} / ${data.length} · ${seconds(frame).toFixed(2)} s`;
  showFacts(frame);
  showPair(frame);
}

// The image shows the video's frame, which may arrive a moment after it was wanted.
function showImage() {
  if (!hasImage) return;
  if (videoShown() && !(state.playing && player.canPlay)) player.seek(state.frame);
  hits.image = [];
  drawImage($("image"), videoShown() && player.frame ? player.frame : state.frame, options);
}

function videoShown() {
  return Boolean(player) && player.works && options.video;
}

// The video shows another frame, or cannot be played.
function onVideoChange() {
  if (player.failed) {
    $("image-note").textContent = `the video cannot be played here${data.video.src ? `: ${data.video.src}` : ""}`;
    player.failed = false;
    if (state.playing) play(true);
    return show();
  }
  if (data.opening && !state.begun && player.frame) {
    state.begun = true;
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play(true);
  }
  if (!state.playing || !player.canPlay) return showImage();
  state.frame = player.frame;
  show();
  if (state.frame >= playedSpan()[1]) end();
}

function showFacts(frame) {
  const rows = [["frame", `${frame} of ${data.length}, ${seconds(frame).toFixed(2)} s`]];
  for (const side of sides) {
    if (!side.groupRows) rows.push([`${side.word} people`, side.rows(frame).length]);
    const groups = side.groupRows
      ? [...side.rows(frame)].map(row => groupWords(side, row))
      : [...groupsAt(side, frame)].map(([id, members]) =>
        `${side.letter}${id} (${members.map(row => side.id[row]).join(", ")})`);
    const none = side === truth && data.unlabelled.some(([a, b]) => a <= frame && frame <= b) ? "not labelled" : "none";
    rows.push([`${side.word} groups`, groups.join(" · ") || none]);
  }
  if (found) rows.push(["detections", found.rows(frame).length]);
  const now = events.filter(event => event.start <= frame && frame <= Math.max(event.end, event.start + data.fps / 2));
  rows.push(["now", now.map(event => `${sideOf[event.side].word} ${event.kind}`).join(", ") || "–"]);
  $("facts").replaceChildren(...rows.flatMap(([key, value]) => [tag("dt", key), tag("dd", value)]));
  eventButtons.forEach((button, k) => button.setAttribute("aria-current", now.includes(events[k])));
  errorButtons.forEach((button, k) => {
    const error = data.errors[k];
    button.setAttribute("aria-current", error.start <= frame && frame <= error.end);
  });
}

// Shows the errors of each tracker at a frame in words.
function showErrors(frame) {
  const shown = data.errors.length ? sides.filter(side => side.tracked && options[side.name]) : [];
  const words = shown.map(side => errorsAt(side, frame));
  const key = JSON.stringify([shown.map(side => side.name), words.map(found => found.map(error => data.errors.indexOf(error)))]);
  if ($("now").dataset.key === key) return;
  $("now").dataset.key = key;
  $("now").replaceChildren(...shown.map((side, k) => {
    const box = tag("div", ""), lines = words[k].map(error => {
      const line = tag("p", ""), kind = tag("span", error.kind);
      kind.className = "kind";
      line.append(kind, `: ${error.who}; cause: ${error.detail || (error.cause === "tracker" ? "the tracker alone" : error.cause)}`);
      return line;
    });
    box.classList.toggle("wrong", lines.length > 0);
    box.append(tag("strong", side.word), ...(lines.length ? lines : [tag("p", "no error at this moment")]));
    return box;
  }));
}

function tag(name, text) {
  const node = document.createElement(name);
  node.textContent = text;
  return node;
}

function play(on) {
  state.playing = on;
  $("play").querySelector("path").setAttribute("d", on ? "M3 2h4v12H3z M9 2h4v12H9z" : "M4 2v12l10-6z");
  $("play").setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return player && player.pause();
  const [from, to] = playedSpan();
  if (state.frame >= to || state.frame < from) {
    state.playing = false; // so that the video goes back as well
    seekTo(from);
    state.playing = true;
  }
  if (videoShown() && player.canPlay) return player.play(state.speed);
  state.clock = state.frame;
  state.then = performance.now();
  requestAnimationFrame(tick);
}

function tick(now) {
  if (!state.playing || (videoShown() && player.canPlay)) return;
  state.clock += ((now - state.then) / 1000) * data.fps * state.speed;
  state.then = now;
  const frame = Math.floor(state.clock);
  if (frame !== state.frame) seekTo(frame);
  if (state.frame >= playedSpan()[1]) end();
  else requestAnimationFrame(tick);
}

// The replay at the head of a report starts again, and so does the stretch of a question.
function end() {
  play(false);
  if (data.opening || asking) play(true);
}

function step(count) {
  play(false);
  seekTo(state.frame + count);
}

function toNext(items, direction) {
  const starts = items.map(item => item.start).filter(start => (start - state.frame) * direction > 0);
  if (starts.length) jump(direction > 0 ? Math.min(...starts) : Math.max(...starts));
}

function jump(frame) {
  play(false);
  seekTo(frame);
}

function speed(change) {
  const next = SPEEDS[Math.min(Math.max(SPEEDS.indexOf(state.speed) + change, 0), SPEEDS.length - 1)];
  state.speed = next;
  $("speed").value = next;
  applySpeed();
}

function applySpeed() {
  if (player) player.video.playbackRate = state.speed;
}

function toggle(name) {
  if (name === "video") play(false);
  options[name] = !options[name];
  $(`show-${name}`).checked = options[name];
  show();
}

function colourBy(by) {
  options.by = by;
  $("by").value = by;
  show();
}

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
  if (asking) return onAskingKey(event);
  const inField = ["SELECT", "INPUT"].includes(event.target.tagName) && event.target.type !== "checkbox";
  const onButton = event.target.tagName === "BUTTON" || event.target.type === "checkbox";
  const one = event.shiftKey ? Math.max(Math.round(data.fps), 1) : 1;
  const zooms = Object.fromEntries([1, 2, 4, 8].map((times, k) => [k + 1, () => { zoomTo(times); show(); }]));
  const actions = {
    ...(hasPlan ? zooms : {}),
    " ": onButton ? null : () => play(!state.playing),
    ArrowRight: () => step(one), ArrowLeft: () => step(-one), Home: () => jump(data.from), End: () => jump(data.to),
    n: () => toNext(events, 1), p: () => toNext(events, -1),
    x: () => toNext(data.errors, 1), z: () => toNext(data.errors, -1), "+": () => speed(1), "=": () => speed(1), "-": () => speed(-1),
    c: () => colourBy(options.by === "person" ? "group" : "person"), "?": () => $("help").showModal(),
    ...(picked.ids.length ? { Escape: letGo } : {}),
  };
  for (const [name, , key, there] of TOGGLES) if (there) actions[key] = () => toggle(name);
  const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || (inField && event.target.tagName === "SELECT")) return;
  event.preventDefault();
  action();
}

function buildHead() {
  const about = [`${data.length} frames, ${data.fps} per second, ${seconds(data.length).toFixed(1)} s`];
  if (truth) about.push(`${new Set(truth.id).size} true people`);
  for (const side of [tracks, other]) if (side) {
    about.push(`${new Set(side.id).size} ${side.groupRows ? "groups" : "people"} by ${side === other ? data.other.tracker : data.tracker}`);
  }
  document.querySelector("h1").textContent = data.name; // all moments of a report have one title
  $("about").textContent = about.join(" · ");
  $("plan-note").textContent = hasPlan && tracks && truth ? planNote() : "";
  $("image-note").textContent = hasImage && tracks && truth ? "true: solid · tracked: dashed · detected: dotted boxes" : "";
  $("plan-stage").hidden = !hasPlan;
  $("image-stage").hidden = !hasImage;
}

function planNote() {
  const flat = sides.find(side => side.plane === "image");
  if (flat) return `${flat.word} in the image only`;
  return wholes ? "true: bodies, solid · tracked: dashed"
    : "true: bodies, solid, ids upright · tracked: rings, dashed, ids slanted";
}

function buildControls() {
  $("seek").min = data.from;
  $("seek").max = data.to;
  for (const value of SPEEDS) $("speed").append(new Option(`${value}×`, value, value === 1, value === 1));
  for (const [name, word, key, there] of TOGGLES) {
    if (!there) continue;
    const box = Object.assign(document.createElement("input"), { type: "checkbox", id: `show-${name}`, checked: options[name] });
    const holder = tag("label", "");
    holder.title = `${word} (${key})`;
    holder.append(box, word);
    box.addEventListener("change", () => toggle(name));
    $("toggles").append(holder);
  }
  const by = Object.assign(document.createElement("select"), { id: "by" });
  by.setAttribute("aria-label", "Colour by");
  by.append(new Option("colour by person", "person"), new Option("colour by group", "group"));
  by.addEventListener("change", () => colourBy(by.value));
  $("toggles").append(by);
  $("keys").replaceChildren(...KEYS.flatMap(([key, word]) => {
    const name = document.createElement("dt");
    name.append(tag("kbd", key));
    return [name, tag("dd", word)];
  }));
  eventButtons = list("events", events, event => `${seconds(event.start).toFixed(1)} s  ${sideOf[event.side].word} ${eventWords(event)}`);
  $("errors-box").hidden = !data.errors.length;
  errorButtons = list("errors", data.errors, errorWords);
}

// Fills a list with a button for each item, which goes to its first frame; returns the buttons.
function list(id, items, words) {
  const buttons = items.map(item => {
    const button = tag("button", words(item));
    button.addEventListener("click", () => jump(item.start));
    return button;
  });
  $(id).replaceChildren(...buttons.map(button => {
    const item = document.createElement("li");
    item.append(button);
    return item;
  }));
  if (!items.length) $(id).append(tag("li", "none"));
  return buttons;
}

function layOut() {
  chooseTheme();
  line = timeline($("timeline"), Math.max($("timeline").clientWidth, 320), jump);
  legend($("legend"));
  wholeGroupsKey($("groups-key"));
  layOutPair();
  show();
}

function listen() {
  $("first").addEventListener("click", () => jump(data.from));
  $("back").addEventListener("click", () => step(-1));
  $("next").addEventListener("click", () => step(1));
  $("play").addEventListener("click", () => play(!state.playing));
  $("seek").addEventListener("input", () => jump($("seek").valueAsNumber));
  $("speed").addEventListener("change", () => {
    state.speed = Number($("speed").value);
    applySpeed();
  });
  if (hasPlan) listenToZoom($("plan"), show);
  $("help-button").addEventListener("click", () => $("help").showModal());
  const drag = event => {
    if (!(event.buttons & 1)) return;
    const left = $("timeline").firstChild.getBoundingClientRect().left;
    if (event.clientX - left > gutter - 8) jump(line.frameAt(event.clientX - left));
  };
  $("timeline").addEventListener("pointerdown", drag);
  $("timeline").addEventListener("pointermove", drag);
  document.addEventListener("keydown", onKey);
  darkQuery.addEventListener("change", layOut);
  let width = 0;
  new ResizeObserver(() => {
    if (innerWidth === width) return;
    width = innerWidth;
    layOut();
  }).observe(document.body);
}

// FILE.html#57 shows frame 57.
function seekToAddress() {
  const frame = Number(location.hash.slice(1));
  if (frame >= 1) jump(frame);
}

document.body.classList.toggle("opening", Boolean(data.opening));
if (data.opening) zoom.times = FOLLOWED;
if (player) $("under").append(player.video);
buildHead();
buildControls();
buildQuestions();
fillLists();
layOut();
listen();
listenToPicks();
seekToAddress();
if (data.zoomed && hasPlan) {
  zoomTo(3);
  show();
}
addEventListener("hashchange", seekToAddress);
