"use strict";
(() => {
  const UNSURE = "unsure";  // as live/events.py has it
  const SILENT_MS = 6000;  // three heartbeats
  const ANSWER_MS = 5000, YIELD_MS = 500;
  const byId = (id) => document.getElementById(id);
  const token = location.hash.slice(1);
  const percent = (p) => p < 1 && p >= 0.995 ? "> 99 %" : `${(100 * p).toFixed(0)} %`;
  const words = (name) => String(name).replaceAll("_", " ");
  let state = null, lastSignMs = 0, source = null;

  // Writes only changes: screen readers announce changes, and the focus is kept.
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
    const created = document.createElement(tag);
    if (classes) created.className = classes;
    created.append(...children);
    return created;
  }
  function duration(seconds) {
    if (seconds === null || seconds === undefined) return "—";
    if (seconds < 90) return `${seconds.toFixed(seconds < 10 ? 1 : 0)} s`;
    const minutes = Math.floor(seconds / 60);
    return minutes < 90 ? `${minutes} min ${Math.floor(seconds % 60)} s` :
      `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  }

  // [class, mark, title, text below the title]
  function judged(state) {
    const { prediction, decision, plan } = state;
    const needed = plan.threshold ?? null;
    if (state.stopped) {
      const held = state.stopped.held ? `It still holds: ${words(state.stopped.held)}.` :
        "Nothing is held.";
      const [mark, title] = state.stopped.finished ? ["✓", "finished"] : ["■", "stopped"];
      return [state.stopped.held ? "alarm" : "", mark, title, `${state.stopped.reason} · ${held}`];
    }
    if (!prediction) return ["", "…", state.grasps.length ? "listening" : "no grasp yet", ""];
    const rate = prediction.detection_rate ?? null;
    const detects = rate === null ? "the detection rate of this check is not measured" :
      `this check detects ${percent(rate)} of novel objects`;
    const check = prediction.verdict === "not checked" ? " · novelty not checked" :
      prediction.verdict === "no sign" ? ` · no sign of a novel object (${detects})` :
      rate === null ? "" : ` · ${detects}`;
    const then = check + decided(state);
    if (prediction.verdict === "nothing")
      return ["unsure", "∅", "nothing held", `it sounds like the empty gripper${then}`];
    if (prediction.verdict === "unknown")
      return ["alarm", "!", "novel object", `novelty ${prediction.novelty.toFixed(2)}, limit 1${then}`];
    const [best, p] = Object.entries(prediction.probability ?? {}).reduce(
      (top, entry) => entry[1] > top[1] ? entry : top, [prediction.value, 0]);
    if (needed !== null && p < needed)
      return ["unsure", "?", "not sure",
        `best: ${words(best)} ${percent(p)}, needed ${percent(needed)}${then}`];
    return ["sure", "✓", words(decision?.value || best), `${percent(p)} sure${then}`];
  }
  const ACTIONS = {
    reject: "not sorted", stop: "stops",
    wait: "waits for an object",
  };
  function decided({ decision }) {
    if (!decision) return "";
    const into = decision.bin ? ` → bin ${words(decision.bin)}` : "";
    return ` · ${ACTIONS[decision.action] ?? ""}${into}`.replace("· → bin", "→ bin")
      .replace("·  → bin", "→ bin");
  }

  function showVerdict(state) {
    const [look, mark, title, more] = judged(state);
    byId("verdict").className = `verdict ${look}`;
    byId("verdict-title").parentElement.classList.toggle("long", title.length > 8);
    write("mark", mark);
    write("verdict-title", title);
    write("more", more);
    const last = state.grasps.at(-1);
    write("which", last ? `grasp ${last.number}` : "");
    write("step", state.step && !state.stopped ? `last step: ${state.step}` : "");
  }

  function showBars(state) {
    const given = state.prediction?.probability ?? {};
    const names = state.plan.classes ?? Object.keys(given);
    const needed = state.plan.threshold ?? null;
    const list = byId("bars");
    const best = Math.max(...names.map((name) => given[name] ?? 0), 0);
    const rows = filled(list, names.length, () => element("li", "", element("span", "name"),
      element("span", "track", element("i")), element("span", "percent")));
    list.classList.toggle("crowded", names.length > 8);
    list.classList.toggle("few", names.length <= 5);
    list.style.setProperty("--at", needed === null ? "-9rem" : `${100 * needed}%`);
    rows.forEach((row, i) => {
      const p = given[names[i]] ?? 0, first = p === best && p > 0;
      const enough = first && needed !== null && p >= needed && ["known", "no sign", "not checked"].includes(state.prediction?.verdict);
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

  function showFacts(state) {
    write("row", String(state.in_a_row));
    write("longest", String(state.longest));
    write("sorts", String(state.sorts));
    write("time", duration(state.seconds));
    write("mistakes", String(state.mistakes));
    const novelty = state.prediction?.novelty ?? null;
    write("novelty", novelty === null ? "—" : `${novelty.toFixed(2)}, limit 1`);
    const peak = state.take?.peak_dbfs;
    const bar = byId("level-bar");
    bar.firstChild.style.width = `${Math.max(0, Math.min(100, 100 * (1 + (peak ?? -60) / 60)))}%`;
    bar.classList.toggle("loud", (state.take?.clipped ?? 0) > 0);
    write("level", peak === undefined ? "—" :
      `${peak.toFixed(1).replace("-", "−")} dBFS${state.take.clipped ? `, ${state.take.clipped} clipped` : ""}`);
    write("drift", state.drift ? "⚠ the gripper has changed" : "no warning");
  }

  function fate(grasp, last) {
    if (grasp.action === "wait") return ["open", "∅", "nothing held"];
    if (!grasp.outcome && !last) return ["open", "–", "not sorted"];
    if (!grasp.outcome) return ["open", "…", "in the gripper"];
    if (grasp.outcome === UNSURE) return ["open", "?", "not sorted automatically"];
    if (!grasp.truth) return ["", "●", "sorted, truth unknown"];
    return grasp.truth === grasp.outcome ? ["right", "✓", "right"] : ["wrong", "✗", `wrong, it was ${words(grasp.truth)}`];
  }
  function showGrasps(state) {
    const newItem = () => element("li", "", element("div", "", element("span", "top", element("span"), element("b")), element("span"), element("span")));
    const items = filled(byId("grasps"), state.grasps.length, newItem);
    items.forEach((item, i) => {
      const grasp = state.grasps[i], tile = item.firstChild;
      const [look, mark, result] = fate(grasp, i === state.grasps.length - 1 && !state.stopped);
      const what = grasp.value === null ? "" : words(grasp.value);
      const sure = grasp.probability === null ? "" : percent(grasp.probability);
      tile.className = look;
      tile.setAttribute("role", "img");
      tile.setAttribute("aria-label", `Grasp ${grasp.number}: ${what} ${sure}, ${result}`);
      tile.title = `${what} ${sure}, ${result}`;
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

  function showProblems(state) {
    byId("problems").parentElement.hidden = !state.problems.length;
    filled(byId("problems"), state.problems.length, () => element("li"))
      .forEach((row, i) => { row.textContent = state.problems[i]; });
  }

  function showControls(state) {
    document.body.dataset.mode = state.mode;
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

  // Shows the most severe problem as long as it exists.
  let undelivered = "";
  function showNotice() {
    const connection = document.body.dataset.connection;
    const notice = undelivered ||
      (connection === "lost" ? "Connection lost: this page is not up to date, and the run may continue. Stop it at the terminal with Ctrl-C." : "") ||
      (state?.drift ? `Drift: ${state.drift}` : "") ||
      (state && !token && state.mode !== "stopped" ? "Watching only. To control the run, open the whole address that the terminal shows." : "");
    byId("notice").hidden = !notice;
    write("notice", notice);
  }

  function show(newState) {
    state = newState;
    for (const part of [showControls, showVerdict, showBars, showFacts, showGrasps, showBins, showProblems])
      part(state);
    document.body.dataset.n = state.n;
    showNotice();
  }

  function connect() {
    source?.close();
    source = new EventSource("events");
    const alive = () => { lastSignMs = Date.now(); connected("live"); };
    source.addEventListener("state", (event) => { show(JSON.parse(event.data)); alive(); });
    source.addEventListener("alive", alive);
    source.addEventListener("error", () => {
      connected("lost");
      if (state?.mode === "stopped") source.close();
    });
  }
  const CONNECTION_TEXT = { live: "live", lost: "connection lost", ended: "the run has ended", connecting: "connecting …" };
  function connected(how) {
    const shown = state?.mode === "stopped" && how !== "connecting" ? "ended" : how;
    if (document.body.dataset.connection === shown) return;
    document.body.dataset.connection = shown;
    write("connection", CONNECTION_TEXT[shown]);
    showNotice();
  }
  setInterval(() => {
    if (document.hidden || state?.mode === "stopped") return;
    if (lastSignMs && Date.now() - lastSignMs > SILENT_MS) connected("lost");
    if (source.readyState === EventSource.CLOSED) connect();  // refused, e.g. too many pages
  }, 1000);
  // A browser has six connections to one server, so hidden pages close their connection.
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) source.close();
    else { lastSignMs = Date.now(); connect(); }
  });

  async function halt() {
    if (byId("halt").disabled) return;
    let problem = "";
    // If all connections of the browser are in use, the stop command uses that of this page's stream.
    // It is sent even if the page is closed. The page reports a missing answer.
    const waits = setTimeout(() => source.close(), YIELD_MS);
    try {
      const given = { keepalive: true, signal: AbortSignal.timeout(ANSWER_MS) };
      const answer = await fetch("stop", { method: "POST", headers: { "X-Ajgdata-Token": token }, ...given });
      if (!answer.ok) problem = (await answer.text()).trim();
    } catch {
      problem = "no answer";
    } finally {
      clearTimeout(waits);
    }
    undelivered = problem && `the run was not stopped: ${problem}. Press Ctrl-C at the terminal, or the robot's own button.`;
    showNotice();
  }
  byId("halt").addEventListener("click", halt);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.key !== "Escape") return;
    event.preventDefault();
    if (!event.repeat) halt();
  });
  byId("halt").disabled = !token;  // before the first state, and if none ever comes
  connect();
})();
