// The part of bodies that are not known exactly: their table, the cloud of draws, and how far these spread.

/** The spin of which least is sure. */
function mostDoubtful() {
  const { probability_unstable: share } = theMap.columns;
  if (!share || theMap.start.whole) return state.place;
  return bestPlace(theMap.order.filter((name) => ["body", "axis"].includes(name)), (place) => share.at(place) * (1 - share.at(place)));
}

const part = {
  buildTable: () => buildBodies(),
  kept: { across: (text) => text, up: (text) => text, told: (text) => text, draw: (text) => (/^\d{1,9}$/.test(text ?? "") ? Number(text) : null) },
  first: mostDoubtful,
  say: outlookInWords,
  build() {
    buildDrawn();
    buildSpread();
  },
};
