// Draws a page of the glider workbench: text, tables, charts. No network.
// Charts of lines and points are uPlot; bars and maps are small SVGs.
const Glider = (() => {
  'use strict';
  const svgns = 'http://www.w3.org/2000/svg';
  const el = (tag, props = {}, ...kids) => {
    const e = document.createElement(tag);
    for (const [k, v] of Object.entries(props)) {
      if (k === 'class') e.className = v;
      else if (k.startsWith('on')) e.addEventListener(k.slice(2), v);
      else if (v !== false && v != null) e.setAttribute(k, v === true ? '' : v);
    }
    e.append(...kids.filter((k) => k != null));
    return e;
  };
  const svg = (tag, props = {}, text) => {
    const e = document.createElementNS(svgns, tag);
    for (const [k, v] of Object.entries(props)) e.setAttribute(k, v);
    if (text != null) e.textContent = text;
    return e;
  };
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const colour = (i) => css('--s' + (i % 7));
  // The same step of the ladder has the same colour in every chart; other series take what is left.
  const STEPS = { measured: 0, 'as given': 1, 'model as given': 1, recalibrated: 4, after: 2, 'with the ticked effects': 2 };
  const hues = (series) => {
    const fixed = series.map((s) => STEPS[s.name]), free = [0, 1, 2, 3, 4, 5, 6].filter((i) => !fixed.includes(i));
    let next = 0;
    return series.reduce((out, s, i) => [...out, s.lower ? out[i - 1] : fixed[i] ?? free[next++ % free.length]], []);
  };
  const fmt = (v) => {
    if (v == null || !Number.isFinite(v)) return '–';
    const a = Math.abs(v);
    if (a !== 0 && (a < 1e-3 || a >= 1e6)) return v.toExponential(2);
    return String(Number(v.toPrecision(4)));
  };
  const axisText = (a) => (a.unit && a.unit !== '1' ? `${a.label} (${a.unit})` : a.label);
  // Hours where seconds would be thousands: the axis, and seconds of one of its units.
  const HOUR = 3600;
  const readable = (axis, span) => (axis.unit === 's' && span > 2 * HOUR ? [{ ...axis, unit: 'h' }, HOUR] : [axis, 1]);
  const charts = new Set(); // everything that must be redrawn when theme or width changes

  // ---- one moment in all charts -----------------------------------------
  // Charts over time share their cursor by `group`. Another chart may be on that clock too (`clock`): `at` has the moments of its
  // points, and the one that is pointed at in any chart is ringed in it.
  const clockOf = (chart) => chart.group || chart.clock;
  let pointing = false;
  const announce = (from, t) => {
    const clock = clockOf(from.chart);
    if (pointing || !clock || t == null) return;
    pointing = true;
    charts.forEach((h) => {
      const synced = from.chart.group && h.chart.group === from.chart.group; // uPlot moves these
      if (h !== from && !synced && h.show && clockOf(h.chart) === clock) h.show(t);
    });
    pointing = false;
  };
  // Index of the moment next to t among those that have a value.
  const nextTo = (at, t, known) => {
    let best = -1;
    for (let i = 0; i < at.length; i++) if (at[i] != null && known(i) && (best < 0 || Math.abs(at[i] - t) < Math.abs(at[best] - t))) best = i;
    return best;
  };

  // ---- lines and points -------------------------------------------------
  // A band is drawn as its two edges with the area between them filled.
  const traces = (chart) => chart.series.flatMap((s) => ((s.mark || chart.mark) === 'band' ? [{ ...s, y: s.high }, { ...s, y: s.low, lower: true }] : [s]));
  // From where to where the values go that are no spikes: where the outermost hundredth would take more of the axis than all others, it is left out.
  const sober = (values) => {
    const v = values.filter((y) => y != null).sort((a, b) => a - b), n = v.length;
    if (n < 50) return null;
    const lo = v[Math.round(0.01 * (n - 1))], hi = v[Math.round(0.99 * (n - 1))], inner = hi - lo;
    return inner > 0 ? [lo - v[0] > inner ? lo - 0.1 * inner : v[0], v[n - 1] - hi > inner ? hi + 0.1 * inner : v[n - 1]] : null;
  };
  function linesData(chart) {
    const series = traces(chart);
    const same = series.every((s) => s.x.length === series[0].x.length && s.x.every((v, i) => v === series[0].x[i]));
    const rising = (x) => x.every((v, i) => i === 0 || v >= x[i - 1]);
    if (same && rising(series[0].x)) return [series[0].x, ...series.map((s) => s.y)];
    const tables = series.map((s) => {
      const at = s.x.map((_, i) => i).filter((i) => s.x[i] != null).sort((a, b) => s.x[a] - s.x[b] || a - b);
      // uPlot.join wants distinct abscissae: nudge ties by one part in 1e9.
      let last = -Infinity;
      const xs = at.map((i) => (last = s.x[i] > last ? s.x[i] : last + Math.max(Math.abs(last), 1e-6) * 1e-9));
      return [xs, at.map((i) => s.y[i])];
    });
    return uPlot.join(tables);
  }
  function lines(box, chart, note) {
    const mark = (s) => s.mark || chart.mark, dotted = (s) => ['point', 'interval'].includes(mark(s));
    // Of the ordinates in sight, all but spikes; once zoomed in, all.
    const upright = (u, min, max) => {
      if (min == null) return [null, null];
      const [first, last] = [u.data[0][0], u.data[0][u.data[0].length - 1]], zoomed = u.scales.x.max - u.scales.x.min < 0.999 * (last - first);
      const all = traces(chart).flatMap((s) => s.y), limits = zoomed ? null : sober(all);
      const beyond = limits ? all.filter((y) => y != null && (y < limits[0] || y > limits[1])).length : 0;
      note.textContent = beyond ? ` – ${beyond} value${beyond > 1 ? 's' : ''} beyond the axis; zoom in to see ${beyond > 1 ? 'them' : 'it'}` : '';
      return uPlot.rangeNum(...(limits ? [Math.max(min, limits[0]), Math.min(max, limits[1])] : [min, max]), 0.1, true);
    };
    const size = () => [Math.max(280, box.clientWidth || 600), box.closest('figure.wide') ? 300 : 270];
    // A chart of places: a metre is as long to the east as to the north; a zoom goes its own way.
    const equal = (axis) => {
      if (!chart.equal) return undefined;
      const of = (k) => { const v = chart.series.flatMap((s) => s[k]).filter((p) => p != null); return v.length ? [Math.min(...v), Math.max(...v)] : [0, 1]; };
      const ends = { x: of('x'), y: of('y') }, [width, height] = size(), px = { x: width - 80, y: height - 80 };
      const metre = Math.max(...['x', 'y'].map((k) => (ends[k][1] - ends[k][0]) / px[k]), 10 / px.y) * 1.1; // of a pixel; at least 10 m in all
      const middle = (ends[axis][0] + ends[axis][1]) / 2, half = (metre * px[axis]) / 2;
      return (u, min, max) => (axis === 'x' && max - min < 0.999 * (ends.x[1] - ends.x[0]) ? [min, max] : [middle - half, middle + half]);
    };
    // A way over ground turns back: its points are joined in their own order, not in that of the abscissa.
    const inOrder = (s) => (u) => {
      const stroke = new Path2D();
      s.x.forEach((x, i) => { if (x != null && s.y[i] != null) stroke[i && s.x[i - 1] != null ? 'lineTo' : 'moveTo'](u.valToPos(x, 'x', true), u.valToPos(s.y[i], 'y', true)); });
      return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 0 };
    };
    const spanned = () => { let lo = Infinity, hi = -Infinity; chart.series.forEach((s) => s.x.forEach((v) => { if (v != null) { lo = Math.min(lo, v); hi = Math.max(hi, v); } })); return hi - lo; };
    const options = () => { const series = traces(chart), hue = hues(series), [width, height] = size(), dashed = (i) => i && mark(series[i - 1]) === 'dashed'; return ({
      width, height,
      cursor: { sync: chart.group ? { key: chart.group, scales: ['x', null] } : undefined, drag: { x: true, y: false } },
      legend: { markers: { width: (u, i) => (dashed(i) ? 2 : 0), stroke: (u, i) => (i ? colour(hue[i - 1]) : 'transparent'), dash: 'dashed', fill: (u, i) => (i && !dashed(i) ? colour(hue[i - 1]) + (mark(series[i - 1]) === 'band' ? '55' : '') : 'transparent') } },
      hooks: { draw: [(u) => series.forEach((s, i) => mark(s) === 'interval' && whiskers(u, s, colour(hue[i]))), (u) => { let named = -Infinity; (chart.marks || []).forEach((m) => { named = mark_at(u, m, named); }); }], setCursor: [pointed], setScale: [() => { ring.hidden = true; }] },
      scales: { x: { time: false, range: equal('x') }, y: { dir: chart.y.inverted ? -1 : 1, range: equal('y') || upright } },
      bands: series.flatMap((s, i) => (s.lower ? [{ series: [i, i + 1], fill: colour(hue[i]) + '33' }] : [])),
      axes: [readable(chart.x, spanned()), [chart.y, 1]].map(([a, per], i) => ({
        label: axisText(a), incrs: per === 1 ? undefined : [0.25, 0.5, 1, 2, 3, 6, 12, 24, 48, 96, 240, 480].map((h) => h * per), stroke: css('--ink'), grid: { stroke: css('--line'), width: 1 }, ticks: { stroke: css('--line') },
        size: i ? 62 : 44, labelSize: 22, font: '12px system-ui, sans-serif', labelFont: '12px system-ui, sans-serif',
        values: (u, ticks) => ticks.map((v) => (v == null ? '' : String(Number((v / per).toPrecision(6))))),
      })),
      series: [
        { label: axisText(readable(chart.x, spanned())[0]), value: (u, v) => fmt(v == null ? v : v / readable(chart.x, spanned())[1]) },
        ...series.map((s, i) => ({
          label: s.name + (s.lower ? ' from' : mark(s) === 'band' ? ' to' : ''), stroke: colour(hue[i]), value: (u, v) => fmt(v), spanGaps: false,
          width: dotted(s) ? 0 : mark(s) === 'band' ? 0.5 : 1.6, dash: mark(s) === 'dashed' || hue[i] === 6 ? [6, 4] : undefined,
          paths: dotted(s) ? () => null : chart.equal ? inOrder(s) : mark(s) === 'bar' ? uPlot.paths.bars({ size: [1, Infinity] }) : undefined, fill: mark(s) === 'bar' ? colour(hue[i]) + '55' : undefined,
          points: dotted(s) ? { show: true, size: 4, fill: colour(hue[i]), width: 0 } : { show: false },
        })),
      ],
    }); };
    const whiskers = (u, s, stroke) => {
      const c = u.ctx;
      c.save();
      c.strokeStyle = stroke;
      c.lineWidth = 1.5 * devicePixelRatio;
      s.x.forEach((x, i) => {
        if (x == null || s.low[i] == null || s.high[i] == null) return;
        const at = u.valToPos(x, 'x', true);
        c.beginPath(); c.moveTo(at, u.valToPos(s.low[i], 'y', true)); c.lineTo(at, u.valToPos(s.high[i], 'y', true)); c.stroke();
      });
      c.restore();
    };
    // A moment that has a name: a fault, a change of phase. A phase is named only where the name before leaves room.
    const mark_at = (u, m, named) => {
      const x = u.valToPos(m.x, 'x', true);
      if (!(x >= u.bbox.left && x <= u.bbox.left + u.bbox.width)) return named;
      const c = u.ctx;
      c.save();
      c.strokeStyle = c.fillStyle = css('--soft');
      c.setLineDash([4, 4]);
      c.beginPath(); c.moveTo(x, u.bbox.top); c.lineTo(x, u.bbox.top + u.bbox.height); c.stroke();
      c.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      const room = m.fault || x - named > 14 * devicePixelRatio;
      c.translate(x + 3, u.bbox.top + 4); c.rotate(Math.PI / 2);
      if (room) c.fillText(m.label, 0, 0);
      c.restore();
      return room ? x : named;
    };
    // What the cursor points at: over time its own x, else the nearest point, if it is near.
    const ring = el('i', { class: 'ring', hidden: true, 'aria-hidden': 'true' });
    const pointed = (u) => {
      if (pointing || u.cursor.left == null || u.cursor.left < 0) return;
      if (chart.group) return announce(handle, u.cursor.idx == null ? null : u.data[0][u.cursor.idx]);
      if (!chart.at) return;
      const s = chart.series[0], { left, top } = u.cursor;
      let best = -1, least = 40 ** 2; // px
      chart.at.forEach((t, i) => {
        if (t == null || s.x[i] == null || s.y[i] == null) return;
        const d = (u.valToPos(s.x[i], 'x') - left) ** 2 + (u.valToPos(s.y[i], 'y') - top) ** 2;
        if (d < least) [best, least] = [i, d];
      });
      if (best >= 0) { ringAt(best); announce(handle, chart.at[best]); }
    };
    const ringAt = (i) => {
      const s = chart.series[0];
      plot.over.append(ring);
      ring.style.left = `${plot.valToPos(s.x[i], 'x')}px`;
      ring.style.top = `${plot.valToPos(s.y[i], 'y')}px`;
      ring.hidden = false;
    };
    const show = (t) => {
      if (!chart.at) { plot.setCursor({ left: plot.valToPos(t, 'x'), top: plot.over.clientHeight / 2 }, true, true); return; }
      const s = chart.series[0], i = nextTo(chart.at, t, (k) => s.x[k] != null && s.y[k] != null);
      if (i >= 0) ringAt(i);
    };
    let plot = null;
    const draw = () => {
      // A zoom of the person survives new data; the full range does not.
      const span = plot && full();
      const range = plot && plot.scales.x.max - plot.scales.x.min < 0.999 * (span[1] - span[0]) ? { min: plot.scales.x.min, max: plot.scales.x.max } : null;
      if (plot) plot.destroy();
      const data = linesData(chart);
      plot = new uPlot(options(), data, box);
      if (range) plot.setScale('x', range);
    };
    const full = () => [plot.data[0][0], plot.data[0][plot.data[0].length - 1]];
    const zoom = (min, max) => {
      const [lo, hi] = full();
      if (hi > lo) plot.setScale('x', { min: Math.max(lo, min), max: Math.min(hi, max) });
    };
    const handle = { chart, draw, set: (series) => { chart.series = series; draw(); }, get plot() { return plot; }, zoom, show };
    draw();
    box.addEventListener('keydown', (e) => {
      const { min, max } = plot.scales.x, w = max - min, mid = (min + max) / 2;
      const acts = {
        '+': () => zoom(mid - w / 4, mid + w / 4), '=': () => zoom(mid - w / 4, mid + w / 4),
        '-': () => zoom(mid - w, mid + w), 0: () => zoom(...full()),
        ArrowLeft: () => (e.shiftKey ? zoom(min - w / 5, max - w / 5) : cursor(-1)),
        ArrowRight: () => (e.shiftKey ? zoom(min + w / 5, max + w / 5) : cursor(1)),
      };
      if (acts[e.key]) { acts[e.key](); e.preventDefault(); }
    });
    const cursor = (step) => {
      const step_px = step * Math.max(2, plot.over.clientWidth / 200);
      const at = (plot.cursor.left ?? -1) < 0 ? plot.over.clientWidth / 2 : plot.cursor.left + step_px;
      plot.setCursor({ left: Math.min(Math.max(0, at), plot.over.clientWidth), top: plot.over.clientHeight / 2 });
    };
    return handle;
  }

  // ---- bars and maps ----------------------------------------------------
  const ticks = (lo, hi, n = 5) => {
    const raw = (hi - lo) / n || 1, mag = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * mag).find((s) => s >= raw);
    const out = [];
    for (let v = Math.ceil(lo / step) * step; v <= hi + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
    return out;
  };
  // Rows over categories: bars, intervals and bands, with a label at the end of each, or under it where there is no room beside.
  function bars(box, chart) {
    const mark = (s) => s.mark || chart.mark;
    const wrapped = (text, letters) => text.split(' ').reduce((lines, word) => {
      const last = lines[lines.length - 1];
      if (last && last.length + 1 + word.length <= letters) lines[lines.length - 1] = `${last} ${word}`; else lines.push(word);
      return lines;
    }, []);
    const draw = () => {
      const names = chart.categories || [], shown = chart.series.filter((s) => mark(s) !== 'band');
      const last = shown[shown.length - 1] || { y: [] };
      const labels = chart.labels || names.map((_, i) => (last.y[i] == null ? '' : fmt(last.y[i])));
      const longest = (list) => Math.max(0, ...list.map((t) => t.length));
      const width = Math.max(300, box.clientWidth || 600), left = Math.min(6.7 * longest(names) + 14, width * 0.42);
      const under = 6.6 * longest(labels) > width * 0.45, right = under ? 14 : 6.9 * longest(labels) + 16;
      const lines = names.map((name) => wrapped(name, Math.floor((left - 8) / 6.4)));
      const tall = lines.map((l) => 12 + 14 * l.length + (under ? 16 : 0)), top = 6;
      const tops = tall.map((_, i) => top + tall.slice(0, i).reduce((sum, h) => sum + h, 0));
      const bottom = top + tall.reduce((sum, h) => sum + h, 0), height = bottom + 40;
      const all = chart.series.flatMap((s) => [...(mark(s) === 'band' ? [] : s.y), ...(s.low || []), ...(s.high || [])]).filter((v) => v != null);
      if (!all.length || shown.some((s) => mark(s) === 'bar')) all.push(0);
      let lo = Math.min(...all), hi = Math.max(...all);
      if (lo === hi) hi = lo + 1;
      const pad = (hi - lo) * 0.05;
      if (lo < 0) lo -= pad;
      hi += pad;
      const x = (v) => left + ((v - lo) / (hi - lo)) * (width - left - right);
      const root = svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': chart.title });
      for (const t of ticks(lo, hi, width < 500 ? 3 : 6)) {
        root.append(svg('line', { x1: x(t), x2: x(t), y1: top, y2: bottom, class: 'grid' }));
        root.append(svg('text', { x: x(t), y: bottom + 16, 'text-anchor': 'middle' }, fmt(t)));
      }
      const title = wrapped(axisText(chart.y), Math.floor(width / 6.3));
      title.forEach((line, k) => root.append(svg('text', { x: width / 2, y: height - 5 + 14 * k, 'text-anchor': 'middle' }, line)));
      root.setAttribute('viewBox', `0 0 ${width} ${height + 14 * (title.length - 1)}`);
      names.forEach((_, i) => {
        const middle = tops[i] + (tall[i] - (under ? 16 : 0)) / 2;
        for (const s of chart.series) {
          const v = s.y[i], ends = s.low && s.low[i] != null && s.high[i] != null ? [s.low[i], s.high[i]] : null;
          const block = (from, to, h, fill, extra) => root.append(svg('rect', { x: Math.min(x(from), x(to)), y: middle - h / 2, width: Math.max(1, Math.abs(x(to) - x(from))), height: h, fill, ...extra }));
          if (mark(s) === 'band') { if (ends) block(...ends, tall[i], colour(0), { opacity: 0.15 }); continue; }
          if (v == null) continue;
          if (mark(s) === 'bar') block(0, v, 15, colour(0), { rx: 2 });
          if (ends) root.append(svg('path', { d: `M${x(ends[0])} ${middle}H${x(ends[1])}M${x(ends[0])} ${middle - 4.5}v9M${x(ends[1])} ${middle - 4.5}v9`, stroke: css('--ink'), 'stroke-width': 1.6, fill: 'none' }));
          if (mark(s) !== 'bar') root.append(svg('circle', { cx: x(v), cy: middle, r: 5, fill: colour(1) }));
        }
        lines[i].forEach((line, k) => root.append(svg('text', { x: left - 8, y: middle + 4 + 14 * (k - (lines[i].length - 1) / 2), 'text-anchor': 'end' }, line)));
        // Beside a bar its own end; beside intervals a column.
        const ends = shown.map((s) => Math.max(x(s.y[i] ?? lo), s.high && s.high[i] != null ? x(s.high[i]) : 0, x(Math.max(lo, 0))));
        if (under) root.append(svg('text', { x: left - 8 > 120 ? left : 14, y: tops[i] + tall[i] - 5, class: 'under' }, labels[i]));
        else root.append(svg('text', { x: chart.labels ? width - right + 10 : Math.max(...ends) + 6, y: middle + 4 }, labels[i]));
      });
      box.replaceChildren(root);
    };
    draw();
    return { chart, draw, set: (series, categories) => { chart.series = series; if (categories) chart.categories = categories; draw(); } };
  }
  function map(box, chart) {
    // blue – neutral – orange: told apart by the common colour blindnesses
    const shade = (t) => {
      const dark = css('color-scheme') === 'dark', mid = dark ? [40, 50, 58] : [245, 245, 245];
      const end = t < 0 ? [0, 114, 178] : [213, 94, 0], a = Math.min(1, Math.abs(t));
      return `rgb(${mid.map((m, i) => Math.round(m + (end[i] - m) * a)).join(',')})`;
    };
    const draw = () => {
      const s = chart.series[0];
      if (!s.z.some((v) => v != null)) { box.replaceChildren(); return; }
      const width = Math.max(300, box.clientWidth || 600), height = 300, left = 60, bottom = 46, right = 70;
      const nx = s.x.length, ny = s.y.length, w = (width - left - right) / nx, h = (height - bottom - 8) / ny;
      const most = chart.most || Math.max(1e-12, ...s.z.filter((v) => v != null).map(Math.abs));
      const down = chart.y.inverted, rowTop = (j) => 8 + (down ? j : ny - 1 - j) * h;
      const root = svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': chart.title });
      for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
        const v = s.z[j * nx + i];
        if (v == null) continue;
        const r = svg('rect', { x: left + i * w, y: rowTop(j), width: w + 0.3, height: h + 0.3, fill: shade(v / most) });
        r.append(svg('title', {}, `${chart.x.label} ${fmt(s.x[i])} ${chart.x.unit}, ${chart.y.label} ${fmt(s.y[j])} ${chart.y.unit}: ${fmt(v)} ${s.name}`));
        root.append(r);
      }
      // Round numbers at their places, not the middles of bins.
      const places = (v, n) => { const d = n > 1 ? (v[n - 1] - v[0]) / (n - 1) : 1, lo = v[0] - d / 2, hi = v[n - 1] + d / 2; return { lo, hi, at: (t) => (t - lo) / (hi - lo) }; };
      const px = places(s.x, nx), py = places(s.y, ny);
      const [axis, per] = readable(chart.x, px.hi - px.lo);
      for (const t of ticks(px.lo / per, px.hi / per, width / 90)) root.append(svg('text', { x: left + px.at(t * per) * nx * w, y: height - bottom + 18, 'text-anchor': 'middle' }, fmt(t)));
      for (const t of ticks(py.lo, py.hi, 6)) root.append(svg('text', { x: left - 6, y: 12 + (down ? py.at(t) : 1 - py.at(t)) * ny * h, 'text-anchor': 'end' }, fmt(t)));
      root.append(svg('text', { x: (left + width - right) / 2, y: height - 6, 'text-anchor': 'middle' }, axisText(axis)));
      const yl = svg('text', { transform: `translate(13 ${(height - bottom) / 2}) rotate(-90)`, 'text-anchor': 'middle' }, axisText(chart.y));
      root.append(yl);
      for (let k = 0; k <= 20; k++) root.append(svg('rect', { x: width - right + 14, y: 8 + ((20 - k) * (height - bottom - 8)) / 21, width: 12, height: (height - bottom - 8) / 21 + 0.4, fill: shade(k / 10 - 1) }));
      root.append(svg('text', { x: width - right + 30, y: 18 }, fmt(most)), svg('text', { x: width - right + 30, y: height - bottom }, fmt(-most)), svg('text', { x: width - right + 30, y: (height - bottom) / 2 + 8 }, s.name.slice(0, 6)));
      root.append(ring);
      ring.setAttribute('visibility', 'hidden');
      box.replaceChildren(root);
      cell = (x, y) => {
        const i = Math.floor(px.at(x) * nx), j = Math.floor(py.at(y) * ny), inside = i >= 0 && i < nx && j >= 0 && j < ny;
        for (const [k, v] of Object.entries(inside ? { x: left + i * w, y: rowTop(j), width: w, height: h, visibility: 'visible' } : { visibility: 'hidden' })) ring.setAttribute(k, v);
      };
    };
    // The cell that holds a moment: `at` has the moments, `where` their places on the axes.
    const ring = svg('rect', { class: 'ring', fill: 'none', visibility: 'hidden' });
    let cell = () => {};
    const show = (t) => {
      const i = nextTo(chart.at || [], t, (k) => chart.where[0][k] != null && chart.where[1][k] != null);
      if (i >= 0) cell(chart.where[0][i], chart.where[1][i]);
    };
    draw();
    return { chart, draw, show, set: (series) => { chart.series = series; draw(); } };
  }

  // ---- page parts -------------------------------------------------------
  function dataTable(chart) {
    const d = el('details', {}, el('summary', {}, 'Numbers'));
    d.addEventListener('toggle', () => {
      if (!d.open || d.querySelector('table')) return;
      const rows = [];
      for (const s of chart.series.filter((t) => !chart.categories || t.mark !== 'band')) s.y.slice(0, chart.mark === 'map' ? 0 : 400).forEach((y, i) => rows.push([s.name, (chart.categories || [])[i] ?? fmt(s.x[i]), (chart.labels || [])[i] ?? fmt(y) + (s.low ? ` (${fmt(s.low[i])} to ${fmt(s.high[i])})` : '')]));
      d.append(table({ caption: '', head: ['series', axisText(chart.x) || 'name', axisText(chart.y)], rows }));
    });
    return d;
  }
  function figure(chart, wide) {
    const box = el('div', { class: 'plot', tabindex: '0', role: 'group', 'aria-label': `${chart.title}: ${axisText(chart.y)} against ${axisText(chart.x)}. Keys: plus and minus zoom, arrows move the cursor, shift and arrows pan, zero shows all.` });
    const note = el('span', { class: 'lead' });
    const fig = el('figure', { class: wide ? 'wide' : '' }, el('figcaption', {}, chart.title, note), box);
    if (chart.mark !== 'map') fig.append(dataTable(chart));
    fig.attach = () => {
      const handle = chart.categories ? bars(box, chart) : chart.mark === 'map' ? map(box, chart) : lines(box, chart, note);
      fig.handle = handle;
      box.handle = handle;
      charts.add(handle);
      return handle;
    };
    return fig;
  }
  function table(t) {
    const body = el('table', {}, t.caption ? el('caption', {}, t.caption) : null,
      el('thead', {}, el('tr', {}, ...t.head.map((h) => el('th', { scope: 'col' }, h)))),
      el('tbody', {}, ...t.rows.map((r) => el('tr', {}, ...r.map((c) => el('td', {}, c))))));
    return el('div', { class: 'tables', tabindex: '0', role: 'region', 'aria-label': t.caption || 'table' }, body);
  }
  // A table with shaded cells; the shade is orange on the ground, which the common colour blindnesses tell from it.
  function heat(t) {
    const node = table(t);
    node.querySelectorAll('tbody tr').forEach((tr, i) => [...tr.children].forEach((td, j) => {
      const v = (t.shade[i] || [])[j];
      if (v != null) td.style.background = `color-mix(in srgb, var(${v < 0 ? '--bad' : '--s1'}) ${v < 0 ? 60 : Math.round(6 + 44 * v)}%, transparent)`;
    }));
    node.classList.add('heat');
    return node;
  }
  function section(s, id) {
    const node = el('section', { id, 'aria-labelledby': id + '-h' }, el('h2', { id: id + '-h' }, s.title), s.lead ? el('p', { class: 'lead' }, s.lead) : null);
    let grid = null;
    const figures = [];
    for (const item of s.items) {
      if (item.type === 'chart') {
        if (!grid) node.append((grid = el('div', { class: 'charts' })));
        const f = figure(item, !!item.group || !!item.labels || (item.categories || []).length > 12);
        figures.push(f);
        grid.append(f);
      } else {
        grid = null;
        node.append(item.type === 'table' ? table(item) : item.type === 'heat' ? heat(item) : el('p', {}, item.text));
      }
    }
    node.attach = () => figures.forEach((f) => f.attach());
    return node;
  }
  // What stands between backticks is a command.
  const prose = (text) => text.split('`').map((part, i) => (i % 2 ? el('code', {}, part) : part));
  function answer(lines) {
    return el('dl', { class: 'answer' }, ...lines.flatMap(([k, v]) => [el('dt', {}, k), el('dd', {}, ...prose(v))]));
  }
  function themeButton() {
    const set = (t) => { document.documentElement.dataset.theme = t; charts.forEach((c) => c.draw()); };
    const dark = () => css('color-scheme') === 'dark';
    return el('button', { type: 'button', onclick: () => set(dark() ? 'light' : 'dark') }, 'Light / dark');
  }
  function footer(p) {
    const parts = [p.command && `command: ${p.command}`, p.version && `glider ${p.version}`, p.data_hash && `data: ${p.data_hash}`, p.seed != null && `seed: ${p.seed}`];
    return el('footer', {}, parts.filter(Boolean).join(' · '));
  }
  // Paper is white: drawn anew in the light colours, whatever the screen has.
  let screenTheme;
  addEventListener('beforeprint', () => { screenTheme = document.documentElement.dataset.theme; document.documentElement.dataset.theme = 'light'; charts.forEach((c) => c.draw()); });
  addEventListener('afterprint', () => { if (screenTheme) document.documentElement.dataset.theme = screenTheme; else delete document.documentElement.dataset.theme; charts.forEach((c) => c.draw()); });
  let timer = 0;
  addEventListener('resize', () => { clearTimeout(timer); timer = setTimeout(() => charts.forEach((c) => c.draw()), 120); });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => charts.forEach((c) => c.draw()));

  function page(root, data) {
    const sections = data.sections.map((s, i) => section(s, 's' + i));
    root.replaceChildren(
      el('div', { class: 'bar' }, el('h1', {}, data.title), themeButton()),
      data.answer.length ? answer(data.answer) : '',
      sections.length > 1 ? el('nav', { 'aria-label': 'Sections' }, el('ul', {}, ...data.sections.map((s, i) => el('li', {}, el('a', { href: '#s' + i }, s.title))))) : '',
      ...sections, footer(data.provenance || {}));
    sections.forEach((s) => s.attach());
  }
  return { page, prose, el, figure, section, answer, table, fmt, charts, themeButton, footer };
})();
