// ---------------------------------------------------------------- the hall: what stays
const degrees = Math.PI / 180;
const furnitureCorners = piece => {
  const [x, y] = piece.position_m, [l, w] = piece.size_m, a = piece.yaw_deg * degrees;
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i, j]) => {
    const dx = i * l / 2, dy = j * w / 2;
    return [x + dx * Math.cos(a) - dy * Math.sin(a), y + dx * Math.sin(a) + dy * Math.cos(a)];
  });
};
// Corners, bounds, middle and longest side of the hall.
function hallOf({ hall: { outline_m, length_m: l, width_m: w } }) {
  const corners = outline_m && outline_m.length ? outline_m : [[-l / 2, -w / 2], [l / 2, -w / 2], [l / 2, w / 2], [-l / 2, w / 2]];
  const [xs, ys] = [0, 1].map(i => corners.map(corner => corner[i]));
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  return { corners, x0, x1, y0, y1, x: (x0 + x1) / 2, y: (y0 + y1) / 2, edge: Math.max(x1 - x0, y1 - y0) };
}
// A simple polygon in triangles: ears are cut until none is left.
function triangles(corners) {
  const area = corners.reduce((sum, [x, y], i) => { const [u, v] = corners[(i + 1) % corners.length]; return sum + x * v - u * y; }, 0);
  const left = area < 0 ? [...corners].reverse() : [...corners], cut = [];
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  while (left.length > 2) {
    const n = left.length, at = i => left[(i + n) % n];
    let ear = left.findIndex((b, i) => { const [a, c] = [at(i - 1), at(i + 1)];
      return turn(a, b, c) > 0 && !left.some(p => p !== a && p !== b && p !== c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0); });
    if (ear < 0) ear = 0;
    cut.push([at(ear - 1), at(ear), at(ear + 1)]);
    left.splice(ear, 1);
  }
  return cut;
}
// Rotation of a sensor: its axes in the site, Z-Y'-X'', positive pitch looks down.
function axesOf({ rotation_deg: { yaw, pitch, roll } }) {
  const [cy, sy, cp, sp, cr, sr] = [yaw, pitch, roll].flatMap(a => [Math.cos(a * degrees), Math.sin(a * degrees)]);
  return [[cy * cp, sy * cp, -sp], [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr], [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr]];
}
// How far a ray goes from within the hall until floor, ceiling or a wall.
function reach(site, corners, [x, y, z], [dx, dy, dz], most) {
  let far = most;
  if (dz < 0) far = Math.min(far, -z / dz);
  if (dz > 0) far = Math.min(far, (site.hall.height_m - z) / dz);
  corners.forEach(([ax, ay], i) => {
    const [bx, by] = corners[(i + 1) % corners.length], [ex, ey] = [bx - ax, by - ay], turned = dx * ey - dy * ex;
    if (Math.abs(turned) < 1e-9) return;
    const t = ((ax - x) * ey - (ay - y) * ex) / turned, s = ((ax - x) * dy - (ay - y) * dx) / turned;
    if (t > .05 && s >= 0 && s <= 1) far = Math.min(far, t);
  });
  return Math.max(far, 0);
}
// Where the lowest and the highest beam of a sensor meet the hall, all round.
function fieldOf(site, sensor, elevations_deg) {
  const axes = axesOf(sensor), { corners } = hallOf(site);
  return elevations_deg.map(elevation => Array.from({ length: 73 }, (_, k) => {
    const turn = k * 5 * degrees, [c, s] = [Math.cos(elevation * degrees), Math.sin(elevation * degrees)];
    const own = [Math.cos(turn) * c, Math.sin(turn) * c, s];
    const way = [0, 1, 2].map(i => axes[0][i] * own[0] + axes[1][i] * own[1] + axes[2][i] * own[2]);
    return plus(sensor.position_m, times(way, reach(site, corners, sensor.position_m, way, sensor.range_max_m)));
  }));
}
// Whether pillars or furniture cut a link, for methods that do not look.
function cut(site, a, b) {
  const d = minus(b, a);
  const through = (boxed, low, high) => {   // by slabs
    let [from, to] = [0, 1];
    for (let i = 0; i < 3; i++) {
      const [p, w] = [boxed[0][i], boxed[1][i]];
      if (Math.abs(w) < 1e-9) { if (p < low[i] || p > high[i]) return false; continue; }
      const [s, t] = [(low[i] - p) / w, (high[i] - p) / w];
      from = Math.max(from, Math.min(s, t)); to = Math.min(to, Math.max(s, t));
    }
    return from < to;
  };
  const by_pillar = site.pillars.some(({ position_m: [x, y], radius_m }) => {
    const flat = d[0] * d[0] + d[1] * d[1] || 1, t = Math.min(1, Math.max(0, ((x - a[0]) * d[0] + (y - a[1]) * d[1]) / flat));
    return Math.hypot(a[0] + t * d[0] - x, a[1] + t * d[1] - y) < radius_m;
  });
  return by_pillar || site.furniture.some(({ position_m: [x, y], size_m: [l, w, h], yaw_deg }) => {
    const [c, s] = [Math.cos(yaw_deg * degrees), Math.sin(yaw_deg * degrees)], own = ([u, v, z]) => [u * c + v * s, v * c - u * s, z];
    return through([own([a[0] - x, a[1] - y, a[2]]), own(d)], [-l / 2, -w / 2, 0], [l / 2, w / 2, h]);
  });
}

