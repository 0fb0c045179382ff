'use strict';
/* Scenarios of a run: its trials evaluated again, or weighted. Without DOM.
   No distribution and no statistic stands here: tables made by Python hold both. */

const decoded = (text, Kind) => new Kind(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
const clamp = (x, least, most) => Math.min(Math.max(x, least), most);

/* Value of a table at a position in [0, 1] of its length. */
function along(table, share) {
  const place = clamp(share, 0, 1) * (table.length - 1);
  const below = Math.min(place | 0, table.length - 2);
  return table[below] + (table[below + 1] - table[below]) * (place - below);
}

/* Place of a value in an ascending table: index of the interval that holds it. */
function interval(table, x) {
  let low = 0, high = table.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (table[middle] <= x) low = middle; else high = middle; }
  return low;
}

function interpolated(xs, ys, x) {
  const last = xs.length - 1;
  if (x <= xs[0]) return ys[0];
  if (x >= xs[last]) return ys[last];
  const i = interval(xs, x);
  return ys[i] + (ys[i + 1] - ys[i]) * (x - xs[i]) / (xs[i + 1] - xs[i]);
}

/* Deviations in half widths about the middle of a zone, by normal score. */
class Distribution {
  constructor(table, farthest) {
    Object.assign(this, table);
    this.farthest = farthest;
    this.deviations = decoded(table.deviations, Float64Array);
    this.logSlope = table.log_slope && decoded(table.log_slope, Float64Array);
  }
  share(score) { return (score + this.farthest) / (2 * this.farthest); }
  at(score) { return along(this.deviations, this.share(score)); }
  slope(score) { return along(this.logSlope, this.share(score)); }
  /* Normal score of a deviation; NaN outside. */
  score(x) {
    const table = this.deviations, last = table.length - 1, edge = 1e-9 * (table[last] - table[0]);
    if (!(x >= table[0] - edge && x <= table[last] + edge)) return NaN;
    const i = interval(table, x), part = (x - table[i]) / (table[i + 1] - table[i]);
    return this.farthest * (2 * (i + clamp(part, 0, 1)) / last - 1);
  }
}

const even = x => { const r = Math.round(x); return Math.abs(x % 1) === 0.5 && r % 2 ? r - 1 : r; };
const RULES = {
  '+': (a, b) => a + b, '-': (a, b) => a - b, '*': (a, b) => a * b, '/': (a, b) => a / b,
  '**': Math.pow, power: Math.pow, mod: (a, b) => a - b * Math.floor(a / b), round: even,
  '<': (a, b) => +(a < b), '<=': (a, b) => +(a <= b), '>': (a, b) => +(a > b), '>=': (a, b) => +(a >= b),
  IF: (condition, met, other) => condition ? met : other,
};

/* Value of a formula's tree: a number, or float64[trial] where columns are. */
function valueOf(node, columns, kept) {
  if (typeof node === 'number') return node;
  if (node[0] === 'link') return columns[node[1]];
  if (kept?.has(node)) return kept.get(node);
  const parts = node.slice(1).map(part => valueOf(part, columns, kept));
  const rule = RULES[node[0]] ?? Math[node[0]], [a, b] = parts;
  const n = parts.find(part => part.length)?.length;
  if (n === undefined) return rule(...parts);
  const out = new Float64Array(n), [X, Y] = parts.map(part => part.length ? part : new Float64Array(n).fill(part));
  if (node[0] === '-') for (let k = 0; k < n; k++) out[k] = X[k] - Y[k];
  else if (node[0] === '+') for (let k = 0; k < n; k++) out[k] = X[k] + Y[k];
  else if (node[0] === '*') for (let k = 0; k < n; k++) out[k] = X[k] * Y[k];
  else if (parts.length === 2) for (let k = 0; k < n; k++) out[k] = rule(X[k], Y[k]);
  else for (let k = 0; k < n; k++) out[k] = rule(...parts.map(part => part.length ? part[k] : part));
  return out;
}

