"use strict";
// The script of a page of simbrake: charts, film, sliders. It reads the data of its page and loads nothing.
(function () {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const SVG = "http://www.w3.org/2000/svg";
  document.documentElement.classList.add("live");

  // --- numbers and elements ------------------------------------------------------------------------------------------

  /** A number with significant digits, a dash for what did not happen. */
  function shown(x, digits = 5) {
    if (x === null || x === undefined || !Number.isFinite(x)) return "—";
    return String(Number(x.toPrecision(digits))).replace("-", "−");
  }

  /** An element with attributes and children; texts are never read as HTML. */
  function made(parent, name, attributes = {}, ...children) {
    const found = parent instanceof SVGElement ? document.createElementNS(SVG, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
    found.append(...children);
    parent.append(found);
    return found;
  }

  /** Place of the last of rising values that is not above x. */
  function place(values, x) {
    let low = 0, high = values.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (values[middle] <= x) low = middle; else high = middle - 1;
    }
    return low;
  }

  /** Rounded values from 0 to a maximum. */
  function ticks(top, count) {
    const raw = top / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 2.5, 5, 10].find((m) => m * power >= raw * 0.999);
    const found = [];
    for (let i = 0; i * step <= top * 1.0001; i++) found.push(i * step);
    return found;
  }

  // --- charts: values at the cursor, zoom by dragging or with two fingers -----------------------------------------------

  let run = null;  // what is drawn now
  let plots = [], hovered = null, zoom = null;

  function marks(u) {
    const c = u.ctx, ratio = uPlot.pxRatio, few = run.events.length <= 12, first = u === plots[0];
    c.save();
    c.lineWidth = ratio;
    c.font = `${11 * ratio}px system-ui, sans-serif`;
    c.textAlign = "left";
    c.setLineDash([4 * ratio, 4 * ratio]);
    let edge = -1e9, row = 0;
    for (const event of run.events) {
      const x = Math.round(u.valToPos(event.t, "x", true));
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
      c.strokeStyle = c.fillStyle = event.colour;
      c.globalAlpha = few ? 1 : 0.35;
      c.beginPath();
      c.moveTo(x, u.bbox.top);
      c.lineTo(x, u.bbox.top + u.bbox.height);
      c.stroke();
      if (!first || !few) continue;
      const wide = c.measureText(event.words).width, over = x + wide - u.bbox.left - u.bbox.width;
      row = x - edge < 8 * ratio + wide ? (row + 1) % 3 : 0;
      edge = x;
      c.fillText(event.words, x - Math.max(over, 0), u.bbox.top - (4 + 13 * row) * ratio);
    }
    c.restore();
  }

  function zoomed(u, key) {
    const {min, max} = u.scales.x, t = run.t, differs = ({scales: {x}}) => x.min !== min || x.max !== max;
    if (key !== "x" || !(max > min)) return;
    zoom = min <= t[0] && max >= t[t.length - 1] ? null : {min, max};
    for (const other of plots.filter(differs)) other.setScale("x", {min, max});
  }

  function followed(u) {
    if (u === hovered && u.cursor.idx !== null && u.cursor.idx !== undefined) showFilm(run.t[u.cursor.idx], u);
  }

  function fingers(u) {
    const over = u.over, at = (touch) => touch.clientX - over.getBoundingClientRect().left;
    let pinch = null;
    over.style.touchAction = "pan-y";
    over.addEventListener("touchstart", (event) => {
      hovered = u;
      if (event.touches.length === 2) pinch = [...event.touches].map((touch) => u.posToVal(at(touch), "x"));
      else u.setCursor({left: at(event.touches[0]), top: 1});
    }, {passive: true});
    over.addEventListener("touchmove", (event) => {
      if (event.touches.length === 2 && pinch) {
        const [a, b] = [...event.touches].map((touch) => at(touch) / over.clientWidth);
        const span = (pinch[1] - pinch[0]) / (b - a || 1e-9), min = pinch[0] - a * span;
        if (span > 0) u.setScale("x", {min: Math.max(min, run.t[0]), max: Math.min(min + span, run.t[run.t.length - 1])});
        event.preventDefault();
      } else if (event.touches.length === 1) u.setCursor({left: at(event.touches[0]), top: 1});
    });
  }

  function chart(about, index, count) {
    const narrow = $("charts").clientWidth < 500, font = "12px system-ui, sans-serif", grid = {stroke: "#e3e7ec", width: 1};
    const lines = about.lines.map((line) => ({
      label: line.label, stroke: line.colour, width: 1.7, dash: line.dashed ? [7, 4] : undefined,
      value: (u, value) => shown(value), points: {show: false},
      paths: about.stepped ? uPlot.paths.stepped({align: 1}) : undefined,
    }));
    const box = made($("charts"), "div", {class: "chart", "data-chart": about.title});
    made(box, "h3", {}, about.unit === "–" ? about.title : `${about.title}, ${about.unit}`);
    const u = new uPlot({
      width: $("charts").clientWidth, padding: [index === 0 ? 42 : 8, null, null, null],
      height: (narrow ? 130 : 145) + (index === 0 ? 34 : index === count - 1 ? 18 : 0),
      scales: {x: {time: false}},
      cursor: {y: false, sync: {key: "simbrake"}, drag: {x: true, y: false}},
      axes: [
        {font, grid, size: 26, label: index === count - 1 ? "time, s" : undefined, labelFont: font, labelSize: 18},
        {font, grid, size: 52},
      ],
      series: [{label: "t, s", value: (u, value) => shown(value, 6)}, ...lines],
      hooks: {draw: [marks], setScale: [zoomed], setCursor: [followed]},
    }, [run.t, ...run.y[index]], box);
    u.over.addEventListener("pointerenter", () => { hovered = u; stop(); });
    fingers(u);
    return u;
  }

  function drawCharts(found) {
    const same = run !== null && JSON.stringify(run.charts) === JSON.stringify(found.charts);
    run = found;
    if (!same) {
      for (const u of plots) u.destroy();
      $("charts").replaceChildren();
      plots = [];
      run.charts.forEach((about, i) => plots.push(chart(about, i, run.charts.length)));
      drawWindows();
    } else {
      plots.forEach((u, i) => {
        u.setData([run.t, ...run.y[i]], zoom === null);
        if (zoom !== null) u.redraw(true, true);
      });
    }
  }

  function drawWindows() {
    $("windows").replaceChildren();
    (run.windows.length > 1 ? run.windows : []).forEach((window, i) => {
      const button = made($("windows"), "button", {type: "button"}, i === 0 ? "whole run" : window.words);
      button.addEventListener("click", () => plots[0].setScale("x", {min: run.windows[i].start, max: run.windows[i].end}));
    });
    made($("windows"), "span", {class: "soft"}, "Drag over a chart to zoom, double-click for all of it.");
  }

  window.addEventListener("resize", () => {
    for (const u of plots) u.setSize({width: $("charts").clientWidth, height: u.height});
  });

  // --- the film: the brake along its shaft, moment by moment --------------------------------------------------------------

  const BAND = 1.21, TENSION = [1.32, 0.72], LOAD = [0.72, -0.44], HEAT = [1.235, 1.295];
  const INFERNO = [[0, 0, 4], [66, 10, 104], [147, 38, 103], [221, 81, 58], [252, 165, 10], [252, 255, 164]];
  let picture = null, frame = 0, begun = null, beganAt = 0;

  const spot = (radius, angle) => `${(radius * Math.cos(angle)).toFixed(4)} ${(-radius * Math.sin(angle)).toFixed(4)}`;

  function wedge(from, to, inner, outer) {
    const far = to - from > Math.PI ? 1 : 0;
    return `M${spot(inner, from)}L${spot(outer, from)}A${outer} ${outer} 0 ${far} 0 ${spot(outer, to)}` +
      `L${spot(inner, to)}A${inner} ${inner} 0 ${far} 1 ${spot(inner, from)}Z`;
  }

  function arc(radius, from, to) {
    const points = [];
    for (let i = 0; i <= 90; i++) points.push(spot(radius, from + (to - from) * i / 90));
    return "M" + points.join("L");
  }

  function heatColour(T, heat) {
    const x = 5 * Math.min(Math.max((T - heat.low) / (heat.high - heat.low), 0), 1), i = Math.min(Math.floor(x), 4);
    return `rgb(${INFERNO[i].map((c, k) => Math.round(c + (x - i) * (INFERNO[i + 1][k] - c))).join(",")})`;
  }

  function scaleRings(svg, top, count, [base, length], from, to) {
    for (const value of ticks(top, count)) {
      const radius = base + length * value / top;
      made(svg, "path", {d: arc(radius, from, to), class: "ring"});
      const [x, y] = spot(radius, to + 0.06 / radius).split(" ");
      made(svg, "text", {x, y, class: "tick", "text-anchor": "middle"}, shown(value, 3));
    }
  }

  function drawFilm(film) {
    const svg = $("wheel"), {places, tension, pairs} = film, banded = tension !== null;
    svg.replaceChildren();
    svg.setAttribute("viewBox", banded ? "-2.2 -2.15 4.4 3.95" : "-1.2 -1.2 2.4 2.4");
    picture = {film, rings: [], heat: [], loads: []};
    picture.rim = made(svg, "path", {d: wedge(0, 3.1415, 0.94, 1) + wedge(3.1415, 6.283, 0.94, 1), class: "rim"});
    picture.turning = made(svg, "g", {class: "turning"});
    for (let i = 0; i < 3; i++) {
      const [x, y] = spot(0.93, 2 * Math.PI * i / 3).split(" ");
      made(picture.turning, "line", {x1: 0, y1: 0, x2: x, y2: y, class: "spoke"});
    }
    made(picture.turning, "circle", {cx: 0.55, cy: 0, r: 0.06, class: "mark"});
    made(svg, "circle", {r: 0.13, class: "hub"});
    const angles = places.flatMap((p) => [p[0], p[1]]), from = Math.min(...angles), to = Math.max(...angles);
    if (banded) {
      picture.topTension = Math.max(...tension.flat(), 1e-9);
      picture.topLoad = Math.max(...pairs.flatMap((pair) => pair.load.flat()), 1e-9);
      scaleRings(svg, picture.topTension, 4, TENSION, from, to);
      scaleRings(svg, picture.topLoad, 3, LOAD, from, to);
      picture.curve = made(svg, "path", {class: "tension"});
      made(svg, "path", {d: arc(BAND, from, to), class: "band"});
      for (const [angle, sense, words] of [[to, 1, "slack end (lever)"], [from, -1, "tight end (anchor)"]]) {
        const [x, y] = [BAND * Math.cos(angle) - sense * 0.45 * Math.sin(angle), BAND * Math.sin(angle) + sense * 0.45 * Math.cos(angle)];
        const [x0, y0] = spot(BAND, angle).split(" ");
        made(svg, "line", {x1: x0, y1: y0, x2: x, y2: -y, class: "band"});
        made(svg, "text", {x, y: -y + 0.13, class: "name", "text-anchor": "middle"}, words);
      }
    }
    pairs.forEach((pair, k) => picture.rings.push(places.map(([a, b, inner, outer], i) => {
      const step = (outer - inner) / pairs.length, top = outer - k * step;
      const found = made(svg, "path", {d: wedge(a, b, top - step, top), class: "lining", "data-lining": i, "data-pair": k});
      found.addEventListener("pointerenter", () => { picture.looked = [k, i]; tell(); });
      return found;
    })));
    if (banded) picture.loads = places.map(() => made(svg, "path", {class: "load"}));
    if (film.heat && film.heat.linings && banded) {
      picture.heat = places.map(([a, b]) => made(svg, "path", {d: wedge(a, b, ...HEAT), class: "heat"}));
    }
    picture.numbers = places.map(([a, b, inner, outer], i) => {
      if (places.length > 30 && i % 5) return null;
      const [x, y] = spot((inner + outer) / 2, (a + b) / 2).split(" ");
      return made(svg, "text", {x, y, class: "count", "text-anchor": "middle", "dominant-baseline": "central"}, String(i + 1));
    });
    $("at").max = film.t.length - 1;
    drawLegend(film);
  }

  function drawLegend(film) {
    const there = new Set(film.pairs.flatMap((pair) => pair.contacts).join(""));
    $("legend").replaceChildren();
    const item = (colour, words) => {
      const box = made($("legend"), "span", {class: "item"});
      made(box, "i").style.background = colour;
      box.append(words);
    };
    for (const [state, look] of Object.entries(data.still.states)) if (there.has(state)) item(look.colour, `${data.still.lining} ${look.words}`);
    if (film.tension) {
      item("var(--blue-line)", "outwards: tension T of the band, kN");
      item("var(--green-line)", "inwards: normal load N of a lining, kN");
    }
    if (film.pairs.length > 1) item("none", "outer half of a lining: band on lining; inner half: lining on rim");
    if (film.heat) item("linear-gradient(90deg,#000004,#932667,#fca50a)", `surface ${shown(film.heat.low, 3)}…${shown(film.heat.high, 3)} °C`);
  }

  function drawFrame(i) {
    const {film} = picture, turns = film.phi[i] / (2 * Math.PI);
    frame = i;
    picture.turning.setAttribute("transform", `rotate(${(-360 * (turns % 1)).toFixed(3)})`);
    const fast = i > 0 && Math.abs(film.phi[i] - film.phi[i - 1]) > 2;
    picture.turning.style.opacity = fast ? 0.25 : 1;
    picture.rings.forEach((ring, k) => ring.forEach((path, j) => {
      path.style.fill = data.still.states[film.pairs[k].contacts[i][j]].colour;
    }));
    if (film.tension) {
      const T = film.tension[i], radius = T.map((x) => TENSION[0] + TENSION[1] * Math.max(x, 0) / picture.topTension);
      const points = film.places.flatMap(([a, b], j) => [spot(radius[j], b), spot(radius[j + 1], a)]);
      const back = film.places.flatMap(([a, b]) => [spot(TENSION[0], b), spot(TENSION[0], a)]).reverse();
      picture.curve.setAttribute("d", "M" + [...points, ...back].join("L") + "Z");
      picture.loads.forEach((path, j) => {
        const [a, b] = film.places[j], middle = (a + b) / 2, half = 0.36 * (b - a);
        const depth = LOAD[0] + LOAD[1] * Math.max(film.pairs[0].load[i][j], 0) / picture.topLoad;
        path.setAttribute("d", wedge(middle - half, middle + half, depth, LOAD[0]));
      });
    }
    if (film.heat && film.heat.rim) picture.rim.style.fill = heatColour(film.heat.rim[i], film.heat);
    picture.heat.forEach((path, j) => {
      const T = film.heat.linings[i];
      path.style.fill = heatColour(T.length > 1 ? T[j] : T[0], film.heat);
    });
    $("at").value = i;
    tell();
  }

  function tell() {
    const {film} = picture, i = frame, T = film.tension && film.tension[i];
    const at = film.seconds * i / (film.t.length - 1), rate = film.rates.find((r) => at <= r.until * 1.0001) || film.rates[0];
    const now = [`t = ${shown(film.t[i], 6)} s`, `ω = ${shown(film.omega[i])} rad/s`, `${shown(film.phi[i] / (2 * Math.PI), 4)} turns`];
    if (film.hook) now.push(`hook ${shown(film.hook[i], 4)} m`);
    if (T) now.push(`T₀ = ${shown(T[0])} kN`, `Tₙ = ${shown(T[T.length - 1])} kN`);
    now.push(`brake torque ${shown(film.torque[i])} kN·m`, rate.words);
    $("now").textContent = now.join(" · ");
    if (!picture.looked) return;
    const [k, j] = picture.looked, pair = film.pairs[k], words = data.still.states[pair.contacts[i][j]].words;
    const said = [`${data.still.lining} ${j + 1} ${words}`, `N = ${shown(pair.load[i][j])} kN`];
    if (film.pairs.length > 1) said.unshift(pair.words);
    if (T) said.push(`T behind it ${shown(T[j + 1])} kN`);
    if (film.heat && film.heat.linings) said.push(`${shown(film.heat.linings[i][film.heat.linings[i].length > 1 ? j : 0], 4)} °C`);
    $("looked").textContent = said.join(" · ");
  }

  /** The moment of the film at a time of the run; `from`: the chart whose cursor is there already. */
  function showFilm(t, from) {
    if (picture === null) return;
    const i = place(picture.film.t, t), next = Math.min(i + 1, picture.film.t.length - 1);
    drawFrame(t - picture.film.t[i] > picture.film.t[next] - t ? next : i);
    if (!from) cursors();
  }

  /** Cursors of the charts at the moment of the film, once the charts are laid out. */
  function cursors() {
    hovered = null;
    requestAnimationFrame(() => {
      for (const u of plots) u.setCursor({left: u.valToPos(picture.film.t[frame], "x"), top: 1}, false, false);
    });
  }

  function jump(i) {
    drawFrame(Math.min(Math.max(i, 0), picture.film.t.length - 1));
    cursors();
  }

  function stop() {
    begun = null;
    if ($("play")) $("play").textContent = "▶ play";
  }

  function tick(now) {
    if (begun === null) return;
    const last = picture.film.t.length - 1, i = beganAt + Math.floor((now - begun) / 1000 / picture.film.seconds * last);
    if (i !== frame) jump(i);
    if (i >= last) stop(); else requestAnimationFrame(tick);
  }

  function play() {
    if (begun !== null) return stop();
    beganAt = frame >= picture.film.t.length - 1 ? 0 : frame;
    begun = performance.now();
    $("play").textContent = "❚❚ pause";
    requestAnimationFrame(tick);
  }

  function drawRun(found, first) {
    const t = picture && picture.film.t[frame];
    drawCharts(found);
    if (!found.film) return;
    drawFilm(found.film);
    if (first) jump(found.film.torque.indexOf(Math.max(...found.film.torque)));
    else showFilm(t);
  }

  // --- results beside the pictures ----------------------------------------------------------------------------------------

  function drawResults(found) {
    const banner = $("banner");
    banner.className = `verdict ${found.colour}`;
    banner.querySelector("b").textContent = found.headline;
    banner.querySelector("p").textContent = found.text;
    $("rows").replaceChildren();
    $("rows").parentElement.hidden = !found.rows.length;
    for (const [name, value, limit, margin, state, kind] of found.rows) {
      const row = made($("rows"), "tr");
      made(row, "td", {}, name);
      for (const number of [value, limit, margin]) made(row, "td", {class: "n"}, number);
      made(made(row, "td"), "span", {class: `badge ${kind}`}, state);
    }
    $("figures").replaceChildren();
    for (const {words, text, si, unit, note} of found.metrics) {
      const box = made($("figures"), "div");
      made(box, "dt", {}, words);
      const value = made(box, "dd");
      made(value, "data", {value: si, title: `${si} ${unit}`}, text);
      made(value, "small", {}, note);
    }
  }

  // --- sliders ------------------------------------------------------------------------------------------------------------

  const reading = (control, si) => si * control.factor + control.offset;

  /** A row with a slider and a field; `moved(si)` is called with each new value. */
  function slider(parent, control, steps, moved) {
    const row = made(parent, "div", {class: "control", "data-path": control.path});
    const id = `c-${control.path}`, name = made(row, "label", {for: id}, control.meaning);
    made(name, "code", {}, control.path);
    const bar = made(row, "input", {type: "range", id, min: 0, max: steps, step: "any"});
    const field = made(row, "input", {type: "text", inputmode: "decimal", "aria-label": `${control.meaning}: value`});
    made(row, "span", {class: "unit"}, control.unit);
    const put = (si) => {
      bar.value = steps * (si - control.low) / (control.high - control.low);
      field.value = shown(reading(control, si), 6);
      row.classList.toggle("changed", si !== control.value);
    };
    bar.addEventListener("input", () => {
      const si = control.low + (control.high - control.low) * bar.value / steps;
      field.value = shown(reading(control, si), 6);
      row.classList.toggle("changed", si !== control.value);
      moved(si);
    });
    field.addEventListener("change", () => {
      const x = Number(field.value.replace("−", "-").replace(",", "."));
      if (!Number.isFinite(x) || field.value.trim() === "") return put(control.value);
      const si = (x - control.offset) / control.factor;
      put(si);
      moved(si);
    });
    put(control.value);
    return {row, bar, put};
  }

  // --- a published grid: cubic Hermite between solved points ------------------------------------------------------------------

  function publication(grid) {
    const {axes, points} = grid, bytes = Uint8Array.from(atob(grid.numbers), (c) => c.charCodeAt(0));
    const numbers = new Float32Array(bytes.buffer), at = axes.map((axis) => axis.value);
    const sizes = axes.map((axis) => axis.values.length), flat = (index) => index.reduce((sum, i, k) => sum * sizes[k] + i, 0);

    /** Values and derivatives at a solved point: `rows[0]` values, `rows[1 + k]` by axis k. */
    const rowsOf = (point) => {
      const size = grid.sequences[point.sequence].size;
      return axes.map((_, k) => k + 1).reduce((rows, k) => [...rows, numbers.subarray(point.start + k * size, point.start + (k + 1) * size)],
        [numbers.subarray(point.start, point.start + size)]);
    };

    /** Cell and share of the way through it, along each axis. */
    const cell = (x) => axes.map((axis, k) => {
      const last = axis.values.length - 2, i = Math.min(place(axis.values, x[k]), last);
      const share = (x[k] - axis.values[i]) / (axis.values[i + 1] - axis.values[i]);
      return {i, share: share < 1e-9 ? 0 : share > 1 - 1e-9 ? 1 : share, width: axis.values[i + 1] - axis.values[i]};
    });

    /** Values at x, or `null` where the sequence of events changes between the points around it. */
    function solve(x) {
      const where = cell(x), inside = where.every((w) => w.share > 0 && w.share < 1);
      let corners = [[]];
      for (const {i, share} of where) {
        const ends = share === 0 ? [i] : share === 1 ? [i + 1] : [i, i + 1];
        corners = corners.flatMap((corner) => ends.map((end) => [...corner, end]));
      }
      const found = corners.map((corner) => points[flat(corner)]), sequence = found[0].sequence;
      if (sequence < 0 || found.some((point) => point.sequence !== sequence)) return null;
      if (inside && grid.gaps.includes(cellNumber(where))) return null;
      let rows = found.map(rowsOf);
      where.forEach(({share: s, width}, k) => {
        if (s === 0 || s === 1) return;
        const half = rows.length / 2, merged = [];
        for (let j = 0; j < half; j++) merged.push(between(rows[j], rows[j + half], s, width, k + 1));
        rows = merged;
      });
      return {values: rows[0][0], sequence: grid.sequences[sequence]};
    }

    const cellNumber = (where) => where.reduce((sum, w, k) => sum * (sizes[k] - 1) + w.i, 0);

    /** Values by cubic Hermite along the axis of the derivative `k`, the other derivatives linearly. */
    function between(a, b, s, width, k) {
      const h = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * width, s * s * (3 - 2 * s), s * s * (s - 1) * width];
      return a.map((_, r) => Float64Array.from(a[r], (x, n) =>
        r === 0 ? h[0] * x + h[1] * a[k][n] + h[2] * b[0][n] + h[3] * b[k][n] : (1 - s) * x + s * b[r][n]));
    }

    function results(values, sequence) {
      const read = (metric, si, offset) => Number.isFinite(si) ? `${shown(si * metric.factor + offset)} ${metric.unit}` : "—";
      const metrics = grid.metrics.map((metric, n) => ({
        words: metric.words, text: read(metric, values[n], metric.offset), si: Number.isFinite(values[n]) ? values[n] : "",
        unit: metric.si_unit, note: "",
      })).filter((metric) => metric.si !== "");
      const rows = grid.metrics.map((metric, n) => [metric, values[n]]).filter(([metric]) => metric.limit !== null).map(([metric, si]) => {
        const over = !(si <= metric.limit), margin = read(metric, metric.limit - si, 0);
        return [metric.words, read(metric, si, metric.offset), read(metric, metric.limit, metric.offset), margin,
          over ? "exceeded" : "within limit", over ? "bad" : "good"];
      });
      const over = rows.some((row) => row[5] === "bad"), headline = sequence.status + (over ? ", limit exceeded" : "");
      return {colour: over ? "red" : sequence.colour, headline, text: `${sequence.message}.`, rows, metrics};
    }

    function runOf(values, sequence) {
      const {pieces, events} = sequence, m = grid.samples, edges = Array.from(values.slice(grid.metrics.length, grid.metrics.length + pieces + 1));
      const t = [], kept = [];
      for (let i = 0; i < pieces; i++) for (let j = 0; j < m; j++) {
        const time = edges[i] + (edges[i + 1] - edges[i]) * (j / (m - 1));
        if (t.length && time < t[t.length - 1]) continue;
        t.push(time);
        kept.push(i * m + j);
      }
      let start = grid.metrics.length + pieces + 1;
      const y = grid.charts.map((about) => about.lines.map(() => {
        const line = kept.map((n) => values[start + n]);
        start += pieces * m;
        return line;
      }));
      return {charts: grid.charts, t, y, windows: [], events: events.map((event) => ({...event, t: edges[event.edge]}))};
    }

    function show() {
      const found = solve(at), gap = found === null;
      document.body.classList.toggle("gap", gap);
      $("state").textContent = gap
        ? "Gap: between the solved points around here the sequence of events changes. Move a slider to a shaded stretch."
        : "";
      if (gap) $("banner").className = "verdict", $("banner").querySelector("b").textContent = "No value here";
      else {
        drawResults(results(found.values, found.sequence));
        drawCharts(runOf(found.values, found.sequence));
      }
      rows.forEach(({bar}, k) => paint(bar, k));
    }

    /** Shade the stretches of a slider that have values, the others as they are. */
    function paint(bar, k) {
      const {values, low, high} = axes[k], stops = [];
      for (let i = 0; i + 1 < values.length; i++) {
        const x = at.slice();
        x[k] = 0.5 * (values[i] + values[i + 1]);
        const colour = solve(x) ? "var(--blue-pale)" : "var(--gap)";
        for (const end of [values[i], values[i + 1]]) stops.push(`${colour} ${(100 * (end - low) / (high - low)).toFixed(2)}%`);
      }
      bar.style.setProperty("--stretches", `linear-gradient(90deg, ${stops.join(", ")})`);
    }

    const rows = axes.map((axis, k) => slider($("sliders"), axis, 1000, (si) => {
      // near a solved point the slider stays on it
      const near = axis.values.find((value) => Math.abs(value - si) < 0.004 * (axis.high - axis.low));
      at[k] = near ?? Math.min(Math.max(si, axis.low), axis.high);
      show();
    }));
    show();
  }

  // --- the app: each move is a run; the latest wins ------------------------------------------------------------------------------

  function application(app) {
    const values = {};
    let waiting = null, wanted = false, sent = 0;

    async function ask() {
      if (waiting !== null) {
        wanted = true;
        if (performance.now() - sent > 150) waiting.abort();
        return;
      }
      waiting = new AbortController();
      wanted = false;
      sent = performance.now();
      try {
        const answer = await fetch("run", {
          method: "POST", signal: waiting.signal, headers: {"Content-Type": "application/json"}, body: JSON.stringify({values}),
        });
        await read(answer.body.getReader());
      } catch (error) {
        if (error.name !== "AbortError") $("state").textContent = `The server does not answer: ${error.message}`;
      }
      waiting = null;
      if (wanted) ask();
    }

    /** Lines of JSON: progress as often as there is any, then the results or what is wrong. */
    async function read(reader) {
      const decoder = new TextDecoder();
      let text = "";
      for (;;) {
        const {done, value} = await reader.read();
        text += decoder.decode(value, {stream: !done});
        const lines = text.split("\n");
        text = lines.pop();
        lines.filter(Boolean).forEach((line) => take(JSON.parse(line)));
        if (done) return;
      }
    }

    function take(found) {
      $("state").className = found.problem ? "state wrong" : "state";
      if (found.progress !== undefined) $("state").textContent = `running: ${Math.round(100 * found.progress)} % simulated`;
      if (found.problem) $("state").textContent = found.problem;
      if (!found.results) return;
      drawResults(found.results);
      if (found.run) drawRun(found.run, run === null);
      requestAnimationFrame(() => { $("state").textContent = `drawn after ${Math.round(performance.now() - sent)} ms`; });
    }

    const groups = new Map();
    for (const control of app.controls) {
      if (!groups.has(control.group)) {
        const box = made($("sliders"), "details", groups.size < 2 ? {open: ""} : {});
        made(box, "summary", {}, control.group);
        groups.set(control.group, box);
      }
      const found = slider(groups.get(control.group), control, 1000, (si) => {
        if (si === control.value) delete values[control.path]; else values[control.path] = si;
        ask();
      });
      $("reset").addEventListener("click", () => found.put(control.value));
    }
    $("reset").addEventListener("click", () => {
      for (const path of Object.keys(values)) delete values[path];
      ask();
    });
    $("find").addEventListener("input", () => {
      const words = $("find").value.trim().toLowerCase();
      for (const [name, box] of groups) {
        let any = false;
        for (const row of box.querySelectorAll(".control")) {
          row.hidden = !`${name} ${row.textContent}`.toLowerCase().includes(words);
          any ||= !row.hidden;
        }
        box.hidden = !any;
        if (words) box.open = any;
      }
    });
    $("save").addEventListener("click", async () => {
      const answer = await fetch("scene", {method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify({values})});
      const found = await answer.json();
      if (found.problem) return take(found);
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([found.text], {type: "application/toml"}));
      link.download = found.name;
      link.click();
      $("state").textContent = `saved as ${found.name}`;
    });
  }

  // --- begin ----------------------------------------------------------------------------------------------------------------

  if ($("play")) {
    $("play").addEventListener("click", play);
    $("back").addEventListener("click", () => { stop(); jump(frame - 1); });
    $("forth").addEventListener("click", () => { stop(); jump(frame + 1); });
    $("at").addEventListener("input", () => { stop(); jump(Number($("at").value)); });
  }
  if (data.run) drawRun(data.run, true);
  if (data.grid) publication(data.grid);
  if (data.app) application(data.app);
})();
