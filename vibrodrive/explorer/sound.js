// Sound: each impact of the motion is a click, as loud as it is fast. Clicks are scheduled ahead, by the clock of the
// sound, which then also moves the mass. Where the browser refuses sound, nothing changes.
const AHEAD = 0.25, LOUDEST = 5; // s, and the speed of the loudest click
const sound = {on: kept("sound") === "on", context: null, until: 0};
const heard = () => sound.on && sound.context?.state === "running";
page.clicks = []; // those scheduled last: time on the clock of the sound, time in the motion in shakes, and speed

const listen = (on) => {
  sound.on = on; hush();
  if (on || clock.still) clock.playing = on;
  try {
    sound.context ??= new AudioContext();
    sound.context.onstatechange = () => { element("sound").ariaPressed = heard(); };
    sound.context[on ? "resume" : "suspend"]().catch(() => {});
  } catch {
    sound.on = false;
  }
  kept("sound", sound.on ? "on" : "");
};
// Schedule the impacts until AHEAD seconds after `now`, at which the motion is at the time of `clock`.
const schedule = (now) => {
  const {hit_time, hit_speed, time} = page.motion, last = time.at(-1), from = Math.max(now, sound.until);
  sound.until = now + AHEAD;
  for (let begin = 0; begin <= clock.at + AHEAD * HEARD; begin += last) hit_time.forEach((shake, k) => {
    const when = now + (begin + shake - clock.at) / HEARD, speed = hit_speed[k], {context} = sound;
    if (when <= from || when > sound.until) return;
    const source = new OscillatorNode(context, {type: "triangle", frequency: 450}), volume = new GainNode(context, {gain: 0});
    volume.gain.setValueAtTime(Math.min(1, speed / LOUDEST), when).setTargetAtTime(0, when, 0.015); // like a knock on wood
    source.connect(volume).connect(context.destination);
    source.start(when); source.stop(when + 0.2); page.clicks.push({when, shake, speed, source});
  });
  page.clicks.splice(0, page.clicks.length - 200);
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
