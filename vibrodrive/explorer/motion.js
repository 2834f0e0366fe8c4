// The motion: the mass on the shaken incline, its phase curve, and its time curve with a line at the present time.
const WORDS = {up: "slides up", down: "slides down", stick: "sticks", rest: "rests", impact: "hits"};
const SLOPE = 0.16; // angle of the drawn incline in radians; the true angle is not used
const TEMPO = 0.7, HEARD = 2.5; // shakes a second, without and with sound
const FRAME = 0.03, PAUSE = 0.3; // s between two pictures of the mass, and after which it has rested
const still = matchMedia("(prefers-reduced-motion: reduce)").matches; // then it may be heard, but moves only if told so
const clock = {at: 0, playing: !still, still, last: 0};

const move = (head, found) => {
  const finite = (values) => Array.from(values).filter(Number.isFinite);
  const [xi, dxi] = [finite(found.xi), finite(found.dxi)];
  const ends = (values, least) => [Math.min(...values, 0), Math.max(...values, least)];
  for (const name of ["xi", "dxi"]) ({xi, dxi})[name].push(...finite(found[`orbit_${name}`] ?? []));
  page.motion = {head, ...found, over: ends(xi, 1e-9), up: ends(dxi, 1e-9), view: head.view};
  page.limits = Object.fromEntries(Object.entries(head.limits).filter(([, limit]) => limit));
  clock.at %= found.time.at(-1); hush(); draw_motion(); place_handle(box_of());
  page.shown = 0; requestAnimationFrame(() => setTimeout(() => { page.shown = performance.now(); }, 0));
  if (head.done === page.seq) answered(head); else judge();
};

// Begin to draw into a canvas. Return its context, its size in pixels of the page, and the size of its letters.
const begun = (id) => {
  const {offsetWidth: width, offsetHeight: height} = element(id), c = cleared(element(id));
  Object.assign(c, {font: `${0.85 * rem()}px ${css("--font")}`, fillStyle: css("--ink"), strokeStyle: css("--ink"), lineWidth: 0.1 * rem(), lineJoin: "round", textAlign: "left"});
  return {c, width, height, size: 0.85 * rem()};
};
const stroke = (c, points) => {
  c.beginPath();
  for (const point of points) c.lineTo(...point);
  c.stroke();
};

