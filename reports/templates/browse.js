// The page of `ajgdata browse`. The server filters and sorts; the page shows and plays.
import {
  MAX_CLASSES, classColour, classMark, coordinatesAt, drawDifference, drawScatter, drawSpectrogram, drawSpectrum,
  drawWaveform, pointAt, positionAt,
} from "./browse_plots.js";

const byId = (id) => document.getElementById(id);
const ROW_HEIGHT = 26;  // --row of the style sheet
const EXTRA_ROWS = 20;  // rows above and below the visible part of the table
const MAX_ROWS = 500;  // of one request
const TYPING_MS = 80;

// What the address of the page holds.
const KEYS = ["filter", "sort", "predictions", "plane", "recording"];
const state = Object.fromEntries(KEYS.map((key) => [key, new URLSearchParams(location.search).get(key) ?? ""]));

let order = [];  // numbers of the recordings of the table, from the top
let columns = [];
let version = null;
let rows = new Map();  // cells and level of recordings by number
let requested = new Set();
let points = null;
let shown = null;  // the selected recording as the server describes it
let selected = null;  // its number
let about = null;
const token = location.hash.slice(1);  // permits decisions

function element(tag, classes, ...children) {
  const created = document.createElement(tag);
  if (classes) created.className = classes;
  created.append(...children);
  return created;
}

