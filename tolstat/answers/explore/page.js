'use strict';
/* The page: controls, cards, figures. All numbers come from the Explorer. */

const $ = id => document.getElementById(id), all = selector => document.querySelectorAll(selector);
const explorer = new Explorer(parsed($('data').textContent));
const escaped = text => String(text).replace(/[&<>"]/g, c => `&#${c.charCodeAt(0)};`);
const LETTERS = ['A', 'B', 'C'], POINTS = explorer.evaluated ? 31 : 13, BINS = 64;
let WIDE, LEFT, BARS; // of figures, in their units: names end, bars are so wide
let scenarios = LETTERS.map(() => explorer.scenario()), readings = [], words = [{}, {}, {}], chosen = 1, focus = 0, waiting = 0;

const grouped = text => text.replace(/^-?\d{5,}/, digits => digits.replace(/\B(?=(\d{3})+$)/g, '\u202f'));
function plain(x, figures = 3) {
  if (x === null || Number.isNaN(x)) return '–';
  if (!Number.isFinite(x)) return x > 0 ? 'infinite' : '-infinite';
  return grouped(x.toFixed(x ? clamp(figures - 1 - Math.floor(Math.log10(Math.abs(x))), 0, 9) : 0));
}
const ppm = share => plain(Math.abs(1e6 * share) < 0.05 ? 0 : 1e6 * share);
const response = () => explorer.responses[focus];
const shown = (x, r = focus) => { // with decimals that resolve a hundredth of sigma
  const {factor} = explorer.responses[r], places = 2 - Math.floor(Math.log10(readings[0].responses[r].sigma * factor));
  return x === null || !Number.isFinite(x) ? plain(x) : (x * factor).toFixed(clamp(places, 0, 9) || 0);
};
const FIELDS = {nominal: s => s.nominal, half: s => explorer.half(s), shift: s => s.shift};
const typed = (x, factor) => x === null ? '' : +(x * factor).toPrecision(7);
/* Ends of a slider, SI. */
const ends = (name, i) => ['min', 'max'].map(end => $(`e${i}-${name}-r`)[end] / explorer.entries[i].factor);

/* Set an input and its slider, but not what is being typed. */
function set(id, value) {
  for (const input of [$(id), $(`${id}-r`)]) if (input && (document.activeElement !== input || input.type === 'range')) input.value = value;
}
function updateControls() {
  const scenario = scenarios[chosen], r = response();
  $('controls').disabled = chosen === 0;
  $('limited').textContent = `limits of ${r.limit_entry}${r.unit && `, ${r.unit}`}`;
  $('limit').classList.toggle('changed', explorer.limitChanged(scenario, focus));
  for (const end of ['lower', 'upper']) {
    const x = scenario.limits[focus][end], [min, max, step] = r.track;
    Object.assign($(`l-${end}-r`), {min, max, step, disabled: x === null});
    set(`l-${end}`, typed(x, r.factor));
  }
  explorer.entries.forEach(({reason, factor}, i) => {
    if (reason) return;
    $(`e${i}`).classList.toggle('changed', explorer.changed(scenario, i));
    for (const key of ['kind', 'grade']) set(`e${i}-${key}`, scenario.entries[i][key]);
    for (const name in FIELDS) set(`e${i}-${name}`, typed(FIELDS[name](scenario.entries[i]), factor));
  });
}
/* A response in a scenario in words, for the places of the page that are named so. */
function wordsOf(s, r) {
  const {verdict, limited, deciding, covered, reasons, anyOut, effective, responses} = readings[s], one = responses[r];
  const changes = explorer.words(scenarios[s]).filter(x => x !== '--limit').join('; ') || (s ? 'nothing changed yet' : 'as on the drawing');
  if (!covered) return {changes, deciding: '', reason: `Not covered by the trials: ${reasons.join('; ')}. Run the commands below.`};
  const [ppk, ...range] = one.ppk, span = (low, high, written) => Number.isNaN(low) ? '' : `${written(low)} to ${written(high)}`;
  return {
    changes, reason: '', verdict: one.verdict, overall: verdict,
    deciding: limited < 2 ? '' : verdict === 'met' ? `all ${limited} limits` : deciding.join(', '),
    out: ppm(one.share), range: span(...one.range, ppm), ppk: plain(ppk), ppk_range: span(...range, plain),
    moments: one.normal ? `; by moments ${plain(one.moments)}` : '',
    performance: one.normal ? `${plain(one.pp)}, ${plain(one.moments)}` : '–', mean: shown(one.mean, r), sigma: shown(one.sigma, r),
    any: ppm(anyOut), effective: grouped(String(Math.round(effective))),
  };
}
function updateWords() {
  const {name, unit, demanded} = response(), of = readings[chosen].limited > 1 ? ` of ${name}` : '';
  const say = (selector, text) => { for (const place of all(selector)) place.textContent = text; };
  for (const place of all('[data-fill]')) {
    const {fill, scenario: s, response: r = focus} = place.dataset, text = (words[s][r] ??= wordsOf(+s, +r))[fill] ?? '–';
    place.textContent = text; place.hidden = !text;
    if (fill === 'verdict' || fill === 'overall') place.className = `verdict ${text.replace(' ', '-')}`;
  }
  for (const row of all('[data-limits]')) row.hidden = !readings.some(x => x.responses[row.dataset.limits].ends);
  for (const card of all('[data-card]')) {
    card.setAttribute('aria-pressed', +card.dataset.card === chosen);
    card.classList.toggle('off', !readings[card.dataset.card].covered);
  }
  say('.unit', unit && `, ${unit}`); say('.permitted-ppm', ppm(1 - demanded)); say('.of-response', of); say('#name', name);
  const {reason, out, overall, deciding} = words[chosen][focus];
  say('#status', `${LETTERS[chosen]}: ${reason || `${out} ppm out of limit${of}, ${[overall, deciding].filter(Boolean).join(': ')}`}`);
  say('#copy', `Copy to ${LETTERS[chosen === 1 ? 2 : 1]}`); say('#changes', `Scenario ${LETTERS[chosen]}${chosen ? '' : ': as on the drawing; choose B or C to change it'}`);
}

// ---- figures
const picture = (height, label, inside, caption) => `<svg viewBox="0 0 ${WIDE} ${height}" role="img" aria-label="${escaped(label)}">${inside}</svg>`
  + `<figcaption>${escaped(caption)}</figcaption>`;
const word = (x, y, text, kind = '', anchor = 'end') => `<text x="${x}" y="${y}" class="${kind}" text-anchor="${anchor}">${escaped(text)}</text>`;
const bar = (x, y, width, height, kind = 'bars') => `<rect class="${kind}" x="${x}" y="${y}" width="${width}" height="${height}"/>`;
const upright = (x, top, end, kind) => `<line class="${kind}" x1="${x}" x2="${x}" y1="${top}" y2="${end}"/>`;
const inUnit = text => `${text}${response().unit && `, ${response().unit}`}`;
const rowed = (y, name, inside, text) => word(LEFT - 10, y, name) + inside + word(WIDE - 5, y, text, 'soft');
function ticks(low, high, x, y) {
  const step = 10 ** Math.floor(Math.log10((high - low) / 3)), wide = [1, 2, 5, 10].map(f => f * step).find(s => (high - low) / s <= 6);
  const at = Array.from({length: 9}, (_, k) => (Math.ceil(low / wide) + k) * wide).filter(t => t <= high);
  return at.map(t => word(x(t), y, String(+(t * response().factor).toPrecision(6)), 'soft', 'middle')).join('');
}
function histogram() {
  const [before, one] = [0, chosen].map(s => readings[s].responses[focus]), {lower, upper} = scenarios[chosen].limits[focus];
  const seen = [before, one].flatMap(({mean, sigma, least, largest}) => [Math.max(mean - 4.5 * sigma, least), Math.min(mean + 4.5 * sigma, largest)]);
  seen.push(...[lower, upper, response().nominal].filter(end => end !== null && Math.abs(end - one.mean) < 12 * one.sigma));
  const size = Math.max(...seen) - Math.min(...seen), low = Math.min(...seen) - 0.04 * size, high = low + 1.08 * size;
  if (!(size > 0)) return '';
  const wide = (high - low) / BINS, x = y => 10 + (WIDE - 20) * (y - low) / (high - low), edge = b => x(low + b * wide);
  const bins = s => {
    const out = new Float64Array(BINS), {weights, responses} = readings[s];
    responses[focus].values.forEach((y, k) => { out[Math.floor((y - low) / wide)] += weights[k]; });
    return [...out].map(y => y / responses[focus].total);
  };
  const area = b => explorer.area((low + b * wide - one.mean) / one.sigma), [drawn, now] = [bins(0), bins(chosen)];
  const fit = now.map((_, b) => area(b + 1) - area(b)), top = Math.max(...drawn, ...now, ...fit), y = share => 190 - 150 * share / top;
  const mark = (end, text, kind, row) => end === null || !(end >= low && end <= high) ? '' : upright(x(end), row + 3, 190, kind)
    + word(clamp(x(end), 60, WIDE - 60), row, `${text} ${shown(end)}`, kind, 'middle');
  return picture(215, `Histogram of ${response().name}: mean ${shown(one.mean)}, sigma ${shown(one.sigma)}`,
    now.map((share, b) => bar(edge(b) + 0.5, y(share), (WIDE - 20) / BINS - 1, 190 - y(share))).join('')
    + (chosen ? `<path class="before" d="M10 190${drawn.map((share, b) => `H${edge(b)}V${y(share)}`).join('')}H${WIDE - 10}V190"/>` : '')
    + `<path class="fit" d="M${fit.map((share, b) => `${edge(b + 0.5)} ${y(share)}`).join('L')}"/>`
    + mark(lower, 'LSL', 'limit', 12) + mark(upper, 'USL', 'limit', 12)
    + mark(response().nominal, 'nominal', 'axis-line', 26) + mark(one.mean, 'mean', 'axis-line', 40)
    + bar(10, 190, WIDE - 20, 1, 'pale') + ticks(low, high, x, 206),
    `${inUnit(response().name)}: bars ${LETTERS[chosen]}, outline A; dashed normal fit`);
}
function waterfall() {
  const {name, turning} = response();
  const words = turning && `${name} rises and falls with ${turning}: slopes tell neither worst case nor spread.`;
  if (words || !explorer.evaluated) return words && `<figcaption>${escaped(words)}</figcaption>`;
  const {nominal, steps, rss: [mean, sigma], worst} = explorer.stack(scenarios[chosen], focus), {lower, upper} = scenarios[chosen].limits[focus];
  const [least, most] = explorer.quantiles(readings[chosen].responses[focus].values, [0.00135, 0.99865]);
  let end = nominal, span = (a, b) => `${shown(a)} to ${shown(b)}`;
  const rows = [ // name, bar, its thickness and kind, line over it, words
    ['nominal', nominal, nominal, 12, 'pale', nominal, nominal, shown(nominal)],
    ...steps.map(({name, move, reach}) => [name, end, end += move, 12, 'pale', end - reach, end + reach,
      `${move < 0 ? '' : '+'}${shown(move)} ± ${shown(reach)}`]),
    ...[['RSS, ±3 sigma', mean - 3 * sigma, mean + 3 * sigma, 'pale'], ['Monte Carlo', least, most, 'bars'], ['worst case', ...worst, 'pale']]
      .filter(([name, low]) => low === low && !(explorer.correlated && name.startsWith('RSS')))
      .map(([name, low, high, kind]) => [name, low, high, 10, kind, low, low, span(low, high)])];
  const limits = [lower, upper].filter(limit => limit !== null), values = rows.flatMap(([, a, b, , , c, d]) => [a, b, c, d]).concat(limits);
  const low = Math.min(...values), high = Math.max(...values), x = v => LEFT + BARS * (v - low) / (high - low || 1), height = 22 + 20 * rows.length;
  const between = (a, b, y, thick, kind) => bar(Math.min(x(a), x(b)), y - thick / 2, Math.max(Math.abs(x(b) - x(a)), 1), thick, kind);
  return picture(height + 18, `From nominal ${shown(nominal)} to mean ${shown(mean)}; worst case ${span(...worst)}`,
    rows.map(([label, a, b, thick, kind, c, d, text], k) =>
      rowed(20 * k + 20, label, between(a, b, 20 * k + 16, thick, kind) + between(c, d, 20 * k + 16, 2), text)).join('')
    + limits.map(limit => upright(x(limit), 6, height, 'limit')).join('') + ticks(low, high, x, height + 13),
    `${inUnit('From the nominal value to the mean; ± tolerance of each part')}. RSS: root sum square. Monte Carlo: 99.73 % of units. `
    + 'Worst case: at the corner to which the slopes point.');
}
function pareto() {
  const scenario = scenarios[chosen], shares = new Map(), simple = explorer.evaluated && !explorer.correlated && !response().turning;
  const {steps, variance} = simple ? explorer.stack(scenario, focus) : {steps: []}, halved = ([, a], [, b]) => a - b || -(a === a);
  const caption = simple ? 'Variance contributions by root sum square, and their sum' : 'ppm out of limit with this tolerance halved as well';
  const names = steps.map(({entry, name}) => explorer.entries[entry]?.name ?? name);
  names.forEach((name, k) => shares.set(name, (shares.get(name) ?? 0) + steps[k].sigma ** 2 / variance));
  if (!simple) explorer.entries.forEach(({name, reason}, i) => {
    if (!reason) shares.set(name, explorer.profile(scenario, i, 'half', [explorer.half(scenario.entries[i]) / 2], focus)[0]);
  });
  let sum = 0;
  const most = simple ? 1 : 1.2 * Math.max(readings[chosen].responses[focus].share, 1e-12);
  const text = share => simple ? `${plain(100 * share)} %, sum ${plain(100 * (sum += share))} %` : share === share ? `${ppm(share)} ppm` : 'not covered';
  const rows = [...shares].sort(simple ? (a, b) => b[1] - a[1] : halved).map(([name, share]) => [name, Math.min(share / most, 1) || 0, text(share)]);
  return picture(8 + 20 * rows.length, `${caption}: ${rows.slice(0, 5).map(([name, , said]) => `${name} ${said}`).join('; ')}`,
    rows.map(([name, share, said], k) => rowed(18 + 20 * k, name, bar(LEFT, 8 + 20 * k, BARS * share, 12), said)).join(''), caption);
}
function curve(i, name) {
  const svg = $(`e${i}`).querySelector(`svg[data-field=${name}]`), [low, high] = ends(name, i), state = scenarios[chosen].entries[i];
  const xs = Array.from({length: POINTS}, (_, k) => low + (high - low) * k / (POINTS - 1));
  const y = share => 38 - 36 * clamp(Math.log10(Math.max(1e6 * share, 1)) / 6, 0, 1); // from 1 ppm to all
  const shares = explorer.profile(scenarios[chosen], i, name, xs, focus), at = 100 * clamp((FIELDS[name](state) - low) / (high - low), 0, 1);
  const path = shares.map((share, k) => share === share ? `${shares[k - 1] >= 0 ? 'L' : 'M'}${100 * k / (POINTS - 1)} ${y(share)}` : '').join('');
  const lines = {permitted: `M0 ${y(1 - response().demanded)}H100`, 'axis-line': `M${at} 0V40`, curve: path};
  svg.innerHTML = Object.entries(lines).map(([kind, d]) => `<path class="${kind}" d="${d}" vector-effect="non-scaling-stroke"/>`).join('');
}
const show = (id, figure) => { $(id).innerHTML = readings[chosen].covered ? figure() : ''; $(id).hidden = !$(id).innerHTML; };
const queue = []; // curves, drawn between moves
const work = () => { queue.shift()?.(); waiting = queue.length ? setTimeout(work) : 0; };
function draw() {
  const scenario = scenarios[chosen];
  [WIDE, LEFT, BARS] = innerWidth < 640 ? [370, 95, 130] : [640, 165, 310];
  readings[chosen] = explorer.read(scenario); words[chosen] = {};
  updateWords(); updateControls();
  show('histogram', histogram); show('waterfall', waterfall);
  $('command').value = explorer.command(scenario, readings[chosen].covered); $('toml').value = explorer.toml(scenario);
  queue.length = 0;
  explorer.entries.forEach(({reason}, i) => { if (!reason) queue.push(() => curve(i, 'half'), () => curve(i, 'shift')); });
  queue.push(() => { show('pareto', pareto); history.replaceState(null, '', `#${explorer.stored(scenarios.slice(1), chosen, focus)}`); });
  waiting ||= setTimeout(work);
}
function change(i, field, x) { scenarios[chosen] = explorer.with(scenarios[chosen], i, field, x); draw(); }
function moved({target}) {
  const {entry, field, end} = target.dataset, scenario = scenarios[chosen], empty = target.value === '';
  if (target.id === 'response') { focus = +target.value; return draw(); }
  if (chosen === 0) return;
  if (end) {
    const limit = {...scenario.limits[focus], [end]: empty ? null : +target.value / response().factor};
    if (limit.lower !== null && limit.upper !== null && !(limit.lower < limit.upper)) return;
    scenarios[chosen] = explorer.limited(scenario, focus, limit); draw();
  } else if (!(field in FIELDS)) change(entry, field, target.value);
  else if (!empty) change(entry, field, +target.value / explorer.entries[entry].factor);
}
function dragged(event) {
  const svg = event.target.closest('svg[data-field]');
  if (!svg || chosen === 0 || !(event.buttons & 1)) return;
  if (event.isTrusted) svg.setPointerCapture(event.pointerId); // a test's pointer cannot be
  const {entry, field} = svg.dataset, box = svg.getBoundingClientRect(), [low, high] = ends(field, entry);
  change(entry, field, low + (high - low) * clamp((event.clientX - box.left) / box.width, 0, 1));
}
async function pressed({target}) {
  const {copy, card} = target.closest('button')?.dataset ?? {}, other = chosen === 1 ? 2 : 1;
  if (card) { chosen = +card; draw(); }
  else if (copy) { $(copy).select(); await navigator.clipboard?.writeText($(copy).value).catch(() => document.execCommand('copy')); }
  else if (target.id === 'reset' && chosen) { scenarios[chosen] = explorer.scenario(); draw(); }
  else if (target.id === 'copy') { scenarios[other] = scenarios[chosen]; chosen = other; draw(); }
}
try {
  const kept = explorer.restored(location.hash.slice(1));
  scenarios = [scenarios[0], ...kept.scenarios].slice(0, 3); chosen = clamp(kept.chosen | 0, 0, 2); focus = kept.focus; $('response').value = focus;
} catch { /* no state, or that of another page */ }
readings = scenarios.map(scenario => explorer.read(scenario));
draw();
const acts = {input: moved, click: pressed, pointerdown: dragged, pointermove: dragged};
for (const [kind, act] of Object.entries(acts)) document.addEventListener(kind, act);
addEventListener('resize', draw);
