"use strict";
// Draws the figures of the page with Vega, as wide as the page is, and says what lies below the pointer.
(function () {
  const page = JSON.parse(document.getElementById("figures").textContent);
  const drawn = new Map();
  const tip = document.getElementById("tip");

  // Columns → rows. Values are text or numbers, shown as text alone.
  function rows(columns) {
    const names = Object.keys(columns), n = names.length ? columns[names[0]].length : 0, out = new Array(n);
    for (let i = 0; i < n; i++) { const row = {}; for (const name of names) row[name] = columns[name][i]; out[i] = row; }
    return out;
  }
  for (const name in page.data) page.data[name] = rows(page.data[name]);

  // A path keeps its shape: one metre is as long upwards as sideways, whatever the page's width.
  function keepShape(spec, box, width) {
    const inner = width - 58, wide = Math.max(box[1] - box[0], 1e-3), high = Math.max(box[3] - box[2], 1e-3);
    const height = Math.max(200, Math.min(430, inner * high / wide));
    const scale = 1.08 * Math.max(wide / inner, high / height);
    const cx = (box[0] + box[1]) / 2, cy = (box[2] + box[3]) / 2;
    spec.height = height; spec.width = inner; spec.autosize = {type: "pad"};
    return {x: [cx - scale * inner / 2, cx + scale * inner / 2], y: [cy - scale * height / 2, cy + scale * height / 2]};
  }

  function fill(spec, width) {
    const full = JSON.parse(JSON.stringify(spec)), meta = full.usermeta || {};
    full.datasets = {};
    for (const name of meta.data || []) full.datasets[name] = page.data[name];
    full.width = width;
    if (meta.box) {
      const domain = keepShape(full, meta.box, width);
      for (const layer of full.layer) for (const c of ["x", "y"])
        if (layer.encoding[c]) layer.encoding[c].scale = Object.assign({}, layer.encoding[c].scale, {domain: domain[c], nice: false, zero: false});
    }
    return full;
  }

  function draw(box) {
    const spec = page.specs[box.id], width = Math.floor(box.clientWidth), old = drawn.get(box.id);
    if (!width || (old && old.width === width)) return;
    if (old) old.view.finalize();
    drawn.delete(box.id);
    window.vegaEmbed(box, fill(spec, width), {mode: "vega-lite", renderer: "svg", actions: false, defaultStyle: false, tooltip: tell})
      .then(made => {
        drawn.set(box.id, {view: made.view, width: width, spec: spec});
        if (spec.usermeta && spec.usermeta.time) follow(box, made.view, spec.usermeta);
        const svg = box.querySelector("svg");
        if (svg) { svg.setAttribute("role", "img"); svg.setAttribute("aria-label", box.dataset.label || ""); }
      })
      .catch(problem => { box.textContent = "This figure cannot be drawn: " + problem.message; });
  }
  function tell(_, event, __, value) { if (value == null) hide(); else say(event, value); }

  // The pointer over a plot over time: a line in all of them, the place on the path, the values there.
  function follow(box, view, meta) {
    view.addEventListener("pointermove", event => at(event));
    view.addEventListener("pointerdown", event => at(event));
    view.addEventListener("pointerout", () => { mark(null); hide(); });
    function at(event) {
      const left = box.querySelector("svg").getBoundingClientRect().left, scale = view.scale("x");
      const t = scale.invert(event.clientX - left - view.origin()[0]), range = scale.domain();
      if (!(t >= range[0] && t <= range[1])) return;
      mark(t); say(event, values(meta, t));
    }
  }
  function values(meta, t) {
    const out = {"time": t.toFixed(2) + " s"};
    for (const one of meta.readout || []) {
      const row = one.span ? within(page.data[one.data], t, one) : nearest(page.data[one.data], one.t || "t", t, one);
      if (row && row[one.field] != null) out[one.name] = typeof row[one.field] === "number" ? short(row[one.field]) : row[one.field];
    }
    return out;
  }
  function nearest(list, key, t, one) {
    let best = null, apart = Infinity;
    for (const row of list) {
      if (one.where && row[one.where[0]] !== one.where[1]) continue;
      const d = Math.abs(row[key] - t);
      if (d < apart && row[one.field] != null) { apart = d; best = row; }
    }
    return best;
  }
  function within(list, t, one) {
    return list.find(row => row.t <= t && t < row.t2 && row[one.where[0]] === one.where[1]);
  }
  function short(v) {
    if (v === 0) return "0";
    const a = Math.abs(v);
    return a >= 1e5 || a < 1e-3 ? v.toExponential(2) : String(+v.toPrecision(4));
  }
  function mark(t) {
    for (const one of drawn.values()) {
      const meta = one.spec.usermeta || {};
      if (meta.time) { one.view.signal("hover_s", t == null ? -1e12 : t); one.view.runAsync(); }
      if (meta.place && page.data[meta.place]) {
        const row = t == null ? null : nearest(page.data[meta.place], "t", t, {field: "x"});
        one.view.signal("hover_x", row ? row.x : null).signal("hover_y", row ? row.y : null).runAsync();
      }
    }
  }
  function say(event, value) {
    tip.textContent = "";
    const pairs = typeof value === "object" ? Object.entries(value) : [["", value]];
    for (const [name, text] of pairs) {
      const row = document.createElement("div"), left = document.createElement("span"), right = document.createElement("span");
      row.className = "row"; left.textContent = name; right.textContent = typeof text === "number" ? short(text) : text;
      row.append(left, right); tip.append(row);
    }
    tip.style.display = "block";
    const wide = tip.offsetWidth, high = tip.offsetHeight, x = event.clientX, y = event.clientY;
    tip.style.left = (x + 16 + wide > innerWidth ? Math.max(4, x - wide - 14) : x + 16) + "px";
    tip.style.top = Math.max(4, Math.min(y + 14, innerHeight - high - 6)) + "px";
  }
  function hide() { tip.style.display = "none"; }

  // A table that its heads sort: numbers by value, what is unknown last.
  function sortable(table) {
    const heads = [...table.querySelectorAll("th[data-sort]")], body = table.tBodies[0];
    heads.forEach(head => head.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending", k = head.cellIndex, number = head.dataset.sort !== "text";
      heads.forEach(other => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const value = row => { const v = row.cells[k].dataset.v; return v === undefined || v === "" ? null : number ? +v : v; };
      [...body.rows].sort((a, b) => {
        const p = value(a), q = value(b);
        if (p === null || q === null) return (p === null) - (q === null);
        return (p < q ? -1 : p > q ? 1 : 0) * (up ? 1 : -1);
      }).forEach(row => body.append(row));
    }));
  }
  document.querySelectorAll("table.sortable").forEach(sortable);

  function drawAll() { document.querySelectorAll(".chart").forEach(box => { if (page.specs[box.id]) draw(box); }); }
  drawAll();
  let waiting = 0;
  addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(drawAll, 120); });
  addEventListener("beforeprint", () => { mark(null); hide(); });
})();