const holds = (node, links) => Array.isArray(node) && (node[0] === 'link' ? links.has(node[1]) : node.some(part => holds(part, links)));
/* Keep the values of those parts of a formula in which some links do not stand. */
function keepOthers(node, columns, links, kept) {
  if (!Array.isArray(node) || node[0] === 'link') return;
  if (holds(node, links)) node.forEach(part => keepOthers(part, columns, links, kept));
  else kept.set(node, valueOf(node, columns));
}

const WORST_FIRST = ['not met', 'undecided', 'no interval', 'met'];

class Explorer {
  constructor(data) {
    Object.assign(this, data);
    this.kinds = Object.fromEntries(Object.entries(data.distributions).map(
      ([name, table]) => [name, new Distribution(table, data.farthest)]));
    this.areas = decoded(data.areas, Float64Array);
    const n = this.rows, whole = data.score_bits === 16;
    const scores = decoded(data.scores, whole ? Int16Array : Float32Array);
    this.scores = data.parts.map((part, p) => Float64Array.from(
      scores.subarray(p * n, (p + 1) * n), z => whole ? z * data.farthest / 32767 : z));
    this.times = data.times ? Float64Array.from(decoded(data.times, Float32Array)) : new Float64Array(n).fill(1);
    this.total = this.times.reduce((sum, x) => sum + x, 0);
    for (const response of data.responses) {
      response.values = response.values && Float64Array.from(decoded(response.values, Float32Array));
    }
    for (const part of data.parts) part.fixed = part.fixed && Float64Array.from(decoded(part.fixed, Float32Array));
    this.drawing = this.scenario();
    this.moved = {}; this.deviating = {}; this.terms = {};
    this.joined = new Set(data.groups.flatMap(group => group.members));
  }
  scenario() {
    return {
      entries: this.entries.map(e => ({nominal: e.nominal, lower: e.lower, upper: e.upper, shift: 0, kind: e.kind, grade: e.grade})),
      limits: this.responses.map(r => ({lower: r.lower, upper: r.upper})),
    };
  }
  half(state) { return (state.upper - state.lower) / 2; }
  middle(state) { return (state.upper + state.lower) / 2 + state.shift; }
  /* State with another half width about the deviation that stays, as `tolstat what-if` has it. */
  resized(i, state, half) {
    const {centre} = this.entries[i], drawn = this.drawing.entries[i], ratio = half / this.half(drawn);
    return {...state, lower: centre + ratio * (drawn.lower - centre), upper: centre + ratio * (drawn.upper - centre), grade: ''};
  }
  graded(i, state, grade) {
    const zone = this.entries[i].grades[grade], drawn = this.drawing.entries[i];
    return zone && grade !== drawn.grade ? {...state, lower: zone[0], upper: zone[1], grade} : {...state, lower: drawn.lower, upper: drawn.upper, grade: drawn.grade};
  }
  changed(scenario, i) {
    const a = this.drawing.entries[i], b = scenario.entries[i];
    return ['nominal', 'lower', 'upper', 'shift', 'kind'].some(key => a[key] !== b[key]);
  }
  changes(scenario) { return this.entries.map((_, i) => i).filter(i => this.changed(scenario, i)); }
  limitChanged(scenario, r) {
    return ['lower', 'upper'].some(end => scenario.limits[r][end] !== this.drawing.limits[r][end]);
  }
  /* An entry of [limits] may be of several responses: these move as one. */
  limited(scenario, r, limit) {
    const entry = i => this.responses[i].limit_entry;
    return {...scenario, limits: scenario.limits.map((other, i) => entry(i) === entry(r) ? limit : other)};
  }
  limitChanges(scenario) {
    const entries = this.responses.map(response => response.limit_entry);
    return entries.map((_, r) => r).filter(r => this.limitChanged(scenario, r) && entries.indexOf(entries[r]) === r);
  }

