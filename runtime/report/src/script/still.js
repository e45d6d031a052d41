// The still drawing of a chart as the live one is now: its zoom, its filter, what it hides.
mpgx.settle = (chart, still, { x, y }, ticks) => {
  const SVG = 'http://www.w3.org/2000/svg';
  const log = chart.view.log;
  const across = (value) => (value - x.min) / (x.max - x.min);
  const map = log ? Math.log : (value) => value;
  const up = (value) => (map(Math.max(value, log ? 1e-300 : -Infinity)) - map(y.min)) / (map(y.max) - map(y.min));
  const near = (share) => Math.round(1000 * Math.min(3, Math.max(-2, share)));
  const line = (points) => {
    let path = '', down = false;
    for (const point of points) {
      if (point) path += `${down ? 'L' : 'M'}${near(point[0])} ${near(1 - point[1])}`;
      down = point !== null;
    }
    return path;
  };
  const element = (name, attributes, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    return node;
  };
  const groups = still.querySelectorAll('.area > g');
  chart.view.lines.forEach((it, k) => {
    const xs = it.x || chart.view.x;
    const at = (values) => {
      const points = values.map((value, i) => (value === null || value === undefined || (log && value <= 0) ? null : [across(xs[i]), up(value)]));
      return chart.view.steps ? points.flatMap((point, i) => (point && points[i + 1] ? [point, [points[i + 1][0], point[1]]] : [point])) : points;
    };
    const region = (lo, hi) => {
      const both = [at(hi).filter(Boolean), at(lo).filter(Boolean)];
      return `${line([...both[0], ...both[1].reverse()])}z`;
    };
    const paths = chart.hidden.has(it.label) ? [] : [
      it.low && ['outer', region(it.low, it.high)],
      ...(it.seeds || []).map((seed) => [seed.failed ? 'seed failed' : 'seed', line(at(seed.values))]),
      it.lo && ['band', region(it.lo, it.hi)],
      ['mid', line(at(it.mid))],
    ].filter(Boolean);
    groups[k]?.replaceChildren(...paths.map(([name, d]) => element('path', { class: name, d: d === 'z' ? '' : d })));
  });
  const percent = (share) => `${(100 * share).toFixed(2)}%`;
  const inside = (tick, scale) => tick.value >= scale.min && tick.value <= scale.max;
  still.querySelector('.y').replaceChildren(...ticks.y.filter((tick) => inside(tick, y)).flatMap((tick) => {
    const top = percent(1 - up(tick.value));
    return [element('line', { x1: 0, x2: '100%', y1: top, y2: top }), element('text', { x: 0, dx: -8, y: top, dy: '.32em' }, tick.label)];
  }));
  still.querySelector('.x').replaceChildren(...ticks.x.filter((tick) => inside(tick, x)).map((tick) => element('text', { x: percent(across(tick.value)), y: '100%', dy: '1.5em' }, tick.label)));
  const mark = still.querySelector('.over .level');
  if (mark) {
    const share = 1 - up(chart.view.level), top = percent(Math.min(1.02, Math.max(-0.02, share)));
    for (const node of [mark, mark.nextElementSibling]) node.setAttribute('visibility', share >= 0 && share <= 1 ? 'visible' : 'hidden');
    for (const key of ['y1', 'y2']) mark.setAttribute(key, top);
    mark.nextElementSibling.setAttribute('y', top);
  }
};
