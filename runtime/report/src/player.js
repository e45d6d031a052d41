// Playback of held-out episodes, two methods side by side and in step.
(() => {
  'use strict';
  const { stages, methods, blocks, tracks } = JSON.parse(document.getElementById('data-playback').textContent);
  const root = document.getElementById('player');
  const part = (selector) => root.querySelector(selector);
  const slider = part('input[type=range]');
  const choice = (name) => part(`[data-choice=${name}]`);
  const TRAIL_S = 4;

  // What is shown. `at` is a frame with its fraction.
  const state = { stage: tracks[0].protocol, episode: 0, seed: tracks[0].seed, left: tracks[0].method, right: -1, at: 0, playing: false };
  let shows = [];
  let lanes = [];
  let ink = {};

  // ---- Numbers

  const decoded = new Map();
  const numbers = (index) => {
    if (decoded.has(index)) return decoded.get(index);
    const { lo, hi, bytes, data } = blocks[index];
    const raw = atob(data);
    const low = Number(lo), level = (Number(hi) - low) / (2 ** (8 * bytes) - 1);
    const values = new Float32Array(raw.length / bytes);
    for (let k = 0; k < values.length; k++) {
      values[k] = low + level * (bytes === 1 ? raw.charCodeAt(k) : raw.charCodeAt(2 * k) | (raw.charCodeAt(2 * k + 1) << 8));
    }
    decoded.set(index, values);
    return values;
  };

  // The track of a method; controllers have one seed that stands for all.
  const find = (method, seed = state.seed) => {
    const fits = (track) => track.protocol === state.stage && track.method === method && track.episode === state.episode;
    return tracks.find((track) => fits(track) && track.seed === seed) || tracks.find(fits);
  };

  const frames = () => Math.max(2, ...shows.map((show) => show.track.frames));
  const secondsPerFrame = () => stages[state.stage].dt_s * (shows.length ? shows[0].track.stride : 1);

  const mix = (values, width, index, at) => {
    const last = values.length / width - 1;
    const from = Math.min(last, Math.floor(at)), to = Math.min(last, from + 1), share = Math.min(1, at - from);
    const a = values[from * width + index];
    return a + share * (values[to * width + index] - a);
  };
  const turn = (values, width, index, at) => {
    const last = values.length / width - 1;
    const from = Math.min(last, Math.floor(at)), to = Math.min(last, from + 1);
    const a = values[from * width + index], b = values[to * width + index];
    const difference = Math.atan2(Math.sin(b - a), Math.cos(b - a));
    return a + (at - from) * difference;
  };

  // ---- The scene

  const fit = (canvas, height) => {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth;
    canvas.style.height = `${height}px`;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    return { context, width, height };
  };

  const draw = (show) => {
    const stage = stages[state.stage], { track } = show, [x0, x1, y0, y1] = stage.frames[state.episode];
    const wide = show.canvas.clientWidth;
    const { context: c, width, height } = fit(show.canvas, Math.round(Math.min(wide * (y1 - y0) / (x1 - x0), wide, 620)));
    const scale = Math.min(width / (x1 - x0), height / (y1 - y0));
    const X = (x) => width / 2 + (x - (x0 + x1) / 2) * scale;
    const Y = (y) => height / 2 - (y - (y0 + y1) / 2) * scale;
    const at = Math.min(state.at, track.frames - 1);
    const colour = ink[methods[track.method].style];

    const scripted = numbers(track.scripted), learned = numbers(track.learned);
    const headings = numbers(track.headings), slots = numbers(track.slots);
    const counts = { scripted: 0, learned: 0 };
    const agents = stage.agents.map((agent) => {
      const kind = agent.learned ? 'learned' : 'scripted';
      return { ...agent, index: counts[kind]++, values: agent.learned ? learned : scripted };
    });
    const where = (agent, time) => {
      const width = 2 * counts[agent.learned ? 'learned' : 'scripted'];
      return [mix(agent.values, width, 2 * agent.index, time), mix(agent.values, width, 2 * agent.index + 1, time)];
    };
    const now = agents.map((agent) => where(agent, at));
    const seats = stage.slots.map(([agent, about], k) => ({
      agent, about, place: [mix(slots, 2 * stage.slots.length, 2 * k, at), mix(slots, 2 * stage.slots.length, 2 * k + 1, at)],
    }));

    c.lineJoin = c.lineCap = 'round';
    c.lineWidth = 1;
    c.strokeStyle = ink.line;
    for (const [a, b, low, high] of stage.arenas) c.strokeRect(X(a), Y(high), (b - a) * scale, (high - low) * scale);

    // The formation as it should be.
    const abouts = [...new Set(seats.map((seat) => seat.about))];
    c.fillStyle = ink.soft;
    for (const about of abouts) {
      c.globalAlpha = 0.09;
      c.beginPath();
      c.moveTo(X(now[about][0]), Y(now[about][1]));
      for (const seat of seats) if (seat.about === about) c.lineTo(X(seat.place[0]), Y(seat.place[1]));
      c.closePath();
      c.fill();
    }

    const trail = Math.round(TRAIL_S / (stage.dt_s * track.stride));
    const from = Math.max(0, at - trail);
    c.lineCap = 'butt';
    agents.forEach((agent) => {
      c.strokeStyle = agent.learned ? colour : ink.ref;
      c.lineWidth = 2;
      let [x, y] = where(agent, from);
      for (let time = Math.floor(from) + 1; ; time++) {
        const end = Math.min(time, at), [u, v] = where(agent, end);
        c.globalAlpha = 0.55 * ((end - at + trail) / trail) ** 1.5;
        c.beginPath();
        c.moveTo(X(x), Y(y));
        c.lineTo(X(u), Y(v));
        c.stroke();
        [x, y] = [u, v];
        if (time >= at) break;
      }
    });
    c.globalAlpha = 1;

    c.lineCap = 'round';
    const reach = Math.max(7, stage.safety_m / 2 * scale);
    c.lineWidth = 1.5;
    for (const seat of seats) {
      const [x, y] = seat.place, [u, v] = now[seat.agent];
      c.strokeStyle = colour;
      c.globalAlpha = 0.6;
      c.beginPath();
      c.moveTo(X(x), Y(y));
      c.lineTo(X(u), Y(v));
      c.stroke();
      c.globalAlpha = 1;
      c.strokeStyle = ink.soft;
      c.setLineDash([4, 3]);
      c.beginPath();
      c.arc(X(x), Y(y), reach, 0, 2 * Math.PI);
      c.stroke();
      c.setLineDash([]);
    }

    const struck = new Set();
    if (track.collisions.includes(Math.round(at))) {
      now.forEach(([x, y], i) => now.forEach(([u, v], j) => {
        if (i < j && Math.hypot(x - u, y - v) < stage.safety_m * 1.02) { struck.add(i); struck.add(j); }
      }));
    }
    agents.forEach((agent, k) => {
      const [x, y] = now[k];
      c.fillStyle = agent.learned ? colour : ink.ref;
      c.globalAlpha = 0.16;
      c.beginPath();
      c.arc(X(x), Y(y), stage.safety_m / 2 * scale, 0, 2 * Math.PI);
      c.fill();
      c.globalAlpha = 1;
      if (agent.hand_m && agent.learned) {
        const heading = turn(headings, counts.learned, agent.index, at);
        const size = agent.hand_m * scale;
        c.save();
        c.translate(X(x), Y(y));
        c.rotate(-heading);
        c.beginPath();
        c.moveTo(0, 0);
        c.lineTo(-1.15 * size, 0.42 * size);
        c.lineTo(-0.85 * size, 0);
        c.lineTo(-1.15 * size, -0.42 * size);
        c.closePath();
        c.fill();
        c.restore();
      }
      c.strokeStyle = ink.raised;
      c.lineWidth = 2;
      c.beginPath();
      c.arc(X(x), Y(y), agent.learned ? 4.5 : 6, 0, 2 * Math.PI);
      c.stroke();
      c.fill();
      if (struck.has(k)) {
        c.strokeStyle = ink.alarm;
        c.lineWidth = 3;
        c.beginPath();
        c.arc(X(x), Y(y), reach + 5, 0, 2 * Math.PI);
        c.stroke();
      }
    });

    // A bar that tells the scale.
    const bar = [5, 2, 1, 0.5, 0.2, 0.1, 0.05].find((length) => length * scale < width / 4) || 0.02;
    c.strokeStyle = c.fillStyle = ink.soft;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(16, height - 16);
    c.lineTo(16 + bar * scale, height - 16);
    c.stroke();
    c.font = `12px ${ink.font}`;
    c.fillText(`${bar} m`, 16, height - 23);
    show.note.textContent = `${Math.round(1000 * mix(numbers(track.error), 1, 0, Math.max(0, at - 1)))} mm from the slots`;
  };

  // ---- The strip below: error, reward terms, actions

  const lane = (name, unit, entries, symmetric) => {
    const box = document.createElement('div');
    box.className = 'lane';
    const labels = document.createElement('div');
    const title = document.createElement('span');
    title.append(name);
    labels.append(title);
    const canvas = document.createElement('canvas');
    canvas.setAttribute('aria-hidden', 'true');
    box.append(labels, canvas);
    let lo = symmetric ? -1 : 0, hi = symmetric ? 1 : 0;
    for (const { values } of entries) for (const value of values) { lo = Math.min(lo, value); hi = Math.max(hi, value); }
    if (hi === lo) hi = lo + 1;
    for (const entry of entries) {
      entry.label = document.createElement('b');
      entry.label.className = entry.style;
      if (entry.columns.length > 1) entry.label.textContent = entry.method;
      labels.append(entry.label);
    }
    const scrub = (event) => {
      const area = canvas.getBoundingClientRect();
      pause();
      seek((event.clientX - area.left) / area.width * (frames() - 1));
      remember();
    };
    canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); scrub(event); });
    canvas.addEventListener('pointermove', (event) => { if (canvas.hasPointerCapture(event.pointerId)) scrub(event); });
    return { box, canvas, entries, lo, hi, unit };
  };

  const column = (values, width, index) => {
    if (width === 1) return values;
    const out = new Float32Array(values.length / width);
    for (let k = 0; k < out.length; k++) out[k] = values[k * width + index];
    return out;
  };

  const drawLane = ({ canvas, entries, lo, hi, unit }) => {
    const { context: c, width, height } = fit(canvas, 54);
    const X = (frame) => frame / (frames() - 1) * width;
    const Y = (value) => 4 + (hi - value) / (hi - lo) * (height - 8);
    c.lineWidth = 1;
    c.strokeStyle = ink.line;
    c.beginPath();
    c.moveTo(0, Y(0));
    c.lineTo(width, Y(0));
    c.stroke();
    for (const entry of entries) {
      c.strokeStyle = ink[entry.style];
      c.globalAlpha = entry.columns.length > 1 ? 0.5 : 1;
      c.lineWidth = entry.columns.length > 1 ? 1 : 1.5;
      for (const values of entry.columns) {
        c.beginPath();
        values.forEach((value, k) => c.lineTo(X(k + 1), Y(value)));
        c.stroke();
      }
      c.globalAlpha = 1;
      if (entry.columns.length === 1) {
        const value = mix(entry.columns[0], 1, 0, Math.max(0, state.at - 1));
        entry.label.textContent = unit(value);
        c.fillStyle = ink[entry.style];
        c.beginPath();
        c.arc(X(state.at), Y(value), 3.5, 0, 2 * Math.PI);
        c.fill();
      }
    }
    c.strokeStyle = ink.ink;
    c.beginPath();
    c.moveTo(X(state.at), 0);
    c.lineTo(X(state.at), height);
    c.stroke();
  };

  // ---- Choosing

  const options = (select, entries, chosen) => {
    select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
    select.value = String(chosen);
  };
  const unique = (values) => [...new Set(values)].sort((a, b) => a - b);

  const choose = () => {
    const here = tracks.filter((track) => track.protocol === state.stage);
    const episodes = unique(here.map((track) => track.episode));
    if (!episodes.includes(state.episode)) state.episode = episodes[0];
    const seeds = unique(here.filter((track) => [state.left, state.right].includes(track.method)).map((track) => track.seed));
    if (!seeds.includes(state.seed)) state.seed = seeds[0];
    const present = unique(here.map((track) => track.method));
    if (!present.includes(state.left)) state.left = present[0];
    if (state.right !== -1 && !present.includes(state.right)) state.right = -1;
    options(choice('stage'), unique(tracks.map((track) => track.protocol)).map((k) => [k, stages[k].name]), state.stage);
    options(choice('episode'), episodes.map((k) => [k, k + 1]), state.episode);
    options(choice('seed'), seeds.map((seed) => [seed, seed]), state.seed);
    options(choice('left'), present.map((k) => [k, methods[k].label]), state.left);
    options(choice('right'), [[-1, 'none'], ...present.map((k) => [k, methods[k].label])], state.right);

    const wanted = state.right === -1 ? [state.left] : [state.left, state.right];
    shows = wanted.map((method) => ({ method, track: find(method) })).filter(({ track }) => track);
    part('.stages').replaceChildren(...shows.map((show) => {
      const box = document.createElement('div'), title = document.createElement('p'), name = document.createElement('span');
      box.className = 'stage';
      name.className = `name ${methods[show.method].style}`;
      name.textContent = methods[show.method].label;
      show.note = document.createElement('span');
      show.note.className = 'aside';
      show.canvas = document.createElement('canvas');
      show.canvas.setAttribute('role', 'img');
      show.canvas.setAttribute('aria-label', `Playback of ${methods[show.method].label}`);
      title.append(name, show.note);
      box.append(title, show.canvas);
      return box;
    }));
    const stage = stages[state.stage];
    const series = (pick, width, index) => shows.map(({ track, method }) => {
      const columns = index === undefined
        ? Array.from({ length: width }, (_, k) => column(numbers(track[pick]), width, k))
        : [column(numbers(track[pick]), width, index)];
      return { style: methods[method].style, method: methods[method].label, columns, values: columns.flatMap((values) => [...values]) };
    });
    const learned = stage.agents.filter((agent) => agent.learned).length;
    const plain = (value) => value.toFixed(3).replace('-', '\u2212');
    lanes = [
      lane('distance from the slots', (value) => `${(1000 * value).toFixed(0)} mm`, series('error', 1, 0), false),
      ...stage.terms.map((term, k) => lane(term, plain, series('terms', stage.terms.length, k), false)),
      ...series('actions', 2 * learned).map((entry) => lane('actions', () => '', [entry], true)),
    ];
    part('.lanes').replaceChildren(...lanes.map(({ box }) => box));
    slider.max = frames() - 1;
    seek(state.at);
  };

  // ---- Time

  const paint = () => {
    shows.forEach(draw);
    lanes.forEach(drawLane);
  };
  const seek = (at) => {
    state.at = Math.min(frames() - 1, Math.max(0, at));
    slider.value = state.at;
    part('output').textContent = `${(state.at * secondsPerFrame()).toFixed(1)} s`;
    paint();
  };

  let before = 0, visible = true, started = false;
  const tick = (time) => {
    if (!state.playing || !visible) return;
    const elapsed = Math.min(0.1, (time - before) / 1000) * Number(choice('speed').value);
    before = time;
    const next = state.at + elapsed / secondsPerFrame();
    if (next < frames() - 1) seek(next);
    else if (choice('loop').checked) seek(0);
    else { seek(frames() - 1); pause(); }
    requestAnimationFrame(tick);
  };
  const wake = () => { before = performance.now(); requestAnimationFrame(tick); };
  const play = () => {
    if (state.playing) return;
    if (state.at >= frames() - 1) state.at = 0;
    state.playing = true;
    root.classList.add('playing');
    wake();
  };
  const pause = () => { state.playing = false; root.classList.remove('playing'); };
  const toggle = () => { if (state.playing) { pause(); remember(); } else play(); };
  const step = (by) => { pause(); seek(Math.round(state.at) + by); remember(); };

  // ---- The address keeps what is shown: #play=protocol,episode,seed,left,right,frame

  const remember = () => {
    const words = [stages[state.stage].name, state.episode, state.seed, methods[state.left].label, state.right < 0 ? '' : methods[state.right].label, Math.round(state.at)];
    try { history.replaceState(null, '', `#play=${words.map(encodeURIComponent).join(',')}`); } catch { /* not in this place */ }
  };
  const recall = () => {
    if (!location.hash.startsWith('#play=')) return false;
    let words;
    try { words = location.hash.slice(6).split(',').map(decodeURIComponent); } catch { return false; }
    const stage = stages.findIndex((other) => other.name === words[0]);
    const method = (label) => methods.findIndex((other) => other.label === label);
    if (stage < 0 || method(words[3]) < 0) return false;
    Object.assign(state, { stage, episode: Number(words[1]) || 0, seed: Number(words[2]) || 0, left: method(words[3]), right: method(words[4]), at: Number(words[5]) || 0 });
    pause();
    choose();
    return true;
  };

  // ---- Wiring

  const colours = () => {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(name).trim();
    ink = { ink: read('--ink'), soft: read('--soft'), line: read('--line'), raised: read('--raised'), alarm: read('--alarm'), ref: read('--ref'), font: read('--sans') };
    for (let k = 0; k < 6; k++) ink[`m${k}`] = read(`--c${k}`);
  };
  for (const name of ['stage', 'episode', 'seed', 'left', 'right']) {
    choice(name).addEventListener('change', (event) => { state[name] = Number(event.target.value); choose(); remember(); });
  }
  part('[data-do=play]').addEventListener('click', toggle);
  slider.addEventListener('input', () => { pause(); seek(Number(slider.value)); });
  slider.addEventListener('change', remember);
  root.addEventListener('keydown', (event) => {
    const kind = event.target.tagName;
    if (kind === 'SELECT' || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === ' ' && (kind === 'BUTTON' || event.target.type === 'checkbox')) return;
    const act = { ' ': toggle, ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => step(-Infinity), End: () => step(Infinity) }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  document.addEventListener('theme', () => { colours(); paint(); });
  addEventListener('hashchange', recall);
  new ResizeObserver(() => requestAnimationFrame(paint)).observe(part('.stages'));

  choice('speed').value = '2';
  slider.step = 'any';
  const second = tracks.find((track) => track.method !== state.left);
  if (second) state.right = second.method;
  colours();
  const recalled = recall();
  if (!recalled) choose();
  new IntersectionObserver(([entry]) => {
    visible = entry.isIntersecting;
    const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
    if (visible && !started && !calm && !recalled) play();
    else if (visible && state.playing) wake();
    started = started || visible;
  }, { threshold: 0.2 }).observe(root);
})();
