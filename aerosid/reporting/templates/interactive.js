"use strict";
// Draws every figure of the page with plotly over its still picture, which stays for paper. Charts of one flight are
// zoomed together. Texts from files were escaped when the figures were written and reach plotly as text.
(() => {
  const held = JSON.parse(document.getElementById("figure-data").textContent);
  const TYPES = { f4: Float32Array, f8: Float64Array };
  const arrays = held.arrays.map(({ dtype, bytes }) => {
    const text = atob(bytes);
    const raw = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i += 1) raw[i] = text.charCodeAt(i);
    return new TYPES[dtype](raw.buffer);
  });
  const CONFIG = {
    displaylogo: false, responsive: true, doubleClick: "reset", scrollZoom: false,
    showSendToCloud: false, plotlyServerURL: "", // flight data stay here
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
  };
  const charts = [];
  let following = false;

  function colours() {
    const style = getComputedStyle(document.documentElement);
    return (role) => style.getPropertyValue(`--${role}`).trim();
  }

  function shown(role) {
    const box = document.getElementById(`show-${role}`);
    return !box || box.checked;
  }

  function traces(chart) {
    const colour = colours();
    const toggled = document.getElementById("prediction")?.contains(chart.element);
    return chart.figure.data.map((trace) => {
      const made = {
        ...trace, x: arrays[trace.x], y: arrays[trace.y], showlegend: false, hoverinfo: trace.hoverinfo ?? "x+y+name",
        visible: !toggled || shown(trace.meta),
      };
      for (const part of ["line", "marker"]) {
        if (part in trace) made[part] = { ...trace[part], color: colour(trace.meta) };
      }
      if ("fill" in trace) made.fillcolor = colour(trace.meta);
      return made;
    });
  }

  function layout(chart) {
    const colour = colours();
    const made = {
      ...chart.figure.layout,
      autosize: true,
      margin: { l: 66, r: 8, t: 4, b: 4 },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(document.body).fontFamily, color: colour("ink") },
      hovermode: "closest",
      hoverlabel: { namelength: -1, bgcolor: colour("sheet"), bordercolor: colour("rule"), font: { color: colour("ink") } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("muted"), activecolor: colour("link") },
      dragmode: "zoom",
      uirevision: "kept",
      shapes: chart.figure.layout.shapes.map((shape) => ({ ...shape, fillcolor: colour(shape.name) })),
    };
    for (const [name, axis] of Object.entries(made)) {
      if (!/^[xy]axis\d*$/.test(name)) continue;
      const range = chart.element.layout?.[name]?.range ?? axis.range;
      made[name] = {
        ...axis, range: [...range], gridcolor: colour("grid"), linecolor: colour("muted"), showline: true,
        exponentformat: "power", zeroline: false, tickcolor: colour("muted"), showspikes: name === "xaxis", spikemode: "across",
        spikesnap: "cursor", spikethickness: 1, spikedash: "solid", spikecolor: colour("muted"),
      };
    }
    return made;
  }

  const drawn = (chart) => Plotly.react(chart.element, traces(chart), layout(chart), CONFIG);
  const companions = (chart) => charts.filter((other) => other.figure.timeline === chart.figure.timeline);

  function start(chart) {
    const axes = Object.entries(chart.figure.layout).filter(([name]) => /^[xy]axis\d*$/.test(name));
    return Object.fromEntries(axes.map(([name, axis]) => [`${name}.range`, [...axis.range]]));
  }

  function whole(chart) {
    following = true;
    Promise.all(companions(chart).map((other) => Plotly.relayout(other.element, start(other)))).then(() => {
      following = false;
    });
  }

  // The time shown `scale` times as long, its middle moved by `shift` of its length.
  function moved(chart, scale, shift) {
    const [low, high] = chart.element.layout.xaxis.range;
    const middle = (low + high) / 2 + shift * (high - low);
    const half = (scale * (high - low)) / 2;
    Plotly.relayout(chart.element, { "xaxis.range": [middle - half, middle + half] });
  }

  function follow(chart, change) {
    if (following || !Object.keys(change).some((key) => key.startsWith("xaxis."))) return;
    following = true;
    const range = [...chart.element.layout.xaxis.range];
    const others = companions(chart).filter((other) => other !== chart);
    Promise.all(others.map((other) => Plotly.relayout(other.element, { "xaxis.range": range }))).then(() => {
      following = false;
    });
  }

  const ACTIONS = [
    ["Zoom in", ["+", "="], (chart) => moved(chart, 0.5, 0)],
    ["Zoom out", ["-"], (chart) => moved(chart, 2, 0)],
    ["Earlier", ["ArrowLeft"], (chart) => moved(chart, 1, -0.25)],
    ["Later", ["ArrowRight"], (chart) => moved(chart, 1, 0.25)],
    ["Whole flight", ["0"], whole],
  ];

  function controls(chart, caption) {
    const bar = document.createElement("div");
    bar.className = "controls";
    bar.setAttribute("role", "toolbar");
    bar.setAttribute("aria-label", `Zoom of ${caption}`);
    for (const [words, keys, act] of ACTIONS) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = words;
      button.title = `${words} (key ${keys[0]})`;
      button.addEventListener("click", () => act(chart));
      bar.append(button);
    }
    return bar;
  }

  async function install(figure) {
    const frame = document.getElementById(figure.id);
    const still = frame.querySelector(".drawing");
    const element = document.createElement("div");
    element.className = "live";
    element.tabIndex = 0;
    element.setAttribute("role", "group");
    element.setAttribute("aria-label", still.querySelector("svg").getAttribute("aria-label"));
    const chart = { figure, element };
    still.after(element);
    const number = frame.querySelector("figcaption b")?.textContent ?? figure.id;
    frame.insertBefore(controls(chart, number), still);
    element.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const action = ACTIONS.find(([, keys]) => keys.includes(event.key));
      if (!action) return;
      event.preventDefault();
      action[2](chart);
    });
    frame.classList.add("is-live");
    await Plotly.newPlot(element, traces(chart), layout(chart), CONFIG);
    charts.push(chart);
    element.on("plotly_relayout", (change) => follow(chart, change));
    element.on("plotly_doubleclick", () => { whole(chart); });
  }

  async function installAll() {
    for (const figure of held.figures) {
      try {
        await install(figure);
      } catch (error) {
        document.getElementById(figure.id).classList.remove("is-live"); // the still picture is there
        console.error(error);
      }
      await new Promise((resolve) => { setTimeout(resolve); }); // the page answers between figures
    }
    for (const box of document.querySelectorAll("[id^=show-]")) {
      box.addEventListener("change", () => charts.forEach(drawn));
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(drawn));
    document.documentElement.dataset.figures = charts.length === held.figures.length ? "drawn" : "incomplete";
  }

  installAll();
})();
