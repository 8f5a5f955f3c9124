// Draws each chart when it comes near the screen. A click selects the candidate of a point; the selected one is framed.
(() => {
  "use strict";
  const CONFIG = { displayModeBar: false, responsive: true };
  const AHEAD = "600px"; // drawn so far before they are seen
  const HALF_PRINTED = 340; // width on paper of a chart that stands beside another [pixel]
  const plots = [...document.querySelectorAll(".plot")];
  let selected = document.getElementById("candidate-choice").value;

  const nameOf = (data) => [data ?? []].flat(2).at(-1);
  const colour = () => getComputedStyle(document.documentElement).getPropertyValue("--ink").trim();

  /** Run plotly.js, of 4.8 MB, no sooner than a chart is wanted: it takes a second. */
  function begin() {
    if (window.Plotly) return;
    const script = document.createElement("script");
    script.textContent = document.getElementById("plotly").textContent;
    document.head.append(script);
  }

  function draw(plot) {
    if (plot.drawn) return;
    plot.drawn = true;
    begin();
    const { data, layout } = JSON.parse(plot.nextElementSibling.textContent);
    const ring = {
      type: "scatter", mode: "markers", x: [], y: [], hoverinfo: "skip", showlegend: false,
      marker: { symbol: "circle-open", size: 19, line: { width: 2.5 } },
    };
    plot.ring = data.some((trace) => trace.type === "scatter" && trace.customdata) ? data.length : null;
    Plotly.newPlot(plot, plot.ring === null ? data : [...data, ring], layout, CONFIG).then(() => {
      plot.on("plotly_click", ({ points }) => {
        const name = nameOf(points[0].customdata);
        if (name) document.dispatchEvent(new CustomEvent("simcore:select", { detail: name }));
      });
      mark(plot);
    });
  }

  /** Frame the selected candidate: a ring around its points, a box around its cells. */
  function mark(plot) {
    if (!plot._fullData) return;
    if (plot.ring !== null) {
      const found = plot._fullData.flatMap((trace) =>
        [...(trace.customdata ?? [])].flatMap((each, i) => (nameOf(each) === selected ? [[trace.x[i], trace.y[i]]] : [])));
      const [x, y] = [0, 1].map((axis) => [found.map((point) => point[axis])]);
      Plotly.restyle(plot, { x, y, "marker.color": colour() }, [plot.ring]);
      return;
    }
    const map = plot._fullData.find((trace) => trace.type === "heatmap" && trace.customdata);
    if (!map) return;
    const cells = [...map.customdata].flatMap((row, j) => [...row].flatMap((each, i) => (nameOf(each) === selected ? [[i, j]] : [])));
    const [across, along] = [0, 1].map((axis) => cells.map((cell) => cell[axis]));
    const box = {
      type: "rect", x0: Math.min(...across) - 0.5, x1: Math.max(...across) + 0.5,
      y0: Math.min(...along) - 0.5, y1: Math.max(...along) + 0.5,
    };
    const lines = [{ color: "#fff", width: 5 }, { color: "#000", width: 2 }]; // seen on any colour of the map
    Plotly.relayout(plot, { shapes: cells.length ? lines.map((line) => ({ ...box, line })) : [] });
  }

  const near = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) draw(entry.target);
  }, { rootMargin: AHEAD });
  plots.forEach((plot) => near.observe(plot));

  document.addEventListener("simcore:select", (event) => {
    selected = event.detail;
    plots.forEach(mark);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach(mark));

  const opened = new Set(); // details that are closed again after printing
  addEventListener("beforeprint", () => {
    document.querySelectorAll("details.mat:not([open])").forEach((each) => {
      each.open = true;
      opened.add(each);
    });
    plots.forEach(draw);
    plots.forEach((plot) => (plot.closest(".many") ? Plotly.relayout(plot, { width: HALF_PRINTED }) : Plotly.Plots.resize(plot)));
  });
  addEventListener("afterprint", () => {
    for (const plot of plots) {
      if (plot.closest(".many")) Plotly.relayout(plot, { width: null, autosize: true });
      else Plotly.Plots.resize(plot);
    }
    opened.forEach((each) => (each.open = false));
    opened.clear();
  });
})();
