'use strict';
/* Scenarios of a run: its trials evaluated again, or weighted. Without DOM.
   No distribution and no statistic stands here: tables made by Python hold both. */

const ARRAYS = {f8: Float64Array, f4: Float32Array, i2: Int16Array};
/* The data of a page; its arrays are base64. */
const parsed = text => JSON.parse(text, (_, x) => x?.base64 === undefined ? x
  : new ARRAYS[x.type](Uint8Array.from(atob(x.base64), c => c.charCodeAt(0)).buffer));
const clamp = (x, least, most) => Math.min(Math.max(x, least), most);

/* Where a value lies in an ascending table, from 0 to 1 of its length. */
function inverse(table, x) {
  let low = 0, high = table.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (table[middle] <= x) low = middle; else high = middle; }
  return (low + clamp((x - table[low]) / (table[high] - table[low]), 0, 1)) / (table.length - 1);
}
/* Value of a table at such a place. */
function along(table, share) {
  const place = clamp(share, 0, 1) * (table.length - 1), below = Math.min(place | 0, table.length - 2);
  return table[below] + (table[below + 1] - table[below]) * (place - below);
}

/* Deviations in half widths about the middle of a zone, by normal score. */
class Distribution {
  constructor(table, farthest) { Object.assign(this, table, {farthest}); }
  at(score, table = this.deviations) { return along(table, (score + this.farthest) / (2 * this.farthest)); }
  slope(score) { return this.at(score, this.log_slope); }
  /* Normal score of a deviation; NaN outside. */
  score(x) {
    const table = this.deviations, last = table[table.length - 1], edge = 1e-9 * (last - table[0]);
    return x >= table[0] - edge && x <= last + edge ? this.farthest * (2 * inverse(table, x) - 1) : NaN;
  }
}

const mod = (a, b) => a - b * Math.floor(a / b);
const even = x => { const r = Math.round(x); return Math.abs(x % 1) === 0.5 && r % 2 ? r - 1 : r; };
/* The function of a formula: columns x of n trials to Float64Array. */
const compiled = formula => formula && Function('mod', 'even', `return (x, n) => {
  const y = new Float64Array(n); for (let k = 0; k < n; k++) y[k] = ${formula}; return y; }`)(mod, even);

class Explorer {
  constructor(data) {
    Object.assign(this, data);
    this.kinds = Object.fromEntries(Object.entries(data.distributions).map(
      ([name, table]) => [name, new Distribution(table, data.farthest)]));
    this.scores = data.scores.map(scores => Float64Array.from(scores, z => z * data.score_unit));
    this.total = (this.times ??= new Float64Array(this.rows).fill(1)).reduce((sum, x) => sum + x, 0);
    this.formulas = data.responses.map(response => compiled(response.formula));
    this.drawing = this.scenario(); this.moved = {}; this.deviating = {}; this.terms = {};
    this.joined = new Set(data.groups.flatMap(group => group.members));
  }
  scenario() {
    const entries = this.entries.map(({nominal, lower, upper, kind, grade}) => ({nominal, lower, upper, shift: 0, kind, grade}));
    return {entries, limits: this.responses.map(({lower, upper}) => ({lower, upper}))};
  }
  half(state) { return (state.upper - state.lower) / 2; }
  middle(state) { return (state.upper + state.lower) / 2 + state.shift; }
  /* Scenario with another value of a field of an entry; the same where it is none. The deviation that `tolstat what-if`
     lets stay, stays where the half width changes. */
  with(scenario, i, field, x) {
    const {centre, grades} = this.entries[i], drawn = this.drawing.entries[i], state = {...scenario.entries[i]};
    const ends = [drawn.lower, drawn.upper], ratio = x / this.half(drawn), zone = x !== drawn.grade && grades[x];
    if (field === 'half') [state.lower, state.upper] = ends.map(end => centre + ratio * (end - centre));
    else if (field === 'grade') [state.lower, state.upper, state.grade] = [...zone || ends, zone ? x : drawn.grade];
    else state[field] = x;
    return this.put(scenario, i, field === 'half' || field === 'nominal' ? {...state, grade: ''} : state);
  }
  put(scenario, i, {nominal, lower, upper, shift, kind, grade}) {
    const {kinds, grades} = this.entries[i], state = {nominal, lower, upper, shift, kind, grade: grade in grades ? grade : ''};
    const valid = upper > lower && kinds.includes(kind) && [nominal, lower, upper, shift].every(Number.isFinite);
    return valid ? {...scenario, entries: scenario.entries.with(i, state)} : scenario;
  }
  changed({entries}, i) {
    return ['nominal', 'lower', 'upper', 'shift', 'kind'].some(key => this.drawing.entries[i][key] !== entries[i][key]);
  }
  changes(scenario) { return [...this.entries.keys()].filter(i => this.changed(scenario, i)); }
  limitChanged(scenario, r) { return ['lower', 'upper'].some(end => this.drawing.limits[r][end] !== scenario.limits[r][end]); }
  ends(scenario, r) { return [scenario.limits[r].lower ?? -Infinity, scenario.limits[r].upper ?? Infinity]; }
  /* An entry of [limits] may be of several responses: these move as one. */
  limited(scenario, r, limit) {
    const same = i => this.responses[i].limit_entry === this.responses[r].limit_entry;
    return {...scenario, limits: scenario.limits.map((other, i) => same(i) ? limit : other)};
  }
  limitChanges(scenario) {
    const entries = this.responses.map(response => response.limit_entry);
    return [...entries.keys()].filter(r => this.limitChanged(scenario, r) && entries.indexOf(entries[r]) === r);
  }