  // ---- trials evaluated again
  column(p, state) {
    const part = this.parts[p], base = state.nominal + this.middle(state), half = this.half(state);
    if (part.fixed) return part.fixed.map(x => state.nominal + x);
    const kind = this.kinds[state.kind];
    const deviations = this.deviating[`${p} ${state.kind}`] ??= this.scores[p].map(z => kind.at(z));
    const out = new Float64Array(deviations.length);
    for (let k = 0; k < out.length; k++) out[k] = base + half * deviations[k];
    return out;
  }
  columns(scenario) {
    return this.parts.map((part, p) => {
      const state = this.state(scenario, part), key = [state.nominal, state.lower, state.upper, state.shift, state.kind].join();
      if (this.moved[p]?.key !== key) this.moved[p] = {key, column: this.column(p, state)};
      return this.moved[p].column;
    });
  }
  /* What is assumed of a part: that of its entry, or as it was sampled. */
  state(scenario, part) {
    if (part.entry < 0) return {shift: 0, ...part};
    const state = scenario.entries[part.entry];
    return {...state, nominal: part.nominal + state.nominal - this.entries[part.entry].nominal};
  }
  sizes(scenario, size) { return this.parts.map(part => size(this.state(scenario, part))); }
  /* Slopes, worst case and root sum square of a formula, without trials. */
  stack(scenario, r) {
    const tree = this.responses[r].formula, at = sizes => valueOf(tree, sizes);
    const middle = this.sizes(scenario, s => s.nominal + this.middle(s));
    const nominal = at(this.sizes(scenario, s => s.nominal));
    const steps = this.parts.map((part, p) => {
      const state = this.state(scenario, part), kind = this.kinds[state.kind], half = this.half(state);
      const step = 1e-4 * (half || 1e-6), low = [...middle], high = [...middle];
      low[p] -= step; high[p] += step;
      const slope = (at(high) - at(low)) / (2 * step);
      const mean = part.fixed ? part.mean : this.middle(state) + half * kind.mean;
      return {name: part.name, entry: part.entry, slope, half, move: slope * mean, reach: Math.abs(slope) * half,
        sigma: Math.abs(slope) * (part.fixed ? part.sigma : half * kind.sigma)};
    }).filter(step => step.slope);
    const reach = new Map(steps.map(step => [step.name, Math.sign(step.slope) * step.half]));
    const corner = sign => at(middle.map((x, p) => x + sign * (reach.get(this.parts[p].name) ?? 0)));
    const variance = steps.reduce((sum, s) => sum + s.sigma ** 2, 0);
    return {nominal, steps, variance, rss: [nominal + steps.reduce((sum, s) => sum + s.move, 0), Math.sqrt(variance)],
      worst: [corner(-1), corner(1)]};
  }

