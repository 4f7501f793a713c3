// Figures of the page: node bars.mjs BIN. One line of JSON each: {what, limit, value, unit}; value null: not measured.
import { Worker } from "node:worker_threads";
import { Browser, Station, press, sleep, until } from "./browser.mjs";
import { ask, jobOf, open, see } from "./steps.mjs";

const RIG = ["--operator", "none", "--scale", "0.5", "--views", "4", "--voxel-mm", "0.5"];
const JOB_RIG = ["--operator", "helper", "--scale", "0.5", "--views", "4", "--voxel-mm", "0.5", "--background-cameras"];
const PAGES = 8;
const PRESSES = 200;
const JOBS = 200;
const PAIRS = 3;

const tell = (what, limit, value, unit, digits = 0) =>
  console.log(JSON.stringify({ what, limit, value: value === null ? null : Number(value.toFixed(digits)), unit }));
const share = (values, of) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(of * values.length))];

/** The daemon's events as another client hears them, each with the time of its arrival. */
function hear(station) {
  const heard = [];
  const thread = new Worker(new URL("./hear.mjs", import.meta.url), { workerData: station.socket });
  thread.on("message", (event) => heard.push(event));
  return { heard, close: () => thread.terminate() };
}

/** Notes in the page when a sentence and a mesh were painted, and its long tasks. */
const WATCH = `
  window.painted = []; window.tasks = [];
  new PerformanceObserver((list) => list.getEntries().forEach((one) => tasks.push(one.duration))).observe({ type: "longtask" });
  new MutationObserver(() => requestAnimationFrame(() => {
    const sentence = document.querySelector(".sentence")?.textContent;
    if (sentence && painted.at(-1)?.sentence !== sentence) painted.push({ sentence, at: Date.now() });
    const shown = document.querySelector(".live canvas")?.dataset.shown;
    if (shown && painted.findLast((one) => one.shown)?.shown !== shown) painted.push({ shown, at: Date.now() });
  })).observe(document, { subtree: true, childList: true, characterData: true, attributes: true });`;

async function firstSentence(browser, station) {
  const page = await browser.page();
  const client = await page.context().newCDPSession(page);
  await client.send("Emulation.setCPUThrottlingRate", { rate: 6 });
  const address = station.address();
  const begun = performance.now();
  await page.goto(address, { waitUntil: "commit" });
  await page.waitForFunction(() => document.querySelector(".sentence")?.textContent, null, { polling: "raf" });
  tell("sentence painted, processor slowed 6 times", 1000, performance.now() - begun, "ms");
  await page.context().close();
}

const pressed = (page) =>
  page.evaluate(async (count) => {
    const times = [];
    for (let i = 0; i < count; i++) {
      const begun = performance.now();
      await fetch("/api/v1/reset", { method: "POST", headers: { "X-Scanrig": "1" }, body: "{}" });
      times.push(performance.now() - begun);
    }
    return times;
  }, PRESSES / 2);

/** A whole job with eight pages open, whose part somebody turns over: answers, paint, patches, tasks. */
async function job(browser, station) {
  const page = await open(browser, station, { expected: /409/ });
  await page.evaluate(WATCH);
  const others = [];
  for (let i = 1; i < PAGES; i++) {
    others.push(await open(browser, station, {}));
    await others.at(-1).keyboard.press("2"); // one model drawn by this machine's processor is enough
  }
  await page.bringToFront(); // a page behind others paints rarely
  await see(page, "READY", 40_000); // the operator at the rig presses Reset
  const events = hear(station);
  await page.evaluate(() => tasks.splice(0)); // of the job alone
  await press(page, "START");
  await until("a view is stored", () => jobOf(station)?.stored.length > 0, 60_000);
  const answers = await pressed(page);
  await until("the model is in the making", () => jobOf(station)?.state === "reconstructing", 240_000);
  answers.push(...(await pressed(page)));
  await until("the job is done", () => jobOf(station)?.state === "done", 400_000);
  await sleep(500);
  events.close();
  const { painted, tasks } = await page.evaluate(() => ({ painted, tasks }));
  tell(`press to answer, p99 of ${answers.length}, ${PAGES} pages, scanning and reconstructing`, 100, share(answers, 0.99), "ms");
  tell("event to pixels, p95", 250, toPixels(events.heard, painted), "ms");
  tell("patch of the model, after its view was stored, longest", 2000, toPatch(events.heard, painted), "ms");
  tell("longest task of the page in the job", 100, Math.max(0, ...tasks), "ms");
  for (const one of [page, ...others]) await one.context().close();
}

/** Of sentences that stood long enough to be painted; the first one was there before. */
function toPixels(heard, painted) {
  const said = heard.filter((one) => one.name === "status").filter((one, i, all) => i > 0 && one.data.sentence !== all[i - 1].data.sentence);
  const lags = said.slice(1).flatMap(({ data, at }, i, all) => {
    const until = all[i + 1]?.at ?? Infinity;
    const seen = painted.find((one) => one.sentence === data.sentence && one.at >= at - 50 && one.at < until + 250);
    if (!seen) return until - at < 250 ? [] : [Infinity];
    return [Math.max(0, seen.at - at)];
  });
  return lags.length ? Math.min(share(lags, 0.95), 1e6) : null;
}