// Faces and lines of all that stays; made once a site and theme.
class Stays {
  constructor(draws, site, origin, fields, before) {
    const { corners, x0, x1, y0, y1 } = hallOf(site), h = site.hall.height_m;
    const faces = new Floats(origin), lines = this.lines = new Floats(origin), seen = new Floats(origin);
    const [floor, thing, line, faint] = ["floor", "thing", "line", "faint"].map(tintOf);
    triangles(corners).forEach(t => faces.face(t.map(p => [...p, -.02]), floor));
    (site.hall.floors || []).forEach(f => { const [[x, y]] = f.outline_m, [dx, dy] = f.slope || [0, 0];
      const lifted = p => [...p, f.height_m + dx * (p[0] - x) + dy * (p[1] - y)];
      triangles(f.outline_m).forEach(t => faces.face(t.map(lifted), thing.map((v, i) => (v + floor[i]) / 2)));
      f.outline_m.forEach((a, i) => lines.line(lifted(a), lifted(f.outline_m[(i + 1) % f.outline_m.length]), line)); });
    corners.forEach((a, i) => { const b = corners[(i + 1) % corners.length];
      lines.line([...a, 0], [...b, 0], faint, 2); lines.line([...a, h], [...b, h], [...line, .6]); lines.line([...a, 0], [...a, h], [...line, .8]); });
    // Lines every two metres, each between the walls that it crosses.
    for (const i of [0, 1]) { const [from, to] = i ? [y0, y1] : [x0, x1];
      for (let at = Math.ceil(from / 2) * 2; at <= to; at += 2) {
        const meets = corners.flatMap((a, k) => { const b = corners[(k + 1) % corners.length];
          return (a[i] > at) === (b[i] > at) ? [] : [a[1 - i] + (at - a[i]) / (b[i] - a[i]) * (b[1 - i] - a[1 - i])]; }).sort((a, b) => a - b);
        for (let k = 0; k + 1 < meets.length; k += 2) lines.line(...[meets[k], meets[k + 1]].map(v => i ? [v, at, 0] : [at, v, 0]), [...line, .55]);
      } }
    const solid = (base, top) => {
      faces.face(base.map(p => [...p, top]), thing);
      base.forEach((a, i) => { const b = base[(i + 1) % base.length], side = .72 + .16 * Math.cos(Math.atan2(b[1] - a[1], b[0] - a[0]));
        faces.face([[...a, 0], [...b, 0], [...b, top], [...a, top]], thing.map(v => v * side)); });
    };
    site.furniture.forEach(piece => solid(furnitureCorners(piece), piece.size_m[2]));
    site.pillars.forEach(({ position_m: [x, y], radius_m: r }) => solid(
      Array.from({ length: 20 }, (_, k) => [x + r * Math.cos(k * .1 * Math.PI), y + r * Math.sin(k * .1 * Math.PI)]), h));
    this.fields = new Floats(origin);
    const hues = SENSORS[dark() ? 1 : 0];
    fields.forEach((field, number) => { const sensor = site.sensors[number], hue = hues[number % hues.length];
      if (!field) return;
      const [low, high] = fieldOf(site, sensor, field);
      low.forEach((p, k) => { if (k + 1 < low.length) seen.face([p, low[k + 1], high[k + 1], high[k]], [...hue, .13]); });
      this.fields.way(low, [...hue, .9], 1.5); this.fields.way(high, [...hue, .9], 1.5, 8);
      low.forEach((p, k) => { if (k % 9 === 0) this.fields.line(sensor.position_m, p, [...hue, .35]); }); });
    this.faces = draws.keep(faces, 7, before && before.faces); this.seen = draws.keep(seen, 7, before && before.seen);
  }
}
// Sensors are told apart by colour in the whole scan; names stand beside them.
const SENSORS = [[[.1, .45, .75], [.8, .4, .1], [.45, .3, .7], [.1, .55, .45], [.7, .25, .45], [.4, .4, .4]],
  [[.4, .72, 1], [1, .68, .35], [.75, .62, 1], [.4, .85, .72], [1, .55, .75], [.7, .7, .7]]];
const dark = () => tintOf("ground")[0] < .5;
