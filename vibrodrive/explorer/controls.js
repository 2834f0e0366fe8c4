// Controls, one for each field of the view, and the words beside the picture.
const ZERO = 0.11; // share of a slider that stands for 0, if a logarithmic slider begins with 0
const STEPS = 80; // steps of ▶ from end to end
const fields = {};
let keyed = false; // a slider is moved by keys, each by a step

const make = (html) => {
  const box = document.createElement("template");
  box.innerHTML = html;
  return box.content.firstChild;
};

// Place of a value on a slider, 0 to 1, and value at a place.
const place_on = ([low, high, scale], value) => {
  if (scale === "linear") return (value - low) / (high - low);
  if (scale === "zero" && value <= 0) return 0;
  const from = scale === "zero" ? ZERO : 0;
  return from + (1 - from) * Math.log(value / low) / Math.log(high / low);
};
const value_on = ([low, high, scale], place) => {
  if (scale === "linear") return Number((low + place * (high - low)).toPrecision(4));
  const from = scale === "zero" ? ZERO : 0;
  if (place < from) return place < from / 2 ? 0 : low;
  return Number((low * (high / low) ** ((place - from) / (1 - from))).toPrecision(3));
};
const ticks_of = ({slider, factor}) => {
  const [low, high, scale] = slider;
  if (scale === "linear") return round(low * factor, high * factor, 4).map((v) => [v / factor, String(Number(v.toPrecision(3)))]);
  const decades = round(Math.log10(low), Math.log10(high), 6).filter(Number.isInteger);
  const named = decades.map((d) => [10 ** d, pretty(`1e${d}`)]);
  return scale === "zero" ? [[0, "0"], ...named.slice(1)] : named; // the first would touch the 0
};
const play_button = (name, label) => `<button data-play="${name}" aria-label="Play ${label}"
  title="Move this slider up, until the motion below loses its structure">▶</button>`;
const build = (c) => {
  const {name, label, words, hint, options, slider} = c, played = name === "eps" || name === "dtau";
  const choices = options.map(([value, text]) => `<option value="${value}">${text}</option>`).join("");
  const radios = options.map(([value, text]) => `<label><input type="radio" name="${name}" value="${value}"><span>${text}</span></label>`);
  const own = options.length && c.place === "main" ? `<div class="radios" id="${name}" role="radiogroup" aria-label="${label}">${radios.join("")}</div>`
    : options.length ? `<select id="${name}">${choices}</select>`
    : `<input id="${name}" class="value" autocomplete="off" spellcheck="false">`;
  const marks = slider ? ticks_of(c).map(([v, text]) => `<i style="left: calc(0.5rem + (100% - 1rem) * ${place_on(slider, v)})">${text}</i>`) : [];
  const track = `<div class="track">${played ? play_button(name, label) : ""}<div>
    <input type="range" min="0" max="1" step="0.0025" aria-label="${label}, slider"><b hidden></b>
    <div class="ticks">${marks.join("")}</div></div></div>`;
  const control = make(`<div class="control" data-field="${name}" title="${hint}"><label for="${name}">${label}${
    words ? ` <small>${words}</small>` : ""}</label>${own}${slider ? track : ""}</div>`);
  element(c.place).append(control);
  const input = control.querySelector(`#${name}`), range = control.querySelector("[type=range]");
  fields[name] = {...c, control, input, range, mark: control.querySelector("b")};
  input.addEventListener("change", ({target}) => page.enter(name, target.value));
  for (const kind of ["focus", "blur"]) if (!options.length) input.addEventListener(kind, () => show_field(name));
  range?.addEventListener("keydown", () => (keyed = true));
  range?.addEventListener("pointerdown", () => (keyed = false));
  range?.addEventListener("input", () => slide(name, Number(range.value)));
  for (const end of ["change", "keyup"]) range?.addEventListener(end, () => {
    if (!page.pressed || (end === "change" && keyed)) return; // a key that is held down goes on
    page.pressed = false; page.ask(true);
  });
  control.querySelector("[data-play]")?.addEventListener("click", () => (page.played ? end_play() : start_play(name)));
};
for (const control of known.controls) build(control);
const label_of = (name) => fields[name].label;

