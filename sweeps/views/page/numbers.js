// Numbers and units as text.

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

function superscript(text) {
  return text.replace(/-/g, "⁻").replace(/\d/g, (digit) => SUPERSCRIPTS[digit]);
}

/** Return UDUNITS text with superscripts: "rad s-1" becomes "rad s⁻¹", and "1" nothing. */
function unitText(units) {
  if (!units || units === "1") return "";
  return units.replace(/([A-Za-z])(-?\d+)/g, (_, letter, power) => letter + superscript(power));
}

/** Return a number with at most `digits` significant digits: 1.5e-7 becomes 1.5 × 10⁻⁷. */
function numberText(value, digits = 6) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value).replace("-", "−");
  let [mantissa, exponent] = value.toPrecision(digits).split("e");
  if (exponent === undefined && value !== 0 && Math.abs(value) < 1e-3) [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  if (mantissa.includes(".")) mantissa = mantissa.replace(/\.?0+$/, "");
  const plain = mantissa.replace("-", "−");
  return exponent === undefined ? plain : `${plain} × 10${superscript(exponent.replace("+", ""))}`;
}

const EVERYDAY = { "rad s-1": [" rpm", 30 / Math.PI], rad: ["°", 180 / Math.PI] }; // unit → everyday unit, and its number per unit

/** Return [name, factor] of a unit in the reader's choice of units; the name begins with a space. */
function unitAndFactor(units) {
  if (state.units === "everyday" && Object.hasOwn(EVERYDAY, units ?? "")) return EVERYDAY[units];
  const unit = unitText(units);
  return [unit ? `\u00a0${unit}` : "", 1];
}

function withUnit(value, units, digits = 6) {
  const [unit, factor] = unitAndFactor(units);
  return numberText(value === null ? value : value * factor, digits) + (Number.isNaN(value) ? "" : unit);
}

/** Return a time in seconds, minutes, hours, days or years, whichever fits. */
function timeText(seconds, digits = 4) {
  if (!Number.isFinite(seconds)) return "never";
  const fits = [["years", 31557600], ["days", 86400], ["hours", 3600], ["min", 60]].find(([, unit]) => seconds >= 2 * unit);
  return fits ? `${numberText(seconds / fits[1], digits)} ${fits[0]}` : withUnit(seconds, "s", digits);
}

/** Return true if values are more evenly spaced by ratio than by difference, over a factor of ten or more. */
function isLogarithmic(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const n = sorted.length;
  if (n < 3 || sorted[0] <= 0 || sorted[n - 1] < 10 * sorted[0]) return false;
  const spread = (f) => {
    const whole = f(sorted[n - 1]) - f(sorted[0]);
    const steps = sorted.slice(1).map((value, i) => (f(value) - f(sorted[i])) / whole);
    return steps.reduce((sum, step) => sum + (step - 1 / (n - 1)) ** 2, 0);
  };
  return spread(Math.log) < spread((x) => x);
}

/** Return n + 1 cell edges halfway between n ascending values (by ratio if these are logarithmic). */
function cellEdges(values) {
  if (values.length === 1) return values[0] === 0 ? [-0.5, 0.5] : [values[0] * 0.95, values[0] * 1.05];
  if (isLogarithmic(values)) return cellEdges.halfway(values.map(Math.log)).map(Math.exp);
  return cellEdges.halfway(values);
}
cellEdges.halfway = (values) => {
  const n = values.length;
  const inner = values.slice(1).map((value, i) => 0.5 * (value + values[i]));
  return [1.5 * values[0] - 0.5 * values[1], ...inner, 1.5 * values[n - 1] - 0.5 * values[n - 2]];
};

function quantile(sorted, share) {
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}
