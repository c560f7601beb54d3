// The replay on a shared page: cars on their road, from behind the car or from above, on a canvas and from this page alone.
"use strict";
const lap = JSON.parse(document.getElementById("lap").textContent);
const canvas = document.getElementById("stage");
const pen = canvas.getContext("2d");
const [button, slider, clock, view] = ["play", "moment", "clock", "view"].map((id) => document.getElementById(id));
const STEP = 1 / 15; // s
const END = (Math.max(...lap.cars.map((car) => car.x.length)) - 1) * STEP;
const COLORS = { sky: "#dfe6ea", field: "#86a37e", road: "#3b4350", line: "#f4f4ef", dash: "#ffb02e" };
let [time, isPlaying, isAbove, last, followed] = [0, false, false, 0, 0];

const written = (value, digits) =>
  value.toLocaleString(document.documentElement.lang, { minimumFractionDigits: digits, maximumFractionDigits: digits });
const mix = (a, b, share) => a + (b - a) * share;
/** Where a car is at the moment; after its end it stays. */
function pose({ x, y, heading, speed, color }) {
  const place = Math.min(time / STEP, x.length - 1);
  const row = Math.floor(place);
  const next = Math.min(row + 1, x.length - 1);
  const turn = Math.atan2(Math.sin(heading[next] - heading[row]), Math.cos(heading[next] - heading[row]));
  const at = (list) => mix(list[row], list[next], place - row);
  return { x: at(x), y: at(y), heading: heading[row] + turn * (place - row), speed: at(speed), color };
}

/** A way from metres to pixels: [x, y, z] to [x, y], or null behind the camera. */
function chaseCamera({ x, y, heading }, width, height) {
  const [cos, sin, back, up, down] = [Math.cos(heading), Math.sin(heading), 1.5, 0.85, 0.33];
  const focus = 0.9 * Math.min(width, 1.5 * height);
  return ([px, py, pz]) => {
    const [dx, dy, dz] = [px - x + back * cos, py - y + back * sin, pz - up];
    const ahead = dx * cos + dy * sin;
    const depth = ahead * Math.cos(down) - dz * Math.sin(down);
    if (depth < 0.12) return null;
    const high = dz * Math.cos(down) + ahead * Math.sin(down);
    return [width / 2 - (focus * (dy * cos - dx * sin)) / depth, height / 2 - (focus * high) / depth, depth];
  };
}

function topCamera(width, height) {
  const all = [...lap.inner, ...lap.outer];
  const [left, right] = [Math.min(...all.map((p) => p[0])), Math.max(...all.map((p) => p[0]))];
  const [low, high] = [Math.min(...all.map((p) => p[1])), Math.max(...all.map((p) => p[1]))];
  const scale = 0.9 * Math.min(width / (right - left), height / (high - low));
  return ([x, y]) => [width / 2 + scale * (x - (left + right) / 2), height / 2 - scale * (y - (low + high) / 2), 1];
}

function fill(see, corners, color) {
  const seen = corners.map(see);
  if (seen.includes(null)) return;
  pen.fillStyle = pen.strokeStyle = color;
  pen.beginPath();
  seen.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.closePath();
  pen.fill();
  pen.stroke(); // no seam between two pieces
}

const between = (a, b, share) => [mix(a[0], b[0], share), mix(a[1], b[1], share), 0];
function drawRoad(see) {
  const { inner, outer, closed } = lap;
  const pieces = [];
  for (let row = 0; row + (closed ? 0 : 1) < inner.length; row++) {
    const next = (row + 1) % inner.length;
    const middle = see(between(inner[row], outer[row], 0.5));
    if (middle) pieces.push([middle[2], row, next]);
  }
  pieces.sort((a, b) => b[0] - a[0]);
  const band = (row, next, from, to, color) => {
    const edge = (at, share) => between(inner[at], outer[at], share);
    fill(see, [edge(row, from), edge(next, from), edge(next, to), edge(row, to)], color);
  };
  for (const [, row, next] of pieces) band(row, next, 0, 1, COLORS.road);
  for (const [, row, next] of pieces) {
    const line = 0.0762 / Math.hypot(inner[row][0] - outer[row][0], inner[row][1] - outer[row][1]);
    band(row, next, 0, line, COLORS.line);
    band(row, next, 1 - line, 1, COLORS.line);
    if (row % 2) band(row, next, 0.5 - 0.2 * line, 0.5 + 0.2 * line, COLORS.dash);
  }
  const start = (share, along) => {
    const [a, b] = [between(inner[0], outer[0], share), between(inner[1], outer[1], share)];
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    return between(a, b, along / length);
  };
  fill(see, [start(0, 0), start(1, 0), start(1, 0.08), start(0, 0.08)], COLORS.line);
}

