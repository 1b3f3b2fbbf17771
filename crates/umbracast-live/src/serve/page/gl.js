// ---------------------------------------------------------------- WebGL: faces that stay, points, capsules, thick lines
// Everything is drawn relative to an origin, so that a map in UTM keeps its centimetres in 32 bits.
const SHADERS = {
  lines: [`
layout(location=0) in vec2 corner; layout(location=1) in vec3 a; layout(location=2) in vec3 b;
layout(location=3) in vec4 tint; layout(location=4) in vec2 look;
uniform mat4 camera; uniform vec2 size; out vec4 v_tint; out vec3 v_dash;
void main() {
  vec4 p = camera * vec4(a, 1.), q = camera * vec4(b, 1.); float near = .05;
  gl_Position = vec4(2., 2., 2., 1.); v_tint = tint; v_dash = vec3(0.);
  if (p.w < near && q.w < near) return;
  if (p.w < near) p = mix(q, p, (q.w - near) / (q.w - p.w));
  if (q.w < near) q = mix(p, q, (p.w - near) / (p.w - q.w));
  vec2 way = (q.xy / q.w - p.xy / p.w) * size * .5; float far = length(way);
  vec2 along = far > 0. ? way / far : vec2(1., 0.);
  vec4 at = corner.x < .5 ? p : q;
  at.xy += vec2(-along.y, along.x) * corner.y * look.x / size * at.w;
  gl_Position = at; v_dash = vec3(corner.x * far * at.w, at.w, look.y);
}`, `
in vec4 v_tint; in vec3 v_dash; out vec4 tint;
void main() { if (v_dash.z > 0. && fract(v_dash.x / v_dash.y / v_dash.z) > .6) discard; tint = v_tint; }`],
  points: [`
layout(location=0) in vec3 at; layout(location=1) in float kind;
uniform mat4 camera; uniform vec4 place; uniform vec3 tints[6]; uniform float thick; out vec3 v_tint;
void main() { gl_Position = camera * vec4(at * place.w + place.xyz, 1.); gl_PointSize = thick;
  v_tint = tints[int(mod(kind, 6.))]; }`, `
in vec3 v_tint; out vec4 tint; void main() { tint = vec4(v_tint, 1.); }`],
  capsules: [`
layout(location=0) in vec4 shape; layout(location=1) in vec3 a; layout(location=2) in vec3 b;
layout(location=3) in vec2 thick; layout(location=4) in vec3 tint;
uniform mat4 camera; out vec3 v_tint;
void main() {
  vec3 way = b - a; float far = length(way);
  vec3 z = far > 1e-5 ? way / far : vec3(0., 0., 1.);
  vec3 x = normalize(cross(abs(z.z) < .9 ? vec3(0., 0., 1.) : vec3(1., 0., 0.), z)), y = cross(z, x);
  vec3 out_ = x * shape.x + y * shape.y + z * shape.z;
  gl_Position = camera * vec4(mix(a, b, shape.w) + out_ * mix(thick.x, thick.y, shape.w), 1.);
  v_tint = tint * (.62 + .38 * max(dot(out_, normalize(vec3(.4, -.5, .8))), 0.));
}`, `
in vec3 v_tint; out vec4 tint; void main() { tint = vec4(v_tint, 1.); }`],
  faces: [`
layout(location=0) in vec3 at; layout(location=1) in vec4 tint; uniform mat4 camera; out vec4 v_tint;
void main() { gl_Position = camera * vec4(at, 1.); v_tint = tint; }`, `
in vec4 v_tint; out vec4 tint; void main() { tint = v_tint; }`],
};

