// Sound: each impact of the motion is a click, as loud as it is fast. Clicks are scheduled ahead, by the clock of the
// sound, which then also moves the mass. Where the browser refuses sound, nothing changes.
const AHEAD = 0.25; // s
const LOUDEST = 5; // dimensionless speed
const KEPT_CLICKS = 200;
const sound = {on: kept("sound") === "on", context: null, click: null, until: 0};
const heard = () => sound.on && sound.context?.state === "running";
page.clicks = []; // those scheduled last: time on the clock of the sound, time in the motion in shakes, and speed

const listen = (on) => {
  sound.on = on; hush();
  if (on || clock.still) clock.playing = on;
  try {
    sound.context ??= new AudioContext();
    sound.context.onstatechange = () => { element("sound").ariaPressed = heard(); };
    sound.click ??= knock(sound.context.sampleRate);
    sound.context[on ? "resume" : "suspend"]().catch(() => {});
  } catch {
    sound.on = false;
  }
  kept("sound", sound.on ? "on" : "");
};
// A knock on wood, whose beginning is sharp.
const knock = (sampleRate) => {
  const buffer = new AudioBuffer({length: Math.round(0.1 * sampleRate), sampleRate}), wave = buffer.getChannelData(0);
  const tone = (t, pitch, length) => Math.sin(2 * Math.PI * pitch * t) * Math.exp(-t / length);
  wave.forEach((_, k) => { wave[k] = 0.7 * tone(k / sampleRate, 420, 0.018) + 0.3 * tone(k / sampleRate, 1900, 0.004); });
  return buffer;
};
// Schedule the impacts until AHEAD seconds after `now`, at which the motion is at the time of `clock`.
const schedule = (now) => {
  const {hit_time, hit_speed, time} = page.motion, last = time.at(-1), from = Math.max(now, sound.until);
  sound.until = now + AHEAD;
  for (let begin = 0; begin <= clock.at + AHEAD * HEARD; begin += last) hit_time.forEach((shake, k) => {
    const when = now + (begin + shake - clock.at) / HEARD, speed = hit_speed[k], {context, click: buffer} = sound;
    if (when <= from || when > sound.until) return;
    const source = new AudioBufferSourceNode(context, {buffer}), gain = Math.min(1, speed / LOUDEST);
    source.connect(new GainNode(context, {gain})).connect(context.destination);
    source.start(when); page.clicks.push({when, shake, speed, source});
  });
  page.clicks.splice(0, page.clicks.length - KEPT_CLICKS);
};
// Take back the clicks that are not yet heard, because another motion comes, or the mass stops.
const hush = () => {
  const now = sound.context?.currentTime ?? 0, late = ({when}) => when > now;
  for (const {source} of page.clicks.filter(late)) source.stop();
  page.clicks = page.clicks.filter((click) => !late(click)); sound.until = 0;
};
press("sound", () => listen(!heard()));
// A browser allows sound after a first action on the page only, also if it was on before.
for (const kind of ["pointerdown", "keydown"]) document.addEventListener(kind, ({target}) => {
  if (sound.on && !heard() && !target.closest?.("#sound")) listen(true);
}, true);
