// The frame with its axes, the picture in it, and the knob that chooses a motion. Coordinates of an axis (span) are its
// values, or their decimal logarithms.
const FINEST = 2 ** -42; // least width of a window as a share of its ends: a few thousand doubles for a thousand columns
const STEADY = 100; // ms that the axes wait for a picture
const WIDEST = 1900; // with more pixels across, as on a projector, a dot takes several pixels
const [axes, canvas, odd_canvas, frame, line, handle] = ["axes", "picture", "odd", "frame", "line", "handle"].map(element);
const context = canvas.getContext("2d", {alpha: false});

const scale_of = (k) => (k === "x" ? page.view.scale : over_plane() ? page.view.y_scale : "linear");
const parameter = (k) => (k === "x" ? page.view.x : over_plane() ? page.view.y : page.view.quantity);
const keys = (k) => (k === "x" ? ["low", "high"] : over_plane() ? ["y_low", "y_high"] : ["bottom", "top"]);
const shown = (u, k) => (scale_of(k) === "log" ? 10 ** u : u);
const drawn = (v, k) => (scale_of(k) === "log" ? Math.log10(Math.max(Number(v), 1e-300)) : Number(v));
const span = (k) => keys(k).map((key, end) => drawn(page.view[key] ?? page.fitted[end], k));
const allowed = (k) => (known.allowed[parameter(k)] ?? [-1e300, 1e300]).map((v) => drawn(v, k));
const name_of = (k) => (page.view.scene === "SI" && known.in_si[parameter(k)]) || known.symbols[parameter(k)];
const factor_of = (k) => known.factor[parameter(k)] ?? 1;

const set_span = (k, start, end) => {
  if (saved) return;
  const [least, most] = allowed(k), [low, high] = [Math.max(start, least), Math.min(end, most)];
  if (!(high - low >= FINEST * Math.max(Math.abs(low), Math.abs(high)))) return;
  keys(k).forEach((key, n) => { page.view[key] = shown([low, high][n], k); });
  element("fit").hidden = k === "x" && element("fit").hidden;
  if (!page.busy) draw();
  else page.due ||= setTimeout(draw, STEADY); // the axes move together with the next picture
  page.ask();
};
const pan = (k, share, [start, end] = span(k)) => {
  const [least, most] = allowed(k), by = Math.min(Math.max(share * (end - start), least - start), most - end);
  set_span(k, start + by, end + by);
};
// Make a window wider by a factor, with the place at this share of its width fixed.
const zoom = (k, factor, share, [start, end] = span(k)) => {
  const still = start + share * (end - start);
  set_span(k, still - factor * (still - start), still + factor * (end - still));
};

// Round numbers (1, 2 or 5 times a power of ten) between two ends, about `most`.
const round = (low, high, most = 8) => {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= rough * (1 - 1e-9)), from = Math.ceil(low / step - 1e-9);
  return Array.from({length: Math.max(0, Math.floor(high / step + 1e-9) - from + 1)}, (_, k) => (from + k) * step);
};
// Coordinates of the ticks. A logarithmic axis has them at 1 to 9, at 1, 2 and 5, or at 1 of each decade, or of some.
const ticks = (k, most) => {
  const [start, end] = span(k), f = factor_of(k);
  return scale_of(k) === "log" ? decades_in(start, end, most) : round(start * f, end * f, most).map((u) => u / f);
};
const decades_in = (start, end, most) => {
  if (end - start < 0.7) return round(10 ** start, 10 ** end, most).map(Math.log10);
  const decades = round(start, end, most).filter(Number.isInteger);
  const within = (factors) => Array.from({length: Math.ceil(end) - Math.floor(start) + 1}, (_, n) => Math.floor(start) + n)
    .flatMap((d) => factors.map((g) => d + Math.log10(g))).filter((u) => u >= start && u <= end);
  return [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1]].map(within).find((places) => places.length <= 1.5 * most) ?? decades;
};
// A number as a book prints it: 2e-4 becomes 2·10⁻⁴.
const pretty = (text) => text.replace(/e\+?(-?)(\d+)$/, (_, sign, power) => `·10${sign && "⁻"}${[...power].map((n) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[n]).join("")}`)
  .replace(/(?<![\d.])1·/, "");
