// Drawings of a recording and of the map, each on a canvas. Colours come from the style sheet.

export const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Colours of classes (Okabe and Ito), which are distinguished with any colour vision.
const CLASS_COLOURS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#8a7f00"];
export const MAX_CLASSES = 3 * CLASS_COLOURS.length;
const SHAPES = ["disc", "square", "triangle"];
export const classColour = (number) => CLASS_COLOURS[number % CLASS_COLOURS.length];
const classShape = (number) => SHAPES[Math.floor(number / CLASS_COLOURS.length) % SHAPES.length];
export const classMark = (number) => ({ disc: "●", square: "■", triangle: "▲" })[classShape(number)];

// Levels of a spectrogram from dark to bright.
const HEAT = [[0, 0, 4], [60, 15, 110], [140, 41, 129], [222, 73, 104], [254, 159, 109], [252, 253, 191]];
const MARGIN = { left: 46, right: 8, top: 6, bottom: 20 };

// Returns the context and the size of a canvas in CSS pixels, with its pixels cleared.
function begin(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { width, height } = canvas.getBoundingClientRect();
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
  return { context, width, height };
}

export function drawWaveform(canvas, sound, position) {
  const { context, width, height } = begin(canvas);
  const inner = width - MARGIN.left - MARGIN.right;
  const peak = Math.max(...sound.high, ...sound.low.map((value) => -value), 1e-9);
  const middle = height / 2;
  const scale = (middle - 4) / peak;
  context.fillStyle = colour("class");
  const step = inner / sound.low.length;
  sound.low.forEach((low, i) => {
    const top = middle - sound.high[i] * scale;
    context.fillRect(MARGIN.left + i * step, top, Math.max(step, 1), Math.max((sound.high[i] - low) * scale, 1));
  });
  context.fillStyle = colour("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  const shown = peak < 0.01 ? peak.toExponential(0) : peak.toFixed(2);
  context.fillText(shown, MARGIN.left - 4, 10);
  context.fillText("0", MARGIN.left - 4, middle);
  if (position > 0) {
    context.fillStyle = colour("other");
    context.fillRect(MARGIN.left + position * inner - 1, 0, 2, height);
  }
}

// The share of the sound at a place of the waveform.
export function positionAt(canvas, event) {
  const box = canvas.getBoundingClientRect();
  const inner = box.width - MARGIN.left - MARGIN.right;
  return Math.min(1, Math.max(0, (event.clientX - box.left - MARGIN.left) / inner));
}

export function drawSpectrogram(canvas, sound) {
  const { context, width, height } = begin(canvas);
  const { rows, columns, levels, low_hz, high_hz } = sound.spectrogram;
  const bytes = Uint8Array.from(atob(levels), (character) => character.charCodeAt(0));
  const image = new OffscreenCanvas(columns, rows);
  const pixels = new ImageData(columns, rows);
  const palette = Array.from({ length: 256 }, (_, level) => heat(level / 255));
  for (let row = 0; row < rows; row++)
    for (let column = 0; column < columns; column++)
      pixels.data.set(palette[bytes[(rows - 1 - row) * columns + column]], 4 * (row * columns + column));
  image.getContext("2d").putImageData(pixels, 0, 0);
  const area = inside(width, height);
  context.drawImage(image, area.left, area.top, area.width, area.height);
  const y = (hz) => area.top + area.height * (1 - Math.log(hz / low_hz) / Math.log(high_hz / low_hz));
  context.fillStyle = colour("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const hz of decades(low_hz, high_hz)) {
    context.fillRect(area.left - 3, y(hz), 3, 1);
    context.fillText(hertz(hz), area.left - 5, y(hz));
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    context.textAlign = share === 1 ? "right" : share === 0 ? "left" : "center";
    context.fillText(seconds(share * sound.seconds), area.left + share * area.width, area.top + area.height + 4);
  }
}

function heat(share) {
  const place = share * (HEAT.length - 1);
  const below = Math.min(HEAT.length - 2, Math.floor(place));
  const mix = (i) => Math.round(HEAT[below][i] + (place - below) * (HEAT[below + 1][i] - HEAT[below][i]));
  return [mix(0), mix(1), mix(2), 255];
}

function inside(width, height) {
  return {
    left: MARGIN.left, top: MARGIN.top,
    width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom,
  };
}

const hertz = (hz) => hz >= 1000 ? `${hz / 1000} kHz` : `${hz} Hz`;
const seconds = (time) => time < 1 ? `${Math.round(1000 * time)} ms` : `${time.toFixed(2)} s`;

// 1, 2 and 5 times the powers of ten between two numbers.
function decades(low, high) {
  const values = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
    for (const factor of [1, 2, 5]) {
      const value = Number(`${factor}e${power}`);
      if (value >= low && value <= high) values.push(value);
    }
  return values;
}

// Dashes of the lines of a spectrum by their role, which is also the name of their colour.
const DASHES = { own: [], class: [], other: [6, 4] };
// Range of levels of a spectrum, below the largest one.
const RANGE_DB = 60;

// Range of the difference of levels, which small differences fill.
const DIFFERENCE_DB = 12;

const isLevel = (spectrum) => spectrum.is_positive && spectrum.lines[0].y.some((value) => value > 0);
const toLevel = (value, largest) => 20 * Math.log10(Math.max(value, 1e-6 * largest) / largest);

// The recording, the mean of its class, and the mean of the nearest other class.
export function drawSpectrum(canvas, spectrum) {
  const values = spectrum.lines.flatMap((line) => line.y);
  const largest = Math.max(...values);
  const isInDb = isLevel(spectrum);
  const lines = spectrum.lines.map((line) => ({
    role: line.role, y: isInDb ? line.y.map((value) => toLevel(value, largest)) : line.y,
  }));
  drawLines(canvas, spectrum, lines, isInDb ? [-RANGE_DB, 0] : [Math.min(...values), largest], isInDb);
}

// The recording minus the mean of each class: the flatter line is the nearer class.
export function drawDifference(canvas, spectrum) {
  const [own, ...means] = spectrum.lines;
  const isInDb = isLevel(spectrum);
  const largest = Math.max(...own.y);
  const lines = means.map((mean) => ({
    role: mean.role,
    y: mean.y.map((value, i) => isInDb ? toLevel(own.y[i], largest) - toLevel(value, largest) : own.y[i] - value),
  }));
  const extreme = Math.max(...lines.flatMap((line) => line.y.map(Math.abs)), 1e-12);
  const range = isInDb ? Math.min(DIFFERENCE_DB, Math.ceil(extreme)) : extreme;
  drawLines(canvas, spectrum, lines, [-range, range], isInDb);
}

function drawLines(canvas, spectrum, lines, [bottom, top], isInDb) {
  const { context, width, height } = begin(canvas);
  const area = inside(width, height);
  const isLogX = spectrum.unit === "Hz";
  const first = spectrum.x.findIndex((value) => !isLogX || value > 0);
  const low = isLogX ? Math.max(spectrum.x[first], 40) : spectrum.x[first];
  const high = spectrum.x.at(-1);
  const toX = isLogX ? (value) => Math.log(value / low) / Math.log(high / low)
    : (value) => (value - low) / (high - low || 1);
  const toY = (value) => area.top + area.height * (top - value) / (top - bottom || 1);
  context.strokeStyle = colour("line");
  if (bottom < 0 && top > 0) {
    context.strokeRect(area.left, toY(0), area.width, 0.5);
  }
  context.save();
  context.beginPath();
  context.rect(area.left, area.top, area.width, area.height);
  context.clip();
  for (const line of [...lines].reverse()) {  // the recording is in front
    context.strokeStyle = colour(line.role);
    context.setLineDash(DASHES[line.role]);
    context.lineWidth = line.role === "own" ? 1.2 : 1.6;
    context.beginPath();
    spectrum.x.forEach((value, i) => {
      if (i >= first) context.lineTo(area.left + area.width * toX(value), toY(line.y[i]));
    });
    context.stroke();
  }
  context.restore();
  context.fillStyle = colour("soft");
  context.textAlign = "center";
  context.textBaseline = "top";
  const ticks = isLogX ? decades(low, high) : [0, 0.25, 0.5, 0.75, 1].map((share) => low + share * (high - low));
  for (const value of ticks) {
    const x = area.left + area.width * toX(value);
    context.fillRect(x, area.top + area.height, 1, 3);
    const text = isLogX ? hertz(value) : String(Number(value.toPrecision(3)));
    if (x < width - 22) context.fillText(text, x, area.top + area.height + 5);
  }
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const share of [0, 0.5, 1]) {
    const value = top - share * (top - bottom);
    const text = isInDb ? `${value.toFixed(0).replace("-", "−")} dB` : String(Number(value.toPrecision(2)));
    context.fillText(text, area.left - 4, area.top + 5 + share * (area.height - 10));
  }
}

