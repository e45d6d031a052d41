// The strip below the picture: error, reward terms and actions over time. What does not move is drawn once.
mpgx.lane = (name, show, entries, { symmetric, frames, scrub, let: letGo }) => {
  const HEIGHT = 54, MOST_LINES = 12;
  const box = document.createElement('div'), labels = document.createElement('div'), title = document.createElement('span'), canvas = document.createElement('canvas');
  box.className = 'lane';
  title.append(name);
  labels.append(title);
  canvas.setAttribute('aria-hidden', 'true');
  box.append(labels, canvas);
  let lo = symmetric ? -1 : 0, hi = symmetric ? 1 : 0;
  for (const { columns } of entries) for (const values of columns) for (const value of values) { lo = Math.min(lo, value); hi = Math.max(hi, value); }
  if (hi === lo) hi = lo + 1;
  for (const entry of entries) {
    entry.label = document.createElement('b');
    entry.label.className = entry.style;
    if (entry.columns.length > 1) entry.label.textContent = entry.method;
    labels.append(entry.label);
  }
  const move = (event) => {
    const area = canvas.getBoundingClientRect();
    scrub((event.clientX - area.left) / area.width * (frames - 1));
  };
  canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); move(event); });
  canvas.addEventListener('pointermove', (event) => { if (canvas.hasPointerCapture(event.pointerId)) move(event); });
  canvas.addEventListener('pointerup', letGo);

  const across = (frame, width) => frame / (frames - 1) * width;
  const up = (value) => 4 + (hi - value) / (hi - lo) * (HEIGHT - 8);
  const still = document.createElement('canvas');
  let key = '';

  const drawStill = (width, ratio, ink) => {
    still.width = Math.max(1, Math.round(width * ratio));
    still.height = Math.round(HEIGHT * ratio);
    const c = still.getContext('2d');
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const trace = (values) => { c.beginPath(); values.forEach((value, k) => c.lineTo(across(k + 1, width), up(value))); };
    c.lineWidth = 1;
    c.strokeStyle = ink.line;
    c.beginPath();
    c.moveTo(0, up(0));
    c.lineTo(width, up(0));
    c.stroke();
    for (const entry of entries) {
      const { columns } = entry;
      c.strokeStyle = c.fillStyle = ink[entry.style];
      if (columns.length > MOST_LINES) {
        // Of many columns what they lie between, and their mean.
        const of = (pick) => columns[0].map((_, k) => pick(columns.map((values) => values[k])));
        const low = of((values) => Math.min(...values)), high = of((values) => Math.max(...values));
        trace(high);
        for (let k = low.length - 1; k >= 0; k--) c.lineTo(across(k + 1, width), up(low[k]));
        c.globalAlpha = 0.2;
        c.fill();
        c.globalAlpha = 1;
        c.lineWidth = 1.5;
        trace(of((values) => values.reduce((sum, value) => sum + value, 0) / values.length));
        c.stroke();
        continue;
      }
      c.globalAlpha = columns.length > 1 ? 0.5 : 1;
      c.lineWidth = columns.length > 1 ? 1 : 1.5;
      for (const values of columns) { trace(values); c.stroke(); }
      c.globalAlpha = 1;
    }
    c.strokeStyle = ink.alarm;
    c.lineWidth = 2;
    for (const entry of entries) for (const frame of entry.strikes || []) {
      c.beginPath();
      c.moveTo(across(frame, width), 0);
      c.lineTo(across(frame, width), 5);
      c.stroke();
    }
  };

  const draw = (time, mix, ink) => {
    const ratio = devicePixelRatio || 1, now = [mpgx.width(canvas), ratio, ink.ink].join();
    const { context: c, width, height } = mpgx.fit(canvas, HEIGHT);
    if (!width) return;
    if (key !== now) { key = now; drawStill(width, ratio, ink); }
    c.drawImage(still, 0, 0, width, height);
    for (const entry of entries) {
      if (entry.columns.length > 1) continue;
      const value = mix(entry.columns[0], 1, 0, Math.max(0, time - 1));
      entry.label.textContent = show(value);
      c.fillStyle = ink[entry.style];
      c.beginPath();
      c.arc(across(time, width), up(value), 3.5, 0, 2 * Math.PI);
      c.fill();
    }
    c.lineWidth = 1;
    c.strokeStyle = ink.ink;
    c.beginPath();
    c.moveTo(across(time, width), 0);
    c.lineTo(across(time, width), height);
    c.stroke();
  };
  return { box, draw };
};