async function request(path, parameters = {}) {
  const query = new URLSearchParams({ predictions: state.predictions, plane: state.plane, ...parameters });
  let answer;
  try {
    answer = await fetch(`${path}?${query}`);
  } catch {
    throw new Error("The server does not answer: `ajgdata browse` has ended. Start it again.");
  }
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

// Shows a problem until the next step of the same kind: a filter, a decision, or another request.
function report(error, kind = "request") {
  const place = byId("problem");
  if (!error && place.dataset.kind !== kind) return;
  place.textContent = error ? error.message : "";
  place.dataset.kind = kind;
  place.hidden = !error;
}

function remember() {
  const query = new URLSearchParams(KEYS.filter((key) => state[key]).map((key) => [key, state[key]]));
  history.replaceState(null, "", `${query.size ? `?${query}` : location.pathname}${location.hash}`);
}

// ---- table ----

let latest = 0;
async function loadTable() {
  remember();
  const turn = ++latest;
  let table;
  try {
    table = await request("table", { filter: state.filter, sort: state.sort });
  } catch (error) {
    byId("filter").setAttribute("aria-invalid", "true");
    report(error, "filter");
    return;
  }
  if (turn !== latest) return;  // a later filter has been typed
  byId("filter").removeAttribute("aria-invalid");
  report(null, "filter");
  order = table.order;
  columns = table.columns;
  forget(table.version);
  const total = table.total.toLocaleString("en");
  byId("count").textContent = order.length === table.total ? `${total} recordings`
    : `${order.length.toLocaleString("en")} of ${total} recordings`;
  if (table.remarks.length) byId("hint").textContent = table.remarks.join("; ");
  showHead();
  showToggles();
  showRows();
  showScatter();
}

function forget(newVersion) {
  if (version !== newVersion) {  // the numbers are those of other recordings
    points = null;
    rows = new Map();
  }
  version = newVersion;
  requested = new Set();  // cells are shown until new ones come
}

function showHead() {
  const heads = columns.map((column) => {
    const isSorted = state.sort.replace(/^-/, "") === column.name;
    const arrow = !isSorted ? "" : state.sort.startsWith("-") ? " ▼" : " ▲";
    const unit = column.unit ? ` (${column.unit})` : "";
    const button = element("button", "", `${column.name.replaceAll("_", " ")}${unit}${arrow}`);
    button.type = "button";
    button.dataset.column = column.name;
    const head = element("th", "", button);
    if (isSorted) head.ariaSort = state.sort.startsWith("-") ? "descending" : "ascending";
    return head;
  });
  byId("table").tHead.rows[0].replaceChildren(...heads);
  byId("table").setAttribute("aria-rowcount", order.length + 1);
}

function sortBy(name) {
  const first = columns.find((column) => column.name === name).is_number ? `-${name}` : name;
  const second = first === name ? `-${name}` : name;
  state.sort = state.sort === first ? second : state.sort === second ? "" : first;
  loadTable().then(() => byId("table").querySelector(`[data-column="${CSS.escape(name)}"]`)?.focus());
}

function showRows() {
  const scroll = byId("scroll");
  const first = Math.max(0, Math.floor(scroll.scrollTop / ROW_HEIGHT) - EXTRA_ROWS);
  const after = Math.min(order.length, Math.ceil((scroll.scrollTop + scroll.clientHeight) / ROW_HEIGHT) + EXTRA_ROWS);
  const visible = [];
  for (let place = first; place < after; place++) visible.push(rowAt(place));
  byId("table").tBodies[0].replaceChildren(space(first), ...visible, space(order.length - after));
  for (const head of byId("table").tHead.rows[0].cells)  // columns do not get narrower during scrolling
    head.style.minWidth = `${head.offsetWidth}px`;
  fetchRows(order.slice(first, after));
}

function space(count) {
  const cell = element("td", "");
  cell.colSpan = Math.max(1, columns.length);
  cell.style.height = `${count * ROW_HEIGHT}px`;
  const row = element("tr", "space", cell);
  row.hidden = !count;
  row.ariaHidden = "true";
  return row;
}

function rowAt(place) {
  const number = order[place];
  const row = element("tr", "");
  row.dataset.number = number;
  row.ariaRowIndex = place + 2;
  row.classList.toggle("selected", number === selected);
  const content = rows.get(number);
  if (!content) {
    row.append(...columns.map(() => element("td", "", " ")));
    return row;
  }
  const { cells, level } = content;
  if (cells.wrong) row.classList.add(cells.wrong === "yes" ? "wrong" : "right");
  row.classList.toggle("rejected", cells.quality === "reject");
  row.append(...columns.map((column) => {
    const value = cells[column.name];
    const text = column.name === "recording" ? value.slice(value.indexOf("/") + 1) : cellText(value);
    const cell = element("td", column.is_number ? "number" : column.name, text);
    if (column.name === "issue") cell.className = `issue ${level}`;
    if (text.length > 24) cell.title = text;
    return cell;
  }));
  return row;
}

function cellText(value, digits = 3) {
  if (value === null || value === undefined) return "";
  if (typeof value !== "number" || Number.isInteger(value)) return String(value);
  return String(Number(value.toPrecision(Math.abs(value) < 1000 ? digits : 7)));
}

async function fetchRows(numbers) {
  const missing = numbers.filter((number) => !requested.has(number)).slice(0, MAX_ROWS);
  if (!missing.length) return;
  missing.forEach((number) => requested.add(number));
  const before = version;
  try {
    const answer = await request("rows", { numbers: missing.join(",") });
    if (version !== before) return;
    if (answer.version !== version) { loadTable(); return; }  // the data changed
    for (const [number, row] of Object.entries(answer.rows)) rows.set(Number(number), row);
    showRows();
  } catch (error) {
    report(error);
  }
}

// ---- selection ----

function move(steps) {
  if (!order.length) return;
  const place = order.indexOf(selected);
  const next = place < 0 ? 0 : Math.min(order.length - 1, Math.max(0, place + steps));
  select(order[next]);
}

function reveal() {
  const place = order.indexOf(selected);
  if (place < 0) return;
  const scroll = byId("scroll");
  const head = byId("table").tHead.offsetHeight;
  const top = place * ROW_HEIGHT;
  if (top < scroll.scrollTop) scroll.scrollTop = top;
  const overlap = top + ROW_HEIGHT + head + 4 - scroll.scrollTop - scroll.clientHeight;
  if (overlap > 0) scroll.scrollTop += overlap;
}

let pending = 0;
async function select(number) {
  selected = number;
  if (shown?.number !== number) byId("form").hidden = true;  // it is about another recording
  showDecidable();
  reveal();
  showRows();
  const turn = ++pending;
  let name = rows.get(number)?.cells.recording;
  if (!name) name = (await request("rows", { numbers: number })).rows[number]?.cells.recording;
  if (turn === pending && name) await open(name, turn);
}

async function open(name, turn = ++pending, channel = "") {
  try {
    const content = await request("recording", { recording: name, channel });
    if (turn !== pending) return;  // another recording has been selected
    shown = content;
    report(null);
    selected = content.number;
    state.recording = name;
    remember();
    reveal();
    showRows();
    showDetail();
    showDecidable();
    showScatter();
    if (byId("auto").checked) play(byId("audio"));
  } catch (error) {
    report(error);
  }
}

const percent = (share) => share >= 0.995 && share < 1 ? "> 99 %" : `${(100 * share).toFixed(0)} %`;

function showDetail() {
  const { cells, sound, spectrum, session } = shown;
  byId("nothing").hidden = true;
  byId("detail").hidden = false;
  byId("name").textContent = shown.name;
  showSummary(cells);
  showDecisions();
  byId("reasons").replaceChildren(...shown.reasons.map((reason) => element("li", "warning", element("b", "", "suspicious"), ` ${reason}`)));
  byId("own-issues").replaceChildren(...[...shown.issues, ...shown.of_session].map(issueItem));
  byId("player").hidden = !sound;
  byId("no-sound").hidden = Boolean(sound);
  byId("no-sound").textContent = shown.problem ? `No sound: ${shown.problem}.` : "";
  if (sound) showSound(sound, session);
  byId("no-spectrum").hidden = !spectrum.note;
  byId("no-spectrum").textContent = spectrum.note;
  for (const id of ["spectrum", "difference", "difference-head", "lines"]) byId(id).hidden = Boolean(spectrum.note);
  if (!spectrum.note) {
    byId("lines").replaceChildren(...spectrum.lines.map((line) => element("span", line.role, line.title)));
    byId("spectrum").ariaLabel = `Spectrum: ${spectrum.lines.map((line) => line.title).join("; ")}`;
  }
  showLabels();
  byId("notes").textContent = session.notes ? `Notes of the session: ${session.notes}` : "";
  draw();
}

// Cells that are coordinates of the map, or the title.
const HIDDEN = ["recording", "x", "y"];
function showLabels() {
  const { gripper, medium, device } = shown.session;
  const labels = { ...shown.cells, file: shown.file, gripper, medium, device };
  byId("labels").replaceChildren(...Object.entries(labels)
    .filter(([key, value]) => cellText(value) !== "" && !HIDDEN.includes(key))
    .map(([key, value]) => element("div", "", element("dt", "", key.replaceAll("_", " ")), element("dd", "", cellText(value, 6)))));
}

function showSummary(cells) {
  const parts = [`label ${cellText(cells.label) || "missing"}`];
  if (cells.predicted !== undefined && cells.predicted !== null && cells.predicted !== "") {
    const look = cells.wrong === "yes" ? "wrong" : cells.wrong === "no" ? "right" : "";
    const sign = { wrong: "✗ ", right: "✓ " }[look] ?? "";
    const confidence = typeof cells.confidence === "number" ? ` (${percent(cells.confidence)})` : "";
    parts.push(", predicted ", element("b", look, `${sign}${cellText(cells.predicted)}${confidence}`));
  }
  if (typeof cells.error === "number") parts.push(`, error ${cellText(cells.error)}`);
  if (typeof cells.novelty === "number") parts.push(` · novelty ${cells.novelty.toFixed(2)} (usual: 1)`);
  if (cells.quality && cells.quality !== "ok") parts.push(` · quality ${cells.quality}`);
  byId("summary").replaceChildren(...parts);
}

function issueItem(issue) {
  const where = issue.recording_id === "*" ? "session or data set: " : "";
  return element("li", issue.level, element("b", "", `${issue.level} ${issue.code}`), ` ${where}${issue.problem}. Fix: ${issue.fix}`);
}

// ---- sound ----

function showSound(sound, session) {
  const query = new URLSearchParams({ recording: shown.name, channel: sound.channel });
  const audio = byId("audio");
  audio.pause();
  audio.src = `sound.wav?${query}`;
  const level = sound.peak_dbfs === null ? "silent" : `peak ${sound.peak_dbfs.toFixed(1).replace("-", "−")} dBFS`;
  byId("sound-facts").textContent = `${sound.seconds.toFixed(2)} s, ${sound.rate_hz} Hz, ${level}`;
  byId("channel-label").hidden = sound.channels < 2;
  byId("channel").replaceChildren(...Array.from({ length: sound.channels }, (_, i) => {
    const option = element("option", "", `${i + 1} of ${sound.channels}`);
    option.value = i + 1;
    option.selected = i + 1 === sound.channel;
    return option;
  }));
  byId("play-played").hidden = !session.played;
  byId("play-played").title = session.played ?? "";
  const played = new URLSearchParams({ session: session.name });
  if (session.played) byId("audio-played").src = `played.wav?${played}`;
}

function play(audio) {
  const other = byId(audio.id === "audio" ? "audio-played" : "audio");
  other.pause();
  if (audio.paused) audio.play().catch((error) => { if (error.name !== "AbortError") report(error); });
  else audio.pause();
}

function progress() {
  const audio = byId("audio");
  byId("play").firstChild.textContent = audio.paused ? "▶ play " : "❚❚ pause ";
  if (shown?.sound) drawWaveform(byId("waveform"), shown.sound, audio.duration ? audio.currentTime / audio.duration : 0);
  if (!audio.paused) requestAnimationFrame(progress);
}

function draw() {
  if (!shown) return;
  if (shown.sound) {
    progress();
    drawSpectrogram(byId("spectrogram"), shown.sound);
  }
  if (shown.spectrum.note) return;
  drawSpectrum(byId("spectrum"), shown.spectrum);
  for (const id of ["difference", "difference-head"]) byId(id).hidden = shown.spectrum.lines.length < 2;
  if (shown.spectrum.lines.length > 1) drawDifference(byId("difference"), shown.spectrum);
}

// ---- decisions ----

function showDecisions() {
  const readOnly = about.read_only || (token ? "" : "To decide, open the complete address that the terminal shows.");
  byId("decide").hidden = Boolean(readOnly) || !shown.state;
  byId("read-only").hidden = !readOnly;
  byId("read-only").textContent = about.read_only ? `The data set ${about.read_only}.` : readOnly;
  if (askedAbout !== shown.name) byId("form").hidden = true;  // a form that a person has opened meanwhile stays
  const changed = Object.entries(shown.state?.changed ?? {}).map(([column, text]) => `recordings.csv: ${column} ${text || "empty"}`);
  byId("history").replaceChildren(...[...(shown.state?.history ?? []), ...changed].map((text) => element("li", "", text)));
}

// What a form asks for, by action. All other actions are sent at once.
const FORMS = {
  reject: { title: "Reject this recording", fields: ["reason"] },
  label: { title: "Another label", fields: ["column", "value", "reason"], value: "Label" },
  note: { title: "Note", fields: ["value"], value: "Text" },
};
let asked = "";
let askedAbout = "";
let isSending = false;

// A decision is about the recording that a person sees, so it waits for the details of the selected one.
const isDecidable = () => shown?.number === selected && !isSending;

function showDecidable() {
  for (const button of byId("decide").querySelectorAll("button")) button.disabled = !isDecidable();
}

function decide(action) {
  if (byId("decide").hidden || !isDecidable()) return;
  if (!FORMS[action]) { send({ action }); return; }
  asked = action;
  askedAbout = shown.name;
  const { title, fields, value } = FORMS[action];
  byId("form-title").textContent = title;
  for (const field of ["column", "value", "reason"]) {
    byId(`${field}-label`).hidden = !fields.includes(field);
    byId(field).value = "";
  }
  byId("value-name").textContent = value ?? "";
  byId("column").replaceChildren(...Object.keys(about.label_columns).map((name) => element("option", "", name)));
  if (shown.target in about.label_columns) byId("column").value = shown.target;
  propose();
  byId("form").hidden = false;
  byId(fields.includes("value") ? "value" : "reason").focus();
}

function propose() {
  const column = byId("column").value;
  const texts = asked === "label" ? about.label_columns[column] ?? [] : [];
  byId("values").replaceChildren(...texts.map((text) => { const option = element("option", ""); option.value = text; return option; }));
  byId("value").placeholder = asked === "label" ? shown.state.labels[column] ?? "" : "";
}

function closeForm() {
  byId("form").hidden = true;
  byId("scroll").focus({ preventScroll: true });
}

async function send(decision) {
  if (!isDecidable()) return;
  isSending = true;
  showDecidable();
  try {
    await sendDecision(decision);
  } catch (error) {
    report(error);
  } finally {
    isSending = false;
    showDecidable();
  }
}

// Decisions after which a recording is no longer in the review list.
const REVIEWED = ["ok", "reject", "label"];
async function sendDecision(decision) {
  const { name, number } = shown;
  const place = order.indexOf(number);
  const turn = pending;
  const body = JSON.stringify({ recording: name, version: shown.state.version, ...decision });
  let answer;
  try {
    answer = await fetch("change", { method: "POST", body, headers: { "X-Ajgdata-Token": token } });
  } catch {
    report(new Error("The decision was not saved: the server does not answer."), "decision");
    return;
  }
  const text = await answer.text();
  if (!answer.ok) {
    report(new Error(`The decision was not saved: ${text}.`), "decision");
    if (answer.status === 409 && turn === pending) await open(name);  // shows what the other person decided
    return;
  }
  report(null, "decision");
  closeForm();
  about = await request("about");
  await loadTable();
  const isNext = state.sort === "-suspicion" && REVIEWED.includes(decision.action);
  if (turn === pending) {  // no other recording has been selected meanwhile
    if (!order.length || (order.includes(number) && !isNext)) await open(name);
    else await select(order[Math.min(Math.max(place, 0), order.length - 1)]);
  }
  byId("decided").textContent = `saved: ${name.slice(name.indexOf("/") + 1)}, ${text}`;
  loadPoints();
}

// ---- map ----

async function loadPoints() {
  try {
    const loaded = await request("points");
    byId("map").hidden = !loaded.x.length;
    points = loaded.x.length ? loaded : null;
    if (!points) return;
    byId("plane").value = points.plane;
    if (points.version === version) { requested = new Set(); showRows(); }  // novelty is known now
    else await loadTable();
    await refreshCells();
    byId("classes").replaceChildren(...points.classes.length > MAX_CLASSES ? [] :
      points.classes.map((name, number) => classKey(name, number)));
    showScatter();
  } catch (error) {
    report(error);
  }
}

// Shows the values of features, which the recording did not have when it was opened.
async function refreshCells() {
  if (!shown) return;
  const row = (await request("rows", { numbers: shown.number })).rows[shown.number];
  if (!row || row.cells.recording !== shown.name) return;
  shown.cells = row.cells;
  showSummary(row.cells);
  showLabels();
}

function classKey(name, number) {
  const mark = element("b", "", `${classMark(number)} `);
  mark.style.color = classColour(number);
  return element("span", "", mark, name || "no class");
}

let box = null;
// Draws the map after the table is on the screen: many points take a tenth of a second.
let waiting = 0;
function showScatter() {
  cancelAnimationFrame(waiting);
  waiting = requestAnimationFrame(() => setTimeout(() => {
    if (points) drawScatter(byId("scatter"), points, new Set(order), selected, box);
  }));
}

const placeOf = (event) => {
  const area = byId("scatter").getBoundingClientRect();
  return { x: event.clientX - area.left, y: event.clientY - area.top };
};

function boxFilter() {
  const [left, bottom] = coordinatesAt(byId("scatter"), points, box.x, box.y + box.height);
  const [right, top] = coordinatesAt(byId("scatter"), points, box.x + box.width, box.y);
  const words = [`x>=${left.toPrecision(4)}`, `x<=${right.toPrecision(4)}`, `y>=${bottom.toPrecision(4)}`, `y<=${top.toPrecision(4)}`];
  const kept = filterWords().filter((word) => !/^[xy][<>]=/.test(word));
  setFilter([...kept, ...words].join(" "));
}

// ---- controls ----

function setFilter(text) {
  state.filter = text;
  byId("filter").value = text;
  byId("scroll").scrollTop = 0;
  return loadTable();
}

// Buttons that add a word to the filter or remove it.
const TOGGLES = { wrong: "wrong=yes", issues: "issue!=" };
const filterWords = () => state.filter.match(/("[^"]*"|[^\s"])+/g) ?? [];  // as the server splits it
function toggle(word) {
  const words = filterWords();
  setFilter((words.includes(word) ? words.filter((other) => other !== word) : [...words, word]).join(" "));
}
function showToggles() {
  for (const [id, word] of Object.entries(TOGGLES)) byId(id).ariaPressed = String(filterWords().includes(word));
  byId("suspicious").ariaPressed = String(state.sort === "-suspicion");
  byId("suspicious").hidden = !columns.some((column) => column.name === "suspicion");
  byId("wrong").hidden = !columns.some((column) => column.name === "wrong");
}

