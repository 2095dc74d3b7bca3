// Shows the value under the pointer in line charts, and switches lines off by their names in the legend. The values are
// read off the paths of the SVG; `data-hover` of the figure has the names and the scales of its axes.
(() => {
  "use strict";
  const NEAR = 24; // farthest line that is shown [pt]

  // The points of a path of straight lines, one array for each unbroken part.
  function parts(path) {
    const out = [];
    for (const [, letter, x, y] of path.getAttribute("d").matchAll(/([ML])\s*([-\d.]+)[ ,]([-\d.]+)/g)) {
      if (letter === "M") out.push([]);
      out[out.length - 1].push([Number(x), Number(y)]);
    }
    return out;
  }

  // The height of a line at x, between two of its points; undefined in a gap.
  function heightAt(line, x) {
    const part = line.find((points) => points[0][0] <= x && x <= points[points.length - 1][0]);
    if (!part) return undefined;
    let low = 0, high = part.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (part[middle][0] <= x) low = middle; else high = middle;
    }
    const [[x0, y0], [x1, y1]] = [part[low], part[high]];
    return x1 === x0 ? y1 : y0 + (y1 - y0) * (x - x0) / (x1 - x0);
  }

  function valueAt(axis, share) {
    const [low, high] = axis.log ? axis.limits.map(Math.log) : axis.limits, value = low + share * (high - low);
    return axis.log ? Math.exp(value) : value;
  }

  const format = (value) => Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(Math.abs(value) >= 10 ? 1 : 2);

  function setUp(figure) {
    const { names, plots } = JSON.parse(figure.dataset.hover), svg = figure.querySelector("svg");
    const lines = [...svg.querySelectorAll("[data-series]")].map((group) => ({
      group, series: Number(group.dataset.series), plot: Number(group.dataset.plot),
      points: parts(group.querySelector(":scope > path")),
    }));
    const bands = [...svg.querySelectorAll("[data-band]")];
    const keys = [...svg.querySelectorAll("[data-key]")], hidden = new Set();
    const note = document.createElement("div");
    note.className = "hover-note";
    note.hidden = true;
    note.setAttribute("role", "status");
    figure.append(note);
    const dot = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    dot.setAttribute("r", "3.5");
    dot.setAttribute("class", "hover-dot");
    dot.style.display = "none";
    svg.append(dot);

    const highlight = (series) => {
      for (const { group, series: of } of lines) group.classList.toggle("is-on", of === series);
      for (const key of keys) key.classList.toggle("is-on", Number(key.dataset.key) === series);
    };

    const toggle = (series) => {
      if (!hidden.delete(series)) hidden.add(series);
      for (const { group, series: of } of lines) group.style.display = hidden.has(of) ? "none" : "";
      for (const band of bands) band.style.display = hidden.has(Number(band.dataset.band)) ? "none" : "";
      for (const key of keys) {
        const off = hidden.has(Number(key.dataset.key));
        key.classList.toggle("is-off", off);
        if (key.hasAttribute("role")) key.setAttribute("aria-pressed", String(!off));
      }
    };

    // The nearest visible line at a place in the SVG, or nothing.
    function nearest({ x, y }) {
      const plot = plots.findIndex((p) => p && p.box[0] <= x && x <= p.box[2] && p.box[1] <= y && y <= p.box[3]);
      let found;
      for (const line of lines) {
        if (line.plot !== plot || hidden.has(line.series)) continue;
        const height = heightAt(line.points, x), distance = Math.abs(height - y);
        if (distance <= (found ? found.distance : NEAR)) found = { ...line, x, height, distance };
      }
      return found;
    }

    function clear() {
      note.hidden = true;
      dot.style.display = "none";
      highlight(-1);
    }

    function show(event) {
      const found = nearest(new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse()));
      if (!found) return clear();
      const { x: across, y: up, box: [left, top, right, bottom] } = plots[found.plot];
      const x = valueAt(across, (found.x - left) / (right - left)), y = valueAt(up, (bottom - found.height) / (bottom - top));
      const name = document.createElement("b");
      name.textContent = names[found.series];
      note.replaceChildren(name, ` ${format(y)} ${up.unit} at ${format(x)} ${across.unit}`);
      note.hidden = false;
      dot.setAttribute("cx", found.x);
      dot.setAttribute("cy", found.height);
      dot.style.display = "";
      highlight(found.series);
      const frame = figure.getBoundingClientRect(), place = event.clientX - frame.left;
      note.style.left = `${Math.max(0, Math.min(place + 14, frame.width - note.offsetWidth))}px`;
      note.style.top = `${event.clientY - frame.top - note.offsetHeight - 12}px`;
    }

    svg.addEventListener("pointermove", show);
    svg.addEventListener("pointerdown", show);
    svg.addEventListener("pointerleave", clear);
    for (const key of keys) {
      const series = Number(key.dataset.key);
      key.addEventListener("click", () => toggle(series));
      key.addEventListener("pointerenter", () => highlight(series));
      key.addEventListener("pointerleave", () => highlight(-1));
      if (!key.querySelector("text")) continue;
      key.setAttribute("role", "button");
      key.setAttribute("tabindex", "0");
      key.setAttribute("aria-pressed", "true");
      key.setAttribute("aria-label", names[series]);
      key.addEventListener("focus", () => highlight(series));
      key.addEventListener("blur", () => highlight(-1));
      key.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        toggle(series);
      });
    }
    figure.dataset.ready = "yes";
  }

  document.querySelectorAll("[data-hover]").forEach(setUp);
})();
