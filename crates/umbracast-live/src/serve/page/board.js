// ---------------------------------------------------------------- beside the view: links, events, sensors
const ROWS = 60;
const adviceOf = ({ action, target, surface, deadline_s: s }) => {
  const by = s == null ? "" : `, by ${Math.round(1000 * s)} ms`;
  const beam = `beam ${surface ? "at the " + surface : "straight again"}${by}`;
  return { stay: "serves", wait: "serves; wait: hold timers", beam }[action] || `${action === "prepare" ? "prepare" : "change to"} ${target}${by}`;
};
const KINDS = { true: "+", false: "\u2013", missed: "!", warning: "\u25b2" };

// A row a link, used again from one picture to the next.
const rows = [];
function rowAt(i) {
  if (rows[i]) return rows[i];
  const row = made("button", "link"), cell = (looks = "") => { const s = made("span", looks); row.append(s); return s; };
  const own = { row, mark: cell(), name: cell(), bars: made("div", "bars"), share: null, soon: null, by: null, strip: made("canvas"), more: null };
  row.append(own.bars);
  for (let k = 0; k <= 9; k++) own.bars.append(made("i"));
  own.bars.title = "probability now, and within 100 to 900 ms";
  own.share = cell("number"); own.soon = cell("number"); own.by = cell();
  own.strip.title = "the last minute: low clear, half warned, full blocked; below + came true, \u2013 false, ! missed";
  row.append(own.strip); own.more = cell("more");
  row.onclick = () => pick(own.track);
  $("links").append(row);
  return rows[i] = own;
}
function drawBoard(frame) {
  const looks = frame ? [...frame.looks.values()] : [];
  looks.sort((a, b) => (b.link.track === picked) - (a.link.track === picked) || RANK[a.state] - RANK[b.state]
    || Math.round(4 * steps(b.link, 9)) - Math.round(4 * steps(a.link, 9)) || a.link.track - b.link.track || (a.link.access_point < b.link.access_point ? -1 : 1));
  looks.slice(0, ROWS).forEach((look, i) => {
    const own = rowAt(i), { link, state, cause, loss, decision, kept } = look;
    own.track = link.track; own.row.hidden = false;
    const classes = `link ${state}${link.track === picked ? " picked" : ""}`;
    if (own.row.className !== classes) own.row.className = classes;
    say(own.mark, MARK[state]); own.row.setAttribute("aria-label", `${link.access_point} to person ${link.track}: ${state}${cause ? " by " + cause : ""}`);
    say(own.name, `${link.access_point} \u2192 ${link.track}`);
    for (let k = 0; k <= 9; k++) own.bars.children[k].style.height = Math.max(4, 100 * steps(link, k)) + "%";
    say(own.share, Math.round(100 * steps(link, 9)) + " %");
    const onset_s = link.onset_p50_s ?? (loss && loss.out_onset_p50_s);
    say(own.soon, state === "blocked" ? "now" : onset_s == null ? "" : Math.round(1000 * onset_s) + " ms");
    say(own.by, cause);
    own.by.title = causes(link, state === "blocked" ? 0 : 9).filter(([, p]) => p != null).map(([name, p]) => `${name} ${Math.round(100 * p)} %`).join(", ");
    const truth = truthOf(frame, link), other = besideOf(frame, link);
    say(own.more, [loss ? dB(loss).text : "", decision ? adviceOf(decision) : "", other, truth].filter(Boolean).join(" \u00b7 "));
    own.more.title = loss ? dB(loss).title : "";
    strip(own.strip, kept, frame.time_ns);
  });
  for (let i = looks.length; i < rows.length; i++) rows[i].row.hidden = true;
  const track = frame && frame.tracks.find(t => t.track === picked), decision = frame && (frame.decisions || []).find(d => d.track === picked);
  say($("person"), track ? `Person ${track.track}: ${Math.hypot(track.vx_mps, track.vy_mps).toFixed(2)} m/s, ${track.height_m.toFixed(2)} m tall, at ${track.x_m.toFixed(1)}, ${track.y_m.toFixed(1)} m, ${track.points} points`
    + (decision ? `; ${decision.serving} serves, ${(100 * decision.p_out).toFixed(0)} % out within 900 ms` : "")
    : picked == null ? "Pick a person in the picture or a row." : `Person ${picked} is not in sight.`);
  if (frame && frame.judged) { const { true: hit, false: wrong, missed } = frame.judged;
    say($("judged"), `last minute: ${hit} came true, ${wrong} false, ${missed} missed`); }
}
// What the mode beside says of the link: of the person who is nearest to the track.
function besideOf(frame, link) {
  if (!beside || frame !== shown) return "";
  const track = frame.tracks.find(t => t.track === link.track);
  const near = track && beside.tracks.filter(t => t.confirmed).map(t => [Math.hypot(t.x_m - track.x_m, t.y_m - track.y_m), t]).sort((a, b) => a[0] - b[0])[0];
  const look = near && near[0] < .5 && beside.looks.get(key({ access_point: link.access_point, track: near[1].track }));
  return `${beside.mode}: ${look ? look.state + (look.cause ? " by " + look.cause : "") : "nobody there"}`;
}
// What the truth says of a link now: of the person who is nearest to the track.
function truthOf(frame, link) {
  if (!frame.truth || !scheme.truth) return "";
  const track = frame.tracks.find(t => t.track === link.track);
  const near = track && frame.truth.people.map(p => [Math.hypot(p.x_m - track.x_m, p.y_m - track.y_m), p]).sort((a, b) => a[0] - b[0])[0];
  const real = near && near[0] < .5 && frame.truth.links.find(l => l.person === near[1].person && l.access_point === link.access_point);
  return !real ? "truth: nobody there" : `truth: ${real.blocked ? "blocked by others" : real.static_blocked ? "blocked by hall" : real.self_blocked ? "blocked by owner" : "free"}`;
}
// The last minute of a link from left to right.
function strip(canvas, kept, now_ns) {
  const scale = Math.min(window.devicePixelRatio || 1, 2), width = Math.round(canvas.clientWidth * scale), height = 13 * scale, c = canvas.getContext("2d");
  if (!width) return;
  if (canvas.width !== width) { canvas.width = width; canvas.height = height; } else c.clearRect(0, 0, width, height);
  const at = ns => width - (now_ns - ns) / MINUTE_NS * width, s = kept.states, base = height - 4 * scale;
  for (let i = 0; i < s.length;) {       // runs of one state at once
    let k = i;
    while (k + 3 < s.length && s[k + 3 + 1] === s[i + 1] && s[k + 3] - s[k] < 5e8) k += 3;
    if (s[i] > now_ns) break;
    const high = [base, base * .5, scale][s[i + 1]], from = at(s[i] - 1e8), to = Math.min(at(Math.min(s[k], now_ns)), width);
    c.fillStyle = css(["blocked", "warning", "clear"][s[i + 1]]); c.fillRect(from, base - high, Math.max(to - from, scale), high);
    i = k + 3;
  }
  c.font = `700 ${8 * scale}px system-ui, sans-serif`; c.textAlign = "center";
  for (const { ns, kind } of kept.outcomes) { if (ns > now_ns) continue;
    c.fillStyle = css(kind === "missed" ? "blocked" : kind === "true" ? "clear" : "faint"); c.fillText(KINDS[kind], at(ns), height - .5 * scale); }
}
let told_ns = null;
function drawEvents(links) {
  const newest = links.events[links.events.length - 1], mark = newest ? newest.ns + links.events.length : 0;
  if (mark === told_ns) return;
  told_ns = mark;
  $("told").replaceChildren(...links.events.slice(-60).reverse().map(e => {
    const li = made("li", "kind-" + e.kind), b = made("b", "", KINDS[e.kind] + " ");
    li.append(clock(e.ns) + " ", b, `${e.access_point} \u2192 ${e.track}: ${e.text}`); li.title = li.textContent;
    return li; }));
}
// How steadily each sensor gives, over the frames that are kept.
function drawSensors(frames, newest) {
  if (!newest) return;
  const list = document.querySelector("#sensors ul");
  while (list.children.length < site.sensors.length) list.append(made("li"));
  site.sensors.forEach((sensor, i) => {
    const span = frames.slice(-100), gave = span.filter(f => f.sensors[i]).length, li = list.children[i], well = newest.sensors[i];
    const text = `${well ? "\u25cf" : "\u25a0"} ${sensor.name}: ${well ? "gives" : "SILENT"}, ${gave} of the last ${span.length} frames, ${sensor.model}`;
    if (li.textContent !== text) { li.textContent = text; li.className = well ? "" : "bad"; }
  });
  const health = Object.entries(newest.health || {}).flatMap(([name, n]) => typeof n === "number" && n ? [`${name.replaceAll("_", " ")} ${n}`]
    : Array.isArray(n) && n.some(Boolean) ? [`${name.replaceAll("_", " ")} ${n.reduce((a, b) => a + b, 0)}`] : []);
  say($("lost"), health.length || newest.frames_skipped ? [newest.frames_skipped ? `${newest.frames_skipped} frames skipped` : "", ...health].filter(Boolean).join(", ") : "nothing lost or skipped");
}
