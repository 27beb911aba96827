// The evidence about pairs of people (pair_columns.py): decodes it, finds that of a moment, and puts it into words.

const REASONS = 4; // quantities that are named, those that weigh most

function decodeBytes(text, [low, step]) {
  return Float32Array.from(atob(text), letter => {
    const whole = letter.charCodeAt(0);
    return whole === 255 ? NaN : low + whole * step;
  });
}

// Of one side: the columns, and stints of rows in consecutive steps by pair.
function decodePairs(raw) {
  const stints = new Map();
  let row = 0;
  for (const [a, b, step, count] of raw.stints) {
    if (!stints.has(a)) stints.set(a, new Map());
    const own = stints.get(a);
    if (!own.has(b)) own.set(b, []);
    own.get(b).push({ step, count, row });
    row += count;
  }
  const columns = (table, range) => Object.fromEntries(Object.entries(table).map(([name, text]) => [name, decodeBytes(text, range(name))]));
  return {
    ...raw, stints,
    probability: decodeBytes(raw.probability, raw.probability_range),
    threshold: decodeBytes(raw.threshold, raw.probability_range),
    bias: decodeBytes(raw.bias, raw.term_range),
    noise: decodeBytes(raw.noise, raw.noise_range),
    values: columns(raw.values, name => raw.ranges[name]),
    terms: columns(raw.terms, () => raw.term_range),
  };
}

function stintsOf(pairs, [a, b]) {
  const low = pairs.stints.get(Math.min(a, b));
  return (low && low.get(Math.max(a, b))) || [];
}

// The row of a pair at a frame, or -1.
function pairRowAt(pairs, stints, frame) {
  const step = Math.floor((frame - 1) / pairs.size);
  const stint = stints.find(one => one.step <= step && step < one.step + one.count);
  return stint ? stint.row + step - stint.step : -1;
}

// The other people about whom there is evidence with one, as [id, greatest probability], the most probable first.
function partnersOf(pairs, id) {
  const found = [];
  const add = (other, stints) => {
    const all = stints.flatMap(({ row, count }) => [...pairs.probability.subarray(row, row + count)]);
    found.push([other, Math.max(...all)]);
  };
  for (const [a, own] of pairs.stints) for (const [b, stints] of own) if (a === id || b === id) add(a === id ? b : a, stints);
  return found.sort((p, q) => q[1] - p[1] || p[0] - q[0]);
}

// What decides at a row: [log-odds, words] of the quantities that weigh most, and the sum of all others.
function reasonsOf(pairs, stints, row) {
  const all = Object.entries(pairs.terms).map(([name, column]) => [column[row], reasonWords(pairs, stints, row, name)]);
  all.sort((p, q) => Math.abs(q[0]) - Math.abs(p[0]));
  return { named: all.slice(0, REASONS), rest: all.slice(REASONS).reduce((sum, [value]) => sum + value, 0) };
}

function reasonWords(pairs, stints, row, name) {
  const value = key => pairs.values[key][row], known = !Number.isNaN(name in pairs.values ? value(name) : 0);
  const walks = !Number.isNaN(value("lengthwise"));
  const words = {
    distance: () => `${value(name).toFixed(1)} m apart`,
    "velocity difference": () => (known ? `velocities differ by ${value(name).toFixed(1)} m/s` : "how alike they moved before"),
    sideways: () => (walks ? `side by side, ${value(name).toFixed(1)} m across their way` : `standing, ${value(name).toFixed(1)} m apart`),
    lengthwise: () => (walks ? `one is ${value(name).toFixed(1)} m ahead of the other` : "who was ahead while they walked"),
    growth: () => growthWords(value(name)),
    turn: () => (known ? `their ways differ by ${Math.round((value(name) * 180) / Math.PI)}°` : "directions of their ways before"),
    "walking difference": () => "speed and direction while both walk",
    "one walks": () => oneWalksWords(value(name)),
    file: () => fileWords(value(name)),
    pace: () => (value(name) < 0.3 ? "they stand" : known ? `they walk at ${value(name).toFixed(1)} m/s` : "how fast they walk"),
    "offset in noise": () => noiseWords("steady offset, given how much positions err", value(name)),
    "velocity difference in noise": () => noiseWords("difference of velocities, given how much positions err", value(name)),
    "share of mates": () => shareWords(pairs.terms[name][row]),
    "time near": () => `within 4 m of each other for ${nearSeconds(pairs, stints, row).toFixed(0)} s`,
  };
  return (words[name] || (() => name))();
}

