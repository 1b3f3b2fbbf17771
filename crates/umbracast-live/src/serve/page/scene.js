// ---------------------------------------------------------------- the view: hall, people and links in one picture
const DASH = { clear: 0, warning: 16, blocked: 7 };
const WIDTH = { clear: 1, warning: 2.6, blocked: 4 };
const scheme = { scan: "foreground", fields: false, way: "fit" };

class Scene {
  constructor(canvas, overlay) {
    Object.assign(this, { canvas, overlay, camera: new Camera(), follows: true, rects: [], scan: null, cloud: null, extra: null });
    this.lettering = overlay.getContext("2d");
    try { this.draws = new Gl(canvas); } catch { this.draws = new Flat(canvas); document.body.dataset.flat = "1"; }
  }
  site(about) {
    const { x, y } = hallOf(site);
    this.origin = this.draws.origin = [Math.round(x), Math.round(y), 0];
    this.fields = about.fields_deg || [];
    [this.floats, this.bodies, this.marks, this.over] = [0, 0, 0, 0].map(() => new Floats(this.origin));
    this.themed();
  }
  themed() { this.stays = new Stays(this.draws, site, this.origin, this.fields, this.stays); }
  fit() {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    for (const c of [this.canvas, this.overlay]) {
      const [w, h] = [c.clientWidth, c.clientHeight].map(v => Math.max(1, Math.round(v * scale)));
      if (c.width !== w) c.width = w; if (c.height !== h) c.height = h;
    }
    this.scale = scale;
  }
  // One picture of each frame, side by side.
  draw(frames, ahead_s) {
    this.fit();
    const { width, height } = this.canvas, each = Math.floor(width / frames.length);
    this.draws.begin(width, height, tintOf("sky"));
    this.lettering.clearRect(0, 0, width, height);
    this.rects = frames.map((_, i) => [i * each, 0, each, height]);
    frames.forEach((frame, i) => this.one(frame, this.rects[i], ahead_s));
  }
  one(frame, rect, ahead_s) {
    const [left, , width, height] = rect, { camera, floats, bodies, marks, over, stays, draws, scale } = this;
    draws.look(rect, camera.matrix(width, height, this.origin));
    [floats, bodies, marks, over].forEach(list => list.clear());
    draws.faces(stays.faces); draws.lines(stays.lines);
    if (this.extra) this.extra.below(draws);
    const hues = SENSORS[dark() ? 1 : 0];
    if (scheme.scan === "whole" && this.scan) draws.points(this.scan, hues, (camera.flat ? 1.2 : 1.6) * scale);
    if (frame && scheme.scan === "foreground") draws.points(this.foreground(frame), Array(6).fill(tintOf("point")), 2 * scale);
    if (frame) this.people(frame, ahead_s);
    this.devices();
    draws.capsules(bodies); draws.lines(floats); draws.lines(marks);
    if (scheme.fields) { draws.lines(stays.fields); draws.faces(stays.seen, true); }
    draws.lines(over, true);
    this.letters(frame, left, width, height);
  }
  // Points of a frame where they are drawn from; the same are not handed over again.
  foreground({ points_cm = [] }) {
    const { cloud } = this;
    if (cloud && cloud.of === points_cm) return cloud;
    const [x, y] = this.origin, data = Int32Array.from(points_cm, (cm, i) => i % 3 === 0 ? cm - 100 * x : i % 3 === 1 ? cm - 100 * y : cm);
    return this.cloud = this.held(data, 3, this.origin, cloud && cloud.buffer, points_cm);
  }
  held(data, stride, from_m, buffer, of) {
    return { data, stride, short: stride === 4, from_m, of, count: Math.floor(data.length / stride), buffer: this.draws.buffer && this.draws.buffer(data, buffer || undefined) };
  }
  // The whole scan as the server sends it: frame, origin, then x y z in centimetres of 16 bits, sensor, reflectivity.
  whole(bytes) {
    const head = new DataView(bytes), from_m = [8, 16, 24].map(at => head.getFloat64(at, true));
    this.scan = this.held(new Int16Array(bytes, 32), 4, from_m, this.scan && this.scan.buffer, bytes);
  }
  people(frame, ahead_s) {
    const { floats, bodies, marks, over, scale } = this, person = tintOf("person"), chosen = tintOf("ink");
    frame.placed = new Map();
    for (const t of frame.tracks) {
      if (!t.confirmed) continue;
      const [x, y] = [t.x_m + t.vx_mps * ahead_s, t.y_m + t.vy_mps * ahead_s], floor = floorOf(t), pace = paceOf(t, frame.time_ns / 1e9 + ahead_s);
      frame.placed.set(t.track, [x, y, floor]);
      figure(bodies, { x, y, floor, heading: t.heading_rad, height: t.height_m, wide: t.width_scale, ...pace }, person);
      for (const k of [3, 6, 9]) marks.way(ellipse(t, k, floor + .02), [...person, .95 - k * .07], 1.1 * scale);
      if (t.track === picked) over.way(ring(x, y, floor + .03, .55), [...chosen, 1], 2.5 * scale);
    }
    for (const body of (frame.truth && scheme.truth ? frame.truth.people : []))
      over.way(ring(body.x_m, body.y_m, .03, .3), [...tintOf("truth"), 1], 2 * scale, 6 * scale);
    const looks = [...frame.looks.values()].sort((a, b) => RANK[b.state] - RANK[a.state]);
    for (const { ap, track, state, decision } of looks) {
      if (!ap || !track || !frame.placed.has(track.track)) continue;
      const ue = plus(ueOf(track), [track.vx_mps * ahead_s, track.vy_mps * ahead_s, 0]), dim = picked != null && picked !== track.track;
      floats.line(ap.position_m, ue, [...tintOf(state), (state === "clear" ? .45 : 1) * (dim ? .3 : 1)], WIDTH[state] * scale, DASH[state] * scale);
      const target = decision && decision.target && site.access_points.find(a => a.name === decision.target);
      if (target) over.line(target.position_m, ue, [...person, 1], 3 * scale, 4 * scale);   // where to
    }
  }
  devices() {
    const { bodies, origin } = this, post = tintOf("faint");
    site.access_points.forEach(({ position_m: [x, y, z] }) => {
      bodies.capsule([x - .12, y, z], [x + .12, y, z], .09, .09, tintOf("ink")); bodies.capsule([x, y, z + .05], [x, y, z + .4], .025, .02, tintOf("ink"));
      this.marks.line([x, y, 0], [x, y, z], [...post, .5], 1, 5 * this.scale); });
    site.sensors.forEach((sensor, i) => { const p = sensor.position_m, hues = SENSORS[dark() ? 1 : 0];
      bodies.capsule(p, plus(p, times(axesOf(sensor)[2], .16)), .13, .13, hues[i % hues.length]);
      this.marks.line(p, plus(p, times(axesOf(sensor)[0], .6)), hues[i % hues.length], 2.5 * this.scale);
      this.marks.line([p[0], p[1], 0], p, [...post, .5], 1, 5 * this.scale); });
  }
  letters(frame, left, width, height) {
    const c = this.lettering, { camera, scale } = this, taken = [];
    c.font = `600 ${11.5 * scale}px system-ui, sans-serif`; c.textAlign = "center"; c.lineJoin = "round";
    const place = (text, at, up, tint, mark = false, must = false) => {
      const p = camera.project(...at);
      if (!p || p[0] < 0 || p[0] > width || p[1] < 0 || p[1] > height) return;
      const half = c.measureText(text).width / 2 + 3 * scale, u = Math.min(Math.max(p[0], half), width - half), v = Math.max(p[1] - up * scale, 12 * scale);
      const box = [u - half, v - 10 * scale, u + half, v + 4 * scale];
      if (!must && taken.some(b => b[0] < box[2] && box[0] < b[2] && b[1] < box[3] && box[1] < b[3])) return;
      taken.push(box);
      c.fillStyle = tint;
      // A diamond and a square, as in reports.
      if (mark === "ap") { const r = 6 * scale; c.beginPath(); c.moveTo(left + p[0], p[1] - r); c.lineTo(left + p[0] + r, p[1]); c.lineTo(left + p[0], p[1] + r); c.lineTo(left + p[0] - r, p[1]); c.closePath(); c.fillStyle = "#f0e442"; c.fill(); c.strokeStyle = "#1f242b"; c.lineWidth = 1.3 * scale; c.stroke(); c.fillStyle = tint; }
      if (mark === "sensor") c.fillRect(left + p[0] - 4 * scale, p[1] - 4 * scale, 8 * scale, 8 * scale);
      c.strokeStyle = css("sky"); c.lineWidth = 3 * scale; c.strokeText(text, left + u, v); c.fillText(text, left + u, v);
    };
    c.save(); c.beginPath(); c.rect(left, 0, width, height); c.clip();
    site.access_points.forEach(ap => place(ap.name, ap.position_m, 12, css("ink"), "ap", true));
    site.sensors.forEach(s => place(s.name, s.position_m, 13, css("faint"), "sensor", true));
    if (frame) {
      for (const t of frame.tracks) if (frame.placed.has(t.track)) { const [x, y, z] = frame.placed.get(t.track);
        place(String(t.track), [x, y, z + t.height_m], 8, css(t.track === picked ? "person" : "ink"), false, true); }
      let told = 0;
      for (const look of [...frame.looks.values()].sort((a, b) => RANK[a.state] - RANK[b.state])) {
        const { ap, track, state, cause, loss } = look;
        if (!ap || !track || (state === "clear" && track.track !== picked) || told++ > 30) continue;
        const text = [loss ? dB(loss).now : "", state === "blocked" ? "by " + cause : ""].filter(Boolean).join(" ");
        if (text) place(text, ap.position_m.map((m, i) => m + .62 * (ueOf(track)[i] - m)), 4, css(state));
      }
    }
    if (camera.flat && !camera.eye) {     // scale bar
      const length = [1, 2, 5, 10, 20, 50].find(m => m * camera.seen.m.unit(1, height) > 60 * scale) || 100, long = length * camera.seen.m.unit(1, height);
      c.fillStyle = css("ink"); c.fillRect(left + 12 * scale, height - 12 * scale, long, 2 * scale); c.textAlign = "left";
      c.fillText(length + " m", left + 12 * scale, height - 18 * scale);
    }
    if (this.rects.length > 1 && frame) { c.textAlign = "center"; c.fillStyle = css("ink"); c.fillText(frame.mode || "", left + width / 2, 18 * scale);
      if (left) c.fillRect(left, 0, scale, height); }
    if (this.extra && this.extra.letters) this.extra.letters(c, camera, scale);
    c.restore();
  }
  // The camera goes where it was told to, without a jerk.
  steer(frame) {
    const { camera } = this, hall = hallOf(site), width = this.rects.length ? this.rects[0][2] : this.canvas.clientWidth, height = this.canvas.clientHeight * (this.scale || 1);
    const slow = this.fresh ? 1 : .08;
    if (scheme.way === "eye") { const sensor = site.sensors[scheme.eye % site.sensors.length], axes = axesOf(sensor);
      camera.eye = { from: plus(sensor.position_m, times(axes[0], .3)), ahead: axes[0], up: axes[2] }; this.fresh = false; return; }
    camera.eye = null;
    if (scheme.way === "own") return;
    if (scheme.way === "follow" && frame) {
      const t = frame.tracks.find(t => t.track === picked) || frame.tracks.find(t => t.confirmed);
      if (!t) return;
      camera.flat = false; camera.aim = camera.aim.map((m, i) => m + ([t.x_m, t.y_m, 1.1][i] - m) * (this.fresh ? 1 : .12));
      camera.away += (7 - camera.away) * (this.fresh ? 1 : .08); camera.tilt += (.45 - camera.tilt) * .08;
      if (Math.hypot(t.vx_mps, t.vy_mps) > .3) { const want = t.heading_rad - Math.PI / 2, away = Math.atan2(Math.sin(want - camera.turn), Math.cos(want - camera.turn)); camera.turn += away * (this.fresh ? 1 : .03); }
      this.fresh = false; return;
    }
    let box = [hall.x0 - .5, hall.y0 - .5, hall.x1 + .5, hall.y1 + .5];
    if (frame && scheme.way !== "corner" && scheme.whole !== true) {
      const people = frame.tracks.filter(t => t.confirmed);
      if (people.length) {
        const [x0, y0, x1, y1] = [Math.min(...people.map(t => t.x_m)) - 2, Math.min(...people.map(t => t.y_m)) - 2, Math.max(...people.map(t => t.x_m)) + 2, Math.max(...people.map(t => t.y_m)) + 2];
        const grow = Math.max(0, 7 - Math.max(x1 - x0, y1 - y0)) / 2;
        box = [x0 - grow, y0 - grow, x1 + grow, y1 + grow];
      }
      // It grows at once and shrinks slowly, so that nobody who walks moves the picture.
      const now = this.box && !this.fresh ? this.box.map((v, i) => (i < 2 ? box[i] < v : box[i] > v) ? v + (box[i] - v) * .2 : v + (box[i] - v) * .02) : box;
      box = this.box = now;
    }
    camera.hold(box, width, height, slow); if (frame || scheme.way === "corner") this.fresh = false;
  }
  // Who stands under a pixel of the page's picture.
  at(u, v, frame) {
    const each = this.canvas.clientWidth / Math.max(this.rects.length, 1);
    if (!frame || !this.camera.seen) return null;
    const near = [...(frame.placed || [])].map(([track, [x, y, z]]) => { const p = this.camera.project(x, y, z + .9);
      return p ? [Math.hypot(p[0] / this.scale - u % each, p[1] / this.scale - v), track] : [Infinity, track]; }).sort((a, b) => a[0] - b[0])[0];
    return near && near[0] < 34 ? near[1] : null;
  }
}
const ring = (x, y, z, r) => Array.from({ length: 25 }, (_, i) => [x + r * Math.cos(i / 12 * Math.PI), y + r * Math.sin(i / 12 * Math.PI), z]);
const dB = loss => {
  const at = k => [10, 50, 90].map(q => loss[k === 0 ? `loss_now_p${q}_db` : `loss_s${k}_p${q}_db`]);
  const all = [...Array(10).keys()].map(at), worst = all.reduce((a, b) => b[1] > a[1] ? b : a), whole = x => Math.round(x) || 0;
  return { now: `${whole(all[0][1])} dB`, text: `${whole(all[0][1])} .. ${whole(worst[1])} dB`,
    title: `now ${whole(all[0][0])} to ${whole(all[0][2])} dB, at the most ${whole(worst[0])} to ${whole(worst[2])} dB (10 to 90 %)` };
};
// Drag turns or shifts, wheel and two fingers come nearer.
function steerable(scene, touched, clicked) {
  const fingers = new Map(); let moved = 0;
  const c = scene.overlay;
  c.onpointerdown = event => { c.setPointerCapture(event.pointerId); fingers.set(event.pointerId, [event.clientX, event.clientY]); moved = 0; };
  c.onpointermove = event => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]], { camera } = scene;
    if (fingers.size === 2) {
      const [other] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
      const [was, is] = [Math.hypot(before[0] - other[0], before[1] - other[1]), Math.hypot(event.clientX - other[0], event.clientY - other[1])];
      if (is > 5) camera.away = Math.min(400, Math.max(1.5, camera.away * was / is));
    } else {
      moved += Math.abs(dx) + Math.abs(dy);
      const per = 1 / (camera.seen.m.unit(camera.away, camera.seen.height) / scene.scale || 1);
      if (camera.flat || event.shiftKey || event.buttons & 4) {
        const [s, k] = camera.flat ? [0, 1] : [Math.sin(camera.turn), Math.cos(camera.turn)];
        camera.aim = plus(camera.aim, [(-dx * k - dy * s) * per, (-dx * s + dy * k) * per, 0]);
      } else { camera.turn -= dx * .007; camera.tilt = Math.min(1.55, Math.max(.03, camera.tilt + dy * .007)); }
    }
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (moved > 4) touched();
  };
  c.onpointerup = event => { fingers.delete(event.pointerId);
    if (moved <= 4) clicked(event.offsetX, event.offsetY); };
  c.onpointercancel = event => fingers.delete(event.pointerId);
  c.addEventListener("wheel", event => { event.preventDefault();
    scene.camera.away = Math.min(400, Math.max(1.5, scene.camera.away * Math.exp(event.deltaY * .001))); touched(); }, { passive: false });
}
