// Pictures are separate canvases below Bokeh's transparent canvas. Bokeh glyphs would be slower: each
// new picture would repaint axes, lines and tools, and each move of an axis would repaint the picture.
const pictures = {}; // for each diagram: a box over its frame with canvases and lines, and the rectangle of the last picture

const picture_of = (plot) => {
  if (pictures[plot.id]) return pictures[plot.id];
  const view = Bokeh.index.find_one_by_id(plot.id);
  if (!view) return null;
  const [box, canvas, line, odd] = ["div", "canvas", "div", "canvas"].map((kind) => document.createElement(kind));
  canvas.style.cssText = "position: absolute; left: 0; top: 0; transform-origin: 0 0";
  odd.style.cssText = `${canvas.style.cssText}; height: 8px`; // ticks at columns whose status is not OK
  line.style.cssText = "position: absolute; left: 0; top: 0; height: 100%; border-left: 1px dotted #888";
  box.append(canvas, line, odd);
  view.canvas_view.underlays_el.append(box);
  view.canvas_view.events_el.style.outline = "none"; // without an outline, although a click sets the focus
  view.repainted.connect(() => {
    page.due = false;
    move_picture(plot);
    if (plot === first) measure();
  });
  const context = canvas.getContext("2d", {alpha: false});
  return pictures[plot.id] = {view, box, canvas, lines: [line], odd, context, drawn: null, frame: ""};
};

// Move each picture to its data coordinates in the visible window. Move the lines to the selected motion and the marks.
const move_picture = (plot) => {
  const picture = picture_of(plot), {view, box, canvas, lines, odd, drawn} = picture;
  const places = [page.over_plane ? NaN : page.followed, ...page.marks];
  while (lines.length < places.length) box.append(lines[lines.length] = lines[0].cloneNode());
  canvas.hidden = odd.hidden = !drawn;
  lines.forEach((line, k) => { line.hidden = !drawn || !Number.isFinite(places[k]); });
  if (!drawn) return;
  const {left, top, width, height} = view.frame.bbox, {x_range, y_range} = plot;
  const frame = `left: ${left}px; top: ${top}px; width: ${width}px; height: ${height}px`;
  if (picture.frame !== frame) box.style.cssText = `position: absolute; overflow: hidden; ${picture.frame = frame}`;
  const across = width / (x_range.end - x_range.start), up = height / (y_range.end - y_range.start);
  const right = (drawn.x - x_range.start) * across, down = (y_range.end - drawn.y - drawn.dh) * up;
  const wider = drawn.dw * across / canvas.width, taller = drawn.dh * up / canvas.height;
  canvas.style.transform = `translate(${right}px, ${down}px) scale(${wider}, ${taller})`;
  odd.style.transform = `translate(${right}px) scale(${wider}, 1)`;
  lines.forEach((line, k) => { line.style.transform = `translate(${(places[k] - x_range.start) * across}px)`; });
};

// Each pixel of a picture is an index into its RGBA palette; the first row is the lowest.
const draw_picture = (plot, image, data, odd) => {
  const picture = picture_of(plot);
  if (!picture) return;
  const {canvas, context} = picture, [rows, columns] = image.shape;
  if (!picture.pixels || canvas.width !== columns || canvas.height !== rows) {
    Object.assign(canvas, {width: columns, height: rows});
    picture.pixels = context.createImageData(columns, rows);
    canvas.style.imageRendering = columns < picture.view.frame.bbox.width ? "pixelated" : "auto"; // so that cells have sharp edges
  }
  const colours = new Uint32Array(picture.pixels.data.buffer), {palette} = data;
  for (let row = 0, k = 0; row < rows; row++) {
    for (let spot = (rows - 1 - row) * columns, end = spot + columns; spot < end;) colours[k++] = palette[image[spot++]];
  }
  context.putImageData(picture.pixels, 0, 0);
  Object.assign(picture.odd, {width: columns, height: 1}).style.width = `${columns}px`;
  const ticks = picture.odd.getContext("2d");
  ticks.fillStyle = "#CC3311";
  for (const column of Object.values(odd).flat()) ticks.fillRect(column, 0, 1, 1);
  picture.drawn = data;
  move_picture(plot);
};

const clear_pictures = () => {
  for (const plot of [first, second]) {
    if (!pictures[plot.id]) continue;
    pictures[plot.id].drawn = null;
    move_picture(plot);
  }
};
