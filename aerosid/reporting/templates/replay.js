"use strict";
(() => {
  const frames = JSON.parse(document.getElementById("replay-data").textContent);
  const byId = (id) => document.getElementById(id);
  const slider = byId("replay-slider");
  const number = (value, digits) => (value === null ? "–" : Number(value).toPrecision(digits).replace("-", "−"));
  const fill = (id, rows) => {
    byId(id).replaceChildren(...rows.map((cells) => {
      const row = document.createElement("tr");
      row.replaceChildren(...cells.map((text) => {
        const cell = document.createElement("td");
        cell.textContent = text;
        return cell;
      }));
      return row;
    }));
  };
  const show = () => {
    const frame = frames[slider.value];
    const last = frames[frames.length - 1];
    byId("replay-time").textContent = frame.time.toFixed(2) + " s";
    byId("replay-names").textContent = frame.names.length
      ? frame.names.map((name) => `${name.coefficient} ${name.term} identified at ${name.time.toFixed(2)} s`).join("; ")
      : "No term identified yet.";
    fill("replay-derivatives", frame.derivatives.map((row) =>
      [row.coefficient, row.term, number(row.value, 4), number(row.deviation, 2)]));
    fill("replay-candidates", frame.candidates.map((row) =>
      [row.coefficient, row.term, row.correlation.toFixed(2), Number(row.p_value).toPrecision(2), row.reason]));
    const span = last.time - frames[0].time;
    const x = span > 0 ? (1000 * (frame.time - frames[0].time)) / span : 1000;
    for (const cursor of document.querySelectorAll(".replay-cursor")) {
      cursor.setAttribute("x1", x);
      cursor.setAttribute("x2", x);
    }
  };
  slider.addEventListener("input", show);
  show();
})();
