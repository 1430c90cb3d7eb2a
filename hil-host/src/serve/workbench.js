// The live workbench: open a flight, see where its model fails, tick effects, find what is missing. Flying is in fly.js.
const Bench = (() => {
  'use strict';
  const { el, fmt } = Glider;
  const token = new URLSearchParams(location.search).get('token') || '';
  const root = document.getElementById('page');
  const state = { catalogue: [], kinds: [], flight: null, second: null, ticked: new Map(), gains: new Map(), error: null, history: [], found: null };

  // ---- talking to the server -------------------------------------------
  const ask = async (path, body, signal) => {
    let r;
    try {
      r = await fetch(path, { method: body === undefined ? 'GET' : 'POST', headers: { 'x-glider-token': token, 'content-type': 'application/json' }, body: body === undefined ? undefined : JSON.stringify(body), signal });
    } catch (e) {
      if (e.name === 'AbortError') throw e;
      throw new Error('The workbench does not answer: is `glider serve` still running?');
    }
    if (!r.ok) throw new Error((await r.text()) || `refused (${r.status})`);
    return r;
  };
  const json = async (path, body, signal) => (await ask(path, body, signal)).json();
  // One JSON document per line, as the work goes on.
  const stream = async (path, body, each, signal) => {
    const reader = (await ask(path, body, signal)).body.getReader();
    const decoder = new TextDecoder();
    let rest = '';
    for (;;) {
      const { done, value } = await reader.read();
      rest += done ? '' : decoder.decode(value, { stream: true });
      const lines = rest.split('\n');
      rest = lines.pop();
      for (const line of lines) if (line) each(JSON.parse(line));
      if (done) return;
    }
  };
  const say = (node, text, kind = '') => { node.textContent = text; node.className = 'say ' + kind; };
  // A pure number has the unit 1, which nobody wants to read.
  const unit = (u) => (u && u !== '1' ? ' ' + u : '');
  const cm = (v) => (v == null ? '–' : (100 * v).toFixed(3));
  const words = (name) => (state.catalogue.find((e) => e.name === name) || { words: name }).words;
  const download = (name, text, type) => { const a = el('a', { href: URL.createObjectURL(new Blob([text], { type })), download: name }); a.click(); setTimeout(() => URL.revokeObjectURL(a.href), 1000); };
  const button = (id, text, disabled) => el('button', { type: 'button', id, disabled: !!disabled }, text);
  const chart = (title, mark, x, y, group, down) => Glider.figure({ title, mark, x: { label: x[0], unit: x[1] }, y: { label: y[0], unit: y[1], inverted: !!down }, series: [{ name: '', x: [0, 1], y: [null, null] }], group }, true);
  const placeChart = (title) => Glider.figure({ title, mark: 'point', equal: true, x: { label: 'east', unit: 'm' }, y: { label: 'north', unit: 'm' }, series: [{ name: '', x: [0, 1], y: [null, null] }] }, true);
  const mapChart = (title, x) => Glider.figure({ title, mark: 'map', x: { label: x[0], unit: x[1] }, y: { label: 'depth', unit: 'm', inverted: true }, series: [{ name: 'cm/s', x: [0, 1], y: [0, 1], z: [null, null, null, null] }] });

  // ---- skeleton ---------------------------------------------------------
  const status = el('p', { class: 'say', role: 'status', 'aria-live': 'polite', id: 'status' });
  const file = el('input', { type: 'file', multiple: true, id: 'file', 'aria-label': 'Flight files: a flight with its vehicle file, or the log files of a glider' });
  const drop = el('div', { class: 'drop', id: 'drop' }, el('p', {}, 'Drop flight.csv and its vehicle file here, or a glider\u2019s own log files (Slocum, Seaglider, SeaExplorer, NetCDF, csv), or choose them:'), file);
  const listed = el('select', { id: 'listed', 'aria-label': 'Flights named on the command line' });
  const openListed = button('open-listed', 'Open');
  const listedRow = el('div', { class: 'row', hidden: true }, el('label', { for: 'listed' }, 'or'), listed, openListed);
  const example = button('example', 'Open an example');
  const openBar = el('progress', { hidden: true, 'aria-label': 'opening the flight' });
  const opener = el('details', { open: true, id: 'opener' }, el('summary', {}, 'Open a flight'), el('div', { class: 'row' }, example, el('span', { class: 'lead' }, 'a simulated flight with an effect that its vehicle file lacks, or your own:')), drop, listedRow);
  const summary = el('p', { class: 'lead', id: 'summary' });
  const notes = el('details', { id: 'notes', hidden: true });
  // The same four figures, with the same names, as `glider add`, `glider diagnose` and the report.
  const steps = [['nominal', 'as given', 'The vehicle file as it stands.'], ['recalibrated', 'recalibrated', 'Its numbers refitted inside their tolerances, no effect added.'], ['now', 'with the ticked effects', 'The ticked effects and the calibration fitted together.'], ['floor', 'floor', 'What ordinary water motion and sensor noise alone would leave.']]
    .map(([key, label, what], i) => {
      const value = el('b', { id: 'error-' + key }, '–'), bar = el('i', { class: 's' + i });
      return { key, value, bar, node: el('div', { class: 'step', title: what }, el('span', {}, label), value, el('div', { class: 'track', 'aria-hidden': 'true' }, bar)) };
    });
  const worth = el('p', { id: 'worth', role: 'status' });
  const undo = button('undo', 'Undo', true);
  const past = el('span', { id: 'history', class: 'lead' });
  const ladder = el('div', { class: 'ladder', id: 'ladder', hidden: true, role: 'group', 'aria-label': 'Depth-rate error in cm/s, step by step' }, el('div', { class: 'steps' }, ...steps.map((s) => s.node)), el('div', { class: 'row' }, worth, undo, past));
  const effects = el('div', { class: 'effects', id: 'effects', role: 'group', 'aria-label': 'Effects', tabindex: '0' });
  const ownText = el('input', { id: 'own', placeholder: 'cd += k*roll^2', spellcheck: 'false', 'aria-label': 'Effect of your own: TARGET += EXPRESSION' });
  const ownSay = el('p', { class: 'say', role: 'status', id: 'own-status' });
  const own = el('form', { class: 'row', title: 'Targets: cd cl cn (alpha U roll climb phase t), volume_cc pitch_rad density_kg_m3 (p z T rho ballast pitch t), water_up_m_s (z H t); other names are fitted' }, el('label', { for: 'own' }, 'Your own:'), ownText, el('button', { id: 'own-add' }, 'Try it'));
  const find = button('find', 'Find what is missing', true);
  const fit = button('fit', 'Fit the ticked effects', true);
  const save = button('save', 'Calibrate and save', true);
  save.title = 'Refits the vehicle\u2019s numbers, with the ticked effects if any, and saves vehicle file and flight table';
  const flyIt = button('fly-it', 'Fly it');
  flyIt.title = 'Flies a simulated mission in the world that this flight means: with the old table, then with the new one';
  const report = button('report', 'Report', true);
  const next = button('next', 'Next flight', true);
  const timeline = button('timeline', 'Timeline', true);
  timeline.title = 'Dive by dive, over all open flights of this vehicle: what changed, and when';
  const mission = el('div', { id: 'mission-timeline' });
  const findSay = el('p', { class: 'say', role: 'status', id: 'find-status' });
  const findBar = el('progress', { hidden: true, 'aria-label': 'search for the missing effect' });
  const verdict = el('div', { id: 'verdict' });
  const saveSay = el('p', { class: 'say', role: 'status', id: 'save-status' });
  // What can be done with any flight: beside the effects until there is an answer, then below it.
  const acts = el('div', { id: 'acts' }, el('div', { class: 'row' }, save, flyIt, next, report, timeline), saveSay);
  const fDepth = chart('Depth', 'line', ['time under way', 's'], ['depth', 'm'], 'time', true);
  const fRate = chart('Depth rate in blocks', 'line', ['time under way', 's'], ['depth rate', 'cm/s'], 'time');
  const fRes = chart('Residual (measured minus model) against angle of attack', 'point', ['angle of attack', '°'], ['residual', 'cm/s']);
  const fCurve = chart('L/D in a dive at 0.3 m/s, and where this flight was', 'line', ['angle of attack', '°'], ['L/D', '']);
  const fTrack = placeChart('Track: dead reckoning by compass and model, and GPS fixes');
  const ALPHA = ['angle of attack', '°'], TIME = ['time under way', 's'];
  const fMaps = [mapChart('Where it fails: model as given', ALPHA), mapChart('Where it fails: with the ticked effects', ALPHA), mapChart('When it fails: model as given', TIME), mapChart('When it fails: with the ticked effects', TIME)];
  const second = el('select', { id: 'second', 'aria-label': 'Second flight to show beside this one' }, el('option', { value: '' }, 'no second flight'));
  const beforeAnswer = el('div', {}, acts);
  const work = el('div', { class: 'cols', hidden: true, id: 'work' },
    el('section', {}, el('h2', {}, 'Effects'), el('div', { class: 'row' }, find, fit), findBar, findSay, beforeAnswer, own, ownSay, effects),
    el('section', {}, verdict, mission, el('h2', {}, 'Model against measurement'), fRate, el('div', { class: 'charts' }, ...fMaps), fRes, fCurve, fDepth, fTrack, el('div', { class: 'row' }, el('label', { for: 'second' }, 'A second flight beside it:'), second)));
  const hil = el('section', { id: 'hil' });
  root.replaceChildren(
    el('a', { class: 'skip', href: '#flight' }, 'Skip to the flight'),
    el('div', { class: 'bar' }, el('h1', {}, 'Glider workbench'), Glider.themeButton()),
    el('section', { id: 'flight' }, opener, summary, notes, status, openBar), ladder, work, hil, el('footer', {}, 'Nothing leaves this machine.'));
  const figures = [fDepth, fRate, fRes, fCurve, fTrack, ...fMaps];
  figures.forEach((f) => f.attach());

  // ---- what a reload keeps ----------------------------------------------
  const KEY = 'glider-workbench';
  const keep = () => {
    const kept = state.flight && { flight: state.flight.id, name: state.flight.name, ticked: [...state.ticked], history: state.history, found: state.found };
    try { sessionStorage.setItem(KEY, JSON.stringify(kept)); } catch { /* a full store loses comfort, not work */ }
  };
  const kept = () => { try { return JSON.parse(sessionStorage.getItem(KEY)) || {}; } catch { return {}; } };

  // ---- flights ----------------------------------------------------------
  const opened = async (f, before = {}) => {
    second.value = '';
    Object.assign(state, { flight: f, second: null, ticked: new Map(before.ticked || []), gains: new Map(), history: before.history || [], found: null });
    verdict.replaceChildren();
    mission.replaceChildren();
    beforeAnswer.append(acts);
    [next, report].forEach((b) => (b.disabled = true));
    [findSay, saveSay].forEach((s) => say(s, ''));
    summary.textContent = `${f.name}: ${f.rows} rows, ${f.segments} segments, ${f.hours.toFixed(2)} h under way${f.speed ? ', with speed through the water' : ''}${f.vehicle ? `, vehicle ${f.vehicle}` : ''}.`;
    notes.hidden = !(f.notes || []).length;
    notes.replaceChildren(el('summary', {}, `How it was read: ${(f.notes || []).length} note${f.notes.length === 1 ? '' : 's'}`), el('ul', {}, ...(f.notes || []).map((n) => el('li', {}, n))));
    if (![...second.options].some((o) => o.value === String(f.id))) second.append(el('option', { value: f.id }, f.name));
    [find, fit, save, timeline].forEach((b) => (b.disabled = false));
    [ladder, work].forEach((n) => (n.hidden = false));
    opener.open = false;
    opener.firstChild.textContent = 'Open another flight';
    drawEffects();
    await evaluate();
    if (before.found) showVerdict(before.found);
    document.dispatchEvent(new Event('flight-open'));
  };
  const base64 = (f) => new Promise((done, failed) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result.slice(reader.result.indexOf(',') + 1));
    reader.onerror = () => failed(new Error(`${f.name}: cannot be read`));
    reader.readAsDataURL(f);
  });
  // Opens what a request names, and says how far it is while the server reads.
  const opening = async (request) => {
    const began = Date.now();
    const look = async () => {
      try { say(status, `${(await json('/api/opening')).text} … ${Math.round((Date.now() - began) / 1000)} s`); } catch { /* the request itself will say */ }
    };
    const timer = setInterval(look, 500);
    openBar.hidden = false;
    try {
      const summary = await json('/api/open', request);
      clearInterval(timer);
      await opened(summary);
      say(status, 'Flight open.', 'good');
      find.focus({ preventScroll: true });
    } catch (e) { say(status, e.message, 'bad'); opener.open = true; }
    clearInterval(timer);
    openBar.hidden = true;
  };
  const open = async (files) => {
    say(status, 'Reading …');
    try {
      const size = [...files].reduce((sum, f) => sum + f.size, 0);
      if (size > 56e6) throw new Error(`${[...files].map((f) => f.name).join(', ')}: ${fmt(size / 1e6)} MB; the page takes up to 56 MB, use \`glider import\` and \`glider diagnose\` for more.`);
      const sent = await Promise.all([...files].map(async (f) => ({ name: f.name, base64: await base64(f) })));
      await opening({ files: sent });
    } catch (e) { say(status, e.message, 'bad'); opener.open = true; }
  };
  file.addEventListener('change', () => file.files.length && open(file.files));
  for (const [type, over] of [['dragover', true], ['dragleave', false], ['drop', false]]) {
    drop.addEventListener(type, (e) => { e.preventDefault(); drop.classList.toggle('over', over); if (type === 'drop' && e.dataTransfer.files.length) open(e.dataTransfer.files); });
  }
  addEventListener('dragover', (e) => e.preventDefault());
  addEventListener('drop', (e) => { e.preventDefault(); if (!drop.contains(e.target) && e.dataTransfer.files.length) open(e.dataTransfer.files); });
  openListed.addEventListener('click', () => opening({ listed: Number(listed.value) }));
  example.addEventListener('click', () => opening({ example: true }));

  // ---- effects ----------------------------------------------------------
  const effectItem = (e) => {
    const id = e.name.replace(/\W+/g, '-');
    const box = el('input', { type: 'checkbox', id: 'fx-' + id });
    const gain = el('span', { class: 'gain', id: 'gain-' + id });
    const sliders = el('div', { class: 'sliders' });
    const li = el('li', {}, el('label', {}, box, el('span', {}, e.words), gain), el('p', { class: 'physics' }, e.physics), sliders);
    e.show = () => {
      const values = state.ticked.get(e.name);
      box.checked = !!values;
      const alone = state.gains.get(e.name), recal = state.error && state.error.recalibrated;
      const by = alone == null || recal == null ? null : 100 * (recal - alone);
      gain.textContent = by == null ? '' : by >= 0.0005 ? `−${by.toFixed(3)} cm/s` : 'no gain';
      gain.title = by == null ? '' : 'What this effect alone takes off the error beyond recalibration';
      gain.classList.toggle('good', by != null && by >= 0.0005);
      sliders.replaceChildren(...(values ? e.parameters.flatMap((p, i) => {
        if (!p.typical) return []; // stated with the others, not for a hand to move
        const text = el('span', {}, `${fmt(values[i])}${unit(p.unit)}`);
        const wide = p.high - p.low > 1e5; // of an expression nobody knows the range
        const s = el('input', { type: wide ? 'number' : 'range', min: p.low, max: p.high, step: wide ? 'any' : (p.high - p.low) / 400, value: values[i], 'aria-label': `${e.words} ${p.name}` });
        s.addEventListener('input', () => { values[i] = Number(s.value); text.textContent = `${fmt(values[i])}${unit(p.unit)}`; evaluate(); });
        return [el('label', {}, el('span', {}, p.name), text, s)];
      }) : []));
    };
    box.addEventListener('change', async () => {
      remember();
      if (!box.checked) { state.ticked.delete(e.name); e.show(); if (state.ticked.size) await fitTicked(); else await evaluate(); return; }
      state.ticked.set(e.name, e.parameters.map((p, i) => (i ? p.off : p.off + p.typical <= p.high ? p.off + p.typical : p.off - p.typical)));
      e.show();
      await fitTicked();
    });
    e.show();
    return li;
  };
  const drawEffects = () => effects.replaceChildren(...state.kinds.flatMap((kind) => {
    const inside = state.catalogue.filter((e) => e.kind === kind);
    return inside.length ? [el('h3', {}, kind), el('ul', { 'aria-label': kind }, ...inside.map(effectItem))] : [];
  }));
  own.addEventListener('submit', async (event) => {
    event.preventDefault();
    try {
      const e = await json('/api/own', { expression: ownText.value });
      if (!state.catalogue.some((c) => c.name === e.name)) state.catalogue.push(e);
      if (!state.kinds.includes(e.kind)) state.kinds.unshift(e.kind);
      drawEffects();
      say(ownSay, '');
      document.getElementById('fx-' + e.name.replace(/\W+/g, '-')).click();
    } catch (e) { say(ownSay, e.message, 'bad'); }
  });
  const chosen = () => Object.fromEntries(state.ticked);
  const copy = () => [...state.ticked].map(([k, v]) => [k, [...v]]);
  const remember = () => { state.history.push({ ticked: copy(), now: state.error && state.error.now }); if (state.history.length > 30) state.history.shift(); };
  undo.addEventListener('click', async () => {
    const before = state.history.pop();
    if (!before) return;
    state.ticked = new Map(before.ticked);
    state.catalogue.forEach((e) => e.show());
    await evaluate();
  });
  let pending = null;
  async function evaluate() {
    if (!state.flight) return;
    if (pending) pending.abort();
    pending = new AbortController();
    try {
      draw(await json('/api/evaluate', { flight: state.flight.id, effects: chosen() }, pending.signal));
    } catch (e) { if (e.name !== 'AbortError') say(status, e.message, 'bad'); }
  }
  async function fitTicked() {
    if (!state.flight || !state.ticked.size) return evaluate();
    say(findSay, 'Fitting …');
    try {
      const names = [...state.ticked.keys()];
      const r = await json('/api/fit', { flight: state.flight.id, effects: names });
      for (const [name, values] of Object.entries(r.effects)) state.ticked.set(name, values);
      if (names.length === 1) state.gains.set(names[0], r.error.now);
      if (pending) pending.abort(); // it asked for the values before the fit
      draw(r);
      say(findSay, r.error.held_out ? 'Fitted on the fit segments; the figures above are of segments kept out of the fit.' : 'Fitted; no segments are kept out, the figures above are of the fitted ones.', 'good');
    } catch (e) { say(findSay, e.message, 'bad'); }
  }
  fit.addEventListener('click', () => { remember(); fitTicked(); });

  // ---- the ladder and the charts -----------------------------------------
  function drawLadder(error) {
    state.error = error;
    const most = Math.max(...steps.map((s) => error[s.key] || 0), 1e-9);
    for (const s of steps) {
      const idle = s.key === 'now' && !state.ticked.size;
      s.value.textContent = cm(error[s.key]);
      s.node.classList.toggle('idle', idle);
      s.bar.style.width = `${(100 * (error[s.key] || 0)) / most}%`;
    }
    const by = error.recalibrated == null || error.now == null ? null : 100 * (error.recalibrated - error.now);
    const where = error.held_out ? 'on segments kept out of the fit' : 'on the fitted segments';
    const which = [...state.ticked.keys()].map(words).join(' + ');
    worth.textContent = !state.ticked.size ? `Depth-rate error in cm/s, ${where}. Nothing is ticked.`
      : by == null ? '' : by >= 0.0005 ? `${which}: takes off ${by.toFixed(3)} cm/s beyond recalibration, ${where}.`
        : `${which}: worth nothing here; recalibration alone leaves ${(-by).toFixed(3)} cm/s less, ${where}.`;
    const least = state.ticked.size ? error.now : error.recalibrated;
    if (least != null && error.floor != null && least < error.floor) worth.textContent += ' Below the floor: water or sensors were quieter than the vehicle file states.';
    worth.className = state.ticked.size && by != null ? (by >= 0.0005 ? 'good' : 'bad') : '';
    undo.disabled = !state.history.length;
    past.textContent = state.history.length ? [...state.history.slice(-4).map((h) => cm(h.now)), cm(error.now)].join(' → ') : '';
    state.catalogue.forEach((e) => e.show && e.show());
    keep();
  }
  function draw(r) {
    drawLadder(r.error);
    const b = r.blocks, other = state.second, on = state.ticked.size > 0;
    const beside = (key, name) => (other ? [{ name: `${name} (${other.name})`, x: other.t, y: other[key] }] : []);
    const ticked = (series) => (on ? [series] : []);
    const minus = (key) => b.observed.map((v, i) => (v == null || b[key][i] == null ? null : v - b[key][i]));
    fDepth.handle.set([{ name: 'measured', x: b.t, y: b.depth }, ...beside('depth', 'measured')]);
    const refitted = (x, y) => (y && y.some((v) => v != null) ? [{ name: 'recalibrated', x, y }] : []);
    fRate.querySelector('figcaption').firstChild.textContent = `Depth rate in ${fmt(r.block_s)} s blocks`;
    fRate.handle.set([{ name: 'measured', x: b.t, y: b.observed }, { name: 'as given', x: b.t, y: b.nominal }, ...refitted(b.t, b.recalibrated), ...ticked({ name: 'with the ticked effects', x: b.t, y: b.now }), ...beside('observed', 'measured'), ...(other ? [{ name: 'difference of the two measured', x: other.difference.t, y: other.difference.observed }] : [])]);
    // One moment in all of them: the charts over time by their cursor, the others by a ring.
    Object.assign(fRes.handle.chart, { clock: 'time', at: b.t });
    fRes.handle.set([{ name: 'as given', x: b.alpha, y: minus('nominal') }, ...refitted(b.alpha, minus('recalibrated')), ...ticked({ name: 'with the ticked effects', x: b.alpha, y: minus('now') })]);
    fTrack.hidden = !b.east.some((v) => v != null);
    Object.assign(fTrack.handle.chart, { clock: 'time', at: b.t });
    fTrack.handle.set([{ name: 'dead reckoning', x: b.east, y: b.north }, { name: 'GPS fixes', x: r.fixes.east, y: r.fixes.north }]);
    fCurve.handle.set([{ name: 'as given', x: r.curve.alpha, y: r.curve.nominal }, ...refitted(r.curve.alpha, r.curve.recalibrated), ...ticked({ name: 'with the ticked effects', x: r.curve.alpha, y: r.curve.now }), { name: 'share of time there, 1 = all of it', x: r.curve.flown_alpha || [0], y: r.curve.flown_share || [null] }]);
    const largest = (m) => Math.max(...m.z.filter((v) => v != null).map(Math.abs), 1e-9); // one scale for two: the second is paler where it is better
    [fMaps[1].hidden, fMaps[3].hidden] = [!on, !on];
    r.maps.forEach((m, i) => { Object.assign(fMaps[i].handle.chart, { most: largest(r.maps[i - (i % 2)]), clock: 'time', at: b.t, where: [i < 2 ? b.alpha : b.t, b.depth] }); fMaps[i].handle.set([m]); });
  }
  second.addEventListener('change', async () => {
    state.second = null;
    try {
      if (second.value) state.second = await json('/api/overlay', { flight: state.flight.id, second: Number(second.value) });
      await evaluate();
    } catch (e) { say(status, e.message, 'bad'); }
  });

  // ---- find what is missing --------------------------------------------
  find.addEventListener('click', async () => {
    find.disabled = true;
    findBar.hidden = false;
    findBar.value = 0;
    say(findSay, 'Trying the whole catalogue, alone and in pairs …');
    try {
      await stream('/api/diagnose', { flight: state.flight.id }, (m) => {
        if (m.error) throw new Error(m.error);
        // A second look starts over; the bar does not.
        if (m.progress != null) { findBar.value = Math.max(findBar.value, m.progress); say(findSay, `Asking ${words(m.text)} …`); }
        if (!m.result) return;
        showVerdict(m.result);
        document.getElementById('answer').focus(); // now: a redraw of the charts may take seconds, and a person has gone on
      });
      await evaluate();
    } catch (e) { say(findSay, e.message, 'bad'); }
    findBar.hidden = true;
    find.disabled = false;
  });
  function showVerdict(d) {
    state.found = d;
    for (const c of d.candidates) {
      const error = c.error_after_heldout ?? c.error_after; // none: not worth refitting
      if (c.effects.length === 1 && error != null) state.gains.set(c.effects[0], error / 100);
    }
    state.catalogue.forEach((e) => e.show && e.show());
    const sure = { adequate: 'good', explained: 'good' }[d.verdict] || '';
    say(findSay, `Verdict: ${d.verdict}${d.answer.length ? ' – ' + d.answer.map(words).join(' + ') : ''}.`, sure);
    const rows = d.candidates.slice(0, 8).map((c) => [c.effects.map(words).join(' + '), Object.entries(c.parameters).map(([k, p]) => `${k.split('.').pop()} ${fmt(p.value)} [${fmt(p.low)}, ${fmt(p.high)}]${unit(p.unit)}`).join('; '), fmt(c.error_after_heldout ?? c.error_after), (100 * c.probability).toFixed(0) + ' %']);
    const same = (d.equivalent || []).filter((c) => c.join() !== d.answer.join());
    const line = (k, v) => (v ? [el('dt', {}, k), el('dd', {}, ...Glider.prose(v))] : []);
    const remains = (d.remains || []).map((r) => `${r.variable.replaceAll('_', ' ')}${r.phase ? ` (${r.phase})` : ''}: ${fmt(r.size_cm_s)} cm/s`).join('; ');
    const take = d.answer.length ? button('take', 'Tick it and fit') : null;
    const part = (key) => { const text = d.in_words[key]; return text.replace(/^[a-z](?=[a-z]* )/, (c) => c.toUpperCase()).replace(/\.?$/, '.'); }; // names of numbers stay
    const figures = d.charts.map((c) => Glider.figure(c, true));
    verdict.replaceChildren(el('h2', { tabindex: '-1', id: 'answer' }, 'The answer'),
      el('dl', { class: 'answer' }, ...line('Verdict', `${d.verdict}: ${d.answer.map(words).join(' + ') || (d.verdict === 'unexplained' ? 'no known effect to add' : 'nothing to add')}`), ...line('What moved', part('what_moved')), ...line('What is missing', part('what_is_missing')), ...line('Cannot tell from', same.map((c) => c.map(words).join(' + ')).join('; ')), ...line('What could hide', part('what_could_hide')), ...line('What next', part('what_next')), ...line('What remains', remains)),
      ...(take ? [take] : []), acts, ...figures,
      el('details', {}, el('summary', {}, `All candidates, best first (${rows.length} shown)`),
        Glider.table({ caption: 'Candidates', head: ['effects', 'parameters and 90 % interval', `error after (${d.error.unit})`, 'probability'], rows })));
    figures.forEach((f) => f.attach());
    [next, report].forEach((b) => (b.disabled = false));
    if (take) {
      take.addEventListener('click', () => {
        remember();
        state.ticked.clear();
        d.answer.forEach((n) => { const e = state.catalogue.find((c) => c.name === n); if (e) state.ticked.set(n, e.parameters.map((p) => p.off)); });
        const box = document.getElementById(`fx-${d.answer[0]}`);
        if (box) effects.scrollTop = box.closest('li').offsetTop - effects.offsetTop - 40;
        fitTicked();
      });
    }
    keep();
  }
  flyIt.addEventListener('click', () => document.dispatchEvent(new Event('fly-learnt')));
  const fetched = (b, path, type, told) => b.addEventListener('click', async () => {
    try {
      const r = await json(path, { flight: state.flight.id });
      download(r.name, r.text, type);
      say(saveSay, told(r), 'good');
      if (path === '/api/next') document.dispatchEvent(new Event('flight-planned'));
    } catch (e) { say(saveSay, e.message, 'bad'); }
  });
  fetched(next, '/api/next', 'application/toml', (r) => `Saved ${r.name}: it puts ${r.tied} apart by an expected chi² of ${fmt(r.expected_chi2)} (${fmt(r.at_one_pitch)} at one pitch). “Fly it” flies it here, glider fly --mission ${r.name} --log DIR there.`);
  timeline.addEventListener('click', async () => {
    say(saveSay, 'Following the vehicle from dive to dive …');
    try {
      const r = await json('/api/timeline', { flight: state.flight.id });
      const drawn = r.charts.map((c) => Glider.figure(c, true));
      mission.replaceChildren(el('h2', { tabindex: '-1' }, `Timeline: ${r.dives} dives of ${r.flights.length} flight${r.flights.length === 1 ? '' : 's'}`), el('p', {}, r.caption), ...r.notes.map((n) => el('p', { class: 'lead' }, n)), ...drawn);
      drawn.forEach((f) => f.attach());
      say(saveSay, 'Timeline drawn.', 'good');
      mission.firstChild.focus();
    } catch (e) { say(saveSay, e.message, 'bad'); }
  });
  fetched(report, '/api/report', 'text/html', (r) => `Saved ${r.name}.`);
  save.addEventListener('click', async () => {
    try {
      const r = await json('/api/save', { flight: state.flight.id, effects: chosen() });
      download(r.vehicle.name, r.vehicle.text, 'application/json');
      if (r.table) download(r.table.name, Uint8Array.from(r.table.values), 'application/octet-stream');
      say(saveSay, `Saved ${r.vehicle.name}${r.table ? ` and ${r.table.name} (${r.table.bytes} bytes)` : ''}${r.note ? ': ' + r.note : ''}.`, 'good');
    } catch (e) { say(saveSay, e.message, 'bad'); }
  });

  // ---- start ------------------------------------------------------------
  const start = (async () => {
    try {
      const c = await json('/api/catalogue');
      Object.assign(state, { catalogue: c.effects, kinds: c.kinds });
      drawEffects();
      for (const [i, f] of c.flights.entries()) { listed.append(el('option', { value: i }, f)); listedRow.hidden = false; }
      for (const f of c.open) second.append(el('option', { value: f.id }, f.name));
      const before = kept(), again = c.open.find((f) => f.id === before.flight && f.name === before.name);
      if (again) await opened(again, before);
      say(status, again ? 'Ready: the flight is as it was before the page was loaded again.' : 'Ready. Nothing leaves this machine.');
      return c;
    } catch (e) { say(status, e.message, 'bad'); return null; }
  })();
  return { state, json, stream, say, chart, placeChart, button, hil, start };
})();
