// ---------------------------------------------------------------- a plan: things on a floor, moved by hand
let site = null, picked = null, shown = null, chosen = null, tool = "move", dirty = true, answered = null, asking = false, wanted = false, offered = null;
const scene = new Scene($("space"), $("overlay")), undone = [];
const at2 = thing => thing.position_m, round = m => Math.round(m * 100) / 100 + 0;
function themed() { if (site) { scene.themed(); heat(); dirty = true; } }
const LISTS = { sensor: "sensors", ap: "access_points", furniture: "furniture", pillar: "pillars" };

// ------------------------------------------------------------------ changes
function remember() { undone.push(JSON.stringify(site)); if (undone.length > 100) undone.shift(); }
function changed() { scene.themed(); dirty = true; wanted = true; fields(); ask(); }
// One question at a time, always of the newest plan.
async function ask() {
  if (asking || !wanted) return;
  asking = true; wanted = false;
  const begun = performance.now();
  try {
    const answer = await question("map", {});
    answered = answer; heat(); means();
    const took = Math.round(performance.now() - begun);
    say($("took"), `in ${took} ms`); say($("state"), ""); $("state").className = "";
    Object.assign(document.body.dataset, { mapped: 1 + +(document.body.dataset.mapped || 0), took });
  } catch (error) { say($("state"), String(error.message || error)); $("state").className = "bad"; }
  asking = false; dirty = true;
  if (wanted) ask();
}
async function question(name, more) {
  const answer = await fetch("/api/plan/" + name, { method: "POST", body: JSON.stringify({ site, people: +$("people").value, height_m: +$("tall").value, ...more }) });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}

// ------------------------------------------------------------------ what stands where
const newName = (list, stem) => { for (let k = 1; ; k++) if (!list.some(t => t.name === `${stem}_${k}`)) return `${stem}_${k}`; };
function add([x, y]) {
  remember();
  const like = site[LISTS[tool]] && site[LISTS[tool]][0], here = [round(x), round(y)];
  const { x: mx, y: my } = hallOf(site), inwards = Math.atan2(my - y, mx - x) / degrees;
  const thing = {
    sensor: () => ({ ...(like || { model: "hdl-32e", rate_hz: 10, cut_deg: 180, range_min_m: .5, range_max_m: 50, range_noise_m: .02, clock_offset_ms: 0 }), name: newName(site.sensors, "lidar"),
      position_m: [...here, like ? like.position_m[2] : Math.min(4, site.hall.height_m)], rotation_deg: { yaw: Math.round(inwards), pitch: like ? like.rotation_deg.pitch : 20, roll: 0 }, udp_port: undefined, address: undefined }),
    ap: () => ({ ...(like || {}), name: newName(site.access_points, "ap"), position_m: [...here, like ? like.position_m[2] : Math.min(3, site.hall.height_m)] }),
    furniture: () => ({ position_m: here, size_m: [1.6, .8, .75], yaw_deg: 0 }),
    pillar: () => ({ position_m: here, radius_m: .3 }),
  }[tool]();
  site[LISTS[tool]].push(thing);
  chosen = { list: LISTS[tool], index: site[LISTS[tool]].length - 1 };
  choose("move"); changed();
}
function outline() {
  if (!(site.hall.outline_m || []).length) site.hall.outline_m = hallOf(site).corners.map(c => c.map(round));
  return site.hall.outline_m;
}
function addCorner([x, y]) {
  remember();
  const corners = outline(), away = corners.map((a, i) => { const b = corners[(i + 1) % corners.length], d = minus(b, a), t = Math.min(1, Math.max(0, dot([...minus([x, y], a), 0], [...d, 0]) / (dot([...d, 0], [...d, 0]) || 1)));
    return Math.hypot(a[0] + t * d[0] - x, a[1] + t * d[1] - y); });
  const i = away.indexOf(Math.min(...away));
  corners.splice(i + 1, 0, [round(x), round(y)]);
  chosen = { list: "corner", index: i + 1 }; choose("move"); changed();
}
function removeChosen() {
  if (!chosen) return;
  remember();
  if (chosen.list === "corner") { const corners = outline(); if (corners.length > 3) corners.splice(chosen.index, 1); }
  else site[chosen.list].splice(chosen.index, 1);
  chosen = null; changed();
}
const thingOf = c => c && (c.list === "corner" ? { position_m: hallOf(site).corners[c.index] } : site[c.list][c.index]);
// What lies under a place, the small before the large; a handle turns what is chosen.
function under([x, y], near) {
  const tip = handle();
  if (tip && Math.hypot(tip[0] - x, tip[1] - y) < near) return { ...chosen, turns: true };
  for (const list of ["sensors", "access_points", "pillars"]) { const index = site[list].findIndex(t => Math.hypot(t.position_m[0] - x, t.position_m[1] - y) < Math.max(near, t.radius_m || 0)); if (index >= 0) return { list, index }; }
  const index = site.furniture.findIndex(({ position_m: [u, v], size_m: [l, w], yaw_deg }) => { const [c, s] = [Math.cos(yaw_deg * degrees), Math.sin(yaw_deg * degrees)];
    return Math.abs((x - u) * c + (y - v) * s) < Math.max(l / 2, near) && Math.abs((y - v) * c - (x - u) * s) < Math.max(w / 2, near); });
  if (index >= 0) return { list: "furniture", index };
  const corner = hallOf(site).corners.findIndex(([u, v]) => Math.hypot(u - x, v - y) < near);
  return corner >= 0 ? { list: "corner", index: corner } : null;
}
function turnOf(thing) { return thing.rotation_deg ? thing.rotation_deg.yaw : thing.yaw_deg; }
function handle() {
  const thing = thingOf(chosen), yaw = thing && turnOf(thing);
  if (yaw == null) return null;
  const long = 34 / scene.camera.seen.m.unit(1, scene.camera.seen.height) * scene.scale;
  return [thing.position_m[0] + long * Math.cos(yaw * degrees), thing.position_m[1] + long * Math.sin(yaw * degrees)];
}
function moveTo(c, [x, y]) {
  if (c.turns) { const thing = thingOf(c), yaw = Math.round(Math.atan2(y - thing.position_m[1], x - thing.position_m[0]) / degrees);
    if (thing.rotation_deg) thing.rotation_deg.yaw = yaw; else thing.yaw_deg = yaw; }
  else if (c.list === "corner") outline()[c.index] = [round(x), round(y)];
  else { const p = thingOf(c).position_m; [p[0], p[1]] = [round(x), round(y)]; }
  changed();
}

