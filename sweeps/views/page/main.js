// The start of the page: columns and Plotly are unpacked, then everything is drawn.

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  document.getElementById("theme").textContent = theme === "dark" ? "Light" : "Dark";
}

const THEME = "polhode-theme"; // key of the reader's choice in the browser's storage, which a page in a mail may not have

function storedTheme(chosen) {
  try {
    if (chosen) localStorage.setItem(THEME, chosen);
    return localStorage.getItem(THEME);
  } catch {
    return chosen;
  }
}

function redraw() {
  for (const listener of state.listeners) listener({});
}

function buildTheme() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let chosen = ["light", "dark"].find((theme) => theme === storedTheme());
  setTheme(chosen ?? (dark.matches ? "dark" : "light"));
  document.getElementById("theme").onclick = () => {
    chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    storedTheme(chosen);
    setTheme(chosen);
    redraw();
  };
  dark.addEventListener("change", () => {
    if (!chosen) setTheme(dark.matches ? "dark" : "light");
    redraw();
  });
}

/** Prints in the light theme, whatever the theme of the screen is. */
function buildPrint() {
  const root = document.documentElement;
  let theme;
  const turn = (to) => {
    root.dataset.theme = to;
    redraw();
  };
  addEventListener("beforeprint", () => {
    theme = root.dataset.theme;
    root.toggleAttribute("data-printing", true);
    turn("light");
  });
  addEventListener("afterprint", () => {
    root.toggleAttribute("data-printing", false);
    turn(theme);
  });
}

async function start() {
  await Promise.all([loadPlotly(), ...Object.values(theMap.columns).map((column) => column.load())]);
  theMap.choices = [...(part.choices?.() ?? []), ...Object.values(theMap.columns)];
  if (theMap.cloud) part.coordinates?.();
  firstState();
  readLink();
  buildTheme();
  buildControls();
  if (theMap.table) part.buildTable();
  else if (theMap.cloud) buildCloud();
  else buildPlane();
  part.build?.();
  buildLecture();
  writeLink("replaceState");
  showRow(state.place);
  document.getElementById("all-values").addEventListener("toggle", () => showRow(state.place));
  say(state.place);
  onChange(() => {
    showRow(state.place);
    say(state.place);
  });
  // `location` may already have the link of an earlier choice, which is written with a delay
  addEventListener("hashchange", ({ newURL }) => readLink(new URL(newURL).hash) && redraw());
  let width = innerWidth;
  const resized = atRest(redraw);
  const units = document.getElementById("units");
  units.onchange = () => choose({ units: units.value });
  addEventListener("resize", () => {
    if (innerWidth !== width) resized();
    width = innerWidth;
  });
  buildPrint();
  document.documentElement.dataset.ready = "yes";
  performance.mark("usable");
}

// objects for the console and the tests
globalThis.polhode = { map: theMap, state, choose, placeWith, link, locate, numberText, ...part.shown };

await start();
