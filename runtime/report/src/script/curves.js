// Learning curves: filter, middle, axes.
(() => {
  'use strict';
  const { steps, filters, paces, charts } = JSON.parse(document.getElementById('data-curves').textContent);
  const state = { filter: '0', middle: 'iqm', x: 'steps', scale: 'log' };

  const smooth = (values, window) => {
    let sum = 0, count = 0;
    return values.map((value, bin) => {
      const add = (other, sign) => { if (other !== null && other !== undefined) { sum += sign * other; count += sign; } };
      add(value, 1);
      add(values[bin - window], -1);
      return value === null ? null : sum / count;
    });
  };
  const places = {
    steps: () => steps,
    // Steps before the first update are all at 0; lines need rising places.
    updates: ({ warm_up: first, updates }) => steps.map((step) => Math.max(step * 1e-9, (step - first) * updates)),
    seconds: ({ seconds }) => steps.map((step) => step * seconds),
  };
  const data = charts.map((chart) => ({
    ...chart,
    methods: chart.methods.map((method) => ({
      ...method,
      bands: method.bands.map((band) => band.map(mpgx.unpack)),
      seeds: method.seeds.map((seed) => ({ ...seed, values: mpgx.unpack(seed.values) })),
    })),
  }));

  // Mean over the seeds that finished, with a t interval.
  const mean = (seeds, t) => {
    const columns = { mid: [], lo: [], hi: [] };
    for (let bin = 0; bin < steps.length; bin++) {
      const known = seeds.filter((seed) => !seed.failed && seed.values[bin] !== null).map((seed) => seed.values[bin]);
      const middle = known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
      const square = known.reduce((sum, value) => sum + (value - middle) ** 2, 0);
      const half = t !== null && known.length > 1 ? t * Math.sqrt(square / (known.length - 1) / known.length) : 0;
      columns.mid.push(middle);
      columns.lo.push(middle === null ? null : middle - half);
      columns.hi.push(middle === null ? null : middle + half);
    }
    return columns;
  };
  const names = { steps: 'environment steps', updates: 'updates', seconds: 'seconds of training' };

  const view = (chart) => {
    const { window } = filters[Number(state.filter)];
    const lines = chart.methods.map((method, k) => {
      const seeds = method.seeds.map((seed) => ({ ...seed, values: smooth(seed.values, window) }));
      const [mid, lo, hi, low, high] = method.bands[Number(state.filter)];
      const middle = state.middle === 'iqm' ? { mid, lo, hi } : mean(seeds, paces[k].t);
      return { label: method.label, style: method.style, seeds, ...middle, low, high, x: places[state.x](paces[k]) };
    });
    return {
      title: chart.title, unit: chart.unit, unitName: chart.factor === 1 ? chart.unit : 'SI', factor: chart.factor, log: chart.log && state.scale === 'log', zero: true,
      level: chart.level, levelName: 'oracle', x: steps, fromZero: true, xName: names[state.x], lines, midName: state.middle === 'iqm' ? 'interquartile mean' : 'mean',
      xLong: (value) => Math.round(value).toLocaleString('en'),
    };
  };

  const group = [];
  group.key = 'curves';
  const live = data.map((chart) => [chart, mpgx.chart(document.querySelector(`[data-curve="${chart.id}"]`), view(chart), group)]);
  mpgx.legend(document.getElementById('curves-legend'), group);
  for (const key of Object.keys(state)) {
    const buttons = document.querySelectorAll(`#curves button[data-${key}]`);
    for (const button of buttons) {
      button.addEventListener('click', () => {
        state[key] = button.dataset[key];
        for (const other of buttons) other.setAttribute('aria-pressed', String(other === button));
        for (const [chart, it] of live) {
          if (key === 'x') it.zoom = null;
          it.ready();
          it.draw(view(chart));
        }
      });
    }
  }
})();
