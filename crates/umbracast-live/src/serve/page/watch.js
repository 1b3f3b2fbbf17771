// ---------------------------------------------------------------- what is watched: live, or a recording
const MINUTE = 600;                  // frames
const PICTURE_MS = 30;               // no more pictures than that: software draws them where there is no graphics card
let site = null, paused = false, shown = null, picked = null, drawn = false, boarded = 0, moving_until = 0, pictured = 0, beside = null;
const kept = [];                     // the last minute, oldest first
const links = [new Links(), new Links()];
const scene = new Scene($("space"), $("overlay"));
const wake = (ms = 100) => { drawn = false; moving_until = Math.max(moving_until, performance.now() + ms); };
function themed() { if (site) { scene.themed(); boarded = 0; wake(); } }

// ------------------------------------------------------------------ frames in
// What is drawn of a frame's rows; the rest stays where it is.
const numbered = (first, last, of) => Array.from({ length: last - first + 1 }, (_, k) => of(first + k)).flat();
const DRAWN = ["track", "x_m", "y_m", "vx_mps", "vy_mps", "heading_rad", "height_m", "width_scale", "gait_phase_rad", "gait_concentration", "points", "confirmed", "aabb_max_z_m",
  ...[3, 6, 9].flatMap(k => [`x_s${k}_m`, `y_s${k}_m`, `cov_xx_s${k}_m2`, `cov_xy_s${k}_m2`, `cov_yy_s${k}_m2`]),
  "access_point", "blocked_now", "blocked_w9", "p_now", "p_own_now", "p_own_w9", "p_hall_now", "p_hall_w9", "p_any_now", "onset_p50_s", ...numbered(1, 9, k => [`p_w${k}`, `p_any_w${k}`]),
  ...[10, 50, 90].flatMap(q => [`loss_now_p${q}_db`, ...numbered(1, 9, k => `loss_s${k}_p${q}_db`)]), "p_out_now", "p_out_w9", "out_onset_p50_s",
  "serving", "action", "target", "surface", "deadline_s", "p_out"];
function connect() {
  const scheme = location.protocol === "https:" ? "wss://" : "ws://";
  const socket = new WebSocket(scheme + location.host + "/api/live?decimals=4&columns=" + DRAWN);
  socket.onmessage = message => {
    const frame = JSON.parse(message.data), before = kept[kept.length - 1];
    if (!frame.published_ns || (before && before.published_ns === frame.published_ns)) return;
    frame.came = performance.now();
    if (before && frame.reloads !== before.reloads) return location.reload();   // another site
    if (before && frame.frame < before.frame) kept.length = 0;   // another run
    links[0].take(frame);
    kept.push(frame);
    if (kept.length > MINUTE) kept.shift();
    $("scrub").max = kept.length - 1;
    if (!paused) { shown = frame; $("scrub").value = kept.length - 1; }
    else if (kept.length === MINUTE && +$("scrub").value > 0) $("scrub").value -= 1;   // what is shown stays shown
    drawn = false;
  };
  socket.onclose = () => setTimeout(connect, 1000);
}
// The whole scan comes only while somebody looks at it, one answer after the other.
async function scans() {
  for (let had = -1;;) {
    await new Promise(done => setTimeout(done, 120));
    if (scheme.scan !== "whole" || document.hidden || (paused && !recording) || !site) continue;
    try {
      const at = recording ? Math.floor(recording.at / recording.about.scan_every) * recording.about.scan_every : null;
      if (recording && at === had) continue;
      const answer = await fetch(recording ? `/api/recording/scan?frame=${at}` : "/api/scan");
      if (answer.status === 200) { scene.whole(await answer.arrayBuffer()); had = at; drawn = false; document.body.dataset.scanned = scene.scan.count; }
    } catch { /* the next may come */ }
  }
}

// ------------------------------------------------------------------ what a user does
function pick(track) { picked = track === picked ? null : track; boarded = 0; wake(800); }
function pause(on) {
  paused = on; say($("pause"), on ? "go on" : "pause"); $("pause").setAttribute("aria-pressed", on);
  if (recording) { if (!on && recording.at >= recording.about.frames - 1 && recording.about.done) seek(0); }
  else if (!on && kept.length) { shown = kept[kept.length - 1]; $("scrub").value = kept.length - 1; }
  wake();
}
function goTo(index) {
  if (recording) return seek(index);
  if (!paused) pause(true);
  shown = kept[index] || shown; $("scrub").value = index; boarded = 0; wake();
}
function way(name) {
  if (name === "eye" && site) scheme.eye = scheme.way === "eye" ? (scheme.eye + 1) % site.sensors.length : scheme.eye || 0;
  if (name === "fit" || name === "corner") { scene.camera.flat = false; scene.camera.turn = -.65; scene.camera.tilt = .62; }
  if (name === "plan") scene.camera.flat = true;
  if (name === "follow") { scene.camera.flat = false; if (picked == null && shown) { const t = shown.tracks.find(t => t.confirmed); if (t) picked = t.track; } }
  scheme.way = name; scene.box = null; scene.fresh = true; boarded = 0;
  document.querySelectorAll("[data-way]").forEach(b => b.setAttribute("aria-pressed", b.dataset.way === name));
  if (name === "eye" && site) say(document.querySelector("[data-way=eye]"), "eye of " + site.sensors[scheme.eye].name);
  wake(1500);
}
const turn = (id, name) => { scheme[name] = !scheme[name]; $(id).setAttribute("aria-pressed", scheme[name]); boarded = 0; wake(); };
scheme.truth = true;
document.querySelectorAll("[data-way]").forEach(b => b.onclick = () => way(b.dataset.way));
$("scan").onchange = () => { scheme.scan = $("scan").value; wake(); };
$("fields").onclick = () => turn("fields", "fields");
$("truth").onclick = () => turn("truth", "truth");
$("pause").onclick = () => pause(!paused);
$("scrub").oninput = () => goTo(+$("scrub").value);
steerable(scene, () => { if (scheme.way === "eye") way("fit"); scheme.way = "own"; document.querySelectorAll("[data-way]").forEach(b => b.setAttribute("aria-pressed", false)); wake(200); },
  (u, v) => { const track = scene.at(u, v, shown); if (track != null) pick(track); });
