// Asks about pairs, one after another: shows the stretch in which the two are near each other again and again, takes the
// answers, and saves them as a file for `flockscope fit grouping --labels`.

const ANSWERS = [["together", "Together", "1"], ["not", "Not", "2"], ["don't know", "Don't know", "3"]];
const AROUND = 9; // m: width of the plan around the two
const askedSide = [tracks, truth, other].find(side => side && pairsOf[side.name] && pairsOf[side.name].questions.length);
const questions = askedSide ? pairsOf[askedSide.name].questions : [];
const answers = [];
let saved = ""; // the answers in the file that was saved last
let asking = null; // what was shown before, while questions are asked

function askedPair() {
  const question = questions[answers.length];
  return { side: askedSide, ids: question ? [question.a, question.b] : [] };
}

// First and last frame that are played.
function playedSpan() {
  const question = asking && questions[answers.length];
  return question ? [question.first, question.last] : [data.from, data.to];
}

function startAsking() {
  asking = { options: { ...options }, frame: state.frame, zoom: { times: zoom.times, centre: zoom.centre } };
  // nothing that gives an answer is shown: no groups, no other people than those of the side, no errors
  Object.assign(options, { hulls: false, ellipses: false, trails: true, ids: false, detections: false, beside: false, by: "person" });
  for (const side of sides) options[side.name] = side === askedSide;
  document.body.classList.add("asking");
  ask();
}

function stopAsking() {
  play(false);
  Object.assign(options, asking.options);
  Object.assign(zoom, asking.zoom);
  const { frame } = asking;
  asking = null;
  document.body.classList.remove("asking");
  seekTo(frame);
  layOut();
}

function ask() {
  const count = questions.length, done = answers.length, question = questions[done], over = !question;
  $("ask-title").textContent = over ? "Thank you" : `${done + 1} of ${count}: do the two ringed people belong together?`;
  const kinds = ANSWERS.map(([answer, word]) => `${answers.filter(one => one === answer).length} ${word.toLowerCase()}`);
  $("ask-note").textContent = over ? `${kinds.join(", ")}.` : "Look at how they move; the stretch repeats.";
  for (const [, , key] of ANSWERS) $(`answer-${key}`).hidden = over;
  $("ask-undo").disabled = !done;
  $("ask-save").disabled = !done;
  $("ask-save").textContent = done ? `Save ${done} answer${done > 1 ? "s" : ""}` : "Save";
  $("ask-save").classList.toggle("main", over);
  play(false);
  if (over) return show();
  zoomToAsked();
  seekTo(question.first);
  play(true);
}

// The plan shows some metres around the way of the two.
function zoomToAsked() {
  if (!hasPlan) return;
  const { first, last } = questions[answers.length], { ids } = askedPair(), [x0, y0, x1, y1] = data.bounds;
  const places = [];
  for (let frame = first; frame <= last; frame++) {
    for (const row of askedSide.rows(frame)) if (ids.includes(askedSide.id[row])) places.push([askedSide.x[row], askedSide.y[row]]);
  }
  if (!places.length) return;
  const ends = k => [Math.min(...places.map(p => p[k])), Math.max(...places.map(p => p[k]))], [[l, r], [b, t]] = [ends(0), ends(1)];
  zoom.centre = [(l + r) / 2, (b + t) / 2];
  zoom.times = Math.max(Math.min((x1 - x0) / (r - l + AROUND), (y1 - y0) / (t - b + AROUND)), 1.001);
}

function answer(kind) {
  if (answers.length < questions.length) answers.push(kind);
  ask();
}

function undoAnswer() {
  answers.pop();
  ask();
}

// The content of the file of answers.
function answersFile() {
  const time = frame => Math.round(1000 * seconds(frame)) / 1000;
  return {
    format: 1, kind: "pair labels", recording: data.name, people: pairsOf[askedSide.name].people, frames: data.length, fps: data.fps,
    answers: answers.map((kind, k) => ({ a: questions[k].a, b: questions[k].b, from: time(questions[k].first), to: time(questions[k].last), answer: kind })),
  };
}

function saveAnswers() {
  const text = `${JSON.stringify(answersFile(), null, 1)}\n`;
  const link = Object.assign(document.createElement("a"), {
    href: URL.createObjectURL(new Blob([text], { type: "application/json" })), download: `${data.name.replace(/[^\w.-]+/g, "_")}-pairs.json`,
  });
  link.click();
  saved = answers.join();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function onAskingKey(event) {
  const kinds = Object.fromEntries(ANSWERS.map(([kind, , key]) => [key, () => answers.length < questions.length && answer(kind)]));
  const actions = { ...kinds, u: undoAnswer, Backspace: undoAnswer, Escape: stopAsking, " ": () => play(!state.playing), s: () => answers.length && saveAnswers() };
  const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || (event.key === " " && event.target.tagName === "BUTTON")) return;
  event.preventDefault();
  action();
}

function buildQuestions() {
  $("pair-bar").hidden = !Object.keys(pairsOf).length;
  $("ask-start").hidden = !questions.length;
  $("ask-start").textContent = `Label ${questions.length} pairs`;
  $("ask-answers").replaceChildren(...ANSWERS.map(([kind, word, key]) => {
    const button = Object.assign(tag("button", `${word} `), { id: `answer-${key}` });
    button.append(tag("kbd", key));
    button.addEventListener("click", () => answer(kind));
    return button;
  }));
  $("ask-start").addEventListener("click", startAsking);
  $("ask-undo").addEventListener("click", undoAnswer);
  $("ask-save").addEventListener("click", saveAnswers);
  $("ask-stop").addEventListener("click", stopAsking);
  window.addEventListener("beforeunload", event => { if (answers.join() !== saved) event.preventDefault(); });
}
