// Charts that zoom and tell their values, in the place of the page's still drawings, and drawn into them again
// for print and for files.
mpgx.charts = new Map();

mpgx.unpack = (text) => {
  const raw = atob(text), word = new DataView(new ArrayBuffer(4));
  return Array.from({ length: raw.length / 3 }, (_, k) => {
    for (let b = 0; b < 3; b++) word.setUint8(b + 1, raw.charCodeAt(3 * k + b));
    const value = word.getFloat32(0, true);
    return Number.isNaN(value) ? null : Number(value.toPrecision(5));
  });
};
mpgx.count = (value) => {
  for (const [size, letter] of [[1e9, 'G'], [1e6, 'M'], [1e3, 'k']]) {
    if (Math.abs(value) >= size) return `${Number((value / size).toPrecision(4))}${letter}`;
  }
  return String(Number(value.toPrecision(4)));
};
mpgx.number = (value) => String(Number(value.toPrecision(3))).replace('-', '\u2212');
mpgx.look = (style) => {
  const probe = document.createElement('i');
  probe.className = style;
  document.body.append(probe);
  const read = getComputedStyle(probe), name = (key) => read.getPropertyValue(key).trim();
  const dash = name('--dash').split(' ').map(Number).filter((length) => length > 0);
  const look = { colour: name('--c'), dash, soft: name('--soft'), faint: name('--faint'), ref: name('--ref'), paper: name('--paper'), font: name('--sans') };
  probe.remove();
  return look;
};
mpgx.faded = (colour, share) => `color-mix(in srgb, ${colour} ${100 * share}%, transparent)`;