const ACTIONS = {
  j: () => move(1), ArrowDown: () => move(1), k: () => move(-1), ArrowUp: () => move(-1),
  PageDown: () => move(10), PageUp: () => move(-10), Home: () => move(-order.length), End: () => move(order.length),
  " ": () => play(byId("audio")),
  p: () => { if (!byId("play-played").hidden) play(byId("audio-played")); },
  "/": () => byId("filter").select(),
  w: () => byId("wrong").click(),
  i: () => byId("issues").click(),
  s: () => byId("suspicious").click(),
  o: () => decide("ok"), r: () => decide("reject"), l: () => decide("label"), n: () => decide("note"), u: () => decide("undo"),
  "?": () => byId("keys").showModal(),
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || byId("keys").open) return;
  const target = event.target;
  if (target.matches("input:not([type=checkbox]), select, textarea")) {
    if (event.key === "Escape" && byId("form").contains(target)) closeForm();
    else if (event.key === "Escape" || (event.key === "Enter" && target.id === "filter")) {
      event.preventDefault();
      byId("scroll").focus();
    }
    return;
  }
  if (event.key === " " && target.matches("button, input")) return;  // the key of the button itself
  const action = ACTIONS[event.key];
  if (!action) return;
  event.preventDefault();
  action();
});