class Gl {
  constructor(canvas) {
    // Where software draws, edges are left as they are: smooth ones cost several times as much.
    const probe = document.createElement("canvas").getContext("webgl2"), about = probe && probe.getExtension("WEBGL_debug_renderer_info");
    this.soft = !!about && /swiftshader|llvmpipe|software/i.test(probe.getParameter(about.UNMASKED_RENDERER_WEBGL));
    if (probe) probe.getExtension("WEBGL_lose_context")?.loseContext();
    const gl = this.gl = canvas.getContext("webgl2", { antialias: !this.soft, alpha: false });
    if (!gl) throw new Error("no WebGL2");
    this.origin = [0, 0, 0];
    this.programs = {};
    for (const [name, [vertex, fragment]] of Object.entries(SHADERS)) this.programs[name] = this.program(vertex, fragment);
    this.quad = this.buffer(new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]));
    this.shape = this.capsule(this.soft ? 7 : 10);
    this.moving = gl.createBuffer();
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }
  program(vertex, fragment) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    const places = {}, count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; i++) { const { name } = gl.getActiveUniform(made, i); places[name.replace("[0]", "")] = gl.getUniformLocation(made, name); }
    return { made, places };
  }
  buffer(data, held = this.gl.createBuffer()) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, held); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    return held;
  }
  // A unit sphere cut at its equator: directions, and the end that each belongs to.
  capsule(around) {
    const rings = [[-1, 0], [-.7, 0], [0, 0], [0, 1], [.7, 1], [1, 1]], corners = [];
    const corner = ([z, end], k) => { const r = Math.sqrt(1 - z * z), turn = k / around * 2 * Math.PI;
      return [r * Math.cos(turn), r * Math.sin(turn), z, end]; };
    for (let i = 0; i + 1 < rings.length; i++) for (let k = 0; k < around; k++) {
      const [p, q, r, s] = [corner(rings[i], k), corner(rings[i], k + 1), corner(rings[i + 1], k), corner(rings[i + 1], k + 1)];
      corners.push(...p, ...q, ...r, ...q, ...s, ...r);
    }
    return { held: this.buffer(new Float32Array(corners)), count: corners.length / 4 };
  }
  begin(width, height, ground) {
    const gl = this.gl;
    gl.disable(gl.SCISSOR_TEST); gl.viewport(0, 0, width, height);
    gl.clearColor(...ground, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }
  // What follows is drawn there (from the left and from below, pixels), as this camera sees it.
  look([x, y, width, height], camera) {
    const gl = this.gl;
    gl.enable(gl.SCISSOR_TEST); gl.scissor(x, y, width, height); gl.viewport(x, y, width, height);
    this.size = [width, height]; this.camera = camera;
  }
  use(name) {
    const { made, places } = this.programs[name], gl = this.gl;
    gl.useProgram(made); gl.uniformMatrix4fv(places.camera, false, this.camera);
    for (let i = 0; i < 5; i++) { gl.disableVertexAttribArray(i); gl.vertexAttribDivisor(i, 0); }
    return places;
  }
  // Attributes of one after the other, in floats, each for an instance where `each` is 1.
  give(first, sizes, each) {
    const gl = this.gl, stride = 4 * sizes.reduce((a, b) => a + b);
    sizes.reduce((from, size, i) => { gl.enableVertexAttribArray(first + i);
      gl.vertexAttribPointer(first + i, size, gl.FLOAT, false, stride, from); gl.vertexAttribDivisor(first + i, each);
      return from + 4 * size; }, 0);
  }
  // Of twelve floats each: from, to, red green blue alpha, width and dash in pixels.
  lines(lines, above = false) {
    const gl = this.gl, places = this.use("lines");
    gl.uniform2fv(places.size, this.size); gl.depthMask(false);
    if (above) gl.disable(gl.DEPTH_TEST);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.quad); this.give(0, [2], 0);
    this.buffer(lines.data(), this.moving); this.give(1, [3, 3, 4, 2], 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count / 12);
    gl.depthMask(true); gl.enable(gl.DEPTH_TEST);
  }
  // Of eleven floats each: from, to, two radii, red green blue.
  capsules(capsules) {
    const gl = this.gl; this.use("capsules");
    gl.bindBuffer(gl.ARRAY_BUFFER, this.shape.held); this.give(0, [4], 0);
    this.buffer(capsules.data(), this.moving); this.give(1, [3, 3, 2, 3], 1);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, this.shape.count, capsules.count / 11);
  }
  // `held`: as `scan` or `cloud` made it.
  points(held, tints, thick) {
    const gl = this.gl, places = this.use("points");
    gl.uniform3fv(places.tints, tints.flat()); gl.uniform1f(places.thick, thick);
    gl.uniform4fv(places.place, [...held.from_m.map((m, i) => m - this.origin[i]), .01]);
    gl.bindBuffer(gl.ARRAY_BUFFER, held.buffer);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, held.short ? gl.SHORT : gl.INT, false, held.short ? 8 : 12, 0);
    if (held.short) { gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 1, gl.UNSIGNED_BYTE, false, 8, 6); }
    else gl.vertexAttrib1f(1, 0);
    gl.drawArrays(gl.POINTS, 0, held.count);
  }
  // Of seven floats a corner: place, red green blue alpha.
  faces(held, seen_through = false) {
    if (!held.count) return;
    const gl = this.gl; this.use("faces"); gl.depthMask(!seen_through);
    gl.bindBuffer(gl.ARRAY_BUFFER, held.buffer); this.give(0, [3, 4], 0);
    gl.drawArrays(gl.TRIANGLES, 0, held.count); gl.depthMask(true);
  }
  keep(list, floats, before) { return { buffer: this.buffer(list.data(), (before && before.buffer) || undefined), count: list.count / floats }; }
}

// Floats that grow and are filled anew for every picture.
class Floats {
  constructor(origin) { this.held = new Float32Array(1 << 12); this.count = 0; this.origin = origin; }
  clear() { this.count = 0; return this; }
  data() { return this.held.subarray(0, this.count); }
  push(...values) {
    if (this.count + values.length > this.held.length) { const wider = new Float32Array(2 * this.held.length); wider.set(this.held); this.held = wider; }
    this.held.set(values, this.count); this.count += values.length;
  }
  line(a, b, tint, width = 1, dash = 0) {
    const o = this.origin;
    this.push(a[0] - o[0], a[1] - o[1], a[2] - o[2], b[0] - o[0], b[1] - o[1], b[2] - o[2], tint[0], tint[1], tint[2], tint[3] ?? 1, width, dash);
  }
  way(places, tint, width, dash) { for (let i = 0; i + 1 < places.length; i++) this.line(places[i], places[i + 1], tint, width, dash); }
  capsule(a, b, thick_a, thick_b, tint) {
    const o = this.origin;
    this.push(a[0] - o[0], a[1] - o[1], a[2] - o[2], b[0] - o[0], b[1] - o[1], b[2] - o[2], thick_a, thick_b, tint[0], tint[1], tint[2]);
  }
  face(corners, tint) {   // convex, in order
    const o = this.origin, alpha = tint[3] ?? 1;
    for (let i = 1; i + 1 < corners.length; i++) for (const c of [corners[0], corners[i], corners[i + 1]])
      this.push(c[0] - o[0], c[1] - o[1], c[2] - o[2], tint[0], tint[1], tint[2], alpha);
  }
}
