// ---------------------------------------------------------------- a recording: any place, any speed
const CHUNK = 20;                    // frames that are asked for at once
const CHUNKS_KEPT = 30;
const BEFORE = 5;                    // chunks before a jump that histories are made of
let recording = null;
async function openRecording() {
  const about = await (await fetch("/api/recording")).json();
  recording = { about, at: 0, chunks: new Map(), asked: new Set(), taken: -1, before: false, near: () => [] };
  $("speed").value = [...$("speed").options].map(o => +o.value).reduce((a, b) => Math.abs(b - about.rate) < Math.abs(a - about.rate) ? b : a);
  document.body.classList.add("recorded");
  document.body.classList.toggle("has-truth", about.truth);
  recording.near = () => { const list = []; for (let k = Math.max(0, Math.floor(recording.at) - 99); k <= recording.at; k++) { const e = entry(k); if (e) list.push(e.frames[0]); } return list; };
  setInterval(async () => { try { recording.about = await (await fetch("/api/recording")).json(); } catch { /* the next may come */ } }, 1000);
}
const entry = k => { const chunk = recording.chunks.get(Math.floor(k / CHUNK)); return chunk && chunk[k % CHUNK]; };
async function load(number) {
  const { chunks, asked, about } = recording, have = chunks.get(number);
  if (number < 0 || number * CHUNK >= about.frames || asked.has(number) || (have && (have.length === CHUNK || have.length >= about.frames - number * CHUNK))) return;
  asked.add(number);
  try {
    const answer = await fetch(`/api/recording/frames?from=${number * CHUNK}&count=${CHUNK}`);
    if (answer.ok) { chunks.delete(number); chunks.set(number, await answer.json()); drawn = false;
      while (chunks.size > CHUNKS_KEPT) chunks.delete(chunks.keys().next().value); }
  } catch { /* it is asked for again */ } finally { asked.delete(number); }
}
function seek(k) {
  recording.at = Math.min(Math.max(k, 0), Math.max(recording.about.frames - 1, 0));
  recording.before = true;
  boarded = 0; wake();
}
function play(passed_s) {
  const r = recording, speed = +$("speed").value, last = r.about.frames - 1;
  if (last < 0) return;
  const chunk = Math.floor(r.at / CHUNK);
  load(chunk); load(chunk + 1); if (speed > 4) { load(chunk + 2); load(chunk + 3); }
  const there = k => !!entry(k);
  if (!paused && there(Math.floor(r.at))) {
    let next = r.at + passed_s * speed * 10;
    while (Math.floor(next) > Math.floor(r.at) && !there(Math.floor(next))) next = Math.floor(next) - 1e-6;   // what is not there yet is waited for
    r.at = Math.max(r.at, Math.min(next, last + .99));
    if (r.at >= last + .9 && r.about.done) { if (r.about.again) seek(0); else { r.at = last; pause(true); } }
  }
  const now = Math.floor(r.at);
  if (!there(now)) return;
  // Histories take every frame on the way, in order; after a jump those of the seconds before it, once they are there.
  const first = Math.max(0, chunk - BEFORE);
  if (r.before) for (let k = first; k < chunk; k++) load(k);
  if (r.before && Array.from({ length: chunk - first }, (_, i) => there((first + i) * CHUNK)).every(Boolean)) { r.before = false; r.taken = first * CHUNK - 1; links.forEach(l => l.begin()); }
  if (now < r.taken || now - r.taken > 200) r.taken = now - 1;
  for (let k = r.taken + 1; k <= now; k++) { const e = entry(k); if (e) e.frames.forEach((frame, i) => { frame.truth = e.truth; frame.mode = r.about.modes[i]; links[i].take(frame); }); }
  r.taken = now;
  const e = entry(now);
  if (e.frames[0].looks == null) e.frames.forEach((frame, i) => { frame.truth = e.truth; frame.mode = r.about.modes[i]; links[i].take(frame); });
  if (shown !== e.frames[0]) { shown = e.frames[0]; beside = e.frames[1] || null; drawn = false; }
  $("scrub").max = last; if (document.activeElement !== $("scrub") || !paused) $("scrub").value = now;
}
function tellRecording() {
  const { about, at } = recording, state = $("state");
  const bad = about.told ? "bad" : "";
  if (state.className !== bad) state.className = bad;
  if (about.frames === 0) return say(state, "computing the first frame");
  say(state, `${shown ? shown.tracks.filter(t => t.confirmed).length : 0} people, frame ${Math.floor(at) + 1} of ${about.frames}${about.done ? "" : ", computing on"}` +
    (shown ? `, ${clock(shown.time_ns)}` : "") + (about.modes.length > 1 ? `; ${about.modes.join(" and ")}` : "") + (about.told ? `; ${about.told}` : ""));
  say($("when"), `${(at / 10).toFixed(1)} s`);
}
