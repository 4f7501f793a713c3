// Logins that lapse, sites that forge, clients that crowd: the page is refused what is not its own, and Stop works.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { connect } from "node:net";
import { Station, press, sleep, until, word } from "./browser.mjs";
import { ask, check, jobOf, open, ready, see } from "./steps.mjs";

const STOP_MS = 100;
/** Seeds of --trouble 1 under which nothing else happens first, nor while the exposure is repeated. */
const SEED_OF_FAULT = { estop: 10, guard: 14, cameras: 609, table: 20 };
const REASON_OF_FAULT = { estop: /e-stop/i, guard: /guard/i, cameras: /camera/i, table: /table/i };

/** Until the page is busy with a scan. */
async function scanning(page, station) {
  await ready(page);
  await press(page, "START");
  await until("the rig is busy", () => station.status().job);
}

async function expectStopIn(station, limit_ms, words) {
  for (const local of [true, false]) {
    const headers = local ? {} : { Cookie: station.cookie, Origin: "http://localhost", "X-Scanrig": "1" };
    const told = await ask(station, { method: "POST", path: "/api/v1/stop", headers, local });
    assert.equal(told.status, 200, `${words}: ${told.text}`);
    assert.ok(told.ms <= limit_ms, `Stop ${local ? "over the Unix socket" : "by cookie"} took ${told.ms.toFixed(0)} ms, ${words}`);
  }
}

/** A cookie of a login of its own, for requests that no browser sends. */
async function logIn(station, role = "operator") {
  const code = station.address(role).split("#code=")[1];
  const told = await ask(station, { method: "POST", path: "/api/v1/login", body: JSON.stringify({ code }) });
  assert.equal(told.status, 200, told.text);
  station.cookie = told.headers["set-cookie"][0].split(";")[0];
}

export const scenarios = {
  /** Whatever befalls the rig in its first exposures, the page has the daemon's sentence; nobody mends it. */
  faults: Object.assign(
    async ({ browser, station }) => {
      for (const [what, seed] of Object.entries(SEED_OF_FAULT)) {
        const troubled = new Station(station.bin, [...station.options, "--seed", seed]);
        try {
          await troubled.start();
          const page = await open(browser, troubled, {});
          await ready(page);
          await press(page, "START");
          await until(`the rig is stopped by ${what}`, () => REASON_OF_FAULT[what].test(troubled.status().cause), 60_000);
          await until("it stands", () => troubled.status().activity === "none");
          await until("the page says why", async () => (await page.locator(".cause").innerText()) === troubled.status().cause);
          await check(page, troubled);
          await page.context().close();
        } finally {
          await troubled.remove();
        }
      }
    },
    { rig: ["--operator", "none", "--trouble", "1"] },
  ),

  /** A login that is ended elsewhere: the page asks for one, and the rig goes on. */
  async login({ browser, station }) {
    const page = await open(browser, station, { expected: /401/ });
    await page.evaluate(() => fetch("/api/v1/login", { method: "DELETE", headers: { "X-Scanrig": "1" } }).then((r) => r.status));
    await page.reload();
    await until("the page asks for a login", () => page.locator("main.login").isVisible());
    await page.getByLabel("Token or code").fill("scanrig_nobody");
    await press(page, "Log in");
    await until("it says why not", () => page.getByRole("alert").isVisible());
    await page.getByLabel("Token or code").fill(station.address().split("#code=")[1]);
    await press(page, "Log in");
    await until("the page is back", async () => (await page.locator("h1.word").count()) && (await word(page)));
    await check(page, station);
  },

  /** Names, origins and frames of other sites. */
  async forged({ browser, station }) {
    const page = await open(browser, station, { expected: /frame|ERR_BLOCKED|Content Security|X-Frame/i });
    await logIn(station);
    const order = (headers) => ask(station, { method: "POST", path: "/api/v1/reset", headers: { Cookie: station.cookie, ...headers } });
    for (const headers of [
      { "X-Scanrig": "1", Origin: "http://evil.example" },
      { "X-Scanrig": "1", Origin: "null" },
      { "X-Scanrig": "1" },
      { Origin: "http://localhost" },
    ]) {
      assert.equal((await order(headers)).status, 403, JSON.stringify(headers));
    }
    await expectStopIn(station, STOP_MS, "after orders of other sites");
    assert.equal((await ask(station, { path: "/", headers: { Host: "evil.example" } })).status, 421);
    for (const path of ["/assets/../secret", "/assets/%2e%2e/secret", "/assets/..%2fsecret", "/assets//etc/passwd"]) {
      const told = await ask(station, { path });
      assert.ok([400, 401, 404].includes(told.status), `${path}: ${told.status}`);
    }
    const split = await ask(station, { path: "/api/v1/jobs/a%0d%0aSet-Cookie:%20x=1", headers: { Cookie: station.cookie } });
    assert.ok(split.status >= 400 && !split.headers["set-cookie"], "no header from a path");
    const site = createServer((_, reply) => {
      reply.setHeader("Content-Type", "text/html");
      reply.end(`<iframe src="http://127.0.0.1:${station.port}/"></iframe>`);
    }).listen(0, "127.0.0.1");
    await new Promise((then) => site.once("listening", then));
    await page.goto(`http://127.0.0.1:${site.address().port}/`);
    await sleep(1000);
    const framed = page.frames().find((frame) => frame !== page.mainFrame());
    assert.equal(await framed.locator("h1.word").count().catch(() => 0), 0, "the page is in another site's frame");
    await expectStopIn(station, STOP_MS, "beside a frame in another site");
    site.close();
    site.closeAllConnections();
  },

  /** 300 connections that say nothing, from four addresses. */
  async seats({ browser, station }) {
    const page = await open(browser, station, {});
    await scanning(page, station);
    await logIn(station);
    const idle = Array.from({ length: 300 }, (_, i) =>
      connect({ host: "127.0.0.1", port: station.port, localAddress: `127.0.0.${1 + (i % 4)}` }).on("error", () => {}),
    );
    await sleep(500);
    await expectStopIn(station, STOP_MS, "beside 300 idle connections");
    await until("the job is interrupted", () => jobOf(station)?.state === "interrupted");
    for (const one of idle) one.destroy();
  },

  /** Seven pages of one browser and two slow downloads. */
  async tabs({ browser, station }) {
    const page = await open(browser, station, {});
    await scanning(page, station);
    await logIn(station);
    const more = [];
    for (let i = 0; i < 6; i++) more.push(await open(browser, station, {}));
    await until("a view is stored", () => jobOf(station)?.stored.length > 0, 40_000);
    const file = `/api/v1/jobs/${jobOf(station).id}/files/pose1%2Fview00%2Fleft_pattern.png`;
    const slow = [0, 1].map(() => {
      const socket = connect({ host: "127.0.0.1", port: station.port }).on("error", () => {});
      socket.write(`GET ${file} HTTP/1.1\r\nHost: localhost\r\nCookie: ${station.cookie}\r\n\r\n`);
      return socket.pause();
    });
    await expectStopIn(station, STOP_MS, "beside seven pages and two slow downloads");
    for (const one of more) await see(one, station.status().word, 5000);
    for (const one of slow) one.destroy();
  },
};
