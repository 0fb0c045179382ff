'use strict';
/* The page: controls, cards, figures. All numbers come from the Explorer. */

const explorer = new Explorer(JSON.parse(document.getElementById('data').textContent));
const $ = id => document.getElementById(id);
const escaped = text => String(text).replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`);
const LETTERS = ['A', 'B', 'C'], POINTS = explorer.evaluated ? 31 : 13;
let WIDE, LEFT, BARS; // of figures, in their units: names end, bars are so wide
let scenarios = LETTERS.map(() => explorer.scenario()), chosen = 1, focus = 0, readings = [], waiting = 0;

const grouped = text => text.replace(/^-?\d{5,}/, digits => digits.replace(/\B(?=(\d{3})+$)/g, '\u202f'));
function plain(x, figures = 3) {
  if (x === null || Number.isNaN(x)) return '–';
  if (!Number.isFinite(x)) return x > 0 ? 'infinite' : '-infinite';
  const places = x ? clamp(figures - 1 - Math.floor(Math.log10(Math.abs(x))), 0, 9) : 0;
  return grouped(x.toFixed(places));
}
const ppm = share => plain(Math.abs(1e6 * share) < 0.05 ? 0 : 1e6 * share);
const response = () => explorer.responses[focus];
const shown = x => { // with decimals that resolve a hundredth of sigma
  const {factor} = response(), {sigma} = readings[0].responses[focus];
  return x === null || !Number.isFinite(x) ? plain(x) : (x * factor).toFixed(clamp(2 - Math.floor(Math.log10(sigma * factor)), 0, 9) || 0);
};
const FIELDS = {
  nominal: {get: s => s.nominal, set: (i, s, x) => ({...s, nominal: x, grade: ''}),
    ends: i => [-2, 2].map(f => explorer.drawing.entries[i].nominal + f * drawnHalf(i))},
  half: {get: s => explorer.half(s), set: (i, s, x) => x > 0 ? explorer.resized(i, s, x) : s,
    ends: i => (explorer.evaluated ? [0.1, 2] : [0.2, 1.2]).map(f => f * drawnHalf(i))},
  shift: {get: s => s.shift, set: (i, s, x) => ({...s, shift: x}),
    ends: i => (explorer.evaluated ? [-1, 1] : [-0.5, 0.5]).map(f => f * drawnHalf(i))},
};
/* Ends of a slider, SI, and its step in the unit shown: round numbers. */
function track([low, high], factor) {
  const step = 10 ** Math.floor(Math.log10((high - low) * factor / 100));
  return [...[low, high].map(x => Math.round(x * factor / step) * step / factor), step];
}
const ends = (name, i) => track(FIELDS[name].ends(i), explorer.entries[i].factor);
const drawnHalf = i => explorer.half(explorer.drawing.entries[i]);
const typed = (x, factor) => +(x * factor).toPrecision(7);

const setting = (input, x, [low, high, step], factor) => {
  if (input.type === 'range') [input.min, input.max, input.step] = [typed(low, factor), typed(high, factor), typed(step, 1)];
  if (document.activeElement !== input || input.type === 'range') input.value = x;
};
function updateControls() {
  const scenario = scenarios[chosen], r = response();
  $('controls').disabled = chosen === 0;
  $('limited').textContent = `limits of ${r.limit_entry}${r.unit && `, ${r.unit}`}`;
  $('limit').classList.toggle('changed', explorer.limitChanged(scenario, focus));
  const values = readings[0].responses[focus], reach = 8 * values.sigma;
  for (const end of ['lower', 'upper']) for (const suffix of ['', '-r']) {
    const input = $(`l-${end}${suffix}`), x = scenario.limits[focus][end];
    input.disabled = suffix === '-r' && x === null;
    setting(input, x === null ? '' : typed(x, r.factor), track([values.mean - reach, values.mean + reach], r.factor), r.factor);
  }
  explorer.entries.forEach((entry, i) => {
    if (entry.reason) return;
    const state = scenario.entries[i];
    $(`e${i}`).classList.toggle('changed', explorer.changed(scenario, i));
    $(`e${i}-kind`).value = state.kind;
    if ($(`e${i}-grade`)) $(`e${i}-grade`).value = state.grade;
    for (const [name, field] of Object.entries(FIELDS)) for (const suffix of ['', '-r']) {
      const input = $(`e${i}-${name}${suffix}`);
      if (input) setting(input, typed(field.get(state), entry.factor), ends(name, i), entry.factor);
    }
  });
}
/* Which limits have the verdict of all, where there are several. */
function decidingWords({verdict, limited, deciding}) {
  if (limited < 2) return '';
  return verdict === 'met' ? `all ${limited} limits` : deciding.join(', ');
}
/* A reading in words, for the places of the page that are named so. */
function wordsOf(s) {
  const reading = readings[s], one = reading.responses[focus], words = explorer.words(scenarios[s]).filter(w => w !== '--limit');
  const numbers = {changes: words.join('; ') || (s ? 'nothing changed yet' : 'as on the drawing'), verdict: one.verdict, overall: reading.verdict, deciding: decidingWords(reading)};
  if (!reading.covered) return {...numbers, verdict: '', overall: '', deciding: '', reason: `Not covered by the trials: ${reading.reasons.join('; ')}. Run the commands below.`};
  const between = (low, high, written) => Number.isNaN(low) ? '' : `${written(low)} to ${written(high)}`;
  return {...numbers, reason: '', out: ppm(one.share), range: between(...one.range, ppm), ppk: plain(one.ppk[0]), ppk_range: between(one.ppk[1], one.ppk[2], plain),
    moments: one.normal ? `; by moments ${plain(one.moments)}` : '', performance: one.normal ? `${plain(one.pp)}, ${plain(one.moments)}` : '–', mean: shown(one.mean), sigma: shown(one.sigma),
    any: ppm(reading.anyOut), effective: grouped(String(Math.round(reading.effective)))};
}
function updateWords() {
  const words = LETTERS.map((_, s) => wordsOf(s)), {name, unit, demanded} = response();
  for (const place of document.querySelectorAll('[data-fill]')) {
    const {fill, scenario} = place.dataset, text = words[scenario][fill] ?? '–';
    place.textContent = text; place.hidden = !text;
    if (fill === 'verdict' || fill === 'overall') place.className = `verdict ${text.replace(' ', '-')}`;
  }
  for (const card of document.querySelectorAll('[data-card]')) {
    card.setAttribute('aria-pressed', +card.dataset.card === chosen);
    card.classList.toggle('off', !readings[card.dataset.card].covered);
  }
  for (const place of document.querySelectorAll('.unit')) place.textContent = unit && `, ${unit}`;
  for (const place of document.querySelectorAll('.permitted-ppm')) place.textContent = ppm(1 - demanded);
  $('name').textContent = name;
  const of = readings[chosen].limited > 1 ? ` of ${name}` : '', {reason, out, overall, deciding} = words[chosen];
  for (const place of document.querySelectorAll('.of-response')) place.textContent = of;
  $('status').textContent = `${LETTERS[chosen]}: ${reason || `${out} ppm out of limit${of}, ${[overall, deciding].filter(x => x).join(': ')}`}`;
}

// ---- figures
const picture = (height, label, inside) => `<svg viewBox="0 0 ${WIDE} ${height}" role="img" aria-label="${escaped(label)}">${inside}</svg>`;
const word = (x, y, text, more = '') => `<text x="${x}" y="${y}" ${more}>${escaped(text)}</text>`;
const tick = x => String(+(x * response().factor).toPrecision(6));
function ticks(low, high) {
  const step = 10 ** Math.floor(Math.log10((high - low) / 3)), wide = [1, 2, 5, 10].map(f => f * step).find(s => (high - low) / s <= 6);
  return Array.from({length: 9}, (_, k) => (Math.ceil(low / wide) + k) * wide).filter(x => x <= high);
}
function fitted() { [WIDE, LEFT, BARS] = innerWidth < 640 ? [370, 95, 130] : [640, 165, 310]; }
function histogram() {
  const [before, one] = [0, chosen].map(s => readings[s].responses[focus]), limit = scenarios[chosen].limits[focus];
  let low = Infinity, high = -Infinity;
  for (const {mean, sigma, least, largest} of [before, one]) { low = Math.min(low, Math.max(mean - 4.5 * sigma, least)); high = Math.max(high, Math.min(mean + 4.5 * sigma, largest)); }
  for (const end of [limit.lower, limit.upper, response().nominal]) if (end !== null && Math.abs(end - one.mean) < 12 * one.sigma) { low = Math.min(low, end); high = Math.max(high, end); }
  if (!(high > low)) return '';
  const pad = 0.04 * (high - low), BINS = 64; low -= pad; high += pad;
  const wide = (high - low) / BINS, x = y => 10 + (WIDE - 20) * (y - low) / (high - low);
  const bins = s => {
    const out = new Float64Array(BINS), {values} = readings[s].responses[focus], {weights} = readings[s]; let total = 0;
    for (let k = 0; k < values.length; k++) if (values[k] === values[k]) { total += weights[k]; const b = Math.floor((values[k] - low) / wide); if (b >= 0 && b < BINS) out[b] += weights[k]; }
    return out.map(y => y / total);
  };
  const [drawn, now] = [bins(0), bins(chosen)], fit = Array.from({length: BINS}, (_, b) => explorer.area((low + (b + 1) * wide - one.mean) / one.sigma) - explorer.area((low + b * wide - one.mean) / one.sigma));
  const top = Math.max(...drawn, ...now, ...fit), y = share => 190 - 150 * share / top;
  const bars = Array.from(now, (share, b) => `<rect class="bars" x="${x(low + b * wide) + 0.5}" width="${(WIDE - 20) / BINS - 1}" y="${y(share)}" height="${190 - y(share)}"/>`).join('');
  const outline = Array.from(drawn, (share, b) => `H${x(low + b * wide)}V${y(share)}`).join('');
  const mark = (at, text, kind, row, anchor = 'middle') => at === null || !(at >= low && at <= high) ? '' : `<line class="${kind}" x1="${x(at)}" x2="${x(at)}" y1="${row + 3}" y2="190"/>${word(clamp(x(at), 60, WIDE - 60), row, `${text} ${shown(at)}`, `text-anchor="${anchor}" class="${kind}"`)}`;
  return picture(215, `Histogram of ${response().name}: mean ${shown(one.mean)}, sigma ${shown(one.sigma)}`,
    bars + (chosen ? `<path class="before" d="M10 190${outline}H${WIDE - 10}V190"/>` : '') + `<path class="fit" d="M${fit.map((s, b) => `${x(low + (b + 0.5) * wide)} ${y(s)}`).join('L')}"/>`
    + mark(limit.lower, 'LSL', 'limit', 12) + mark(limit.upper, 'USL', 'limit', 12) + mark(response().nominal, 'nominal', 'axis-line', 26) + mark(one.mean, 'mean', 'axis-line', 40)
    + `<line class="axis-line" x1="10" x2="${WIDE - 10}" y1="190" y2="190"/>` + ticks(low, high).map(t => word(x(t), 206, tick(t), 'text-anchor="middle" class="soft"')).join(''))
    + `<figcaption>${escaped(response().name)}${response().unit && `, ${response().unit}`}: bars ${LETTERS[chosen]}, outline A; dashed normal fit</figcaption>`;
}
function waterfall() {
  if (!explorer.evaluated) return '';
  if (response().turning) return `<figcaption>${escaped(response().name)} rises and falls with ${escaped(response().turning)}: slopes tell neither worst case nor spread.</figcaption>`;
  const stack = explorer.stack(scenarios[chosen], focus), one = readings[chosen].responses[focus], limit = scenarios[chosen].limits[focus];
  const mc = explorer.quantiles(one.values, [0.00135, 0.99865]), [mean, sigma] = stack.rss;
  const rows = [['nominal', stack.nominal, stack.nominal, 0, shown(stack.nominal)]]; let at = stack.nominal;
  for (const s of stack.steps) { rows.push([s.name, at, at + s.move, s.reach, `${s.move < 0 ? '' : '+'}${shown(s.move)} ± ${shown(s.reach)}`]); at += s.move; }
  const bands = [['RSS, ±3 sigma', mean - 3 * sigma, mean + 3 * sigma], ['Monte Carlo', ...mc], ['worst case', ...stack.worst]].filter(b => b[1] === b[1] && !(explorer.correlated && /RSS/.test(b[0])));
  const all = [...rows.flatMap(r => [r[1] - r[3], r[2] + r[3], r[2] - r[3]]), ...bands.flatMap(b => b.slice(1)), limit.lower, limit.upper].filter(v => v !== null);
  const low = Math.min(...all), high = Math.max(...all), x = v => LEFT + BARS * (v - low) / (high - low || 1), end = 22 + 20 * (rows.length + bands.length);
  const line = (name, k, inside, text) => word(LEFT - 10, 20 + 20 * k, name, 'text-anchor="end"') + inside + word(WIDE - 5, 20 + 20 * k, text, 'text-anchor="end" class="soft"');
  const bar = (a, b, k, kind, thick) => `<rect class="${kind}" x="${Math.min(x(a), x(b))}" width="${Math.max(Math.abs(x(b) - x(a)), 1)}" y="${16 + 20 * k - thick / 2}" height="${thick}"/>`;
  return picture(end + 18, `From nominal ${shown(stack.nominal)} to mean ${shown(mean)}; worst case ${stack.worst.map(shown).join(' to ')}`,
    rows.map(([name, a, b, reach, text], k) => line(name, k, bar(a, b, k, 'pale', 12) + bar(b - reach, b + reach, k, 'bars', 2), text)).join('')
    + bands.map(([name, a, b], k) => line(name, k + rows.length, bar(a, b, k + rows.length, k === 1 ? 'bars' : 'pale', 10), `${shown(a)} to ${shown(b)}`)).join('')
    + [limit.lower, limit.upper].filter(v => v !== null).map(v => `<line class="limit" x1="${x(v)}" x2="${x(v)}" y1="6" y2="${end}"/>`).join('')
    + ticks(low, high).map(t => word(x(t), end + 13, tick(t), 'text-anchor="middle" class="soft"')).join(''))
    + `<figcaption>From the nominal value to the mean; ± tolerance of each part${response().unit && `, ${response().unit}`}. RSS: root sum square. Monte Carlo: 99.73 % of units. Worst case: at the corner to which the slopes point.</figcaption>`;
}
function pareto() {
  const scenario = scenarios[chosen], movable = explorer.entries.map((_, i) => i).filter(i => !explorer.entries[i].reason);
  let rows, caption;
  if (explorer.evaluated && !explorer.correlated && !response().turning) {
    const {steps, variance} = explorer.stack(scenario, focus), shares = new Map(); let sum = 0;
    for (const s of steps) { const name = s.entry < 0 ? s.name : explorer.entries[s.entry].name; shares.set(name, (shares.get(name) ?? 0) + s.sigma ** 2 / variance); }
    rows = [...shares].sort((a, b) => b[1] - a[1]).map(([name, share]) => [name, share, `${plain(100 * share)} %, sum ${plain(100 * (sum += share))} %`]);
    caption = 'Variance contributions by root sum square, and their sum';
  } else {
    const halved = movable.map(i => [explorer.entries[i].name, explorer.profile(scenario, i, 'half', [explorer.half(scenario.entries[i]) / 2], focus)[0]]);
    const most = Math.max(readings[chosen].responses[focus].share, 1e-12);
    rows = halved.sort((a, b) => a[1] - b[1] || -(a[1] === a[1])).map(([name, share]) => [name, clamp(share / most, 0, 1.2) / 1.2 || 0, share === share ? `${ppm(share)} ppm` : 'not covered']);
    caption = 'ppm out of limit with this tolerance halved as well';
  }
  const label = `${caption}: ${rows.slice(0, 5).map(r => `${r[0]} ${r[2]}`).join('; ')}`;
  return picture(8 + 20 * rows.length, label, rows.map(([name, share, text], k) => word(LEFT - 10, 18 + 20 * k, name, 'text-anchor="end"')
    + `<rect class="bars" x="${LEFT}" width="${BARS * share}" y="${8 + 20 * k}" height="12"/>` + word(WIDE - 5, 18 + 20 * k, text, 'text-anchor="end" class="soft"')).join('')) + `<figcaption>${caption}</figcaption>`;
}
function curves() {
  if (chosen >= 0) explorer.entries.forEach((entry, i) => {
    if (entry.reason) return;
    queue.push(() => ['half', 'shift'].forEach(name => {
      const svg = $(`e${i}`).querySelector(`svg[data-field=${name}]`), [low, high] = ends(name, i);
      const xs = Array.from({length: POINTS}, (_, k) => low + (high - low) * k / (POINTS - 1)), shares = explorer.profile(scenarios[chosen], i, name, xs, focus);
      const y = share => 38 - 36 * clamp(Math.log10(Math.max(1e6 * share, 1)) / 6, 0, 1); // from 1 ppm to all
      const at = 100 * clamp((FIELDS[name].get(scenarios[chosen].entries[i]) - low) / (high - low), 0, 1); let pen = 'M';
      const path = shares.map((share, k) => { if (share !== share) { pen = 'M'; return ''; } const step = `${pen}${100 * k / (POINTS - 1)} ${y(share)}`; pen = 'L'; return step; }).join('');
      const line = (kind, d) => `<path class="${kind}" d="${d}" vector-effect="non-scaling-stroke"/>`;
      svg.innerHTML = line('permitted', `M0 ${y(1 - response().demanded)}H100`) + line('axis-line', `M${at} 0V40`) + line('curve', path);
    }));
  });
}
function show(id, figure) {
  $(id).innerHTML = readings[chosen].covered ? figure() : '';
  $(id).hidden = !$(id).innerHTML;
}
const queue = [];
function work() { // curves are drawn between moves
  const start = performance.now();
  while (queue.length && performance.now() - start < 12) queue.shift()();
  waiting = queue.length ? setTimeout(work, 0) : 0;
}
function draw() {
  readings[chosen] = explorer.read(scenarios[chosen]);
  updateWords(); updateControls();
  $('changes').textContent = `Scenario ${LETTERS[chosen]}${chosen ? '' : ': as on the drawing; choose B or C to change it'}`;
  $('copy').textContent = `Copy to ${LETTERS[chosen === 1 ? 2 : 1]}`;
  show('histogram', histogram); show('waterfall', waterfall);
  $('command').value = explorer.command(scenarios[chosen], readings[chosen].covered); $('toml').value = explorer.toml(scenarios[chosen]);
  queue.length = 0; curves();
  queue.push(() => { show('pareto', pareto); history.replaceState(null, '', `#${explorer.stored(scenarios.slice(1), chosen, focus)}`); });
  waiting ||= setTimeout(work, 0);
}
function change(i, state) { const entries = [...scenarios[chosen].entries]; entries[i] = state; scenarios[chosen] = {...scenarios[chosen], entries}; draw(); }
function moved({target}) {
  const {entry, field, end} = target.dataset, scenario = scenarios[chosen];
  if (target.id === 'response') { focus = +target.value; draw(); }
  if (chosen === 0) return;
  if (end) {
    const x = target.value === '' ? null : +target.value / response().factor, limit = {...scenario.limits[focus], [end]: x};
    if (limit.lower !== null && limit.upper !== null && !(limit.lower < limit.upper)) return;
    scenarios[chosen] = explorer.limited(scenario, focus, limit); draw();
  } else if (field) {
    const state = scenario.entries[entry], x = +target.value / explorer.entries[entry].factor;
    if (field === 'kind') change(entry, {...state, kind: target.value});
    else if (field === 'grade') change(entry, explorer.graded(entry, state, target.value));
    else if (target.value !== '' && Number.isFinite(x)) change(entry, FIELDS[field].set(entry, state, x));
  }
}
function dragged(event) {
  const svg = event.target.closest('svg[data-field]');
  if (!svg || chosen === 0 || !(event.buttons & 1)) return;
  const {entry, field} = svg.dataset, box = svg.getBoundingClientRect(), [low, high] = ends(field, entry);
  if (event.isTrusted) svg.setPointerCapture(event.pointerId); // a test's pointer cannot be
  change(entry, FIELDS[field].set(entry, scenarios[chosen].entries[entry], low + (high - low) * clamp((event.clientX - box.left) / box.width, 0, 1)));
}
async function pressed({target}) {
  const {copy, card} = target.closest('button')?.dataset ?? {};
  if (card) { chosen = +card; draw(); }
  else if (copy) { $(copy).select(); try { await navigator.clipboard.writeText($(copy).value); } catch { document.execCommand('copy'); } }
  else if (target.id === 'reset' && chosen) { scenarios[chosen] = explorer.scenario(); draw(); }
  else if (target.id === 'copy') { const other = chosen === 1 ? 2 : 1; scenarios[other] = scenarios[chosen]; readings[other] = readings[chosen]; chosen = other; draw(); }
}
fitted();
try {
  const kept = explorer.restored(location.hash.slice(1));
  scenarios = [scenarios[0], ...kept.scenarios].slice(0, 3); chosen = clamp(kept.chosen | 0, 0, 2); focus = kept.focus; $('response').value = focus;
} catch { /* no state, or that of another page */ }
readings = scenarios.map(scenario => explorer.read(scenario));
draw();
document.addEventListener('input', moved);
addEventListener('resize', () => { fitted(); draw(); });
document.addEventListener('click', pressed);
for (const kind of ['pointerdown', 'pointermove']) document.addEventListener(kind, dragged);
document.documentElement.dataset.ready = Math.round(performance.now());
