// ---------------------------------------------------------------- the same without WebGL, on a plain canvas
class Flat {
  constructor(canvas) { this.context = canvas.getContext("2d"); this.origin = [0, 0, 0]; }
  begin(width, height, ground) {
    const c = this.context; this.height = height;
    c.setTransform(1, 0, 0, 1, 0, 0); c.globalAlpha = 1; c.fillStyle = this.tint(ground); c.fillRect(0, 0, width, height);
  }
  tint([r, g, b]) { return `rgb(${255 * r} ${255 * g} ${255 * b})`; }
  look(rect, camera) { this.rect = rect; this.camera = camera; }
  at(x, y, z) {
    const m = this.camera, w = m[3] * x + m[7] * y + m[11] * z + m[15], [left, below, width, height] = this.rect;
    if (w < .05) return null;
    const u = (m[0] * x + m[4] * y + m[8] * z + m[12]) / w, v = (m[1] * x + m[5] * y + m[9] * z + m[13]) / w;
    return [left + (u + 1) / 2 * width, this.height - below - (v + 1) / 2 * height, w];
  }
  stroke(p, q, tint, alpha, width, dash) {
    if (!p || !q) return;
    const c = this.context;
    c.strokeStyle = this.tint(tint); c.globalAlpha = alpha; c.lineWidth = width; c.setLineDash(dash ? [.6 * dash, .4 * dash] : []);
    c.beginPath(); c.moveTo(p[0], p[1]); c.lineTo(q[0], q[1]); c.stroke();
  }
  lines(lines) {
    const d = lines.data();
    for (let i = 0; i < d.length; i += 12)
      this.stroke(this.at(d[i], d[i + 1], d[i + 2]), this.at(d[i + 3], d[i + 4], d[i + 5]), d.subarray(i + 6, i + 9), d[i + 9], d[i + 10], d[i + 11]);
  }
  capsules(capsules) {
    const d = capsules.data(); this.context.lineCap = "round";
    for (let i = 0; i < d.length; i += 11) {
      const p = this.at(d[i], d[i + 1], d[i + 2]), q = this.at(d[i + 3], d[i + 4], d[i + 5]);
      if (p && q) this.stroke(p, q, d.subarray(i + 8, i + 11), 1, Math.max(1, (d[i + 6] + d[i + 7]) * this.camera.unit(p[2], this.rect[3])), 0);
    }
    this.context.lineCap = "butt";
  }
  points(held, tints, thick) {
    const c = this.context; c.globalAlpha = 1;
    let last = -1;
    for (let i = 0; i < held.count; i++) {
      const kind = held.short ? (held.data[i * 4 + 3] & 255) % 6 : 0;
      if (kind !== last) c.fillStyle = this.tint(tints[last = kind]);
      const [x, y, z] = [0, 1, 2].map(k => held.data[i * held.stride + k] / 100 + held.from_m[k] - this.origin[k]), p = this.at(x, y, z);
      if (p) c.fillRect(p[0], p[1], thick, thick);
    }
  }
  faces(held) {
    const c = this.context, d = held.data || [];
    for (let i = 0; i < d.length; i += 21) {
      const corners = [0, 7, 14].map(k => this.at(d[i + k], d[i + k + 1], d[i + k + 2]));
      if (corners.some(corner => !corner)) continue;
      c.globalAlpha = d[i + 6]; c.fillStyle = this.tint(d.subarray(i + 3, i + 6)); c.beginPath();
      corners.forEach(corner => c.lineTo(corner[0], corner[1])); c.fill();
    }
  }
  keep(list, floats) { return { data: list.data().slice(), count: list.count / floats }; }
}