  // ---- trials evaluated again
  column(p, state) {
    const part = this.parts[p], base = state.nominal + this.middle(state), half = this.half(state);
    if (part.fixed) return Float64Array.from(part.fixed, x => state.nominal + x);
    const deviations = this.deviating[`${p} ${state.kind}`] ??= this.scores[p].map(z => this.kinds[state.kind].at(z));
    return deviations.map(x => base + half * x);
  }
  columns(scenario) {
    return this.parts.map((part, p) => {
      const state = this.state(scenario, part), key = Object.values(state).join();
      if (this.moved[p]?.key !== key) this.moved[p] = {key, column: this.column(p, state)};
      return this.moved[p].column;
    });
  }
  values(r, columns) { return columns ? this.formulas[r](columns, this.rows) : this.responses[r].values; }
  /* What is assumed of a part: that of its entry, or as it was sampled. */
  state(scenario, {entry, nominal, lower, upper}) {
    if (entry < 0) return {nominal, lower, upper, shift: 0};
    const state = scenario.entries[entry];
    return {...state, nominal: nominal + state.nominal - this.entries[entry].nominal};
  }
  /* Slopes, worst case and root sum square of a formula, without trials. */
  stack(scenario, r) {
    const states = this.parts.map(part => this.state(scenario, part));
    const at = sizes => this.formulas[r](sizes.map(size => [size]), 1)[0];
    const middle = states.map(s => s.nominal + this.middle(s)), nominal = at(states.map(s => s.nominal));
    const steps = this.parts.map((part, p) => {
      const state = states[p], kind = this.kinds[state.kind], half = this.half(state), step = 1e-4 * (half || 1e-6);
      const [low, high] = [-step, step].map(off => at(middle.with(p, middle[p] + off)));
      const slope = (high - low) / (2 * step) || 0; // NaN where the formula has no value
      const mean = part.fixed ? part.mean : this.middle(state) + half * kind.mean;
      const sigma = Math.abs(slope) * (part.fixed ? part.sigma : half * kind.sigma);
      return {name: part.name, entry: part.entry, slope, half, move: slope * mean, reach: Math.abs(slope) * half, sigma};
    });
    const worst = [-1, 1].map(sign => at(middle.map((x, p) => x + sign * Math.sign(steps[p].slope) * steps[p].half)));
    const variance = steps.reduce((sum, s) => sum + s.sigma ** 2, 0), mean = steps.reduce((sum, s) => sum + s.move, nominal);
    return {nominal, variance, steps: steps.filter(s => s.slope), rss: [mean, Math.sqrt(variance)], worst};
  }

