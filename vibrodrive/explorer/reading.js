// Values at the mouse, and the marks that clicks set while "Mark" is on.
const reading = {on: false, under: ""};

// Value at a coordinate, with as many digits as the width of a pixel justifies.
const read_off = (u, range, pixels, name) => {
  const v = shown(u, name), step = Math.abs(shown(u + (range.end - range.start) / pixels, name) - v);
  const digits = Math.ceil(Math.log10(Math.max(Math.abs(v), step) / step)) + 1;
  return Number(v.toPrecision(Math.min(17, Math.max(1, digits))));
};

// Differences and ratios of the marks. For three period doublings (A₂ - A₁) / (A₃ - A₂) is near Feigenbaum's δ.
const marks_text = () => {
  const [a, b, c] = page.marks.map((u) => shown(u, "scale")), digits = (v) => Number(v.toPrecision(5));
  if (a === undefined) return reading.on ? "click to set marks" : "";
  const texts = [`marks ${page.marks.map((u) => read_off(u, x_range, 1000, "scale")).join(", ")}`];
  if (b !== undefined) texts.push(`difference ${digits(b - a)}, ratio ${digits(b / a)}`);
  if (c !== undefined) texts.push(`δ = ${digits((b - a) / (c - b))}`);
  return texts.join("; ");
};
const show_reading = () => {
  say(reading.under, "read");
  say(marks_text(), "marks");
};

const set_mark = (u) => {
  page.marks = [...page.marks.slice(page.marks.length === 3 ? 3 : 0), u];
  point_at(page.followed);
  show_reading();
};
press("mark", ({currentTarget}) => {
  reading.on = toggle(currentTarget);
  page.marks = [];
  point_at(page.followed);
  show_reading();
});

const read = (event) => {
  const plot = event.currentTarget.id === "first" ? first : second, {canvas_view, frame} = pictures[plot.id].view;
  const box = canvas_view.el.getBoundingClientRect(), {left, top, width, height} = frame.bbox, {over_plane} = page;
  const x = (event.clientX - box.left - left) / width, y = 1 - (event.clientY - box.top - top) / height;
  const at = (range, share) => range.start + share * (range.end - range.start);
  const within = event.type === "pointermove" && Math.min(x, y) >= 0 && Math.max(x, y) <= 1;
  const [across, up] = [fields.x.value, fields[over_plane ? "y" : "quantity"].value].map(named);
  reading.under = !within ? "" : `${across} = ${read_off(at(x_range, x), x_range, width, "scale")}, `
    + `${up} = ${read_off(at(y_range, y), y_range, height, over_plane ? "y_scale" : "")}`;
  show_reading();
};
for (const kind of ["pointermove", "pointerleave"]) for (const plot of ["first", "second"]) element(plot).addEventListener(kind, read);
