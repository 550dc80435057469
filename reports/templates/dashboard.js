"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const OTHERS = "others", UNSURE = "unsure";  // as live/run_state.py has them
  const SILENT_MS = 6000;  // three heartbeats
  const ANSWER_MS = 5000, YIELD_MS = 500;
  const byId = (id) => document.getElementById(id);
  const token = location.hash.slice(1);
  const percent = (p) => p < 1 && p >= 0.995 ? "> 99 %" : `${(100 * p).toFixed(0)} %`;
  const words = (name) => String(name).replaceAll("_", " ");
  let state = null, heard = 0, source = null;

  // Only what differs is written: a reader that is spoken to hears changes, and no focus is lost.
  function write(id, text) {
    const place = byId(id);
    if (place.textContent !== text) place.textContent = text;
  }
  function filled(parent, count, make) {
    while (parent.children.length > count) parent.lastElementChild.remove();
    while (parent.children.length < count) parent.append(make());
    return [...parent.children];
  }
  function element(tag, classes = "", ...children) {
    const made = document.createElement(tag);
    if (classes) made.className = classes;
    made.append(...children);
    return made;
  }
  function drawn(tag, attributes, text = "") {
    const made = document.createElementNS(NS, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.textContent = text;
    return made;
  }
  function duration(seconds) {
    if (seconds === null || seconds === undefined) return "—";
    if (seconds < 90) return `${seconds.toFixed(seconds < 10 ? 1 : 0)} s`;
    const minutes = Math.floor(seconds / 60);
    return minutes < 90 ? `${minutes} min ${Math.floor(seconds % 60)} s` :
      `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  }

  // Combined over several grasps once it is decided, else of the last one.
  function probabilities(state) {
    const combined = state.decision?.probability;
    if (combined && typeof combined === "object") return combined;
    return state.prediction?.probability ?? {};
  }
  function value(told, unit) {
    return typeof told === "number" ? `${told.toPrecision(3)} ${unit ?? ""}`.trim() : words(told);
  }

  // [class, mark, what is said, what is said smaller]
  function judged(state) {
    const { prediction, decision, plan } = state;
    const needed = plan.threshold ?? null;
    if (state.stopped) {
      const held = state.stopped.held ? `It still holds: ${words(state.stopped.held)}.` :
        "Nothing is held.";
      const [mark, told] = state.stopped.finished ? ["✓", "finished"] : ["■", "stopped"];
      return [state.stopped.held ? "alarm" : "", mark, told, `${state.stopped.reason} · ${held}`];
    }
    if (state.paused !== null || state.mode === "paused")
      return ["unsure", "❚❚", "paused", state.paused || "It goes on with Go on."];
    if (!prediction) return ["", "…", state.grasps.length ? "listening" : "no grasp yet", ""];
    const rate = prediction.detection_rate ?? null;
    const check = prediction.verdict === "not checked" ? " · novelty not checked" :
      rate === null ? "" : ` · the novelty check detects ${percent(rate)} of novel objects`;
    const then = check + decided(state);
    if (prediction.verdict === "nothing")
      return ["unsure", "∅", "nothing held", `it sounds like the empty gripper${then}`];
    if (prediction.verdict === "unknown")
      return ["alarm", "!", "unlike anything known",
        `${prediction.novelty.toFixed(1)} times as far as a new grasp may be${then}`];
    if (prediction.kind === "regression") {
      const [low, high] = prediction.interval ?? [];
      const range = low === undefined ? "" : `between ${low.toPrecision(3)} and ${high.toPrecision(3)} ${prediction.unit}`;
      return ["sure", "✓", value(prediction.value, prediction.unit), `${range}${then}`];
    }
    const [best, p] = Object.entries(probabilities(state)).reduce(
      (most, one) => one[1] > most[1] ? one : most, [prediction.value, 0]);
    if (needed !== null && p < needed)
      return ["unsure", "?", "not sure",
        `best: ${words(best)} ${percent(p)}, needed ${percent(needed)}${then}`];
    return ["sure", "✓", words(decision?.value || best), `${percent(p)} sure${then}`];
  }
  const ACTIONS = {
    again: "grasps it again", reject: "not sorted", stop: "stops",
    wait: "waits for an object",
  };
  function decided({ decision }) {
    if (!decision) return "";
    const into = decision.bin ? ` → bin ${words(decision.bin)}` : "";
    const looks = decision.looks > 1 ? `, of ${decision.looks} grasps` : "";
    return `${looks} · ${ACTIONS[decision.action] ?? ""}${into}`.replace("· → bin", "→ bin")
      .replace("·  → bin", "→ bin");
  }

  function showVerdict(state) {
    const [look, mark, said, more] = judged(state);
    byId("verdict").className = `verdict ${look}`;
    byId("said").parentElement.classList.toggle("long", said.length > 8);
    write("mark", mark);
    write("said", said);
    write("more", more);
    const last = state.grasps.at(-1);
    const look_ = state.prediction?.look ?? state.take?.look ?? 1;
    write("which", last ? `grasp ${last.number}${look_ > 1 ? `, look ${look_}` : ""}` : "");
    write("step", state.step && !state.stopped ? `last step: ${state.step}` : "");
  }

  function showBars(state) {
    const given = probabilities(state);
    const names = state.plan.classes ?? Object.keys(given);
    const needed = state.plan.threshold ?? null;
    const list = byId("bars");
    const best = Math.max(...names.map((name) => given[name] ?? 0), 0);
    const rows = filled(list, names.length, () => element("li", "", element("span", "name"),
      element("span", "track", element("i")), element("span", "percent")));
    list.classList.toggle("crowded", names.length > 8);
    list.classList.toggle("few", names.length <= 5);
    document.body.classList.toggle("many", names.length > 8);
    list.style.setProperty("--at", needed === null ? "-9rem" : `${100 * needed}%`);
    rows.forEach((row, i) => {
      const p = given[names[i]] ?? 0, first = p === best && p > 0;
      const enough = first && needed !== null && p >= needed && ["known", "not checked"].includes(state.prediction?.verdict);
      row.dataset.class = names[i];
      row.dataset.probability = p.toFixed(4);
      row.className = `${first ? "best" : ""} ${enough ? "enough" : ""}`.trim();
      row.children[0].textContent = words(names[i]);
      row.children[0].title = words(names[i]);
      row.children[1].firstChild.style.width = `${100 * p}%`;
      row.children[2].textContent = state.prediction ? `${enough ? "✓ " : ""}${percent(p)}` : "—";
    });
    list.dataset.threshold = needed ?? "";
    write("needed", needed === null || !names.length ? "" : `dashed line: ${percent(needed)} is enough`);
  }

  const HIGH = 200, LEFT = 34, BOTTOM = 24, TOP = 26, FLOOR_DB = -60, LEAST_DB = 6;
  const decibels = (levels) => levels.map((level) => 20 * Math.log10(Math.max(level, 10 ** (FLOOR_DB / 20))));
  const distance = (a, b) => a.reduce((sum, one, i) => sum + Math.abs(one - b[i]), 0) / a.length;
  // Relative to the mean of all classes: what they share would hide by what they differ.
  function relative(state) {
    const classes = Object.entries(state.spectra).map(([name, levels]) => [name, decibels(levels)]);
    const take = state.take?.spectrum ? decibels(state.take.spectrum) : null;
    const every = classes.length ? classes.map((one) => one[1]) : take ? [take] : [];
    const shared = every[0]?.map((_, i) => every.reduce((sum, one) => sum + one[i], 0) / every.length);
    const less = (levels) => levels.map((level, i) => level - shared[i]);
    return [new Map(classes.map(([name, levels]) => [name, less(levels)])), take && less(take)];
  }
  function showSpectrum(state) {
    const picture = byId("spectrum");
    const [classes, take] = relative(state);
    const named = state.grasps.at(-1)?.value ?? null, mean = classes.get(named);
    const said = !take ? "no take yet" : mean ?
      `${distance(take, mean).toFixed(1)} dB from the mean of ${words(named)}` : "last take";
    write("sound-said", said);
    write("mean-key", `mean of ${words(named ?? "")}, training`);
    byId("mean-key").hidden = !mean;
    byId("take-key").hidden = !take;
    picture.setAttribute("aria-label", `Spectrum of the last take and of the classes: ${said}`);
    picture.replaceChildren();
    if (!take && !classes.size) return;
    const wide = Math.max(picture.clientWidth, 240);  // as many units as pixels: text keeps its size
    picture.setAttribute("viewBox", `0 0 ${wide} ${HIGH}`);
    const most = Math.max(LEAST_DB, ...[...classes.values(), take ?? []].flat().map(Math.abs));
    const step = most > 25 ? 20 : most > 12 ? 10 : 5, top = step * Math.ceil(most / step);
    const x = (share) => LEFT + (wide - LEFT - 12) * share;
    const y = (db) => TOP + (HIGH - BOTTOM - TOP) * (top - db) / (2 * top);
    for (let db = -top; db <= top; db += step) {
      picture.append(drawn("line", { x1: LEFT, x2: wide, y1: y(db), y2: y(db) }));
      picture.append(drawn("text", { x: LEFT - 4, y: y(db) + 4, "text-anchor": "end" }, String(db).replace("-", "−")));
    }
    picture.append(drawn("text", { x: 0, y: 12 }, classes.size ? "dB from the mean of all classes" : "dB"));
    const khz = (state.top_hz ?? 0) / 1000;
    for (let at = 0; khz && at <= khz; at += 5)
      picture.append(drawn("text", { x: x(at / khz), y: HIGH - 6, "text-anchor": at ? "middle" : "start" }, at ? String(at) : "0 kHz"));
    const line = (levels, look) => picture.append(drawn("path", { class: look, d: levels.map(
      (db, i) => `${i ? "L" : "M"}${x((i + 0.5) / levels.length).toFixed(1)} ${y(db).toFixed(1)}`).join("") }));
    for (const [name, levels] of classes) if (name !== named) line(levels, "other");
    if (mean) line(mean, "mean");
    if (take) line(take, "take");
  }

  function showFacts(state) {
    write("row", String(state.in_a_row));
    write("longest", String(state.longest));
    write("sorts", String(state.sorts));
    write("time", duration(state.seconds));
    write("sort-time", duration(state.sort_s));
    const [good, all] = Object.entries(state.confusion).reduce(([good, all], [truth, row]) =>
      [good + (row[truth] ?? 0), all + Object.values(row).reduce((a, b) => a + b, 0)], [0, 0]);
    write("right", all ? `${good} of ${all}` : "—");
    const novelty = state.prediction?.novelty ?? null;
    write("novelty", novelty === null ? "—" : `${novelty.toFixed(2)} ${novelty > 1 ? "(too far)" : "of 1"}`);
    const peak = state.take?.peak_dbfs;
    const bar = byId("level-bar");
    bar.firstChild.style.width = `${Math.max(0, Math.min(100, 100 * (1 + (peak ?? -60) / 60)))}%`;
    bar.classList.toggle("loud", (state.take?.clipped ?? 0) > 0);
    write("level", peak === undefined ? "—" :
      `${peak.toFixed(1).replace("-", "−")} dBFS${state.take.clipped ? `, ${state.take.clipped} clipped` : ""}`);
    write("dropouts", `${state.xruns}, ${state.retakes}`);
    const { ratio, text } = state.drift ?? {};
    write("drift", ratio === undefined || ratio === null ? text || "—" :
      `${ratio.toFixed(2)} of the alarm${ratio > 1 ? " ⚠" : ""}`);
  }

  function fate(grasp, last) {
    if (grasp.action === "wait") return ["open", "∅", "nothing held"];
    if (!grasp.outcome && !last) return ["open", "–", "not sorted"];
    if (!grasp.outcome) return ["open", "…", grasp.action === "again" ? "grasped again" : "in the gripper"];
    if (grasp.outcome === UNSURE) return ["open", "?", "not sorted by itself"];
    if (!grasp.truth) return ["", "●", "sorted, truth unknown"];
    return grasp.truth === grasp.outcome ? ["right", "✓", "right"] : ["wrong", "✗", `wrong, it was ${words(grasp.truth)}`];
  }
  function showGrasps(state) {
    const made = () => element("li", "", element("div", "", element("span", "top", element("span"), element("b")), element("span"), element("span")));
    const items = filled(byId("grasps"), state.grasps.length, made);
    items.forEach((item, i) => {
      const grasp = state.grasps[i], tile = item.firstChild;
      const [look, mark, told] = fate(grasp, i === state.grasps.length - 1 && !state.stopped);
      const what = grasp.value === null ? "" : value(grasp.value, state.plan.unit);
      const sure = grasp.probability === null ? "" : percent(grasp.probability);
      tile.className = look;
      tile.setAttribute("role", "img");
      tile.setAttribute("aria-label", `Grasp ${grasp.number}: ${what} ${sure}, ${told}`);
      tile.title = `${what} ${sure}, ${told}`;
      const [top, name, more] = tile.children;
      top.children[0].textContent = grasp.number;
      top.children[1].textContent = mark;
      name.textContent = what || " ";
      more.textContent = sure || " ";
    });
  }

  function showBins(state) {
    const bins = new Map();
    for (const [name, bin] of Object.entries(state.plan.bins ?? {}))
      bins.set(bin, [...(bins.get(bin) ?? []), name]);
    for (const bin of Object.keys(state.bins)) if (!bins.has(bin)) bins.set(bin, []);
    const rows = [...bins].map(([bin, names]) => {
      const about = names.filter((name) => name !== bin).map(words).join(", ");
      const row = element("li", "", element("span", "", words(bin) || "no bin", element("small", "", about)), element("b", "", String(state.bins[bin] ?? 0)));
      row.dataset.bin = bin;
      return row;
    });
    byId("bins").replaceChildren(...rows);
  }

  function showConfusion(state) {
    const truths = Object.keys(state.confusion).sort((a, b) => (a === OTHERS) - (b === OTHERS) || (a < b ? -1 : 1));
    const found = new Set(truths.flatMap((truth) => Object.keys(state.confusion[truth])));
    const columns = [...(state.plan.classes ?? []).filter((name) => found.has(name) || truths.includes(name)),
      ...[OTHERS, UNSURE].filter((name) => found.has(name))];
    byId("no-truth").hidden = truths.length > 0;
    byId("confusion-head").parentElement.querySelector(".scroll").hidden = !truths.length;
    const head = columns.map((name) => { const cell = element("th", "", words(name)); cell.scope = "col"; return cell; });
    byId("decided").replaceChildren(element("td"), ...head);
    byId("truths").replaceChildren(...truths.map((truth) => {
      const label = element("th", "", words(truth));
      label.scope = "row";
      return element("tr", "", label, ...columns.map((name) => {
        const count = state.confusion[truth][name] ?? 0;
        return element("td", !count || name === UNSURE ? "" : name === truth ? "right" : "wrong", count ? String(count) : "·");
      }));
    }));
  }

  function showProblems(state) {
    byId("problems").parentElement.hidden = !state.problems.length;
    filled(byId("problems"), state.problems.length, () => element("li"))
      .forEach((row, i) => { row.textContent = state.problems[i]; });
  }

  const GO = { running: "❚❚ Pause", paused: "▶ Go on", stopped: "ended" };
  function showControls(state) {
    document.body.dataset.mode = state.mode;
    write("go-label", GO[state.mode] ?? "");
    byId("go").disabled = !token || state.mode === "stopped";
    byId("halt").disabled = !token || state.mode === "stopped";
    const { dataset, task, model, device, robot, session } = state.plan;
    write("title", dataset ? `${dataset}/${task}` : "Live run");
    document.title = dataset ? `${dataset}/${task}: live run` : "Live run";
    write("setup", [model, device, robot && `robot ${robot}`, session].filter(Boolean).map(words).join(" · "));
    const badge = byId("source");
    badge.hidden = !state.plan.source;
    badge.className = `badge ${state.plan.source ?? ""}`;
    write("source", state.plan.source ?? "");
  }

  // What a person has to know, the worst first; it stays until it is no longer so.
  let undelivered = "";
  function showNotice() {
    const connection = document.body.dataset.connection;
    const said = undelivered ||
      (connection === "lost" ? "Connection lost: what stands here is old, and the run may go on. Stop it at the terminal with Ctrl-C." : "") ||
      (state?.drift?.text ? `Drift: ${state.drift.text}` : "") ||
      (state && !token && state.mode !== "stopped" ? "Watching only. To control the run, open the whole address that the terminal shows." : "");
    byId("notice").hidden = !said;
    write("notice", said);
  }

  function show(found) {
    state = found;
    for (const part of [showControls, showVerdict, showBars, showSpectrum, showFacts, showGrasps, showBins, showConfusion, showProblems])
      part(state);
    document.body.dataset.n = state.n;
    showNotice();
  }

  function connect() {
    source?.close();
    source = new EventSource("events");
    const alive = () => { heard = Date.now(); connected("live"); };
    source.addEventListener("state", (event) => { show(JSON.parse(event.data)); alive(); });
    source.addEventListener("alive", alive);
    source.addEventListener("error", () => {
      connected("lost");
      if (state?.mode === "stopped") source.close();
    });
  }
  const SAID = { live: "live", lost: "connection lost", ended: "the run has ended", connecting: "connecting …" };
  function connected(how) {
    const shown = state?.mode === "stopped" && how !== "connecting" ? "ended" : how;
    if (document.body.dataset.connection === shown) return;
    document.body.dataset.connection = shown;
    write("connection", SAID[shown]);
    showNotice();
  }
  setInterval(() => {
    if (document.hidden || state?.mode === "stopped") return;
    if (heard && Date.now() - heard > SILENT_MS) connected("lost");
    if (source.readyState === EventSource.CLOSED) connect();  // refused, e.g. too many pages
  }, 1000);
  // A browser has six connections to one server: pages that nobody sees leave theirs to others.
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) source.close();
    else { heard = Date.now(); connect(); }
  });

  async function ask(what) {
    let problem = "";
    // A browser has so many connections to one server: a stop that waits for one gets that of this
    // page's stream. It is sent even if the page is closed; no answer in time is told.
    const waits = what === "stop" && setTimeout(() => source.close(), YIELD_MS);
    try {
      const given = { keepalive: true, signal: AbortSignal.timeout(ANSWER_MS) };
      const answer = await fetch(what, { method: "POST", headers: { "X-Ajgdata-Token": token }, ...given });
      if (!answer.ok) problem = (await answer.text()).trim();
    } catch {
      problem = "nobody answers";
    } finally {
      clearTimeout(waits);
    }
    undelivered = problem && `${what} was not done: ${problem}.${what === "stop" ? " Press Ctrl-C at the terminal, or the robot's own button." : ""}`;
    showNotice();
  }
  const go = () => { if (!byId("go").disabled) ask(state.mode === "running" ? "pause" : "start"); };
  const halt = () => { if (!byId("halt").disabled) ask("stop"); };
  byId("go").addEventListener("click", go);
  byId("halt").addEventListener("click", halt);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Escape") {
      event.preventDefault();
      if (!event.repeat) halt();
    } else if (event.key === " " && !event.target.closest("button, [tabindex]")) {
      event.preventDefault();
      if (!event.repeat) go();
    }
  });
  byId("halt").disabled = !token;  // before the first state, and if none ever comes
  addEventListener("resize", () => { if (state) showSpectrum(state); });
  connect();
})();
