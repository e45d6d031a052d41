// Recorded episodes as numbers over time. A time is a frame with its fraction.
mpgx.tracks = ({ blocks, tracks }) => {
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

  // The value of a column at a time, between frames on a line.
  const mix = (values, width, index, time) => {
    const last = values.length / width - 1;
    const from = Math.max(0, Math.min(last, Math.floor(time))), to = Math.min(last, from + 1), share = Math.min(1, Math.max(0, time - from));
    const a = values[from * width + index];
    return a + share * (values[to * width + index] - a);
  };
  const turn = (values, width, index, time) => {
    const last = values.length / width - 1;
    const from = Math.min(last, Math.floor(time)), to = Math.min(last, from + 1);
    const a = values[from * width + index], b = values[to * width + index];
    return a + (time - from) * Math.atan2(Math.sin(b - a), Math.cos(b - a));
  };

  // The track of a method; controllers have one seed that stands for all.
  const find = (stage, method, episode, seed) => {
    const fits = (track) => track.protocol === stage && track.method === method && track.episode === episode;
    return tracks.find((track) => fits(track) && track.seed === seed) || tracks.find(fits);
  };

  // The agents of a stage with the columns they have in a track.
  const actors = (stage, track) => {
    const counts = { scripted: 0, learned: 0 };
    const all = stage.agents.map((agent) => ({ ...agent, index: counts[agent.learned ? 'learned' : 'scripted']++, values: numbers(agent.learned ? track.learned : track.scripted) }));
    for (const agent of all) agent.width = 2 * counts[agent.learned ? 'learned' : 'scripted'];
    return all;
  };
  const x = (agent, time) => mix(agent.values, agent.width, 2 * agent.index, time);
  const y = (agent, time) => mix(agent.values, agent.width, 2 * agent.index + 1, time);

  // How far a point is from the outline of an obstacle, below 0 inside.
  const beyond = ({ solid }, dx, dy) => {
    if (solid.Disc) return Math.hypot(dx, dy) - solid.Disc.radius_m;
    const corners = solid.Segment ? [[0, 0], solid.Segment.to_m] : solid.Polygon.corners_m;
    let least = Infinity, inside = false;
    corners.forEach(([ax, ay], k) => {
      const [bx, by] = corners[(k + 1) % corners.length], length = (bx - ax) ** 2 + (by - ay) ** 2;
      const share = length ? Math.min(1, Math.max(0, ((dx - ax) * (bx - ax) + (dy - ay) * (by - ay)) / length)) : 0;
      least = Math.min(least, Math.hypot(dx - ax - share * (bx - ax), dy - ay - share * (by - ay)));
      if ((ay > dy) !== (by > dy) && dx < ((bx - ax) * (dy - ay)) / (by - ay) + ax) inside = !inside;
    });
    return inside && solid.Polygon ? -least : least;
  };

  // Agents that collide or touch an obstacle at a frame.
  const struck = (stage, track, frame) => {
    const out = new Set(), all = actors(stage, track);
    const bodies = all.map((agent, k) => ({ agent, k, x: x(agent, frame), y: y(agent, frame) }));
    const agents = bodies.filter(({ agent }) => !agent.solid), obstacles = bodies.filter(({ agent }) => agent.solid);
    if (track.collisions.includes(frame)) {
      agents.forEach((a, i) => agents.slice(i + 1).forEach((b) => {
        if (Math.hypot(a.x - b.x, a.y - b.y) < stage.safety_m * 1.02) { out.add(a.k); out.add(b.k); }
      }));
    }
    for (const a of agents) for (const o of obstacles) {
      if (a.agent.learned && beyond(o.agent, a.x - o.x, a.y - o.y) <= a.agent.radius_m + 0.001) out.add(a.k);
    }
    return out;
  };
  // Frames with anything struck, for the strip below the picture.
  const strikes = (stage, track) => {
    if (!track.strikes) {
      track.strikes = stage.agents.some((agent) => agent.solid)
        ? Array.from({ length: track.frames }, (_, frame) => frame).filter((frame) => struck(stage, track, frame).size)
        : track.collisions;
    }
    return track.strikes;
  };
  // The least distance of an agent's body from an obstacle at each frame after the start, m; nothing without obstacles.
  const clearance = (stage, track) => {
    const all = actors(stage, track), obstacles = all.filter((agent) => agent.solid), agents = all.filter((agent) => agent.learned);
    if (!obstacles.length || !agents.length) return null;
    return Float32Array.from({ length: track.frames - 1 }, (_, k) => {
      let least = Infinity;
      for (const o of obstacles) for (const a of agents) least = Math.min(least, beyond(o, x(a, k + 1) - x(o, k + 1), y(a, k + 1) - y(o, k + 1)) - a.radius_m);
      return least;
    });
  };
  return { clearance, numbers, mix, turn, find, actors, x, y, struck, strikes };
};
