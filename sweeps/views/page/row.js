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

function showRow(place) {
  const body = document.querySelector("#row tbody");
  const lines = coordinateNames().map((name) => {
    const value = coordinateAt(name, place);
    return rowLine(name, theMap.coordinates[name].longName, "", value, coordinateText(name, value));
  });
  for (const column of Object.values(theMap.columns)) {
    const value = column.at(place);
    lines.push(rowLine(column.name, column.longName, column.comment, value, column.text(value)));
  }
  body.replaceChildren(...lines);
  document.getElementById("row-where").textContent = placeText(place);
}

function placeText(place) {
  return theMap.dims.filter(({ size }) => size > 1).map(({ name }) => `${symbolText(name)} = ${coordinateText(name, coordinateAt(name, place))}`).join(", ");
}