const plain = (v, count) => {
  const n = Math.min(17, Math.max(1, count)), text = Math.abs(v) < 1e-3 ? v.toExponential(n - 1) : v.toPrecision(n);
  if (v === 0) return "0";
  return text.includes("e") ? text.replace(/\.?0+e/, "e") : text.includes(".") ? text.replace(/\.?0+$/, "") : text;
};
// Labels of ticks. On a narrow axis the first is complete and the others are differences from it.
const labels = (places, k) => {
  const values = places.map((u) => shown(u, k) * factor_of(k)), log = scale_of(k) === "log";
  if (values.length < 2) return values.map((v) => plain(v, 12));
  const step = Math.abs(values[1] - values[0]), size = Math.max(...values.map(Math.abs));
  const even = Number(step.toPrecision(2)); // the difference of two rounded numbers has other digits
  const count = (v) => Math.ceil(Math.log10(Math.max(log ? Math.abs(values[0]) : Math.abs(v), step) / step)) + (log ? 3 : 2);
  return values.map((v, n) => (log || step > 1e-5 * size || n === 0 ? plain(v, count(v)) : `+${plain(n * even, 3)}`));
};
// Value at a coordinate, with as many digits as the width of a pixel justifies.
const read_off = (u, k, pixels) => {
  const [start, end] = span(k), v = shown(u, k), step = Math.abs(shown(u + (end - start) / pixels, k) - v);
  return Number(v.toPrecision(Math.min(17, Math.max(1, Math.ceil(Math.log10(Math.max(Math.abs(v), step) / step)) + 1))));
};
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);
const box_of = () => ({left: frame.offsetLeft, top: frame.offsetTop, width: frame.clientWidth, height: frame.clientHeight});

// Clear a canvas, and return its context, whose unit is a pixel of the page.
const cleared = (one) => {
  const {offsetWidth: width, offsetHeight: height} = one, ratio = devicePixelRatio, c = one.getContext("2d");
  const [wide, tall] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (one.width !== wide || one.height !== tall) Object.assign(one, {width: wide, height: tall}); // this takes long
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  return c;
};

// Draw the axes, their labels and the periods of the columns around a box.
const draw_axes = (c, {left, top, width, height}) => {
  const size = 0.9 * rem(), [ink, quiet] = ["--ink", "--quiet"].map(css);
  const [[x0, x1], [y0, y1]] = [span("x"), span("y")];
  const across = (u) => left + width * (u - x0) / (x1 - x0), up = (u) => top + height * (y1 - u) / (y1 - y0);
  Object.assign(c, {font: `${size}px ${css("--font")}`, fillStyle: quiet, textAlign: "center", textBaseline: "top", lineWidth: 1});
  c.fillRect(left, top + height, width, 1);
  const xs = ticks("x", Math.max(2, width / (5.5 * size))), ys = ticks("y", Math.max(2, height / (3.5 * size)));
  labels(xs, "x").map(pretty).forEach((text, k) => {
    const half = c.measureText(text).width / 2, at = Math.min(across(xs[k]), axes.offsetWidth - half); // it may need more room
    c.fillRect(Math.round(across(xs[k])), top + height, 1, 0.35 * size);
    if (!(at + half > page.tag[0] - 4 && at - half < page.tag[1] + 4)) c.fillText(text, at, top + height + 0.75 * size);
  });
  Object.assign(c, {textAlign: "right", textBaseline: "middle"});
  if (page.data || over_plane()) labels(ys, "y").forEach((text, k) => {
    c.fillRect(left - 0.35 * size, Math.round(up(ys[k])), 0.35 * size, 1);
    c.fillText(pretty(text), left - 0.6 * size, up(ys[k]));
  });
  Object.assign(c, {fillStyle: ink, textBaseline: "top", font: `${1.1 * size}px ${css("--font")}`});
  c.fillText(name_of("x"), left + width, top + height + 2.4 * size); c.textAlign = "left";
  c.fillText(name_of("y"), Math.max(0, left - 3.2 * size), Math.max(0, top - 1.9 * size));
  Object.assign(c, {font: `${0.9 * size}px ${css("--font")}`, fillStyle: quiet, textAlign: "center"});
  for (const [from, to, period] of (current("picture") && page.data.spans) || []) {
    const [a, b] = [from, to].map((u) => Math.min(left + width, Math.max(left, across(u)))), room = b - a;
    const text = [`period ${period}`, String(period)].find((one) => c.measureText(one).width < room - 6);
    if (text && period) c.fillText(text, (a + b) / 2, top - 1.7 * size);
    if (!period && room > 6 * size) c.fillText("no period", (a + b) / 2, top - 1.7 * size);
    if (period && room > 3) c.fillRect(a + 1, top - 0.4 * size, room - 2, 0.15 * size);
  }
  c.fillStyle = css("--down");
  for (const [k, start, end] of [["x", x0, x1], ...(over_plane() ? [["y", y0, y1]] : [])]) {
    const k2 = limit_of(parameter(k)), share = (drawn(k2, k) - start) / (end - start), inside = share >= 0 && share <= 1;
    if (!(Math.abs(k2) < Infinity)) continue;
    const clipped = Math.min(1, Math.max(0, share)), x = left + width * clipped, y = top + height * (1 - clipped), s = 0.45 * size;
    c.beginPath();
    if (k === "x" && inside) stroke(c, [[x, top + height], [x - s, top + height + 1.7 * s], [x + s, top + height + 1.7 * s]]);
    if (k === "y" && inside) stroke(c, [[left, y], [left - 1.7 * s, y - s], [left - 1.7 * s, y + s]]);
    c.fill(); c.textAlign = k === "y" || share < 0 ? "left" : share > 1 ? "right" : "center";
    const sign = inside ? "k₂" : share < 0 ? (k === "x" ? "◀ k₂" : "▼ k₂") : k === "x" ? "k₂ ▶" : "▲ k₂";
    if (k === "x") c.fillText(sign, x, top - 1.5 * size); else c.fillText(sign, left + width + 2, Math.min(y, top + height - size));
  }
};

