// What the page does in the browser: it asks for the next view when the last one is painted, keeps the address in step
// with what is shown, and formats the numbers of the axes. Everything else is the server's.
const page = {
  busy: false, // a view has been asked for, and nothing of it painted yet
  pending: false, // the view has changed since
  known: {}, // values of widgets and ranges that have been dealt with: scripts hear of a change later than it is made
  tapped: false, // another motion has been chosen since
  settled: false, // what is painted is complete, and what was asked for last
  begun: false, // the first view stands in the address: from now on each change of it is a step of "back"
  over_plane: false, // a map is shown: when another mode has just been chosen, what the ranges hold is still of this one
  waiting: 0, // timer of an address that is going to be kept
  patience: 0, // ms that a newer view waits for the one under way
  held: 0, // timer of diagrams that are not painted until their picture is there
  due: false, // they are going to be painted
  asked: 0, // number of the request for the picture that is wanted
  answered: 0, // of that for the picture that is painted
  whole: 0, // the same, if that is complete
  seq: 0, sent: 0, began: 0, changed: 0, timer: 0,
  scales: {}, // of both axes, as they are drawn
  kept: {}, // ends of ranges as they were given
  last: "", // the view asked for last
  extra: {}, // fields of a view without a widget, where no range has them: at; the ends of colours, or of a map's ordinate
  frames: [], latencies: [], // when pictures were painted, and how long after the movement that they show (ms)
  heard: 0, // number of the news heard last
  file: null, // what was downloaded last
  words: "", // what is said about the motion that is followed
  followed: NaN, // where that is on the axis
  refused: "", // why the view asked for last is not shown
  status: "", // what is said below the diagrams, but for COMPILING
  slow: 0, // timer until that is said
};
window.explorer = page;
const STEADY = 100; // ms for which axes and lines wait for the picture that is to move with them
const PATIENCE = 250; // ms that a newer view waits for an older one at most, where that before was painted
page.patience = PATIENCE;
const COMPILING = "computing …; what is used for the first time after an installation is compiled, for up to a minute";
const SLOW = 1500; // ms without an answer after which that is said
const REST = 300; // ms for which a view stands before it is a step of "back"

// Where the mouse rests for a moment after it is pressed, or the page is busy then, Bokeh would hold that for a press, and
// neither move the diagram with what follows nor call it a tap.
Bokeh.require("core/ui_gestures").UIGestures.press_threshold = 2 ** 31 - 1;

const plain = (given) => (given instanceof Map ? Object.fromEntries(given) : given);
fields = plain(fields);
sliders = plain(sliders);
only = plain(only);
axes = plain(axes);
page.fields = fields;
const log = (name) => page.scales[name] === "log";
const shown = (u, name) => (log(name) ? Math.pow(10, u) : u);
const drawn = (v, name) => (log(name) ? Math.log10(v) : v);
const span = (range, name, low, high) => {
  // ends that nobody has moved are those that were given: the logarithm of a power has other last bits
  const kept = page.kept[range.id];
  if (kept && kept[0] === range.start && kept[1] === range.end) return {[low]: kept[2], [high]: kept[3]};
  return {[low]: shown(range.start, name), [high]: shown(range.end, name)};
};
const put_span = (range, name, low, high) => {
  const [start, end] = [drawn(low, name), drawn(high, name)];
  page.known[range.id] = start + " " + end;
  range.setv({start, end});
  page.kept[range.id] = [start, end, low, high];
};

page.state = () => {
  const view = {...page.extra};
  for (const [name, field] of Object.entries(fields)) view[name] = field.value;
  Object.assign(view, span(x_range, "scale", "low", "high"));
  if (page.over_plane) Object.assign(view, span(y_range, "y_scale", "y_low", "y_high"));
  else if (!page.fit) Object.assign(view, {bottom: y_range.start, top: y_range.end});
  return view;
};

page.send = () => {
  page.began = page.changed;
  const view = page.state(), only_motion = page.tapped && page.last === but_for_motion(view);
  Object.assign(page, {busy: true, pending: false, tapped: false, sent: performance.now(), last: but_for_motion(view)});
  if (page.refused) say(page.refused = "", notice);
  clearTimeout(page.slow);
  page.slow = setTimeout(() => { if (page.status) say(COMPILING); }, SLOW); // before a first picture it says so already
  tell({view, only_motion});
  if (!only_motion) Object.assign(page, {asked: page.seq, settled: false});
};

