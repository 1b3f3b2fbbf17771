// ---------------------------------------------------------------- what lies on and beneath the floor of a plan
const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]].map(c => c.map(v => v / 255));
const shade = v => { const k = Math.min(3.999, Math.max(0, v) * 4), i = Math.floor(k); return STOPS[i].map((a, n) => a + (STOPS[i + 1][n] - a) * (k - i)); };
// Value of a cell, its scale, and what it says.
const LAYERS = {
  seen: { name: "a person is seen", of: m => m.seen, top: 1, what: "share of time in which some sensor sees a person there" },
  returns: { name: "points on a person", of: m => m.returns, top: 200, what: "points on a person alone there, in one revolution of all sensors" },
  sensors: { name: "sensors that see", of: m => m.sensors_seeing, top: 4, what: "sensors with 6 points or more on a person alone there" },
  blocked: { name: "all links blocked", of: m => m.all_blocked, top: 1, what: "share of time in which no link of a person there is free" },
};
let held = { heat: null, numbers: [] };
function layer() {
  const name = $("layer").value;
  return LAYERS[name] || { name, of: m => m.blocked[+name.slice(3)], top: 1, what: `share of time in which the link to ${(site.access_points[+name.slice(3)] || {}).name} is blocked` };
}
function heat() {
  if (!answered) return;
  const select = $("layer"), names = [...Object.keys(LAYERS), ...answered.blocked.map((_, i) => "ap:" + i)].join();
  if (select.dataset.names !== names + site.access_points.map(ap => ap.name)) {
    const before = select.value;
    select.replaceChildren(...names.split(",").map(name => { const o = made("option", "", LAYERS[name] ? LAYERS[name].name : "blocked: " + (site.access_points[+name.slice(3)] || {}).name); o.value = name; return o; }));
    if ([...select.options].some(o => o.value === before)) select.value = before;
    select.dataset.names = names + site.access_points.map(ap => ap.name);
  }
  const { of, top, what } = layer(), values = of(answered) || [], { from_m: [x0, y0], step_m: step, columns, rows } = answered.floor;
  const floats = new Floats(scene.origin), numbers = [], every = Math.max(1, Math.round(Math.max(columns, rows) / 9));
  for (let j = 0; j < rows; j++) for (let i = 0; i < columns; i++) {
    const k = j * columns + i;
    if (answered.returns[k] < 0) continue;
    const [x, y] = [x0 + i * step, y0 + j * step], h = step / 2;
    floats.face([[x - h, y - h, .01], [x + h, y - h, .01], [x + h, y + h, .01], [x - h, y + h, .01]], [...shade(values[k] / top), .78]);
    if (i % every === every >> 1 && j % every === every >> 1) numbers.push([x, y, top > 1 ? String(Math.round(values[k])) : values[k].toFixed(2), values[k] / top]);
  }
  held = { heat: scene.draws.keep(floats, 7, held.heat), numbers };
  say($("low"), "0"); say($("high"), top === 1 ? "1" : `${top} and more`); say($("what"), what);
  if (!$("scale").children.length) for (let k = 0; k < 24; k++) { const i = made("i"); i.style.background = `rgb(${shade(k / 23).map(v => 255 * v)})`; $("scale").append(i); }
  dirty = true;
}
function means() {
  const share = v => (100 * v).toFixed(1) + " %", rows = [["one sensor or more can see a person", answered.means[0]], ["and does, others in between", answered.means[1]], ["no link is free", answered.means[2]],
    ...answered.blocked_means.map((v, i) => [`the link to ${(site.access_points[i] || {}).name} is blocked`, v])];
  $("means").replaceChildren(...rows.map(([name, v]) => { const d = made("div"); d.append(made("span", "", name), made("b", "", share(v))); return d; }));
}