// Draw everything that depends on the window: axes, place of the picture, knob.
const draw = () => {
  clearTimeout(page.due); page.due = 0;
  if (!page.view) return;
  const box = box_of();
  place_handle(box); draw_axes(cleared(axes), box);
  const {data} = page, [[x0, x1], [y0, y1]] = [span("x"), span("y")], across = box.width / (x1 - x0), up = box.height / (y1 - y0);
  canvas.hidden = odd_canvas.hidden = !data;
  if (!data) return;
  const right = (data.x - x0) * across, down = (y1 - data.y - data.dh) * up, wider = data.dw * across / canvas.width;
  canvas.style.transform = `translate(${right}px, ${down}px) scale(${wider}, ${data.dh * up / canvas.height})`;
  odd_canvas.style.transform = `translate(${right}px) scale(${wider}, 1)`;
};
// The place of a motion in words; and what else is different there from the view of the page, or is being moved.
const named = (name, value) => {
  const [symbol, unit] = known.symbols[name].replace(")", "").split(" (");
  return [symbol, "=", pretty(plain(value * known.factor[name], 10)), unit].join(" ").trim();
};
const place_of = (view) => [named(view.x, view.at), ...(over_plane() ? [named(view.y, view.at_y)] : [])].join(", ");
const moved = (view) => BESIDE.filter((name) => (view[name] !== page.view[name] || name === page.pressed) && !hidden_now().includes(name));
// The knob is on the horizontal axis or, in a map, at the point of its motion.
const place_handle = ({left, top, width, height}) => {
  const [[x0, x1], [y0, y1]] = [span("x"), span("y")], map = over_plane(), [tag] = handle.children;
  const x = (drawn(page.view.at, "x") - x0) / (x1 - x0), y = map ? (y1 - drawn(page.view.at_y, "y")) / (y1 - y0) : 1;
  const [at, down] = [x, y].map((share) => Math.min(1, Math.max(0, share))), away = at !== x || down !== y;
  const signs = [[x < 0, "◀ "], [y > 1, "▼ "], [y < 0, "▲ "]].map(([out, sign]) => (out ? sign : "")).join("");
  handle.hidden = line.hidden = !page.motion; // it invites when motions are quick
  handle.classList.toggle("away", away);
  handle.style.transform = `translate(${left + at * width}px, ${top + down * height}px)`;
  line.style.transform = `translate(${x * width}px)`;
  line.hidden ||= map || away; tag.textContent = signs + place_of(page.view) + (x > 1 ? " ▶" : "");
  const half = tag.offsetWidth / 2, middle = Math.max(map ? left + half : half, Math.min(axes.offsetWidth - half, left + at * width));
  Object.assign(tag.style, {left: `${middle - left - at * width}px`, top: map && down > 0.5 ? "-3rem" : ""});
  page.tag = map || handle.hidden ? [NaN, NaN] : [middle - half, middle + half];
  const [low, high, now] = [shown(x0, "x"), shown(x1, "x"), page.view.at].map((v) => v * factor_of("x"));
  Object.assign(handle, {ariaValueMin: low, ariaValueMax: high, ariaValueNow: now, ariaValueText: place_of(page.view)});
};