// Bokeh paints a diagram once for each picture, not once for each movement of the mouse: that takes longer.
const hold = () => {
  if (page.due) return;
  for (const plot of [first, second]) plot.hold_render = plot.visible; // one that is hidden would be laid out anew
  clearTimeout(page.held);
  page.held = setTimeout(release, STEADY);
};

const release = () => {
  clearTimeout(page.held);
  if (!first.hold_render) return;
  page.due = true;
  first.hold_render = second.hold_render = false;
};

const but_for_motion = (view) => JSON.stringify({...view, at: null});

const tell = (message) => {
  if (!("file" in message)) page.seq += 1; // what is under way is still wanted
  request.data = {message: [JSON.stringify({seq: page.seq, time: performance.now(), heard: page.heard, ...message})]};
};

page.ask = (again) => {
  page.changed = performance.now();
  if (page.pending) return;
  if (!again && page.last === but_for_motion(page.state())) return;
  if (!page.busy) return page.send();
  page.pending = true;
  page.settled = false;
  clearTimeout(page.timer);
  page.timer = setTimeout(insist, Math.max(0, page.patience - (performance.now() - page.sent)));
};

// Give up the view that is under way. Each in turn gets more time, or a slow machine would never finish one.
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
  if (!("file" in message)) Object.assign(page, {asked: 0, settled: false}); // what is under way is not that any more
  tell({view: page.state(), ...message});
};

// Whether a value is another one than that dealt with last; then it is now.
const is_new = (name, value) => {
  const old = page.known[name];
  page.known[name] = value;
  return old !== value;
};

const set_field = (name, value) => {
  page.known[name] = value;
  fields[name].value = value;
};

// Slider and field of one number hold the same value; a slider of orders of magnitude holds its logarithm.
page.slide = ({name, value: place}) => {
  if (!is_new("slider " + name, place)) return;
  const value = exponents.includes(name) ? Math.pow(10, place) : place;
  set_field(name, String(Number(value.toPrecision(10))));
  page.ask();
};

const follow = (name) => {
  const slider = sliders[name], value = Number(fields[name].value);
  if (!slider || !Number.isFinite(value)) return;
  const place = exponents.includes(name) ? Math.log10(value) : value;
  page.known["slider " + name] = Math.min(slider.end, Math.max(slider.start, place));
  slider.value = page.known["slider " + name];
};

const REARRANGE = ["x", "y", "mode", "quantity", "shade", "scale", "y_scale", "scene"];
page.enter = ({name, value}) => {
  if (!is_new(name, value)) return;
  if (REARRANGE.includes(name)) return page.command({changed: name});
  follow(name);
  arrange();
  page.ask();
};

page.fit_now = () => {
  if (fields.mode.value === "map") Object.assign(page.extra, {bottom: null, top: null});
  page.fit = true;
  page.ask(true);
};

// A whole view, from the server: into every widget and range, without a question for each.
page.apply = (view) => {
  for (const [name, field] of Object.entries(fields)) {
    set_field(name, typeof field.value === "string" ? String(view[name]) : view[name]);
    follow(name);
  }
  const over_plane = view.mode === "map";
  if (over_plane !== page.over_plane) clear_pictures();
  page.over_plane = over_plane;
  page.scales = {scale: view.scale, y_scale: view.y_scale};
  page.extra = over_plane ? {bottom: view.bottom, top: view.top} : {y_low: view.y_low, y_high: view.y_high};
  page.extra.at = view.at;
  point_at(view.at === null ? NaN : drawn(view.at, "scale"));
  page.fit = !over_plane && view.bottom === null;
  put_span(x_range, "scale", view.low, view.high);
  if (over_plane) put_span(y_range, "y_scale", view.y_low, view.y_high);
  else if (!page.fit) put_span(y_range, "", view.bottom, view.top);
  arrange();
  page.ask(true);
};

const label = (name) => {
  const field = fields[name], found = field.options.find((option) => option[0] === field.value);
  return found ? found[1] : field.value;
};