/** From the event that says that a view is stored to its mesh on the canvas. */
function toPatch(heard, painted) {
  const lags = [];
  let stored = 0;
  for (const { name, data, at } of heard) {
    if (name !== "job" || data.stored.length <= stored) continue;
    stored = data.stored.length;
    const { pose, view } = data.stored.at(-1);
    const mesh = `pose${pose + 1}_view${String(view).padStart(2, "0")}`;
    const seen = painted.find((one) => one.shown?.split(",").includes(mesh));
    if (seen) lags.push(seen.at - at);
  }
  return lags.length ? Math.max(...lags) : null;
}

async function loss(browser, station) {
  const page = await open(browser, station, { expected: /./ });
  await sleep(1500);
  const grey = (is) => page.waitForFunction((old) => Boolean(document.querySelector(".old")) === old, is, { polling: 20 });
  station.process.kill("SIGSTOP");
  let begun = performance.now();
  await grey(true);
  tell("a daemon that hangs is shown", 1000, performance.now() - begun, "ms");
  station.process.kill("SIGCONT");
  begun = performance.now();
  await grey(false);
  tell("back after it goes on", 2000, performance.now() - begun, "ms");
  await page.context().close();
}

async function heap(browser, station) {
  const page = await open(browser, station, {});
  const client = await page.context().newCDPSession(page);
  const used = async () => {
    await client.send("HeapProfiler.collectGarbage");
    return (await client.send("Runtime.getHeapUsage")).usedSize;
  };
  const turn = async (count) => {
    for (let i = 0; i < count; i++) {
      const told = await ask(station, { method: "POST", path: "/api/v1/jobs", body: "{}", local: true });
      const [id] = JSON.parse(told.text).jobs ?? [JSON.parse(told.text).job];
      await ask(station, { method: "POST", path: `/api/v1/jobs/${id}/cancel`, local: true });
      await ask(station, { method: "DELETE", path: `/api/v1/jobs/${id}`, local: true });
    }
    await sleep(1000);
  };
  await turn(20);
  const before = await used();
  await turn(JOBS);
  tell(`heap after ${JOBS} more jobs`, 10, (100 * (await used())) / before - 100, "%", 1);
  await page.context().close();
}

/** Until the table is seen to stand, Reset is refused. */
async function resetUntilReady(station) {
  if (station.status().word === "READY") return true;
  await ask(station, { method: "POST", path: "/api/v1/reset", local: true });
  return false;
}

/** Seconds from Start to the flip, with a page that reads everything and without. */
async function acquisition(browser, station) {
  const times = { alone: [], watched: [] };
  for (let i = 0; i < 2 * PAIRS; i++) {
    await until("ready", () => resetUntilReady(station), 60_000);
    const kind = i % 2 ? "watched" : "alone";
    const client = kind === "watched" ? watcher(station) : null;
    const begun = performance.now();
    await ask(station, { method: "POST", path: "/api/v1/start", local: true });
    await until("the flip", () => station.status().word === "FLIP", 120_000);
    times[kind].push(performance.now() - begun);
    client?.close();
    await ask(station, { method: "POST", path: "/api/v1/stop", local: true });
  }
  const median = (values) => share(values, 0.5);
  tell("acquisition with a client that takes images and patches", 2, 100 * (median(times.watched) / median(times.alone) - 1), "%", 1);
}

/** What a page reads, without a browser that takes the processor on the same machine. */
function watcher(station) {
  const events = hear(station);
  const known = new Set();
  const timer = setInterval(() => {
    for (const side of ["left", "right"]) ask(station, { path: `/api/v1/preview/${side}?or_nothing=true`, local: true }).catch(() => {});
    const job = events.heard.findLast((one) => one.name === "job")?.data;
    for (const name of job?.live ?? []) {
      if (known.has(name)) continue;
      known.add(name);
      ask(station, { path: `/api/v1/jobs/${job.id}/files/live%2F${name}.glb`, local: true }).catch(() => {});
    }
  }, 500);
  return {
    close() {
      clearInterval(timer);
      events.close();
    },
  };
}

const [bin, ...names] = process.argv.slice(2);
const parts = { firstSentence, job, loss, heap, acquisition };
const browser = new Browser();
await browser.start();
for (const name of names.length ? names : Object.keys(parts)) {
  const station = new Station(bin, name === "job" ? JOB_RIG : RIG);
  await station.start();
  try {
    await parts[name](browser, station);
  } catch (error) {
    tell(`${name}: ${error.message}`, 0, null, "");
  } finally {
    await station.remove();
  }
}
await browser.end();