  // ---- stored trials weighted by the ratio of densities
  /* Of units sampled with one state of a part: their normal scores in another, and the log ratio of densities. */
  term(p, from, to, sampled) {
    const place = `${p} ${sampled}`, key = JSON.stringify([from, to]);
    if (this.terms[place]?.key === key) return this.terms[place];
    const old = this.kinds[from.kind], kind = this.kinds[to.kind], [half, other] = [from, to].map(this.half);
    const offset = this.middle(from) - this.middle(to), size = Math.log(half / other), alone = !this.joined.has(p);
    const before = this.scores[p], after = before.map(z => kind.score((offset + half * old.at(z)) / other));
    const log = after.map((score, k) => score !== score ? -Infinity
      : size + old.slope(before[k]) - kind.slope(score) + (alone ? (before[k] ** 2 - score ** 2) / 2 : 0));
    return this.terms[place] = {key, after, log};
  }
  /* Log density of units in one scenario over that in another, with which they were sampled. */
  logRatios(from, to) {
    const out = new Float64Array(this.rows), after = {};
    for (const i of this.changes(from === this.drawing ? to : from)) for (const p of this.entries[i].members) {
      const {after: scores, log} = this.term(p, from.entries[i], to.entries[i], from === this.drawing);
      after[p] = scores; log.forEach((x, k) => { out[k] += x; });
    }
    for (const {members, inverse: matrix} of this.groups) if (members.some(p => after[p])) {
      const before = members.map(p => this.scores[p]), now = members.map(p => after[p] ?? this.scores[p]);
      matrix.forEach((row, a) => row.forEach((x, b) => {
        const [c, d, e, f] = [before[a], before[b], now[a], now[b]];
        for (let k = 0; k < out.length; k++) if (out[k] > -Infinity) out[k] += x * (c[k] * d[k] - e[k] * f[k]) / 2;
      }));
    }
    return out;
  }
  weights(scenario) { return this.logRatios(this.drawing, scenario).map((log, k) => Math.exp(log) * this.times[k]); }
  /* Efficiency of weights of new units, [weight, mass], and whether the heaviest of them dominate; sorts them. */
  efficiency(units) {
    const [share, most] = this.heaviest;
    let taken = 0, mean = 0, top = 0;
    for (const [w, mass] of units.sort((a, b) => b[0] - a[0])) { if (taken < share) top += mass * w; taken += mass; mean += mass * w; }
    return {efficiency: mean ? 1 / mean : 0, dominated: top > most * mean};
  }
  /* Cap of the weights for intervals, and share of the new units above it: the cheapest of the new units' own weights. */
  cap(scenario) {
    const [log, times] = [this.logRatios(scenario, this.drawing), this.times].map(x => x.subarray(0, this.most_units));
    const total = times.reduce((sum, x) => sum + x, 0);
    const units = Array.from(log, (x, k) => [Math.exp(-x), times[k] / total]).filter(([weight]) => weight < Infinity);
    let best = {most: 1, cut: 0, cost: Infinity}, above = 0, sampled = 0;
    const efficiency = this.efficiency(units);
    for (const [weight, mass] of units) {
      above += mass; sampled += mass / weight;
      const cut = Math.max(above - sampled * weight, 0), cost = this.none_met * weight / this.trials + cut;
      if (cost < best.cost) best = {most: weight, cut, cost};
    }
    return {...best, ...efficiency};
  }
  /* How far the sampled parts of an entry cover its new ones: share outside, efficiency. */
  cover(i, state) {
    const drawn = this.drawing.entries[i], old = this.kinds[drawn.kind], kind = this.kinds[state.kind], units = [];
    let outside = 0;
    const offset = this.middle(state) - this.middle(drawn), size = Math.log(this.half(drawn) / this.half(state));
    kind.deviations.forEach((x, k) => {
      const z = this.farthest * (2 * k / (kind.deviations.length - 1) - 1), mass = this.masses[k];
      const before = old.score((offset + this.half(state) * x) / this.half(drawn));
      if (before !== before) outside += mass;
      else units.push([Math.exp(size + old.slope(before) + before * before / 2 - kind.log_slope[k] - z * z / 2), mass]);
    });
    return {outside, ...this.efficiency(units)};
  }
  /* Why the trials do not cover a scenario, and the effective sample size by its distributions. */
  coverage(scenario) {
    let expected = this.trials;
    const reasons = this.changes(scenario).flatMap(i => {
      const {name, members} = this.entries[i], {outside, efficiency, dominated} = this.cover(i, scenario.entries[i]);
      expected *= efficiency ** members.length;
      if (dominated) return `${name}: its tails are too heavy for the sampled ones`;
      return outside > this.most_uncovered ? `${name}: ${(100 * outside).toPrecision(2)} % of these parts lie outside the sampled range` : [];
    });
    return {reasons: reasons.length ? reasons : this.tooFew(expected), expected};
  }
  tooFew(n) {
    return n < this.least_effective ? [`effective sample size ${Math.round(n)} of ${this.trials} trials; ${this.least_effective} needed`] : [];
  }

