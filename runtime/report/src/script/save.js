// Every figure as SVG, PNG and CSV, as it is now, in light colours.
(() => {
  'use strict';
  const SVG = 'http://www.w3.org/2000/svg';
  const LOOK = ['fill', 'fill-opacity', 'stroke', 'stroke-width', 'stroke-dasharray', 'stroke-linecap', 'stroke-linejoin', 'stroke-opacity', 'opacity', 'vector-effect', 'paint-order', 'visibility'];
  const FONT = ['font-family', 'font-size', 'font-weight', 'text-anchor'];

  // A cell that a spreadsheet would take for a formula is kept as text.
  const cell = (value) => {
    if (typeof value === 'number') return String(value);
    const text = value === null || value === undefined ? '' : String(value);
    const plain = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
  };
  mpgx.csv = (rows) => rows.map((row) => row.map(cell).join(',')).join('\n') + '\n';
  mpgx.save = (name, content, type) => {
    const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
    const link = document.createElement('a');
    link.href = url;
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };

  // A drawing with the style of the page written into it.
  const copy = (node) => {
    const out = node.cloneNode(false), leaf = !['g', 'svg', 'title', 'desc'].includes(node.localName);
    const style = getComputedStyle(node);
    if (style.display === 'none') return null;
    for (const key of ['class', 'style', 'role', 'aria-labelledby', 'aria-hidden', 'id']) out.removeAttribute(key);
    if (leaf) for (const key of node.localName === 'text' ? [...LOOK, ...FONT] : LOOK) {
      const value = style.getPropertyValue(key);
      if (value && value !== 'none' && value !== 'normal' && value !== 'visible' || key === 'fill') out.setAttribute(key, value);
    }
    if (node.localName === 'svg') out.setAttribute('overflow', style.overflow);
    for (const child of node.childNodes) {
      const part = child.nodeType === Node.ELEMENT_NODE ? copy(child) : child.cloneNode();
      if (part) out.append(part);
    }
    return out;
  };

  // The words of an element, a line each where they wrap.
  const words = (node, box) => {
    const texts = [], walker = document.createTreeWalker(node, NodeFilter.SHOW_TEXT), range = document.createRange();
    for (let text = walker.nextNode(); text; text = walker.nextNode()) {
      if (text.parentElement.closest('svg, .save, [aria-pressed="false"]')) continue;
      const style = getComputedStyle(text.parentElement);
      let line = null;
      for (const word of text.data.matchAll(/\S+/g)) {
        range.setStart(text, word.index);
        range.setEnd(text, word.index + word[0].length);
        const rect = range.getBoundingClientRect();
        if (!rect.width) continue;
        if (line && Math.abs(line.top - rect.top) < 3) line.node.textContent += ` ${word[0]}`;
        else {
          line = { top: rect.top, node: document.createElementNS(SVG, 'text') };
          const at = { x: rect.left - box.left, y: rect.top - box.top + rect.height * 0.78, fill: style.color, 'font-family': style.fontFamily, 'font-size': style.fontSize, 'font-weight': style.fontWeight };
          for (const [key, value] of Object.entries(at)) line.node.setAttribute(key, value);
          line.node.textContent = word[0];
          texts.push(line.node);
        }
      }
    }
    return texts;
  };

  const drawing = (figure) => {
    const root = document.documentElement, theme = root.dataset.theme, chart = mpgx.charts?.get(figure);
    chart?.ready();
    chart?.settle();
    root.dataset.theme = 'light';
    figure.classList.add('saving');
    try {
      const box = figure.getBoundingClientRect(), out = document.createElementNS(SVG, 'svg');
      const margin = 12, parts = [];
      let bottom = 0;
      for (const node of figure.querySelectorAll('svg')) {
        if (node.parentElement.closest('svg') || !node.getClientRects().length || node.closest('.save, details, button.reset')) continue;
        const rect = node.getBoundingClientRect(), part = copy(node);
        if (!part) continue;
        for (const [key, value] of Object.entries({ x: rect.left - box.left, y: rect.top - box.top, width: rect.width, height: rect.height })) part.setAttribute(key, value);
        parts.push(part);
        bottom = Math.max(bottom, rect.bottom - box.top + (node.classList.contains('chart') ? 26 : 0));
      }
      for (const node of figure.querySelectorAll('figcaption, .legend, .label, .axis, .below')) {
        if (!node.getClientRects().length) continue;
        parts.push(...words(node, box));
        bottom = Math.max(bottom, node.getBoundingClientRect().bottom - box.top);
      }
      const list = figure.dataset.legend && document.getElementById(figure.dataset.legend);
      if (list) {
        // The legend of the whole panel, below.
        const other = list.getBoundingClientRect();
        const moved = { left: other.left, top: other.top - bottom - 8 };
        for (const node of list.querySelectorAll('svg')) {
          if (node.closest('[aria-pressed="false"]')) continue;
          const rect = node.getBoundingClientRect(), part = copy(node);
          for (const [key, value] of Object.entries({ x: rect.left - moved.left, y: rect.top - moved.top, width: rect.width, height: rect.height })) part.setAttribute(key, value);
          parts.push(part);
        }
        parts.push(...words(list, moved));
        bottom += other.height + 8;
      }
      const width = Math.ceil(box.width + 2 * margin), height = Math.ceil(bottom + 2 * margin);
      for (const [key, value] of Object.entries({ xmlns: SVG, width, height, viewBox: `${-margin} ${-margin} ${width} ${height}` })) out.setAttribute(key, value);
      const back = document.createElementNS(SVG, 'rect');
      for (const [key, value] of Object.entries({ x: -margin, y: -margin, width, height, fill: '#fff' })) back.setAttribute(key, value);
      out.append(back, ...parts);
      return { text: new XMLSerializer().serializeToString(out), width, height };
    } finally {
      figure.classList.remove('saving');
      if (theme) root.dataset.theme = theme; else delete root.dataset.theme;
    }
  };

  const png = ({ text, width, height }) => new Promise((done, fail) => {
    const image = new Image(), scale = 3;
    image.onload = () => {
      const canvas = document.createElement('canvas');
      canvas.width = width * scale;
      canvas.height = height * scale;
      const context = canvas.getContext('2d');
      context.scale(scale, scale);
      context.drawImage(image, 0, 0, width, height);
      canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error('no picture'))), 'image/png');
    };
    image.onerror = () => fail(new Error('no picture'));
    image.src = `data:image/svg+xml,${encodeURIComponent(text)}`;
  });

  const table = (figure) => {
    const rows = [...figure.querySelectorAll('details table tr')];
    return rows.map((row) => [...row.cells].map((it) => it.textContent.trim().replace('\u2212', '-')));
  };

  const name = document.title.replace(/ · mpgx$/, '').replace(/[^\w.-]+/g, '-');
  for (const figure of document.querySelectorAll('figure[data-name]')) {
    const chart = mpgx.charts?.get(figure), part = figure.closest('[data-part]')?.dataset.part;
    const parts = [name, figure.closest('section').id, part, figure.dataset.name].filter(Boolean);
    const file = parts.map((word) => word.replace(/[^\w.-]+/g, '-')).join('-');
    const kinds = {
      SVG: () => mpgx.save(`${file}.svg`, drawing(figure).text, 'image/svg+xml'),
      PNG: async () => mpgx.save(`${file}.png`, await png(drawing(figure))),
    };
    if (chart || figure.querySelector('details table')) kinds.CSV = () => mpgx.save(`${file}.csv`, mpgx.csv(chart ? chart.rows() : table(figure)), 'text/csv');
    const group = document.createElement('span');
    group.className = 'save';
    group.setAttribute('role', 'group');
    group.setAttribute('aria-label', `Save ${figure.dataset.name}`);
    for (const [kind, act] of Object.entries(kinds)) {
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = kind;
      button.setAttribute('aria-label', `Save ${figure.dataset.name} as ${kind}`);
      button.addEventListener('click', act);
      group.append(button);
    }
    figure.querySelector('figcaption').append(group);
  }
})();
