// The numbers of the page as files.
(() => {
  'use strict';
  const read = (id) => { const node = document.getElementById(`data-${id}`); return node && JSON.parse(node.textContent); };
  const { scenario, summary } = read('data');

  const files = {
    'page.json': () => {
      const all = [...document.querySelectorAll('script[type="application/json"]')];
      return JSON.stringify(Object.fromEntries(all.map((node) => [node.id.slice(5), JSON.parse(node.textContent)])));
    },
    'summary.json': () => JSON.stringify(summary, null, 2),
    'seeds.csv': () => {
      const rows = [['protocol', 'method', 'metric', 'seed', 'value']];
      for (const [protocol, methods] of Object.entries(summary.protocols))
        for (const [method, metrics] of Object.entries(methods))
          for (const [metric, statistic] of Object.entries(metrics))
            statistic.per_seed.forEach((value, seed) => rows.push([protocol, method, metric, seed, value]));
      return mpgx.csv(rows);
    },
    'curves.csv': () => {
      const rows = [['quantity', 'method', 'seed', 'steps', 'value']];
      const { steps, charts } = read('curves') || { steps: [], charts: [] };
      for (const chart of charts)
        for (const method of chart.methods)
          for (const seed of method.seeds)
            mpgx.unpack(seed.values).forEach((value, bin) => rows.push([chart.title, method.label, seed.seed, steps[bin], value]));
      return mpgx.csv(rows);
    },
  };
  for (const button of document.querySelectorAll('[data-save]')) {
    button.addEventListener('click', () => {
      const name = button.dataset.save;
      mpgx.save(`${scenario}-${name}`, files[name](), 'text/plain');
    });
  }
})();
