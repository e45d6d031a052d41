// Profiles, and curves of imports and comparisons: values, zoom.
(() => {
  'use strict';
  for (const id of ['comparison', 'results', 'learning']) {
    const data = document.getElementById(`data-${id}`);
    for (const it of data ? JSON.parse(data.textContent).charts : []) {
      const figure = document.querySelector(`[data-chart="${it.id}"]`);
      const lines = it.samples.map(({ label, style, x, mid, lo, hi }) => ({
        label, style, x: mpgx.unpack(x), mid: mpgx.unpack(mid), ...(lo && { lo: mpgx.unpack(lo), hi: mpgx.unpack(hi) }),
      }));
      const shown = (value) => mpgx.number(value * it.across);
      const chart = mpgx.chart(figure, {
        title: it.title, unit: it.unit, unitName: it.steps ? 'share' : '', factor: it.factor, x: lines[0].x, xName: it.name, xFactor: it.across, zero: it.steps, steps: it.steps, midName: it.middle, lines,
        ...(it.steps && { xText: shown, xLong: shown }),
      });
      mpgx.legend(figure.querySelector('.legend'), [chart]);
    }
  }
})();
