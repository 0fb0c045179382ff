/* Read scenarios of a page's data: node scenarios.js DATA.json CHANGES.json, to JSON. */
const {readFileSync} = require('fs');
const {Explorer, parsed} = require('../../../tolstat/answers/explore/model.js');

const [data, changes] = process.argv.slice(2).map(path => parsed(readFileSync(path, 'utf8')));
const explorer = new Explorer(data);

function scenarioOf({entries = {}, limits = {}}) {
  let scenario = explorer.scenario();
  for (const [name, {half, grade, ...state}] of Object.entries(entries)) {
    const i = explorer.entries.findIndex(entry => entry.name === name);
    Object.assign(scenario.entries[i], state);
    if (half) scenario = explorer.with(scenario, i, 'half', half);
    if (grade) scenario = explorer.with(scenario, i, 'grade', grade);
  }
  for (const [name, limit] of Object.entries(limits)) {
    const r = explorer.responses.findIndex(response => response.name === name);
    scenario = explorer.limited(scenario, r, {...scenario.limits[r], ...limit});
  }
  return scenario;
}
const readings = changes.map(change => {
  const scenario = scenarioOf(change), start = process.cpuUsage(), reading = explorer.read(scenario);
  const milliseconds = process.cpuUsage(start).user / 1000, {covered, reasons, effective, anyOut, verdict, limited, deciding} = reading;
  const responses = Object.fromEntries(reading.responses.map(({values, ...numbers}, r) => [explorer.responses[r].name, numbers]));
  const again = explorer.restored(explorer.stored([scenario], 1, 0)).scenarios[0];
  const profiles = Object.fromEntries((change.profiles ?? []).map(([name, field, xs]) => [
    `${name} ${field}`, explorer.profile(scenario, explorer.entries.findIndex(e => e.name === name), field, xs, 0)]));
  return {
    covered, reasons, effective, anyOut, verdict, limited, deciding, responses, profiles, milliseconds, words: explorer.words(scenario),
    command: explorer.command(scenario, covered), toml: explorer.toml(scenario),
    same: JSON.stringify(again) === JSON.stringify(scenario),
    stack: explorer.evaluated ? explorer.stack(scenario, 0) : null,
    quantiles: explorer.evaluated ? explorer.quantiles(reading.responses[0].values, [0.00135, 0.5, 0.99865]) : null,
  };
});
console.log(JSON.stringify(readings, (_, x) => Number.isNaN(x) ? null : x === Infinity ? 'infinite' : x));