  // ---- stored trials weighted by the ratio of densities
  /* Of units sampled with one state of a part: their normal scores in another, and the log ratio of densities. */
  term(p, from, to, rows) {
    const old = this.kinds[from.kind], kind = this.kinds[to.kind], n = rows ? rows.length : this.rows;
    const after = new Float64Array(n), log = new Float64Array(n), [half, other] = [from, to].map(this.half);
    const offset = this.middle(from) - this.middle(to), size = Math.log(half / other), alone = !this.joined.has(p);
    for (let k = 0; k < n; k++) {
      const z = this.scores[p][rows ? rows[k] : k], score = kind.score((offset + half * old.at(z)) / other);
      after[k] = score;
      log[k] = score === score ? size + old.slope(z) - kind.slope(score) + (alone ? (z * z - score * score) / 2 : 0) : -Infinity;
    }
    return {after, log};
  }
  /* Log density of units in one scenario over that in another, with which they were sampled; of some rows, or all.
     Terms are kept but those of the entry `special`, which a profile moves; of none if it is true. */
  logRatios(from, to, rows = null, special = -1) {
    const n = rows ? rows.length : this.rows, out = new Float64Array(n), after = new Map(), direction = from === this.drawing ? 'to' : 'from';
    this.entries.forEach(({members}, i) => {
      const [a, b] = [from, to].map(scenario => scenario.entries[i]);
      if (!this.changed(from, i) && !this.changed(to, i)) return;
      for (const p of members) {
        if (this.parts[p].repeats) continue;
        const some = rows && (special === true || i === special), place = `${p} ${direction}`, key = JSON.stringify([a, b]);
        if (!some && this.terms[place]?.key !== key) this.terms[place] = {key, ...this.term(p, a, b)};
        const term = some ? this.term(p, a, b, rows) : this.terms[place];
        for (let k = 0; k < n; k++) out[k] += term.log[some || !rows ? k : rows[k]];
        after.set(p, k => term.after[some || !rows ? k : rows[k]]);
      }
    });
    for (const {members, inverse} of this.groups) if (members.some(p => after.has(p))) for (let k = 0; k < n; k++) {
      const before = members.map(p => this.scores[p][rows ? rows[k] : k]), now = members.map((p, m) => after.get(p)?.(k) ?? before[m]);
      if (out[k] > -Infinity) members.forEach((_, a) => members.forEach((__, b) => { out[k] += inverse[a][b] * (before[a] * before[b] - now[a] * now[b]) / 2; }));
    }
    return out;
  }
  /* Cap of the weights for intervals, and share of the new units above it: the cheapest of the new units' own weights. */
  cap(scenario) {
    this.units ??= Uint32Array.from({length: Math.min(this.rows, this.most_units)}, (_, k) => k);
    const log = this.logRatios(scenario, this.drawing, this.units, true), total = this.units.reduce((sum, k) => sum + this.times[k], 0);
    const order = this.units.filter(k => log[k] > -Infinity).sort((a, b) => log[a] - log[b]);
    let above = 0, sampled = 0, mean = 0, top = 0, best = {most: 1, cut: 0, cost: Infinity};
    for (const k of order) {
      const weight = Math.exp(-log[k]), mass = this.times[k] / total;
      if (above < this.heaviest[0]) top += mass * weight;
      above += mass; sampled += mass / weight; mean += mass * weight;
      const cut = Math.max(above - sampled * weight, 0), cost = this.none_met * weight / this.trials + cut;
      if (cost < best.cost) best = {most: weight, cut, cost};
    }
    return {...best, efficiency: 1 / mean, dominated: top > this.heaviest[1] * mean};
  }
  /* How far the sampled parts of an entry cover its new ones: share outside, efficiency. */
  cover(i, state) {
    const drawn = this.drawing.entries[i], old = this.kinds[drawn.kind], kind = this.kinds[state.kind];
    const n = kind.deviations.length, size = Math.log(this.half(drawn) / this.half(state));
    let outside = 0, mean = 0; const heavy = [];
    for (let k = 0; k < n; k++) {
      const z = this.farthest * (2 * k / (n - 1) - 1), mass = this.masses[k];
      const before = old.score((this.middle(state) + this.half(state) * kind.deviations[k] - this.middle(drawn)) / this.half(drawn));
      if (before !== before) { outside += mass; continue; }
      const weight = Math.exp(size + old.slope(before) + before * before / 2 - kind.logSlope[k] - z * z / 2);
      mean += mass * weight; heavy.push([weight, mass]);
    }
    heavy.sort((a, b) => b[0] - a[0]);
    let top = 0, taken = 0;
    for (const [weight, mass] of heavy) { const part = Math.min(mass, this.heaviest[0] - taken); if (part <= 0) break; taken += part; top += part * weight; }
    return {outside, efficiency: mean ? 1 / mean : 0, dominated: top > this.heaviest[1] * mean};
  }
  get masses() {
    return this._masses ??= this.areas.map((area, k) => (this.areas[Math.min(k + 1, this.areas.length - 1)] - this.areas[Math.max(k - 1, 0)]) / 2);
  }
  /* Why the trials do not cover a scenario, and the effective sample size by its distributions. */
  coverage(scenario) {
    const reasons = []; let efficiency = 1;
    for (const i of this.changes(scenario)) {
      const {name, members} = this.entries[i], cover = this.cover(i, scenario.entries[i]);
      if (cover.dominated) reasons.push(`${name}: its tails are too heavy for the sampled ones`);
      else if (cover.outside > this.most_uncovered) reasons.push(`${name}: ${(100 * cover.outside).toPrecision(2)} % of these parts lie outside the sampled range`);
      efficiency *= cover.efficiency ** members.filter(p => !this.parts[p].repeats).length;
    }
    const expected = this.trials * efficiency;
    if (!reasons.length && expected < this.least_effective) reasons.push(this.tooFew(expected));
    return {reasons, expected};
  }
  tooFew(effective) { return `effective sample size ${Math.round(effective)} of ${this.trials} trials; ${this.least_effective} needed`; }

