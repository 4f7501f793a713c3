// Steps that several scenes take.
import assert from "node:assert/strict";
import { request } from "node:http";
import { findings, overflows, press, until, word } from "./browser.mjs";

export async function see(page, wanted, limit_ms = 20_000) {
  let seen = "";
  await until(`the page says ${wanted}`, async () => (seen = await word(page)) === wanted, limit_ms).catch((error) => {
    throw new Error(`${error.message}; it says ${seen}`);
  });
}

/** The page agrees with the daemon, is legible to a screen reader, and fits. */
export async function check(page, station) {
  const status = station.status();
  assert.equal(await page.locator(".sentence").innerText(), status.sentence);
  assert.equal(await page.locator(".next").innerText(), status.next_action);
  assert.deepEqual(await findings(page), []);
  assert.deepEqual(await overflows(page), []);
}

export async function open(browser, station, options) {
  const page = await browser.page(options);
  await page.goto(station.address(options?.role));
  await until("the page has a word", async () => (await page.locator("h1.word").count()) && (await word(page)));
  return page;
}

export async function ready(page) {
  await press(page, "Reset");
  await see(page, "READY", 40_000);
}

/** The newest job, in detail; nothing before there is one, or when the daemon is too busy to answer. */
export function jobOf(station) {
  const told = (...words) => {
    const { status, stdout } = station.scanrig("jobs", ...words, "--json");
    return status === 0 ? JSON.parse(stdout) : undefined;
  };
  const newest = told()?.jobs[0];
  return newest && told(newest.id);
}

/** One request as any client can send it: status and headers, and how many milliseconds the reply took. */
export function ask(station, { method = "GET", path, headers = {}, body, local = false }) {
  const begun = performance.now();
  const where = local ? { socketPath: station.socket } : { host: "127.0.0.1", port: station.port };
  return new Promise((resolve, reject) => {
    const asked = request({ ...where, method, path, headers: { Host: "localhost", ...headers }, agent: false }, (reply) => {
      let text = "";
      reply.on("data", (chunk) => (text += chunk));
      reply.on("end", () => resolve({ status: reply.statusCode, headers: reply.headers, text, ms: performance.now() - begun }));
    });
    asked.on("error", reject);
    asked.end(body);
  });
}
