// What a reader wants first: a page to learn from, then the gallery, then the reference.
var FIRST = { lecture: 40, tutorials: 40, howto: 20, gallery: 10, faq: 10, glossary: 10, reference: -5 };
var Scorer = {
  score: ([page, , , , score]) => score + (FIRST[page.split("/")[0]] ?? 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