// Send the size of the frame in dots, for which pictures are computed.
const measure = () => {
  const {width, height} = box_of(), dot = Math.ceil(width / WIDEST);
  const pixels = [width, height].map((length) => Math.round(length / dot));
  if (!(width > 1 && height > 1)) return;
  draw();
  if (String(pixels) === String(page.pixels)) return;
  page.pixels = pixels; clearTimeout(page.resized); page.resized = setTimeout(request, 100);
};
new ResizeObserver(measure).observe(element("figure"));

const clear_picture = () => {
  page.data = null;
  for (const where of ["key", "status"]) say("", where);
  for (const where of ["subject", "conditions"]) say("…", where);
  document.title = "vibrodrive";
  wait(`computing the ${page.view.mode} …`);
};

// Colours of a diagram: scales of `--ink`, `--down` and `--up` on the paper. The colours of a map come with it.
const SHADES = 64;
const rgb = (name) => { // of the system, its colours are words
  context.fillStyle = css(name);
  return [1, 3, 5].map((at) => parseInt(context.fillStyle.slice(at, at + 2), 16));
};
const inks = () => {
  const paper = rgb("--paper"), table = new Uint32Array(3 * SHADES);
  ["--ink", "--down", "--up"].map(rgb).forEach((ink, k) => {
    for (let s = 0; s < SHADES; s++) {
      const share = s && 0.24 + 0.76 * s / (SHADES - 1); // a single dot has a contrast of 3
      const [r, g, b] = paper.map((v, n) => Math.round(v + (ink[n] - v) * share));
      table[k * SHADES + s] = (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    }
  });
  return table;
};
// Each pixel of a picture is an index into its palette; the first row is the lowest.
const colour = () => {
  const {image, palette, odd} = page.data, [rows, columns] = image.shape, table = palette.length ? palette : page.inks ??= inks();
  if (!page.cells || canvas.width !== columns || canvas.height !== rows) {
    Object.assign(canvas, {width: columns, height: rows});
    page.cells = context.createImageData(columns, rows);
  }
  const colours = new Uint32Array(page.cells.data.buffer);
  for (let row = 0, k = 0; row < rows; row++) {
    for (let spot = (rows - 1 - row) * columns, end = spot + columns; spot < end;) colours[k++] = table[image[spot++]];
  }
  context.putImageData(page.cells, 0, 0);
  Object.assign(odd_canvas, {width: columns, height: 1}).style.width = `${columns}px`;
  const marks = odd_canvas.getContext("2d");
  for (const [words, places] of Object.entries(odd)) {
    marks.fillStyle = css(words.includes("rest") ? "--quiet" : "--down");
    for (const column of places) marks.fillRect(column, 0, 1, 1);
  }
};
const paint = (head, {image, palette}) => {
  const answers = page.busy, {began, data: before} = page;
  if (kind_of(head.view) !== page.kind) return; // a late picture of an earlier kind
  page.data = {...head, image, palette}; page.patience = PATIENCE;
  const latest = current("window"), rests = before && (page.pressed || page.played);
  if (head.fit && page.view.bottom === null && !head.map && latest && !rests) page.fitted = [head.y, head.y + head.dh];
  colour(); draw(); caption(head);
  if (latest && head.seq) remember(head.address);
  wait("");
  requestAnimationFrame(() => setTimeout(() => {
    const now = performance.now();
    if (head.seq) page.frames.push(now);
    if (answers) page.latencies.push(now - began);
    page.settled ||= head.seq > 0 && head.complete && current("window") && page.last === but_for_motion(page.state());
  }, 0));
};
const caption = ({title, conditions, key, count, share: ready, left, complete, counts, empty}) => {
  say(title, "subject");
  document.title = `${title} – vibrodrive`;
  say(conditions, "conditions");
  const swatches = key.swatches.map(([colour, name]) => `<span class="entry"><i style="background: ${colour}"></i>${name}</span>`);
  const [low, high, log] = key.ends, values = log ? decades_in(Math.log10(low), Math.log10(high), 5).map((u) => 10 ** u) : round(low, high, 6);
  const share = (v) => (log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low));
  const numbers = values.map((v) => `<span style="left: ${100 * share(v)}%">${pretty(plain(v, 4))}</span>`);
  const bar = key.scale.length ? `<span class="bar"><i style="--scale: ${key.scale}"></i>${numbers.join("")}</span>` : "";
  say(bar + swatches.join(""), "key");
  const odds = Object.entries(counts).map(([words, n]) => `${n} ${words}`);
  const more = left < 2 ? "" : `, about ${left < 90 ? `${Math.ceil(left)} s` : `${Math.ceil(left / 60)} min`} more`;
  const text = complete ? [`${count} motions`, ...odds].join(" · ") : `coarse, ${Math.round(100 * ready)} % of ${count} motions${more}`;
  say((empty ? "no value in this window: press F · " : "") + text, "status");
};

