// Drives and trains what cases.json says with the core's WebAssembly, through the pages' own face of it, and prints the
// hashes of all that came out:  node bits.mjs WEB CORE.wasm CASES.json
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { pathToFileURL } from "node:url";
import { Worker } from "node:worker_threads";

const [pages, code, cases] = process.argv.slice(2);
const { build } = await import(
  pathToFileURL(join(pages, "node_modules/vite/dist/node/index.js")).href
);

/** A TypeScript file of the pages, bundled as they are. */
const load = async (file) =>
  import(`data:text/javascript,${encodeURIComponent(await bundle(file))}`);

async function bundle(file) {
  const lib = { entry: join(pages, file), formats: ["es"] };
  const bundled = await build({
    configFile: false,
    root: pages,
    logLevel: "error",
    build: { lib, write: false },
  });
  return bundled[0].output[0].code;
}

const THREADS = 3;
const AS_A_BROWSER = `const { parentPort } = require("node:worker_threads");
globalThis.postMessage = (data) => parentPort.postMessage(data);
parentPort.on("message", (data) => globalThis.onmessage({ data }));
`;
const helpers = [];
/** The page's helper, as a thread of Node. */
function openHelper() {
  const helper = new Worker(AS_A_BROWSER + helperCode, { eval: true });
  helpers.push(helper);
  return {
    postMessage: (data) => helper.postMessage(data),
    terminate: () => helper.terminate(),
    set onmessage(hear) {
      helper.on("message", (data) => hear({ data }));
    },
    set onerror(hear) {
      helper.on("error", hear);
    },
  };
}

/** Python as the page has it, from the same package. */
async function startPython(files) {
  const folder = join(pages, "node_modules/pyodide/");
  const { loadPyodide } = await import(
    pathToFileURL(join(folder, "pyodide.mjs")).href
  );
  const { Python } = await load("src/tab/python.ts");
  const outside = Object.create(null);
  return Python.of(
    await loadPyodide({ indexURL: folder, jsglobals: outside }),
    files,
  );
}

const KINDS = {
  float64: Float64Array,
  float32: Float32Array,
  int32: Int32Array,
  uint8: Uint8Array,
};
// An array as {dtype, data in base64}.
const read = ({ dtype, data }) =>
  new KINDS[dtype](new Uint8Array(Buffer.from(data, "base64")).buffer);
const digest = (...arrays) => {
  const hash = createHash("sha256");
  for (const a of arrays)
    hash.update(new Uint8Array(a.buffer, a.byteOffset, a.byteLength));
  return hash.digest("hex");
};

function track(core, { lines, tables, waypoints, ...rest }) {
  return core.track({
    ...rest,
    lines: read(lines),
    tables: read(tables),
    waypoints: read(waypoints),
  });
}

function drive(core, { track: of, settings, vehicle, actions }) {
  const cars = track(core, of).cars(settings, vehicle);
  const all = read(actions);
  const seen = { frames: [], rows: [], state: [], vehicles: [] };
  for (let at = 0; at < all.length; at += 2 * cars.count) {
    cars.step(all.slice(at, at + 2 * cars.count));
    for (const [name, list] of Object.entries(seen))
      list.push(cars[name].slice());
    const { terminated, truncated } = cars;
    cars.reset(terminated.map((flag, car) => flag | truncated[car]));
  }
  return Object.fromEntries(
    Object.entries(seen).map(([name, list]) => [name, digest(...list)]),
  );
}

/** What a step's rows are paid: for being near the middle, or by a reward function in Python. */
function payer(core, cars, pay, seed) {
  const columns = core.names("row");
  if (pay.source) {
    const { count } = cars;
    return python.open(pay.source, pay, count, columns.length, seed).pay;
  }
  const [offset, width] = [
    columns.indexOf(pay.distance),
    columns.indexOf(pay.width),
  ];
  return (rows) =>
    Float64Array.from({ length: cars.count }, (_, car) => {
      const row = rows.subarray(car * cars.rowWidth, (car + 1) * cars.rowWidth);
      return 1 - Math.abs(row[offset]) / row[width];
    });
}

/** Rewards of rows, or the sentence about a function that failed. */
function ask(core, { rows, count, source, track: of, seed }) {
  try {
    const all = read(rows);
    const width = all.length / count;
    const { pay, printed } = python.open(source, of, count, width, seed);
    return { rewards: digest(pay(all)), printed: printed() };
  } catch (error) {
    return { sentence: error.message };
  }
}

/** What a check says; with `among`, after the moments that there are among its objects. */
async function check(core, { source, track: of, among }) {
  if (!among) return python.check(source, of);
  const { momentsAmong } = await load("src/tab/among.ts");
  const situations = momentsAmong(core, of, among);
  return {
    moments: situations,
    ...python.check(source, { ...of, situations }),
  };
}