// A curve in the colours of its states or in one colour, broken where a coordinate is not a number.
const draw_curve = (c, state, across, up, colour) => {
  c.lineWidth = 0.1 * rem();
  for (let k = 0; k + 1 < across.length;) {
    const from = k;
    c.strokeStyle = colour ?? css(`--${known.states[state[k]] === "impact" ? "rest" : known.states[state[k]]}`);
    c.beginPath(); c.moveTo(across[k], up[k]);
    while (k + 1 < across.length && state[k] === state[from] && Number.isFinite(up[k + 1])) c.lineTo(across[k + 1], up[++k]);
    c.stroke();
    if (k === from || !Number.isFinite(up[k + 1])) k += Number.isFinite(up[k + 1]) ? 1 : 2;
  }
};
const draw_motion = () => {
  draw_mass();
  if (!page.motion) return;
  const {motion} = page, {time, xi, dxi, head} = motion;
  const scale = ([low, high], from, to) => (v) => from + (to - from) * (v - low) / (high - low);
  {
    const {c, width, height, size} = begun("phase"), across = scale(motion.over, 2.2 * size, width - size), up = scale(motion.up, height - 1.6 * size, 1.4 * size);
    Object.assign(c, {strokeStyle: css("--faint"), lineWidth: 1, fillStyle: css("--quiet")});
    stroke(c, [[across(motion.over[0]), up(0)], [width - size, up(0)]]);
    stroke(c, [[across(0), up(motion.up[0])], [across(0), up(motion.up[1])]]);
    c.fillText("velocity ξ′", 0.3 * size, size); c.textAlign = "right";
    c.fillText("gap ξ", width - 0.3 * size, height - 0.4 * size);
    const {orbit_state: calm, orbit_xi, orbit_dxi} = motion; // the undisturbed motion, pale behind the disturbed one
    if (calm) draw_curve(c, calm, Array.from(orbit_xi, across), Array.from(orbit_dxi, up), css("--sine"));
    draw_curve(c, motion.state, Array.from(xi, across), Array.from(dxi, up));
  }
  const {c, width, height, size} = begun("time"), last = time.at(-1), across = scale([0, last], 0, width), up = scale(motion.over, height - 1.6 * size, 1.4 * size);
  Object.assign(c, {strokeStyle: css("--sine"), lineWidth: 0.06 * rem(), fillStyle: css("--quiet")});
  const low = up(motion.over[0]), high = up(motion.over[1]), {phase} = head;
  stroke(c, Array.from({length: 60 * Math.ceil(last) + 1}, (_, k) => [across(k / 60), low + (high - low) * (1 + Math.sin(2 * Math.PI * k / 60 + phase)) / 6]));
  for (let k = 0; k <= last; k++) c.fillRect(across(k), low, 1, 0.4 * size);
  c.fillText("gap ξ over time, in shakes", 0.3 * size, size);
  c.fillText("shaking sin τ", 0.3 * size, height - 0.4 * size);
  draw_curve(c, motion.state, Array.from(time, across), Array.from(xi, up));
};
const draw_mass = () => {
  const {c, width, height, size} = begun("mechanism"), {motion} = page, at = clock.at;
  const length = Math.min(0.84 * width, 1.7 * height), block = 0.27 * length, wall = 0.05 * length;
  let k = 0, gap = 0.45, state = "rest";
  if (motion) {
    k = Math.max(0, motion.time.findLastIndex((t) => t <= at));
    gap = (Number.isFinite(motion.xi[k]) ? motion.xi[k] : 0) / motion.over[1];
    state = known.states[motion.state[k]];
  }
  c.translate((width - length) / 2, Math.min(height - 1.6 * size, height / 2 + 0.26 * length));
  c.rotate(-SLOPE);
  c.translate(motion ? 0.03 * length * Math.sin(2 * Math.PI * at + motion.head.phase) : 0, 0);
  c.fillStyle = css("--faint"); c.fillRect(0, 0, length, 0.2 * size); c.fillStyle = css("--quiet");
  c.fillRect(0, -1.1 * block, wall, 1.1 * block); // the obstacle moves with the incline
  c.fillStyle = css(`--${state === "impact" ? "down" : state}`);
  const left = wall + gap * (length - wall - block);
  c.beginPath(); c.roundRect(left, -block, block, block, 0.1 * block); c.fill();
  c.textAlign = gap > 0.6 ? "right" : "left";
  if (motion) c.fillText(WORDS[state], left + (gap > 0.6 ? block : 0), -block - 0.5 * size);
  Object.assign(c, {fillStyle: css("--quiet"), textAlign: "left"});
  c.fillText("obstacle", 0, 1.3 * size); c.textAlign = "right";
  if (width > 15 * size) c.fillText("shaken incline", length, 1.3 * size);
  element("moment").style.transform = `translate(${motion ? at / motion.time.at(-1) * element("times").clientWidth : -9}px)`;
};
// Each impact between two times flashes on the dots of the diagram that it makes.
const flash = (from, to) => {
  const {dot_time, dot, view} = page.motion, [[x0, x1], [y0, y1]] = [span("x"), span("y")];
  const turn = parameter("y") === "impact_phase" ? 2 * Math.PI : 0;
  if (view.quantity === page.view.quantity && current("neighbour") && !moved(view).length) dot_time.forEach((hit, n) => {
    if (from < to ? hit <= from || hit > to : hit <= from && hit > to) return;
    const v = dot[n] - turn * Math.floor((dot[n] - y0) / (turn || 1)), ring = make("<i class='flash'></i>");
    Object.assign(ring.style, {left: `${100 * (drawn(view.at, "x") - x0) / (x1 - x0)}%`, top: `${100 * (y1 - v) / (y1 - y0)}%`});
    ring.addEventListener("animationend", () => ring.remove());
    frame.append(ring);
  });
};
const tick = (now) => {
  requestAnimationFrame(tick);
  const sounds = heard(), time = sounds ? sound.context.currentTime : now / 1000, passed = time - clock.last, from = clock.at;
  const rests = page.pressed === true && pointers.part !== "handle"; // while the picture is dragged, it has all the time
  if (passed >= 0 && passed < FRAME) return;
  clock.last = time;
  if (!page.motion || !clock.playing || document.hidden || rests || passed < 0 || passed > PAUSE) return;
  clock.at = (from + passed * (sounds ? HEARD : TEMPO)) % page.motion.time.at(-1);
  if (sounds) schedule(time);
  if (!clock.still) { draw_mass(); flash(from, clock.at); }
};
page.play = () => {
  hush(); Object.assign(clock, {playing: !clock.playing, still: false});
};
element("mechanism").addEventListener("click", () => page.play());
for (const id of ["mechanism", "phase", "time"]) new ResizeObserver(draw_motion).observe(element(id));
requestAnimationFrame(tick);
if (saved) revive().catch((error) => say(String(error), "notice")); else connect();