// Show the motion at a place in pixels or, on a saved page, the nearest one that is stored.
const choose_at = (x, y) => {
  const {width, height} = box_of(), at = (k, share, size) => {
    const [low, high] = span(k);
    return read_off(low + Math.min(1, Math.max(0, share)) * (high - low), k, size);
  };
  page.view.at = at("x", x / width, width);
  if (over_plane() && !saved) page.view.at_y = at("y", 1 - y / height, height);
  const away = (place) => Math.abs(drawn(place, "x") - drawn(page.view.at, "x"));
  if (saved) page.view.at = known.places.reduce((one, other) => (away(other) < away(one) ? other : one));
  draw(); page.ask();
};
press("dive", () => page.command({changed: "mode", view: {...page.state(), mode: "diagram", [page.view.y]: page.view.at_y}}));

// The mouse and fingers: `down` contains their places; `from` the windows when the last of them went down or up.
const pointers = {down: new Map(), from: null, far: false, part: ""};
const inside = (event) => {
  const {left, top} = frame.getBoundingClientRect();
  return [event.clientX - left, event.clientY - top];
};
const begin = () => {
  const places = [...pointers.down.values()];
  pointers.from = {places, x: span("x"), y: span("y")};
  page.pressed = places.length > 0;
};
const figure = element("figure");
figure.addEventListener("pointerdown", (event) => {
  if (!page.view || event.target.closest("button")) return;
  const [x, y] = inside(event), {width, height} = box_of();
  const part = event.target.closest("#handle") ? "handle" : x < 0 ? "y" : y > height ? "x" : "frame";
  if (part === "frame" && (x > width || y < 0)) return;
  figure.setPointerCapture(event.pointerId);
  if (!pointers.down.size) Object.assign(pointers, {far: false, part});
  pointers.down.set(event.pointerId, [x, y]); begin();
});
figure.addEventListener("pointermove", (event) => {
  const place = inside(event), {width, height} = box_of(), {down, part, from} = pointers;
  if (!down.has(event.pointerId)) return;
  down.set(event.pointerId, place);
  if (part === "handle") return choose_at(...place);
  const places = [...down.values()], both = places.length > 1, up = part === "y" || over_plane() || event.shiftKey;
  const middle = (all) => [0, 1].map((n) => all.reduce((sum, one) => sum + one[n], 0) / all.length);
  const [[x0, y0], [x1, y1]] = [middle(from.places), middle(places)];
  pointers.far ||= both || Math.hypot(x1 - x0, y1 - y0) > 4;
  if (!pointers.far) return;
  const apart = (all) => Math.max(20, both ? Math.abs(all[0][0] - all[1][0]) : 20), by = apart(from.places) / apart(places);
  if (both) zoom("x", by, x0 / width, from.x);
  if (both && over_plane()) zoom("y", by, 1 - y0 / height, from.y);
  if (both) return;
  if (part !== "y" && !(event.shiftKey && !over_plane())) pan("x", (x0 - x1) / width, from.x);
  if (up && part !== "x") pan("y", (y1 - y0) / height, from.y);
});
const lift = (event) => {
  if (!pointers.down.delete(event.pointerId)) return;
  const dragged = pointers.far;
  if (event.type === "pointerup" && !dragged && pointers.part !== "y") choose_at(...inside(event));
  pointers.far = true; // the other finger does not click
  begin(); judge();
  if (!page.pressed && dragged && page.view.bottom === null) page.ask(true); // the ordinate may move now
};
for (const kind of ["pointerup", "pointercancel"]) figure.addEventListener(kind, lift);
figure.addEventListener("wheel", (event) => {
  event.preventDefault();
  const [x, y] = inside(event), {width, height} = box_of(), factor = Math.exp(0.002 * (event.deltaY || event.deltaX));
  if (x >= 0 && !(event.shiftKey && y < height)) zoom("x", factor, x / width);
  if (x < 0 || (y < height && (event.shiftKey || over_plane()))) zoom("y", factor, 1 - y / height);
}, {passive: false});
handle.addEventListener("keydown", (event) => {
  const {left, top} = handle.getBoundingClientRect(), {width} = box_of(), most = 1e9, size = event.shiftKey ? 20 : 2;
  const by = {ArrowLeft: -size, ArrowRight: size, ArrowDown: -size, ArrowUp: size, PageDown: -width / 10, PageUp: width / 10, Home: -most, End: most}[event.key];
  if (!by) return;
  event.preventDefault();
  const up = over_plane() && !saved && /Arrow(Up|Down)/.test(event.key), [x, y] = inside({clientX: left, clientY: top}), {at} = page.view;
  let far = 1; // as far as a saved page needs it for another motion
  do choose_at(x + (up ? 0 : far * by), y - (up ? by : 0)); while (saved && page.view.at === at && far++ < width);
});

