"use strict";
// The page and its server: one view at a time. The page requests the next picture as soon as the last one is painted.
const PATIENCE = 250; // ms that a newer view first waits for the running request; it doubles on a slow machine
const SLOW = 1200; // ms without an answer until the page says that it computes
const SILENCE = 8000; // ms without any answer of the server until a message is shown
const COMPILES = 30; // s to compile all kernels of the page on two idle cores (benchmarks/first_picture.py)
const REST = 300; // ms without a change after which a view becomes a step of "back"
const element = (id) => document.getElementById(id);
const known = JSON.parse(element("known").textContent);
// Text that the browser keeps under a name until the next visit: "" if there is none, or if it refuses to keep any.
const kept = (name, text) => {
  try {
    if (text !== undefined) localStorage.setItem(name, text);
    return localStorage.getItem(name) ?? "";
  } catch {
    return "";
  }
};
const saved = known.places.length > 0; // the page is a file without a server
document.body.classList.toggle("saved", saved);
const token = new URLSearchParams(location.search).get("token");
const page = {
  view: null, // all fields of the view (view.py); texts that the user has typed stay texts
  good: {}, // the last view that the server has accepted
  fitted: [-1, 1], // range of the values, which the ordinate shows unless it was moved
  busy: false, // a view has been requested, and its answer has not yet arrived
  pending: false, // the view has changed since the last request
  again: false, // the picture is wanted even if only the place of the motion has changed
  settled: false, // the picture of the last request is painted and complete
  begun: false, // the address contains the first view; each later change is a step of "back"
  pressed: false, // a button of the mouse or a finger is down, or the name of the slider that moves: the ordinate rests
  patience: PATIENCE, seq: 0, since: 0, changed: 0, began: 0, pinged: 0, timer: 0, slow: 0, waiting: 0, resized: 0,
  kind: "", // what the picture shows
  waits: "", // what is said while nothing arrives
  last: "", // the last picture requested
  data: null, // head of the last picture, with its view
  motion: null, // head and arrays of the motion that is shown, with its view
  limits: {}, // its limits k₂, by name
  played: "", // field whose slider ▶ moves at present
  refused: "", pixels: null, file: null,
  shown: 0, // time at which the motion was painted, 0 until it is
  frames: [], latencies: [], // times at which pictures were painted, and their delay after the change (ms)
};
window.explorer = page;
let socket = null;

const said = {};
const say = (text, where) => {
  if (said[where] !== text) element(where).innerHTML = (said[where] = text).replaceAll(" = ", "\u00a0=\u00a0"); // one word
};
const over_plane = () => page.view.mode === "map";

