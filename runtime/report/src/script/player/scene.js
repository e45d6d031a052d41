// The picture of a moment: arenas, obstacles with their margins, ways, places, agents.
// Reading a width makes the browser lay out the page again, so it is kept until the player changes its size.
mpgx.width = (canvas) => (canvas.wide ??= canvas.clientWidth);
mpgx.fit = (canvas, height) => {
  const ratio = devicePixelRatio || 1, width = mpgx.width(canvas), style = `${height}px`;
  if (canvas.style.height !== style) canvas.style.height = style;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
};

mpgx.scene = (world, canvas, { stage, track, area, time, colour, ink }) => {
  const TRAIL_S = 4, MOST_SEGMENTS = 6000, MOST_SEATS = 12, ROUND = 2 * Math.PI;
  const [x0, x1, y0, y1] = area, wide = mpgx.width(canvas);
  const { context: c, width, height } = mpgx.fit(canvas, Math.round(Math.min(wide * (y1 - y0) / (x1 - x0), wide, 620)));
  const scale = Math.min(width / (x1 - x0), height / (y1 - y0));
  const X = (x) => width / 2 + (x - (x0 + x1) / 2) * scale;
  const Y = (y) => height / 2 - (y - (y0 + y1) / 2) * scale;
  const at = Math.min(time, track.frames - 1);
  const all = world.actors(stage, track), agents = all.filter((agent) => !agent.solid);
  const now = all.map((agent) => [X(world.x(agent, at)), Y(world.y(agent, at))]);
  const paint = (draw, style, alpha = 1) => {
    c.globalAlpha = alpha;
    Object.assign(c, style);
    c.beginPath();
    draw();
    if (style.fillStyle) c.fill();
    if (style.strokeStyle) c.stroke();
    c.globalAlpha = 1;
  };
  const dot = ([x, y], radius) => { c.moveTo(x + radius, y); c.arc(x, y, radius, 0, ROUND); };
  const many = agents.length > 40;

  c.lineJoin = c.lineCap = 'round';
  for (const [a, b, low, high] of stage.arenas) paint(() => c.rect(X(a), Y(high), (b - a) * scale, (high - low) * scale), { strokeStyle: ink.line, fillStyle: null, lineWidth: 1 });

  // Obstacles, and how near is too near.
  all.forEach((obstacle, k) => {
    if (!obstacle.solid) return;
    const [x, y] = now[k], { Disc: disc, Segment: segment, Polygon: polygon } = obstacle.solid;
    const outline = () => {
      if (disc) return dot([x, y], disc.radius_m * scale);
      const corners = segment ? [[0, 0], segment.to_m] : polygon.corners_m;
      corners.forEach(([dx, dy], i) => c[i ? 'lineTo' : 'moveTo'](x + dx * scale, y - dy * scale));
      if (polygon) c.closePath();
    };
    if (stage.safety_m > 0) paint(outline, { strokeStyle: ink.alarm, fillStyle: null, lineWidth: 2 * stage.safety_m * scale }, 0.09);
    paint(outline, { strokeStyle: ink.soft, fillStyle: segment ? null : ink.obstacle, lineWidth: segment ? 3 : 1 });
  });

  // The formation as it should be.
  const slots = world.numbers(track.slots), columns = 2 * stage.slots.length;
  const seats = stage.slots.map(([agent, about], k) => ({ agent, about, place: [X(world.mix(slots, columns, 2 * k, at)), Y(world.mix(slots, columns, 2 * k + 1, at))] }));
  if (seats.length <= MOST_SEATS) {
    for (const about of new Set(seats.map((seat) => seat.about))) {
      paint(() => {
        c.moveTo(...now[about]);
        for (const seat of seats) if (seat.about === about) c.lineTo(...seat.place);
        c.closePath();
      }, { fillStyle: ink.soft, strokeStyle: null }, 0.09);
    }
  }

  // Tails, fading in a few strokes for all agents together.
  const trail = Math.max(1, Math.round(TRAIL_S / (stage.dt_s * track.stride))), from = Math.max(0, at - trail);
  const skip = Math.max(1, Math.ceil(agents.length * trail / MOST_SEGMENTS)), fades = many ? 5 : 16;
  c.lineCap = 'butt';
  for (const learned of [false, true]) {
    const some = agents.filter((agent) => agent.learned === learned);
    for (let fade = 0; fade < fades && at > from; fade++) {
      const begin = from + (at - from) * fade / fades, end = from + (at - from) * (fade + 1) / fades;
      paint(() => {
        for (const agent of some) {
          c.moveTo(X(world.x(agent, begin)), Y(world.y(agent, begin)));
          for (let frame = Math.floor(begin) + skip; frame < end; frame += skip) c.lineTo(X(world.x(agent, frame)), Y(world.y(agent, frame)));
          c.lineTo(X(world.x(agent, end)), Y(world.y(agent, end)));
        }
      }, { strokeStyle: learned ? colour : ink.ref, fillStyle: null, lineWidth: many ? 1 : 2 }, 0.55 * ((end - at + trail) / trail) ** 1.5);
    }
  }

  c.lineCap = 'round';
  const reach = Math.max(many ? 2 : 7, stage.safety_m / 2 * scale), size = Math.min(4.5, Math.max(2, reach));
  paint(() => { for (const seat of seats) { c.moveTo(...seat.place); c.lineTo(...now[seat.agent]); } }, { strokeStyle: colour, fillStyle: null, lineWidth: many ? 0.75 : 1.5 }, 0.6);
  c.setLineDash(many ? [] : [4, 3]);
  paint(() => { for (const seat of seats) dot(seat.place, many ? size : reach); }, { strokeStyle: ink.soft, fillStyle: null, lineWidth: many ? 0.75 : 1.5 });
  c.setLineDash([]);

  const headings = world.numbers(track.headings), learners = stage.agents.filter((agent) => agent.learned).length;
  for (const learned of [false, true]) {
    const style = { fillStyle: learned ? colour : ink.ref, strokeStyle: null };
    const some = all.map((agent, k) => [agent, now[k]]).filter(([agent]) => !agent.solid && agent.learned === learned);
    paint(() => { for (const [, place] of some) dot(place, stage.safety_m / 2 * scale); }, style, 0.16);
    paint(() => { for (const [agent, place] of some) if (agent.radius_m * scale > size) dot(place, agent.radius_m * scale); }, style, 0.3);
    for (const [agent, [x, y]] of some) {
      if (!agent.hand_m || !learned) continue;
      const angle = world.turn(headings, learners, agent.index, at), length = Math.max(agent.hand_m * scale, many ? 5 : 9);
      c.save();
      c.translate(x, y);
      c.rotate(-angle);
      paint(() => {
        c.moveTo(0, 0);
        c.lineTo(-1.15 * length, 0.42 * length);
        c.lineTo(-0.85 * length, 0);
        c.lineTo(-1.15 * length, -0.42 * length);
        c.closePath();
      }, style);
      c.restore();
    }
    paint(() => { for (const [, place] of some) dot(place, learned || many ? size : 6); }, { fillStyle: style.fillStyle, strokeStyle: ink.raised, lineWidth: many ? 1 : 2 });
  }
  const struck = world.struck(stage, track, Math.round(at));
  paint(() => { for (const k of struck) dot(now[k], reach + 5); }, { strokeStyle: ink.alarm, fillStyle: null, lineWidth: 3 });

  // A bar that tells the scale.
  const bar = [50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05].find((length) => length * scale < width / 4) || 0.02;
  paint(() => { c.moveTo(16, height - 16); c.lineTo(16 + bar * scale, height - 16); }, { strokeStyle: ink.soft, fillStyle: null, lineWidth: 1.5 });
  c.font = `12px ${ink.font}`;
  c.fillStyle = ink.soft;
  c.fillText(`${bar} m`, 16, height - 23);
  return struck.size;
};