// Draws all points: those of the table in colour, the other points in grey, the selected one ringed.
export function drawScatter(canvas, points, shown, selected, box) {
  const { context, width, height } = begin(canvas);
  const place = placing(points, width, height);
  const isDense = points.x.length > 5000;
  const size = isDense ? 1.5 : 3;
  const hasColours = points.classes.length <= MAX_CLASSES;
  const draw = (i) => {
    const [x, y] = place(i);
    if (isDense) context.fillRect(x - size, y - size, 2 * size, 2 * size);
    else mark(context, hasColours ? classShape(points.class[i]) : "disc", x, y, size);
  };
  const ofClass = points.classes.map(() => []);  // the colour changes once per class
  context.fillStyle = colour("line");
  points.x.forEach((x, i) => {
    if (x === null) return;
    if (shown.has(i)) ofClass[points.class[i]].push(i);
    else draw(i);
  });
  ofClass.forEach((numbers, number) => {
    context.fillStyle = hasColours ? classColour(number) : colour("class");
    numbers.forEach(draw);
  });
  if (selected !== null && points.x[selected] !== null && points.x[selected] !== undefined) {
    const [x, y] = place(selected);
    context.strokeStyle = colour("text");
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, size + 5, 0, 2 * Math.PI);
    context.stroke();
  }
  if (box) {
    context.strokeStyle = colour("text");
    context.setLineDash([4, 3]);
    context.strokeRect(box.x, box.y, box.width, box.height);
  }
}