// What is on the page belongs to one setting. A picture, a motion or a limit of another view is dimmed, and says nothing
// (`judge`), if a field differs on which it depends: a picture that is moved or zoomed keeps its place on the axes, and
// a motion from which the knob or a slider has moved on is its neighbour, and keeps its sentence, which names its place.
const PLACES = ["at", "at_y"], WINDOW = ["low", "high", "columns", "y_low", "y_high", "rows"], ENDS = ["bottom", "top"];
const LOOK = [...PLACES, ...WINDOW, ...ENDS, "scale", "y_scale", "quantity", "shade", "compare"], DRAWN = [...LOOK, "mode", "x", "y"];
const BESIDE = Object.keys(known.factor).filter((name) => name !== "eps" && name !== "dtau"); // they have a limit
const SEARCHED = [...DRAWN, "section_phase", "transient", "periods", "tol", "dtau"];
const FREE = {window: PLACES, picture: [...PLACES, ...WINDOW], neighbour: [...LOOK, ...BESIDE], motion: DRAWN, dtau: SEARCHED, eps: [...SEARCHED, "method", "eps"]};
const setting = (view, what) => {
  const [at, at_y] = what === "neighbour" ? ["x", "y"] : [view.at, view.at_y];
  const on_axes = what in {window: 0, picture: 0} ? {} : {[view.x]: at, ...(view.mode === "map" && {[view.y]: at_y})};
  const free = what === "picture" && view.mode !== "map" ? [...FREE.picture, ...ENDS] : FREE[what];
  return JSON.stringify({...view, ...on_axes, ...Object.fromEntries(free.map((name) => [name, 0]))});
};
const current = (what) => {
  const view = (what in {window: 0, picture: 0} ? page.data : page.motion)?.view;
  return Boolean(view) && setting(view, what) === setting(page.view, what);
};
const connect = () => {
  const address = new URL(`ws?token=${token}`, location.href);
  address.protocol = address.protocol.replace("http", "ws"); socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    page.pinged = 0;
    if (page.view) return document.hidden || request(true); // who looks at another page waits for that one
    apply(known.view);
    if (known.refused) refuse(known);
    stored().then(([first]) => !first || page.data || receive(first, {view: known.view})); // until a picture is computed
  };
  socket.onclose = () => {
    page.busy = false; lost(GONE);
    fetch(location).then((answer) => answer.status === 403 && answer.text().then(lost), () => {}); // another token now
    setTimeout(connect, 1000);
  };
  socket.onmessage = ({data}) => {
    page.pinged = 0; lost("");
    if (typeof data === "string") hear(JSON.parse(data)); else receive(data);
  };
};
// Take a message with arrays (session.py), or with more in its head.
const receive = (data, more) => {
  const length = new DataView(data).getInt32(0, true);
  const head = {...JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))), ...more}, found = {};
  const kinds = {u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i1: Int8Array, f4: Float32Array};
  for (const [name, [type, shape, at]] of Object.entries(head.arrays)) {
    const size = shape.reduce((a, b) => a * b, 1);
    found[name] = Object.assign(new kinds[type](data, 4 + length + at, size), {shape});
  }
  ({picture: paint, motion: move})[head.kind](head, found);
};
// Such messages that the page contains.
const stored = () => Promise.all(known.stored.map((text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}));
const tell = (message) => {
  if (!(message.ping || message.toml || message.save)) page.seq += 1; // these replace no running request
  if (socket.readyState === 1) socket.send(JSON.stringify({seq: page.seq, ...message}));
};
// A saved page answers itself: with its picture, and with the motion that is stored for the place of the knob.
const revive = async () => {
  const [picture, ...motions] = await stored(), {address, places} = known;
  socket = {readyState: 1, send: (text) => setTimeout(() => {
    const {seq, view, only_motion} = JSON.parse(text);
    if (!only_motion) receive(picture, {seq, view, address});
    receive(motions[places.indexOf(view.at)], {done: seq, view, address});
  })};
  apply(known.view);
};
const GONE = "The explorer does not answer. If its program has ended, start it again and open the address that it prints.";
const lost = (gone) => {
  if (gone && page.played) end_play();
  if (document.body.classList.toggle("gone", Boolean(gone)) || said.notice === said.gone) say(said.gone = gone, "notice");
};
document.addEventListener("visibilitychange", () => document.hidden || request(true));
setInterval(() => {
  if (document.hidden || saved || !socket || socket.readyState !== 1) return;
  if (page.pinged && performance.now() - page.pinged > SILENCE) lost(GONE);
  if (page.pinged) return;
  page.pinged = performance.now();
  tell({ping: true});
}, 1000);

page.state = () => ({...page.view});
const but_for_motion = (view) => setting(view, "window") + page.pixels;

const send = () => {
  const view = page.state(), last = but_for_motion(view), only_motion = !page.again && page.last === last;
  Object.assign(page, {busy: true, pending: false, again: false, since: performance.now(), began: page.changed, last});
  page.settled &&= only_motion;
  clearTimeout(page.slow); page.slow = setTimeout(() => wait("computing …"), SLOW);
  tell({view, only_motion, pixels: page.pixels});
};