  // ---- what a scenario reads
  read(scenario) {
    const isDrawing = !this.changes(scenario).length, weighted = !this.evaluated && !isDrawing;
    let weights = this.times, reasons = [], effective = this.trials, cap = null;
    if (weighted) {
      const coverage = this.coverage(scenario), ratios = this.logRatios(this.drawing, scenario).map(Math.exp);
      cap = this.cap(scenario); reasons = coverage.reasons;
      if (!reasons.length && cap.dominated) reasons = ['few units would dominate; change all parts that are correlated'];
      weights = ratios.map((w, k) => w * this.times[k]);
      let sum = 0, squares = 0;
      for (let k = 0; k < weights.length; k++) { sum += weights[k]; squares += weights[k] * ratios[k]; }
      effective = Math.min(coverage.expected, this.trials * cap.efficiency, squares ? sum * sum / squares : 0);
      if (!reasons.length && effective < this.least_effective) reasons = [this.tooFew(effective)];
    }
    const columns = this.evaluated ? this.columns(scenario) : null, anyOut = new Uint8Array(this.rows);
    const responses = this.responses.map((response, r) => {
      const values = columns ? valueOf(response.formula, columns) : response.values, moved = this.limitChanged(scenario, r);
      const reading = this.judged(values, weights, cap, response, scenario.limits[r], moved, anyOut);
      if (isDrawing && !moved && response.run) Object.assign(reading, this.ofRun(response, reading.ends));
      return reading;
    });
    let out = 0;
    for (let k = 0; k < this.rows; k++) if (anyOut[k]) out += weights[k];
    return {covered: !reasons.length, reasons, effective, weights, responses, anyOut: Math.min(out / this.total, 1), ...this.ofAll(responses)};
  }
  /* The verdict of all limits, the worst of theirs; how many they are, and which have it. */
  ofAll(responses) {
    const worst = WORST_FIRST.find(verdict => responses.some(r => r.verdict === verdict)) ?? '';
    const limited = responses.filter(r => r.verdict).length;
    return {verdict: worst, limited, deciding: this.responses.filter((_, r) => worst && responses[r].verdict === worst).map(r => r.name)};
  }
  judged(values, weights, cap, response, limit, moved, anyOut) {
    const lower = limit.lower ?? -Infinity, upper = limit.upper ?? Infinity, ends = (limit.lower !== null) + (limit.upper !== null);
    let out = 0, sum = 0, squares = 0, total = 0, first = 0, second = 0, most = 0, count = 0, least = Infinity, largest = -Infinity;
    const start = values.find(x => x === x) ?? 0;
    for (let k = 0; k < values.length; k++) {
      const y = values[k], w = weights[k];
      if (w > most) most = w;
      if (ends && !(y >= lower && y <= upper)) {
        const capped = cap ? Math.min(w, cap.most * this.times[k]) : w;
        anyOut[k] = 1; count++; out += w; sum += capped; squares += capped * capped;
      }
      if (y === y) { if (y < least) least = y; if (y > largest) largest = y; total += w; first += w * (y - start); second += w * (y - start) ** 2; }
    }
    const mean = start + first / total, sigma = Math.sqrt(Math.max(second / total - (first / total) ** 2, 0) * total / Math.max(total - 1, 1));
    let share = out / this.total, range = [NaN, NaN];
    if (cap || this.times_differ) { // one more unit weighs as the heaviest that may be out of limit
      const heaviest = this.evaluated || moved ? Math.max(...this.times_ends) : 1;
      const [low, high] = this.gammaEnds(sum, squares, cap ? cap.most * heaviest : most).map(x => x / this.total);
      const end = Math.min(Math.max(high + (cap?.cut ?? 0), share > 0.5 ? share : 0), 1);
      share = Math.min(share, end); range = [Math.min(low, share), end];
    } else if (this.random) range = ['lower', 'upper'].map(end => interpolated(this.anytime.counts, this.anytime[end], count));
    const verdict = !ends ? '' : Number.isNaN(range[0]) ? 'no interval' : 1 - range[1] >= response.demanded ? 'met' : 1 - range[0] < response.demanded ? 'not met' : 'undecided';
    const ppk = this.ppks(share, range, ends), moments = ends ? Math.min(upper - mean, mean - lower) / (3 * sigma) : NaN;
    return {values, count, share, range, verdict, ends, ppk, stored: false, mean, sigma, least, largest,
      pp: ends === 2 ? (upper - lower) / (6 * sigma) : NaN, moments, normal: response.normal && !(ppk[2] < moments)}; // counts may exclude it
  }
  /* The verdict that counts: what the run itself has. */
  ofRun({run}, ends) {
    const [share, ...range] = run.out.map(x => x ?? NaN);
    return {share, range, verdict: run.verdict, ppk: this.ppks(share, range, ends), stored: true};
  }
  ppks(share, [lower, upper], ends) { return [share, upper, lower].map(x => this.ppk(x, ends)); }
  gammaEnds(sum, squares, one) {
    const {lower, upper, last} = this.gamma, at = (table, k) => along(table, Math.log10(k) / last);
    const low = squares > 0 ? sum * at(lower, sum * sum / squares) : 0;
    const more = sum + one, square = squares + one * one;
    return [low, more * at(upper, more * more / square)];
  }
  /* Equivalent Ppk of a share out of limit, from the areas below normal scores. */
  ppk(share, ends) {
    if (!ends || !(share === share)) return NaN;
    if (share <= 0) return Infinity;
    const area = Math.min(share / ends, 1), low = Math.min(area, 1 - area), last = this.areas.length - 1;
    const i = interval(this.areas, low), part = (Math.log(low) - Math.log(this.areas[i])) / (Math.log(this.areas[i + 1]) - Math.log(this.areas[i]));
    const score = low <= this.areas[0] ? -this.farthest : this.farthest * (2 * (i + part) / last - 1);
    return (area <= 0.5 ? -score : score) / 3;
  }
  area(score) { return along(this.areas, (score + this.farthest) / (2 * this.farthest)); }
  /* Quantiles as the report has them: median-unbiased; where trials stand for several, the first one that reaches it. */
  quantiles(values, shares) {
    const order = Array.from(values.keys()).filter(k => values[k] === values[k]).sort((a, b) => values[a] - values[b]), n = order.length;
    if (!this.times_differ) return shares.map(share => along(order.map(k => values[k]), ((n + 1 / 3) * share - 2 / 3) / (n - 1)));
    const total = order.reduce((sum, k) => sum + this.times[k], 0);
    return shares.map(share => { let sum = 0; for (const k of order) { sum += this.times[k]; if (sum >= share * total) return values[k]; } return NaN; });
  }
  /* Shares out of limit of a response over a field of an entry: its profile. */
  profile(scenario, i, field, values, r) {
    const entry = this.entries[i], state = scenario.entries[i], limit = scenario.limits[r];
    const lower = limit.lower ?? -Infinity, upper = limit.upper ?? Infinity, out = y => !(y >= lower && y <= upper);
    const states = values.map(x => field === 'half' ? this.resized(i, state, x) : {...state, [field]: x});
    if (this.evaluated) {
      const tree = this.responses[r].formula, columns = [...this.columns(scenario)], links = new Set(entry.members), kept = new Map();
      keepOthers(tree, columns, links, kept);
      return states.map(other => {
        for (const p of entry.members) columns[p] = this.column(p, other);
        const y = valueOf(tree, columns, kept); let sum = 0;
        for (let k = 0; k < y.length; k++) if (out(y[k])) sum += this.times[k];
        return sum / this.total;
      });
    }
    const {values: all} = this.responses[r], rows = Array.from(all.keys()).filter(k => out(all[k]));
    return states.map(other => {
      const entries = scenario.entries.map((s, j) => j === i ? other : s), changed = {...scenario, entries};
      if (this.coverage(changed).reasons.length) return NaN;
      const log = this.logRatios(this.drawing, changed, rows, i);
      return rows.reduce((sum, row, k) => sum + Math.exp(log[k]) * this.times[row], 0) / this.total;
    });
  }

