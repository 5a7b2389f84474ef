// The state of the page: an index along every dimension, the plane, the colour, and the states of the system's part.

const state = { place: [], x: null, y: null, color: null, units: "si", listeners: [] };

function onChange(listener) {
  state.listeners.push(listener);
}

/** Changes the state, calls all listeners, and writes the link. */
function choose(changes) {
  part.adjust?.(changes);
  Object.assign(state, changes);
  for (const listener of state.listeners) listener(changes);
  writeLink();
}

const SEEN_MARGIN = 200; // pixels; elements so near to the window are drawn before a reader scrolls to them

/** Return a function that draws an element if it is in the window or near it, else as soon as it is. */
function whenSeen(target, draw) {
  let [seen, stale] = [false, false];
  const drawIfStale = () => {
    if (stale) draw();
    stale = false;
  };
  const look = (entries) => {
    seen = entries.at(-1).isIntersecting;
    if (seen) drawIfStale();
  };
  new IntersectionObserver(look, { rootMargin: `${SEEN_MARGIN}px` }).observe(target);
  addEventListener("beforeprint", drawIfStale);
  return () => {
    stale = true;
    if (seen || document.documentElement.hasAttribute("data-printing")) drawIfStale();
  };
}

const REST_DELAY = 80; // ms without a change after which slow pictures are drawn; a moving slider changes faster

/** Return a function that draws a slow picture when there has been no change for a while. */
function atRest(draw) {
  let later;
  return () => {
    clearTimeout(later);
    later = setTimeout(draw, REST_DELAY);
  };
}

function placeWith(changes) {
  return state.place.map((i, k) => changes[theMap.order[k]] ?? i);
}

/** Return the dimensions that can span the plane: numeric and longer than one; those of real numbers if there are any. */
function planeDimensions() {
  if (theMap.cloud) return theMap.cloud; // coordinates of the points
  const candidates = theMap.dims.filter((dim) => dim.size > 1 && theMap.coordinates[dim.name].numeric);
  const real = candidates.filter((dim) => !theMap.coordinates[dim.name].whole);
  return (real.length > 0 ? real : candidates).map((dim) => dim.name);
}

function firstState() {
  state.place = theMap.dims.map((dim) => theMap.start.index[dim.name]);
  const candidates = planeDimensions();
  const longest = [...candidates].sort((a, b) => sizeOf(b) - sizeOf(a)).slice(0, 2);
  const preferred = theMap.start.plane.filter((name) => candidates.includes(name));
  [state.x = null, state.y = null] = preferred.length === 2 ? preferred : candidates.filter((name) => longest.includes(name));
  state.color = (theMap.choices.find(({ name }) => name === part.color) ?? theMap.choices[0]).name;
  setPartState();
  state.place = part.first?.() ?? informativePlace();
  readLink(`#${theMap.start.link}`, false);
  part.opening?.();
}

const UNINFORMATIVE = ["marginal", "sphere", "undetermined", "absent"]; // meanings of a leading flag without a motion to show
const START_DISTANCE = 0.2; // fraction of the picture between the first point and an uninformative one, so that it is not on the edge

/** Return the first point of the page; if it is impossible or uninformative, an informative one at some distance. */
function informativePlace() {
  const flag = Object.values(theMap.columns).find((column) => column.role === "headline" && column.isFlag);
  const margin = theMap.existence;
  const isInformative = (place) => !(margin && margin.at(place) < 0) && !(flag && UNINFORMATIVE.includes(flag.meanings.get(flag.at(place))));
  const names = theMap.cloud ? ["point"] : [state.x, state.y].filter(Boolean);
  if (isInformative(state.place) || names.length === 0) return state.place;
  const along = names.map((name) => theMap.order.indexOf(name));
  const away = (place) => Math.hypot(...along.map((k) => (place[k] - state.place[k]) / theMap.dims[k].size));
  return bestPlace(names, (place) => (isInformative(place) ? -Math.abs(away(place) - START_DISTANCE) : NaN));
}

function sizeOf(name) {
  return theMap.dims[theMap.order.indexOf(theMap.cloud?.includes(name) ? "point" : name)].size;
}

/** Calls `visit` with every place along some dimensions; the indices of all other dimensions stay. */
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

/** Return the place along some dimensions with the greatest merit; the selected place if no merit is a number. */
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

/** Return a value for a link, without its last digits, which are rounding, unless a neighbouring value is so near. */
function shortValue(coordinate, i) {
  const value = coordinate.values[i];
  if (typeof value !== "number") return value;
  const short = Number(value.toPrecision(12));
  return nearest(coordinate, String(short)) === i ? short : value;
}

