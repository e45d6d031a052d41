// What is played, as files: the pictures side by side, and every position.
mpgx.pictures = (shows, background) => new Promise((done) => {
  const gap = 24, canvases = shows.map(({ canvas }) => canvas);
  const out = document.createElement('canvas'), c = out.getContext('2d');
  out.width = canvases.reduce((sum, canvas) => sum + canvas.width + gap, -gap);
  out.height = Math.max(...canvases.map((canvas) => canvas.height));
  c.fillStyle = background;
  c.fillRect(0, 0, out.width, out.height);
  let left = 0;
  for (const canvas of canvases) { c.drawImage(canvas, left, 0); left += canvas.width + gap; }
  out.toBlob(done, 'image/png');
});

mpgx.rows = (world, stage, shows, labels) => {
  const rows = [['protocol', 'episode', 'seed', 'method', 'time_s', 'agent', 'x_m', 'y_m', 'error_m', ...stage.terms.map((term) => `reward/${term}`)]];
  for (const { track, method } of shows) {
    const all = world.actors(stage, track), error = world.numbers(track.error), terms = world.numbers(track.terms);
    const short = (value) => Number(value.toPrecision(5));
    const counts = {};
    const names = all.map(({ group }) => `${group}[${counts[group] = (counts[group] || 0) + 1}]`);
    for (let frame = 0; frame < track.frames; frame++) {
      const step = frame - 1, here = [stage.name, track.episode + 1, track.seed, labels[method], short(frame * track.stride * stage.dt_s)];
      const sums = step < 0 ? [''].concat(stage.terms.map(() => '')) : [short(error[step]), ...stage.terms.map((_, k) => short(terms[step * stage.terms.length + k]))];
      all.forEach((agent, k) => rows.push([...here, names[k], short(world.x(agent, frame)), short(world.y(agent, frame)), ...sums]));
    }
  }
  return rows;
};
