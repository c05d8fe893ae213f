"use strict";
// The script of a page of simbrake: charts and film of a run. It reads the data of its page and loads nothing.
// Pages with sliders have sliders.js as well, for which it leaves `simbrake`.
(function () {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const SVG = "http://www.w3.org/2000/svg";
  document.documentElement.classList.add("live");

  // --- numbers and elements ----------------------------------------------------------------------------------------

  /** A number with significant digits, a dash for what did not happen. */
  function shown(x, digits = 3) {
    if (x === null || x === undefined || !Number.isFinite(x)) return "—";
    return String(Number(x.toPrecision(digits))).replace("-", "−");
  }

  /** A colour of the page, by its name there. */
  const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  /** A colour of a curve: black ones are those of the text, also in the dark. */
  const readable = (colour) => colour === "#1c2430" ? themed("--ink") : colour;

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

  /** Value at x of the line through rising points, outside of them that of its ends. */
  function along(xs, ys, x) {
    const i = Math.min(place(xs, x), xs.length - 2), share = (x - xs[i]) / (xs[i + 1] - xs[i]);
    return ys[i] + (ys[i + 1] - ys[i]) * Math.min(Math.max(share, 0), 1);
  }

  // --- charts: values at the cursor, zoom by dragging or with two fingers ------------------------------------------

  let run = null;  // what is drawn now
  let plots = [], hovered = null;
  let zoom = null, view = 0;  // what the user has zoomed to; else the window of the run that is shown

  function marks(u) {
    const c = u.ctx, ratio = uPlot.pxRatio, few = run.events.length <= 12, first = u === plots[0];
    c.save();
    Object.assign(c, {lineWidth: ratio, font: `${11 * ratio}px system-ui, sans-serif`, textAlign: "left"});
    c.setLineDash([4 * ratio, 4 * ratio]);
    const ends = [-1e9, -1e9, -1e9, -1e9, -1e9];  // of the labels in each row above the first chart
    for (const event of run.events) {
      const x = Math.round(u.valToPos(event.t, "x", true));
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
      c.strokeStyle = c.fillStyle = readable(event.colour);
      c.globalAlpha = few ? 1 : 0.2;
      c.beginPath();
      c.moveTo(x, u.bbox.top);
      c.lineTo(x, u.bbox.top + u.bbox.height);
      c.stroke();
      if (!first || !few) continue;
      const wide = c.measureText(event.words).width, over = x + wide - u.bbox.left - u.bbox.width;
      const left = x - Math.max(over, 0), row = Math.max(ends.findIndex((end) => end < left), 0);
      ends[row] = left + wide + 6 * ratio;
      c.fillText(event.words, left, u.bbox.top - (4 + 13 * row) * ratio);
    }
    c.restore();
  }

  /** Texts of ticks with as many decimals as the step between them has. */
  function ticks(splits, step) {
    let decimals = 0;
    while (decimals < 9 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6) decimals += 1;
    const digits = {minimumFractionDigits: decimals, maximumFractionDigits: decimals};
    return splits.map((x) => x.toLocaleString("en", digits).replace("-", "−"));
  }

  function zoomed(u, key) {
    const {min, max} = u.scales.x, t = run.t, differs = ({scales: {x}}) => x.min !== min || x.max !== max;
    if (key !== "x" || !(max > min)) return;
    view = run.windows.findIndex(({start, end}) => start === min && end === max);
    zoom = view >= 0 || min <= t[0] && max >= t[t.length - 1] ? null : {min, max};
    for (const other of plots.filter(differs)) other.setScale("x", {min, max});
  }

  function followed(u) {
    if (u === hovered && picture !== null && u.cursor.idx !== null && u.cursor.idx !== undefined) drawFrame(u.cursor.idx);
  }

  function fingers(u) {
    const over = u.over, at = (touch) => touch.clientX - over.getBoundingClientRect().left;
    let held = [];
    const follow = (event) => {
      hovered = u;
      const touches = [...event.touches];
      if (touches.length === 1) return u.setCursor({left: at(touches[0]), top: 1});
      if (event.type === "touchstart") held = touches.map((touch) => u.posToVal(at(touch), "x"));
      const [a, b] = touches.map((touch) => at(touch) / over.clientWidth), span = (held[1] - held[0]) / (b - a);
      const min = Math.max(held[0] - a * span, run.t[0]), max = Math.min(min + span, run.t[run.t.length - 1]);
      if (max > min) u.setScale("x", {min, max});
      event.preventDefault();
    };
    over.style.touchAction = "pan-y";
    for (const kind of ["touchstart", "touchmove"]) over.addEventListener(kind, follow, {passive: false});
  }

  function chart(about, index, count) {
    const labelled = index === 0 && run.events.length && run.events.length <= 12;
    const narrow = $("charts").clientWidth < 500, font = "12px system-ui, sans-serif", grid = {stroke: themed("--raster"), width: 1}, stroke = themed("--ink");
    const lines = about.lines.map((line) => ({
      label: line.label, stroke: readable(line.colour), width: 1.7, dash: line.dashed ? [7, 4] : undefined,
      value: (u, value) => shown(value, 4), points: {show: false},
      paths: about.stepped ? uPlot.paths.stepped({align: 1}) : undefined,
    }));
    const box = made($("charts"), "div", {class: "chart", "data-chart": about.title});
    made(box, "h3", {}, about.unit === "–" ? about.title : `${about.title}, ${about.unit}`);
    const u = new uPlot({
      width: $("charts").clientWidth, padding: [labelled ? 69 : 8, null, null, null],
      height: (narrow ? 130 : 145) + (labelled ? 61 : index === count - 1 ? 18 : 0),
      scales: {x: {time: false}},
      cursor: {y: false, sync: {key: "simbrake"}, drag: {x: true, y: false}},
      axes: [
        {font, grid, stroke, size: 26, label: index === count - 1 ? "time, s" : undefined, labelFont: font, labelSize: 18},
        {font, grid, stroke, size: 60, values: (u, splits, axis, space, step) => ticks(splits, step)},
      ],
      series: [{label: "t, s", value: (u, value) => shown(value, 4)}, ...lines],
      hooks: {draw: [marks], setScale: [zoomed], setCursor: [followed]},
    }, [run.t, ...run.y[index]], box);
    u.over.addEventListener("pointerenter", () => { hovered = u; stop(); });
    fingers(u);
    return u;
  }

  function drawCharts(found) {
    const shown = view, same = run !== null && JSON.stringify(run.charts) === JSON.stringify(found.charts);
    run = found;
    if (same) {
      plots.forEach((u, i) => {
        u.setData([run.t, ...run.y[i]], zoom === null);
        if (zoom !== null) u.redraw(true, true);
      });
      return look(shown);
    }
    for (const u of plots) u.destroy();
    $("charts").replaceChildren();
    plots = [];
    run.charts.forEach((about, i) => plots.push(chart(about, i, run.charts.length)));
    drawWindows();
    look(shown);
  }

  /** Show a window of the run in all charts; none where the user has zoomed. */
  function look(i) {
    const window = run.windows[i];
    if (window) plots[0].setScale("x", {min: window.start, max: window.end});
  }

  function drawWindows() {
    $("windows").replaceChildren();
    (run.windows.length > 1 ? run.windows : []).forEach((window, i) => {
      const button = made($("windows"), "button", {type: "button"}, window.words);
      button.addEventListener("click", () => look(i));
    });
    made($("windows"), "span", {class: "soft"}, "Drag over a chart to zoom, double-click for all of it.");
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (run === null) return;
    const found = run;
    run = null;
    drawCharts(found);
  });

  window.addEventListener("resize", () => {
    for (const u of plots) u.setSize({width: $("charts").clientWidth, height: u.height});
  });

  // --- the film: the brake along its shaft, moment by moment -------------------------------------------------------

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

  function rings(svg, top, [base, length], from, to) {
    for (const share of [0, 0.5, 1]) {
      const radius = base + length * share, [x, y] = spot(radius, to + 0.08 / radius).split(" ");
      made(svg, "path", {d: arc(radius, from, to), class: "ring"});
      made(svg, "text", {x, y, class: "tick"}, shown(top * share, 3));
    }
  }

  const most = (rows) => Math.max(...rows.map((row) => Math.max(...row)), 1e-9);

  /** Which part of the film, each with its speed, has a moment. */
  const partOf = ({run: times, words}, i) => Math.min(place(times, run.t[i]), words.length - 1);

  function drawFilm(film) {
    const svg = $("wheel"), {places, tension, pairs} = film, banded = tension !== null;
    svg.replaceChildren();
    picture = {film, rings: [], heat: [], loads: []};
    picture.rim = made(svg, "path", {d: wedge(0, 3.1415, 0.94, 1) + wedge(3.1415, 6.283, 0.94, 1), class: "rim"});
    picture.turning = made(svg, "g", {class: "turning"});
    for (const i of [0, 1, 2]) made(picture.turning, "path", {d: `M0 0L${spot(0.93, 2 * Math.PI * i / 3)}`, class: "spoke"});
    made(picture.turning, "circle", {cx: 0.55, cy: 0, r: 0.06, class: "mark"});
    made(svg, "circle", {r: 0.13, class: "hub"});
    const angles = places.flatMap((p) => [p[0], p[1]]), from = Math.min(...angles), to = Math.max(...angles);
    const low = Math.max(1.8, -2.2 * Math.min(Math.sin(from), Math.sin(to)));
    svg.setAttribute("viewBox", banded ? `-2.2 -2.15 4.4 ${2.15 + low}` : "-1.2 -1.2 2.4 2.4");
    if (banded) {
      picture.topTension = most(tension);
      picture.topLoad = most(pairs.flatMap((pair) => pair.load));
      rings(svg, picture.topTension, TENSION, from, to);
      rings(svg, picture.topLoad, LOAD, from, to);
      picture.curve = made(svg, "path", {class: "tension"});
      made(svg, "path", {d: arc(BAND, from, to), class: "band"});
      film.ends.forEach(([x, y, tipX, tipY, left, top, side], k) => {
        made(svg, "path", {d: `M${x} ${-y}L${tipX} ${-tipY}`, class: "band"});
        const style = `text-anchor:${{left: "start", center: "middle", right: "end"}[side]}`;
        [["slack end", "(lever)"], ["tight end", "(anchor)"]][k].forEach((words, line) =>
          made(svg, "text", {x: left, y: 0.11 + 0.11 * line - top, style}, words));
      });
    }
    pairs.forEach((pair, k) => picture.rings.push(places.map(([a, b, inner, outer], i) => {
      const step = (outer - inner) / pairs.length, top = outer - k * step;
      const found = made(svg, "path", {d: wedge(a, b, top - step, top), class: "lining", "data-lining": i, "data-pair": k});
      found.addEventListener("pointerenter", () => { picture.looked = [k, i]; tell(); });
      return found;
    })));
    if (banded) picture.loads = places.map(() => made(svg, "path", {class: "load"}));
    const hot = film.heat && film.heat.linings && banded ? places : [];
    picture.heat = hot.map(([a, b]) => made(svg, "path", {d: wedge(a, b, ...HEAT), class: "heat"}));
    places.forEach(([a, b, inner, outer], i) => {
      const [x, y] = spot((inner + outer) / 2, (a + b) / 2).split(" ");
      if (places.length <= 30 || i % 5 === 4) made(svg, "text", {x, y, class: "count"}, String(i + 1));
    });
    $("at").max = run.t.length - 1;
    drawLegend(film);
  }

  function drawLegend(film) {
    const {units} = data.still, there = new Set(film.pairs.flatMap((pair) => pair.contacts).join(""));
    $("legend").replaceChildren();
    const item = (colour, words) => {
      const box = made($("legend"), "span", {class: "item"});
      made(box, "i").style.background = colour;
      box.append(words);
    };
    for (const [state, look] of Object.entries(data.still.states)) if (there.has(state)) item(look.colour, `${data.still.lining} ${look.words}`);
    if (film.tension) {
      item("var(--blue-line)", `outwards: tension T of the band, ${units.force}`);
      item("var(--green-line)", `inwards: normal load N of a lining, ${units.force}`);
    }
    if (film.pairs.length > 1) item("none", "outer half of a lining: band on lining; inner half: lining on rim");
    if (film.heat) item("linear-gradient(90deg,#000004,#932667,#fca50a)", `surface ${shown(film.heat.low, 3)}…${shown(film.heat.high, 3)} ${units.heat}`);
  }

  function drawFrame(i) {
    const {film} = picture, {clock} = film, turns = film.phi[i] / (2 * Math.PI), k = partOf(clock, i);
    frame = i;
    picture.turning.setAttribute("transform", `rotate(${(-360 * (turns % 1)).toFixed(3)})`);
    const speed = film.omega[i] * (clock.run[k + 1] - clock.run[k]) / (clock.film[k + 1] - clock.film[k]) / data.still.turning;  // rad/s as it is played
    picture.turning.style.opacity = Math.abs(speed) > 60 ? 0.25 : 1;
    picture.rings.forEach((ring, k) => ring.forEach((path, j) => {
      path.style.fill = data.still.states[film.pairs[k].contacts[i][j]].colour;
    }));
    if (film.tension) {
      const T = film.tension[i], radius = T.map((x) => TENSION[0] + TENSION[1] * Math.max(x, 0) / picture.topTension);
      const steps = [0, 0.2, 0.4, 0.6, 0.8, 1], there = (a, b, s) => a + s * (b - a);
      const points = film.places.flatMap(([a, b], j) =>
        steps.map((s) => spot(there(radius[j], radius[j + 1], s), there(b, a, s))));
      const back = film.places.flatMap(([a, b]) => steps.map((s) => spot(TENSION[0], there(b, a, s)))).reverse();
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
    const {film} = picture, {clock} = film, {units} = data.still, i = frame, t = run.t[i], T = film.tension && film.tension[i];
    const now = [`t = ${shown(t, 4)} s`, `ω = ${shown(film.omega[i])} ${units.speed}`, `${shown(film.phi[i] / (2 * Math.PI))} turns`];
    if (film.hook) now.push(`${film.hook_name} ${shown(film.hook[i])} ${units.travel}`);
    if (T) now.push(`T₀ = ${shown(T[0])} ${units.force}`, `Tₙ = ${shown(T[T.length - 1])} ${units.force}`);
    now.push(`brake torque ${shown(film.torque[i])} ${units.torque}`);
    if (t <= clock.run.at(-1)) now.push(clock.words[partOf(clock, i)]);
    $("now").textContent = now.join(" · ");
    if (!picture.looked) return;
    const [k, j] = picture.looked, pair = film.pairs[k], words = data.still.states[pair.contacts[i][j]].words;
    const said = [`${data.still.lining} ${j + 1} ${words}`, `N = ${shown(pair.load[i][j])} ${units.force}`];
    if (film.pairs.length > 1) said.unshift(pair.words);
    if (T) said.push(`T behind it ${shown(T[j + 1])} ${units.force}`);
    if (film.heat && film.heat.linings) said.push(`${shown(film.heat.linings[i][film.heat.linings[i].length > 1 ? j : 0])} ${units.heat}`);
    $("looked").textContent = said.join(" · ");
  }

  /** A moment of the film, with the cursors of the charts at it, or nowhere where they are zoomed to others. */
  function jump(i) {
    drawFrame(Math.min(Math.max(i, 0), run.t.length - 1));
    hovered = null;
    const t = run.t[frame];
    for (const u of plots) u.setCursor({left: t > u.scales.x.max ? -1 : u.valToPos(t, "x"), top: 1}, false, false);
  }

  function stop() {
    begun = null;
    if ($("play")) $("play").textContent = "▶ play";
  }

  function tick(now) {
    if (begun === null) return;
    const {film, run: times} = picture.film.clock, at = beganAt + (now - begun) / 1000, i = place(run.t, along(film, times, at));
    if (i !== frame) jump(i);
    if (at >= film.at(-1)) stop(); else requestAnimationFrame(tick);
  }

  function play() {
    if (begun !== null) return stop();
    const {film, run: times} = picture.film.clock, at = along(times, film, run.t[frame]);
    beganAt = at < film.at(-1) ? at : 0;
    begun = performance.now();
    $("play").textContent = "❚❚ pause";
    requestAnimationFrame(tick);
  }

  function drawRun(found, first) {
    const t = picture && run.t[frame];
    drawCharts(found);
    if (!found.film) return;
    drawFilm(found.film);
    const {torque, clock} = found.film, played = torque.map((x, i) => run.t[i] >= clock.run[0] && run.t[i] <= clock.run.at(-1) ? x : -Infinity);
    const i = first ? played.indexOf(Math.max(...played)) : place(run.t, t);
    drawFrame(i);
    requestAnimationFrame(() => jump(i));  // once the charts are laid out
  }

  // --- results beside the pictures ---------------------------------------------------------------------------------

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
      // (a number stays with its unit)
      for (const number of [value, limit, margin]) made(row, "td", {class: "n"}, number.replace(/(\d) (?=[^\s(])/g, "$1\u00a0"));
      made(made(row, "td"), "span", {class: `badge ${kind}`}, state);
    }
    $("figures").replaceChildren();
    for (const {words, text, si, unit, note, decides} of found.metrics) {
      const box = made($("figures"), "div", decides ? {class: "decides"} : {});
      made(box, "dt", {}, words);
      const value = made(box, "dd");
      made(value, "data", {value: si, title: `${si} ${unit}`}, text);
      made(value, "small", {}, note);
    }
  }

  // --- begin -------------------------------------------------------------------------------------------------------

  if ($("play")) {
    $("play").addEventListener("click", play);
    $("back").addEventListener("click", () => { stop(); jump(frame - 1); });
    $("forth").addEventListener("click", () => { stop(); jump(frame + 1); });
    $("at").addEventListener("input", () => { stop(); jump(Number($("at").value)); });
  }
  if (data.run) drawRun(data.run, true);
  window.simbrake = {$, data, shown, made, place, drawResults, drawCharts, drawRun};
})();
