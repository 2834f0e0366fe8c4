// Script of the page: it requests the next view as soon as the last picture is painted, and updates the address. The
// server does everything else.
const PATIENCE = 250; // initial time in ms that a newer view waits for the running request
const page = {
  busy: false, // a view has been requested, and its picture is not yet painted
  pending: false, // the view has changed since the last request
  tapped: false, // another motion has been selected since the last request
  settled: false, // the picture of the last request is painted and complete
  begun: false, // the address contains the first view; each later change is a step of "back"
  over_plane: false, // true if the ranges belong to a map; after a change of mode they still belong to the old mode
  waiting: 0, // timer that will update the address, or 0
  patience: PATIENCE, // the present value of PATIENCE (ms), which grows on a slow machine
  held: 0, // timer that will paint the diagrams even without their picture
  due: false, // a painting of the diagrams is scheduled
  asked: 0, // number of the last request for a picture
  whole: 0, // number of the request whose picture is painted and complete, else 0
  data: null, // the last picture, with its place, its palette, and `head`: its title, status line, …
  document: Bokeh.documents[0],
  seq: 0, sent: 0, began: 0, changed: 0, timer: 0, // number of the last message; times of requests
  scales: {}, // scales of both axes as drawn: linear or log
  kept: {}, // ends of ranges that the server sent, until they are moved
  last: "", // the last view requested
  extra: {}, // fields without widget and range: at, and the ends of the colours (map) or of y (diagram)
  frames: [], latencies: [], // times at which pictures were painted, and their delay after the movement (ms)
  file: null, // the last file downloaded
  words: "", // description of the selected motion
  followed: NaN, // coordinate of the selected motion on the abscissa
  marks: [], // coordinates of the marks on the abscissa
  pinged: 0, // time of the last ping of the server; 0 after the answer
  played: "", // field whose slider the button ▶ moves at present, or ""
  judging: false, // true until the selected motion has been compared with its limits; meanwhile the slider does not move
  fit: false, // the ordinate follows the values, until the user moves the ordinate
  refused: "", // error message of the last request
  numbers: {}, // values of the fields with sliders, from the server
  good: {}, // accepted values of fields; they replace refused values
  pixels: null, // width and height of the frame in pixels of the screen, for which pictures are computed
  status: "", // status line below the diagrams, without COMPILING
  slow: 0, // timer that will show COMPILING
};
window.explorer = page;
const STEADY = 100; // delay of axes and lines in ms, so that they move together with the picture
const COMPILING = "computing …; the first use of a kernel after an installation compiles it (up to a minute)";
const SLOW = 1500; // ms without an answer until COMPILING is shown
const SILENCE = 8000; // ms without an answer of the server until a message is shown
const REST = 300; // ms without a change after which a view becomes a step of "back"

// Disable the "press" gesture. Bokeh would detect it if the mouse rests after the button is pressed, or if the page is
// busy. Then the following movement would be neither a drag nor a tap.
Bokeh.require("core/ui_gestures").UIGestures.press_threshold = 2 ** 31 - 1;

const {MessageSentEvent} = Bokeh.require("document/events");
const plain = (given) => (given instanceof Map ? Object.fromEntries(given) : given);
[acts, symbols, in_si, about] = [acts, symbols, in_si, about].map(plain);
starts = starts.map(plain);
const element = (id) => document.getElementById(id);

// Controls by the names of the fields of a view. To set `value` is the same as to type or choose it.
const fields = {}, sliders = {};
for (const control of document.querySelectorAll("[data-field]")) {
  const name = control.dataset.field, input = element(name), slider = control.querySelector("[type=range]");
  fields[name] = {
    name, control, input, hint: control.title,
    get value() { return input.value; },
    set value(text) { input.value = text; page.enter(this); },
  };
  input.addEventListener("change", () => page.enter(fields[name]));
  if (slider) slider.addEventListener("input", () => page.slide(name));
  if (slider) sliders[name] = slider;
}
page.fields = fields;
const log = (name) => page.scales[name] === "log";
const shown = (u, name) => (log(name) ? Math.pow(10, u) : u);
const drawn = (v, name) => (log(name) ? Math.log10(v) : v);
const unmoved = ({id, start, end}) => page.kept[id]?.[0] === start && page.kept[id]?.[1] === end;
const span = (range, name, low, high) => {
  // for ends that were not moved, return the numbers from the server: 10 ** log10(v) may differ from v in its last bits
  if (unmoved(range)) return {[low]: page.kept[range.id][2], [high]: page.kept[range.id][3]};
  return {[low]: shown(range.start, name), [high]: shown(range.end, name)};
};
const put_span = (range, name, low, high) => {
  const [start, end] = [drawn(low, name), drawn(high, name)];
  page.kept[range.id] = [start, end, low, high];
  range.setv({start, end});
};

