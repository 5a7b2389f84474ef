// Maps of named bodies: a table of body and axis in place of the plane; each cell is a button that chooses its point.

function bodyCell(column, place, color) {
  const value = column.at(place);
  const button = element("button", { type: "button", textContent: column.isFlag ? column.text(value) : numberText(value, 4) });
  button.onclick = () => choose({ place });
  button.onfocus = button.onpointerenter = () => showRow(place);
  button.onpointerleave = () => showRow(state.place);
  if (color) button.style.borderLeftColor = color;
  return button;
}

/** A flag's colour: growth in that of what is unstable, the rest in that of what is stable. */
function flagColorAt(column, place) {
  const number = column.flags.findIndex(({ value }) => value === column.at(place));
  return number < 0 ? null : flagColor(column.flags[number].meaning, number);
}

function drawBodies() {
  const column = chosenColumn();
  const regime = theMap.columns.regime ?? theMap.columns.stability;
  const shown = column.isFlag ? column : regime;
  const axes = theMap.order.includes("axis") ? theMap.coordinates.axis.values : [null];
  const head = element("tr", {}, element("th", { scope: "col", textContent: "body" }));
  for (const axis of axes) head.append(element("th", { scope: "col", textContent: axis === null ? column.longName : `spin about axis ${axis}` }));
  const places = [];
  const lines = theMap.coordinates.body.values.map((body, i) => {
    const line = element("tr", {}, element("th", { scope: "row", textContent: body }));
    axes.forEach((axis, j) => {
      const place = placeWith({ body: i, axis: j });
      places.push(place);
      const cell = element("td", {}, bodyCell(column, place, shown?.isFlag ? flagColorAt(shown, place) : null));
      if (place.every((at, k) => at === state.place[k])) cell.firstChild.setAttribute("aria-current", "true");
      if (theMap.nature[body] === axis) cell.append(element("span", { className: "nature", title: "usual spin axis", textContent: "★" }));
      line.append(cell);
    });
    return line;
  });
  const unit = unitText(column.units);
  const caption = element("caption", { textContent: `${column.longName}${unit ? `, ${unit}` : ""}` });
  const table = element("table", { className: "bodies" }, caption, element("thead", {}, head), element("tbody", {}, ...lines));
  const target = document.getElementById("map");
  const focused = target.contains(document.activeElement);
  target.replaceChildren(table);
  if (focused) table.querySelector("[aria-current]")?.focus();
  document.getElementById("map-summary").textContent = `${column.longName}: ${valuesInWords(column, places.map((place) => column.at(place)))}.`;
  if (shown) drawLegend(shown, places.map((place) => shown.at(place)));
}

function buildBodies() {
  const target = document.getElementById("map");
  target.setAttribute("role", "group");
  target.removeAttribute("tabindex");
  target.classList.add("table");
  document.getElementById("map-table").remove();
  drawBodies();
  onChange(drawBodies);
}
