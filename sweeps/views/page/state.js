// What is chosen: a place along every dimension, the plane, the colour, and what the system's part keeps besides.

const state = { place: [], x: null, y: null, color: null, units: "si", listeners: [] };

function onChange(listener) {
  state.listeners.push(listener);
}

/** Changes the choice, tells everyone who draws it, and writes the link. */
function choose(changes) {
  part.adjust?.(changes);
  Object.assign(state, changes);
  for (const listener of state.listeners) listener(changes);
  writeLink();
}

const BESIDE = 200; // pixels beyond the window that count as seen

/** What draws in an element only while that is in the window, or near it: what is hidden is drawn when it comes. */
function whenSeen(target, draw) {
  let [seen, stale] = [false, false];
  const late = () => {
    if (stale) draw();
    stale = false;
  };
  const look = (entries) => {
    seen = entries.at(-1).isIntersecting;
    if (seen) late();
  };
  new IntersectionObserver(look, { rootMargin: `${BESIDE}px` }).observe(target);
  addEventListener("beforeprint", late);
  return () => {
    stale = true;
    if (seen || document.documentElement.hasAttribute("data-printing")) late();
  };
}

const REST = 80; // ms without a change, as of a slider that moves

/** What takes long to draw: once changes have come to rest. */
function atRest(draw) {
  let later;
  return () => {
    clearTimeout(later);
    later = setTimeout(draw, REST);
  };
}

function placeWith(changes) {
  return state.place.map((i, k) => changes[theMap.order[k]] ?? i);
}

/** Dimensions that can span the plane: numeric and longer than one, those of real numbers first. */
function planeDimensions() {
  if (theMap.cloud) return theMap.cloud; // coordinates of the points
  const able = theMap.dims.filter((dim) => dim.size > 1 && theMap.coordinates[dim.name].numeric);
  const real = able.filter((dim) => !theMap.coordinates[dim.name].whole);
  return (real.length > 0 ? real : able).map((dim) => dim.name);
}

function firstState() {
  state.place = theMap.dims.map((dim) => theMap.start.index[dim.name]);
  const able = planeDimensions();
  const longest = [...able].sort((a, b) => sizeOf(b) - sizeOf(a)).slice(0, 2);
  const usual = theMap.start.plane.filter((name) => able.includes(name));
  [state.x = null, state.y = null] = usual.length === 2 ? usual : able.filter((name) => longest.includes(name));
  state.color = (theMap.choices.find(({ name }) => name === part.color) ?? theMap.choices[0]).name;
  keepOwn();
  state.place = part.first?.() ?? tellingPlace();
  readLink(`#${theMap.start.link}`, false);
  part.opening?.();
}

const DULL = ["marginal", "sphere", "undetermined", "absent"]; // meanings of a leading flag that say little
const AWAY = 0.2; // of the picture: how far from there, so as not to stand on its edge

/** Where the page begins; if nothing can be there, or what is says little, some way off where more is said. */
function tellingPlace() {
  const flag = Object.values(theMap.columns).find((column) => column.role === "headline" && column.isFlag);
  const margin = theMap.existence;
  const tells = (place) => !(margin && margin.at(place) < 0) && !(flag && DULL.includes(flag.meanings.get(flag.at(place))));
  const names = theMap.cloud ? ["point"] : [state.x, state.y].filter(Boolean);
  if (tells(state.place) || names.length === 0) return state.place;
  const along = names.map((name) => theMap.order.indexOf(name));
  const away = (place) => Math.hypot(...along.map((k) => (place[k] - state.place[k]) / theMap.dims[k].size));
  return bestPlace(names, (place) => (tells(place) ? -Math.abs(away(place) - AWAY) : NaN));
}

function sizeOf(name) {
  return theMap.dims[theMap.order.indexOf(theMap.cloud?.includes(name) ? "point" : name)].size;
}

/** Calls back with every place of some dimensions, the others as they are. */
function eachPlace(names, visit) {
  const along = names.map((name) => theMap.order.indexOf(name));
  const walk = (k, place) => {
    if (k === along.length) return visit(place);
    for (let i = 0; i < theMap.dims[along[k]].size; i++) {
      place[along[k]] = i;
      walk(k + 1, place);
    }
  };
  walk(0, [...state.place]);
}

/** The place of some dimensions at which a merit is greatest; the chosen one where it is a number nowhere. */
function bestPlace(names, merit) {
  let [most, best] = [-Infinity, state.place];
  eachPlace(names, (place) => {
    const value = merit(place);
    if (value > most) [most, best] = [value, [...place]];
  });
  return best;
}

// ---------------------------------------------------------------------------------------------------------
// The link

function link() {
  const pairs = theMap.dims.map((dim, k) => [dim.name, shortValue(theMap.coordinates[dim.name], state.place[k])]);
  for (const name of ["x", "y", "color", ...Object.keys(part.kept ?? {})]) if (state[name] !== null) pairs.push([`_${name}`, state[name]]);
  return `#${pairs.map((pair) => pair.map((part) => encodeURIComponent(part)).join("=")).join("&")}`;
}

