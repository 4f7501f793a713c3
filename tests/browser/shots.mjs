// Pictures of the page for the documents: node shots.mjs BIN FOLDER. The same rig and object every time.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { Browser, Station, press, sleep, until } from "./browser.mjs";
import { jobOf, open, ready, see } from "./steps.mjs";

const RIG = ["--scale", "0.5", "--views", "4", "--voxel-mm", "0.5", "--seed", "1", "--background-cameras"];
const SIZES = { desk: { width: 1280, height: 800 }, phone: { width: 390, height: 844, touch: true } };
const [bin, folder] = process.argv.slice(2);

mkdirSync(folder, { recursive: true });
const browser = new Browser();
await browser.start();

/** Lets `act` take pictures of a station with this operator: (station, pages by size, shoot, show). */
async function at(operator, act) {
  const station = new Station(bin, [...RIG, "--operator", operator]);
  await station.start();
  const pages = {};
  const shoot = async (what) => {
    await sleep(700);
    for (const [name, page] of Object.entries(pages)) {
      await page.evaluate(() => scrollTo(0, 0));
      await page.screenshot({ path: join(folder, `web-${what}-${name}.png`) });
    }
  };
  const show = async (key) => {
    for (const page of Object.values(pages)) await page.keyboard.press(key);
  };
  try {
    for (const [name, size] of Object.entries(SIZES)) pages[name] = await open(browser, station, size);
    await act(station, pages, shoot, show);
  } finally {
    for (const page of Object.values(pages)) await page.context().close();
    await station.remove();
  }
}

/** Nobody turns the part over: the flip waits. */
async function scan(station, pages, shoot) {
  await ready(pages.desk);
  await shoot("ready");
  await press(pages.desk, "START");
  await until("views are stored", () => jobOf(station)?.stored.length >= 2, 60_000);
  await until("they are shown", () => pages.desk.locator(".live").count(), 150_000);
  await shoot("scanning");
  await see(pages.desk, "FLIP", 200_000);
  await sleep(3000);
  await shoot("flip");
}

/** The operator turns the part over and continues. */
async function model(station, pages, shoot, show) {
  await see(pages.desk, "READY", 60_000);
  await press(pages.desk, "START");
  const ended = () => ["done", "failed"].find((state) => state === jobOf(station)?.state);
  if ((await until("the job ends", ended, 300_000)) === "failed") throw new Error("the job failed: nothing to show");
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
}

try {
  await at("none", scan);
  await at("helper", model);
} finally {
  await browser.end();
}
