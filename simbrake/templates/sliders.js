"use strict";
// The sliders of a page of simbrake: of a publication, between whose solved points it interpolates, and of the app.
(function () {
  const {$, data, shown, made, place, drawResults, drawCharts, drawRun} = window.simbrake;

  // --- sliders -----------------------------------------------------------------------------------------------------

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

    /** Values at x, or `null` where the sequence of events changes between the points around it. */
    function solve(x) {
      const where = cell(x), inside = where.every((w) => w.share > 0 && w.share < 1);
      const ends = ({i, share}) => share === 0 ? [i] : share === 1 ? [i + 1] : [i, i + 1];
      const corners = where.reduce((all, w) => all.flatMap((corner) => ends(w).map((end) => [...corner, end])), [[]]);
      const found = corners.map((corner) => points[flat(corner)]), sequence = found[0].sequence;
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

    function results({values, sequence, coarse}) {
      const read = (metric, si, offset) => Number.isFinite(si) ? `${shown(si * metric.factor + offset)} ${metric.unit}` : "—";
      const metrics = grid.metrics.map((metric, n) => coarse.includes(n) ?
        {words: metric.words, text: "—", si: "", unit: "", note: "changes too fast between the points"} : {
          words: metric.words, text: read(metric, values[n], metric.offset), si: Number.isFinite(values[n]) ? values[n] : "",
          unit: metric.si_unit, note: "",
        }).filter((metric) => metric.si !== "" || metric.note);
      const limited = grid.metrics.map((metric, n) => [metric, values[n], n]).filter(([metric]) => metric.limit !== null);
      const rows = limited.map(([metric, si, n]) => {
        if (coarse.includes(n)) return [metric.words, "—", read(metric, metric.limit, metric.offset), "—", "not known here", ""];
        const over = !(si <= metric.limit), margin = read(metric, metric.limit - si, 0);
        return [metric.words, read(metric, si, metric.offset), read(metric, metric.limit, metric.offset), margin,
          over ? "exceeded" : "within limit", over ? "bad" : "good"];
      });
      const open = limited.some(([, , n]) => coarse.includes(n)), colour = open ? "amber" : sequence.colour;
      const over = rows.some((row) => row[5] === "bad"), headline = sequence.status + (over ? ", limit exceeded" : "");
      return {colour: over ? "red" : colour, headline, text: `${sequence.message}.`, rows, metrics};
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
      const whole = {words: "whole run", start: t[0], end: t[t.length - 1]};
      const rest = last && last.words === "stop" ? t[0] + 1.15 * (last.t - t[0]) : whole.end;
      const windows = rest < whole.end ? [{...whole, words: "until rest", end: rest}, whole] : [];
      return {charts: grid.charts, t, y, windows, events: marked};
    }

    function show() {
      const found = solve(at), gap = found === null;
      document.body.classList.toggle("gap", gap);
      $("state").textContent = gap ? "Gap: between the solved points around here the sequence of events, or a time, changes too much. " +
        "Move a slider to a blue stretch." : "";
      drawResults(gap ? {colour: "", headline: "No value here", text: "", rows: [], metrics: []}
        : results(found));
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

  // --- the app: each move is a run; the latest wins ----------------------------------------------------------------

  function application(app) {
    const values = {};
    let waiting = null, wanted = false, sent = 0, any = data.run !== null;

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
      drawResults(found.results);
      if (found.run) drawRun(found.run, !any);
      any ||= Boolean(found.run);
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
      const found = await (await fetch("scene", request())).json();
      if (found.problem) return take(found);
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([found.text], {type: "application/toml"}));
      link.download = found.name;
      link.click();
      $("state").textContent = `saved as ${found.name}`;
    });
  }

  if (data.grid) publication(data.grid);
  if (data.app) application(data.app);
})();
