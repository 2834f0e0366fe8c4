// The mass on the shaking incline: a drawing with labels if no motion is selected, else the selected motion.
const SLOPE = 0.22; // radians, for the eye: the angle of the incline is not drawn to scale
const drawn_motion = {canvas: element("mechanism"), at: 0, playing: false, last: 0, time: [], xi: [], state: [], most: 1};

// Join the curves of the states, each of which is NaN during the others.
page.moves = () => {
  const data = motion.data, curves = data.xi.slice(0, -1), m = drawn_motion;
  m.time = data.time.length ? Array.from(data.time[0]) : [];
  m.state = [];
  m.xi = [];
  m.time.forEach((_, i) => { // at an impact no curve has a value: keep the state and the place before the impact
    const state = curves.findIndex((curve) => Number.isFinite(curve[i]));
    m.state.push(state < 0 ? m.state.at(-1) ?? 0 : state);
    m.xi.push(state < 0 ? m.xi.at(-1) ?? 0 : curves[state][i]);
  });
  m.most = Math.max(1e-9, ...m.xi.filter(Number.isFinite));
  m.at = 0;
  draw_mechanism();
};

// Index of the last point of the motion at or before a time.
const point_of = (time) => Math.max(0, drawn_motion.time.findLastIndex((t) => t <= time));

const draw_mechanism = () => {
  const m = drawn_motion, {canvas} = m, moves = m.time.length > 0;
  const {width, height} = canvas.getBoundingClientRect();
  if (!width) return;
  const scale = devicePixelRatio, c = canvas.getContext("2d"), style = getComputedStyle(canvas);
  Object.assign(canvas, {width: width * scale, height: height * scale});
  const i = moves ? point_of(m.at) : 0, xi = moves ? m.xi[i] : 0.55 * m.most;
  const ink = style.color, colour = moves ? colours[m.state[i]] : "#888";
  const size = parseFloat(style.fontSize), length = 0.8 * width, block = 0.13 * length;
  const phase = 2 * Math.PI * m.at, shake = moves ? 0.035 * length * Math.sin(phase) : 0;
  c.scale(scale, scale);
  c.font = `${size}px sans-serif`;
  c.fillStyle = c.strokeStyle = ink;
  c.lineWidth = 1.5;
  c.translate(0.1 * width, 0.76 * height);
  c.rotate(-SLOPE);
  const line = (...points) => { c.beginPath(); points.forEach(([x, y], k) => (k ? c.lineTo(x, y) : c.moveTo(x, y))); c.stroke(); };
  line([-0.03 * length, 0.35 * block], [1.05 * length, 0.35 * block]); // ground at rest
  for (const x of [0.1, 0.5, 0.9]) { c.beginPath(); c.arc(x * length, 0.17 * block, 0.15 * block, 0, 7); c.stroke(); }
  c.translate(shake, 0);
  line([0, 0], [length, 0]);
  c.fillStyle = "#999";
  c.fillRect(0, -1.4 * block, 0.06 * length, 1.4 * block); // the obstacle moves with the incline
  const left = 0.06 * length + (xi / m.most) * (0.9 * length - 0.06 * length - block);
  c.fillStyle = colour;
  c.fillRect(left, -block, block, block);
  c.strokeRect(left, -block, block, block);
  c.fillStyle = ink;
  if (moves) {
    c.fillText(names[m.state[i]], left, -1.25 * block);
  } else {
    line([0.06 * length, -0.5 * block], [left, -0.5 * block]);
    c.fillText("gap ξ", 0.2 * length, -0.65 * block);
    c.fillText("mass", left, -1.25 * block);
    c.fillText("obstacle", 0, -1.6 * block);
    c.fillText("shaken incline: A sin τ", 0.2 * length, 0.35 * block + 1.3 * size);
  }
  moment.location = m.at; // the line in the time series that shows the time
};

const play = (now) => {
  const m = drawn_motion, speed = 2 ** Number(element("speed").value); // excitation periods a second
  if (!m.playing || !m.time.length) return;
  m.at += Math.min(0.1, (now - m.last) / 1000) * speed;
  if (m.at >= m.time.at(-1)) m.at = 0;
  m.last = now;
  draw_mechanism();
  requestAnimationFrame(play);
};
page.play = (on = !drawn_motion.playing) => {
  Object.assign(drawn_motion, {playing: on, last: performance.now()});
  element("play").textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(play);
};

// Go to the next switch: the next point with another state.
page.step = () => {
  const m = drawn_motion, from = point_of(m.at);
  page.play(false);
  const next = m.state.findIndex((state, i) => i > from && state !== m.state[i - 1]);
  m.at = m.time[Math.max(0, next)] ?? 0;
  draw_mechanism();
};
page.drawn_motion = drawn_motion;
press("play", () => page.play());
press("step", page.step);
new ResizeObserver(draw_mechanism).observe(drawn_motion.canvas);
draw_mechanism();
