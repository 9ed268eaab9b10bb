// Draws the page of laws scored on a measured trajectory. Every text goes in as a text node, never as markup.
"use strict";

window.addEventListener("error", (event) => {
  document.body.dataset.error = (document.body.dataset.error || "") + String(event.message) + "; ";
});

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const page = document.getElementById("page");
  const grey = "#8a929e";
  const colours = ["#2f6db3", "#c8553d", "#3d8b5f", "#8a5fb0", "#b58a2b", "#4aa3a8", "#a34a78"];

  function make(parent, tag, className, text) {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  }

  // The legend is Dygraph's own markup: labels are law names, which are put in as text.
  function legend(parent, names, hues) {
    names.forEach((name, i) => {
      const entry = make(parent, "span");
      make(entry, "i").style.background = hues[i];
      entry.append(name);
    });
  }

  function table(columns, rows) {
    const element = make(make(page, "div", "scroll"), "table");
    const head = make(make(element, "thead"), "tr");
    for (const name of columns) make(head, "th", "", name);
    const body = make(element, "tbody");
    for (const cells of rows) {
      const row = make(body, "tr");
      for (const cell of cells) make(row, "td", "", cell);
    }
  }

  function plot(one) {
    const names = one.measured ? ["measured", ...data.laws] : data.laws;
    const hues = data.laws.map((_, i) => colours[i % colours.length]);
    if (one.measured) hues.unshift(grey);
    const panel = make(page, "section", "panel");
    const head = make(panel, "div", "head");
    make(head, "h3", "", one.title);
    legend(make(head, "div", "legend"), names, hues);
    const box = make(panel, "div", "plot");
    // Lines are told apart by their number: names may be equal, or hold markup.
    const labels = ["distance", ...names.map((_, i) => `s${i}`)];
    new Dygraph(box, one.rows.map((row) => row.map((v) => (v === null ? NaN : v))), {
      labels, colors: hues, legend: "never", xlabel: "distance (mm)", ylabel: one.y, strokeWidth: 1.4,
      gridLineColor: "rgba(128,128,128,0.22)", axisLineColor: "rgba(128,128,128,0.6)", axisLabelFontSize: 12,
      xLabelHeight: 17, yLabelWidth: 17, yRangePad: 8, axes: { y: { axisLabelWidth: 56 } },
    });
  }

  const header = make(page, "header");
  make(header, "p", "kicker", "Asperity \u00b7 laws on a measured trajectory");
  make(header, "h1", "", data.title);
  make(header, "p", "meta", data.date);
  make(page, "p", "summary", data.summary);
  const notes = make(page, "ul", "notes hint");
  for (const text of data.notes) make(notes, "li", "", text);

  make(page, "h2", "", "Scores");
  make(page, "p", "hint", "dF: the law's force less the measured one, over samples where either is above 1 mN. Angle: between the two. To the true normal: of the law's force. Missed: share of the measured contact without an answer; added: share of the free path with one.");
  table(data.columns, data.table);

  make(page, "h2", "", "Along the path");
  for (const one of data.plots) plot(one);

  make(page, "h2", "", "How to reproduce");
  make(page, "pre", "", data.command);
  make(page, "footer", "", `${data.program}. Plots: dygraphs 2 (MIT licence), carried in this file.`);
  document.body.dataset.ready = "true";
})();