page.state = () => {
  const view = {...page.extra};
  for (const [name, field] of Object.entries(fields)) view[name] = refuses(field) ? page.good[name] : field.value;
  Object.assign(view, span(x_range, "scale", "low", "high"));
  if (page.over_plane) Object.assign(view, span(y_range, "y_scale", "y_low", "y_high"));
  else if (!page.fit) Object.assign(view, {bottom: y_range.start, top: y_range.end});
  return view;
};

const refuses = (field) => field.control.classList.contains("refused");
const label_of = ({control}) => control.querySelector("label").textContent;
const accept = (field) => {
  field.control.classList.remove("refused");
  field.input.ariaInvalid = null;
  element(field.name + "-hint").textContent = field.hint;
};

// Mark the field whose name begins an error message. The view then contains the last accepted value of this field.
const refuse = (text) => {
  end_play();
  say(page.refused = text, "notice");
  const field = fields[text.split(" = ")[0]];
  if (!field || refuses(field) || !(field.name in page.good)) return;
  field.control.classList.add("refused");
  field.input.ariaInvalid = "true";
  element(field.name + "-hint").innerHTML = text.replace(field.name, label_of(field)); // the server has escaped the text
  request_picture(true);
};

page.send = () => {
  page.began = page.changed;
  const view = page.state(), only_motion = page.tapped && page.last === but_for_motion(view);
  Object.assign(page, {busy: true, pending: false, tapped: false, sent: performance.now(), last: but_for_motion(view)});
  clearTimeout(page.slow);
  page.slow = setTimeout(() => { if (page.status && said.notice !== GONE) say(COMPILING); }, SLOW); // before the first picture LOADING is shown
  tell({view, only_motion, pixels: page.pixels});
  if (!only_motion) Object.assign(page, {asked: page.seq, settled: false});
};

// Let Bokeh paint a diagram once for each picture and not for each movement of the mouse, which would be slower.
const hold = () => {
  if (page.due) return;
  for (const plot of [first, second]) plot.hold_render = plot.visible; // for a hidden diagram this would start a layout
  clearTimeout(page.held);
  page.held = setTimeout(release, STEADY);
};

const release = () => {
  clearTimeout(page.held);
  if (!first.hold_render) return;
  page.due = true;
  first.hold_render = second.hold_render = false;
};

const but_for_motion = (view) => JSON.stringify({...view, at: null, pixels: page.pixels});

const tell = (message) => {
  if (!("file" in message || message.ping)) page.seq += 1; // files and pings do not replace the running request
  const asked = JSON.stringify({seq: page.seq, ...message});
  page.document._trigger_on_change(new MessageSentEvent(page.document, "asked", asked));
};

page.ask = (again) => {
  page.changed = performance.now();
  if (page.refused && !Object.values(fields).some(refuses)) say(page.refused = "", "notice");
  element("follow").setAttribute("aria-pressed", page.over_plane ? page.extra.bottom === null : page.fit);
  request_picture(again);
};

const request_picture = (again) => {
  if (page.pending) return;
  if (!again && page.last === but_for_motion(page.state())) return;
  if (!page.busy) return page.send();
  page.pending = true;
  page.settled = false;
  clearTimeout(page.timer);
  page.timer = setTimeout(insist, Math.max(0, page.patience - (performance.now() - page.sent)));
};

// Replace the running request. The next request gets twice the time; otherwise a slow machine would finish no request.
const insist = () => {
  if (!page.pending) return;
  page.patience *= 2;
  page.send();
};

const free = () => {
  page.busy = false;
  clearTimeout(page.slow);
  if (page.status) say(page.status);
  release();
  if (page.pending) page.send();
};

page.command = (message) => {
  if (!("file" in message || "start" in message)) say("", "story"); // it describes the previous picture
  if (!("file" in message)) Object.assign(page, {asked: 0, settled: false}); // the running request is obsolete
  tell({view: page.state(), pixels: page.pixels, ...message});
};