// ------------------------------------------------------------------ what a user does
function choose(name) { tool = name; document.querySelectorAll("[data-tool]").forEach(b => b.setAttribute("aria-pressed", b.dataset.tool === name)); }
document.querySelectorAll("[data-tool]").forEach(b => b.onclick = () => choose(b.dataset.tool));
$("remove").onclick = removeChosen;
$("undo").onclick = () => { if (undone.length) { site = JSON.parse(undone.pop()); chosen = null; changed(); } };
steerable(scene, () => { scheme.way = "own"; dirty = true; }, () => {});
{
  const c = $("overlay"), { onpointerdown: down, onpointermove: move, onpointerup: up } = c;
  let drags = null, from = null;
  const place = event => scene.camera.ground(event.offsetX * scene.scale, event.offsetY * scene.scale);
  c.onpointerdown = event => {
    if (!site || !scene.camera.flat || event.button > 0) return down.call(c, event);
    const here = place(event);
    if (tool === "corner") return addCorner(here);
    if (tool !== "move") return add(here);
    const near = 12 / scene.camera.seen.m.unit(1, scene.camera.seen.height) * scene.scale, found = under(here, near);
    chosen = found; fields(); dirty = true;
    if (!found) return down.call(c, event);
    c.setPointerCapture(event.pointerId); remember();
    drags = found; const thing = thingOf(found); from = found.turns ? [0, 0] : [thing.position_m[0] - here[0], thing.position_m[1] - here[1]];
  };
  c.onpointermove = event => { if (!drags) return move.call(c, event); const here = place(event); moveTo(drags, [here[0] + from[0], here[1] + from[1]]); };
  c.onpointerup = event => { if (!drags) return up.call(c, event); drags = null; };
}
$("flat").onclick = () => { scene.camera.flat = !scene.camera.flat; $("flat").setAttribute("aria-pressed", scene.camera.flat); scheme.way = "corner"; scene.fresh = true; dirty = true; };
$("layer").onchange = () => { heat(); dirty = true; };
for (const id of ["people", "tall"]) $(id).oninput = () => { wanted = true; ask(); };
addEventListener("resize", () => { scene.fresh = true; dirty = true; });
addEventListener("keydown", event => {
  if (["INPUT", "SELECT", "TEXTAREA"].includes(event.target.tagName)) return;
  if (event.key === "z" && (event.ctrlKey || event.metaKey)) { event.preventDefault(); return $("undo").click(); }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const push = (dx, dy) => { const thing = thingOf(chosen); if (thing) { const by = event.shiftKey ? 1 : .1; remember(); moveTo({ ...chosen, turns: false }, [thing.position_m[0] + dx * by, thing.position_m[1] + dy * by]); } };
  const all = ["sensors", "access_points", "furniture", "pillars"].flatMap(list => site[list].map((_, index) => ({ list, index })));
  const keys = { ArrowLeft: () => push(-1, 0), ArrowRight: () => push(1, 0), ArrowUp: () => push(0, 1), ArrowDown: () => push(0, -1), Delete: removeChosen, Backspace: removeChosen,
    n: () => { const i = all.findIndex(c => chosen && c.list === chosen.list && c.index === chosen.index); chosen = all[(i + 1) % all.length] || null; fields(); dirty = true; },
    m: () => choose("move"), l: () => choose("sensor"), a: () => choose("ap"), f: () => choose("furniture"), p: () => choose("pillar"), c: () => choose("corner"), v: () => $("flat").click(), Escape: () => { chosen = null; choose("move"); fields(); dirty = true; } };
  if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
});
$("save").onclick = async () => {
  try { const { file, text } = await question("save", {}); say($("saved"), file ? `Saved to ${file}; comments are kept.` : "No file was given (--site or --out): copy this text."); $("saved").className = ""; $("text").value = text; $("text").hidden = false; document.body.dataset.saved = file || "text"; }
  catch (error) { say($("saved"), error.message); $("saved").className = "wrong"; }
};
$("best").onclick = async () => {
  $("best").disabled = true; say($("found"), "looking"); $("take").hidden = true;
  try {
    const beside = $("beside").checked, answer = await question("best", { sensors: +$("count_sensors").value, access_points: +$("count_aps").value, beside });
    $("found").replaceChildren(...["sensors", "access_points"].flatMap(kind => tellBest(kind, answer[kind])));
    offered = { answer, beside }; $("take").hidden = !(answer.sensors || answer.access_points);
  } catch (error) { say($("found"), error.message); }
  $("best").disabled = false;
};
function tellBest(kind, found) {
  if (!found) return [];
  const share = v => (100 * v).toFixed(1) + " %", list = made("ol"), what = kind === "sensors" ? "Some sensor sees a person" : "Some link is free";
  found.placed.forEach((thing, i) => list.append(made("li", "", `${share(found.values[i])} with ${thing.name} at ${thing.position_m.map(m => m.toFixed(1)).join(", ")} m`)));
  const how = found.exact ? `The best choice of ${found.candidates} places, then moved to better ones beside them.` : `Chosen one by one of ${found.candidates} places (at least 1 \u2212 1/e of the best); no choice of them reaches ${share(found.bound)}.`;
  return [made("div", "", what + ":"), list, made("div", "", how), made("div", "", `With one, two, three more: ${found.further.map(share).join(", ")}.`)];
}
$("take").onclick = () => {
  remember();
  for (const kind of ["sensors", "access_points"]) { const found = offered.answer[kind]; if (found) site[kind] = offered.beside ? [...site[kind], ...found.placed] : found.placed; }
  chosen = null; $("take").hidden = true; changed();
};
// Numbers of what is chosen, to type.
function fields() {
  const thing = thingOf(chosen), into = $("fields");
  say($("chosen"), !thing ? "Hall" : thing.name || { corner: "Corner", furniture: "Furniture", pillars: "Pillar" }[chosen.list]);
  const active = document.activeElement && into.contains(document.activeElement);
  const spec = !thing ? [["height, m", site.hall, "height_m"], ...((site.hall.outline_m || []).length ? [] : [["along x, m", site.hall, "length_m"], ["along y, m", site.hall, "width_m"]])]
    : [["x, m", thing.position_m, 0], ["y, m", thing.position_m, 1], ...(thing.position_m.length > 2 ? [["z, m", thing.position_m, 2]] : []),
      ...(thing.rotation_deg ? [["yaw, deg", thing.rotation_deg, "yaw"], ["pitch, deg", thing.rotation_deg, "pitch"]] : []), ...(thing.size_m ? [["long", thing.size_m, 0], ["wide", thing.size_m, 1], ["high", thing.size_m, 2], ["yaw, deg", thing, "yaw_deg"]] : []),
      ...(thing.radius_m != null ? [["radius, m", thing, "radius_m"]] : [])];
  if (active && into.children.length === spec.length) return;
  into.replaceChildren(...spec.map(([label, of, key]) => { const l = made("label", "", label + " "), input = made("input"); input.type = "number"; input.step = "any"; input.value = of[key];
    input.onchange = () => { if (input.value !== "" && isFinite(input.value)) { remember(); if (chosen && chosen.list === "corner") outline()[chosen.index][key] = +input.value; else of[key] = +input.value; changed(); } }; l.append(input); return l; }));
}
async function begin() {
  const about = await (await fetch("/api/site")).json();
  site = about.site; say($("title"), about.title); document.title = "Umbracast plan: " + about.title;
  scheme.way = "corner"; scheme.scan = "none"; scene.camera.flat = true; scene.fresh = true; scene.extra = drawing;
  scene.site({ fields_deg: [] });
  fields(); changed(); requestAnimationFrame(draw);
}
function draw() { requestAnimationFrame(draw); if (!dirty || !site) return; dirty = false; scene.steer(null); scene.draw([null], 0); }
begin().catch(error => { say($("state"), "cannot read the site: " + error); $("state").className = "bad"; });
