// ---------------------------------------------------------------- camera
const product = (a, b) => { const m = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let k = 0; k < 4; k++) for (let n = 0; n < 4; n++) m[4 * i + k] += b[4 * i + n] * a[4 * n + k];
  return m; };
const minus = (a, b) => a.map((x, i) => x - b[i]), plus = (a, b) => a.map((x, i) => x + b[i]), times = (a, s) => a.map(x => x * s);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => times(a, 1 / (Math.hypot(...a) || 1));

// Looks at `aim` from `away` metres; from above without perspective where `flat`; from a place of its own where `eye`.
class Camera {
  constructor() { Object.assign(this, { aim: [0, 0, 1], turn: -.65, tilt: .62, away: 30, flat: false, eye: null, lens: .7 }); }
  // Of a picture so wide and high, relative to an origin.
  matrix(width, height, origin) {
    const ratio = width / height;
    let from, ahead, up;
    if (this.eye) { ({ from, ahead, up } = this.eye); }
    else {
      const tilt = this.flat ? Math.PI / 2 : this.tilt, turn = this.flat ? 0 : this.turn;
      ahead = [Math.sin(-turn) * Math.cos(tilt), Math.cos(turn) * Math.cos(tilt), -Math.sin(tilt)];
      up = [Math.sin(-turn) * Math.sin(tilt), Math.cos(turn) * Math.sin(tilt), Math.cos(tilt)];
      from = minus(this.aim, times(ahead, this.away));
    }
    const right = unit(cross(ahead, up)), top = cross(right, ahead), at = minus(from, origin);
    const view = [right[0], top[0], -ahead[0], 0, right[1], top[1], -ahead[1], 0, right[2], top[2], -ahead[2], 0,
      -dot(right, at), -dot(top, at), dot(ahead, at), 1];
    const near = .1, far = 4 * this.away + 400, flat = this.flat && !this.eye;
    const [wide, high] = this.spread(ratio), half = this.away * Math.tan(this.lens / 2), s = 1 / Math.tan((this.eye ? 1.25 : this.lens) / 2);
    const lensed = flat
      ? [1 / half / wide, 0, 0, 0, 0, 1 / half / high, 0, 0, 0, 0, -1 / far, 0, 0, 0, 0, 1]
      : [s / wide, 0, 0, 0, 0, s / high, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, 2 * near * far / (near - far), 0];
    const m = product(lensed, view);
    m.unit = (w, pixels) => lensed[5] * pixels / 2 / w;   // pixels of a metre at that depth
    this.seen = { m, width, height, origin, ratio };
    return m;
  }
  // Half the picture's width and height; the smaller is 1.
  spread(ratio) { return [Math.max(ratio, 1), Math.max(1 / ratio, 1)]; }
  // Where a place is in the last picture, pixels from its left upper corner; none behind the camera.
  project(x, y, z) {
    const { m, width, height, origin } = this.seen; x -= origin[0]; y -= origin[1]; z -= origin[2];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    if (w < .05) return null;
    return [((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) / 2 * width, (1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) / 2 * height, w];
  }
  // The place at height z below a pixel of the last picture. From above only.
  ground(u, v) {
    const { width, height, ratio } = this.seen, half = this.away * Math.tan(this.lens / 2);
    const [wide, high] = times(this.spread(ratio), half);
    return [this.aim[0] + (2 * u / width - 1) * wide, this.aim[1] + (1 - 2 * v / height) * high];
  }
  // So far away that a box is seen whole.
  hold([x0, y0, x1, y1], width, height, slow = 1) {
    const ratio = width / height, tilt = this.flat ? Math.PI / 2 : this.tilt, [turn, t] = [this.flat ? 0 : this.turn, Math.tan(this.lens / 2)];
    const [dx, dy] = [x1 - x0, y1 - y0], [c, s] = [Math.abs(Math.cos(turn)), Math.abs(Math.sin(turn))];
    const wide = dx * c + dy * s, deep = dx * s + dy * c, high = deep * Math.sin(tilt) + 2 * Math.cos(tilt);
    const [across, up] = times(this.spread(ratio), t);
    const away = Math.max(wide / 2 / across, high / 2 / up) + (this.flat ? 0 : deep / 4 * Math.cos(tilt));
    const aim = [(x0 + x1) / 2, (y0 + y1) / 2, this.flat ? 0 : .8], to = (from, where) => from + (where - from) * slow;
    this.aim = this.aim.map((m, i) => to(m, aim[i])); this.away = to(this.away, Math.max(away * 1.05, 2));
  }
}