function mark(context, shape, x, y, size) {
  context.beginPath();
  if (shape === "square") context.rect(x - size, y - size, 2 * size, 2 * size);
  else if (shape === "triangle") {
    context.moveTo(x, y - 1.3 * size);
    context.lineTo(x + 1.2 * size, y + size);
    context.lineTo(x - 1.2 * size, y + size);
  } else context.arc(x, y, size, 0, 2 * Math.PI);
  context.fill();
}

const EDGE = 12;
function extent(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values)
    if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
  return [low, high > low ? high : low + 1];
}

// Returns the function that gives the place of a point.
function placing(points, width, height) {
  const [left, right] = extent(points.x), [bottom, top] = extent(points.y);
  return (i) => [
    EDGE + (width - 2 * EDGE) * (points.x[i] - left) / (right - left),
    height - EDGE - (height - 2 * EDGE) * (points.y[i] - bottom) / (top - bottom),
  ];
}

// The coordinates in the plane of a place on the canvas.
export function coordinatesAt(canvas, points, x, y) {
  const { width, height } = canvas.getBoundingClientRect();
  const [left, right] = extent(points.x), [bottom, top] = extent(points.y);
  return [
    left + (right - left) * (x - EDGE) / (width - 2 * EDGE),
    bottom + (top - bottom) * (height - EDGE - y) / (height - 2 * EDGE),
  ];
}

// The nearest point of the table to a place, if it is near; otherwise null.
export function pointAt(canvas, points, shown, x, y) {
  const { width, height } = canvas.getBoundingClientRect();
  const place = placing(points, width, height);
  let nearest = null, least = 15 ** 2;
  for (const i of shown) {
    if (points.x[i] === null) continue;
    const [px, py] = place(i);
    const distance = (px - x) ** 2 + (py - y) ** 2;
    if (distance < least) { least = distance; nearest = i; }
  }
  return nearest;
}
