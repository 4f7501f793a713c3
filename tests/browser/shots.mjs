// Pictures of the page for the documents: node shots.mjs BIN FOLDER. The same rig and object every time.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { Browser, Station, press, sleep, until } from "./browser.mjs";
import { jobOf, open, ready, see } from "./steps.mjs";

const RIG = ["--operator", "none", "--scale", "0.5", "--views", "4", "--voxel-mm", "0.5", "--seed", "1", "--background-cameras"];
const SIZES = { desk: { width: 1280, height: 800 }, phone: { width: 390, height: 844, touch: true } };
const [bin, folder] = process.argv.slice(2);

mkdirSync(folder, { recursive: true });
const browser = new Browser();
await browser.start();
const station = new Station(bin, RIG);
await station.start();
const pages = {};
for (const [name, size] of Object.entries(SIZES)) pages[name] = await open(browser, station, size);

/** Every size of what is shown now. */
async function shoot(what) {
  await sleep(700);
  for (const [name, page] of Object.entries(pages)) {
    await page.evaluate(() => scrollTo(0, 0));
    await page.screenshot({ path: join(folder, `web-${what}-${name}.png`) });
  }
}
async function show(key) {
  for (const page of Object.values(pages)) await page.keyboard.press(key);
}

try {
  await ready(pages.desk);
  await shoot("ready");
  await press(pages.desk, "START");
  await until("views are stored", () => jobOf(station)?.stored.length >= 2, 60_000);
  await until("they are shown", () => pages.desk.locator(".live").count(), 150_000);
  await shoot("scanning");
  await see(pages.desk, "FLIP", 200_000);
  await sleep(3000);
  await shoot("flip");
  await until("it may be pressed", () => pages.desk.getByRole("button", { name: "CONTINUE", exact: true }).isEnabled());
  await press(pages.desk, "CONTINUE");
  await until("the model is made", () => jobOf(station)?.state === "done", 900_000);
  await show("2");
  await shoot("jobs");
  for (const page of Object.values(pages)) {
    await page.evaluate((id) => (location.hash = `model/${id}`), jobOf(station).id);
    await until("the model is shown", () => page.getByRole("button", { name: "Sigma" }).count(), 60_000);
  }
  await shoot("model");
  await show("e");
  await shoot("sigma");
  await show("4");
  await shoot("calibrate");
  await show("5");
  await shoot("service");
  await show("1");
  station.process.kill("SIGSTOP");
  await sleep(3000);
  await shoot("lost");
  station.process.kill("SIGCONT");
} finally {
  await browser.end();
  await station.remove();
}