// The picture as PNG, as on the page, with twice as many pixels, its axes, and all texts and colours of title and key.
const whole_picture = () => {
  const ratio = 2 * devicePixelRatio, out = document.createElement("canvas"), c = out.getContext("2d"), size = rem();
  const [top, {left, width}, {bottom}, box] = [element("title"), figure, element("foot"), frame].map((one) => one.getBoundingClientRect());
  Object.assign(out, {width: ratio * (width + 2 * size), height: ratio * (bottom - top.top + 2 * size)});
  c.scale(ratio, ratio); c.fillStyle = css("--paper"); c.fillRect(0, 0, out.width, out.height);
  c.translate(size - left, size - top.top); c.imageSmoothingEnabled = false;
  c.save(); c.beginPath(); c.rect(box.left, box.top, box.width, box.height); c.clip();
  for (const one of [canvas, odd_canvas]) {
    const place = one.getBoundingClientRect();
    c.drawImage(one, place.left, place.top, place.width, place.height);
  }
  c.restore(); c.save(); c.translate(left, box.top - frame.offsetTop); draw_axes(c, box_of()); c.restore();
  Object.assign(c, {textAlign: "left", textBaseline: "middle"});
  for (const one of document.querySelectorAll("#title, #subject, #conditions, #key *, #line:not([hidden]), #handle:not([hidden]), #handle output")) {
    const {left: x, top: y, width: wide, height} = one.getBoundingClientRect(), style = getComputedStyle(one), text = one.lastChild;
    const shades = c.createLinearGradient(x, 0, x + wide, 0), {scale} = page.data.key, range = document.createRange();
    scale.forEach((colour, k) => shades.addColorStop(k / (scale.length - 1), colour));
    Object.assign(c, {font: style.font, fillStyle: one.parentNode.className === "bar" ? shades : style.backgroundColor});
    if (one === handle) { c.fillStyle = css("--accent"); c.beginPath(); c.arc(x, y, 0.5 * size, 0, 7); c.fill(); }
    if (one === line || /^(I|OUTPUT)$/.test(one.tagName)) c.fillRect(x, y, wide, height);
    if (text?.nodeType !== 3) continue;
    range.selectNode(text); c.fillStyle = style.color;
    c.fillText(text.data, range.getBoundingClientRect().left, y + height / 2);
  }
  return out;
};
press("png", () => whole_picture().toBlob((content) => save(`${parameter("y")}_over_${page.view.x}.png`, content)));

for (const feature of ["prefers-color-scheme: dark", "forced-colors: active"]) {
  matchMedia(`(${feature})`).addEventListener("change", () => {
    page.inks = null;
    if (page.data) colour();
    draw(); draw_motion();
  });
}
