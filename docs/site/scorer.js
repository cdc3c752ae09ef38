// Order of the pages that the manual's search finds: those that name the words in their title first,
// then those that explain words, and those about the project itself last.
const words = (new URLSearchParams(location.search).get("q") ?? "").toLowerCase();
const about = ["ARCHITECTURE", "CHANGELOG", "CONTRIBUTING", "SECURITY", "README", "python/README"];
const explain = ["docs/symbols"];

var Scorer = {
    score: ([page, title, , , score]) =>
        score +
        (title.toLowerCase().includes(words) ? 20 : 0) +
        (explain.includes(page) ? 4 : 0) -
        (about.includes(page) ? 20 : 0),
    objNameMatch: 30,
    objPartialMatch: 15,
    objPrio: { 0: 15, 1: 5, 2: -5 },
    objPrioDefault: 0,
    title: 15,
    partialTitle: 7,
    term: 5,
    partialTerm: 2,
};