  // ---- as text
  number(x, factor) { return String(+(x * factor).toPrecision(10)); }
  zone(entry, state) {
    const [low, high] = [state.lower, state.upper].map(x => this.number(x, entry.factor)), plus = x => +x > 0 ? `+${x}` : x;
    return (+low === -high ? `+-${high}` : `${plus(low)}..${plus(high)}`) + (entry.unit && ` ${entry.unit}`);
  }
  tolerance(i, state) {
    const drawn = this.drawing.entries[i], entry = this.entries[i];
    if (state.grade && state.grade !== drawn.grade) return state.grade;
    return state.lower === drawn.lower && state.upper === drawn.upper && entry.tolerance ? entry.tolerance : this.zone(entry, state);
  }
  quantity(entry, x) { return `${this.number(x, entry.factor)}${entry.unit && ` ${entry.unit}`}`; }
  /* Keys of an entry as TOML; a link's other size is a shift here, unless `sized`. */
  keys(i, state, sized) {
    const entry = this.entries[i], drawn = this.drawing.entries[i], keys = [];
    if (sized) keys.push(['nominal', this.quantity(entry, state.nominal)]);
    const same = state.lower === drawn.lower && state.upper === drawn.upper;
    keys.push(['tolerance', this.tolerance(i, state)]);
    if (entry.size && (same || state.grade)) keys.push(['size', entry.size]);
    const kind = this.kinds[state.kind], half = this.half(state), middle = (state.lower + state.upper) / 2;
    for (const [key, value] of Object.entries(kind.keys)) {
      if (value.across) keys.push([key, `${value.across.map(x => this.number(middle + half * x, entry.factor)).join('..')}${entry.unit && ` ${entry.unit}`}`]);
      else if (value.times !== undefined) keys.push([key, this.quantity(entry, half * value.times)]);
      else keys.push([key, value]);
    }
    // a tolerance of the drawing is written without the shift that it has there
    const shift = state.shift + (sized ? 0 : state.nominal - drawn.nominal) + (same ? entry.shifted : 0);
    if (Math.abs(shift) > 1e-9 * half) keys.push(['nominal_shift', this.quantity(entry, shift)]);
    return keys;
  }
  inline(keys, rest = '') { return `{ ${[...keys.map(([key, value]) => `${key} = ${JSON.stringify(value)}`), ...rest ? [rest] : []].join(', ')} }`; }
  toml(scenario) {
    const lines = this.changes(scenario).map(i => {
      const entry = this.entries[i];
      return `${entry.section}.${entry.key} = ${this.inline(this.keys(i, scenario.entries[i], entry.section === 'links'), entry.rest)}`;
    });
    const limits = this.limitChanges(scenario).map(r => {
      const response = this.responses[r];
      return `limits.${response.key} = ${this.inline([['limit', this.limit(response, scenario.limits[r])]], response.demand)}`;
    });
    return [...lines, ...limits].join('\n') || '# as on the drawing';
  }
  limit(response, {lower, upper}) {
    const [low, high] = [lower, upper].map(x => x === null ? '' : this.number(x, response.factor)), unit = response.unit && ` ${response.unit}`;
    return lower === null ? `<= ${high}${unit}` : upper === null ? `>= ${low}${unit}` : `${low}..${high}${unit}`;
  }
  /* Words of `tolstat what-if`: the changes of a scenario. */
  words(scenario) {
    const changes = this.changes(scenario).map(i => {
      const entry = this.entries[i], state = scenario.entries[i], drawn = this.drawing.entries[i], size = state.nominal !== drawn.nominal;
      const zoned = state.lower !== drawn.lower || state.upper !== drawn.upper, other = state.kind !== drawn.kind;
      if (size && this.evaluated && !zoned && !other && !state.shift) return `${entry.name}=${this.inline([['nominal', this.quantity(entry, state.nominal)]])}`;
      if (zoned && !other && !size && !state.shift && !entry.shifted) return `${entry.name}=${this.tolerance(i, state)}`;
      if (!zoned && !other && !size) return `${entry.name}${state.shift < 0 ? '-' : '+'}=${this.quantity(entry, Math.abs(state.shift))}`;
      return `${entry.name}=${this.inline(this.keys(i, state, false))}`;
    });
    const limits = this.limitChanges(scenario).flatMap(r => {
      const response = this.responses[r], limit = this.limit(response, scenario.limits[r]);
      return ['--limit', `${response.limit_entry} ${/^[<>]/.test(limit) ? limit : `= ${limit}`}`];
    });
    return [...changes, ...limits];
  }
  quoted(word) { return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`; }
  command(scenario, covered = true) {
    const words = this.words(scenario), machine = this.machine ? ['--machine', this.machine] : [];
    if (!words.length) return ['tolstat', 'report', this.path, ...machine].map(this.quoted).join(' ');
    const call = (...more) => ['tolstat', 'what-if', this.path, ...words, ...more, ...machine].map(this.quoted).join(' ');
    if (covered) return this.evaluated ? call() : call('--reweight');
    return `${call('--write', this.fresh)}\n${['tolstat', 'run', this.fresh, ...machine].map(this.quoted).join(' ')}`;
  }
  /* The state of the page as text of its address, and back. */
  stored(scenarios, chosen, focus) {
    const different = scenarios.map(scenario => [
      this.changes(scenario).map(i => [this.entries[i].name, scenario.entries[i]]),
      this.limitChanges(scenario).map(r => [this.responses[r].name, scenario.limits[r]])]);
    return encodeURIComponent(JSON.stringify([chosen, this.responses[focus].name, ...different]));
  }
  restored(text) {
    const [chosen, focus, ...different] = JSON.parse(decodeURIComponent(text));
    const number = x => x === null || Number.isFinite(x);
    const scenarios = different.map(([entries, limits]) => {
      let scenario = this.scenario();
      for (const [name, state] of entries) {
        const i = this.entries.findIndex(e => e.name === name && !e.reason), {nominal, lower, upper, shift, kind, grade} = state;
        if (i < 0 || ![nominal, lower, upper, shift].every(Number.isFinite) || !(upper > lower) || !this.entries[i].kinds.includes(kind)) continue;
        scenario.entries[i] = {nominal, lower, upper, shift, kind, grade: grade in this.entries[i].grades ? grade : ''};
      }
      for (const [name, {lower, upper}] of limits) {
        const r = this.responses.findIndex(x => x.name === name);
        if (r >= 0 && number(lower) && number(upper)) scenario = this.limited(scenario, r, {lower, upper});
      }
      return scenario;
    });
    return {chosen, focus: Math.max(this.responses.findIndex(r => r.name === focus), 0), scenarios};
  }
}

if (typeof module !== 'undefined') module.exports = {Explorer, valueOf};