let typing = 0;
byId("filter").addEventListener("input", (event) => {
  clearTimeout(typing);
  typing = setTimeout(() => setFilterTyped(event.target.value), TYPING_MS);
});
function setFilterTyped(text) {
  state.filter = text;
  byId("scroll").scrollTop = 0;
  loadTable();
}
for (const [id, word] of Object.entries(TOGGLES)) byId(id).addEventListener("click", () => toggle(word));
byId("suspicious").addEventListener("click", async () => {
  byId("count").textContent = "computing the review list …";
  state.sort = state.sort === "-suspicion" ? "" : "-suspicion";
  byId("scroll").scrollTop = 0;
  await loadTable();
  if (order.length) select(order[0]);
});
byId("decide").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) decide(button.dataset.action);
});
byId("form").addEventListener("submit", (event) => {
  event.preventDefault();
  const values = Object.fromEntries(FORMS[asked].fields.map((field) => [field, byId(field).value]));
  send({ action: asked, ...values });
});
byId("cancel").addEventListener("click", closeForm);
byId("column").addEventListener("change", propose);
byId("help").addEventListener("click", () => byId("keys").showModal());
byId("play").addEventListener("click", () => play(byId("audio")));
byId("play-played").addEventListener("click", () => play(byId("audio-played")));
for (const name of ["play", "pause", "ended", "seeked"]) byId("audio").addEventListener(name, progress);
byId("channel").addEventListener("change", (event) => open(shown.name, ++pending, event.target.value));
byId("waveform").addEventListener("click", (event) => {
  const audio = byId("audio");
  const share = positionAt(byId("waveform"), event);
  const seek = () => { audio.currentTime = share * audio.duration; };
  if (audio.readyState) { seek(); return; }
  audio.addEventListener("loadedmetadata", seek, { once: true });
  audio.load();
});
byId("table").tHead.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) sortBy(button.dataset.column);
});
byId("table").tBodies[0].addEventListener("click", (event) => {
  const row = event.target.closest("tr[data-number]");
  if (row) select(Number(row.dataset.number));
});
byId("scroll").addEventListener("scroll", showRows);
byId("predictions").addEventListener("change", async (event) => {
  state.predictions = event.target.value;
  await loadTable();
  await loadPoints();
  if (shown) open(shown.name);
});
byId("plane").addEventListener("change", (event) => {
  state.plane = event.target.value;
  remember();
  loadPoints();
});
byId("scatter").addEventListener("pointerdown", (event) => {
  const from = placeOf(event);
  box = { ...from, width: 0, height: 0 };
  byId("scatter").setPointerCapture(event.pointerId);
  byId("scatter").onpointermove = (moved) => {
    const to = placeOf(moved);
    box = {
      x: Math.min(from.x, to.x), y: Math.min(from.y, to.y),
      width: Math.abs(to.x - from.x), height: Math.abs(to.y - from.y),
    };
    showScatter();
  };
});
byId("scatter").addEventListener("pointerup", () => {
  byId("scatter").onpointermove = null;
  const drawn = box;
  if (!drawn || !points) return;
  if (Math.max(drawn.width, drawn.height) > 8) boxFilter();
  else {
    const found = pointAt(byId("scatter"), points, order, drawn.x, drawn.y);
    if (found !== null) select(found);
  }
  box = null;
  showScatter();
});
let resizing = 0;
addEventListener("resize", () => {
  cancelAnimationFrame(resizing);
  resizing = requestAnimationFrame(() => { showRows(); draw(); showScatter(); });
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { draw(); showScatter(); });

function showAbout() {
  byId("title").textContent = about.title;
  document.title = `${about.dataset}: recordings`;
  byId("source").textContent = about.source;
  byId("source").className = `badge ${about.source}`;
  byId("source").hidden = false;
  byId("hint").textContent = about.without_issues;
  const options = (items, text) => items.map((item) => {
    const option = element("option", "", text(item));
    option.value = item.name;
    return option;
  });
  byId("predictions").replaceChildren(...options(about.predictions, (item) => item.has_model ? item.name : `${item.name.replace(/\/$/, "")} (no predictions yet)`));
  byId("predictions").parentElement.hidden = !about.predictions.length;
  if (state.predictions) byId("predictions").value = state.predictions;
  byId("plane").replaceChildren(...options(about.planes, (item) => item.title));
}

async function start() {
  byId("filter").value = state.filter;
  try {
    about = await request("about");
    showAbout();
  } catch (error) {
    report(error);
  }
  await loadTable();
  if (state.recording) await open(state.recording);
  else if (order.length) await select(order[0]);
  byId("scroll").focus({ preventScroll: true });
  await loadPoints();
  document.body.dataset.ready = "yes";
}
start();