function drawCar(see, { x, y, heading, color }) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const point = (along, side, high) => [x + along * cos - side * sin, y + along * sin + side * cos, high];
  const slab = (from, to, half, high, color) =>
    fill(see, [point(from, half, high), point(to, half, high), point(to, -half, high), point(from, -half, high)], color);
  const big = isAbove ? 1.8 : 1; // to be seen from far above
  slab(-0.17 * big, 0.17 * big, 0.11 * big, 0.002, "#252b34");
  for (const along of [-0.09, 0.09])
    for (const side of [-0.08, 0.08])
      fill(
        see,
        [
          point((along - 0.035) * big, (side + 0.02) * big, 0.03),
          point((along + 0.035) * big, (side + 0.02) * big, 0.03),
          point((along + 0.035) * big, (side - 0.02) * big, 0.03),
          point((along - 0.035) * big, (side - 0.02) * big, 0.03),
        ],
        "#15181c",
      );
  fill(see, [point(-0.16 * big, 0.07 * big, 0.03), point(-0.16 * big, -0.07 * big, 0.03), point(-0.16 * big, -0.07 * big, 0.1), point(-0.16 * big, 0.07 * big, 0.1)], color);
  slab(-0.16 * big, 0.16 * big, 0.06 * big, 0.09, color);
  slab(-0.09 * big, 0.05 * big, 0.045 * big, 0.13, "#262b33");
}

function draw() {
  const share = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth * share, canvas.clientHeight * share];
  if (canvas.width !== Math.round(width) || canvas.height !== Math.round(height)) [canvas.width, canvas.height] = [Math.round(width), Math.round(height)];
  const poses = lap.cars.map(pose);
  const car = poses[followed];
  const see = isAbove ? topCamera(width, height) : chaseCamera(car, width, height);
  const horizon = isAbove ? 0 : height / 2 - 0.9 * Math.min(width, 1.5 * height) * Math.tan(0.33);
  pen.lineWidth = 1;
  pen.fillStyle = COLORS.sky;
  pen.fillRect(0, 0, width, height);
  pen.fillStyle = COLORS.field;
  pen.fillRect(0, Math.max(horizon, 0), width, height);
  drawRoad(see);
  const far = (one) => see([one.x, one.y, 0])?.[2] ?? 0;
  for (const one of [...poses].sort((a, b) => far(b) - far(a))) drawCar(see, one);
  slider.value = String(time);
  clock.textContent = `${written(time, 2)} s · ${written(car.speed, 1)} m/s`;
  button.textContent = isPlaying ? "❚❚" : "▶";
}

function step(moment) {
  if (!isPlaying) return;
  time += Math.min((moment - last) / 1000, 0.1);
  last = moment;
  if (time >= END) [time, isPlaying] = [END, false];
  draw();
  requestAnimationFrame(step);
}

button.addEventListener("click", () => {
  isPlaying = !isPlaying;
  if (isPlaying && time >= END) time = 0;
  last = performance.now();
  draw();
  requestAnimationFrame(step);
});
slider.max = String(END);
slider.addEventListener("input", () => {
  [time, isPlaying] = [Number(slider.value), false];
  draw();
});
view.addEventListener("click", () => {
  isAbove = !isAbove;
  view.setAttribute("aria-pressed", String(isAbove));
  draw();
});
const choices = [...document.querySelectorAll("[data-car]")];
for (const choice of choices)
  choice.addEventListener("click", () => {
    followed = Number(choice.dataset.car);
    for (const one of choices) one.setAttribute("aria-pressed", String(one === choice));
    draw();
  });
new ResizeObserver(draw).observe(canvas);
if (!matchMedia("(prefers-reduced-motion: reduce)").matches) button.click();
