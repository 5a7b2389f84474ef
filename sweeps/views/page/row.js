// One point's whole row: every coordinate and every variable, with units.

function rowLine(name, longName, comment, value, text) {
  const data = element("data", { value: value === null || value === undefined ? "" : String(value), textContent: text });
  const head = element("th", { scope: "row", title: comment }, element("span", { textContent: longName }), element("code", { textContent: name }));
  const line = element("tr", {}, head, element("td", {}, data));
  line.dataset.name = name;
  return line;
}

function coordinateNames() {
  return Object.keys(theMap.coordinates);
}

const MAX_HEADLINES = 6;

/** Return the most important columns: the leading flag, measured numbers with a theory, then further measured numbers. */
function headlines() {
  const columns = Object.values(theMap.columns);
  const references = new Set(columns.flatMap((column) => [column.theory, column.exact, column.error]).filter(Boolean));
  const own = columns.filter((column) => !references.has(column.name));
  const weight = (column) => (column.role === "headline" ? 3 : 0) + (column.theory || column.exact ? 2 : 0) + (column.role === "measurement" ? 1 : 0);
  return own.filter(weight).sort((a, b) => weight(b) - weight(a)).slice(0, MAX_HEADLINES);
}

/** Return [measured value with its error, value of theory] as texts. */
function headlineTexts(column, place) {
  const value = column.at(place);
  const reference = theMap.columns[column.theory] ?? theMap.columns[column.exact];
  const theory = reference ? reference.text(reference.at(place)) : "";
  const error = theMap.columns[column.error]?.at(place);
  if (column.isFlag || !Number.isFinite(value) || !Number.isFinite(error)) return [column.text(value), theory];
  const [unit, factor] = unitAndFactor(column.units);
  return [`${numberText(value * factor, 6)} ± ${numberText(error * factor, 2)}${unit}`, theory];
}

/** Shows the headlines of a point; between the points of the map, those that the system computes without measuring. */
function showHeadlines(place) {
  const between = part.between?.() ?? null;
  const rows = between?.rows ?? headlines().map((column) => [column.longName.replace(/, measured\b/, ""), ...headlineTexts(column, place), column.comment]);
  const lines = rows.map(([name, measured, theory, comment = ""]) => {
    const head = element("th", { scope: "row", textContent: name, title: comment });
    return element("tr", {}, head, element("td", { className: "n", textContent: measured }), element("td", { className: "n", textContent: theory }));
  });
  document.querySelector("#headline tbody").replaceChildren(...lines);
  document.getElementById("headline").hidden = lines.length === 0;
  document.getElementById("row-where").textContent = between?.words ?? placeText(place) + (part.aside?.(place) ?? "");
  document.querySelector("#all-values summary").textContent = between ? "More: all values of the nearest point of the map" : "More: all values of the point";
}

/** Shows the point in one sentence: the system's own, or one of the leading flag and the first number. */
function say(place) {
  document.getElementById("say").textContent = part.say?.(place) ?? sentenceOf(place);
}

function sentenceOf(place) {
  const columns = headlines();
  const flag = columns.find((column) => column.isFlag);
  const number = columns.find((column) => !column.isFlag && Math.abs(column.at(place)) > 0);
  const [measured, theory] = number ? headlineTexts(number, place) : [];
  const words = flag ? flag.text(flag.at(place)) : "";
  const what = number?.longName.replace(/, measured$/, "");
  const rate = number ? `${what}: ${measured}${theory ? ` (theory ${theory})` : ""}` : "";
  return [words, rate].filter(Boolean).map((part) => part[0].toUpperCase() + part.slice(1)).join(". ");
}

const MISSING = {
  no_equilibrium: "There is no such equilibrium at this point.",
  equilibrium_undecided: "Whether there is such an equilibrium at this point is undecided.",
};

/** Return the reason, by its status, why a point has no measured value. */
function missingInWords(place) {
  const { status } = theMap.columns;
  const meaning = status?.meanings.get(status.at(place));
  return MISSING[meaning] ?? `No value is measured at this point${meaning ? `: ${flagText(meaning)}` : ""}.`;
}

/** Return a coordinate's value for a sentence: "equilibrium “upright”", "mode 2". */
function namedPlace(name, place) {
  const text = coordinateText(name, coordinateAt(name, place));
  return /^\d+$/.test(text) ? `${name} ${text}` : `${name} “${text}”`;
}

function showRow(place) {
  showHeadlines(place);
  if (!document.getElementById("all-values").open) return;
  const lines = coordinateNames().map((name) => {
    const value = coordinateAt(name, place);
    return rowLine(name, theMap.coordinates[name].longName, "", value, coordinateText(name, value));
  });
  for (const column of Object.values(theMap.columns)) {
    const value = column.at(place);
    lines.push(rowLine(column.name, column.longName, column.comment, value, column.text(value)));
  }
  document.querySelector("#row tbody").replaceChildren(...lines);
}

/** Return the number of a point, with its name if it has one: "3 (Vesta)". */
function pointText(place) {
  const number = coordinateText("point", coordinateAt("point", place));
  return theMap.coordinates.name?.dim === "point" ? `${number} (${coordinateAt("name", place)})` : number;
}

/** Return the coordinates of a place as text, except those of the dimensions `without`. */
function placeText(place, without = []) {
  return theMap.dims.filter(({ name, size }) => size > 1 && !without.includes(name)).map(({ name }) => `${symbolText(name)} = ${name === "point" ? pointText(place) : coordinateText(name, coordinateAt(name, place))}`).join(", ");
}
