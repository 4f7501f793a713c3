// What a person does at the page while the rig works.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { findings, overflows, press, sleep, until, word } from "./browser.mjs";
import { check, jobOf, open, ready, see } from "./steps.mjs";

const STL_HEAD = 84; // bytes before the triangles
const STL_TRIANGLE = 50;
const MODEL_LIMIT_MS = 240_000;

/** A binary STL file, each corner elsewhere: what a design's mesh in its own frame is. */
function movedStl(bytes, move) {
  const moved = Buffer.from(bytes);
  for (let at = STL_HEAD; at + STL_TRIANGLE <= moved.length; at += STL_TRIANGLE) {
    for (let corner = at + 12; corner < at + 48; corner += 12) {
      const to = move([0, 4, 8].map((k) => bytes.readFloatLE(corner + k)));
      for (const k of [0, 1, 2]) moved.writeFloatLE(to[k], corner + 4 * k);
    }
  }
  return moved;
}

const WIDTHS = [320, 390, 700, 1280, 1920];

export const scenarios = {
  /** From Reset to the end of the scan by touch and keys; the ring shows what is stored. */
  async job({ browser, station }) {
    const page = await open(browser, station, { touch: true });
    await check(page, station);
    await ready(page);
    await check(page, station);
    await page.getByRole("button", { name: "START", exact: true }).tap();
    await see(page, "FLIP", 60_000);
    assert.ok((await page.locator(".next").innerText()).includes("press Start"), "the button has the sentence's word");
    const stored = await page.locator(".head .ring-stored").count();
    assert.equal(stored, 3, "views of the first pose");
    await check(page, station);
    await until("it may be pressed", () => page.getByRole("button", { name: "START", exact: true }).isEnabled());
    await page.getByRole("button", { name: "START", exact: true }).focus();
    await page.keyboard.press("Enter");
    await until("the scan is over", () => ["reconstructing", "done", "failed"].includes(jobOf(station)?.state), 60_000);
    await page.keyboard.press("2");
    await until("the list of jobs", async () => (await page.locator("main .badge").count()) === 1);
    await check(page, station);
  },

  /** The daemon's sentence, whatever stops the rig: here Stop in motion. */
  async stop({ browser, station }) {
    const page = await open(browser, station, {});
    await ready(page);
    await press(page, "START");
    await until("the table moves", () => station.status().activity !== "none" && station.status().standstill === "moving");
    await page.keyboard.press("x");
    await until("the daemon has stopped", () => jobOf(station)?.state === "interrupted");
    await until("the page has the sentence", async () => (await page.locator(".sentence").innerText()) === station.status().sentence);
    await check(page, station);
    await page.keyboard.press("2");
    await until("it can be resumed", () => page.getByRole("button", { name: "Resume" }).isVisible());
  },

  /** A daemon that is killed, and one that hangs: grey with the age, STOP not delivered, then the truth again. */
  async lost({ browser, station }) {
    const page = await open(browser, station, { expected: /Failed to load resource|ERR_/ });
    await ready(page);
    station.process.kill("SIGSTOP");
    await until("the page is grey", () => page.locator(".old").count(), 3000);
    await until("it says so", async () => /Connection lost\. Last known state \d+ s ago\./.test(await page.locator(".banner").innerText()));
    await page.locator("button.stop").dispatchEvent("pointerdown");
    await until("STOP is not delivered", async () => (await page.locator(".stop-place").innerText()).includes("NOT DELIVERED"), 4000);
    station.process.kill("SIGCONT");
    await until("it is back", async () => (await page.locator(".old").count()) === 0, 6000);
    await press(page, "START");
    await until("views are stored", () => jobOf(station)?.stored.length > 0, 40_000);
    await station.end("SIGKILL");
    await until("the page is grey", () => page.locator(".old").count(), 3000);
    await station.start();
    await until("it shows the new daemon's state", async () => (await word(page)) === station.status().word && !(await page.locator(".old").count()), 15_000);
    await check(page, station);
    await page.keyboard.press("2");
    await until("it can be resumed", () => page.getByRole("button", { name: "Resume" }).isVisible());
  },

  /** Two pages press Continue, one of them late: it counts once, and the late one is told. */
  async twice({ browser, station }) {
    const page = await open(browser, station, {});
    await ready(page);
    const order = (offer) =>
      page.evaluate(
        (body) => fetch("/api/v1/start", { method: "POST", headers: { "X-Scanrig": "1" }, body }).then((reply) => reply.status),
        JSON.stringify({ offer }),
      );
    const { offer } = station.status().actions.start;
    const seen = await Promise.all([order(offer), order(offer)]);
    assert.ok(seen.includes(200) && !seen.some((status) => status !== 200 && status !== 409), `${seen}`);
    await see(page, "FLIP", 60_000);
    page.wrong.length = 0; // a refusal is a failed request
    assert.equal(await order(offer), 409, "the first Start, late");
    await sleep(1000);
    assert.equal(station.status().word, "FLIP", "nothing moved");
    page.wrong.length = 0;
  },

  /** A viewer has no Start, is refused when it forces one, and stops the rig all the same. */
  async viewer({ browser, station }) {
    const page = await open(browser, station, { role: "viewer", expected: /403/ });
    assert.equal(await page.getByRole("button", { name: "START" }).count(), 0);
    const forced = await page.evaluate(() =>
      fetch("/api/v1/start", { method: "POST", headers: { "X-Scanrig": "1" } }).then((reply) => reply.status));
    assert.equal(forced, 403);
    const engineer = await open(browser, station, {});
    await ready(engineer);
    await press(engineer, "START");
    await until("the rig is busy", () => station.status().job);
    await page.locator("button.stop").dispatchEvent("pointerdown");
    await until("STOP was sent", async () => (await page.locator(".stop-place").innerText()).includes("STOP SENT"));
    await until("the job is interrupted", () => jobOf(station)?.state === "interrupted");
    await until("the other page says what was ordered", () => engineer.getByText(/^Last order: stop \(127\.0\.0\.1\), [\d:]+\.$/).count());
    await check(page, station);
  },

  /** A model against two references: its own surface, turned, and one squeezed flat, which is refused. */
  deviation: Object.assign(
    async ({ browser, station }) => {
      const page = await open(browser, station, { expected: /409/ });
      await see(page, "READY", 60_000);
      await press(page, "START");
      const ended = () => ["done", "failed"].find((state) => state === jobOf(station)?.state);
      assert.equal(await until("the job ends", ended, MODEL_LIMIT_MS), "done");
      const { id } = jobOf(station);
      const jobs = join(station.folder, "jobs");
      const own = readFileSync(join(jobs, id, "model", "model.stl"));
      const references = { turned: ([x, y, z]) => [z + 300, x - 20, y], flat: ([x, y, z]) => [x, 0.2 * y, z] };
      for (const [name, move] of Object.entries(references)) {
        const file = join(station.folder, `${name}.stl`);
        writeFileSync(file, movedStl(own, move));
        const added = station.command("reference", "add", file, "--jobs", jobs);
        assert.equal(added.status, 0, added.stderr);
      }
      await page.evaluate((job) => (location.hash = `model/${job}`), id);
      const choice = page.getByLabel("Compare with");
      await until("references are offered", () => choice.count(), 30_000);
      await choice.selectOption("turned");
      const look = page.getByRole("button", { name: "Deviation" });
      await until("the model is coloured", () => look.count(), 60_000);
      assert.equal(await look.getAttribute("aria-pressed"), "true");
      const told = await page.getByText(/^Best fit:/).innerText();
      const within = Number(/95 % within ([\d.]+) mm/.exec(told)?.[1]);
      assert.ok(within < 0.05, `its own surface: ${told}`);
      await check(page, station);
      await choice.selectOption("flat");
      await until("it is refused", () => page.getByText(/the reference does not fit/).count(), 60_000);
      assert.equal(await look.count(), 0, "no colouring by what does not fit");
      await check(page, station);
    },
    { rig: ["--operator", "helper", "--clock", "virtual"] },
  ),

  /** Every screen in both themes and from 320 to 1920 px: nothing sticks out, nothing is illegible. */
  async layout({ browser, station }) {
    for (const theme of ["dark", "light"]) {
      const page = await open(browser, station, { theme });
      for (const width of WIDTHS) {
        await page.setViewportSize({ width, height: 900 });
        for (const key of ["1", "2", "3", "4", "5"]) {
          await page.keyboard.press(key);
          await sleep(150);
          assert.deepEqual(await overflows(page), [], `${theme}, ${width} px, screen ${key}`);
          const box = await page.locator("button.stop").boundingBox();
          assert.ok(box.width >= 64 && box.height >= 64 && box.x >= 0 && box.x + box.width <= width, "STOP is there whole");
          if (width === 390 || width === 1280) assert.deepEqual(await findings(page), [], `${theme}, ${width} px, screen ${key}`);
        }
      }
      assert.deepEqual(page.wrong, []);
    }
  },
};
