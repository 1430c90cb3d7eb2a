// Fly it: the real controller against the simulated glider, live, with faults, in a calm sea or in the world that a flight revealed.
(() => {
  'use strict';
  const { el, fmt } = Glider;
  const { state, json, stream, say, chart, placeChart, button, hil } = Bench;
  const options = (id, label, list) => el('select', { id, 'aria-label': label }, ...list.map(([v, t]) => el('option', { value: v }, t || v)));
  const wings = options('wings', 'Wings', [['standard', 'standard wings'], ['low-ar', 'low aspect ratio wings']]);
  const mission = options('mission', 'Mission', []);
  const seat = options('seat', 'Seat', [['in-process'], ['pty'], ['qemu']]);
  const controller = options('controller', 'Controller', [['ours', 'our controller'], ['stock', 'stock controller']]);
  const pace = options('pace', 'Pace', [[0, 'as fast as it goes'], [200, '200 × real time'], [50, '50 × real time']]);
  const learnt = el('input', { type: 'checkbox', id: 'learnt', disabled: true });
  const fly = button('fly', 'Fly it'), stop = button('stop', 'Recall', true), play = button('play', 'Play', true);
  const faults = el('div', { class: 'row', id: 'faults', role: 'group', 'aria-label': 'Inject a fault' });
  const status = el('p', { class: 'say', role: 'status', id: 'live-status' });
  const events = el('ul', { id: 'events', 'aria-label': 'Events' });
  const both = el('div', { id: 'both' });
  const numbers = el('div', { class: 'numbers', id: 'live-numbers' });
  const scrub = el('input', { type: 'range', class: 'scrub', id: 'scrub', min: 0, max: 0, value: 0, 'aria-label': 'Scrub through the flight' });
  const fDepth = chart('Depth', 'line', ['time', 's'], ['depth', 'm'], 'live', true);
  const fPitch = chart('Pitch and ballast', 'line', ['time', 's'], ['pitch (°), ballast (10 cc)', ''], 'live');
  const fAlpha = chart('Angle of attack against the best one', 'line', ['time', 's'], ['angle of attack', '°'], 'live');
  const fTrack = placeChart('Track over ground');
  const flown = el('div', { hidden: true }, both, numbers, el('div', { class: 'row' }, play, scrub), events, fDepth, fPitch, fAlpha, fTrack);
  hil.append(el('h2', {}, 'Fly it'),
    el('p', { class: 'lead' }, 'The real controller against the simulated glider. In the seat qemu it is the very image that is flashed to the board.'),
    el('div', { class: 'row' }, wings, mission, seat, controller, pace, fly, stop),
    el('div', { class: 'row' }, el('label', {}, learnt, ' in the world that this flight means, with the ticked effects if any: with the old table, then with the new one')),
    el('fieldset', {}, el('legend', {}, 'Inject a fault'), faults), status, flown);
  const figures = [fDepth, fPitch, fAlpha, fTrack];
  figures.forEach((f) => f.attach());
  const planned = el('option', { value: 'planned' }, 'the planned next flight');
  document.addEventListener('flight-open', () => { learnt.disabled = false; planned.remove(); });
  document.addEventListener('flight-planned', () => { mission.append(planned); mission.value = 'planned'; });
  document.addEventListener('fly-learnt', () => {
    if (fly.disabled) return;
    learnt.checked = true;
    if (mission.value !== 'planned') mission.value = 'sea';
    hil.scrollIntoView();
    fly.focus({ preventScroll: true });
    fly.click();
  });

  let rows = [], passes = [], marks = [], follow = true, timer = 0, player = 0;
  const column = (k, of = rows) => of.map((r) => r[k]);
  // Speeds near zero have no angle of attack.
  const angle = (k) => rows.map((r) => (Math.abs(r.alpha) < 45 ? r[k] : null));
  const drawLive = () => {
    timer = 0;
    flown.hidden = false;
    const t = column('t');
    const phases = rows.filter((r, i) => i && r.phase !== rows[i - 1].phase).map((r) => ({ x: r.t, label: r.phase }));
    const shown = [...(phases.length <= 24 ? phases : []), ...marks];
    [fDepth, fPitch, fAlpha].forEach((f) => { f.handle.chart.marks = shown; });
    const before = passes.map((p) => ({ name: p.name, x: column('t', p.rows), y: column('depth', p.rows) }));
    fDepth.handle.set([{ name: 'true depth', x: t, y: column('depth') }, ...before]);
    fPitch.handle.set([{ name: 'pitch', x: t, y: column('pitch') }, { name: 'setpoint', x: t, y: column('setpoint') }, { name: 'ballast', x: t, y: column('ballast') }]);
    fAlpha.handle.set([{ name: 'true', x: t, y: angle('alpha') }, { name: 'estimated', x: t, y: angle('alpha_estimate') }, { name: 'best (α*)', x: t, y: angle('alpha_best') }]);
    Object.assign(fTrack.handle.chart, { clock: 'live', at: t });
    fTrack.handle.set([{ name: 'true track', x: column('east'), y: column('north') }]);
    scrub.max = Math.max(0, rows.length - 1);
    if (follow) scrub.value = scrub.max;
    showRow(Number(scrub.value));
  };
  const showRow = (i) => {
    const r = rows[i];
    if (!r) return;
    numbers.replaceChildren(...[['time', fmt(r.t) + ' s'], ['phase', r.phase], ['depth', fmt(r.depth) + ' m'], ['pitch', fmt(r.pitch) + '°'], ['α, α*', `${fmt(r.alpha)}°, ${fmt(r.alpha_best)}°`], ['abort', r.abort || 'none'], ['table', r.table], ['link', r.link]]
      .map(([k, v]) => el('div', {}, el('b', { id: 'live-' + k.replace(/[^a-z]/g, '') }, String(v)), el('span', {}, k))));
    const plot = fDepth.handle.plot;
    // One is enough: the others of its group follow.
    if (!follow && plot) plot.setCursor({ left: plot.valToPos(r.t, 'x'), top: 10 }, true, true);
  };
  const to = (i) => { scrub.value = i; follow = i >= Number(scrub.max); showRow(i); };
  scrub.addEventListener('input', () => to(Number(scrub.value)));
  play.addEventListener('click', () => {
    if (player) { clearInterval(player); player = 0; play.textContent = 'Play'; return; }
    if (Number(scrub.value) >= Number(scrub.max)) to(0);
    play.textContent = 'Pause';
    player = setInterval(() => { if (Number(scrub.value) >= Number(scrub.max)) play.click(); else to(Number(scrub.value) + Math.max(1, Math.round(scrub.max / 400))); }, 50);
  });
  const event = (text) => events.append(el('li', {}, text));

  // ---- lines of a flight, as they come or after a reload ------------------
  const take = (m) => {
    if (m.error) throw new Error(m.error);
    if (m.pass != null) {
      if (rows.length) passes.push({ name: 'with the ' + passName, rows });
      passName = m.pass;
      rows = [];
      marks = [];
    }
    if (m.rows) {
      rows.push(...m.rows);
      if (!timer) timer = setTimeout(drawLive, 150);
      say(status, `Flying in the seat ${m.seat}${passName ? `, ${passName}` : ''}.`);
    }
    if (m.worlds) {
      stop.disabled = true;
      say(status, `Flying both tables in worlds within the tolerances of the vehicle: ${m.worlds} of ${m.of}.`);
    }
    if (m.end) ended(m);
  };
  let passName = '';
  const ended = (m) => {
    say(status, `End: ${m.end}. ${m.dives} dives, ${fmt(m.distance_m)} m, L/D ${fmt(m.achieved_l_over_d)} of ${fmt(m.max_l_over_d)}. Log: ${m.log}`, m.end === 'done' ? 'good' : '');
    if (!m.beside) return;
    const row = (name, f) => [name, f.table_id, fmt(f.achieved_l_over_d), fmt(f.distance_m), f.end];
    both.replaceChildren(Glider.table({ caption: `Same world, two tables: the new one gains ${m.range_gain_in_words}`, head: ['', 'table', 'L/D flown', 'over ground (m)', 'end'], rows: [row('old table', m.beside), row('new table', m)] }));
  };
  const begin = () => {
    [fly.disabled, stop.disabled, follow, rows, passes, marks, passName] = [true, false, true, [], [], [], ''];
    both.replaceChildren();
    events.replaceChildren();
  };
  const finish = () => {
    clearTimeout(timer);
    drawLive();
    [fly.disabled, stop.disabled, play.disabled] = [false, true, !rows.length];
  };
  fly.addEventListener('click', async () => {
    begin();
    say(status, learnt.checked ? 'Refitting the vehicle and making its table …' : 'Taking the seat …');
    const request = { wings: wings.value, mission: mission.value, seat: seat.value, controller: controller.value, pace: Number(pace.value) };
    if (mission.value === 'planned') request.planned = state.flight.id;
    if (learnt.checked) request.learnt = { flight: state.flight.id, effects: [...state.ticked.keys()] };
    try { await stream('/api/fly', request, take); } catch (e) { say(status, e.message, 'bad'); }
    finish();
  });
  stop.addEventListener('click', () => json('/api/stop', {}).then(() => event(`${fmt((rows[rows.length - 1] || { t: 0 }).t)} s: recalled`), (e) => say(status, e.message, 'bad')));
  const inject = (f) => json('/api/fault', { spec: f.spec }).then((r) => {
    const t = (rows[rows.length - 1] || { t: 0 }).t;
    marks.push({ x: t, label: f.label, fault: true });
    event(`${fmt(t)} s: ${r.text}`);
  }, (e) => say(status, e.message, 'bad'));

  // ---- start: also in the middle of a flight that another load of the page began ----
  const watch = async () => {
    let from = 0;
    for (;;) {
      const w = await json(`/api/watch?from=${from}`);
      if (!from && !w.lines.length) return;
      if (!from) begin();
      from = w.next;
      w.lines.forEach(take);
      if (!w.under_way) break;
      await new Promise((r) => setTimeout(r, 500));
    }
    finish();
  };
  (async () => {
    const c = await Bench.start;
    if (!c) return;
    mission.append(...c.missions.map((m) => el('option', { value: m }, m)));
    faults.replaceChildren(...c.faults.map((f) => el('button', { type: 'button', 'data-fault': f.spec, onclick: () => inject(f) }, f.label)));
    try { await watch(); } catch (e) { say(status, e.message, 'bad'); finish(); }
  })();
})();
