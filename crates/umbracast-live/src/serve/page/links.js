// ---------------------------------------------------------------- links: what each is, was, and what became of warnings
const MARK = { clear: "\u25cf", warning: "\u25b2", blocked: "\u25a0" };
const RANK = { blocked: 0, warning: 1, clear: 2 };
const HOLD_NS = 800e6;               // a warning stays on the page for at least so long
const HORIZON_NS = 1e9;              // and is judged when what it foretold is over
const MINUTE_NS = 60e9;
const MOST_LINKS = 600;              // histories that are kept; beyond, the oldest goes
// By what: others, the owner or the hall; those alone that the method knows.
const part = (link, name, k) => link[`p_${name}${k === 0 ? "now" : "w" + k}`];
const causes = (link, k) => [["others", part(link, "", k)], ["owner", part(link, "own_", k)], ["hall", part(link, "hall_", k) ?? (link.cut ? 1 : null)]];
const steps = (link, k) => Math.max(part(link, "any_", k) ?? part(link, "", k), link.cut ? 1 : 0);
const key = link => link.access_point + "\n" + link.track;
const ueOf = track => {
  const { forward_m: f, left_m: l, height_share } = site.ue, [c, s] = [Math.cos(track.heading_rad), Math.sin(track.heading_rad)];
  return [track.x_m + f * c - l * s, track.y_m + f * s + l * c, floorOf(track) + track.height_m * height_share];
};
// Nothing is clear that anything blocks, or that loses more dB than it may.
function rawState(link, loss) {
  const likely = (k, p) => steps(link, k) >= .5 || (loss && loss[p] >= .5);
  return link.blocked_now || likely(0, "p_out_now") ? "blocked" : link.blocked_w9 || likely(9, "p_out_w9") ? "warning" : "clear";
}
const causeOf = (link, state) => {
  const k = state === "blocked" ? 0 : 9;
  return state === "clear" ? "" : causes(link, k).reduce((a, b) => (b[1] ?? 0) > (a[1] ?? 0) ? b : a)[0];
};

// The last minute of every link. Frames come in order; another order begins anew.
class Links {
  constructor() { this.of = new Map(); this.events = []; this.begin(); }
  begin() { this.of.clear(); this.events.length = 0; this.time_ns = -Infinity; }
  // What is shown of each link of a frame: kept with the frame.
  take(frame) {
    const now = frame.time_ns;
    if (now < this.time_ns || now - this.time_ns > 5e9) this.begin();
    this.time_ns = now;
    const aps = new Map(site.access_points.map(ap => [ap.name, ap])), tracks = new Map(frame.tracks.map(t => [t.track, t]));
    const losses = new Map((frame.losses || []).map(l => [key(l), l])), advice = new Map((frame.decisions || []).map(d => [d.track, d]));
    frame.looks = new Map();
    for (const link of frame.blockages) {
      const ap = aps.get(link.access_point), track = tracks.get(link.track), name = key(link), loss = losses.get(name), decision = advice.get(link.track);
      if (link.p_hall_now == null && ap && track) link.cut = cut(site, ap.position_m, ueOf(track));
      const raw = rawState(link, loss), serves = decision && decision.serving === link.access_point;
      let kept = this.of.get(name);
      if (!kept) this.of.set(name, kept = { states: [], outcomes: [], open: null, held_ns: -Infinity, last: null, first: true });
      // Where there is a radio, what is to be done about the serving link is the warning: decisions do not flicker.
      let state = raw === "warning" && serves && decision.action === "stay" ? "clear" : raw;
      if (state === "warning" && kept.last !== "warning") kept.held_ns = now + HOLD_NS;
      if (state === "clear" && kept.last === "warning" && now < kept.held_ns) state = "warning";
      this.judge(kept, link, raw, state, now);
      kept.last = state; kept.seen_ns = now; kept.first = false;
      kept.states.push(now, RANK[state], 0);
      while (kept.states.length && kept.states[0] < now - MINUTE_NS) kept.states.splice(0, 3);
      while (kept.outcomes.length && kept.outcomes[0].ns < now - MINUTE_NS) kept.outcomes.shift();
      frame.looks.set(name, { link, ap, track, loss, decision: serves ? decision : null, state, cause: causeOf(link, state), kept });
    }
    for (const [name, kept] of this.of) if (kept.seen_ns < now - MINUTE_NS || this.of.size > MOST_LINKS) this.of.delete(name);
    while (this.events.length && (this.events[0].ns < now - MINUTE_NS || this.events.length > 400)) this.events.shift();
    frame.judged = this.count(now);
  }
  judge(kept, link, raw, state, now) {
    const tell = (kind, text) => { kept.outcomes.push({ ns: now, kind }); this.events.push({ ns: now, kind, access_point: link.access_point, track: link.track, text }); };
    if (raw === "warning" && state === "warning" && !kept.open) {
      kept.open = { ns: now, said_ns: now };
      const at = link.onset_p50_s;
      this.events.push({ ns: now, kind: "warning", access_point: link.access_point, track: link.track,
        text: `${Math.round(100 * steps(link, 9))} %${at == null ? "" : `, in ${Math.round(1000 * at)} ms`}, by ${causeOf(link, "warning")}` });
    }
    if (kept.open && raw === "warning") kept.open.said_ns = now;
    if (raw === "blocked" && kept.last !== "blocked") {
      if (kept.open) { tell("true", `blocked by ${causeOf(link, "blocked")}, told ${((now - kept.open.ns) / 1e9).toFixed(1)} s before`); kept.open = null; }
      else if (!kept.first) tell("missed", `blocked by ${causeOf(link, "blocked")} without a warning`);
    }
    if (kept.open && raw === "clear" && now - kept.open.said_ns > HORIZON_NS) { tell("false", "stayed free after a warning"); kept.open = null; }
  }
  count(now) {
    const sum = { true: 0, false: 0, missed: 0 };
    for (const e of this.events) if (e.kind in sum && e.ns > now - MINUTE_NS) sum[e.kind]++;
    return sum;
  }
}
