import assert from "node:assert/strict";
import { test } from "node:test";
import type { JobState } from "../src/api/types.ts";
import { chosen } from "../src/jobs/filter.ts";
import { modelFile } from "../src/model/file.ts";
import { arc, segments } from "../src/parts/ring.ts";
import { badge, bytes } from "../src/words.ts";

const job = { state: "scanning" as JobState, passed: null, stages: [], stored: [], all_views: 16 };

test("a job has one badge, from its state", () => {
  const words = (changes: object) => badge({ ...job, ...changes }).word;
  assert.equal(words({ stored: [{ pose: 0, view: 0, retakes: 0 }] }), "SCANNING 1/16");
  assert.equal(words({ state: "waiting_for_flip" }), "FLIP");
  assert.equal(words({ state: "reconstructing", stages: [{ name: "volume", fraction: 0.5 }] }), "MODEL volume 50 %");
  assert.equal(words({ state: "done", passed: true }), "DONE");
  assert.equal(words({ state: "done", passed: false }), "BELOW LIMITS");
  for (const state of ["queued", "failed", "interrupted", "cancelled"])
    assert.equal(words({ state }), state.toUpperCase());
});

test("the ring has a segment a view, filled in the order of the scan", () => {
  const ring = segments({
    ...job,
    poses: 2,
    views: 8,
    stored: [
      { pose: 1, view: 0, retakes: 0 },
      { pose: 0, view: 0, retakes: 2 },
    ],
  });
  assert.equal(ring.length, 16);
  assert.deepEqual(
    ring.map((one) => one.stored),
    [true, true, ...Array(14).fill(false)],
  );
  assert.deepEqual([ring[0]?.retaken, ring[1]?.retaken], [true, false]);
  assert.ok(ring.every((one, at) => one.from > at / 16 && one.to < (at + 1) / 16));
  assert.equal(segments({ ...job, poses: 0, views: 0, all_views: 0 }).length, 1);
});

test("an arc is clockwise from the top", () => {
  assert.equal(arc(0, 0.25), "M 50.00 8.00 A 42 42 0 0 1 92.00 50.00");
  assert.equal(arc(0, 0.75).split(" ")[7], "1");
});

test("jobs are filtered by queue and trouble", () => {
  const one = (changes: object) => ({ id: "a", ...job, ...changes });
  assert.equal(chosen("queue", one({}), ["a"]), true);
  assert.equal(chosen("queue", one({}), []), false);
  assert.equal(chosen("trouble", one({ state: "failed" }), []), true);
  assert.equal(chosen("trouble", one({ state: "done", passed: false }), []), true);
  assert.equal(chosen("trouble", one({ state: "done", passed: true }), []), false);
  assert.equal(chosen("all", one({}), []), true);
});

test("the reduced model is shown where there is one", () => {
  const files = (...paths: string[]) => ({ files: paths.map((path) => ({ path, bytes: 1, type: "" })) });
  assert.equal(modelFile(files("model/model.glb", "model/view.glb")), "model/view.glb");
  assert.equal(modelFile(files("model/model.obj", "model/model.glb")), "model/model.glb");
  assert.equal(modelFile(files("model/report.json")), undefined);
});

test("bytes for people", () => {
  assert.deepEqual([0, 999, 1500, 250_000, 3_200_000_000].map(bytes), ["0 B", "999 B", "1.5 kB", "250 kB", "3.2 GB"]);
});
