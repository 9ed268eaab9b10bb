// Draws the page of friction laws against measured stick-slip. Every text goes in as a text node, never as markup.
"use strict";

window.addEventListener("error", (event) => {
  document.body.dataset.error = (document.body.dataset.error || "") + String(event.message) + "; ";
});

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const page = document.getElementById("page");
  const colours = ["#8a929e", "#2f6db3"];

  function make(parent, tag, className, text) {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  }

  function number(value, digits = 3) {
    return value === null || value === undefined ? "\u2013" : String(Number(value.toPrecision(digits)));
  }

  function legend(state) {
    return state.series.map((s) => `<span><i style="background:${s.color}"></i>${s.label}</span>`).join("");
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

  function plot(parent, trace, law) {
    const panel = make(parent, "section", "panel");
    const head = make(panel, "div", "head");
    make(head, "h3", "", `${trace.name}, ${trace.fitted ? "fitted" : "predicted"}`);
    const labels = make(head, "div", "legend");
    make(panel, "div", "hint", `misfit ${number(law.misfit)}`);
    const box = make(panel, "div", "plot");
    new Dygraph(box, law.rows.map((row) => row.map((v) => (v === null ? NaN : v))), {
      labels: ["time", "measured", "law"], colors: colours, labelsDiv: labels, legend: "always", legendFormatter: legend,
      xlabel: "time (s)", ylabel: "friction / load", strokeWidth: 1.4, gridLineColor: "rgba(128,128,128,0.22)",
      axisLineColor: "rgba(128,128,128,0.6)", axisLabelFontSize: 12, xLabelHeight: 17, yLabelWidth: 17, yRangePad: 8,
      connectSeparatedPoints: true, axes: { y: { axisLabelWidth: 56 } },
    });
  }

  const header = make(page, "header");
  make(header, "p", "kicker", "Asperity \u00b7 friction laws against measured stick-slip");
  make(header, "h1", "", data.title);
  make(header, "p", "meta", data.date);
  make(page, "p", "summary", data.summary);
  const notes = make(page, "ul", "notes hint");
  for (const text of data.notes) make(notes, "li", "", text);

  make(page, "h2", "", "Misfit");
  make(page, "p", "hint", data.misfit_hint);
  table(["law", "on fitted traces", "on predicted traces", ...data.traces.map((t) => `${t.name} (${t.fitted ? "fitted" : "predicted"})`)],
    data.laws.map((law) => [law.name, number(law.fitted_misfit), number(law.predicted_misfit), ...law.traces.map((t) => number(t.misfit))]));

  make(page, "h2", "", "Measured against predicted");
  make(page, "p", "hint", "Measured values with the spread from event to event. Error: predicted over measured, less one.");
  table(["trace", "law", "", "period (s)", "measured", "error", "amplitude", "measured", "error", "static/dynamic", "measured", "error", "level", "measured", "error"], data.comparison);

  make(page, "h2", "", "Fitted parameters");
  make(page, "p", "hint", "SI. A star marks a parameter that ended at an end of what was searched: the traces do not tell it.");
  table(["law", ...data.parameter_names], data.laws.map((law) => [law.name, ...law.parameters]));

  for (const law of data.laws) {
    make(page, "h2", "", law.name);
    make(page, "p", "hint", law.verdict);
    const pair = make(page, "div", "pair");
    law.traces.forEach((t, k) => plot(pair, data.traces[k], t));
  }

  make(page, "h2", "", "How to reproduce");
  make(page, "pre", "", data.command);
  make(page, "footer", "", `${data.program}. Plots: dygraphs 2 (MIT licence), carried in this file.`);
  document.body.dataset.ready = "true";
})();