/** A value as a link has it: without the last digits that are rounding, where no neighbour is that near. */
function shortValue(coordinate, i) {
  const value = coordinate.values[i];
  if (typeof value !== "number") return value;
  const short = Number(value.toPrecision(12));
  return nearest(coordinate, String(short)) === i ? short : value;
}

/** Writes the link: a step of the browser's history, but one alone for what a slider passes through. */
function writeLink(way = "pushState") {
  clearTimeout(writeLink.later);
  writeLink.later = setTimeout(() => {
    if (link() === location.hash) return;
    try {
      history[way](null, "", link());
    } catch {
      // a page inside a frame may have no history of its own; the link is then on its button only
    }
  }, 150);
}

/** Takes over what a link says; what is unknown changes nothing, and what is not as the link has it is said. */
function readLink(hash = location.hash, isTold = true) {
  const said = new URLSearchParams(hash.slice(1));
  if ([...said].length === 0) return false;
  state.place = theMap.dims.map((dim, k) => nearest(theMap.coordinates[dim.name], said.get(dim.name)) ?? state.place[k]);
  state.place = nearestBy(said);
  if (isTold) tellOfLink(remarks(said));
  const able = planeDimensions();
  const [x, y] = [said.get("_x"), said.get("_y")];
  if (able.includes(x) && able.includes(y) && x !== y) [state.x, state.y] = [x, y];
  if (theMap.choices.some((choice) => choice.name === said.get("_color"))) state.color = said.get("_color");
  keepOwn(said);
  return true;
}

/** Coordinates along several dimensions that a link asks for. */
function askedBeside(said) {
  const known = Object.values(theMap.columns).filter(({ role, name }) => role === "coordinate" && said.has(name));
  return known.map((column) => [column, Number(said.get(column.name))]).filter(([, value]) => Number.isFinite(value));
}

/** The place where these are nearest to what is asked, each in units of its range; other dimensions stay. */
function nearestBy(said) {
  const asked = askedBeside(said);
  const stands = ([column], k) => column.shape[k] > 1 || column.powers[theMap.order[k]];
  const names = theMap.order.filter((name, k) => sizeOf(name) > 1 && !said.has(name) && asked.some((one) => stands(one, k)));
  const ranges = asked.map(() => [Infinity, -Infinity]);
  eachPlace(names, (place) => asked.forEach(([column], i) => (ranges[i] = [Math.min(ranges[i][0], column.at(place)), Math.max(ranges[i][1], column.at(place))])));
  const off = ([column, value], place, [low, high]) => (column.at(place) - value) / (high - low || 1);
  return bestPlace(names, (place) => -asked.reduce((sum, one, i) => sum + off(one, place, ranges[i]) ** 2, 0));
}

/** What the system's part keeps, from a link; null where that says nothing of it. */
function keepOwn(said = new URLSearchParams()) {
  for (const [name, read] of Object.entries(part.kept ?? {})) state[name] = read(said.get(`_${name}`));
}

/** The perturbation of a motion that a system's part keeps. */
function nudgeOfLink(text) {
  return Number(text) > 0 && Number(text) < 1 ? Number(text) : null;
}

/** What a link asks for and does not get, one sentence each. */
function remarks(said) {
  return [...said].flatMap(([name, text]) => {
    if (name.startsWith("_")) return [];
    const beside = askedBeside(said).find(([column]) => column.name === name);
    if (beside) return remarkOn(name, text, beside[0].at(state.place), beside[0].text(beside[0].at(state.place)));
    const at = theMap.order.includes(name) ? nearest(theMap.coordinates[name], text) : null;
    if (at === null) return [`${name} = ${text} is not in this map and was ignored.`];
    const value = theMap.coordinates[name].values[at];
    return remarkOn(name, text, value, coordinateText(name, value));
  });
}

function remarkOn(name, text, value, shown) {
  const same = typeof value !== "number" || Math.abs(Number(text) - value) <= 1e-9 * Math.abs(value);
  return same ? [] : [`The map has no ${symbolText(name)} = ${text}: the nearest, ${shown}, is shown.`];
}

function tellOfLink(sentences) {
  const notice = document.getElementById("link-notice");
  notice.hidden = sentences.length === 0;
  notice.textContent = sentences.length > 0 ? `The link: ${sentences.slice(0, 5).join(" ")}` : "";
}

/** Where a coordinate comes nearest to a value of a link. */
function nearest(coordinate, text) {
  if (text === null || text.trim() === "") return null;
  if (!coordinate.numeric) {
    const at = coordinate.values.indexOf(text);
    return at >= 0 ? at : null;
  }
  const value = Number(text);
  if (!Number.isFinite(value)) return null;
  let best = 0;
  coordinate.values.forEach((other, i) => {
    if (Math.abs(other - value) < Math.abs(coordinate.values[best] - value)) best = i;
  });
  return best;
}