// Set a field to a text or a number, as one types or chooses it.
const REARRANGE = ["x", "y", "mode", "quantity", "shade", "scale", "y_scale"];
page.enter = (name, text) => {
  const {factor, options} = fields[name];
  const plain = String(text).trim().replace(",", ".");
  page.view[name] = options.length || plain === "" ? plain : Number.isFinite(Number(plain)) ? Number(plain) / factor : text;
  if (REARRANGE.includes(name)) return page.command({changed: name});
  if (name === "dtau" && !known.steps[page.view.method]) page.view.method = "fixed"; // a step asks for a grid
  show_controls();
  page.ask(true);
};
const slide = (name, place) => {
  const {slider, factor} = fields[name], gap = keyed && slider[2] === "zero" && place > 0 && place < ZERO;
  page.pressed = !page.played && name;
  const value = !gap ? value_on(slider, place) : page.view[name] > 0 ? 0 : slider[0]; // a key crosses the gap above 0
  page.enter(name, value * factor);
};

// Value of a field, NaN if it is empty or no number.
const number = (name) => (page.view[name] === "" || page.view[name] === null ? NaN : Number(page.view[name]));

const hidden_now = () => {
  const {view} = page, map = over_plane(), away = [view.x, ...(map ? [view.y] : [])];
  if (!known.steps[view.method]) away.push("compare");
  if (map || view.quantity.startsWith("impact")) away.push("section_phase");
  if (!/\((J|N s|W)\)/.test(known.in_si[view.shade]) || !map) away.push("mass");
  if (away.includes("A")) away.push("a0");
  if (away.includes("frequency")) away.push("omega0");
  return away;
};

// A number in a field has as many digits as there is room for and, while one types in it, all.
const show_field = (name) => {
  const {input, factor} = fields[name], value = page.view[name] ?? "";
  const digits = input === document.activeElement || Number.isInteger(value) ? 15 : 6;
  input.value = typeof value === "number" ? plain(value * factor, digits) : value;
};
// Show the view in all controls, also in the one in which one types if its text is refused.
const show_controls = (refused) => {
  const away = hidden_now(), {view} = page;
  for (const [name, {control, input, range, slider, factor, options, only}] of Object.entries(fields)) {
    control.hidden = away.includes(name) || (only !== "" && only !== view.mode && only !== view.scene);
    const value = view[name];
    if (input.className === "radios") for (const radio of input.querySelectorAll("input")) radio.checked = radio.value === value;
    else if (options.length) input.value = value;
    else if (input !== document.activeElement || refused) show_field(name);
    const place = range && place_on(slider, number(name)), shown = pretty(plain(number(name) * factor, 15));
    if (range && Number.isFinite(place)) Object.assign(range, {value: place, ariaValueText: `${label_of(name)} = ${shown}`});
  }
  fields.dtau.control.classList.toggle("idle", !known.steps[view.method]);
  element("dive").hidden = !over_plane();
  element("fit").hidden = over_plane() ? view.bottom === null || view.bottom === undefined : view.bottom === null;
};
const fit_now = () => {
  Object.assign(page.view, {bottom: null, top: null});
  show_controls(); page.ask(true);
};

known.starts.forEach(({name, address}, k) => {
  const button = make(`<button><kbd>${k + 1}</kbd> ${name}</button>`);
  button.addEventListener("click", () => page.command({address}));
  element("starts").append(button);
});
element("starts").append(make("<button id='over'>Start over</button>"));
press("over", () => start_over());
const start_over = () => {
  page.kind = ""; page.command({reset: true});
};
const SAVED = `<br><strong>A saved page.</strong> The knob moves among ${known.places.length} motions stored in this file;
  it cannot compute others, zoom, add a ripple, or find a limit k₂ that was not known. The program vibrodrive can: see Save.`;
// The text of the start view in whose window the middle of the view is, as long as nothing else has changed than what
// this text invites to move.
const story = () => {
  const {view} = page, rest = (one, moves) => JSON.stringify({...one, ...Object.fromEntries([...PLACES, ...WINDOW, ...ENDS, moves].map((free) => [free, 0]))});
  const about = known.about[over_plane() ? view.mode : view.quantity];
  const found = [...known.starts].reverse().find(({view: first, moves}) => {
    const inside = (low, high) => view[low] + view[high] >= 2 * first[low] && view[low] + view[high] <= 2 * first[high];
    return rest(view, moves) === rest(first, moves) && inside("low", "high") && (!over_plane() || inside("y_low", "y_high"));
  });
  return saved ? `${about} ${SAVED}` : found ? `<strong>${found.name}</strong> ${found.text}` : about;
};

