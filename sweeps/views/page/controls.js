// The controls: one for every dimension, the plane and the colour. All are the browser's own, so the keyboard works.

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made && name !== "list") made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Calls `move` with the steps of arrow keys to the right and up, and `enter` (if it is given) for the Enter key. */
function onArrows(target, move, enter) {
  target.addEventListener("keydown", (event) => {
    if (event.key in ARROWS) move(...ARROWS[event.key]);
    else if (event.key === "Enter" && enter) enter();
    else return;
    event.preventDefault();
  });
}

function selectBox(label, options, value, onChoice) {
  const select = element("select", { onchange: () => onChoice(select.value) });
  for (const [key, text] of options) select.append(element("option", { value: key, textContent: text, selected: key === value }));
  return element("label", { className: "control" }, element("span", { textContent: label }), select);
}

/** Selects an option unless it is selected, because the browser then measures all options. */
function selectOption(select, value) {
  if (select.value !== value) select.value = value;
}

function symbolText(name) {
  return theMap.symbols[name] ?? name.replaceAll("_", " ");
}

/** Return words with their unit in brackets, if they have a unit. */
function labelled(words, units) {
  return unitText(units) ? `${words} (${unitText(units)})` : words;
}

function dimensionLabel(name) {
  return labelled(symbolText(name), theMap.coordinates[name].units);
}

function coordinateText(name, value) {
  const coordinate = theMap.coordinates[name];
  const flag = (coordinate.flags ?? []).find((one) => one.value === value);
  if (flag) return flagText(flag.meaning);
  if (typeof value === "number") return withUnit(value, coordinate.units);
  const typed = coordinate.typed || !/^[a-z][a-z0-9_]*$/.test(value); // by an author of a definition, not by a description
  return typed ? String(value) : value.replaceAll("_", " ");
}

/** The control of one dimension: buttons for few names or whole numbers, a list for many, a slider for numbers. */
function dimensionControl(name) {
  const coordinate = theMap.coordinates[name];
  const named = (!coordinate.numeric || coordinate.whole) && name !== "point";
  if (named && coordinate.values.length <= 5) return radioGroup(name, coordinate);
  if (named) return dimensionList(name, coordinate);
  return dimensionSlider(name, coordinate);
}

function radioGroup(name, coordinate) {
  const group = element("fieldset", { className: "control radios" }, element("legend", { textContent: coordinate.longName }));
  coordinate.values.forEach((value, i) => {
    const input = element("input", { type: "radio", name: `dim-${name}`, value: i, onchange: () => choose({ place: placeWith({ [name]: i }) }) });
    group.append(element("label", {}, input, element("span", { textContent: coordinateText(name, value) })));
  });
  group.show = (i) => (group.querySelectorAll("input")[i].checked = true);
  return group;
}

function dimensionList(name, coordinate) {
  const options = coordinate.values.map((value, i) => [String(i), coordinateText(name, value)]);
  const control = selectBox(coordinate.longName, options, "0", (i) => choose({ place: placeWith({ [name]: Number(i) }) }));
  control.show = (i) => selectOption(control.querySelector("select"), String(i));
  return control;
}

function dimensionSlider(name, coordinate) {
  const output = element("output", {});
  const input = element("input", { type: "range", min: 0, max: coordinate.values.length - 1, step: 1, "aria-label": coordinate.longName });
  input.oninput = () => choose({ place: placeWith({ [name]: Number(input.value) }) });
  const head = element("span", { title: coordinate.longName }, `${symbolText(name)} = `, output);
  const control = element("label", { className: "control slider" }, head, input);
  control.show = (i) => {
    input.value = i;
    const text = name === "point" ? pointText(state.place) : coordinateText(name, coordinate.values[i]);
    output.textContent = text;
    input.setAttribute("aria-valuetext", text);
  };
  return control;
}

function buildControls() {
  const bar = document.getElementById("controls");
  const able = theMap.table ? [] : planeDimensions();
  const made = new Map();
  for (const dim of theMap.dims.filter(({ size }) => size > 1)) made.set(dim.name, dimensionControl(dim.name));
  for (const [name, control] of made) control.dataset.dimension = name;
  const planeControls = able.length > 1 ? ["x", "y"].map((side) => planeControl(side, able)) : [];
  bar.append(...planeControls, colorControl(), ...made.values());
  const show = () => {
    for (const [name, control] of made) {
      control.show(state.place[theMap.order.indexOf(name)]);
      control.hidden = (able.length > 0 && (name === state.x || name === state.y)) || (part.hides ?? []).includes(name);
    }
    for (const side of planeControls) {
      const select = side.querySelector("select");
      selectOption(select, state[side.dataset.side]);
      for (const option of select.options) option.textContent = axisText(side.dataset.side, option.value);
    }
    selectOption(bar.querySelector("[data-color] select"), state.color);
  };
  onChange(show);
  show();
}

/** Return the words of a choice of an axis: those that stand at the axis, if it is chosen. */
function axisText(side, name) {
  const slant = side === "y" && name === state.y ? part.slanted?.() : null;
  return slant?.label ?? symbolText(name);
}

function planeControl(side, able) {
  const other = { x: "y", y: "x" };
  const label = side === "x" ? "x axis" : "y axis";
  const control = selectBox(label, able.map((name) => [name, symbolText(name)]), state[side], (name) => {
    const swapped = name === state[other[side]] ? { [other[side]]: state[side] } : {};
    choose({ [side]: name, ...swapped });
  });
  control.dataset.side = side;
  return control;
}

/** Return the heading of a column's group in the list of colours. */
function groupOf(column) {
  const columns = Object.values(theMap.columns);
  if (!theMap.columns[column.name]) return "main variables";
  if (columns.some((one) => one.error === column.name)) return "errors";
  if (columns.some((one) => one.theory === column.name || one.exact === column.name)) return "theory";
  if (column.isFlag) return "regimes and statuses";
  return { coordinate: "coordinates", check: "checks", certificate: "certificates", existence: "bodies" }[column.role] ?? "measured";
}

/** Return the list of variables by which the map may be coloured, under headings, with a search field. */
function colorControl() {
  const control = selectBox("colour by", [], state.color, (color) => {
    find.value = "";
    choose({ color });
    fill();
  });
  const select = control.querySelector("select");
  const find = element("input", { type: "search", placeholder: "find …", "aria-label": "find a variable" });
  const fill = () => {
    const sought = find.value.trim().toLowerCase();
    const groups = new Map();
    for (const choice of theMap.choices) {
      const kept = choice.name === state.color || `${choice.longName} ${choice.name}`.toLowerCase().includes(sought);
      if (kept) groups.set(groupOf(choice), [...(groups.get(groupOf(choice)) ?? []), choice]);
    }
    select.replaceChildren(...[...groups].map(([label, choices]) => {
      const group = element("optgroup", { label });
      for (const { name, longName } of choices) group.append(element("option", { value: name, textContent: longName, selected: name === state.color }));
      return group;
    }));
    select.size = sought ? 6 : 0;
  };
  find.oninput = fill;
  find.onkeydown = ({ key }) => ["ArrowDown", "Enter"].includes(key) && select.focus();
  fill();
  control.dataset.color = "";
  control.classList.add("wide");
  if (theMap.choices.length < 8) return control;
  return element("div", { className: "with-search" }, control, find);
}