const set_field = (name, value) => {
  fields[name].input.value = value;
  accept(fields[name]);
};

// Slider and field of a parameter have the same value; the sliders in `exponents` have its logarithm.
page.slide = (name, again) => {
  const place = Number(sliders[name].value), value = exponents.includes(name) ? Math.pow(10, place) : place;
  set_field(name, String(Number(value.toPrecision(10))));
  arrange();
  page.ask(again);
};

// Number in a field. The server sends the value of an expression with each picture.
const number = ({name, value}) => (Number.isFinite(Number(value)) ? Number(value) : page.numbers[name]);
const follow = (name) => {
  const slider = sliders[name], value = number(fields[name]);
  if (!slider || !Number.isFinite(value)) return;
  slider.value = exponents.includes(name) ? Math.log10(value) : value;
};

const REARRANGE = ["x", "y", "mode", "quantity", "shade", "scale", "y_scale", "scene"];
page.enter = (field) => {
  const {name, value} = field;
  accept(field);
  if (REARRANGE.includes(name)) return page.command({changed: name});
  follow(name);
  arrange();
  page.ask();
};

page.fit_now = () => {
  if (page.over_plane) Object.assign(page.extra, {bottom: null, top: null});
  page.fit = !page.over_plane;
  page.ask(true);
};

// Write a complete view from the server into all widgets and ranges. Then send one request.
page.apply = (view) => {
  for (const [name, field] of Object.entries(fields)) {
    set_field(name, view[name] === null ? "" : String(view[name]));
    follow(name);
  }
  const over_plane = view.mode === "map";
  if (over_plane !== page.over_plane) clear_pictures();
  page.over_plane = over_plane;
  page.scales = {scale: view.scale, y_scale: over_plane ? view.y_scale : "linear"};
  each_axis((axis, upwards) => {
    for (const model of [axis.formatter, axis.ticker]) model.args = {scale: page.scales[upwards ? "y_scale" : "scale"]};
  });
  page.extra = over_plane ? {bottom: view.bottom, top: view.top} : {y_low: view.y_low, y_high: view.y_high};
  page.extra.at = view.at;
  point_at(view.at === null ? NaN : drawn(view.at, "scale"));
  show_words(page.words || (view.at === null || over_plane ? "" : WAITING));
  page.fit = !over_plane && view.bottom === null;
  put_span(x_range, "scale", view.low, view.high);
  if (over_plane) put_span(y_range, "y_scale", view.y_low, view.y_high);
  else if (!page.fit) put_span(y_range, "", view.bottom, view.top);
  arrange();
  page.ask(true);
};

const each_axis = (act) => {
  for (const {below, left} of [first, second]) [below[0], left[0]].forEach(act);
};

// Reasons why a control has no effect now, by name.
const idle = () => {
  const is = (name, value) => fields[name].value === value, why = {};
  const over_plane = is("mode", "map"), along = over_plane ? ["x", "y"] : ["x"];
  const crossed = (name) => along.some((axis) => is(axis, name));
  for (const [name, methods] of Object.entries(acts)) {
    if (!methods.includes(fields.method.value)) why[name] = `acts only if switches are found by ${methods.join(" or ")}`;
  }
  if (is("method", "certified")) why.compare = "compares another method with certified: select fixed or muller above";
  if (!crossed("eps") && number(fields.eps) === 0) why.eta = "acts only where ε > 0";
  if (!crossed("A") || over_plane) why.orbits = "are drawn only in a diagram over A";
  if (over_plane || fields.quantity.value.startsWith("impact")) why.section_phase = "acts only on section points";
  if (is("scene", "SI")) {
    const shown = fields[over_plane ? "shade" : "quantity"].value;
    if (!/\((J|N s|W)\)/.test(in_si[shown])) why.mass = "acts only on momenta, energies and powers of a map";
    for (const name of in_si[shown] === symbols[shown] ? ["a0", "omega0", "g"] : ["a0"]) {
      if (crossed("A")) why[name] = "acts only through A, which is on an axis";
    }
  }
  for (const axis of along) why[fields[axis].value] = "is on an axis: the range of this axis sets its values";
  return why;
};

const named = (name) => (fields.scene.value === "SI" && in_si[name]) || symbols[name];

