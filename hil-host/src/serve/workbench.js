// The live workbench: open a flight, tick effects, find what is missing, fly it.
(() => {
  'use strict';
  const { el, fmt } = Glider;
  const token = new URLSearchParams(location.search).get('token') || '';
  const root = document.getElementById('page');
  const state = { catalogue: [], flight: null, second: null, ticked: new Map(), listed: [] };

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

  // ---- skeleton ---------------------------------------------------------
  const status = el('p', { class: 'say', role: 'status', 'aria-live': 'polite', id: 'status' });
  const file = el('input', { type: 'file', multiple: true, id: 'file', 'aria-label': 'Flight files: flight.csv and its vehicle file' });
  const drop = el('div', { class: 'drop', id: 'drop' }, el('p', {}, 'Drop flight.csv and its vehicle file here, or choose them:'), file);
  const listed = el('select', { id: 'listed', 'aria-label': 'Flights named on the command line' });
  const openListed = el('button', { type: 'button', id: 'open-listed' }, 'Open');
  const listedRow = el('div', { class: 'row', hidden: true }, el('label', { for: 'listed' }, 'or'), listed, openListed);
  const summary = el('p', { class: 'lead', id: 'summary' });
  const number = (id, label) => { const b = el('b', { id }, '–'); return [b, el('div', {}, b, el('span', {}, label))]; };
  const [nNominal, dNominal] = number('error-nominal', 'model as given, cm/s');
  const [nRecal, dRecal] = number('error-recalibrated', 'recalibrated in tolerance, cm/s');
  const [nNow, dNow] = number('error-now', 'with the ticked effects, cm/s');
  const effects = el('ul', { class: 'effects', id: 'effects', 'aria-label': 'Effects' });
  const find = el('button', { type: 'button', id: 'find', disabled: true }, 'Find what is missing');
  const fit = el('button', { type: 'button', id: 'fit', disabled: true }, 'Fit the ticked effects');
  const save = el('button', { type: 'button', id: 'save', disabled: true }, 'Save vehicle and table');
  const findSay = el('p', { class: 'say', role: 'status', id: 'find-status' });
  const findBar = el('progress', { hidden: true, 'aria-label': 'search for the missing effect' });
  const verdict = el('div', { id: 'verdict' });
  const chart = (title, mark, x, y, group, down) => Glider.figure({ title, mark, x: { label: x[0], unit: x[1] }, y: { label: y[0], unit: y[1], inverted: !!down }, series: [{ name: '', x: [0, 1], y: [null, null] }], group }, true);
  const fDepth = chart('Depth', 'line', ['time under way', 's'], ['depth', 'm'], 'flight', true);
  const fRate = chart('Depth rate: measured and model', 'line', ['time under way', 's'], ['depth rate', 'cm/s'], 'flight');
  const fRes = chart('Residual against angle of attack', 'point', ['angle of attack', '°'], ['residual', 'cm/s']);
  const fCurve = chart('L/D against angle of attack', 'line', ['angle of attack', '°'], ['L/D', '']);
  const second = el('select', { id: 'second', 'aria-label': 'Second flight to show beside this one' }, el('option', { value: '' }, 'no second flight'));

  const wings = el('select', { id: 'wings', 'aria-label': 'Wings' }, el('option', { value: 'standard' }, 'standard wings'), el('option', { value: 'low-ar' }, 'low aspect ratio wings'));
  const mission = el('select', { id: 'mission', 'aria-label': 'Mission' }, ...['shallow', 'sea', 'deep'].map((m) => el('option', { value: m }, m)));
  const seat = el('select', { id: 'seat', 'aria-label': 'Seat' }, ...['in-process', 'pty', 'qemu'].map((m) => el('option', { value: m }, m)));
  const controller = el('select', { id: 'controller', 'aria-label': 'Controller' }, ...['ours', 'stock'].map((m) => el('option', { value: m }, m)));
  const pace = el('select', { id: 'pace', 'aria-label': 'Pace' }, ...[[0, 'as fast as it goes'], [200, '200 × real time'], [50, '50 × real time']].map(([v, t]) => el('option', { value: v }, t)));
  const fly = el('button', { type: 'button', id: 'fly' }, 'Fly it');
  const stop = el('button', { type: 'button', id: 'stop', disabled: true }, 'Recall');
  const faults = el('div', { class: 'row', id: 'faults', role: 'group', 'aria-label': 'Inject a fault' });
  const liveSay = el('p', { class: 'say', role: 'status', id: 'live-status' });
  const liveNumbers = el('div', { class: 'numbers', id: 'live-numbers' });
  const fLive = chart('Depth', 'line', ['time', 's'], ['depth', 'm'], 'live', true);
  const fPitch = chart('Pitch and ballast', 'line', ['time', 's'], ['pitch (°), ballast (10 cc)', ''], 'live');
  const fAlpha = chart('Angle of attack against the best one', 'line', ['time', 's'], ['angle of attack', '°'], 'live');
  const scrub = el('input', { type: 'range', class: 'scrub', id: 'scrub', min: 0, max: 0, value: 0, 'aria-label': 'Scrub through the flight' });

  root.replaceChildren(
    el('a', { class: 'skip', href: '#flight' }, 'Skip to the flight'),
    el('div', { class: 'bar' }, el('h1', {}, 'Glider workbench'), Glider.themeButton()),
    status,
    el('section', { id: 'flight' }, el('h2', {}, '1 · A flight and its model'), drop, listedRow, summary,
      el('div', { class: 'numbers', 'aria-live': 'polite' }, dNominal, dRecal, dNow)),
    el('div', { class: 'cols' },
      el('section', {}, el('h2', {}, '2 · Effects'), el('p', { class: 'lead' }, 'Tick what may be missing and move its size; error, traces and L/D follow.'),
        el('div', { class: 'row' }, find, fit, save), findBar, findSay, effects),
      el('section', {}, verdict, el('h2', {}, 'Model against measurement'), el('div', { class: 'row' }, el('label', { for: 'second' }, 'Beside it:'), second), fDepth, fRate, fRes, fCurve)),
    el('section', { id: 'hil' }, el('h2', {}, '3 · Fly it'),
      el('p', { class: 'lead' }, 'The real controller against the simulated glider. In the seat qemu it is the very image that is flashed to the board.'),
      el('div', { class: 'row' }, wings, mission, seat, controller, pace, fly, stop),
      el('fieldset', {}, el('legend', {}, 'Inject a fault'), faults), liveSay, liveNumbers, scrub, fLive, fPitch, fAlpha),
    el('footer', {}, 'Nothing leaves this machine.'));
  [fDepth, fRate, fRes, fCurve, fLive, fPitch, fAlpha].forEach((f) => f.attach());

  // ---- flights ----------------------------------------------------------
  const opened = (f) => {
    state.flight = f;
    state.ticked.clear();
    verdict.replaceChildren();
    say(findSay, '');
    summary.textContent = `${f.name}: ${f.rows} rows, ${f.segments} segments, ${fmt(f.hours)} h${f.speed ? ', with speed through the water' : ''}${f.vehicle ? `, vehicle ${f.vehicle}` : ''}.`;
    second.append(el('option', { value: f.id }, f.name));
    [find, fit, save].forEach((b) => (b.disabled = false));
    drawEffects();
    return evaluate();
  };
  const open = async (files) => {
    say(status, 'Reading …');
    try {
      const size = [...files].reduce((sum, f) => sum + f.size, 0);
      if (size > 64e6) throw new Error(`${[...files].map((f) => f.name).join(', ')}: ${fmt(size / 1e6)} MB; the page takes up to 64 MB, use \`glider diagnose --flight\` for more.`);
      const texts = await Promise.all([...files].map(async (f) => ({ name: f.name, text: await f.text() })));
      await opened(await json('/api/open', { files: texts }));
      say(status, 'Flight open.', 'good');
    } catch (e) { say(status, e.message, 'bad'); }
  };
  file.addEventListener('change', () => file.files.length && open(file.files));
  for (const [type, over] of [['dragover', true], ['dragleave', false], ['drop', false]]) {
    drop.addEventListener(type, (e) => { e.preventDefault(); drop.classList.toggle('over', over); if (type === 'drop' && e.dataTransfer.files.length) open(e.dataTransfer.files); });
  }
  addEventListener('dragover', (e) => e.preventDefault());
  addEventListener('drop', (e) => e.preventDefault());
  openListed.addEventListener('click', async () => {
    say(status, 'Reading …');
    try { await opened(await json('/api/open', { listed: Number(listed.value) })); say(status, 'Flight open.', 'good'); } catch (e) { say(status, e.message, 'bad'); }
  });

  // ---- effects ----------------------------------------------------------
  const drawEffects = () => effects.replaceChildren(...state.catalogue.map((e) => {
    const box = el('input', { type: 'checkbox', id: 'fx-' + e.name });
    const sliders = el('div', { class: 'sliders' });
    const li = el('li', {}, el('label', { title: e.physics }, box, el('span', {}, e.name)), sliders);
    const show = () => {
      const values = state.ticked.get(e.name);
      box.checked = !!values;
      sliders.replaceChildren(...(values ? e.parameters.flatMap((p, i) => {
        if (!p.typical) return []; // stated with the others, not for a hand to move
        const text = el('span', {}, `${fmt(values[i])}${unit(p.unit)}`);
        const s = el('input', { type: 'range', min: p.low, max: p.high, step: (p.high - p.low) / 400, value: values[i], 'aria-label': `${e.name} ${p.name}` });
        s.addEventListener('input', () => { values[i] = Number(s.value); text.textContent = `${fmt(values[i])}${unit(p.unit)}`; evaluate(); });
        return [el('label', {}, el('span', {}, p.name), text, s)];
      }) : []));
    };
    box.addEventListener('change', async () => {
      if (!box.checked) { state.ticked.delete(e.name); show(); evaluate(); return; }
      state.ticked.set(e.name, e.parameters.map((p, i) => (i ? p.off : p.off + p.typical <= p.high ? p.off + p.typical : p.off - p.typical)));
      show();
      await fitTicked();
    });
    e.show = show;
    show();
    return li;
  }));
  const chosen = () => Object.fromEntries(state.ticked);
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
      const r = await json('/api/fit', { flight: state.flight.id, effects: [...state.ticked.keys()] });
      for (const [name, values] of Object.entries(r.effects)) state.ticked.set(name, values);
      state.catalogue.forEach((e) => e.show());
      draw(r);
      say(findSay, 'Fitted on the fit segments; the numbers above are on the check segments.', 'good');
    } catch (e) { say(findSay, e.message, 'bad'); }
  }
  fit.addEventListener('click', fitTicked);
  function draw(r) {
    nNominal.textContent = cm(r.error.nominal);
    nRecal.textContent = cm(r.error.recalibrated);
    nNow.textContent = cm(r.error.now);
    const b = r.blocks, other = state.second;
    const beside = (key, name) => (other ? [{ name: `${name} (${other.name})`, x: other.blocks.t, y: other.blocks[key] }] : []);
    fDepth.handle.set([{ name: 'measured', x: b.t, y: b.depth }, ...beside('depth', 'measured')]);
    fRate.handle.set([{ name: 'measured', x: b.t, y: b.observed }, { name: 'model as given', x: b.t, y: b.nominal }, { name: 'with the ticked effects', x: b.t, y: b.now }, ...beside('observed', 'measured')]);
    fRes.handle.set([{ name: 'as given', x: b.alpha, y: b.observed.map((v, i) => (v == null || b.nominal[i] == null ? null : v - b.nominal[i])) }, { name: 'with the ticked effects', x: b.alpha, y: b.observed.map((v, i) => (v == null || b.now[i] == null ? null : v - b.now[i])) }]);
    fCurve.handle.set([{ name: 'as given', x: r.curve.alpha, y: r.curve.nominal }, { name: 'with the ticked effects', x: r.curve.alpha, y: r.curve.now }, { name: 'share of time there, 1 = all of it', x: r.curve.flown_alpha || [0], y: r.curve.flown_share || [null] }]);
  }
  second.addEventListener('change', async () => {
    state.second = null;
    if (second.value) {
      const r = await json('/api/evaluate', { flight: Number(second.value), effects: {} });
      state.second = { name: second.selectedOptions[0].textContent, blocks: r.blocks };
    }
    evaluate();
  });

  // ---- find what is missing --------------------------------------------
  find.addEventListener('click', async () => {
    find.disabled = true;
    findBar.hidden = false;
    findBar.removeAttribute('value');
    say(findSay, 'Trying the whole catalogue, alone and in pairs …');
    try {
      await stream('/api/diagnose', { flight: state.flight.id }, (m) => {
        if (m.error) throw new Error(m.error);
        if (m.progress != null) { findBar.value = m.progress; say(findSay, m.text); }
        if (m.result) showVerdict(m.result);
      });
    } catch (e) { say(findSay, e.message, 'bad'); }
    findBar.hidden = true;
    find.disabled = false;
  });
  function showVerdict(d) {
    say(findSay, `Verdict: ${d.verdict}${d.answer.length ? ' – ' + d.answer.join(' + ') : ''}.`, 'good');
    const rows = d.candidates.slice(0, 8).map((c) => [c.effects.join(' + '), Object.entries(c.parameters).map(([k, p]) => `${k.split('.').pop()} ${fmt(p.value)} [${fmt(p.low)}, ${fmt(p.high)}]${unit(p.unit)}`).join('; '), fmt(c.error_after), (100 * c.probability).toFixed(0) + ' %']);
    const same = (d.equivalent || []).filter((c) => c.join() !== d.answer.join());
    verdict.replaceChildren(el('h2', {}, 'What is missing'), el('p', {}, d.explanation), same.length ? el('p', {}, 'Cannot be told apart from: ' + same.map((c) => c.join(' + ')).join('; ') + '.') : '',
      el('details', innerWidth > 860 ? { open: true } : {}, el('summary', {}, `All candidates, best first (${rows.length} shown)`),
        Glider.table({ caption: 'Candidates', head: ['effects', 'parameters and 90 % interval', `error after (${d.error.unit})`, 'probability'], rows })));
    if (d.answer.length) {
      verdict.querySelector('p').after(el('button', { type: 'button', id: 'take', onclick: () => { state.ticked.clear(); d.answer.forEach((n) => { const e = state.catalogue.find((c) => c.name === n); if (e) state.ticked.set(n, e.parameters.map((p) => p.off)); }); fitTicked(); } }, 'Tick it and fit'));
    }
  }
  const download = (name, text, type) => { const a = el('a', { href: URL.createObjectURL(new Blob([text], { type })), download: name }); a.click(); setTimeout(() => URL.revokeObjectURL(a.href), 1000); };
  save.addEventListener('click', async () => {
    try {
      const r = await json('/api/save', { flight: state.flight.id, effects: chosen() });
      download(r.vehicle.name, r.vehicle.text, 'application/toml');
      if (r.table) download(r.table.name, Uint8Array.from(r.table.values), 'application/octet-stream');
      say(findSay, `Saved ${r.vehicle.name}${r.table ? ` and ${r.table.name} (${r.table.bytes} bytes)` : ''}${r.note ? ': ' + r.note : ''}.`, 'good');
    } catch (e) { say(findSay, e.message, 'bad'); }
  });

  // ---- fly it -----------------------------------------------------------
  let rows = [], follow = true, drawTimer = 0;
  const column = (k) => rows.map((r) => r[k]);
  const drawLive = () => {
    drawTimer = 0;
    const t = column('t');
    fLive.handle.set([{ name: 'true depth', x: t, y: column('depth') }]);
    fPitch.handle.set([{ name: 'pitch', x: t, y: column('pitch') }, { name: 'setpoint', x: t, y: column('setpoint') }, { name: 'ballast', x: t, y: column('ballast') }]);
    fAlpha.handle.set([{ name: 'true', x: t, y: column('alpha') }, { name: 'estimated', x: t, y: column('alpha_estimate') }, { name: 'best (α*)', x: t, y: column('alpha_best') }]);
    scrub.max = Math.max(0, rows.length - 1);
    if (follow) scrub.value = scrub.max;
    showRow(Number(scrub.value));
  };
  const showRow = (i) => {
    const r = rows[i];
    if (!r) return;
    liveNumbers.replaceChildren(...[['time', fmt(r.t) + ' s'], ['phase', r.phase], ['depth', fmt(r.depth) + ' m'], ['pitch', fmt(r.pitch) + '°'], ['α, α*', `${fmt(r.alpha)}°, ${fmt(r.alpha_best)}°`], ['abort', r.abort || 'none'], ['table', r.table], ['link', r.link]]
      .map(([k, v]) => el('div', {}, el('b', { id: 'live-' + k.replace(/[^a-z]/g, '') }, String(v)), el('span', {}, k))));
  };
  scrub.addEventListener('input', () => { follow = Number(scrub.value) >= Number(scrub.max); showRow(Number(scrub.value)); });
  fly.addEventListener('click', async () => {
    fly.disabled = true;
    stop.disabled = false;
    rows = [];
    follow = true;
    say(liveSay, 'Taking the seat …');
    try {
      await stream('/api/fly', { wings: wings.value, mission: mission.value, seat: seat.value, controller: controller.value, pace: Number(pace.value) }, (m) => {
        if (m.error) throw new Error(m.error);
        if (m.rows) { rows.push(...m.rows); if (!drawTimer) drawTimer = setTimeout(drawLive, 150); say(liveSay, `Flying in the seat ${m.seat}.`); }
        if (m.end) say(liveSay, `End: ${m.end}. ${m.dives} dives, ${fmt(m.distance_m)} m, L/D ${fmt(m.achieved_l_over_d)} of ${fmt(m.max_l_over_d)}. Log: ${m.log}`, m.end === 'complete' ? 'good' : '');
      });
    } catch (e) { say(liveSay, e.message, 'bad'); }
    clearTimeout(drawTimer);
    drawLive();
    fly.disabled = false;
    stop.disabled = true;
  });
  stop.addEventListener('click', () => json('/api/stop', {}).catch((e) => say(liveSay, e.message, 'bad')));

  // ---- start ------------------------------------------------------------
  (async () => {
    try {
      const c = await json('/api/catalogue');
      state.catalogue = c.effects;
      drawEffects();
      for (const [i, f] of c.flights.entries()) { listed.append(el('option', { value: i }, f)); listedRow.hidden = false; }
      faults.replaceChildren(...c.faults.map((f) => el('button', { type: 'button', 'data-fault': f.spec, onclick: () => json('/api/fault', { spec: f.spec }).then((r) => say(liveSay, r.text), (e) => say(liveSay, e.message, 'bad')) }, f.label)));
      say(status, 'Ready. Nothing leaves this machine.');
    } catch (e) { say(status, e.message, 'bad'); }
  })();
})();
