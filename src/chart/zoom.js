"use strict";
// Zoom and values under the cursor for every chart of the page: mouse, touch and keyboard. Drawn positions are scaled as
// they are; an axis may be logarithmic, so positions, not values, are proportional.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  // Nothing is zoomed farther than to this part of the whole.
  const SMALLEST = 1e-3;

  function make(parent, name, attributes) {
    const node = document.createElementNS(SVG, name);
    for (const key in attributes) node.setAttribute(key, attributes[key]);
    parent.append(node);
    return node;
  }

  // About `count` marks between two positions of an axis: values with their positions.
  function marks(low, high, log, count) {
    const decades = [];
    for (let k = Math.ceil(low); k <= high; k++) decades.push([10 ** k, k]);
    if (log && decades.length >= 3) {
      const every = Math.ceil(decades.length / count);
      return decades.filter(([, k]) => k % every === 0);
    }
    const [from, to] = log ? [10 ** low, 10 ** high] : [low, high];
    const rough = (to - from) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough) || 10 * power;
    const found = [];
    for (let i = Math.ceil(from / step); i * step <= to; i++) {
      found.push([i * step, log ? Math.log10(i * step) : i * step]);
    }
    return found;
  }

  const text = (value, digits) => String(Number(value.toPrecision(digits)));

  function chart(svg) {
    const figure = svg.closest("figure");
    const [left, right, top, bottom, x0, x1, xLog, y0, y1, yLog] =
      svg.dataset.axes.split(" ").map(Number);
    const width = right - left, height = bottom - top;
    // The part of the frame that is shown, in positions of the whole.
    let view = [left, right, top, bottom];
    let cursor = null;

    const frame = svg.querySelector(".frame");
    const inside = make(svg, "svg", { x: left, y: top, width, height, viewBox: `${left} ${top} ${width} ${height}` });
    inside.style.overflow = "hidden";
    inside.setAttribute("preserveAspectRatio", "none");
    const data = make(inside, "g", {});
    const drawn = ".line,.band,.rail,.dot,.filled,.smeared,.inside";
    svg.querySelectorAll(drawn).forEach((node) => {
      node.setAttribute("vector-effect", "non-scaling-stroke");
      data.append(node);
    });
    const ticks = make(svg, "g", {});
    svg.insertBefore(ticks, frame);
    const isMark = (node) => node.classList.contains("grid") || node.getAttribute("text-anchor") === "end"
      || node.getAttribute("text-anchor") === "middle" && Number(node.getAttribute("y")) < bottom + 20;
    svg.querySelectorAll(".grid, text").forEach((node) => isMark(node) && ticks.append(node));
    const whole = [...ticks.childNodes];
    const line = make(svg, "line", { class: "cursor", y1: top, y2: bottom, visibility: "hidden" });
    const choice = make(svg, "rect", { class: "choice", y: top, height, visibility: "hidden" });

    const names = [...figure.querySelectorAll(".key span")].map((span) => span.textContent.trim());
    const swatches = [...figure.querySelectorAll(".key .swatch")];
    const series = swatches.map((swatch, k) => {
      const colour = [...swatch.firstElementChild.classList].find((c) => /^s\d$/.test(c));
      const points = [];
      if (colour) data.querySelectorAll(`.line.${colour}`).forEach((path) => {
        for (const pair of path.getAttribute("d").split(/[ML]/)) {
          if (pair) points.push(pair.split(" ").map(Number));
        }
      });
      if (colour) data.querySelectorAll(`.dot.${colour}`).forEach((dot) =>
        points.push([Number(dot.getAttribute("cx")), Number(dot.getAttribute("cy"))]));
      return { name: names[k], points };
    }).filter((one) => one.points.length > 0);
    const dots = [...data.querySelectorAll(".dot")].map((dot) => [dot, dot.getAttribute("cx"), dot.getAttribute("cy")]);

    const valueX = (x) => { const p = x0 + (x - left) / width * (x1 - x0); return xLog ? 10 ** p : p; };
    const valueY = (y) => { const p = y0 + (bottom - y) / height * (y1 - y0); return yLog ? 10 ** p : p; };
    const labels = [...svg.children].filter((node) => node.tagName === "text").map((node) => node.textContent.trim());
    const yLabel = labels[0] || "", xLabel = labels[1] || "";
    const toView = (x) => left + (x - view[0]) / (view[1] - view[0]) * width;
    const fromView = (x) => view[0] + (x - left) / width * (view[1] - view[0]);

    function draw() {
      const [a, b, c, d] = view;
      const sx = width / (b - a), sy = height / (d - c);
      const isWhole = sx === 1 && sy === 1;
      data.setAttribute("transform", `matrix(${sx} 0 0 ${sy} ${left - a * sx} ${top - c * sy})`);
      // A dot stays round.
      for (const [dot, cx, cy] of dots) {
        dot.setAttribute("transform", `translate(${cx} ${cy}) scale(${1 / sx} ${1 / sy}) translate(${-cx} ${-cy})`);
      }
      ticks.replaceChildren(...(isWhole ? whole : []));
      if (!isWhole) drawMarks();
      drawCursor();
    }

    function drawMarks() {
      const [a, b, c, d] = view;
      const position = (from, to, part) => from + part * (to - from);
      const xs = [a, b].map((x) => position(x0, x1, (x - left) / width));
      const ys = [d, c].map((y) => position(y0, y1, (bottom - y) / height));
      for (const [value, at] of marks(xs[0], xs[1], xLog, 6)) {
        const x = left + (at - xs[0]) / (xs[1] - xs[0]) * width;
        make(ticks, "line", { class: "grid", x1: x, x2: x, y1: top, y2: bottom });
        make(ticks, "text", { x, y: bottom + 16, "text-anchor": "middle" }).textContent = text(value, 9);
      }
      for (const [value, at] of marks(ys[0], ys[1], yLog, 6)) {
        const y = bottom - (at - ys[0]) / (ys[1] - ys[0]) * height;
        make(ticks, "line", { class: "grid", x1: left, x2: right, y1: y, y2: y });
        make(ticks, "text", { x: left - 7, y: y + 4, "text-anchor": "end" }).textContent = text(value, 9);
      }
    }

    // The values of a series at a position; several points at one place are a range.
    function valueAt(points, x) {
      let nearest = points[0];
      for (const point of points) if (Math.abs(point[0] - x) < Math.abs(nearest[0] - x)) nearest = point;
      const close = 0.75 * (view[1] - view[0]) / width;
      const ys = points.filter((p) => Math.abs(p[0] - nearest[0]) <= close).map((p) => p[1]);
      const [low, high] = [Math.max(...ys), Math.min(...ys)].map((y) => text(valueY(y), 4));
      return { x: nearest[0], said: low === high ? low : `${low} to ${high}` };
    }

    function drawCursor() {
      if (cursor === null || series.length === 0) {
        line.setAttribute("visibility", "hidden");
        return;
      }
      cursor = Math.min(Math.max(cursor, view[0]), view[1]);
      const found = series.map((one) => ({ name: one.name, ...valueAt(one.points, cursor) }));
      const at = toView(cursor);
      for (const key of ["x1", "x2"]) line.setAttribute(key, at);
      line.setAttribute("visibility", "visible");
      const said = found.map((one) => `${one.name} ${one.said}`.trim()).join("; ");
      const [, name, unit] = /^(.*?)(?:, ([^,]*))?$/.exec(xLabel);
      const step = Math.abs(valueX(view[1]) - valueX(view[0])) / width;
      const value = valueX(cursor);
      const digits = Math.min(15, Math.max(4, Math.ceil(Math.log10(Math.abs(value) / step || 1)) + 1));
      output.textContent = `${name} ${text(value, digits)} ${unit || ""}: ${said} (${yLabel})`;
    }

    // Shows the positions from a to b, with y as far as the points there need.
    function show(a, b) {
      const least = SMALLEST * width;
      if (b - a < least) [a, b] = [(a + b - least) / 2, (a + b + least) / 2];
      const shift = Math.max(left - a, 0) + Math.min(right - b, 0);
      if (b - a >= width) view = [left, right, top, bottom];
      else {
        [a, b] = [Math.max(a + shift, left), Math.min(b + shift, right)];
        const ys = series.flatMap((one) => one.points.filter((p) => p[0] >= a && p[0] <= b).map((p) => p[1]));
        const low = ys.reduce((m, y) => Math.min(m, y), bottom), high = ys.reduce((m, y) => Math.max(m, y), top);
        const room = Math.max(0.05 * (high - low), 1e-3 * height);
        view = ys.length ? [a, b, Math.max(low - room, top), Math.min(high + room, bottom)] : [a, b, top, bottom];
      }
      draw();
    }

    function zoom(factor, x) {
      const at = x ?? cursor ?? (view[0] + view[1]) / 2;
      show(at - (at - view[0]) / factor, at + (view[1] - at) / factor);
    }

    const tools = document.createElement("div");
    tools.className = "tools";
    const button = (label, name, act) => {
      const node = document.createElement("button");
      node.type = "button";
      node.textContent = label;
      node.setAttribute("aria-label", name);
      node.addEventListener("click", act);
      tools.append(node);
    };
    button("+", "zoom in", () => zoom(2));
    button("\u2212", "zoom out", () => zoom(0.5));
    button("all", "show all", () => show(left, right));
    const output = document.createElement("output");
    tools.append(output);
    figure.append(tools);

    const place = (event) => {
      const box = svg.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * svg.viewBox.baseVal.width;
      return fromView(Math.min(Math.max(x, left), right));
    };
    const pointers = new Map();
    let start = null;
    svg.tabIndex = 0;
    svg.style.touchAction = "pan-y";
    svg.addEventListener("pointerdown", (event) => {
      pointers.set(event.pointerId, place(event));
      start = event.pointerType === "mouse" && event.button === 0 ? place(event) : null;
      cursor = place(event);
      drawCursor();
    });
    svg.addEventListener("pointermove", (event) => {
      const here = place(event);
      if (pointers.size === 2 && pointers.has(event.pointerId)) {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
        const before = Math.abs(pointers.get(event.pointerId) - other), now = Math.abs(here - other);
        if (before > 0 && now > 0) zoom(now / before, other);
        pointers.set(event.pointerId, place(event));
        return;
      }
      cursor = here;
      drawCursor();
      if (start !== null) {
        const [from, to] = [start, here].map(toView).sort((a, b) => a - b);
        choice.setAttribute("x", from);
        choice.setAttribute("width", to - from);
        choice.setAttribute("visibility", "visible");
      }
    });
    const end = (event) => {
      choice.setAttribute("visibility", "hidden");
      pointers.delete(event.pointerId);
      if (event.type === "pointerup" && start !== null) {
        const [from, to] = [start, place(event)].sort((a, b) => a - b);
        if (toView(to) - toView(from) > 8) show(from, to);
      }
      start = null;
    };
    for (const type of ["pointerup", "pointercancel", "pointerleave"]) svg.addEventListener(type, end);
    svg.addEventListener("dblclick", () => show(left, right));
    svg.addEventListener("wheel", (event) => {
      // Alone it scrolls the page.
      if (!event.ctrlKey) return;
      event.preventDefault();
      zoom(Math.exp(-0.01 * event.deltaY), place(event));
    }, { passive: false });
    svg.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const step = (view[1] - view[0]) * (event.shiftKey ? 0.1 : 0.01);
      const at = cursor ?? (view[0] + view[1]) / 2;
      const move = (to) => {
        cursor = Math.min(Math.max(to, left), right);
        // What leaves the view on one side is followed.
        const beyond = Math.min(cursor - view[0], 0) + Math.max(cursor - view[1], 0);
        if (beyond === 0) drawCursor(); else show(view[0] + beyond, view[1] + beyond);
      };
      const keys = {
        ArrowLeft: () => move(at - step), ArrowRight: () => move(at + step),
        Home: () => move(view[0]), End: () => move(view[1]),
        "+": () => zoom(2), "=": () => zoom(2), "-": () => zoom(0.5),
        0: () => show(left, right), Escape: () => show(left, right),
      };
      if (keys[event.key]) {
        event.preventDefault();
        keys[event.key]();
      }
    });
  }

  document.querySelectorAll("svg[data-axes]").forEach(chart);
})();