const arrange = () => {
  const mode = fields.mode.value, over_plane = mode === "map", shown_now = [mode, fields.scene.value];
  const why = idle(), [across, up] = [fields.x.value, fields[over_plane ? "y" : "quantity"].value];
  each_axis((axis, upwards) => { axis.axis_label = named(upwards ? up : across); });
  const two = !over_plane && fields.compare.value === "beside" && fields.method.value !== "certified";
  say(about[mode], "about");
  second.visible = two;
  element("second").hidden = !two;
  mirror(x_range, x2);
  mirror(y_range, y2);
  for (const [name, {control, hint}] of Object.entries(fields)) {
    const where = control.dataset.only, reason = why[name];
    control.hidden = where !== undefined && !shown_now.includes(where);
    for (const part of control.querySelectorAll("input, select, button")) part.disabled = Boolean(reason);
    control.title = reason ? `${label_of(fields[name])} ${reason}.` : hint;
  }
};

// Letters and borders of the figures have the same size as letters and borders of the page.
const scale_letters = () => {
  const size = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const [large, usual] = [1.1 * size, 0.9 * size].map((pixels) => `${pixels.toFixed(1)}px`);
  for (const plot of [first, second, ...small]) {
    for (const axis of [...plot.left, ...plot.below]) {
      Object.assign(axis, {major_label_text_font_size: usual, axis_label_text_font_size: large});
    }
  }
  for (const plot of [first, second]) plot.min_border_left = Math.round((innerWidth > 720 ? 4.6 : 3.8) * size);
};

// Send the size of the frame in pixels, after each painting of the first diagram: pictures are computed for this size.
const measure = () => {
  const {width, height} = pictures[first.id].view.frame.bbox;
  const pixels = [width, height].map((length) => Math.round(length * devicePixelRatio));
  if (!(width > 1 && height > 1) || String(pixels) === String(page.pixels)) return;
  page.pixels = pixels;
  clearTimeout(page.resized);
  if (page.last) page.resized = setTimeout(request_picture, STEADY);
};
window.addEventListener("resize", scale_letters);

// A picture has arrived. Request the next picture immediately, so that it is computed while this picture is painted.
page.paint = (sent) => {
  const data = plain(sent), head = JSON.parse(data.head), began = page.began, answers = page.busy;
  if (head.fit && page.fit && head.seq === page.asked) put_span(y_range, "", ...head.fit);
  page.patience = PATIENCE;
  [first, second].forEach((plot, k) => { if (data.images[k]) draw_picture(plot, data.images[k], data, head.odd); });
  Object.assign(page, {status: head.status, data: {...data, head}});
  say(head.note, "note");
  say(head.title, "title");
  for (const [name, field] of Object.entries(fields)) if (!refuses(field)) page.good[name] = field.value;
  page.numbers = head.numbers;
  const typed = Object.keys(sliders).filter((name) => !Number.isFinite(Number(fields[name].value)));
  typed.forEach(follow);
  if (typed.length) arrange();
  show_window();
  if (head.seq === page.asked) remember(head.address);
  free();
  requestAnimationFrame(() => setTimeout(() => {
    const now = performance.now();
    if (page.frames.length > 20000) page.frames.length = page.latencies.length = 0;
    page.frames.push(now);
    if (answers) page.latencies.push(now - began);
    page.whole = head.complete ? head.seq : 0;
    settle();
  }, 0));
};

const settle = () => {
  const latest = page.last === but_for_motion(page.state()); // the picture must also have the present size
  page.settled = page.whole === page.asked && !page.pending && latest;
  if (page.settled && page.played && !page.judging) play_on();
};

const said = {};
const say = (text, where = "status") => {
  if (said[where] !== text) element(where).innerHTML = said[where] = text;
};

// Write the view into the address after REST ms, as a new step of "back".
const remember = (address) => {
  clearTimeout(page.waiting);
  page.waiting = setTimeout(() => {
    const url = "?token=" + token + (address ? "&" + address : "");
    if (url !== location.search) history[page.begun && !page.played ? "pushState" : "replaceState"](null, "", url);
    page.begun = true;
    page.waiting = 0;
  }, REST);
};
window.addEventListener("popstate", () => page.command({address: location.search.slice(1)}));

// Save a file, or show its text, which can be copied or saved.
const offer = (name, content, text = "") => {
  const link = element("keep");
  URL.revokeObjectURL(link.href);
  Object.assign(link, {href: URL.createObjectURL(new Blob([content])), download: name});
  element("content").value = text;
  if (text) element("text").showModal(); else link.click();
};