// Show an error message, beside its field if that is in view, until the next action. All fields return to what was
// accepted last. The server has escaped the text.
const wrong = make("<p id='wrong' role='alert'></p>");
element("main").append(wrong);
const refuse = ({refused, field}) => {
  const control = fields[field]?.control, beside = Boolean(control?.checkVisibility());
  const words = (page.refused = refused).replace(/\w+/g, (name) => (known.allowed[name] && known.symbols[name]?.split(" (")[0]) || name);
  if (beside) control.append(wrong);
  say(beside ? words : "", "wrong"); say(beside ? "" : words, "notice");
  if (!refused) return;
  page.view = {...page.good};
  show_controls(true); end_play();
};

// ▶ moves a slider from its least value upwards, at most ten steps a second, until the motion has lost its structure.
const start_play = (name) => {
  page.played = name;
  document.querySelector(`[data-play=${name}]`).textContent = "■";
  slide(name, fields[name].slider[2] === "zero" ? ZERO : 0); play_on();
};
const end_play = () => {
  page.played = "";
  for (const button of document.querySelectorAll("[data-play]")) button.textContent = "▶";
  judge(); request(true);
};
const play_on = () => setTimeout(() => {
  const name = page.played;
  if (!name) return;
  const {slider} = fields[name], place = place_on(slider, number(name)), limit = page.limits[name];
  const rests = current("motion") && page.motion.head.status === "NEVER_LEAVES";
  if (page.busy || !page.shown || !current("motion") || !(limit || rests)) return play_on(); // each step shows its motion
  if (place >= 1 || rests || verdict(name, limit) === "lost") return end_play();
  slide(name, Math.min(1, place + 1 / STEPS));
  play_on();
}, 100);

// Compare a disturbance of the motion with its limit k₂, which does not depend on it.
const disturbance = (name) => {
  const {view} = current("neighbour") ? page.motion : page;
  return Number(name === view.x ? view.at : view.mode === "map" && name === view.y ? view.at_y : view[name]);
};
const verdict = (name, {k2, last_kept}) => {
  const value = disturbance(name);
  return value < Number(k2) ? "kept" : value > Number(last_kept) ? "lost" : "between";
};
const digits = (v, n = 3) => pretty(plain(Number(v.toPrecision(n)), 15));
const comparison = (name, limit, others) => {
  const k2 = Number(limit.k2), value = disturbance(name), sign = label_of(name), keeps = "keeps its structure, the rhythm of its impacts,";
  if (k2 === Infinity) return `${keeps} at every ${sign} tried`;
  if (!(value > 0)) return `${keeps} up to ${sign} = ${digits(k2)}`;
  const ratio = value / k2, times = ratio < 1 ? `${digits(ratio, 2)} of` : `${digits(ratio)} times`;
  const words = {kept: "structure kept", lost: "structure lost", between: "structure kept or lost by chance"}[verdict(name, limit)];
  const by = name === "dtau" ? "the time step" : others ? "the ripple alone" : "the ripple";
  return `<span class="${verdict(name, limit)}">${words}</span> with ${by}: your ${sign} = ${digits(value)} is ${times} the limit`;
};
const ENDED = {NEVER_LEAVES: "rests for ever", BUDGET: "stopped by its budget of switches", TOO_CLOSE: "comes too close to a decision"};
const limit_of = (name) => (page.limits[name] && current(name) ? Number(page.limits[name].k2) : NaN);

