// Debian's Chromium against a daemon of its own: what every scenario starts from.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const require = createRequire(new URL("../../web/package.json", import.meta.url));
const { chromium } = require("playwright-core");
const axe = require("axe-core").source;

const READY_MS = 60_000;
const OFFLINE = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic"];

export const sleep = (ms) => new Promise((then) => setTimeout(then, ms));

/** Until `what` is true, or a failure that says what was waited for. */
export async function until(words, what, limit_ms = 20_000) {
  const limit = performance.now() + limit_ms;
  for (;;) {
    const got = await what();
    if (got) return got;
    if (performance.now() > limit) throw new Error(`not within ${limit_ms / 1000} s: ${words}`);
    await sleep(50);
  }
}

async function freePort() {
  const server = createServer().listen(0, "127.0.0.1");
  await new Promise((then) => server.once("listening", then));
  const { port } = server.address();
  await new Promise((then) => server.close(then));
  return port;
}

/** The simulated rig with its daemon, on a port of its own. */
export class Station {
  constructor(bin, options = []) {
    this.bin = bin;
    this.options = options;
    this.folder = mkdtempSync(join(tmpdir(), "scanrig-browser-"));
    this.socket = join(this.folder, "api.sock");
    this.log = "";
  }
  async start() {
    this.port ??= await freePort();
    const words = ["--http-port", this.port, "--socket", this.socket, "--jobs", join(this.folder, "jobs"), ...this.options];
    this.process = spawn(join(this.bin, "scanrigd-sim"), words.map(String), { stdio: ["ignore", "pipe", "pipe"] });
    for (const from of [this.process.stdout, this.process.stderr]) from.on("data", (text) => (this.log += text));
    await until("the daemon answers", () => this.status() !== null, READY_MS);
  }
  /** A verb that needs no daemon. */
  command(...words) {
    return spawnSync(join(this.bin, "scanrig"), words, { encoding: "utf8" });
  }
  scanrig(...words) {
    return this.command(...words, "--socket", this.socket);
  }
  status() {
    const told = this.scanrig("status", "--json");
    return told.status === 0 ? JSON.parse(told.stdout) : null;
  }
  /** An address that logs a browser in. */
  address(role = "engineer") {
    const told = this.scanrig("open", "--role", role, "--json");
    const { address, code } = JSON.parse(told.stdout);
    return `${address}/#code=${code}`;
  }
  async end(signal = "SIGTERM") {
    if (this.process.exitCode !== null || this.process.signalCode) return;
    this.process.kill(signal);
    await new Promise((then) => this.process.once("exit", then));
  }
  async remove() {
    await this.end();
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** A browser, and pages of it that count what must not happen: errors, reports of the policy, requests elsewhere. */
export class Browser {
  async start() {
    this.browser = await chromium.launch({
      executablePath: "/usr/bin/chromium",
      args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--no-first-run", ...OFFLINE],
    });
  }
  async page({ width = 1280, height = 800, theme = "dark", touch = false, expected = /^$/ } = {}) {
    const context = await this.browser.newContext({ viewport: { width, height }, colorScheme: theme, hasTouch: touch });
    const page = await context.newPage();
    page.wrong = [];
    page.on("console", (message) => {
      if (message.type() === "error" && !expected.test(message.text())) page.wrong.push(message.text());
    });
    page.on("pageerror", (error) => page.wrong.push(String(error)));
    page.on("request", (request) => {
      const url = new URL(request.url());
      if (url.protocol !== "blob:" && url.hostname !== "127.0.0.1") page.wrong.push(`request to ${url.hostname}`);
    });
    return page;
  }
  async end() {
    await this.browser.close();
  }
}

/** What axe finds against WCAG 2 A and AA, as sentences. The policy forbids inline scripts: axe comes from outside it. */
export async function findings(page) {
  const client = await page.context().newCDPSession(page);
  const run = `${axe}; axe.run({ runOnly: ["wcag2a", "wcag2aa", "wcag21aa"] }).then((found) => JSON.stringify(
    found.violations.map((one) => one.id + ": " + one.nodes.map((node) => node.target.join(" ")).join(", "))))`;
  const told = await client.send("Runtime.evaluate", { expression: run, awaitPromise: true, returnByValue: true });
  return JSON.parse(told.result.value);
}

/** Elements that stick out of the page, or text that is cut off. */
export const overflows = (page) =>
  page.evaluate(() => (document.documentElement.scrollWidth > innerWidth ? [`page is ${document.documentElement.scrollWidth} px wide`] : []));

export const word = (page) => page.locator("h1.word").innerText();
export const press = (page, name) => page.getByRole("button", { name, exact: true }).click();