const arrange = () => {
  const over_plane = fields.mode.value === "map";
  for (const axis of axes.x) axis.axis_label = label("x");
  for (const axis of axes.y) axis.axis_label = label(over_plane ? "y" : "quantity");
  const two = !over_plane && fields.compare.value === "beside" && fields.method.value !== "certified";
  second.visible = two;
  first.height = second.height = heights[two ? 1 : 0];
  mirror(x_range, x2);
  mirror(y_range, y2);
  for (const [name, items] of Object.entries(only)) {
    for (const item of items) item.visible = name === fields.mode.value || name === fields.scene.value;
  }
  for (const [name, field] of Object.entries(fields)) { // what lies along an axis is set by the window
    field.disabled = name === fields.x.value || (over_plane && name === fields.y.value);
    if (sliders[name]) sliders[name].disabled = field.disabled;
  }
};

// A frame has arrived: the next one is asked for at once, and computed while this one is painted. It can't overtake:
// the browser takes its frames one after the other.
page.painted = () => {
  const head = JSON.parse(frame.data.head[0]), began = page.began, answers = page.busy;
  if (head.fit && page.fit && head.seq === page.asked) {
    put_span(y_range, "", ...head.fit); // of a coarse picture the range may still grow
    page.fit = !head.complete;
    if (head.complete && !page.pending) page.last = but_for_motion(page.state());
  }
  page.patience = PATIENCE;
  draw_picture(first, frame.data);
  if (other.data.head[0] === frame.data.head[0]) draw_picture(second, other.data);
  Object.assign(page, {answered: head.seq, status: head.status});
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

const settle = () => { page.settled = page.whole === page.asked && !page.pending; };

// Past Bokeh's models: a change of theirs lays the whole page out anew.
const said = {};
const say = (text, where = status) => {
  const place = said[where.id] !== text && Bokeh.index.find_one_by_id(where.id)?.shadow_el.querySelector(".bk-clearfix");
  if (place) place.innerHTML = said[where.id] = text;
};

// The address holds the view, a step of "back" for every one at which the mouse has rested.
const remember = (address) => {
  clearTimeout(page.waiting);
  page.waiting = setTimeout(() => {
    const url = "?token=" + token + (address ? "&" + address : "");
    if (url !== location.search) history[page.begun ? "pushState" : "replaceState"](null, "", url);
    page.begun = true;
    page.waiting = 0;
  }, REST);
};
window.addEventListener("popstate", () => page.command({address: location.search.slice(1)}));

const download = ({name, base64}) => {
  page.file = {name, base64};
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

page.hear = () => {
  for (const item of JSON.parse(news.data.items[0])) {
    if (item.number <= page.heard) continue;
    page.heard = item.number;
    if (item.apply) page.apply(item.apply);
    if (item.file) download(item.file);
    if (item.refused !== undefined) say(page.refused = item.refused, notice);
    if (item.picture === page.answered) {
      page.status = item.status;
      if (!page.busy) say(page.status);
    }
    if (item.words !== undefined) say(page.words = item.words, words);
    if (item.done === page.seq) {
      if (item.address !== undefined) remember(item.address);
      free();
      settle();
    }
  }
};

const point_at = (x) => {
  page.followed = x;
  for (const plot of [first, second]) if (pictures[plot.id]) move_picture(plot);
};

page.tap = (event) => {
  if (fields.mode.value === "map") {
    page.extra.at = shown(event.x, "scale");
    return page.command({dive: shown(event.y, "y_scale")});
  }
  page.extra.at = shown(event.x, "scale");
  point_at(event.x);
  page.tapped = true;
  page.ask(true);
};

page.lost = (gone) => {
  say(gone ? "The explorer no longer answers. Start it again, and open the address that it prints." : "", notice);
  if (!gone) { page.busy = false; page.ask(true); }
};

// A browser may keep a page that was left, for "back", with its connection open or cut: the address holds all of it.
window.addEventListener("pagehide", () => tell({left: true}));
window.addEventListener("pageshow", (event) => { if (event.persisted) location.reload(); });

// The second diagram moves as the first one does, while it is there.
const mirror = (from, to) => {
  const moved = to.start !== from.start || to.end !== from.end;
  if (second.visible && moved) to.setv({start: from.start, end: from.end});
};

page.moved = (range) => {
  if (range === x2) return mirror(x2, x_range);
  if (range === y2) return mirror(y2, y_range);
  mirror(...(range === x_range ? [x_range, x2] : [y_range, y2]));
  if (!is_new(range.id, range.start + " " + range.end)) return;
  if (page.busy) hold();
  if (range === y_range) page.fit = false;
  page.ask();
};

tell({hello: true});
