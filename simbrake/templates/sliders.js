"use strict";
// The sliders of a page of simbrake: of a publication, between whose solved points it interpolates, and of the app.
(function () {
  const {$, data, shown, made, place, drawResults, drawCharts, drawRun} = window.simbrake;

  // --- sliders -----------------------------------------------------------------------------------------------------

  const reading = (control, si) => si * control.factor + control.offset;

  /** A row with a slider and a field; `moved(si)` is called with each new value. */
  function slider(parent, control, steps, moved) {
    const row = made(parent, "div", {class: "control", "data-path": control.path});
    const id = `c-${control.path}`, name = made(row, "label", {for: id, title: control.meaning}, control.name ?? control.meaning);
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

  /** Heading, limits and metrics of a run; `unknown`: places of metrics that have no value here; `coverage`: what the
   * limits cover. */
  function readResults({metrics: about, coverage}, values, {colour, status, message}, unknown = []) {
    const read = (metric, si, offset, digits = 5) =>
      Number.isFinite(si) ? `${shown(si * metric.factor + offset, digits)} ${metric.unit}` : "—";
    const metrics = about.map((metric, n) => {
      const si = Number.isFinite(values[n]) ? values[n] : "", decides = metric.decides;
      if (unknown.includes(n))
        return {words: metric.words, text: "—", si: "", unit: "", note: "changes too fast between the points", decides};
      return {words: metric.words, text: read(metric, values[n], metric.offset, 3), si, unit: metric.si_unit, note: "", decides};
    }).filter((metric) => metric.si !== "" || metric.note).sort((a, b) => b.decides - a.decides);
    const rows = [];
    about.forEach((metric, n) => {
      const si = values[n], least = metric.least !== null;
      // (without a load to hold there is no reserve; what never happened exceeds its limit)
      if (metric.limit === null && !(least && (unknown.includes(n) || Number.isFinite(si)))) return;
      const bound = read(metric, least ? metric.least : metric.limit, metric.offset), limit = `${least ? ">" : "≤"} ${bound}`;
      if (unknown.includes(n)) return rows.push([metric.words, "—", limit, "—", "not known here", "open"]);
      const margin = least ? si - metric.least : metric.limit - si, over = least ? !(margin > 0) : !(margin >= 0);
      const [state, kind] = over ? ["exceeded", "bad"] : margin < metric.small ? ["small margin", "open"] : ["within limit", "good"];
      rows.push([metric.words, read(metric, si, metric.offset), limit, read(metric, margin, 0), state, kind]);
    });
    const has = (place, word) => rows.some((row) => row[place] === word), over = has(5, "bad"), open = has(5, "open");
    const found = over ? "red" : colour === "green" && (open || coverage.open) ? "amber" : colour;
    const headline = status + (over ? ", limit exceeded" : has(4, "small margin") ? ", small margin" : "");
    return {colour: found, headline, text: `${message}. ${coverage.words}`.trim(), rows, metrics};
  }

  /** The windows of a run that a page offers: until its last event, and the whole of it. */
  function windowsOf(start, end, last) {
    const whole = {words: "whole run", start, end}, rest = last ? start + 1.15 * (last.t - start) : end;
    return rest < end ? [{...whole, words: "until rest", end: rest}, whole] : [];
  }

  // --- a published grid: cubic Hermite between solved points -------------------------------------------------------

  function publication(grid) {
    const {axes, points} = grid, bytes = Uint8Array.from(atob(grid.numbers), (c) => c.charCodeAt(0));
    const numbers = new Float32Array(bytes.buffer), at = axes.map((axis) => axis.value);
    const sizes = axes.map((axis) => axis.values.length), flat = (index) => index.reduce((sum, i, k) => sum * sizes[k] + i, 0);

    /** Values and derivatives at a solved point: `rows[0]` values, `rows[1 + k]` by axis k. */
    const rowsOf = ({sequence, start}) => [null, ...axes].map((_, k) => {
      const size = grid.sequences[sequence].size;
      return numbers.subarray(start + k * size, start + (k + 1) * size);
    });

    /** Cell and share of the way through it, along each axis. */
    const cell = (x) => axes.map((axis, k) => {
      const last = axis.values.length - 2, i = Math.min(place(axis.values, x[k]), last);
      const share = (x[k] - axis.values[i]) / (axis.values[i + 1] - axis.values[i]);
      return {i, share: share < 1e-9 ? 0 : share > 1 - 1e-9 ? 1 : share, width: axis.values[i + 1] - axis.values[i]};
    });

    /** What is too coarse to be shown between points: in all cells on which they border; -1: times of events. */
    function coarseAt(where) {
      if (where.every((w) => w.share === 0 || w.share === 1)) return [];
      const beside = ({i, share}, last) => [i - 1, i, i + 1].filter((j) => j >= 0 && j < last &&
        (j === i || (j < i ? share === 0 : share === 1)));
      const cells = where.reduce((all, w, k) => all.flatMap((n) => beside(w, sizes[k] - 1).map((i) => n * (sizes[k] - 1) + i)), [0]);
      const each = cells.map((n) => grid.coarse[n] ?? []);
      return each[0].filter((metric) => each.every((one) => one.includes(metric)));
    }

    /** The solved points around a place. */
    function around(where) {
      const ends = ({i, share}) => share === 0 ? [i] : share === 1 ? [i + 1] : [i, i + 1];
      const corners = where.reduce((all, w) => all.flatMap((corner) => ends(w).map((end) => [...corner, end])), [[]]);
      return corners.map((corner) => points[flat(corner)]);
    }

    /** What happens in a gap: how the runs around it differ. */
    function happening(x) {
      const kinds = [...new Set(around(cell(x)).map((point) => point.sequence))].sort((a, b) => a - b);
      const known = kinds.filter((n) => n >= 0).map((n) => grid.sequences[n]), ways = [...new Set(known.map((one) => one.status))];
      if (kinds.includes(-1)) ways.push("Failed");
      if (ways.length > 1) return `Around here runs end in different ways: ${ways.join("; ")}.`;
      if (kinds.length === 1) return "Between the solved points around here an event comes or goes, or its time changes too fast.";
      const lists = known.map((one) => one.events.map((event) => event.words)), all = [...new Set(lists.flat())];
      const count = (list, words) => list.filter((one) => one === words).length;
      const some = all.filter((words) => new Set(lists.map((list) => count(list, words))).size > 1);
      return some.length ? `Around here not all runs have the same events: ${some.join(", ")}.`
        : `Around here the same events come in different orders: ${lists.map((list) => list.join(", ")).join("; or ")}.`;
    }

    /** Values at x, or `null` where the sequence of events changes between the points around it. */
    function solve(x) {
      const where = cell(x), inside = where.every((w) => w.share > 0 && w.share < 1);
      const found = around(where), sequence = found[0].sequence;
      if (sequence < 0 || found.some((point) => point.sequence !== sequence)) return null;
      if (inside && grid.gaps.includes(cellNumber(where))) return null;
      const coarse = coarseAt(where);
      if (coarse.includes(-1)) return null;
      let rows = found.map(rowsOf);
      where.forEach(({share: s, width}, k) => {
        if (s === 0 || s === 1) return;
        const half = rows.length / 2;
        rows = rows.slice(0, half).map((row, j) => between(row, rows[j + half], s, width, k + 1));
      });
      return {values: rows[0][0], sequence: grid.sequences[sequence], coarse};
    }

    const cellNumber = (where) => where.reduce((sum, w, k) => sum * (sizes[k] - 1) + w.i, 0);

    /** Values by cubic Hermite along the axis of the derivative `k`, the other derivatives linearly. */
    function between(a, b, s, width, k) {
      const h = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * width, s * s * (3 - 2 * s), s * s * (s - 1) * width];
      return a.map((_, r) => Float64Array.from(a[r], (x, n) =>
        r === 0 ? h[0] * x + h[1] * a[k][n] + h[2] * b[0][n] + h[3] * b[k][n] : (1 - s) * x + s * b[r][n]));
    }

    function runOf(values, sequence) {
      const {pieces, events} = sequence, m = grid.samples, first = grid.metrics.length;
      const edges = Array.from(values.slice(first, first + pieces + 1)), t = [], kept = [];
      for (let i = 0; i < pieces; i++) for (let j = 0; j < m; j++) {
        const time = edges[i] + (edges[i + 1] - edges[i]) * (j / (m - 1));
        if (t.length && time < t[t.length - 1]) continue;
        t.push(time);
        kept.push(i * m + j);
      }
      let start = first + pieces + 1;
      const y = grid.charts.map((about) => about.lines.map(() => {
        const line = kept.map((n) => values[start + n]);
        start += pieces * m;
        return line;
      }));
      const marked = events.map((event) => ({...event, t: edges[event.edge]})), last = marked.at(-1);
      const windows = windowsOf(t[0], t[t.length - 1], last && last.words === "stop" ? last : null);
      return {charts: grid.charts, t, y, windows, events: marked};
    }

    function show() {
      const found = solve(at), gap = found === null;
      document.body.classList.toggle("gap", gap);
      $("state").textContent = gap ? `Gap. ${happening(at)} Move a slider to a blue stretch.` : "";
      drawResults(gap ? {colour: "", headline: "No value here", text: "", rows: [], metrics: []}
        : readResults(grid, found.values, found.sequence, found.coarse));
      if (!gap) drawCharts(runOf(found.values, found.sequence));
      rows.forEach(({bar}, k) => paint(bar, k));
    }

    /** Colour the stretches of a slider: those that have values, and gaps. */
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
      if (si !== at[k] && near === undefined) rows[k].put(at[k]);
      show();
    }));
    if (solve(at) === null) {  // the page begins at the nearest solved point
      const far = (x) => axes.reduce((sum, axis, k) => sum + ((x[k] - axis.value) / (axis.high - axis.low)) ** 2, 0);
      const all = axes.reduce((found, axis) => found.flatMap((x) => axis.values.map((value) => [...x, value])), [[]]);
      const nearest = all.filter((_, i) => points[i].sequence >= 0).sort((a, b) => far(a) - far(b))[0];
      nearest.forEach((value, k) => { at[k] = value; rows[k].put(value); });
    }
    show();
  }

  // --- sliders in groups, of the app and of a page that runs -------------------------------------------------------

  /** Sliders for parameters in groups, with a search and a reset; `moved(values)`: those that are changed, in SI. */
  function sliderGroups(controls, values, moved) {
    const groups = new Map();
    for (const control of controls) {
      if (!groups.has(control.group)) {
        const box = made($("sliders"), "details", groups.size < 1 ? {open: ""} : {});
        made(box, "summary", {}, control.group);
        groups.set(control.group, box);
      }
      const found = slider(groups.get(control.group), control, 1000, (si) => {
        if (si === control.value) delete values[control.path]; else values[control.path] = si;
        moved();
      });
      $("reset").addEventListener("click", () => found.put(control.value));
    }
    $("reset").addEventListener("click", () => {
      for (const path of Object.keys(values)) delete values[path];
      moved();
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
  }

  /** What a page began with, drawn beside its run now where that is wanted: in the tiles, and dashed in the charts. */
  function comparison(first) {
    const tiles = new Map([...$("figures").children].map((box) => [box.querySelector("dt").textContent, box.querySelector("data").cloneNode(true)]));
    let wanted = false, last = null;

    function beside(metric) {
      const old = tiles.get(metric.words);
      if (!old || old.value === "" || metric.si === "") return metric;
      // (of a temperature the share means nothing)
      const share = 100 * (metric.si / old.value - 1), shares = metric.unit !== "K" && Number.isFinite(share);
      const change = shares ? `, ${share < 0 ? "" : "+"}${shown(share, 2)} %` : "", same = metric.text === old.textContent;
      const words = same ? "as at the start" : `start: ${old.textContent}${change}`;
      return {...metric, note: [metric.note, words].filter(Boolean).join("; ")};
    }

    function overlaid(run) {
      const {t} = first, at = run.t.map((now) => place(t, now));
      const value = (line, now, i) => now > t[t.length - 1] ? null : i + 1 === t.length || t[i + 1] === t[i] ? line[i]
        : line[i] + (line[i + 1] - line[i]) * (now - t[i]) / (t[i + 1] - t[i]);
      const pairs = run.charts.map((chart, n) => {
        const old = first.charts.findIndex((one) => one.title === chart.title && one.lines.length === chart.lines.length);
        if (old < 0) return [chart, run.y[n]];
        const lines = chart.lines.map((line) => ({...line, label: `${line.label}, start`, dashed: true}));
        const y = first.y[old].map((line) => run.t.map((now, i) => value(line, now, at[i])));
        return [{...chart, lines: [...chart.lines, ...lines]}, [...run.y[n], ...y]];
      });
      return {...run, charts: pairs.map(([chart]) => chart), y: pairs.map(([, y]) => y)};
    }

    function draw(results, run, drawn) {
      last = [results, run, drawn];
      drawResults(wanted ? {...results, metrics: results.metrics.map(beside)} : results);
      if (run) drawn(wanted && first ? overlaid(run) : run);
    }

    $("compare").addEventListener("click", () => {
      wanted = !wanted;
      $("compare").setAttribute("aria-pressed", wanted);
      if (last) draw(...last);
    });
    return draw;
  }

  // --- the app: each move is a run; the latest wins ----------------------------------------------------------------

  function application(app) {
    const values = {};
    let waiting = null, wanted = false, sent = 0, any = data.run !== null;
    const draw = comparison(data.run);

    const request = () => ({method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify({values})});

    async function ask() {
      if (waiting !== null) {
        wanted = true;  // a short run is waited for, so that moving a slider shows pictures; a longer one ends
        const asked = waiting;
        setTimeout(() => { if (asked === waiting) asked.abort(); }, Math.max(0, sent + 150 - performance.now()));
        return;
      }
      waiting = new AbortController();
      wanted = false;
      sent = performance.now();
      try {
        const answer = await fetch("run", {...request(), signal: waiting.signal});
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
      const first = !any;
      draw(found.results, found.run, (run) => drawRun(run, first));
      any ||= Boolean(found.run);
      requestAnimationFrame(() => { $("state").textContent = `drawn after ${Math.round(performance.now() - sent)} ms`; });
    }

    sliderGroups(app.controls, values, ask);
    /** The scene as it is now, for a button that does something with its text. */
    const withScene = (id, use) => $(id).addEventListener("click", async () => {
      const found = await (await fetch("scene", request())).json();
      if (found.problem) return take(found);
      $("state").textContent = await use(found);
    });
    withScene("save", ({name, text}) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([text], {type: "application/toml"}));
      link.download = name;
      link.click();
      return `saved as ${name}`;
    });
    withScene("copy", async ({text}) => {
      await navigator.clipboard.writeText(text);
      return "copied as TOML";
    });
  }

  // --- a page that runs: the program of the scene, here in the browser ----------------------------------------------

  async function inBrowser(live) {
    const packed = Uint8Array.from(atob(live.program), (c) => c.charCodeAt(0));
    const opened = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const {instance: {exports: c}} = await WebAssembly.instantiate(await new Response(opened).arrayBuffer());
    if (c._initialize) c._initialize();
    const doubles = (place, count) => new Float64Array(c.memory.buffer, place, count);
    const numbers = doubles(c.live_numbers(), live.numbers), first = numbers.slice(), values = {};
    const controls = new Map(live.controls.map((control) => [control.path, control]));
    let draw = null;

    /** Times at which the curves are drawn: evenly until rest and over all, and beside each event. */
    function grid(start, end, events) {
      const last = events.length ? Math.min(start + 1.15 * (events.at(-1).t - start), end) : end, near = 1e-9 * (end - start);
      const evenly = (from, to, count) => Array.from({length: count + 1}, (_, i) => i === count ? to : from + (to - from) * i / count);
      const beside = events.slice(0, 60).flatMap((event) => [event.t - near, event.t + near]);
      const all = [...evenly(start, last, 160), ...evenly(start, end, 60), ...beside].filter((t) => t >= start && t <= end);
      return [...new Set(all)].sort((a, b) => a - b).slice(0, live.rows);
    }

    function curves(start, end, events) {
      let count = c.live_rows();
      if (live.steps) {
        const times = grid(start, end, events);
        doubles(c.live_grid(), times.length).set(times);
        count = c.live_curves(live.rtol, times.length);
      }
      const columns = doubles(c.live_columns(), count * live.width);
      const rows = Array.from({length: count}, (_, i) => columns.subarray(i * live.width, (i + 1) * live.width));
      const value = (row, [place, size, most]) => most ? Math[most](...row.subarray(place, place + size)) : row[place];
      const t = rows.map((row) => row[live.time]);
      const y = live.charts.map((chart) => chart.from.map((line) => rows.map((row) => value(row, line) * chart.factor + chart.offset)));
      return {charts: live.charts, t, y, windows: windowsOf(start, end, events.at(-1)), events};
    }

    /** Metrics, events and curves with the numbers as they are. */
    function run() {
      const code = c.live_run(live.rtol, live.steps ? 0 : 1), metrics = [...doubles(c.live_metrics(), live.metrics.length)];
      const times = doubles(c.live_times(), c.live_events()), names = new Int32Array(c.memory.buffer, c.live_names(), c.live_events());
      const events = [...times].map((t, i) => ({...live.events[names[i]], t})).filter((event) => event.words);
      return {code, metrics, events, status: c.live_status(), reason: c.live_reason(), colour: c.live_colour()};
    }

    function show() {
      const began = performance.now(), wrong = [];
      numbers.set(first);
      for (const [path, si] of Object.entries(values)) {
        const {places, ends, meaning} = controls.get(path);
        if (!(si >= ends[0] && si <= ends[1])) wrong.push(`${meaning}: ${si} is out of range (SI)`);
        for (const place of places) numbers[place] = si;
      }
      $("state").className = wrong.length ? "state wrong" : "state";
      if (wrong.length) { $("state").textContent = wrong.join("\n"); return; }
      const found = run(), failed = live.failures[found.code] || ["bad_number", "a number is not finite"];
      const judged = {colour: live.colours[found.colour], status: live.reasons[found.reason], message: live.statuses[found.status]};
      const said = found.code === 0 ? judged :
        {colour: "red", status: `Failed: ${failed[0]}`, message: failed[1]};
      const results = readResults(live, found.code === 0 ? found.metrics : found.metrics.map(() => NaN), said);
      const [start, end] = live.span.map((place) => numbers[place]), drawn = curves(start, end, found.events);
      const ran = performance.now() - began, curved = drawn.t.length > 1 ? drawn : null;
      if (draw) {
        draw(results, curved, drawCharts);
      } else {  // as the page began
        drawResults(results);
        if (curved) drawCharts(curved);
        draw = comparison(curved);
      }
      document.body.dataset.milliseconds = ran.toFixed(2);
      $("state").textContent = `run in ${ran < 10 ? ran.toFixed(1) : Math.round(ran)} ms`;
    }

    sliderGroups(live.controls, values, show);
    $("save").addEventListener("click", async () => {
      const text = Object.entries(values).map(([path, si]) => `--set '${path}=${si}'`).join(" ");
      await navigator.clipboard.writeText(text);
      $("state").textContent = text ? `copied: ${text}` : "nothing is changed";
    });
    window.simbrake.live = {run, curves};
    show();
  }

  if (data.grid) publication(data.grid);
  if (data.live) inBrowser(data.live).catch((error) => {
    $("state").className = "state wrong";
    $("state").textContent = `This browser cannot run the page: ${error.message}`;
  });
  if (data.app) application(data.app);
})();