// ------------------------------------------------------------------ an image or a drawing beneath
let beneath = null;
const drawing = {
  below(draws) {
    if (held.heat) draws.faces(held.heat, true);
    const lines = scene.over;
    if (beneath && beneath.lines) { const k = +$("under_wide").value / beneath.wide, [ox, oy] = [+$("under_x").value, +$("under_y").value];
      for (const [a, b] of beneath.lines) scene.marks.line([ox + (a[0] - beneath.x0) * k, oy + (a[1] - beneath.y0) * k, .02], [ox + (b[0] - beneath.x0) * k, oy + (b[1] - beneath.y0) * k, .02], [...tintOf("truth"), .8], 1); }
    hallOf(site).corners.forEach(([x, y], i) => { const on = chosen && chosen.list === "corner" && chosen.index === i; lines.way(ring(x, y, .03, .12), [...tintOf(on ? "person" : "ink"), 1], on ? 3 : 1.5); });
    const thing = thingOf(chosen);
    if (thing && chosen.list !== "corner") { const r = Math.max(.45, thing.radius_m || 0, thing.size_m ? Math.hypot(thing.size_m[0], thing.size_m[1]) / 2 : 0), [x, y] = thing.position_m;
      lines.way(ring(x, y, .04, r), [...tintOf("person"), 1], 2.5);
      const tip = scene.camera.flat && handle();
      if (tip) { lines.line([x, y, .05], [...tip, .05], [...tintOf("person"), 1], 2.5); lines.way(ring(...tip, .05, .18), [...tintOf("person"), 1], 3); } }
  },
  letters(c, camera, scale) {
    if (beneath && beneath.image && camera.flat) {
      const [x, y, wide] = [+$("under_x").value, +$("under_y").value, +$("under_wide").value], high = wide * beneath.image.height / beneath.image.width;
      const a = camera.project(x, y + high, 0), b = camera.project(x + wide, y, 0);
      if (a && b) { c.save(); c.globalAlpha = .4; c.globalCompositeOperation = "destination-over"; c.drawImage(beneath.image, a[0], a[1], b[0] - a[0], b[1] - a[1]); c.restore(); }
    }
    c.font = `${10.5 * scale}px system-ui, sans-serif`; c.textAlign = "center";
    for (const [x, y, text, share] of held.numbers) { const p = camera.project(x, y, 0); if (p) { c.fillStyle = share > .62 ? "#111" : "#fff"; c.fillText(text, p[0], p[1] + 3 * scale); } }
  },
};
$("under").onchange = async () => {
  const file = $("under").files[0];
  if (!file) return;
  try {
    if (file.size > 64 << 20) throw new Error(`${file.name}: expected 64 MB at most, found ${Math.round(file.size / 1048576)} MB`);
    const { x0, y0, x1 } = hallOf(site);
    if (/\.dxf$/i.test(file.name)) {
      beneath = dxf(await file.text(), file.name);
      $("under_wide").value = round(beneath.wide * beneath.unit_m); $("under_x").value = round(x0); $("under_y").value = round(y0);
    } else {
      beneath = { image: await createImageBitmap(file) };
      $("under_wide").value = round(x1 - x0); $("under_x").value = round(x0); $("under_y").value = round(y0);
    }
    $("lies").hidden = false; $("walls").hidden = !(beneath.closed && beneath.closed.length > 2);
    for (const id of ["under_wide", "under_x", "under_y"]) $(id).oninput = () => dirty = true;
  } catch (error) { beneath = null; say($("state"), `${file.name}: ${error.message}`); $("state").className = "bad"; }
  dirty = true;
};
$("walls").onclick = () => {
  remember();
  const k = +$("under_wide").value / beneath.wide;
  site.hall.outline_m = beneath.closed.map(([x, y]) => [round(+$("under_x").value + (x - beneath.x0) * k), round(+$("under_y").value + (y - beneath.y0) * k)]);
  chosen = null; scene.fresh = true; scheme.way = "corner"; changed();
};
// Lines of a drawing in text form: LINE, LWPOLYLINE, POLYLINE, CIRCLE and ARC of its model space.
const DXF_LINES_MOST = 200000;
function dxf(text, name) {
  const rows = text.split(/\r\n|\n|\r/), lines = [], closed = [];
  if (text.startsWith("AutoCAD Binary DXF")) throw new Error(`${name}: expected a DXF in text form, found a binary one`);
  let unit = 0, entity = null, in_entities = false, poly = null;
  const put = (a, b) => { if ([...a, ...b].every(isFinite) && lines.length < DXF_LINES_MOST) lines.push([a, b]); };
  const way = (places, shut) => { places.forEach((p, i) => { if (i + 1 < places.length) put(p, places[i + 1]); else if (shut && places.length > 2) put(p, places[0]); }); if (shut && places.length > 2) closed.push(places); };
  const finish = () => {
    if (!entity) return;
    const { kind, g, places } = entity, f = code => +(g[code] ?? NaN);
    if (kind === "LINE") put([f(10), f(20)], [f(11), f(21)]);
    if (kind === "LWPOLYLINE") way(places, (f(70) & 1) === 1 || (places.length > 3 && Math.hypot(...minus(places[0], places[places.length - 1])) < 1e-6));
    if (kind === "POLYLINE") poly = { places: [], shut: (f(70) & 1) === 1 };
    if (kind === "VERTEX" && poly) poly.places.push([f(10), f(20)]);
    if (kind === "SEQEND" && poly) { way(poly.places, poly.shut); poly = null; }
    if (kind === "CIRCLE" || kind === "ARC") { const [from, to] = kind === "ARC" ? [f(50), f(51) < f(50) ? f(51) + 360 : f(51)] : [0, 360];
      const at = a => [f(10) + f(40) * Math.cos(a * degrees), f(20) + f(40) * Math.sin(a * degrees)];
      for (let k = 0; k < 24; k++) put(at(from + (to - from) * k / 24), at(from + (to - from) * (k + 1) / 24)); }
    entity = null;
  };
  for (let i = 0; i + 1 < rows.length; i += 2) {
    const code = parseInt(rows[i], 10), value = rows[i + 1].trim();
    if (code === 9 && value === "$INSUNITS") unit = parseInt(rows[i + 3], 10) || 0;
    if (code === 0) { finish(); if (value === "ENDSEC") in_entities = false; if (in_entities) entity = { kind: value, g: {}, places: [] }; }
    else if (code === 2 && value === "ENTITIES") in_entities = true;
    else if (entity) { if (code === 10 && entity.kind === "LWPOLYLINE") entity.places.push([+value, 0]); else if (code === 20 && entity.kind === "LWPOLYLINE" && entity.places.length) entity.places[entity.places.length - 1][1] = +value; else entity.g[code] ??= value; }
  }
  finish();
  if (!lines.length) throw new Error("expected lines or polylines in its ENTITIES, found none");
  let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [a, b] of lines) for (const [x, y] of [a, b]) { x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y); }
  const wide = x1 - x0 || 1, area = p => Math.abs(p.reduce((sum, [x, y], i) => { const [u, v] = p[(i + 1) % p.length]; return sum + x * v - u * y; }, 0));
  const unit_m = { 1: .0254, 2: .3048, 4: .001, 5: .01, 6: 1 }[unit] || (wide > 500 ? .001 : 1);
  return { lines, x0, y0, wide, unit_m, closed: closed.filter(p => p.length < 400).sort((a, b) => area(b) - area(a))[0] };
}
