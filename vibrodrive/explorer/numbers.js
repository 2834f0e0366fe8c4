// Format the numbers of an axis. On a wide axis every number is complete. On a narrow axis the first number is complete
// and the others are differences from it, because there is no space for all digits.
const log = scale === "log";
const value = (u) => (log ? Math.pow(10, u) : u);
const plain = (v, digits) => {
  const n = Math.min(17, Math.max(1, digits));
  const text = Math.abs(v) < 1e-3 ? v.toExponential(n - 1) : v.toPrecision(n);
  if (v === 0) return "0";
  return text.includes("e") ? text.replace(/\.?0+e/, "e") : text.includes(".") ? text.replace(/\.?0+$/, "") : text;
};
if (ticks.length < 2) return plain(value(tick), 12);
const step = Math.abs(value(ticks[1]) - value(ticks[0])), size = Math.max(...ticks.map((u) => Math.abs(value(u))));
const first = Math.abs(value(ticks[0])); // the steps of a logarithmic axis are proportional to the numbers
const digits = (v) => Math.ceil(Math.log10(Math.max(log ? first : Math.abs(v), step) / step)) + (log ? 3 : 2);
if (log || step > 1e-5 * size || index === 0) return plain(value(tick), digits(value(tick)));
return "+" + plain(value(tick) - value(ticks[0]), 3);