const take = ({name, base64}) => {
  page.file = {name, base64};
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  offer(name, bytes, /\.(py|toml)$/.test(name) ? new TextDecoder().decode(bytes) : "");
};

page.hear = (news) => {
  const item = JSON.parse(news);
  page.pinged = 0;
  page.lost(false);
  if (item.apply) page.apply(item.apply);
  if (item.file) take(item.file);
  if (item.refused) refuse(item.refused);
  if (item.note !== undefined) say(item.note, "note");
  if (item.words !== undefined) show_words(page.words = item.words);
  if (item.column !== undefined) point_at(item.column);
  if (item.lost !== undefined || item.words === "") judged(item.lost);
  if (item.done === page.seq) {
    if (item.address !== undefined) remember(item.address);
    free();
    settle();
  }
};

const WAITING = "The motion is being computed …";
const show_words = (text) => {
  say(text, "words");
  element("motion").hidden = element("player").hidden = !text;
};

const point_at = (x) => {
  page.followed = x;
  for (const plot of [first, second]) if (pictures[plot.id]) move_picture(plot);
};

// Select the next motion with a status other than OK.
element("status").addEventListener("click", ({target}) => {
  if (!target.dataset.odd) return;
  const {x, dw, images, head} = page.data, columns = head.odd[target.dataset.odd];
  const places = columns.map((column) => x + (column + 0.5) * dw / images[0].shape[1]);
  page.tap({x: places.find((u) => u > page.followed + 1e-9 * dw) ?? places[0]});
});

const select = (x) => {
  page.extra.at = shown(x, "scale");
  if (page.over_plane) return;
  point_at(x);
  show_words(page.words || WAITING);
};

page.tap = (event) => {
  if (reading.on) return set_mark(event.x);
  select(event.x);
  if (page.over_plane) return page.command({dive: shown(event.y, "y_scale")});
  page.tapped = true;
  page.ask(true);
};

const GONE = "The explorer does not answer. If the program has ended, start it again and open the address that it prints. "
  + "Otherwise this page continues as soon as the explorer answers.";
page.lost = (gone) => {
  if ((said.notice === GONE) !== gone) say(gone ? GONE : page.refused, "notice");
};
page.back = () => {
  page.busy = false;
  page.pinged = 0;
  page.lost(false);
  page.ask(true);
};

// The server answers in milliseconds, also while it computes.
setInterval(() => {
  if (page.pinged) {
    if (performance.now() - page.pinged > SILENCE) page.lost(true);
    return;
  }
  page.pinged = performance.now();
  tell({ping: true});
}, SILENCE / 4);

// A browser may keep a page for "back". When the user returns, the page is reloaded, and its address restores the view.
window.addEventListener("pagehide", () => tell({left: true}));
window.addEventListener("pageshow", (event) => { if (event.persisted) location.reload(); });

// While the second diagram is visible, both diagrams move together.
const mirror = (from, to) => {
  const moved = to.start !== from.start || to.end !== from.end;
  if (second.visible && moved) to.setv({start: from.start, end: from.end});
};

page.moved = (range) => {
  if (range === x2) return mirror(x2, x_range);
  if (range === y2) return mirror(y2, y_range);
  mirror(...(range === x_range ? [x_range, x2] : [y_range, y2]));
  if (unmoved(range)) return;
  delete page.kept[range.id];
  if (page.busy) hold();
  if (range === y_range) page.fit = false;
  page.ask();
};

const press = (id, act) => element(id).addEventListener("click", act);
press("back", () => history.back());
press("reset", () => KEYS.Home());
press("follow", page.fit_now);
press("copy", () => navigator.clipboard.writeText(element("content").value));
press("close", () => KEYS.Escape());
press("full", () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()));
element("save").addEventListener("change", ({target}) => {
  const link = location.href.replace(/token=[^&]*&?/, "");
  const command = `vibrodrive explore "${link}"`;
  if (target.value === "link") offer("link.txt", command, command); else page.command({file: target.value});
  target.value = "";
});
press("grid", ({currentTarget}) => {
  const on = toggle(currentTarget);
  for (const plot of [first, second]) for (const grid of plot.center) grid.visible = on;
});
const toggle = (button) => {
  const on = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", on);
  return on;
};