  // ---- what a scenario reads
  read(scenario) {
    const isDrawing = !this.changes(scenario).length;
    let weights = this.times, reasons = [], effective = this.trials, cap = null;
    if (!this.evaluated && !isDrawing) {
      const coverage = this.coverage(scenario);
      cap = this.cap(scenario); weights = this.weights(scenario); reasons = coverage.reasons;
      const sum = weights.reduce((a, w) => a + w, 0), squares = weights.reduce((a, w, k) => a + w * w / this.times[k], 0);
      effective = Math.min(coverage.expected, this.trials * cap.efficiency, squares ? sum * sum / squares : 0);
      if (!reasons.length && cap.dominated) reasons = ['few units would dominate; change all parts that are correlated'];
      if (!reasons.length) reasons = this.tooFew(effective);
    }
    const anyOut = new Uint8Array(this.rows), columns = this.evaluated && this.columns(scenario);
    const responses = this.responses.map((_, r) => this.judged(scenario, r, columns, weights, cap, anyOut, isDrawing));
    // the verdict of all limits is the worst of theirs
    const verdict = ['not met', 'undecided', 'no interval', 'met'].find(x => responses.some(r => r.verdict === x)) ?? '';
    const deciding = this.responses.filter((_, r) => verdict && responses[r].verdict === verdict).map(r => r.name);
    const out = weights.reduce((sum, w, k) => anyOut[k] ? sum + w : sum, 0), limited = responses.filter(r => r.verdict).length;
    return {covered: !reasons.length, reasons, effective, weights, responses, anyOut: Math.min(out / this.total, 1), verdict, limited, deciding};
  }
  /* Reading of a response. What the run itself has, comes from there: its verdict counts. */
  judged(scenario, r, columns, weights, cap, anyOut, isDrawing) {
    const values = this.values(r, columns), response = this.responses[r], [lower, upper] = this.ends(scenario, r);
    const ends = Number.isFinite(lower) + Number.isFinite(upper), moved = this.limitChanged(scenario, r);
    const run = isDrawing && !moved ? response.run : null;
    let out = 0, sum = 0, squares = 0, total = 0, first = 0, second = 0, most = 0, count = 0, least = Infinity, largest = -Infinity;
    const start = values.find(x => x === x) ?? 0;
    for (let k = 0; k < values.length; k++) {
      const y = values[k], w = weights[k];
      if (w > most) most = w;
      if (ends && !(y >= lower && y <= upper)) {
        const capped = cap ? Math.min(w, cap.most * this.times[k]) : w;
        anyOut[k] = 1; count++; out += w; sum += capped; squares += capped * capped;
      }
      if (y !== y) continue;
      total += w; first += w * (y - start); second += w * (y - start) ** 2;
      if (y < least) least = y;
      if (y > largest) largest = y;
    }
    const mean = start + first / total;
    const sigma = Math.sqrt(Math.max(second / total - (first / total) ** 2, 0) * total / Math.max(total - 1, 1));
    let share = out / this.total, range = [NaN, NaN];
    if (run) [share, ...range] = run.out.map(x => x ?? NaN);
    else if (cap || this.times_differ) { // one more unit weighs as the heaviest that may be out of limit
      const heaviest = this.evaluated || moved ? Math.max(...this.times_ends) : 1;
      const [low, high] = this.gammaEnds(sum, squares, cap ? cap.most * heaviest : most).map(x => x / this.total);
      const end = Math.min(Math.max(high + (cap?.cut ?? 0), share > 0.5 ? share : 0), 1);
      share = Math.min(share, end); range = [Math.min(low, share), end];
    } else if (this.random) range = ['lower', 'upper'].map(end => along(this.anytime[end], inverse(this.anytime.counts, count)));
    const verdict = !ends ? '' : run ? run.verdict : Number.isNaN(range[0]) ? 'no interval'
      : 1 - range[1] >= response.demanded ? 'met' : 1 - range[0] < response.demanded ? 'not met' : 'undecided';
    const ppk = [share, range[1], range[0]].map(x => this.ppk(x, ends)), moments = ends ? Math.min(upper - mean, mean - lower) / (3 * sigma) : NaN;
    return {values, count, total, share, range, verdict, ends, ppk, stored: Boolean(run), mean, sigma, least, largest, moments,
      pp: ends === 2 ? (upper - lower) / (6 * sigma) : NaN, normal: response.normal && !(ppk[2] < moments)}; // counts may exclude it
  }
  gammaEnds(sum, squares, one) {
    const {lower, upper, last} = this.gamma, at = (table, k) => along(table, Math.log10(k) / last);
    const low = squares > 0 ? sum * at(lower, sum * sum / squares) : 0, more = sum + one;
    return [low, more * at(upper, more * more / (squares + one * one))];
  }
  /* Equivalent Ppk of a share out of limit, from the areas below normal scores. */
  ppk(share, ends) {
    if (!ends || !(share === share)) return NaN;
    return share > 0 ? this.farthest * (1 - 2 * inverse(this.log_areas, Math.log(share / ends))) / 3 : Infinity;
  }
  area(score) { return Math.exp(along(this.log_areas, (score / this.farthest + 1) / 2)); }
  /* Quantiles as the report has them: median-unbiased. */
  quantiles(values, shares) {
    const order = [...values.keys()].filter(k => values[k] === values[k]).sort((a, b) => values[a] - values[b]);
    let sum = 0;
    const sorted = order.map(k => values[k]), counts = order.map(k => sum += this.times[k]);
    return shares.map(share => along(sorted, inverse(counts, (sum + 1 / 3) * share + 1 / 3)));
  }
  /* Shares out of limit of a response over a field of an entry: its profile; NaN where not covered. */
  profile(scenario, i, field, values, r) {
    const [lower, upper] = this.ends(scenario, r);
    return values.map(x => {
      const changed = this.with(scenario, i, field, x);
      if (!this.evaluated && this.coverage(changed).reasons.length) return NaN;
      const weights = this.evaluated ? this.times : this.weights(changed), y = this.values(r, this.evaluated && this.columns(changed));
      let sum = 0;
      for (let k = 0; k < y.length; k++) if (!(y[k] >= lower && y[k] <= upper)) sum += weights[k];
      return sum / this.total;
    });
  }

