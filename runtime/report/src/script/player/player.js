// Playback of held-out episodes, two methods side by side and in step.
(() => {
  'use strict';
  const data = JSON.parse(document.getElementById('data-playback').textContent);
  const { stages, methods, tracks } = data;
  const world = mpgx.tracks(data);
  const root = document.getElementById('player');
  const part = (selector) => root.querySelector(selector);
  const slider = part('input[type=range]');
  const choice = (name) => part(`[data-choice=${name}]`);
  const SPEEDS = [...choice('speed').options].map((option) => option.value);

  // What is shown. `at` is a frame with its fraction.
  const state = { stage: tracks[0].protocol, episode: 0, seed: tracks[0].seed, left: tracks[0].method, right: -1, at: 0, playing: false };
  let shows = [];
  let lanes = [];
  let ink = {};

  const frames = () => Math.max(2, ...shows.map((show) => show.track.frames));
  const secondsPerFrame = () => stages[state.stage].dt_s * (shows.length ? shows[0].track.stride : 1);

  const paint = () => {
    const stage = stages[state.stage];
    for (const show of shows) {
      const { track, method, canvas, note } = show;
      const struck = mpgx.scene(world, canvas, { stage, track, area: stage.frames[state.episode], time: state.at, colour: ink[methods[method].style], ink });
      const error = world.mix(world.numbers(track.error), 1, 0, Math.max(0, state.at - 1));
      note.textContent = `${struck ? 'collision, ' : ''}${Math.round(1000 * error)} mm from the slots`;
      note.classList.toggle('struck', struck > 0);
      if (show.view) show.view(state.at * track.stride);
    }
    for (const lane of lanes) lane.draw(state.at, world.mix, ink);
  };

  // ---- Choosing

  const options = (select, entries, chosen) => {
    select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
    select.value = String(chosen);
  };
  const unique = (values) => [...new Set(values)].sort((a, b) => a - b);
  const column = (values, width, index) => {
    if (width === 1) return values;
    const out = new Float32Array(values.length / width);
    for (let k = 0; k < out.length; k++) out[k] = values[k * width + index];
    return out;
  };

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
    shows = wanted.map((method) => ({ method, track: world.find(state.stage, method, state.episode, state.seed) })).filter(({ track }) => track);
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
      show.canvas.addEventListener('click', toggle);
      title.append(name, show.note);
      box.append(title, show.canvas);
      const { film } = data;
      const seen = film && ['protocol', 'method', 'seed', 'episode'].every((key) => film[key] === show.track[key]);
      show.view = seen && mpgx.film(film, box, () => paint());
      return box;
    }));
    const stage = stages[state.stage], learned = stage.agents.filter((agent) => agent.learned).length;
    const series = (pick, width, index) => shows.map(({ track, method }) => ({
      style: methods[method].style, method: methods[method].label,
      columns: (index === undefined ? [...Array(width).keys()] : [index]).map((k) => column(world.numbers(track[pick]), width, k)),
    }));
    const plain = (value) => value.toFixed(3).replace('-', '\u2212');
    const lane = (name, show, entries, symmetric) => mpgx.lane(name, show, entries, { symmetric, frames: frames(), scrub: (at) => { pause(); seek(at); }, let: remember });
    const errors = series('error', 1, 0);
    errors.forEach((entry, k) => { entry.strikes = world.strikes(stage, shows[k].track); });
    const millimetres = (value) => `${(1000 * value).toFixed(0)} mm`.replace('-', '\u2212');
    const clear = shows.map(({ track, method }) => ({ style: methods[method].style, method: methods[method].label, columns: [world.clearance(stage, track)] }));
    lanes = [
      lane('distance from the slots', millimetres, errors, false),
      ...(clear.every(({ columns }) => columns[0]) ? [lane('clearance of obstacles', millimetres, clear, false)] : []),
      ...stage.terms.map((term, k) => lane(term, plain, series('terms', stage.terms.length, k), false)),
      ...series('actions', 2 * learned).map((entry) => lane('actions', () => '', [entry], true)),
    ];
    part('.lanes').replaceChildren(...lanes.map(({ box }) => box));
    slider.max = frames() - 1;
    seek(state.at);
  };

  // ---- Time

  const seek = (at) => {
    state.at = Math.min(frames() - 1, Math.max(0, at));
    slider.value = state.at;
    const time = `${(state.at * secondsPerFrame()).toFixed(1)} s`;
    slider.setAttribute('aria-valuetext', time);
    part('output').textContent = time;
    paint();
  };

  let before = 0, visible = true, started = false;
  const tick = (time) => {
    if (!state.playing || !visible) return;
    const elapsed = Math.min(0.1, Math.max(0, time - before) / 1000) * Number(choice('speed').value);
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
  function toggle() { if (state.playing) { pause(); remember(); } else play(); }
  const step = (by) => { pause(); seek(Math.round(state.at) + by); remember(); };
  const hasten = (by) => {
    const speed = choice('speed'), k = SPEEDS.indexOf(speed.value) + by;
    if (SPEEDS[k]) { speed.value = SPEEDS[k]; remember(); }
  };

  // ---- The address keeps what is shown: #play=protocol,episode,seed,left,right,frame,speed

  function remember() {
    const words = [stages[state.stage].name, state.episode, state.seed, methods[state.left].label, state.right < 0 ? '' : methods[state.right].label, Math.round(state.at), choice('speed').value];
    try { history.replaceState(null, '', `#play=${words.map(encodeURIComponent).join(',')}`); } catch { /* not in this place */ }
  }
  const recall = () => {
    if (!location.hash.startsWith('#play=')) return false;
    let words;
    try { words = location.hash.slice(6).split(',').map(decodeURIComponent); } catch { return false; }
    const stage = stages.findIndex((other) => other.name === words[0]);
    const method = (label) => methods.findIndex((other) => other.label === label);
    if (stage < 0 || method(words[3]) < 0) return false;
    Object.assign(state, { stage, episode: Number(words[1]) || 0, seed: Number(words[2]) || 0, left: method(words[3]), right: method(words[4]), at: Number(words[5]) || 0 });
    if (SPEEDS.includes(words[6])) choice('speed').value = words[6];
    pause();
    choose();
    return true;
  };

  // ---- Wiring

  const colours = () => {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(name).trim();
    ink = { ink: read('--ink'), soft: read('--soft'), line: read('--line'), raised: read('--raised'), alarm: read('--alarm'), ref: read('--ref'), font: read('--sans'), obstacle: read('--obstacle') };
    for (let k = 0; k < 6; k++) ink[`m${k}`] = read(`--c${k}`);
  };
  for (const name of ['stage', 'episode', 'seed', 'left', 'right']) {
    choice(name).addEventListener('change', (event) => { state[name] = Number(event.target.value); choose(); remember(); });
  }
  choice('speed').addEventListener('change', remember);
  part('[data-do=play]').addEventListener('click', toggle);
  const file = () => [document.title.replace(/ · mpgx$/, ''), 'playback', stages[state.stage].name, state.episode + 1, state.seed].join('-').replace(/[^\w.-]+/g, '-');
  part('[data-do=rows]').addEventListener('click', () => mpgx.save(`${file()}.csv`, mpgx.csv(mpgx.rows(world, stages[state.stage], shows, methods.map(({ label }) => label))), 'text/csv'));
  part('[data-do=picture]').addEventListener('click', async () => {
    pause();
    mpgx.save(`${file()}-${Math.round(state.at)}.png`, await mpgx.pictures(shows, ink.raised));
  });
  slider.addEventListener('input', () => { pause(); seek(Number(slider.value)); });
  slider.addEventListener('change', remember);
  root.addEventListener('keydown', (event) => {
    const kind = event.target.tagName;
    if (['SELECT', 'SUMMARY'].includes(kind) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === ' ' && (kind === 'BUTTON' || event.target.type === 'checkbox')) return;
    const far = event.shiftKey ? Math.max(1, Math.round(1 / secondsPerFrame())) : 1;
    const act = {
      ' ': toggle, ArrowLeft: () => step(-far), ArrowRight: () => step(far), Home: () => step(-Infinity), End: () => step(Infinity),
      '[': () => hasten(-1), ']': () => hasten(1), l: () => choice('loop').click(),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  document.addEventListener('theme', () => { colours(); paint(); });
  addEventListener('hashchange', recall);
  new ResizeObserver(() => requestAnimationFrame(() => {
    for (const canvas of root.querySelectorAll('canvas')) canvas.wide = undefined;
    paint();
  })).observe(part('.stages'));

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
