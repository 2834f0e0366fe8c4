// Places of the ticks of an axis: round numbers (1, 2 or 5 times a power of ten). A logarithmic axis of at least 0.7
// decades has ticks at 1 to 9, at 1, 2 and 5, or at 1 of each decade, or only at some of the decades. Its coordinates are
// decimal logarithms.
const MOST = 8, {start, end} = cb_data.range, log = scale === "log";
const round = (low, high) => {
  const rough = (high - low) / MOST, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= rough), from = Math.ceil(low / step);
  return Array.from({length: Math.max(0, Math.floor(high / step) - from + 1)}, (_, k) => (from + k) * step);
};
if (!log) return round(start, end);
if (end - start < 0.7) return round(10 ** start, 10 ** end).map(Math.log10);
const decades = round(start, end).filter(Number.isInteger);
const within = (factors) => Array.from({length: Math.ceil(end) - Math.floor(start) + 1}, (_, k) => Math.floor(start) + k)
  .flatMap((d) => factors.map((f) => d + Math.log10(f))).filter((u) => u >= start && u <= end);
return [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1]].map(within).find((places) => places.length <= 1.5 * MOST) ?? decades;
