// The numbers of the page as files.
(() => {
  'use strict';
  const read = (id) => { const node = document.getElementById(`data-${id}`); return node && JSON.parse(node.textContent); };
  const { scenario, summary } = read('data');

  // A cell that a spreadsheet would take for a formula is kept as text.
  const cell = (value) => {
    if (typeof value === 'number') return String(value);
    const text = value === null || value === undefined ? '' : String(value);
    const plain = /^[=+\-@]/.test(text) ? `'${text}` : text;
    return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
  };
  const csv = (rows) => rows.map((row) => row.map(cell).join(',')).join('\n') + '\n';

  const files = {
    'summary.json': () => JSON.stringify(summary, null, 2),
    'seeds.csv': () => {
      const rows = [['protocol', 'method', 'metric', 'seed', 'value']];
      for (const [protocol, methods] of Object.entries(summary.protocols))
        for (const [method, metrics] of Object.entries(methods))
          for (const [metric, statistic] of Object.entries(metrics))
            statistic.per_seed.forEach((value, seed) => rows.push([protocol, method, metric, seed, value]));
      return csv(rows);
    },
    'curves.csv': () => {
      const rows = [['quantity', 'method', 'seed', 'steps', 'value']];
      const { steps, charts } = read('curves') || { steps: [], charts: [] };
      for (const chart of charts)
        for (const method of chart.methods)
          for (const seed of method.seeds)
            seed.values.forEach((value, bin) => rows.push([chart.title, method.label, seed.seed, steps[bin], value]));
      return csv(rows);
    },
  };
  for (const button of document.querySelectorAll('[data-save]')) {
    button.addEventListener('click', () => {
      const name = button.dataset.save;
      const url = URL.createObjectURL(new Blob([files[name]()], { type: 'text/plain' }));
      const link = document.createElement('a');
      link.href = url;
      link.download = `${scenario}-${name}`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(url), 1000);
    });
  }
})();