// A view: x (or an x of each line), lines of { label, style, mid, lo, hi, low, high, seeds }, unit, factor, log,
// level, zero (whether 0 is to be seen), steps (whether values hold until the next), xName.
mpgx.chart = (figure, first, group = []) => {
  const plot = figure.querySelector('.plot'), still = plot.querySelector('svg.chart');
  const box = document.createElement('div'), tip = document.createElement('div'), reset = document.createElement('button');
  const chart = { figure, view: first, hidden: new Set(), zoom: null };
  const ticks = { x: [], y: [] };
  let u = null, columns = [];

  box.className = 'live-chart';
  box.tabIndex = 0;
  box.setAttribute('role', 'group');
  box.setAttribute('aria-label', `${still.querySelector('title').textContent}: arrows tell values, plus and minus zoom, 0 shows all`);
  tip.className = 'tip';
  tip.hidden = true;
  reset.className = 'small reset';
  reset.textContent = 'all';
  reset.setAttribute('aria-label', 'Show all');
  reset.hidden = true;
  plot.append(box, tip, reset);

  const shown = (value) => mpgx.number(value * chart.view.factor);
  const lines = () => chart.view.lines.filter((line) => !chart.hidden.has(line.label));

  // ---- What uPlot draws: for each line the ends of its bands, its seeds, its middle.

  const pieces = (line) => [
    ...['low', 'high', 'lo', 'hi'].map((key) => ({ key, line, values: line[key] })),
    ...(line.seeds || []).map((seed) => ({ key: 'seed', line, seed, values: seed.values })),
    { key: 'mid', line, values: line.mid },
  ].filter(({ values }) => values);

  const range = (low, high) => {
    const { level, zero, log } = chart.view;
    let [lo, hi] = [low, high];
    if (level !== null && level !== undefined && !chart.zoom) [lo, hi] = [Math.min(lo ?? level, level), Math.max(hi ?? level, level)];
    if (lo === null || lo === undefined) return log ? [0.1, 1] : [0, 1];
    if (log) return [lo / 1.15, hi * 1.15];
    if (zero && !chart.zoom) [lo, hi] = [Math.min(0, lo), Math.max(0, hi)];
    const room = 0.04 * (hi - lo) || Math.abs(hi) / 2 || 1;
    return [lo === 0 ? 0 : lo - room, hi === 0 ? 0 : hi + room];
  };
  const logTicks = (lo, hi) => {
    if (hi / lo < 3) {
      const { factor } = chart.view, raw = (hi - lo) * factor / 5, power = 10 ** Math.floor(Math.log10(raw));
      const step = [1, 2, 5, 10].map((m) => m * power).find((size) => size >= raw) / factor;
      const first = Math.ceil(lo / step);
      return Array.from({ length: Math.floor(hi / step) - first + 1 }, (_, k) => (first + k) * step);
    }
    const mantissas = hi / lo < 10 ? [1, 2, 3, 4, 5, 7] : hi / lo < 1000 ? [1, 2, 5] : [1];
    const out = [], { factor } = chart.view;
    for (let power = Math.floor(Math.log10(lo * factor)); power <= Math.ceil(Math.log10(hi * factor)); power++) {
      for (const mantissa of mantissas) out.push(Number(`${mantissa}e${power}`) / factor);
    }
    return out.filter((value) => value >= lo && value <= hi);
  };

  const build = () => {
    const { view } = chart;
    plot.classList.add('alive');
    const look = mpgx.look(''), keep = (axis, label) => (_, splits) => (ticks[axis] = splits.map((value) => ({ value, label: label(value) }))).map((tick) => tick.label);
    columns = lines().flatMap(pieces);
    const tables = lines().map((line) => [line.x || view.x, ...pieces(line).map(({ values }) => values)]);
    const positive = (value) => (value !== null && value <= 0 ? null : value);
    const data = (tables.length ? uPlot.join(tables) : [[]]).map((column, k) => (k && view.log ? column.map(positive) : column));
    const series = columns.map(({ key, line, seed }) => {
      const { colour, dash } = mpgx.look(line.style);
      const paths = view.steps ? { paths: uPlot.paths.stepped({ align: 1 }) } : {};
      const base = { ...paths, points: { show: false }, stroke: null, width: 0 };
      if (key === 'mid') return { ...base, stroke: colour, width: 2.25, dash };
      if (key === 'seed') return { ...base, auto: !line.lo, stroke: mpgx.faded(colour, seed.failed ? 0.7 : 0.3), width: 1, dash: seed.failed ? [1, 4] : [] };
      return base;
    });
    const bands = [];
    for (const line of lines()) {
      const { colour } = mpgx.look(line.style);
      for (const [lo, hi, share] of [['low', 'high', 0.07], ['lo', 'hi', 0.17]]) {
        const at = (key) => columns.findIndex((column) => column.line === line && column.key === key) + 1;
        if (at(lo)) bands.push({ series: [at(hi), at(lo)], fill: mpgx.faded(colour, share) });
      }
    }
    const axis = { stroke: look.soft, font: `12px ${look.font}`, ticks: { show: false }, border: { show: false } };
    u?.destroy();
    u = new uPlot({
      width: Math.max(120, plot.clientWidth), height: still.height.baseVal.value + 34, padding: [8, 12, 0, 0],
      legend: { show: false }, bands,
      cursor: { y: false, points: { size: 6 }, drag: { x: true, y: false, setScale: false }, sync: { key: group.key || `alone-${figure.dataset.chart}`, setSeries: false } },
      scales: {
        x: { time: false, range: () => chart.zoom || chart.extent() },
        y: { distr: view.log ? 3 : 1, range: (_, lo, hi) => range(lo, hi) },
      },
      axes: [
        { ...axis, size: 28, gap: 8, grid: { show: false }, space: 60, values: keep('x', view.xText || mpgx.count) },
        { ...axis, size: 48, gap: 6, grid: { stroke: look.faint, width: 1 }, space: 36, values: keep('y', shown), ...(view.log ? { splits: (_, __, lo, hi) => logTicks(lo, hi), filter: (_, splits) => splits } : {}) },
      ],
      series: [{}, ...series],
      hooks: {
        draw: [level],
        setCursor: [tell],
        setSelect: [({ select, posToVal }) => {
          if (select.width > 4) zoom([posToVal(select.left, 'x'), posToVal(select.left + select.width, 'x')]);
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
      },
    }, data, box);
    u.over.addEventListener('dblclick', () => zoom(null));
    u.over.addEventListener('mouseenter', () => { chart.here = true; });
    u.over.addEventListener('mouseleave', () => { chart.here = false; tip.hidden = true; });
    reset.hidden = !chart.zoom;
    const caption = figure.querySelector('.axis');
    if (caption) caption.textContent = view.xName;
  };

  chart.extent = () => {
    const ends = lines().flatMap((line) => { const x = line.x || chart.view.x; return [x[0], x[x.length - 1]]; });
    const hi = Math.max(...ends, -Infinity), lo = chart.view.fromZero ? 0 : Math.min(...ends, Infinity);
    return lo < hi ? [lo, hi] : [0, 1];
  };

  const level = () => {
    const { view } = chart;
    if (view.level === null || view.level === undefined) return;
    const c = u.ctx, y = u.valToPos(view.level, 'y', true), ratio = devicePixelRatio || 1, look = mpgx.look('');
    const { left, top, width, height } = u.bbox;
    if (!(y >= top && y <= top + height)) return;
    c.save();
    c.strokeStyle = look.ref;
    c.lineWidth = 1.25 * ratio;
    c.setLineDash([5 * ratio, 4 * ratio]);
    c.beginPath();
    c.moveTo(left, y);
    c.lineTo(left + width, y);
    c.stroke();
    c.font = `${12 * ratio}px ${look.font}`;
    c.textAlign = 'right';
    c.lineWidth = 4 * ratio;
    c.setLineDash([]);
    c.lineJoin = 'round';
    c.strokeStyle = look.paper;
    c.fillStyle = look.soft;
    const text = `${view.levelName} ${shown(view.level)} ${view.unit}`, base = y - 5 * ratio > top + 12 * ratio ? y - 5 * ratio : y + 14 * ratio;
    c.strokeText(text, left + width, base);
    c.fillText(text, left + width, base);
    c.restore();
  };

  // ---- Values under the pointer or at the place the arrows chose

  const tell = () => {
    const { left, idxs } = u.cursor;
    if (left < 0 || !(chart.here || box.contains(document.activeElement) || document.activeElement === box)) { tip.hidden = true; return; }
    const value = (key, line) => {
      const k = columns.findIndex((column) => column.line === line && column.key === key) + 1;
      return k ? u.data[k][idxs[columns.findIndex((column) => column.line === line && column.key === 'mid') + 1]] : undefined;
    };
    const head = document.createElement('div');
    head.textContent = `${chart.view.xLong ? chart.view.xLong(u.posToVal(left, 'x')) : mpgx.count(u.posToVal(left, 'x'))} ${chart.view.xName}`;
    tip.replaceChildren(head, ...lines().filter((line) => Number.isFinite(value('mid', line))).map((line) => {
      const row = document.createElement('div'), name = document.createElement('b');
      const [mid, lo, hi] = ['mid', 'lo', 'hi'].map((key) => value(key, line));
      row.className = line.style;
      name.textContent = line.label;
      row.append(name, ` ${shown(mid)} ${chart.view.unit}`, lo < hi ? ` [${shown(lo)}, ${shown(hi)}]` : '');
      return row;
    }));
    tip.hidden = false;
    const x = u.over.offsetLeft + left;
    tip.style.left = x < plot.clientWidth / 2 ? `${x + 12}px` : `${Math.max(0, x - 12 - tip.offsetWidth)}px`;
  };

  const zoom = (to) => {
    for (const other of group.length ? group : [chart]) other.show(to);
  };
  chart.show = (to) => {
    chart.zoom = to;
    reset.hidden = !to;
    const [min, max] = to || chart.extent();
    u?.setScale('x', { min, max });
  };
  chart.draw = (view) => { if (view) chart.view = view; build(); };
  chart.refresh = () => u && build();

  reset.addEventListener('click', () => { zoom(null); box.focus(); });
  box.addEventListener('blur', () => { tip.hidden = true; });
  box.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [lo, hi] = chart.zoom || chart.extent(), width = u.over.clientWidth;
    const at = u.cursor.left >= 0 ? u.cursor.left : width / 2;
    const move = (by) => u.setCursor({ left: Math.min(width - 1, Math.max(0, at + by * width / 100)), top: 10 });
    const around = (factor) => {
      const middle = u.posToVal(at, 'x'), [first, last] = chart.extent();
      const [from, to] = [Math.max(first, middle - (middle - lo) * factor), Math.min(last, middle + (hi - middle) * factor)];
      zoom(from <= first && to >= last ? null : [from, to]);
    };
    const act = {
      ArrowLeft: () => move(-1), ArrowRight: () => move(1), Home: () => move(-100), End: () => move(100),
      '+': () => around(0.5), '=': () => around(0.5), '-': () => around(2), 0: () => zoom(null), Escape: () => zoom(null),
    }[event.key];
    if (act) { event.preventDefault(); tip.setAttribute('aria-live', 'polite'); act(); }
  });

  chart.settle = () => mpgx.settle(chart, still, u.scales, ticks);

  chart.rows = () => [
    ['quantity', 'unit', 'method', 'series', chart.view.xLabel || chart.view.xName, 'value'],
    ...lines().flatMap((line) => pieces(line).flatMap(({ key, seed, values }) => {
      const name = { mid: chart.view.midName || 'mean', lo: 'interval, low', hi: 'interval, high', low: 'tolerance, low', high: 'tolerance, high' }[key] || `seed ${seed.seed}`;
      return values.map((value, k) => [chart.view.title, chart.view.unitName || '', line.label, name, (line.x || chart.view.x)[k] * (chart.view.xFactor || 1), value]).filter((row) => row[5] !== null);
    })),
  ];

  group.push(chart);
  mpgx.charts.set(figure, chart);
  // Drawn when it comes near, since a page may have many.
  const near = new IntersectionObserver(([entry]) => {
    if (entry.isIntersecting && !u) build();
  }, { rootMargin: '600px' });
  near.observe(plot);
  new ResizeObserver(() => { if (u && Math.abs(u.width - plot.clientWidth) > 1) u.setSize({ width: Math.max(120, plot.clientWidth), height: u.height }); }).observe(plot);
  chart.ready = () => { if (!u) build(); };
  return chart;
};

// The names of a legend as buttons that hide and show their lines.
mpgx.legend = (list, charts) => {
  for (const item of list.querySelectorAll('li')) {
    const button = document.createElement('button'), label = item.textContent.trim();
    button.type = 'button';
    button.setAttribute('aria-pressed', 'true');
    button.append(...item.childNodes);
    item.append(button);
    button.addEventListener('click', () => {
      const on = button.getAttribute('aria-pressed') !== 'true';
      button.setAttribute('aria-pressed', String(on));
      for (const chart of charts) {
        chart.hidden[on ? 'delete' : 'add'](label);
        chart.refresh();
      }
    });
  }
};

document.addEventListener('theme', () => { for (const chart of mpgx.charts.values()) chart.refresh(); });
addEventListener('beforeprint', () => { for (const chart of mpgx.charts.values()) { chart.ready(); chart.settle(); } });