function train(
  core,
  {
    track: of,
    settings,
    vehicle,
    network,
    layers,
    ppo,
    table,
    seed,
    weights,
    iterations,
    pay,
  },
) {
  const cars = track(core, of).cars(settings, vehicle);
  const learner = core.learner(network);
  learner.write("weights", read(weights));
  const training = learner.train(cars, ppo, read(table));
  const rewards = payer(core, cars, pay, seed);
  const ended = [];
  for (let iteration = 0; iteration < iterations; ++iteration) {
    training.begin(seed, iteration, training.totalSteps);
    for (let isFull = false; !isFull;) {
      if (!training.drive()) throw new Error("not finite");
      isFull = training.pay(rewards(cars.rows));
    }
    if (!training.learn()) throw new Error("not finite");
    ended.push(...training.ended().map(({ total, length }) => [total, length]));
  }
  return {
    weights: digest(learner.read("weights")),
    moment1: digest(learner.read("moment1")),
    moment2: digest(learner.read("moment2")),
    initial: digest(core.orthogonalWeights(seed, layers)),
    best: digest(learner.best(cars, read(table))),
    steps: training.totalSteps,
    ended,
  };
}

function refuse(core, { track: of }) {
  const before = core.module.stack.value;
  try {
    track(core, of);
  } catch (error) {
    return { sentence: error.message, stack: before - core.module.stack.value };
  }
}

/** A replay file driven again, or which sentence of the page says why not. */
async function verify(core, { plan, replays, tracks }) {
  const { ReplayProblem, verifyFile } = await load("src/tab/verify/verify.ts");
  const found = [];
  for (const file of replays) {
    try {
      const bytes = new Blob([Buffer.from(file, "base64")]);
      found.push(
        await verifyFile(core, plan, bytes, async (name) => tracks[name]),
      );
    } catch (error) {
      if (!(error instanceof ReplayProblem)) throw error;
      found.push({ key: error.key, values: error.values });
    }
  }
  return found;
}

async function policies(_, { plan, wishes }) {
  const { policyFor } = await load("src/tab/policy.ts");
  return wishes.map(({ race, space, objects }) =>
    policyFor(plan.races[race], space, objects),
  );
}

/** A whole training, as the page's worker runs it. */
async function session(core, asked) {
  const { plan, race: type, objects, space, track, seed, steps } = asked;
  const { Trainer, payWith } = await load("src/tab/trainer.ts");
  const { policyFor } = await load("src/tab/policy.ts");
  const { rewards } = await import(
    `data:text/javascript,${encodeURIComponent(asked.rewards)}`
  );
  const race = plan.races[type];
  const policy = policyFor(race, space, objects);
  const pay = () => payWith(rewards.own, track, race.cars.num_envs);
  const begin = asked.begin && {
    weights: read(asked.begin.weights),
    layout: asked.begin.layout,
  };
  const wish = { plan, race, policy, objects, track, seed, begin };
  const trainer = new Trainer(core, wish, pay);
  let evaluation;
  let download; // of what was judged first
  while (trainer.steps < steps) {
    trainer.drive(() => {});
    trainer.learn();
    if (!trainer.needsEvaluation && trainer.steps < steps) continue;
    evaluation = trainer.evaluate();
    download ??= await downloaded(trainer, evaluation, asked);
  }
  const { completions, lapTimes } = evaluation;
  const { learning, average, simulation, totals, lengths, returnScale } =
    trainer.state();
  return {
    steps: trainer.steps,
    learning: digest(learning),
    average: digest(average),
    simulation: digest(simulation),
    totals: digest(totals),
    lengths: digest(lengths),
    returnScale: digest(returnScale),
    completions,
    lapTimes,
    download,
  };
}

/** What the page would give of a training as it stands. */
async function downloaded(trainer, evaluation, asked) {
  const { modelOf, archive } = await load("src/tab/model.ts");
  const { plan, race: type, objects, space, track, seed, source } = asked;
  const { weights } = evaluation;
  const model = modelOf(track, {
    ...{ name: type, seed, reward: source, space, race: { type, objects } },
    ...{ steps: trainer.steps, seconds: 1, laps: 0, bestLap: null, weights },
    ...{ state: trainer.state(), judgement: trainer.judgement(evaluation) },
  });
  const file = await archive(model, plan);
  return Buffer.from(await file.arrayBuffer()).toString("base64");
}

/** What the page takes of an archive, and how it drives there. */
async function arrival(core, { plan, track, file }) {
  const { arrivalOf } = await load("src/tab/arrive.ts");
  const { policyOf } = await load("src/tab/model.ts");
  const { Trainer } = await load("src/tab/trainer.ts");
  const found = await arrivalOf(
    new Blob([Buffer.from(file, "base64")]),
    plan,
    async () => track.digest,
  );
  const { weights, seed, steps, reward, race: told } = found;
  const policy = policyOf(found, plan);
  const begin = { weights, layout: policy.weights };
  const race = plan.races[told.type];
  const asked = { plan, race, policy, objects: told.objects, track, seed };
  const trainer = new Trainer(core, { ...asked, begin }, () => () => []);
  const { completions, lapTimes } = trainer.evaluate();
  return {
    ...{ weights: digest(weights), seed, steps, reward },
    ...{ completions, lapTimes },
  };
}