/** Writes the link into the browser's history, once for all values that a moving slider passes. */
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

/** Sets the state from a link. Unknown names are ignored; values that the map does not have are reported. */
function readLink(hash = location.hash, isReported = true) {
  const parameters = new URLSearchParams(hash.slice(1));
  if ([...parameters].length === 0) return false;
  state.place = theMap.dims.map((dim, k) => nearest(theMap.coordinates[dim.name], parameters.get(dim.name)) ?? state.place[k]);
  state.place = nearestBy(parameters);
  if (isReported) showLinkRemarks(linkRemarks(parameters));
  const candidates = planeDimensions();
  const [x, y] = [parameters.get("_x"), parameters.get("_y")];
  if (candidates.includes(x) && candidates.includes(y) && x !== y) [state.x, state.y] = [x, y];
  if (theMap.choices.some((choice) => choice.name === parameters.get("_color"))) state.color = parameters.get("_color");
  setPartState(parameters);
  return true;
}

/** Return [column, value] of each coordinate along several dimensions that a link contains. */
function requestedCoordinates(parameters) {
  const known = Object.values(theMap.columns).filter(({ role, name }) => role === "coordinate" && parameters.has(name));
  return known.map((column) => [column, Number(parameters.get(column.name))]).filter(([, value]) => Number.isFinite(value));
}

/** Return the place nearest to these values, each in units of the column's range; further dimensions stay. */
function nearestBy(parameters) {
  const requests = requestedCoordinates(parameters);
  const stands = ([column], k) => column.shape[k] > 1 || column.powers[theMap.order[k]];
  const names = theMap.order.filter((name, k) => sizeOf(name) > 1 && !parameters.has(name) && requests.some((request) => stands(request, k)));
  const ranges = requests.map(() => [Infinity, -Infinity]);
  eachPlace(names, (place) => requests.forEach(([column], i) => (ranges[i] = [Math.min(ranges[i][0], column.at(place)), Math.max(ranges[i][1], column.at(place))])));
  const distance = ([column, value], place, [low, high]) => (column.at(place) - value) / (high - low || 1);
  return bestPlace(names, (place) => -requests.reduce((sum, request, i) => sum + distance(request, place, ranges[i]) ** 2, 0));
}

const OTHER_LINK_KEYS = { epsilon: "_nudge", moments: "moments" }; // of links of earlier versions, and of those typed by hand

/** Sets the states of the system's part from a link; null for states that it does not contain. */
function setPartState(parameters = new URLSearchParams()) {
  for (const [name, read] of Object.entries(part.kept ?? {})) state[name] = read(parameters.get(`_${name}`) ?? parameters.get(OTHER_LINK_KEYS[name]));
}

/** Return the relative size of a perturbation, between 0 and 1, from a link's text; null for any other text. */
function perturbationFromLink(text) {
  return Number(text) > 0 && Number(text) < 1 ? Number(text) : null;
}

const MAX_QUOTED = 60; // characters of a link's value that a message repeats

/** Return a sentence for each value of a link that the map does not have. */
function linkRemarks(parameters) {
  return [...parameters].flatMap(([name, text]) => {
    const reason = part.refusal?.(name, text);
    if (reason) return [`${name} = ${text.slice(0, MAX_QUOTED)}: ${reason}`];
    if (name.startsWith("_") || reason === "") return [];
    const request = requestedCoordinates(parameters).find(([column]) => column.name === name);
    if (request) return remarkOf(name, text, request[0].at(state.place), request[0].text(request[0].at(state.place)));
    const at = theMap.order.includes(name) ? nearest(theMap.coordinates[name], text) : null;
    if (at === null) return [`${name} = ${text} is not in this map and was ignored.`];
    const value = theMap.coordinates[name].values[at];
    return remarkOf(name, text, value, coordinateText(name, value));
  });
}

function remarkOf(name, text, value, shown) {
  const same = typeof value !== "number" || Math.abs(Number(text) - value) <= 1e-9 * Math.abs(value);
  return same ? [] : [`The map has no ${symbolText(name)} = ${text}: the nearest, ${shown}, is shown.`];
}

function showLinkRemarks(sentences) {
  const notice = document.getElementById("link-notice");
  notice.hidden = sentences.length === 0;
  notice.textContent = sentences.length > 0 ? `The link: ${sentences.slice(0, 5).join(" ")}` : "";
}

/** Return the index of a coordinate's value nearest to a link's text; null if there is none. */
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
