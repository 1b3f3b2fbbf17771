// ---------------------------------------------------------------- people: figures that walk
// The pace of each, kept between pictures; a track that says its phase of the gait leads it.
const paces = new Map();
function paceOf(track, time_s) {
  const speed = Math.hypot(track.vx_mps, track.vy_mps), stride_m = .55 + .65 * Math.min(speed, 2);
  let pace = paces.get(track.track);
  if (!pace) paces.set(track.track, pace = { phase: track.track * 2.4, time_s });
  const passed = Math.min(.3, Math.max(-.3, time_s - pace.time_s));
  pace.phase += 2 * Math.PI * speed / stride_m * passed; pace.time_s = time_s;
  if (track.gait_concentration > 2) {   // towards what was measured, never with a jerk
    const off = Math.atan2(Math.sin(track.gait_phase_rad - pace.phase), Math.cos(track.gait_phase_rad - pace.phase));
    pace.phase += .15 * off;
  }
  return { phase: pace.phase, speed };
}
const floorOf = track => track.aabb_max_z_m - track.height_m;
// Limbs of one person as capsules.
function figure(capsules, { x, y, floor, heading, height, phase, speed, wide = 1 }, tint) {
  const h = height / 1.75, w = Math.min(Math.max(wide, .8), 1.3) * h, swing = Math.min(1, speed / 1.3);
  const [c, s] = [Math.cos(heading), Math.sin(heading)];
  const legs = [0, Math.PI].map(of => ({ hip: .42 * swing * Math.sin(phase + of), knee: .1 * swing + .75 * swing * Math.max(0, Math.cos(phase + of)) }));
  const [thigh, shin] = [.43 * h, .43 * h];
  const foot = ({ hip, knee }) => -thigh * Math.cos(hip) - shin * Math.cos(hip - knee);
  const hips = .05 * h - Math.min(...legs.map(foot));
  const at = (ahead, left, up) => [x + ahead * c - left * s, y + ahead * s + left * c, floor + up];
  const clothes = tint.map(v => v * .68), skin = tint.map(v => Math.min(1, .45 + .6 * v));
  legs.forEach((leg, i) => {
    const side = (i ? 1 : -1) * .095 * w, knee = [thigh * Math.sin(leg.hip), hips - thigh * Math.cos(leg.hip)];
    const ankle = [knee[0] + shin * Math.sin(leg.hip - leg.knee), knee[1] - shin * Math.cos(leg.hip - leg.knee)];
    capsules.capsule(at(0, side, hips), at(knee[0], side, knee[1]), .085 * w, .06 * w, clothes);
    capsules.capsule(at(knee[0], side, knee[1]), at(ankle[0], side, ankle[1]), .06 * w, .045 * w, clothes);
    capsules.capsule(at(ankle[0] - .04 * h, side, ankle[1] - .01), at(ankle[0] + .14 * h, side, ankle[1] - .02), .045 * w, .035 * w, clothes);
    const arm = -.5 * swing * Math.sin(phase + (i ? Math.PI : 0)), shoulder = hips + .5 * h, out = side / .095 * .215;
    const elbow = [.28 * h * Math.sin(arm), shoulder - .28 * h * Math.cos(arm)], bent = arm + .25 + .3 * swing;
    const hand = [elbow[0] + .26 * h * Math.sin(bent), elbow[1] - .26 * h * Math.cos(bent)];
    capsules.capsule(at(0, out, shoulder), at(elbow[0], out * 1.06, elbow[1]), .052 * w, .042 * w, tint);
    capsules.capsule(at(elbow[0], out * 1.06, elbow[1]), at(hand[0], out * 1.02, hand[1]), .042 * w, .035 * w, skin);
    capsules.capsule(at(0, side * .9, hips + .02), at(.01, side * 1.25, hips + .44 * h), .1 * w, .115 * w, tint);
  });
  capsules.capsule(at(0, -.12 * w, hips + .48 * h), at(0, .12 * w, hips + .48 * h), .085 * w, .085 * w, tint);
  const top = height - .115 * h;
  capsules.capsule(at(0, 0, hips + .5 * h), at(.01, 0, top), .05 * w, .05 * w, skin);
  capsules.capsule(at(.01, 0, top - .02 * h), at(.015, 0, top + .025 * h), .088 * h, .092 * h, skin);
}
// Where a person will be after so many steps: the ellipse that holds nine of ten.
function ellipse(track, k, up) {
  const xx = track[`cov_xx_s${k}_m2`], xy = track[`cov_xy_s${k}_m2`], yy = track[`cov_yy_s${k}_m2`];
  const middle = (xx + yy) / 2, root = Math.hypot((xx - yy) / 2, xy), turn = Math.atan2(2 * xy, xx - yy) / 2;
  const [a, b] = [middle + root, Math.max(middle - root, 0)].map(v => Math.sqrt(4.605 * v)), [c, s] = [Math.cos(turn), Math.sin(turn)];
  return Array.from({ length: 25 }, (_, i) => { const t = i / 12 * Math.PI, [u, v] = [a * Math.cos(t), b * Math.sin(t)];
    return [track[`x_s${k}_m`] + u * c - v * s, track[`y_s${k}_m`] + u * s + v * c, up]; });
}
