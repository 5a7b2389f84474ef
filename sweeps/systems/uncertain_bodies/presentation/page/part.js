// The part of bodies that are not known exactly: their table, the cloud of draws, and how far these spread.

/** The spin of which least is sure. */
function mostDoubtful() {
  const { probability_unstable: share } = theMap.columns;
  let [most, best] = [-1, state.place];
  if (!share || theMap.start.whole) return best;
  eachPlace(theMap.order.filter((name) => ["body", "axis"].includes(name)), (place) => {
    const doubt = share.at(place) * (1 - share.at(place));
    if (doubt > most) [most, best] = [doubt, [...place]];
  });
  return best;
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
