// Learning curves: raw or filtered, logarithmic or linear, values under the pointer.
(() => {
  'use strict';
  const { steps, window: width, charts } = JSON.parse(document.getElementById('data-curves').textContent);
  const state = { curves: 'smooth', scale: 'log' };
  const SVG = 'http://www.w3.org/2000/svg';

  const place = (axis, value) => {
    const map = axis.log ? (x) => Math.log(Math.max(x, 1e-300)) : (x) => x;
    return (map(value) - map(axis.lo)) / (map(axis.hi) - map(axis.lo));
  };
  const percent = (share) => `${(100 * Math.min(1.02, Math.max(-0.02, share))).toFixed(2)}%`;
  const across = (bin) => (bin + 1) / steps.length;
  const filter = (values) => values.map((value, bin) => {
    if (value === null) return null;
    const known = values.slice(Math.max(0, bin + 1 - width), bin + 1).filter((other) => other !== null);
    return known.reduce((sum, other) => sum + other, 0) / known.length;
  });
  const line = (points) => {
    let path = '', down = false;
    for (const point of points) {
      if (point) path += `${down ? 'L' : 'M'}${Math.round(1000 * point[0])} ${Math.round(1000 * (1 - Math.min(3, Math.max(-2, point[1]))))}`;
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
  const axisOf = (chart) => chart.axes[state.scale === 'log' && chart.axes.smooth_log ? `${state.curves}_log` : state.curves];
  const show = (chart, value) => String(Number((value * chart.factor).toPrecision(3))).replace('-', '\u2212');

  const draw = (chart, figure) => {
    const axis = axisOf(chart);
    const smooth = state.curves === 'smooth';
    const at = (value, bin) => (value === null ? null : [across(bin), place(axis, value)]);
    const groups = figure.querySelectorAll('.area > g');
    chart.methods.forEach((method, k) => {
      const band = method[state.curves].map((point, bin) => point && [bin, ...point]).filter(Boolean);
      const edge = (end) => band.map((point) => at(point[end], point[0]));
      const seeds = groups[k].querySelectorAll('.seed');
      method.seeds.forEach((seed, s) => seeds[s].setAttribute('d', line((smooth ? filter(seed.values) : seed.values).map(at))));
      const region = (lo, hi) => {
        const path = line([...edge(hi), ...edge(lo).reverse()]);
        return path && `${path}z`;
      };
      groups[k].querySelector('.band').setAttribute('d', region(2, 3));
      groups[k].querySelector('.outer').setAttribute('d', region(4, 5));
      groups[k].querySelector('.mid').setAttribute('d', line(method[state.curves].map((point, bin) => point && at(point[0], bin))));
    });
    figure.querySelector('.y').replaceChildren(...axis.ticks.flatMap((tick) => {
      const top = percent(1 - place(axis, tick.value));
      return [element('line', { x1: 0, x2: '100%', y1: top, y2: top }), element('text', { x: 0, dx: -8, y: top, dy: '.32em' }, tick.label)];
    }));
    if (chart.level !== null) {
      const top = percent(1 - place(axis, chart.level));
      const level = figure.querySelector('.over .level');
      level.setAttribute('y1', top);
      level.setAttribute('y2', top);
      level.nextElementSibling.setAttribute('y', top);
    }
  };

  const inspect = (chart, figure) => {
    const plot = figure.querySelector('.plot');
    const area = figure.querySelector('.area');
    const cross = element('line', { class: 'cross', y1: 0, y2: '100%', visibility: 'hidden' });
    figure.querySelector('.over').append(cross);
    const tip = document.createElement('div');
    tip.className = 'tip';
    tip.hidden = true;
    plot.append(tip);
    plot.addEventListener('pointermove', (event) => {
      const box = area.getBoundingClientRect();
      const share = (event.clientX - box.left) / box.width;
      const bin = Math.min(steps.length - 1, Math.max(0, Math.round(share * steps.length) - 1));
      cross.setAttribute('x1', percent(across(bin)));
      cross.setAttribute('x2', percent(across(bin)));
      cross.setAttribute('visibility', 'visible');
      const head = document.createElement('div');
      head.textContent = `${steps[bin].toLocaleString('en')} steps`;
      tip.replaceChildren(head, ...chart.methods.filter((method) => method[state.curves][bin]).map((method) => {
        const [mid, lo, hi] = method[state.curves][bin];
        const row = document.createElement('div');
        const name = document.createElement('b');
        row.className = method.style;
        name.textContent = method.label;
        row.append(name, ` ${show(chart, mid)} ${chart.unit}`, lo < hi ? ` [${show(chart, lo)}, ${show(chart, hi)}]` : '');
        return row;
      }));
      tip.hidden = false;
      const x = box.left - plot.getBoundingClientRect().left + across(bin) * box.width;
      tip.style.left = x < plot.clientWidth / 2 ? `${x + 12}px` : `${x - 12 - tip.offsetWidth}px`;
    });
    plot.addEventListener('pointerleave', () => { tip.hidden = true; cross.setAttribute('visibility', 'hidden'); });
  };

  const figures = new Map(charts.map((chart) => [chart, document.querySelector(`[data-curve="${chart.id}"]`)]));
  for (const [chart, figure] of figures) inspect(chart, figure);
  for (const key of ['curves', 'scale']) {
    const buttons = document.querySelectorAll(`button[data-${key}]`);
    for (const button of buttons) {
      button.addEventListener('click', () => {
        state[key] = button.dataset[key];
        for (const other of buttons) other.setAttribute('aria-pressed', String(other === button));
        for (const [chart, figure] of figures) draw(chart, figure);
      });
    }
  }
})();
