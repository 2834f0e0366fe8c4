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
  return scale === "zero" ? [[0, "0"], ...named] : named;
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
    <input type="range" min="0" max="1" step="0.0025" aria-label="${label}, slider"><b hidden title="k₂, the limit of the motion below">▲</b>
    <div class="ticks">${marks.join("")}</div></div></div>`;
  const control = make(`<div class="control" data-field="${name}" title="${hint}"><label for="${name}">${label}${
    words ? ` <small>${words}</small>` : ""}</label>${own}${slider ? track : ""}</div>`);
  element(c.place).append(control);
  const input = control.querySelector(`#${name}`), range = control.querySelector("[type=range]");
  fields[name] = {...c, control, input, range, mark: control.querySelector("b")};
  input.addEventListener("change", ({target}) => page.enter(name, target.value));
  range?.addEventListener("keydown", () => (keyed = true));
  range?.addEventListener("pointerdown", () => (keyed = false));
  range?.addEventListener("input", () => slide(name, Number(range.value)));
  range?.addEventListener("change", () => { page.pressed = false; page.ask(true); });
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
  judge();
  page.ask(true);
};
const slide = (name, place) => {
  const {slider, factor} = fields[name], gap = keyed && slider[2] === "zero" && place > 0 && place < ZERO;
  page.pressed = !page.played;
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

// Show the view in all controls.
const show_controls = () => {
  const away = hidden_now(), {view} = page;
  for (const [name, {control, input, range, slider, factor, options, only}] of Object.entries(fields)) {
    control.hidden = away.includes(name) || (only !== "" && only !== view.mode && only !== view.scene);
    const value = view[name] ?? "", shown = typeof value === "number" ? plain(value * factor, 15) : value;
    if (input.className === "radios") for (const radio of input.querySelectorAll("input")) radio.checked = radio.value === value;
    else if (input !== document.activeElement || options.length) input.value = shown;
    const place = range && place_on(slider, number(name));
    if (range && Number.isFinite(place)) range.value = place;
  }
  fields.dtau.control.classList.toggle("idle", !known.steps[view.method]);
  element("dive").hidden = !over_plane();
  element("fit").hidden = over_plane() ? view.bottom === null || view.bottom === undefined : view.bottom === null;
};
const fit_now = () => {
  Object.assign(page.view, {bottom: null, top: null});
  show_controls();
  page.ask(true);
};

for (const {name, text, address} of known.starts) {
  const button = make(`<button>${name}</button>`);
  button.addEventListener("click", () => {
    page.story = `<strong>${name}</strong> ${text}`;
    page.command({address});
  });
  element("starts").append(button);
}
element("starts").append(make("<button id='over'>Start over</button>"));
press("over", () => start_over());
const start_over = () => {
  page.kind = "";
  page.command({reset: true});
};

// Show an error message. The field whose name begins it, or else the view, returns to what was accepted last.
const refuse = (text) => {
  end_play();
  say(page.refused = text, "notice"); // the server has escaped the text
  const name = text.split(" = ")[0], {view, good} = page;
  if (JSON.stringify(view) === JSON.stringify(good)) return;
  page.view = name in good && view[name] !== good[name] ? {...view, [name]: good[name]} : {...good};
  show_controls();
  request(true);
};

// ▶ moves a slider from its least value upwards, at most ten steps a second, until the motion has lost its structure.
const start_play = (name) => {
  page.played = name;
  document.querySelector(`[data-play=${name}]`).textContent = "■";
  slide(name, fields[name].slider[2] === "zero" ? ZERO : 0);
  play_on();
};
const end_play = () => {
  page.played = "";
  for (const button of document.querySelectorAll("[data-play]")) button.textContent = "▶";
  if (page.view) page.ask(true);
};
const play_on = () => setTimeout(() => {
  const name = page.played;
  if (!name) return;
  const {slider} = fields[name], place = place_on(slider, number(name)), limit = page.limits[name];
  if (page.busy || !limit) return play_on();
  if (place >= 1 || verdict(name, limit) === "lost") return end_play();
  slide(name, Math.min(1, place + 1 / STEPS));
  play_on();
}, 100);

// Compare a disturbance with the limit k₂ of the motion. On an axis its value is that of the knob.
const disturbance = (name) => Number(name === page.view.x ? page.view.at : over_plane() && name === page.view.y ? page.view.at_y : number(name));
const verdict = (name, {k2, last_kept}) => {
  const value = disturbance(name);
  return value < Number(k2) ? "kept" : value > Number(last_kept) ? "lost" : "between";
};
const digits = (v, n = 3) => pretty(plain(Number(v.toPrecision(n)), 15));
const comparison = (name, limit) => {
  const k2 = Number(limit.k2), value = disturbance(name), sign = label_of(name);
  if (k2 === Infinity) return `keeps its structure at every ${sign} tried`;
  if (!(value > 0)) return `keeps its structure up to ${sign} = ${digits(k2)}`;
  const ratio = value / k2, times = ratio < 1 ? `${digits(ratio, 2)} of` : `${digits(ratio)} times`;
  const words = {kept: "structure kept", lost: "structure lost", between: "structure kept or lost by chance"}[verdict(name, limit)];
  return `<span class="${verdict(name, limit)}">${words}</span>: your ${sign} = ${digits(value)} is ${times} the limit`;
};

// The sentence about the motion, and the marks of its limits at the sliders.
const judge = () => {
  const {motion, limits, view} = page;
  if (!motion) return;
  const {status, period} = motion.head, step = known.steps[view.method];
  const names = step ? (disturbance("eps") > 0 ? ["dtau", "eps"] : ["dtau"]) : ["eps"];
  for (const name of ["eps", "dtau"]) {
    const {mark, slider} = fields[name], k2 = Number(limits[name]?.k2 ?? NaN), place = place_on(slider, k2);
    mark.hidden = !(place >= 0 && place <= 1);
    mark.style.left = `calc(0.5rem + (100% - 1rem) * ${place})`;
  }
  const own = status === "NEVER_LEAVES" ? "rests for ever" : status === "BUDGET" ? "stopped by its budget of switches"
    : period > 0 ? `period ${period}` : step || disturbance("eps") > 0 ? "" : limits.eps?.period > 0 ? `period ${limits.eps.period}, not yet settled` : "no period";
  const parts = own ? [label_of_x(), own] : [label_of_x()], found = names.filter((name) => limits[name]);
  if (status === "NEVER_LEAVES") parts.push("the shaking is too weak to move the mass");
  else if (found.length < names.length) parts.push(page.compiling || "finding the limit of its structure …");
  else if (limits[names[0]].period > 0) for (const name of names) parts.push(comparison(name, limits[name]));
  else parts.push("no structure to lose");
  say(parts.join(" · "), "sentence");
  const lines = found.map((name) => `k₂ in ${label_of(name)}: ${limits[name].k2 === "nan" ? "none" : digits(Number(limits[name].k2), 4)}, ${limits[name].how}`);
  say([...motion.head.details, ...lines].map((line) => `<p>${line}</p>`).join(""), "words");
};
const know = (limits) => {
  Object.assign(page.limits, limits);
  if (page.took > usual) localStorage.setItem("compiled", page.took);
  judge();
};

// Keys. On a focused control the keys of this control act.
const KEYS = {
  ArrowLeft: () => pan("x", -0.1), ArrowRight: () => pan("x", 0.1), ArrowUp: () => pan("y", 0.1), ArrowDown: () => pan("y", -0.1),
  "+": () => zoom("x", 0.5, 0.5), "-": () => zoom("x", 2, 0.5), Home: () => start_over(), f: () => fit_now(), " ": () => page.play(),
  x: () => element("full").click(), Escape: () => { end_play(); close_menus(); },
};
known.starts.forEach((_, k) => { KEYS[k + 1] = () => element("starts").children[k].click(); });
window.addEventListener("keydown", (event) => {
  const on = (kinds) => event.target.matches?.(kinds);
  if (event.ctrlKey || event.metaKey || event.altKey || !page.view) return;
  if (on("input:not([type=range], [type=radio]), select, textarea") && event.key !== "Escape") return;
  if (on("[type=range], [type=radio], #handle, .menu *") && /Arrow|Home/.test(event.key)) return;
  if (on("button, summary, a") && event.key === " ") return;
  const act = KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});
element("more").open = localStorage.getItem("more") === "open";
element("more").addEventListener("toggle", ({target}) => localStorage.setItem("more", target.open ? "open" : ""));