addEventListener("resize", () => { scene.fresh = true; boarded = 0; wake(); });
addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || ["INPUT", "SELECT"].includes(event.target.tagName)) return;
  const people = shown ? shown.tracks.filter(t => t.confirmed).map(t => t.track).sort((a, b) => a - b) : [];
  const next = by => { if (people.length) { const i = people.indexOf(picked); picked = people[(i + by + people.length + (i < 0 && by < 0 ? 1 : 0)) % people.length]; boarded = 0; wake(800); } };
  const step = by => { const now = recording ? Math.floor(recording.at) : +$("scrub").value; if (!paused) pause(true); goTo(Math.max(0, now + by)); };
  const keys = { " ": () => pause(!paused), 1: () => way("fit"), 2: () => way("plan"), 3: () => way("corner"), 4: () => way("eye"), 5: () => way("follow"),
    s: () => { const all = ["foreground", "whole", "none"]; $("scan").value = scheme.scan = all[(all.indexOf(scheme.scan) + 1) % 3]; wake(); },
    v: () => turn("fields", "fields"), r: () => turn("truth", "truth"), t: () => $("theme").click(), n: () => next(1), p: () => next(-1), Escape: () => { picked = null; boarded = 0; wake(); },
    ArrowLeft: () => step(-1), ArrowRight: () => step(1), PageUp: () => step(-50), PageDown: () => step(50),
    "+": () => { scene.camera.away /= 1.15; scheme.way = "own"; wake(); }, "-": () => { scene.camera.away *= 1.15; scheme.way = "own"; wake(); } };
  if (event.key === " " && event.target.tagName === "BUTTON") return;
  if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
});

// ------------------------------------------------------------------ draw
function tell() {
  if (recording) return tellRecording();
  const newest = kept[kept.length - 1], state = $("state");
  if (!newest) return say(state, "waiting for frames");
  const age = (newest.age_ms || 0) + performance.now() - newest.came;
  const silent = newest.sensors.map((gave, i) => gave ? null : site.sensors[i].name).filter(Boolean);
  const stale = age > 1000, looks = stale || silent.length ? "bad" : "";
  if (state.className !== looks) state.className = looks;
  say(state, stale ? `no frame for ${(age / 1000).toFixed(1)} s`
    : `${newest.tracks.filter(t => t.confirmed).length} people, frame ${newest.frame}, ${newest.latency_ms.toFixed(1)} ms after its last packet` +
      (silent.length ? `; silent: ${silent.join(", ")}` : "") + (newest.frames_skipped ? `; ${newest.frames_skipped} frames skipped` : ""));
  const back = shown ? (newest.time_ns - shown.time_ns) / 1e9 : 0;
  say($("when"), paused ? `\u2212${back.toFixed(1)} s` : "now");
}
let pictures = 0, counted = 0;
function draw(now) {
  requestAnimationFrame(draw);
  if (!site || now - pictured < PICTURE_MS) return;
  const passed_s = Math.min(1, (now - pictured) / 1000);
  pictured = now;
  if (recording) play(passed_s);
  tell();
  if (drawn && (paused || !shown) && now > moving_until) return;
  drawn = true;
  const ahead_s = paused || !shown ? 0 : recording ? Math.min(.1, (recording.at % 1) * .1) : Math.min(.15, Math.max(0, now - shown.came) / 1000);
  scene.steer(shown);
  scene.draw(shown && beside ? [shown, beside] : [shown], ahead_s);
  if (counted++ === 0) pictures = now;
  document.body.dataset.pictures = (1000 * (counted - 1) / Math.max(1, now - pictures)).toFixed(1);
  // Numbers that change ten times a second are not read.
  if (now - boarded > 300) { drawBoard(shown); drawEvents(links[0]); drawSensors(recording ? recording.near() : kept, shown); boarded = now; }
  if (shown) { const looks = [...shown.looks.values()], count = state => looks.filter(l => l.state === state).length;
    Object.assign(document.body.dataset, {            // what is drawn, for tests
      frame: shown.frame, people: shown.tracks.filter(t => t.confirmed).length, warned: count("warning"), blocked: count("blocked"),
      advised: (shown.decisions || []).filter(d => d.action !== "stay").length }); }
}
async function begin() {
  const about = await (await fetch("/api/site")).json();
  site = about.site; scene.site(about);
  document.body.classList.toggle("has-radio", site.access_points.some(a => a.radio));
  say($("title"), about.title); document.title = "Umbracast: " + about.title;
  way("fit");
  if (about.recorded) await openRecording(); else connect();
  scans(); requestAnimationFrame(draw);
}
begin().catch(error => { say($("state"), "cannot read the site: " + error); $("state").className = "bad"; });
