// Brings the page to life.
for (const box of document.querySelectorAll("[data-choices]")) new Choices(box);
for (const figure of document.querySelectorAll("figure[data-plot]")) new Plot(figure);
for (const box of document.querySelectorAll("[data-motion]")) new Viewer(box, data.motions[box.dataset.motion]);
for (const box of document.querySelectorAll("[data-comparison]")) new Comparison(box, data.runs);
