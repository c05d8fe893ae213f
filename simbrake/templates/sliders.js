"use strict";
// The sliders of a page of simbrake: of a publication, which runs its scene itself, and of the app.
(function () {
  const {$, data, shown, made, place, drawResults, drawCharts, drawRun} = window.simbrake;

  // --- sliders -----------------------------------------------------------------------------------------------------

  const reading = (control, si) => si * control.factor + control.offset;

  /** A row with a slider and a field; `moved(si)` is called with each new value. */
  function slider(parent, control, moved) {
    const row = made(parent, "div", {class: "control", "data-path": control.path});
    const id = `c-${control.path}`, name = made(row, "label", {for: id, title: control.meaning}, control.name ?? control.meaning);
    made(name, "code", {}, control.path);
    const bar = made(row, "input", {type: "range", id, min: 0, max: 1000, step: "any"});
    const field = made(row, "input", {type: "text", inputmode: "decimal", "aria-label": `${control.meaning}: value`});
    made(row, "span", {class: "unit"}, control.unit);
    const put = (si) => {
      bar.value = 1000 * (si - control.low) / (control.high - control.low);
      field.value = shown(reading(control, si), 6);
      row.classList.toggle("changed", si !== control.value);
    };
    bar.addEventListener("input", () => {
      const si = control.low + (control.high - control.low) * bar.value / 1000;
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
    return put;
  }

  /** Heading, limits and metrics of a run; `coverage`: what the limits cover. */
  function readResults({metrics: about, coverage, ratios, small}, values, {colour, status, message, ...said}) {
    /** A number (SI) in the unit that fits its size; `apart`: a difference, of temperatures in kelvins. */
    function read({scales, offset, difference}, si, digits, apart = false) {
      if (!Number.isFinite(si)) return "—";
      const [, factor, unit] = scales.find(([low]) => Math.abs(si) >= low && si !== 0) ?? scales.at(-1), temperature = offset !== 0;
      return `${shown(si * factor + (apart ? 0 : offset), digits)} ${apart && temperature ? difference : unit}`.trim();
    }
    const metrics = about.map((metric, n) => {
      const si = Number.isFinite(values[n]) ? values[n] : "", {words, decides} = metric;
      return {words, text: read(metric, values[n], 3), si, unit: metric.si_unit, note: "", decides};
    }).filter((metric) => metric.si !== "").sort((a, b) => b.decides - a.decides);
    const rows = [], stateOf = (over, near) => over ? ["exceeded", "bad"] : near ? ["small margin", "open"] : ["within limit", "good"];
    about.forEach((metric, n) => {
      const si = values[n];
      if (metric.limit === null) return;
      // (what never happened exceeds its limit)
      const limit = `${metric.least ? "≥" : "≤"} ${read(metric, metric.limit, 5)}`;
      const margin = metric.least ? si - metric.limit : metric.limit - (metric.of_size ? Math.abs(si) : si);
      const unloaded = metric.least && si === Infinity && status.startsWith("H4");
      const judged = unloaded ? ["no load hung", ""] : stateOf(!(Number.isFinite(si) && margin >= 0), margin < metric.small);
      rows.push([metric.words, read(metric, si, 4), limit, read(metric, margin, 3, true), ...judged]);
    });
    const named = (kind) => rows.filter((row) => row[5] === kind).map(([name]) => name).join(", ");
    const over = named("bad"), found = over ? "red" : colour === "green" && (named("open") || coverage.open) ? "amber" : colour;
    // (what they mean for the colour is in the reason)
    for (const {key, words, reasons} of ratios) {
      const ratio = said[key];
      if (!Number.isFinite(ratio) || !reasons.includes(said.reason)) continue;
      const known = key !== "reserve" || said.pull > 0 || colour === "red";
      const margin = known ? `${ratio < 1 ? "" : "+"}${shown(100 * (ratio - 1), 3)} %` : "—";
      const judged = known ? stateOf(!(ratio > 1 + (colour === "red" ? 1e-9 : 0)), ratio < small) : ["not evaluated", ""];
      rows.push([words, shown(ratio, 4), "> 1", margin, ...judged]);
    }
    const near = named("open"), headline = status + (over ? `. Exceeded: ${over}` : near ? `. Small margin: ${near}` : "");
    return {colour: found, headline, text: `${message}. ${coverage.words}`.trim(), rows, metrics};
  }

  /** The windows of a run that a page offers: until its last event, and the whole of it. */
  function windowsOf(start, end, last) {
    const whole = {words: "whole run", start, end}, rest = last ? start + 1.15 * (last.t - start) : end;
    return rest < end ? [{...whole, words: "until rest", end: rest}, whole] : [];
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
      const put = slider(groups.get(control.group), control, (si) => {
        if (si === control.value) delete values[control.path]; else values[control.path] = si;
        moved();
      });
      $("reset").addEventListener("click", () => put(control.value));
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
      const said = {status: c.live_status(), reason: c.live_reason(), colour: c.live_colour()};
      // (a load may have been held with less before)
      const reserve = c.live_reserve(), least = metrics[live.least] < reserve ? metrics[live.least] : NaN;
      return {code, metrics, events, ...said, reserve, least, sliding: c.live_sliding(), pull: c.live_pull()};
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
      const message = found.code === 0 ? live.statuses[found.status] : failed[1];
      const said = found.code < 0 ? {colour: "red", status: `Failed: ${failed[0]}`, message} :
        {...found, colour: live.colours[found.colour], status: live.reasons[found.reason], message};
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

  if (data.live) inBrowser(data.live).catch((error) => {
    $("state").className = "state wrong";
    $("state").textContent = `This browser cannot run the page: ${error.message}`;
  });
  if (data.app) application(data.app);
})();