// Move a slider upwards from its least value, with one complete picture for each step, until the structure of the selected
// motion is lost. If no motion is selected in the window of a diagram, select the motion in the middle.
const STEPS = 50;
const run = (name, place) => {
  const {start, end} = x_range;
  if (!page.over_plane && !(page.followed >= start && page.followed <= end)) select((start + end) / 2);
  sliders[name].value = place;
  Object.assign(page, {played: name, judging: !page.over_plane});
  document.querySelector(`[data-play=${name}]`).textContent = "■";
  page.slide(name, true); // also if the slider is already at its least value
};
const end_play = () => {
  page.played = "";
  for (const button of document.querySelectorAll("[data-play]")) button.textContent = "▶";
};
const play_on = () => {
  const {value, min, max} = sliders[page.played];
  if (Number(value) < max) return run(page.played, Number(value) + (max - min) / STEPS);
  if (!page.over_plane) say(`the structure is kept up to ${label_of(fields[page.played])} = ${fields[page.played].value}`, "note");
  end_play();
};
const judged = (lost) => {
  page.judging = false;
  if (page.played && lost) {
    end_play();
    say(`stopped: ${lost}`, "note");
  }
  settle();
};
for (const button of document.querySelectorAll("[data-play]")) {
  const name = button.dataset.play;
  button.addEventListener("click", () => (page.played ? end_play() : run(name, sliders[name].min)));
}

// Fields with the ends of the window.
const edges = {left: [x_range, "start"], right: [x_range, "end"], lower: [y_range, "start"], upper: [y_range, "end"]};
const scale_of = (range) => (range === x_range ? "scale" : "y_scale");
const show_window = () => {
  for (const [id, [range, end]] of Object.entries(edges)) {
    if (element(id) !== document.activeElement) element(id).value = read_off(range[end], range, 1000, scale_of(range));
  }
};
for (const [id, [range, end]] of Object.entries(edges)) {
  element(id).addEventListener("change", ({target}) => {
    const place = drawn(Number(target.value.replace(",", ".")), scale_of(range));
    if (Number.isFinite(place) && place !== range[end === "end" ? "start" : "end"]) range[end] = place;
  });
}

// Move a range by a share of its width, and make it wider by a factor.
const shift = (range, share, factor = 1) => {
  const middle = (range.start + range.end) / 2 + share * (range.end - range.start);
  const half = factor * (range.end - range.start) / 2;
  range.setv({start: middle - half, end: middle + half});
};
const KEYS = {
  ArrowLeft: () => shift(x_range, -0.1), ArrowRight: () => shift(x_range, 0.1),
  ArrowUp: () => shift(y_range, 0.1), ArrowDown: () => shift(y_range, -0.1),
  "+": () => shift(x_range, 0, 0.5), "-": () => shift(x_range, 0, 2),
  Home: () => page.command({reset: true}),
  Escape: () => { end_play(); page.extra.at = null; point_at(NaN); page.ask(true); },
  Backspace: () => history.back(), f: () => page.fit_now(), " ": () => page.play(), n: () => page.step(),
  x: () => element("full").click(), m: () => element("mark").click(), g: () => element("grid").click(),
};
window.addEventListener("keydown", (event) => {
  const on = (kinds) => event.target.matches?.(kinds);
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (on("input:not([type=range]), select, textarea, summary") && event.key !== "Escape") return;
  if (on("[type=range]") && /Arrow|Home|[+-]/.test(event.key)) return;
  if (on("button") && event.key === " ") return;
  const act = KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});

element("start").addEventListener("change", () => {
  const {name, text, address} = starts[element("start").value];
  element("start").value = ""; // so that the same view can be chosen again
  say(`<b>${name}.</b> ${text}`, "story");
  page.command({address, start: true});
});

scale_letters();
for (const plot of [first, second]) {
  picture_of(plot);
  for (const kind of ["tap", "doubletap"]) plot.on_event(kind, page.tap); // the second of two quick clicks is a double tap
  page.document.event_manager.subscribed_models.add(plot);
}
measure();
for (const range of [x_range, y_range, x2, y2]) range.change.connect(() => page.moved(range));
motion.properties.data.change.connect(() => page.moves());
page.document.on_event("connection_lost", () => page.lost(true));
page.document.on_event("client_reconnected", () => page.back());
page.document.on_message("news", page.hear);
page.document.on_message("forces", (sent) => page.forces(sent));
page.document.on_message("picture", page.paint);
tell({hello: true});

