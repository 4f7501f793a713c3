// scanrig setup on the page, at the simulated wired rig: a person answers in the browser until the service runs on the
// rig.toml that was found. Others try to take part.
// Usage: node setup.mjs BIN [SHOTS], inside `scanrig-sim own-network`. Exit code 77: there is no Chromium here.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { appendFileSync, existsSync, readFileSync, rmSync } from "node:fs";
import { createConnection } from "node:net";
import { join } from "node:path";
import { Browser, Station, findings, overflows, press, sleep, until, word } from "./browser.mjs";
import { ask, open, see } from "./steps.mjs";

const GEAR = "90";
const KEPT = "\n[recipe.kept] # as it was\nviews = 5\nposes = 1\nflip_timeout_min = 1\n";
const LOOK_MS = 60_000; // for ports, lines and cameras
const DOCTOR_MS = 150_000;

/** The wired rig as programs of their own, and the real service over it. */
class WiredStation extends Station {
  async start() {
    this.rig = join(this.folder, "rig");
    this.file = join(this.rig, "rig.toml");
    this.socket = join(this.rig, "api.sock");
    this.port = 8099; // the network is this test's own
    const sim = ["rig", "--dir", this.rig, "--cameras", "gige", "--scale", "0.25", "--voxel-mm", "1"];
    this.wire = spawn(join(this.bin, "scanrig-sim"), sim, { stdio: ["ignore", "pipe", "inherit"] });
    await new Promise((then) => this.wire.stdout.once("data", then));
    appendFileSync(this.file, `http_port = ${this.port}\ntokens = "tokens.json"\n${KEPT}`);
    this.process = spawn(join(this.bin, "scanrigd"), ["--config", this.file], { stdio: ["ignore", "pipe", "pipe"] });
    for (const from of [this.process.stdout, this.process.stderr]) from.on("data", (text) => (this.log += text));
    await until("the service answers", () => this.status() !== null, LOOK_MS);
  }
  /** One request to the rig, as by a hand. */
  hand(request) {
    return new Promise((resolve, reject) => {
      const control = createConnection(join(this.rig, "control.sock"), () => control.write(`${JSON.stringify(request)}\n`));
      control.once("data", (reply) => {
        control.end();
        resolve(JSON.parse(reply));
      });
      control.once("error", reject);
    });
  }
  async remove() {
    await this.end();
    this.wire.kill();
    await new Promise((then) => this.wire.once("exit", then));
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** A cookie of a login of its own. */
async function cookieOf(station, role) {
  const code = station.address(role).split("#code=")[1];
  const told = await ask(station, { method: "POST", path: "/api/v1/login", body: JSON.stringify({ code }) });
  assert.equal(told.status, 200, told.text);
  return told.headers["set-cookie"][0].split(";")[0];
}

const own = { Origin: "http://localhost", "X-Scanrig": "1" };
const post = (station, cookie, path, body = {}, headers = own) =>
  ask(station, { method: "POST", path: `/api/v1/setup/${path}`, headers: { Cookie: cookie, ...headers }, body: JSON.stringify(body) });

/** Refused with one sentence. */
function expectRefused(told, status, words) {
  assert.equal(told.status, status, told.text);
  const { message } = JSON.parse(told.text).error;
  assert.match(message, words);
  assert.ok(!message.includes("\n"), message);
}

/** Who may not take part, while `page` has a question. */
async function attack(station) {
  const engineer = await cookieOf(station, "engineer");
  const operator = await cookieOf(station, "operator");
  const asked = JSON.parse((await ask(station, { path: "/api/v1/setup", headers: { Cookie: engineer } })).text);
  assert.equal(asked.owner, false);
  const reply = { key: "0123456789abcdef", number: asked.question.number, text: GEAR };
  expectRefused(await post(station, engineer, "reply", reply), 409, /another browser replies/);
  expectRefused(await post(station, engineer, "accept", { key: reply.key }), 409, /another browser replies/);
  expectRefused(await post(station, engineer, "begin"), 409, /begun it already/);
  for (const path of ["begin", "end", "reply", "accept", "repeat", "doctor"]) {
    const body = path === "reply" ? reply : path === "begin" || path === "end" ? {} : { key: reply.key };
    expectRefused(await post(station, operator, path, body), 403, /needs the role engineer/);
    const forged = await post(station, engineer, path, body, { ...own, Origin: "http://evil.example" });
    assert.equal(forged.status, 403, `${path}: ${forged.text}`);
  }
  assert.equal((await ask(station, { path: "/api/v1/setup", headers: { Cookie: operator } })).status, 403);
  assert.equal((await ask(station, { path: "/api/v1/setup" })).status, 401);
  const again = JSON.parse((await ask(station, { path: "/api/v1/setup", headers: { Cookie: engineer } })).text);
  assert.deepEqual(again.question, asked.question, "the question stays");
}

async function look(page, name) {
  assert.deepEqual(await findings(page), [], name);
  assert.deepEqual(await overflows(page), [], name);
  const shots = process.argv[3];
  if (shots) await page.screenshot({ path: join(shots, `${name}.png`), fullPage: true });
}

const shows = (page, text) => page.getByText(text, { exact: false }).first().isVisible();

async function holdDown(page, name) {
  const button = page.getByRole("button", { name });
  await button.hover();
  await page.mouse.down();
  await sleep(1300);
  await page.mouse.up();
}

async function begin(page, station) {
  await press(page, "Begin maintenance");
  await see(page, "SERVICE");
  await press(page, "Find the devices");
  await until("setup has the devices", () => station.status()?.sentence.startsWith("Setup has the devices"), LOOK_MS);
  await see(page, "SERVICE", LOOK_MS);
}

/** From the first question to the file. */
async function answerAll(page, narrow, station) {
  await until("the gear is asked for", () => shows(page, "How many turns does the motor make"), LOOK_MS);
  await attack(station);
  await until("another browser reads along", () => shows(narrow, "has begun setup in another browser"));
  await look(page, "setup-gear");
  await look(narrow, "setup-other");
  await page.getByLabel("0.1 to 1000").fill("many");
  await press(page, "Send");
  await until("that is not a reply", () => shows(page, "that is not a reply"));
  await page.getByLabel("0.1 to 1000").fill(GEAR);
  await press(page, "Send");
  await until("the cameras are shown", () => shows(page, "Which camera is on the left"), LOOK_MS);
  const pictures = page.locator(".setup-options img");
  await until("both have a picture", async () => (await pictures.evaluateAll((all) => all.filter((one) => one.naturalWidth > 0).length)) === 2);
  await look(page, "setup-cameras");
  await page.getByRole("button", { name: /SIM-L/ }).click();
  await until("the file is shown", () => shows(page, "This rig.toml was found"), LOOK_MS);
}

/** The doctor, while a person presses what it asks for. */
async function examine(page, station) {
  await press(page, "Run the doctor");
  await until("it asks for the e-stop", () => shows(page, "Press the emergency stop"), DOCTOR_MS);
  await station.hand({ press: "estop" });
  await until("it asks to release it", () => shows(page, "Release the emergency stop"), LOOK_MS);
  await station.hand({ release: "estop" });
  const before = (await station.hand({ get: "truth" })).angle_deg;
  await until("the doctor is done", () => shows(page, "The doctor has examined the rig."), DOCTOR_MS);
  assert.equal((await station.hand({ get: "truth" })).angle_deg, before, "nothing has turned");
}

async function play(browser, station) {
  const old = readFileSync(station.file, "utf8");
  // The service restarts: requests of then are lost.
  const expected = /Failed to load resource|ERR_|409|400|401|403/;
  const page = await open(browser, station, { expected });
  await press(page, "Service");
  await until("the page says what is missing", () => shows(page, "switch maintenance on first"));
  await begin(page, station);
  const narrow = await open(browser, station, { width: 320, height: 700, theme: "light", expected });
  await press(narrow, "Service");
  await answerAll(page, narrow, station);
  assert.equal(readFileSync(station.file, "utf8"), old, "nothing is written before it is accepted");
  await look(page, "setup-found");
  await press(page, "Accept");
  await until("it is written", () => shows(page, "rig.toml is replaced"));
  assert.equal(readFileSync(`${station.file}.old`, "utf8"), old);
  const written = readFileSync(station.file, "utf8");
  for (const kept of [KEPT.trim(), `http_port = ${station.port}`, 'left = { serial = "SIM-L"']) assert.ok(written.includes(kept), written);
  await examine(page, station);
  await look(page, "setup-examined");
  await holdDown(page, "Start the service");
  await see(page, "RESET", LOOK_MS);
  await until("the way on is shown", () => shows(page, "Now press Reset at the rig"));
  await look(page, "setup-next");
  await until("the devices are back", () => station.status()?.devices.every((device) => device.ok), LOOK_MS);

  await begin(page, station);
  await until("it asks again", () => shows(page, "How many turns does the motor make"), LOOK_MS);
  const stopped = await ask(station, { method: "POST", path: "/api/v1/stop", headers: { Cookie: await cookieOf(station, "operator"), ...own } });
  assert.equal(stopped.status, 200, stopped.text);
  await until("Stop gives the devices back", () => station.status()?.machine === "Halted", LOOK_MS);
  await until("the devices are back", () => station.status()?.devices.every((device) => device.ok), LOOK_MS);
  assert.equal(readFileSync(station.file, "utf8"), written);
  await until("the page says what the station says", async () => (await word(page)) === station.status().word);
  for (const one of [page, narrow]) assert.deepEqual(one.wrong, []);
}

async function main() {
  const [bin] = process.argv.slice(2);
  if (!existsSync("/usr/bin/chromium")) {
    console.log("skipped: no /usr/bin/chromium (./dev deps web installs it)");
    return 77;
  }
  const browser = new Browser();
  await browser.start();
  const station = new WiredStation(bin);
  try {
    await station.start();
    await play(browser, station);
    console.log("ok   setup on the page");
    return 0;
  } catch (error) {
    console.log(`FAIL setup on the page: ${error.stack}\n${station.log.slice(-3000)}`);
    return 1;
  } finally {
    await browser.end();
    await station.remove();
  }
}

process.exitCode = await main();
