// What a person does on the page, in a browser, against the daemon over a simulated rig.
// Usage: node scenarios.mjs BIN [NAME...]. Exit code 77: there is no Chromium here.
import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { Browser, Station } from "./browser.mjs";
import { scenarios as ofRig } from "./scenes_rig.mjs";
import { scenarios as ofTrust } from "./scenes_trust.mjs";

const RIG = ["--scale", "0.5", "--views", "3", "--voxel-mm", "1"];
const ALONE = ["--operator", "none"];
const scenarios = { ...ofRig, ...ofTrust };

async function play(name, bin, browser) {
  const began = performance.now();
  const station = new Station(bin, [...RIG, ...(scenarios[name].rig ?? ALONE)]);
  const pages = [];
  const counted = { page: async (options) => pages[pages.push(await browser.page(options)) - 1] };
  try {
    await station.start();
    await scenarios[name]({ browser: counted, station });
    for (const page of pages) assert.deepEqual(page.wrong, [], "errors of the page");
    console.log(`ok   ${name}, ${((performance.now() - began) / 1000).toFixed(1)} s`);
    return true;
  } catch (error) {
    console.log(`FAIL ${name}: ${error.stack}\n${station.log.slice(-1500)}`);
    return false;
  } finally {
    for (const page of pages) await page.context().close();
    await station.remove();
  }
}

async function main() {
  const [bin, ...names] = process.argv.slice(2);
  if (!existsSync("/usr/bin/chromium")) {
    console.log("skipped: no /usr/bin/chromium (./dev deps web installs it)");
    return 77;
  }
  const browser = new Browser();
  await browser.start();
  const wanted = names.length ? names : Object.keys(scenarios);
  const passed = [];
  const playAll = async (left) => {
    while (left.length) passed.push(await play(left.shift(), bin, browser));
  };
  const atRig = wanted.filter((name) => name in ofRig);
  await Promise.all([playAll(atRig), playAll(atRig)]); // most of a scene is waiting
  await playAll(wanted.filter((name) => !(name in ofRig))); // alone: they say how soon a Stop must be answered
  await browser.end();
  return passed.length === wanted.length && passed.every(Boolean) ? 0 : 1;
}

process.exitCode = await main();