// Request the picture of the view, or only its motion. While a request runs, the newest view waits.
const request = (again) => {
  page.again ||= again === true;
  if (!page.view || !page.pixels || page.pending) return;
  if (!page.busy) return send();
  page.pending = true; clearTimeout(page.timer);
  page.timer = setTimeout(insist, Math.max(0, page.patience - (performance.now() - page.since)));
};
const insist = () => { // replace the running request; the next one gets twice the time, or none would ever finish
  if (!page.pending) return;
  page.patience *= 2; send();
};
page.ask = (again) => {
  page.changed = performance.now();
  if (page.refused) refuse({refused: ""});
  judge(); request(again);
};
page.command = (message) => {
  if (saved) return;
  Object.assign(page, {settled: false, busy: false, pending: false}); // the running request is obsolete
  tell({view: page.state(), pixels: page.pixels, ...message});
};

const kind_of = (view) => ["mode", "x", "y", "quantity", "shade"].map((name) => view[name]).join();

// Take a complete view from the server, and request its picture.
const apply = (view) => {
  const kind = kind_of(view), other = kind !== page.kind;
  Object.assign(page, {view, kind, good: {...view}});
  if (other) clear_picture();
  show_controls(); draw(); page.ask(true);
};
const hear = (item) => {
  if (item.apply) apply(item.apply);
  if (item.refused) refuse(item);
  if (item.toml) save("view.toml", item.toml);
  if (item.saved) save(`${parameter("y")}_over_${page.view.x}.html`, item.saved);
  if (item.limits) { Object.assign(page.limits, item.limits); wait(""); }
  if (item.waits) wait(`waiting for another open page: ${item.waits}`);
  if (item.compiling) wait(`compiling the program for this machine, once after an installation: ${item.compiling} s, usually about ${COMPILES} s`);
  if (item.done !== undefined && item.done === page.seq) answered(item);
};
// The last request has its motion or, without a view, is refused.
const answered = ({view, address}) => {
  if (view) {
    page.good = page.motion.view = view; remember(address);
  }
  page.busy = false; clearTimeout(page.slow); wait("");
  if (page.pending) send();
};

// One line in the middle of the frame or, if a picture is there, in the sentence about the motion.
const wait = (text) => {
  page.waits = text; say(page.data ? "" : text, "wait"); judge();
  if (text && page.data && !page.data.complete) say(text, "status");
};

// Write the view into the address after REST ms, as a new step of "back".
const remember = (address) => {
  clearTimeout(page.waiting);
  page.waiting = setTimeout(() => {
    const url = `?token=${token}${address ? `&${address}` : ""}`;
    if (!saved && url !== location.search) history[page.begun && !page.played ? "pushState" : "replaceState"](null, "", url);
    element("link").textContent = `vibrodrive explore "?${address}"`;
    page.begun = true; page.waiting = 0;
  }, REST);
};
window.addEventListener("popstate", () => page.command({address: location.search.slice(1)}));

// Save a file as a download of the browser.
const save = (name, content) => {
  page.file = {name, content};
  Object.assign(document.createElement("a"), {href: URL.createObjectURL(new Blob([content])), download: name}).click();
};
const press = (id, act) => element(id).addEventListener("click", act);
press("send", () => tell({save: true, view: page.state(), pixels: page.pixels}));
press("toml", () => tell({toml: true, view: page.state(), pixels: page.pixels}));
press("full", () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()));
press("fit", () => fit_now());

// Menus close when one clicks elsewhere, or chooses something in them.
const close_menus = (target) => {
  for (const menu of document.querySelectorAll(".menu[open]")) {
    if (menu.contains(target ?? null) && !target.matches(".menu div button")) continue;
    if (menu.contains(document.activeElement)) menu.firstElementChild.focus();
    menu.open = false;
  }
};
document.addEventListener("click", ({target}) => close_menus(target));