  // ---- as text
  number(x, {factor}) { return String(+(x * factor).toPrecision(10)); }
  quantity(entry, ...ends) { return ends.map(x => this.number(x, entry)).join('..') + (entry.unit && ` ${entry.unit}`); }
  tolerance(i, state) {
    const drawn = this.drawing.entries[i], entry = this.entries[i];
    if (state.grade && state.grade !== drawn.grade) return state.grade;
    if (state.lower === drawn.lower && state.upper === drawn.upper && entry.tolerance) return entry.tolerance;
    const [low, high] = [state.lower, state.upper].map(x => this.number(x, entry)), plus = x => +x > 0 ? `+${x}` : x;
    return (+low === -high ? `+-${high}` : `${plus(low)}..${plus(high)}`) + (entry.unit && ` ${entry.unit}`);
  }
  /* Keys of an entry as a study has them; a link's other size is a shift here, unless `sized`. */
  keys(i, state, sized) {
    const entry = this.entries[i], drawn = this.drawing.entries[i], keys = sized ? [['nominal', this.quantity(entry, state.nominal)]] : [];
    const same = state.lower === drawn.lower && state.upper === drawn.upper, half = this.half(state);
    keys.push(['tolerance', this.tolerance(i, state)]);
    if (entry.size && (same || state.grade)) keys.push(['size', entry.size]);
    for (const [key, value] of Object.entries(this.kinds[state.kind].keys)) {
      const sizes = value.across?.map(x => (state.lower + state.upper) / 2 + half * x) ?? value.times?.map(x => half * x);
      keys.push([key, sizes ? this.quantity(entry, ...sizes) : value]);
    }
    // a tolerance of the drawing is written without the shift that it has there
    const shift = state.shift + (sized ? 0 : state.nominal - drawn.nominal) + (same ? entry.shifted : 0);
    if (Math.abs(shift) > 1e-9 * half) keys.push(['nominal_shift', this.quantity(entry, shift)]);
    return keys;
  }
  table(keys, rest = '') {
    return `{ ${[...keys.map(([key, value]) => `${key} = ${JSON.stringify(value)}`), rest].filter(Boolean).join(', ')} }`;
  }
  toml(scenario) {
    const entries = this.changes(scenario).map(i => {
      const {section, key, rest} = this.entries[i];
      return `${section}.${key} = ${this.table(this.keys(i, scenario.entries[i], section === 'links'), rest)}`;
    });
    const limits = this.limitChanges(scenario).map(r =>
      `limits.${this.responses[r].key} = ${this.table([['limit', this.limit(r, scenario.limits[r])]], this.responses[r].demand)}`);
    return [...entries, ...limits].join('\n') || '# as on the drawing';
  }
  limit(r, {lower, upper}) {
    const sign = lower === null ? '<= ' : upper === null ? '>= ' : '';
    return sign + this.quantity(this.responses[r], ...[lower, upper].filter(x => x !== null));
  }
  /* Words of `tolstat what-if`: the changes of a scenario. */
  words(scenario) {
    const changes = this.changes(scenario).map(i => {
      const {name} = this.entries[i], state = scenario.entries[i], {shift} = state;
      if (this.changes({...scenario, entries: this.drawing.entries.with(i, {...state, shift: 0})}).length) {
        const keys = this.keys(i, state, false);
        return `${name}=${keys.length > 1 ? this.table(keys) : keys[0][1]}`;
      }
      return `${name}${shift < 0 ? '-' : '+'}=${this.quantity(this.entries[i], Math.abs(shift))}`;
    });
    const limits = this.limitChanges(scenario).flatMap(r => {
      const limit = this.limit(r, scenario.limits[r]);
      return ['--limit', `${this.responses[r].limit_entry} ${/^[<>]/.test(limit) ? limit : `= ${limit}`}`];
    });
    return [...changes, ...limits];
  }
  command(scenario, covered = true) {
    const quoted = word => /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`;
    const typed = (...words) => ['tolstat', ...words, ...this.machine ? ['--machine', this.machine] : []].map(quoted).join(' ');
    const words = this.words(scenario), call = (...more) => typed('what-if', this.path, ...words, ...more);
    if (!words.length) return typed('report', this.path);
    if (covered) return this.evaluated ? call() : call('--reweight');
    return `${call('--write', this.fresh)}\n${typed('run', this.fresh)}`;
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
    const scenarios = different.map(([entries, limits]) => {
      let scenario = this.scenario();
      for (const [name, state] of entries) {
        const i = this.entries.findIndex(entry => entry.name === name);
        if (i >= 0) scenario = this.put(scenario, i, state);
      }
      for (const [name, {lower, upper}] of limits) {
        const r = this.responses.findIndex(x => x.name === name), valid = [lower, upper].every(x => x === null || Number.isFinite(x));
        if (r >= 0 && valid) scenario = this.limited(scenario, r, {lower, upper});
      }
      return scenario;
    });
    return {chosen, focus: Math.max(this.responses.findIndex(r => r.name === focus), 0), scenarios};
  }
}
if (typeof module !== 'undefined') module.exports = {Explorer, parsed};
