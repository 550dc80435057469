"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const byId = (id) => document.getElementById(id);
  const content = JSON.parse(byId("content").textContent);
  const picture = byId("picture");
  const choices = { space: byId("space"), colour: byId("colour"), part: byId("part") };
  const sound = new Audio();
  const shownOnly = new Set();  // entries of the legend that are pressed
  let current = -1;

  const circles = content.recordings.map((name, index) => {
    const circle = document.createElementNS(NS, "circle");
    circle.id = `r${index}`;
    circle.dataset.index = index;
    circle.setAttribute("role", "option");
    circle.setAttribute("aria-label", [name, ...content.facts.map((f) => f.values[index])].join(", "));
    circle.setAttribute("r", 5);
    picture.append(circle);
    return circle;
  });
  const ring = document.createElementNS(NS, "circle");
  ring.setAttribute("r", 11);
  ring.setAttribute("class", "ring");
  picture.append(ring);

  const colouring = () => content.colours[choices.colour.value];
  const points = () => content.spaces[choices.space.value].points;
  const hidden = (index) => {
    const part = choices.part.value;
    if (part !== "all" && content.training[index] !== Number(part)) return true;
    return shownOnly.size > 0 && !shownOnly.has(colouring().entries[index]);
  };

  function place() {
    const at = points();
    circles.forEach((circle, i) => {
      circle.style.transform = `translate(${at[i][0]}px, ${at[i][1]}px)`;
    });
    mark();
  }

  function paint() {
    const { palette, entries } = colouring() ?? { palette: ["#0072B2"], entries: [] };
    circles.forEach((circle, i) => {
      const colour = palette[entries[i] ?? 0];
      circle.setAttribute("stroke", colour);
      circle.setAttribute("fill", content.training[i] ? colour : "#ffffff");
      circle.classList.toggle("hidden", hidden(i));
    });
    if (current >= 0 && hidden(current)) select(-1);
  }

  function legend() {
    const box = byId("legend");
    box.replaceChildren();
    shownOnly.clear();
    const { legend: names, range, palette } = colouring() ?? {};
    if (range) {
      const bar = document.createElement("span");
      bar.className = "bar";
      bar.style.background = `linear-gradient(to right, ${palette.slice(0, -1).join(", ")})`;
      box.append(range[0], bar, range[1]);
    }
    (names ?? []).forEach((name, entry) => {
      const button = document.createElement("button");
      const dot = document.createElement("i");
      dot.style.background = palette[entry];
      button.type = "button";
      button.setAttribute("aria-pressed", "false");
      button.append(dot, name);
      button.addEventListener("click", () => {
        const pressed = !shownOnly.delete(entry);
        if (pressed) shownOnly.add(entry);
        button.setAttribute("aria-pressed", String(pressed));
        paint();
      });
      box.append(button);
    });
  }

  function mark() {
    ring.classList.toggle("hidden", current < 0);
    if (current < 0) return;
    const [x, y] = points()[current];
    ring.style.transform = `translate(${x}px, ${y}px)`;
  }

  function select(index) {
    if (current >= 0) circles[current].removeAttribute("aria-selected");
    current = index;
    mark();
    const facts = byId("facts");
    facts.replaceChildren();
    if (index < 0) {
      picture.removeAttribute("aria-activedescendant");
      return;
    }
    circles[index].setAttribute("aria-selected", "true");
    picture.setAttribute("aria-activedescendant", circles[index].id);
    const rows = [["recording", content.recordings[index]]];
    content.facts.forEach((fact) => rows.push([fact.label, fact.values[index]]));
    rows.push(["network", content.training[index] ? "trained on it" : "did not see it"]);
    for (const [label, text] of rows) {
      const term = document.createElement("dt");
      const said = document.createElement("dd");
      term.textContent = label;
      said.textContent = text;
      facts.append(term, said);
    }
  }

  function silence() {
    sound.pause();
    picture.querySelector(".playing")?.classList.remove("playing");
    byId("state").textContent = "";
  }

  function play(index) {
    silence();
    if (index < 0) return;
    if (!content.clips[index]) {
      byId("state").textContent = "Its sound is not in this file.";
      return;
    }
    sound.src = `data:audio/mpeg;base64,${content.clips[index]}`;
    sound.volume = byId("volume").value;
    circles[index].classList.add("playing");
    byId("state").textContent = "Playing.";
    sound.play().catch((error) => {
      silence();
      byId("state").textContent = `Cannot be played here: ${error.message}`;
    });
  }

  // The nearest visible point within 45 degrees of the direction; sideways counts double.
  function neighbour(dx, dy) {
    const at = points();
    let best = current, least = Infinity;
    at.forEach(([x, y], i) => {
      if (i === current || hidden(i)) return;
      const along = (x - at[current][0]) * dx + (y - at[current][1]) * dy;
      const across = Math.abs((x - at[current][0]) * dy - (y - at[current][1]) * dx);
      const cost = along + 2 * across;
      if (along > 0 && across <= along && cost < least) [best, least] = [i, cost];
    });
    return best;
  }

  const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const STEPS = { PageUp: -1, PageDown: 1 };
  picture.addEventListener("keydown", (event) => {
    const visible = [...circles.keys()].filter((i) => !hidden(i));
    if (!visible.length) return;
    if (event.key === "Home" || (current < 0 && event.key in MOVES)) select(visible[0]);
    else if (event.key === "End") select(visible[visible.length - 1]);
    else if (event.key in STEPS) {
      const at = visible.indexOf(current) + STEPS[event.key];
      select(visible[Math.min(Math.max(at, 0), visible.length - 1)]);
    } else if (event.key in MOVES) select(neighbour(...MOVES[event.key]));
    else if (event.key === "Enter" || event.key === " ") play(current);
    else if (event.key === "Escape") silence();
    else return;
    event.preventDefault();
  });
  const target = (event) => Number(event.target.dataset?.index ?? -1);
  picture.addEventListener("pointerover", (event) => {
    if (target(event) >= 0) select(target(event));
  });
  picture.addEventListener("click", (event) => {
    if (target(event) >= 0) { select(target(event)); play(target(event)); }
  });
  sound.addEventListener("ended", silence);
  byId("volume").addEventListener("input", (event) => { sound.volume = event.target.value; });
  byId("picture").closest("main").querySelector("form").addEventListener("submit", (event) => event.preventDefault());

  content.spaces.forEach((space, i) => choices.space.add(new Option(space.label, i)));
  content.colours.forEach((colour, i) => choices.colour.add(new Option(colour.label, i)));
  choices.space.addEventListener("change", place);
  choices.part.addEventListener("change", paint);
  choices.colour.addEventListener("change", () => { legend(); paint(); });
  legend();
  paint();
  place();
})();