function growthWords(speed) {
  if (!(Math.abs(speed) > 0.1)) return "their distance hardly changes";
  return speed > 0 ? `moving apart by ${speed.toFixed(1)} m/s` : `coming nearer by ${(-speed).toFixed(1)} m/s`;
}

function oneWalksWords(share) {
  return share > 0.05 ? `one stands and the other walks, ${Math.round(100 * share)} % of the time` : "both walk, or both stand";
}

function fileWords(ends) {
  if (Number.isNaN(ends)) return "in no file: they stand, or are too far apart";
  return ends > 0.1 ? "in one file with others, as in a queue" : "in no file with others";
}

// A length in units of what mates and errors of positions make of it: of mates it is mostly below 2.
function noiseWords(words, length) {
  if (Number.isNaN(length)) return words;
  return `${words}: ${length < 2 ? "as mates have it" : `${length.toFixed(0)} times that of mates`}`;
}

function shareWords(shift) {
  if (Math.abs(shift) < 0.05) return "as many people here are mates as usual";
  return shift < 0 ? "few people here are mates" : "many people here are mates";
}

function errorOfPositions(noise) {
  return noise < 0.095 ? `${Math.max(Math.round(100 * noise), 1)} cm` : `${noise.toFixed(1)} m`;
}

// Why two people with a probability are, or are not, in one group, where the threshold alone says otherwise; else "".
// before, now: whether they were in one group a step before, and are now.
function heldWords(held, probability, threshold, before, now) {
  if (!held || now === probability > threshold) return "";
  const [hold, join] = held, least = before ? threshold - hold : threshold + join, ends = percent(Math.max(least, 0));
  if (now) return before && probability > least ? `In one group because they were a moment before: it lasts down to ${ends}.` : "In one group because of its other members.";
  return !before && probability <= least ? `Not yet in one group: to come into one takes more than ${ends}.` : "Not in one group because of others near them.";
}

function percent(share) {
  return share > 0 && share < 0.01 ? "under 1 %" : `${Math.round(100 * share)} %`;
}

// The time, s, for which rows of a pair have been seen up to a row.
function nearSeconds(pairs, stints, row) {
  const rows = stints.reduce((sum, stint) => sum + Math.min(Math.max(row - stint.row + 1, 0), stint.count), 0);
  return (rows * pairs.size) / data.fps;
}

// Stretches [first, last] of frames in which a condition on a frame holds.
function stretchesOf(from, to, holds) {
  const found = [];
  for (let frame = from; frame <= to; frame++) {
    if (!holds(frame)) continue;
    const last = found[found.length - 1];
    if (last && last[1] === frame - 1) last[1] = frame;
    else found.push([frame, frame]);
  }
  return found;
}

// Whether two people of a side are in one group of it at a frame.
function inOneGroup(side, ids, frame) {
  const rows = [...side.rows(frame)].filter(row => ids.includes(side.id[row]));
  return rows.length === 2 && side.group[rows[0]] >= 0 && side.group[rows[0]] === side.group[rows[1]];
}

// Whether the people of another side who are nearest to these two, within 1 m, are in one group of that side.
function inOneGroupOf(other, side, ids, frame) {
  const here = [...side.rows(frame)].filter(row => ids.includes(side.id[row])), theirs = [...other.rows(frame)];
  const nearest = here.map(row => {
    const far = one => Math.hypot(other.x[one] - side.x[row], other.y[one] - side.y[row]);
    return theirs.filter(one => far(one) <= 1).sort((p, q) => far(p) - far(q))[0];
  });
  const [p, q] = nearest;
  return nearest.length === 2 && p !== undefined && q !== undefined && p !== q && other.group[p] >= 0 && other.group[p] === other.group[q];
}

const pairsOf = Object.fromEntries(sides.filter(side => data.pairs && data.pairs[side.name]).map(side => [side.name, decodePairs(data.pairs[side.name])]));