// The sentence about the motion, and all else that is said: only of what belongs to the view (`current`). What is older
// is dimmed once, at the beginning of a movement, until its end.
const judge = () => {
  if (!page.view) return;
  const {motion, limits, data} = page, calm = !page.played && !page.pressed, {classList} = document.body;
  const fresh = current("motion"), near = current("neighbour"), moves = !calm && classList.contains("older");
  classList.toggle("older", Boolean(data) && (moves || !current("picture")));
  element("motion").classList.toggle("late", Boolean(motion) && !near);
  if (data?.complete && !current("window")) say("…", "status");
  say(story(), "story"); say(known.questions[over_plane() ? page.view.shade : page.view.x], "title");
  for (const one of ["sentence", "status"]) element(one).ariaLive = calm ? "polite" : "off";
  for (const name of ["eps", "dtau"]) {
    const {mark, slider} = fields[name], k2 = limit_of(name), place = place_on(slider, k2), away = place < 0 ? "◀" : "▶";
    mark.hidden = !Number.isFinite(place);
    mark.style.left = `calc(0.5rem + (100% - 1rem) * ${Math.min(1, Math.max(0, place))})`;
    mark.textContent = place >= 0 && place <= 1 ? "▲" : away;
    mark.title = `k₂ = ${digits(k2)}, the limit of the motion below`;
  }
  const shown = JSON.stringify([current("picture"), limit_of("eps"), limit_of("dtau")]);
  if (shown !== page.marked) draw(page.marked = shown);
  if (!motion) return say(page.waits, "sentence");
  const {status, period, hits, details} = motion.head, {view} = near ? motion : page, step = known.steps[view.method];
  const names = step ? (disturbance("eps") > 0 ? ["dtau", "eps"] : ["dtau"]) : ["eps"];
  const found = names.filter((name) => limits[name] && (near || current(name))), none = found.length && !(limits[found[0]].period > 0);
  const beat = ENDED[status] ?? (period > 0 ? `period ${period}` : step || disturbance("eps") > 0 || none ? (found.length ? "" : hits)
    : limits.eps?.period > 0 ? `period ${limits.eps.period}, not yet settled` : "no period");
  const parts = [[place_of(view), ...moved(view).map((name) => named(name, view[name]))].join(", "), near ? beat : found.length ? "" : "…"];
  if (near && status === "NEVER_LEAVES") parts.push("the shaking is too weak to move the mass");
  else if (none) parts.push("not seen to repeat, even undisturbed: no structure to lose");
  else for (const name of found) parts.push(comparison(name, limits[name], names.length > 1));
  if (page.waits && !(fresh && found.length === names.length)) parts.push(page.waits);
  else if (fresh && calm && !saved && status !== "NEVER_LEAVES" && found.length < names.length) parts.push("finding the limit of its structure …");
  say(parts.filter(Boolean).join(" · "), "sentence");
  const lines = found.map((name) => `k₂ in ${label_of(name)}: ${limits[name].k2 === "nan" ? "none" : digits(Number(limits[name].k2), 4)}, ${limits[name].how}`);
  say((near ? [...details, ...lines] : ["…"]).map((line) => `<p>${line}</p>`).join(""), "words");
  for (const [id, what] of [["phase", "Phase curve: velocity over gap"], ["time", "Gap over time"]]) {
    element(id).ariaLabel = `${what}. ${element("sentence").textContent}`;
  }
};

// Keys. On a focused control the keys of this control act.
const KEYS = {
  ArrowLeft: () => pan("x", -0.1), ArrowRight: () => pan("x", 0.1), ArrowUp: () => pan("y", 0.1), ArrowDown: () => pan("y", -0.1),
  "+": () => zoom("x", 0.5, 0.5), "-": () => zoom("x", 2, 0.5), Home: () => start_over(), f: () => fit_now(), " ": () => page.play(),
  m: () => element("sound").click(), x: () => element("full").click(), Escape: () => { end_play(); close_menus(); },
};
known.starts.forEach((_, k) => { KEYS[k + 1] = () => element("starts").children[k].click(); });
window.addEventListener("keydown", (event) => {
  const on = (kinds) => event.target.matches?.(kinds);
  if (event.ctrlKey || event.metaKey || event.altKey || !page.view) return;
  if (on("input:not([type=range], [type=radio]), select, textarea") && event.key !== "Escape") return;
  if (on("[type=range], [type=radio], #handle, .menu *") && /Arrow|Home|End|Page/.test(event.key)) return;
  if (on("button, summary, a") && event.key === " ") return;
  const act = KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});
element("more").open = kept("more") === "open";
element("more").addEventListener("toggle", ({target}) => kept("more", target.open ? "open" : ""));