/** Laps of an evaluation as the page shows them, what a reward pays for them, and what the car saw first. */
async function watched(core, { weights, reward, ...asked }) {
  const { Watched } = await load("src/tab/laps/watched.ts");
  const { payLaps } = await load("src/tab/laps/paid.ts");
  const { payWith } = await load("src/tab/trainer.ts");
  const address = `data:text/javascript,${encodeURIComponent(reward)}`;
  const { rewards } = await import(address);
  const begin = { weights: read(weights) };
  const found = await Watched.evaluation(core, { ...asked, begin });
  const pay = payWith(rewards.own, asked.track, 1);
  found.pay(payLaps(pay, found.toPay()), rewards.own.remembers);
  const last = found.report.laps.at(-1);
  const { frames, shape } = await found.eyes(last.number);
  return {
    report: found.report,
    count: frames.length / shape[0] / shape[1],
    first: digest(frames.slice(0, shape[0] * shape[1])),
  };
}

/** The same of a replay. */
async function rewatched(core, { plan, replay, track }) {
  const { Watched } = await load("src/tab/laps/watched.ts");
  const { verify } = await load("src/tab/verify/verify.ts");
  const bytes = new Uint8Array(Buffer.from(replay, "base64"));
  let found;
  const keep = (file, road) => {
    found = Watched.replay(core, plan, file, road);
  };
  await verify(core, plan, bytes, async () => track, keep);
  const eyes = await found.eyes(found.report.laps[0].number);
  return { report: found.report, shape: eyes?.shape };
}

/** What becomes of drawings: a verdict, and of a road that can be driven the file. */
async function drawings(core, { sketches, statuses }) {
  const { judge } = await load("src/tab/drawn/judge.ts");
  const { roadOf } = await load("src/tab/drawn/road.ts");
  const { fileOf } = await load("src/tab/drawn/file.ts");
  const words = { columns: core.names("row"), statuses };
  const found = {};
  for (const [name, sketch] of Object.entries(sketches)) {
    const verdict = judge(sketch);
    const file = verdict.ok && (await fileOf("drawing", roadOf(sketch), words));
    found[name] = { verdict, file };
  }
  return found;
}

/** What rewards pay along tracks: presets by name, and one in Python. */
async function paintings(core, { tracks, among, rewards, presets, source }) {
  const { paint } = await load("src/tab/painting.ts");
  const { payWith } = await load("src/tab/trainer.ts");
  const address = `data:text/javascript,${encodeURIComponent(rewards)}`;
  const made = (await import(address)).rewards;
  const always = async () => true;
  const found = [];
  for (const of of tracks) {
    for (const about of among) {
      const on = [core, of, about, always];
      for (const name of presets)
        found.push(await paint(() => payWith(made[name], of, 1), ...on));
      const { obstacles, bots } = about.objects;
      const count = (obstacles?.count ?? 0) + (bots?.count ?? 0);
      const { header, each } = about.objectColumns;
      const extra = count && header.length + each.length * count;
      const width = core.names("row").length + extra;
      found.push(
        await paint(() => python.open(source, of, 1, width, 0).pay, ...on),
      );
    }
  }
  return found;
}

/** Somebody's drive, answer by answer. */
async function driven(core, { plan, track, settings, controls }) {
  const { DrivenCar } = await load("src/tab/drivencar.ts");
  const car = new DrivenCar(core, plan, track, settings);
  const { start } = car.begin("");
  const answers = controls.map(({ steering, speed, steps }) =>
    car.step(steering, speed, steps),
  );
  return { start, answers };
}

const { Core, loadCore } = await load("src/tab/core.ts");
const { loadTeam } = await load("src/tab/team.ts");
const bytes = readFileSync(code);
const isTeam = basename(code) === "threads.wasm";
const helperCode = await bundle("src/tab/helper.ts");
const core = isTeam
  ? new Core(await loadTeam(bytes, THREADS, openHelper))
  : await Core.load(bytes);
const run = {
  ...{ ask, check, drive, train, refuse },
  ...{ verify, policies, session, driven, arrival, paintings },
  ...{ watched, rewatched, drawings },
};
const all = JSON.parse(readFileSync(cases, "utf8"));
const files = all.find(({ files }) => files)?.files;
const python = files ? await startPython(files) : undefined;
const results = [];
for (const { what, ...rest } of all) results.push(await run[what](core, rest));
// What a page takes where the first builds it asks for do not run.
const taken = async (broken) => {
  const files = [];
  const read = async (file) => {
    files.push(file);
    return broken.includes(file) ? new Uint8Array(8) : bytes;
  };
  const { isSlow, threads } = await loadCore(read, THREADS, openHelper);
  return [files.at(-1), isSlow, threads];
};
const ASKED = ["threads.wasm", "core.wasm", "exact.wasm"];
const doors = [];
if (isTeam) doors.push(await taken([]));
else if (core.isFused)
  for (const count of [1, 2, 3]) doors.push(await taken(ASKED.slice(0, count)));
console.log(JSON.stringify({ isFused: core.isFused, doors, results }));
for (const helper of helpers) helper.terminate();
