// Draws a report page from the JSON that the page carries. Every text goes in as a text node, never as markup.
"use strict";

window.addEventListener("error", (event) => {
  document.body.dataset.error = (document.body.dataset.error || "") + String(event.message) + "; ";
});

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const page = document.getElementById("page");
  const force_colours = { normal: "#4a86cf", tangential: "#e0853a", magnitude: "#8a929e" };
  const law_colours = ["#4477aa", "#ee6677", "#228833", "#c2a52b", "#3fb1d8", "#aa3377", "#e0853a", "#8a929e"];
  const follow_hint = "How far the field at the probe is from the isosurface's value, as a share of the largest difference in the volume.";
  const groups = {};

  // --- small helpers ---

  function make(parent, tag, className, text) {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  }

  function number(value, digits = 3) {
    if (value === null || value === undefined || Number.isNaN(value)) return "\u2013";
    if (value === 0) return "0";
    const size = Math.abs(value);
    // Too small to matter in any unit of the page; its JSON has the digits.
    if (size < 1e-4) return "\u2248\u00a00";
    if (size >= 1e5) return value.toExponential(Math.max(0, digits - 1));
    return size >= 10 ** digits ? value.toFixed(0) : String(Number(value.toPrecision(digits)));
  }

  function axis(value) {
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e5 || size < 1e-3 ? value.toExponential().replace(/^(-?\d\.?\d?)\d*e/, "$1e") : String(Number(value.toPrecision(4)));
  }

  function count(value) {
    return String(value).replace(/\B(?=(\d{3})+$)/g, "\u2009");
  }

  function percent(share) {
    return share === null ? "\u2013" : number(100 * share, 2) + " %";
  }

  function escaped(text) {
    const holder = document.createElement("span");
    holder.textContent = text;
    return holder.innerHTML;
  }

  function section(title, hint) {
    make(page, "h2", "", title);
    if (hint) make(page, "p", "hint", hint);
  }

  // --- plots ---

  function legend(state) {
    return state.series.filter((s) => s.isVisible).map((s) => {
      const value = state.x === undefined || s.yHTML === undefined ? "" : " " + s.yHTML;
      return `<span><i style="background:${s.color}"></i>${escaped(s.label)}${value}</span>`;
    }).join("") + (state.x === undefined ? "" : `<span>at ${escaped(state.xHTML)}</span>`);
  }

  function follow(group, source) {
    if (group.busy) return;
    group.busy = true;
    const range = source.isZoomed("x") ? source.xAxisRange() : null;
    for (const plot of group.plots) {
      if (plot !== source) plot.updateOptions({ dateWindow: range });
    }
    group.busy = false;
  }

  // spec: title, hint, rows, labels, colours, x, y, group, logarithmic, note
  function plot(parent, spec) {
    const panel = make(parent, "section", "panel");
    const head = make(panel, "div", "head");
    make(head, "h3", "", spec.title);
    const labels = make(head, "div", "legend");
    if (spec.hint) make(panel, "div", "hint", spec.hint);
    if (spec.rows.length < 2) {
      make(panel, "p", "hint", "Nothing to draw: the run has no such part.");
      return;
    }
    const box = make(panel, "div", spec.tall ? "plot tall" : "plot");
    const rows = spec.rows.map((row) => row.map((v) => (v === null ? NaN : v === undefined ? null : v)));
    const group = spec.group ? (groups[spec.group] = groups[spec.group] || { plots: [], busy: false }) : null;
    const graph = new Dygraph(box, rows, {
      labels: spec.labels, colors: spec.colours, labelsDiv: labels, legend: "always", legendFormatter: legend,
      xlabel: spec.x, ylabel: spec.y, logscale: Boolean(spec.logarithmic), strokeWidth: 1.4, highlightCircleSize: 3,
      connectSeparatedPoints: true, gridLineColor: "rgba(128,128,128,0.22)", axisLineColor: "rgba(128,128,128,0.6)",
      includeZero: Boolean(spec.zero), xRangePad: 4, yRangePad: 8, axisLabelFontSize: 12, xLabelHeight: 17, yLabelWidth: 17,
      digitsAfterDecimal: 6, series: spec.series || {},
      axes: {
        x: { valueFormatter: (v) => `${number(v, 4)} ${spec.unit}`, axisLabelFormatter: axis },
        y: { valueFormatter: (v) => (spec.logarithmic ? axis(v) : number(v, 3)), axisLabelFormatter: axis, axisLabelWidth: 64 },
      },
      drawCallback: (self, first) => { if (!first && group) follow(group, self); },
    });
    if (group) group.plots.push(graph);
    if (spec.ticks > spec.rows.length) {
      make(panel, "div", "hint", `Thinned for the page: ${count(spec.rows.length)} of ${count(spec.ticks)} ticks, the extremes of every stretch among them.`);
    }
  }

  function series_plot(parent, part, spec) {
    plot(parent, { ...spec, rows: part.rows, labels: part.labels, ticks: part.ticks });
  }

  /// One column of the same part of several laws over a common abscissa. undefined: no sample there; null: a gap.
  function overlay(parts, column) {
    const rows = new Map();
    parts.forEach((part, k) => {
      for (const row of part.rows) {
        if (!rows.has(row[0])) rows.set(row[0], [row[0], ...parts.map(() => undefined)]);
        rows.get(row[0])[k + 1] = row[column];
      }
    });
    return [...rows.values()].sort((a, b) => a[0] - b[0]);
  }

  function law_plot(parent, key, column, spec) {
    // A law that has no such part is left out; the others keep their colours.
    const laws = data.laws.map((law, k) => ({ name: law.law, part: law[key], k })).filter((law) => law.part);
    const rows = overlay(laws.map((law) => law.part), column);
    // Laws often agree: every second line is dashed, so that the one under it still shows.
    const series = Object.fromEntries(laws.map((law) => [law.name, { strokePattern: law.k % 2 === 1 ? [7, 4] : null }]));
    plot(parent, { ...spec, rows, series, labels: ["x", ...laws.map((law) => law.name)], colours: laws.map((law) => law_colours[law.k % law_colours.length]) });
  }

  // --- parts that both kinds of page have ---

  function draw_head() {
    const header = make(page, "header");
    make(header, "p", "kicker", data.kind === "run" ? "Asperity \u00b7 run" : "Asperity \u00b7 comparison of laws");
    make(header, "h1", "", data.title);
    const laws = data.kind === "run" ? `law: ${data.laws[0].law}` : "";
    make(header, "p", "meta", [laws, data.date].filter(Boolean).join(" \u00b7 "));
    if (data.warnings.length > 0) {
      const box = make(page, "div", "warnings");
      make(box, "strong", "", data.warnings.length === 1 ? "Warning" : "Warnings");
      const list = make(box, "ul");
      for (const text of data.warnings) make(list, "li", "", text);
    }
    make(page, "p", "summary", data.summary);
    if (data.notes.length > 0) {
      const list = make(page, "ul", "notes hint");
      for (const text of data.notes) make(list, "li", "", text);
    }
  }

  function draw_picture() {
    const image = document.getElementById("picture-image");
    if (!image || !data.picture) return;
    const figure = make(page, "figure");
    figure.appendChild(image);
    const scale = make(figure, "div", "scale");
    make(scale, "span", "", "Force");
    make(scale, "span", "", number(data.picture.low_n) + " N");
    make(scale, "div", "bar").style.background = `linear-gradient(to right, ${data.picture.colours.join(", ")})`;
    make(scale, "span", "", number(data.picture.high_n) + " N");
    make(figure, "figcaption", "", data.picture.caption + " Forces beyond the ends of the scale take the colour of its end.");
  }

  function draw_foot() {
    section("How to reproduce");
    if (data.command) make(page, "pre", "", data.command);
    const body = make(make(page, "table", "facts"), "tbody");
    for (const [name, value] of [...data.setup, ["Program", data.program], ["Machine", data.machine], ["Date", data.date]]) {
      if (!value) continue;
      const row = make(body, "tr");
      make(row, "td", "", name);
      make(row, "td", "", value);
    }
    make(page, "footer", "", "Drag across a plot to zoom, double-click to see all again; plots over the same quantity move together. " +
      "Plots: dygraphs 2 (MIT licence), carried in this file.");
  }

  // --- one run ---

  function card(parent, name, value, unit, more) {
    const box = make(parent, "div", "card");
    make(box, "div", "name", name);
    const line = make(box, "div", "value", value + " ");
    make(line, "small", "", unit);
    if (more) make(box, "div", "more", more);
  }

  function draw_cards(n) {
    const grid = make(page, "div", "cards");
    card(grid, "Force, mean in contact", number(n.force_mean_n), "N", `at most ${number(n.force_max_n)} N, RMS ${number(n.force_rms_n)} N`);
    card(grid, "Height error, RMS", number(n.height_rms_um), "\u00b5m",
      n.relief_um > 0 ? `${percent(n.height_relative)} of ${number(n.relief_um)} \u00b5m relief` : "on a surface without relief");
    card(grid, "Direction error, mean", number(n.direction_mean_deg, 2), "deg", `p99 ${number(n.direction_p99_deg, 2)}, at most ${number(n.direction_max_deg, 2)} deg`);
    card(grid, "Largest jump in a tick", number(n.jump_n), "N", n.jump_mm === null ? `tick ${count(n.jump_tick)}` : `at ${number(n.jump_mm, 4)} mm, tick ${count(n.jump_tick)}`);
    card(grid, "Energy given back", number(n.generated_mj, 2), "mJ", `beyond what was taken; ${number(n.absorbed_mj, 2)} mJ taken` +
      (n.mean_loop_mj === null ? "" : `; ${number(n.mean_loop_mj, 2)} mJ a loop`));
    if (n.follow_samples > 0)
      card(grid, "Follow error", number(n.follow_global_percent), "%", `mean over time ${number(n.follow_mean_percent)} %, ${number(n.follow_min_percent)} to ${number(n.follow_max_percent)} %`);
    card(grid, "Update time, median", number(n.update_p50_us), "\u00b5s", `p99 ${number(n.update_p99_us)}, p99.9 ${number(n.update_p999_us)}, at most ${number(n.update_max_us)} \u00b5s`);
    card(grid, "In contact", percent(n.ticks > 0 ? n.contact_ticks / n.ticks : null), "", `${count(n.contact_ticks)} of ${count(n.ticks)} ticks, ${number(n.length_mm)} mm travelled`);
    card(grid, "Safety stage", count(n.interventions), "ticks changed", n.interventions > 0 ? `by ${number(n.largest_intervention_n)} N at most` : "every rendered force went out as it was");
  }

  function draw_histogram(parent, histogram, n) {
    const panel = make(parent, "section", "panel");
    make(make(panel, "div", "head"), "h3", "", "Update time, ticks per bin");
    make(panel, "div", "hint", `Heights are logarithmic. Median ${number(n.update_p50_us)}, p99 ${number(n.update_p99_us)}, p99.9 ${number(n.update_p999_us)}, ` +
      `at most ${number(n.update_max_us)} \u00b5s.`);
    const bars = make(panel, "div", "bars");
    const ticks = make(panel, "div", "ticks");
    const top = Math.log10(1 + Math.max(1, ...histogram.counts));
    const step = Math.max(1, Math.ceil(histogram.counts.length / 8));
    histogram.counts.forEach((value, k) => {
      const bar = make(bars, "div");
      bar.style.height = `${(100 * Math.log10(1 + value)) / top}%`;
      bar.title = `${number(histogram.edges[k])} to ${number(histogram.edges[k + 1])} \u00b5s: ${count(value)} ticks`;
      make(ticks, "div", "", k % step === 0 ? number(histogram.edges[k], 2) + (k === 0 ? " \u00b5s" : "") : "");
    });
  }

  function draw_numbers(n) {
    section("All numbers");
    const names = {
      ticks: "Ticks", contact_ticks: "Ticks in contact", duration_s: "Duration (s)", rate_hz: "Rate (Hz)", length_mm: "Distance travelled (mm)",
      force_mean_n: "Force, mean in contact (N)", force_max_n: "Force, largest (N)", force_rms_n: "Force, RMS in contact (N)",
      force_normal_n: "Normal force, mean (N)", jump_n: "Largest jump in a tick (N)", direction_samples: "Direction samples",
      direction_mean_deg: "Direction error, mean (deg)", direction_p99_deg: "Direction error, p99 (deg)", direction_max_deg: "Direction error, largest (deg)",
      direction_near_deg: "Direction error near sharp edges, mean (deg)", direction_far_deg: "Direction error elsewhere, mean (deg)",
      height_samples: "Heights compared", height_excluded: "Heights left out, within one texel of a step", height_rms_um: "Height error, RMS (\u00b5m)",
      height_max_um: "Height error, largest (\u00b5m)", relief_um: "Relief met, highest to lowest (\u00b5m)", excursion_um: "Height followed, highest to lowest (\u00b5m)",
      peak_normal_hz: "Normal force, strongest frequency (Hz)", peak_tangential_hz: "Tangential force, strongest frequency (Hz)",
      peak_normal_per_mm: "Normal force, strongest spatial frequency (1/mm)", peak_tangential_per_mm: "Tangential force, strongest spatial frequency (1/mm)",
      work_mj: "Work on the hand, whole run (mJ)", held_work_mj: "The same with forces held from tick to tick (mJ)", absorbed_mj: "Most energy taken at one time (mJ)",
      follow_samples: "Ticks compared with the isosurface's value", follow_global_percent: "Follow error over the path (%)",
      follow_mean_percent: "Follow error, mean over time (%)", follow_min_percent: "Follow error, smallest (%)", follow_max_percent: "Follow error, largest (%)",
      generated_mj: "Largest rise of work + stored energy (mJ)", mean_loop_mj: "Energy a loop, mean (mJ)", interventions: "Ticks changed by the safety stage",
      largest_intervention_n: "Largest change by the safety stage (N)", update_mean_us: "Update time, mean (\u00b5s)", update_p50_us: "Update time, median (\u00b5s)",
      update_p99_us: "Update time, p99 (\u00b5s)", update_p999_us: "Update time, p99.9 (\u00b5s)", update_max_us: "Update time, largest (\u00b5s)",
    };
    const body = make(make(page, "table", "facts wide"), "tbody");
    const add = (name, value) => {
      const row = make(body, "tr");
      make(row, "td", "", name);
      make(row, "td", "", value);
    };
    for (const [key, name] of Object.entries(names)) {
      if (key.startsWith("follow_") && n.follow_samples === 0) continue;
      add(name, Number.isInteger(n[key]) ? count(n[key]) : number(n[key], 4));
    }
    for (const [flag, ticks] of Object.entries(n.flags)) add(`Ticks with ${flag.replaceAll("_", " ")}`, count(ticks));
  }

  function draw_run() {
    const law = data.laws[0];
    const forces = [force_colours.normal, force_colours.tangential, force_colours.magnitude];
    draw_cards(law.numbers);
    draw_picture();
    section("Along the stroke", "What the hand felt and where the felt point went, over the distance travelled.");
    series_plot(page, law.force_distance, { title: "Force", x: "distance (mm)", y: "N", unit: "mm", group: "distance", colours: forces, tall: true });
    if (law.parts_distance) {
      series_plot(page, law.parts_distance, { title: "Friction and texture", hint: "Parts of the tangential force along the direction of travel; what remains of it is constraint. Negative resists.",
        x: "distance (mm)", y: "N", unit: "mm", group: "distance", colours: ["#228833", "#aa3377"] });
    }
    series_plot(page, law.height_distance, { title: "Height over the base", hint: "Followed: of the proxy, or of the probe with the force's own deflection removed. Relief: the reconstructed map at the same base point.",
      x: "distance (mm)", y: "mm", unit: "mm", group: "distance", colours: [force_colours.normal, "#e0853a"] });
    series_plot(page, law.direction_distance, { title: "Angle of the force to the surface's normal", x: "distance (mm)", y: "deg", unit: "mm", group: "distance", zero: true, colours: ["#aa3377"] });
    section("Over time");
    series_plot(page, law.force_time, { title: "Force", x: "time (s)", y: "N", unit: "s", group: "time", colours: forces });
    series_plot(page, law.energy_time, { title: "Energy", hint: "Work on the hand since the start, energy stored in the contact's spring, and their sum. A passive contact never lets the sum rise.",
      x: "time (s)", y: "mJ", unit: "s", group: "time", colours: ["#4a86cf", "#228833", "#d0475a"] });
    draw_account();
    if (law.follow_time)
      series_plot(page, law.follow_time, { title: "Follow error", hint: follow_hint, x: "time (s)", y: "%", unit: "s", group: "time", zero: true, colours: ["#228833"] });
    section("Spectra and cost");
    const pair = make(page, "div", "pair");
    const two = [force_colours.normal, force_colours.tangential];
    series_plot(pair, law.spectrum_time, { title: "Force over time", x: "frequency (Hz)", y: "N / \u221aHz", unit: "Hz", logarithmic: true, colours: two });
    series_plot(pair, law.spectrum_distance, { title: "Force over distance", x: "spatial frequency (1/mm)", y: "N / \u221a(1/mm)", unit: "/mm", logarithmic: true, colours: two });
    draw_histogram(page, law.update_histogram, law.numbers);
    draw_numbers(law.numbers);
    draw_foot();
  }

  // What would have given more than the hand had put in, law by law.
  function draw_account() {
    const rows = data.laws.flatMap((law) => law.numbers.account.map((row) => [law.law, ...row]));
    if (rows.length === 0) return;
    make(page, "p", "hint", "What would have given the hand more than it had put in, and how much of that was paid: from what it had put in elsewhere, or by the scene's change power. " +
      "The rest was refused: that force was softened.");
    const table = make(make(page, "div", "scroll"), "table");
    const head = make(make(table, "thead"), "tr");
    for (const name of ["law", "giver", "asked (mJ)", "paid (mJ)", "refused (mJ)"]) make(head, "th", "", name);
    const body = make(table, "tbody");
    for (const [law, giver, ...energies] of rows) {
      const row = make(body, "tr");
      make(row, "td", "", law);
      make(row, "td", "", giver);
      for (const energy of energies) make(row, "td", "", number(energy));
    }
  }

  // --- several laws ---

  function draw_table() {
    const table = make(make(page, "div", "scroll"), "table");
    const head = make(make(table, "thead"), "tr");
    const columns = [
      ["direction, mean (deg)", (n) => number(n.direction_mean_deg, 2)], ["p99", (n) => number(n.direction_p99_deg, 2)], ["max", (n) => number(n.direction_max_deg, 2)],
      ["height error, RMS (\u00b5m)", (n) => number(n.height_rms_um)], ["of relief", (n) => percent(n.height_relative)],
      ["largest jump (N)", (n) => number(n.jump_n)], ["energy a loop (mJ)", (n) => number(n.mean_loop_mj, 2)], ["given back (mJ)", (n) => number(n.generated_mj, 2)],
      ["update p50 (\u00b5s)", (n) => number(n.update_p50_us)], ["p99.9", (n) => number(n.update_p999_us)],
    ];
    const near = data.laws.some((law) => law.numbers.direction_near_deg != null);
    if (near) columns.splice(3, 0, ["near edges, mean (deg)", (n) => number(n.direction_near_deg, 2)], ["elsewhere (deg)", (n) => number(n.direction_far_deg, 2)]);
    if (data.laws.some((law) => law.follow_time))
      columns.push(["follow error (%)", (n) => number(n.follow_global_percent)], ["at most (%)", (n) => number(n.follow_max_percent)]);
    make(head, "th", "", "law");
    for (const [name] of columns) make(head, "th", "", name);
    make(head, "th", "left", "what the numbers say");
    const body = make(table, "tbody");
    for (const law of data.laws) {
      const row = make(body, "tr");
      make(row, "td", "", law.law);
      for (const [, value] of columns) make(row, "td", "", value(law.numbers));
      make(row, "td", "left", law.verdict);
    }
  }

  function draw_loop_rate() {
    if (!data.loop_rate || data.loop_rate.length === 0) return;
    section("Loop rate over the size of the data", "The same isosurface on every eighth, fourth, second and every sample along each axis: median time of a tick on the machine named below, the least of five rounds. Memory is of volume and octree, which all laws feel; what a law adds is what it remembers and what was made for it.");
    const names = data.laws.map((law) => law.law);
    const table = make(make(page, "div", "scroll"), "table");
    const head = make(make(table, "thead"), "tr");
    for (const name of ["samples", "memory (MB)", ...names.map((name) => `${name} adds (bytes)`), ...names.map((name) => `${name} (\u00b5s)`), ...names.map((name) => `${name} (kHz)`)]) make(head, "th", "", name);
    const body = make(table, "tbody");
    for (const [samples, megabytes, added, ...times] of data.loop_rate) {
      const row = make(body, "tr");
      make(row, "td", "", String(samples));
      make(row, "td", "", number(megabytes));
      for (const bytes of added) make(row, "td", "", String(bytes));
      for (const time of times) make(row, "td", "", number(time));
      for (const time of times) make(row, "td", "", number(1e3 / time));
    }
    if (data.loop_rate.length > 1)
      plot(page, { title: "Time of a tick", x: "log2 of the samples", y: "\u00b5s", unit: "", zero: true, labels: ["size", ...names],
        colours: names.map((_, k) => law_colours[k % law_colours.length]), series: {},
        rows: data.loop_rate.map(([samples, , , ...times]) => [Math.log2(samples), ...times]) });
  }

  function draw_detection() {
    if (!data.detection || data.detection.length === 0) return;
    section("Detection at speed", "Share of straight passages through the isosurface, at places of the stroke and each from a random start, in which a law answered with a contact. " +
      "Expected: of avila, min(1, layer / distance in a tick).");
    const names = data.laws.map((law) => law.law);
    const table = make(make(page, "div", "scroll"), "table");
    const head = make(make(table, "thead"), "tr");
    for (const name of ["speed (m/s)", "layer (mm)", "expected", ...names]) make(head, "th", "", name);
    const body = make(table, "tbody");
    for (const [speed, layer, ...shares] of data.detection) {
      const row = make(body, "tr");
      make(row, "td", "", number(speed));
      make(row, "td", "", number(layer));
      for (const share of shares) make(row, "td", "", percent(share));
    }
    plot(page, { title: "Detected over speed", x: "speed (m/s)", y: "%", unit: "m/s", zero: true, labels: ["speed", ...names],
      colours: names.map((_, k) => law_colours[k % law_colours.length]), series: {},
      rows: data.detection.map(([speed, , , ...shares]) => [speed, ...shares.map((share) => share == null ? null : 100 * share)]) });
  }

  function draw_compare() {
    draw_table();
    make(page, "p", "hint", "Direction: angle of the force to the normal of the reconstructed relief (of the face, on a bare mesh). Height: of the felt point against the relief at the same " +
      "base point, samples within one texel of a step left out. Given back: largest rise of work + stored energy.");
    draw_picture();
    section("Along the stroke");
    law_plot(page, "force_distance", 1, { title: "Normal force", x: "distance (mm)", y: "N", unit: "mm", group: "distance" });
    law_plot(page, "force_distance", 2, { title: "Tangential force", hint: "Along the direction of travel; negative resists.", x: "distance (mm)", y: "N", unit: "mm", group: "distance" });
    if (data.laws.some((law) => law.parts_distance)) {
      law_plot(page, "parts_distance", 1, { title: "Friction", hint: "Along the direction of travel; negative resists.", x: "distance (mm)", y: "N", unit: "mm", group: "distance" });
      law_plot(page, "parts_distance", 2, { title: "Lateral force of the texture", x: "distance (mm)", y: "N", unit: "mm", group: "distance" });
    }
    law_plot(page, "height_distance", 1, { title: "Height followed", x: "distance (mm)", y: "mm", unit: "mm", group: "distance" });
    law_plot(page, "direction_distance", 1, { title: "Direction error", x: "distance (mm)", y: "deg", unit: "mm", group: "distance", zero: true });
    if (data.laws.every((law) => law.follow_time))
      law_plot(page, "follow_time", 1, { title: "Follow error over time", hint: follow_hint, x: "time (s)", y: "%", unit: "s", zero: true });
    draw_loop_rate();
    draw_detection();
    section("Energy, spectra");
    law_plot(page, "energy_time", 3, { title: "Work + stored energy", hint: "A passive contact never lets it rise.", x: "time (s)", y: "mJ", unit: "s" });
    draw_account();
    law_plot(page, "spectrum_distance", 1, { title: "Normal force over distance", x: "spatial frequency (1/mm)", y: "N / \u221a(1/mm)", unit: "/mm", logarithmic: true });
    law_plot(page, "spectrum_distance", 2, { title: "Tangential force over distance", x: "spatial frequency (1/mm)", y: "N / \u221a(1/mm)", unit: "/mm", logarithmic: true });
    draw_foot();
  }

  draw_head();
  if (data.kind === "run") draw_run(); else draw_compare();
  document.body.dataset.ready = "true";
})();
