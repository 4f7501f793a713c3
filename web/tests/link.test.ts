import assert from "node:assert/strict";
import { test } from "node:test";
import { broken, heard, isDeaf, isOld, newLink, noteChange, opened, retryAfter } from "../src/api/link.ts";

test("a page is old until it is connected, and after a second of silence", () => {
  const fresh = newLink(0);
  assert.equal(isOld(fresh, 0), true);
  const open = opened(fresh, 1000);
  assert.equal(isOld(open, 1900), false);
  assert.equal(isOld(open, 2001), true);
  assert.equal(isOld(heard(open, 2000), 2900), false);
  assert.equal(isOld(broken(open), 1001), true);
});

test("it tries again after 0.25 to 2 s, and at once quickly after a success", () => {
  let link = newLink(0);
  const waits = [1, 2, 3, 4, 5, 6].map(() => {
    link = broken(link);
    return retryAfter(link);
  });
  assert.deepEqual(waits, [250, 500, 1000, 2000, 2000, 2000]);
  assert.equal(retryAfter(broken(opened(link, 9))), 250);
});

test("it is deaf for a moment after what may be pressed has changed, and only then", () => {
  const open = opened(newLink(0), 1000);
  assert.equal(isDeaf(open, 1399), true);
  assert.equal(isDeaf(open, 1401), false);
  assert.equal(isDeaf(noteChange(open, "begin-1", "begin-1", 5000), 5001), false);
  assert.equal(isDeaf(noteChange(open, "begin-1", "continue-1", 5000), 5001), true);
});
