// The learners' own log: values, zoom.
(() => {
  'use strict';
  const { updates, charts } = JSON.parse(document.getElementById('data-health').textContent);
  const group = [];
  group.key = 'health';
  for (const chart of charts) {
    const lines = chart.methods.map((method) => {
      const seeds = method.seeds.map((seed) => ({ ...seed, values: mpgx.unpack(seed.values) }));
      const mid = updates.map((_, k) => {
        const known = seeds.map((seed) => seed.values[k]).filter((value) => value !== null && value !== undefined);
        return known.length === seeds.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
      });
      return { label: method.label, style: method.style, seeds, mid };
    });
    const figure = document.querySelector(`[data-health="${chart.id}"]`);
    mpgx.chart(figure, { title: chart.title, unit: '', factor: 1, x: updates, fromZero: true, xName: 'updates', lines }, group);
  }
  mpgx.legend(document.getElementById('health-legend'), group);
})();
