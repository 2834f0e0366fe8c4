// Drawing of the mass on the vibrating incline. If a motion is selected, the drawing shows this motion and its forces,
// otherwise the mass with labels.
const SLOPE = 0.22; // angle of the drawn incline in radians; the true angle is not used
const SPAN = 2; // excitation periods in the picture of the forces
const RIPPLE = 0.005; // with a smaller time step the curve of H is a band, drawn pale so that other curves stay visible
const SINE = "#CC79A7";
const drawn_motion = {at: 0, playing: false, last: 0, forces: null};

// The forces of a motion arrive before its curves.
page.forces = (sent) => {
  const forces = plain(sent);
  const most = (values, least) => Math.max(least, ...Array.from(values, Math.abs).filter(Number.isFinite));
  drawn_motion.forces = {...forces, widest: most(forces.xi, 1e-9), strongest: most(forces.H, 1.2)};
};
page.moves = () => {
  drawn_motion.at = 0;
  if (!motion.data.time.length) {
    drawn_motion.forces = null;
    page.play(false);
  }
  draw_motion();
};

// Index of the last time at or before the present time.
const index_in = (times) => Math.max(0, times.findLastIndex((t) => t <= drawn_motion.at));

// Clear a canvas. Return its context, its size in pixels of the page, the size of its letters, and its ink.
const cleared = (id) => {
  const canvas = element(id), {width, height} = canvas.getBoundingClientRect(), style = getComputedStyle(canvas);
  const c = canvas.getContext("2d"), scale = devicePixelRatio, size = parseFloat(style.fontSize), ink = style.color;
  Object.assign(canvas, {width: width * scale, height: height * scale});
  c.scale(scale, scale);
  Object.assign(c, {font: `${size}px sans-serif`, fillStyle: ink, strokeStyle: ink, lineWidth: 1.5});
  return {c, width, height, size, ink};
};

const line = (c, points) => {
  c.beginPath();
  for (const point of points) c.lineTo(...point);
  c.stroke();
};

const draw_mechanism = (forces) => {
  const {c, width, height, size, ink} = cleared("mechanism");
  const length = Math.min(0.8 * width, 2 * height), block = 0.13 * length;
  const state = forces?.states[index_in(forces.begins)], now = forces && index_in(forces.time);
  const gap = forces ? forces.xi[now] / forces.widest : 0.55; // as a share of the largest ξ
  c.translate((width - length) / 2, 0.76 * height);
  c.rotate(-SLOPE);
  line(c, [[-0.03 * length, 0.35 * block], [1.05 * length, 0.35 * block]]); // ground at rest
  for (const x of [0.1, 0.5, 0.9]) { c.beginPath(); c.arc(x * length, 0.17 * block, 0.15 * block, 0, 7); c.stroke(); }
  if (forces) c.translate(0.035 * length * forces.sine[now], 0);
  line(c, [[0, 0], [length, 0]]);
  c.fillStyle = "#999";
  c.fillRect(0, -1.4 * block, 0.06 * length, 1.4 * block); // the obstacle moves with the incline
  const left = 0.06 * length + gap * (0.9 * length - 0.06 * length - block);
  c.fillStyle = forces ? colours[state] : "#888";
  c.fillRect(left, -block, block, block);
  c.strokeRect(left, -block, block, block);
  c.fillStyle = ink;
  c.fillText(forces ? names[state] : "mass", left, -1.25 * block);
  if (forces) return;
  line(c, [[0.06 * length, -0.5 * block], [left, -0.5 * block]]);
  c.fillText("gap ξ", 0.2 * length, -0.65 * block);
  c.fillText("obstacle", 0, -1.6 * block);
  c.fillText("shaken incline: A sin τ", 0.2 * length, 0.35 * block + 1.3 * size);
};

// The force H, the friction ±1 that it must exceed, and sin τ; below them the states, with a mark at each switch.
const draw_forces = ({time, H, sine, begins, states, strongest}) => {
  const {at} = drawn_motion, from = SPAN * Math.floor(at / SPAN);
  const {c, width, height, size, ink} = cleared("forces"), band = 0.6 * size, middle = (height + size - 2 * band) / 2;
  const across = (t) => width * (t - from) / SPAN, up = (force) => middle - (middle - 1.2 * size) * force / strongest;
  begins.forEach((begin, k) => {
    const end = begins[k + 1] ?? time.at(-1);
    if (end < from || begin > from + SPAN || states[k] < 0) return;
    c.fillStyle = colours[states[k]];
    c.fillRect(across(begin), height - band, across(end) - across(begin), band);
    c.fillStyle = ink;
    c.fillRect(Math.round(across(begin)), height - 2 * band, 1, 2 * band);
  });
  const curve = (values, colour) => {
    c.strokeStyle = colour;
    line(c, Array.from(time, (t, k) => [across(t), up(values[k])]).filter(([x]) => x >= -width && x <= 2 * width));
  };
  c.globalAlpha = time[1] < RIPPLE ? 0.3 : 1;
  curve(H, ink);
  c.globalAlpha = 1;
  curve(sine, SINE);
  Object.assign(c, {strokeStyle: ink, lineWidth: 0.5});
  for (const level of [-1, 1]) line(c, [[0, up(level)], [width, up(level)]]);
  line(c, [[across(at), 1.2 * size], [across(at), height]]);
  c.fillText("force H, friction ±1", 0, size);
  c.fillStyle = SINE;
  c.fillText("sin τ", width - 2.5 * size, size);
};

const draw_motion = () => {
  const {at, forces} = drawn_motion;
  draw_mechanism(forces);
  if (forces) draw_forces(forces);
  moment.location = at; // the line in the time series that shows the time
};

const play = (now) => {
  const m = drawn_motion, speed = 2 ** Number(element("speed").value); // excitation periods a second
  if (!m.playing || !m.forces) return;
  m.at += Math.min(0.1, (now - m.last) / 1000) * speed;
  if (m.at >= m.forces.time.at(-1)) m.at = 0;
  m.last = now;
  draw_motion();
  requestAnimationFrame(play);
};
page.play = (on = !drawn_motion.playing) => {
  Object.assign(drawn_motion, {playing: on, last: performance.now()});
  element("play").textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(play);
};

// Go to the next switch, or after the last switch to the beginning.
page.step = () => {
  page.play(false);
  drawn_motion.at = drawn_motion.forces?.begins.find((begin) => begin > drawn_motion.at) ?? 0;
  draw_motion();
};
page.drawn_motion = drawn_motion;
press("play", () => page.play());
press("step", page.step);
for (const id of ["mechanism", "forces"]) new ResizeObserver(draw_motion).observe(element(id));
draw_motion();
