import assert from "node:assert/strict";
import { test } from "node:test";
import { figuresOf } from "../src/model/report.ts";
import { topFor } from "../src/model/scale.ts";
import { exposureOf, sharpnessOf } from "../src/service/sharpness.ts";
import { deviationColour, isOutside } from "../src/view3d/colourings.ts";
import { cutAt } from "../src/view3d/outline.ts";
import { minutesSince, words } from "../src/words.ts";

/** A picture of vertical stripes, their edges `soft` pixels wide. */
function stripes(soft: number, light = 1) {
  const [width, height] = [64, 16];
  const data = new Uint8ClampedArray(4 * width * height);
  for (let i = 0; i < width * height; i++) {
    const phase = (i % width) % 16;
    const edge = Math.min(Math.max((Math.abs(phase - 8) - 4) / soft + 0.5, 0), 1);
    data.fill(Math.round(light * (40 + 180 * edge)), 4 * i, 4 * i + 3);
  }
  return { width, height, data };
}

test("a picture in focus is sharper, and brightness alone is not sharpness", () => {
  const [sharp, soft] = [sharpnessOf(stripes(1)), sharpnessOf(stripes(5))];
  assert.ok(sharp > 2 * soft, `${sharp} and ${soft}`);
  assert.ok(Math.abs(sharpnessOf(stripes(1, 0.5)) / sharp - 1) < 0.05);
  assert.equal(sharpnessOf({ width: 4, height: 4, data: new Uint8ClampedArray(64) }), 0);
});

test("shares of dark and overexposed pixels", () => {
  const data = new Uint8ClampedArray(4 * 4).fill(128);
  data.fill(255, 0, 4);
  data.fill(3, 4, 8);
  assert.deepEqual(exposureOf({ width: 2, height: 2, data }), { dark: 0.25, bright: 0.25 });
});

test("a plane cuts a tetrahedron in a triangle, and misses it above", () => {
  const points = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0]);
  const surface = { points, corners: [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3] };
  const cut = cutAt(surface, 0.5);
  assert.equal(cut.length, 3 * 6, "three segments");
  for (let i = 1; i < cut.length; i += 3) assert.equal(cut[i], 0.5);
  const ends = new Map<string, number>();
  for (let i = 0; i < cut.length; i += 3) {
    const end = `${cut[i]?.toFixed(4)} ${cut[i + 2]?.toFixed(4)}`;
    ends.set(end, (ends.get(end) ?? 0) + 1);
  }
  assert.deepEqual([...ends.values()], [2, 2, 2], "closed");
  assert.equal(cutAt(surface, 2).length, 0);
});

test("the age of a report", () => {
  const at = (later_s: number) =>
    words.ago(minutesSince("2026-11-26T06:00:00Z", Date.UTC(2026, 10, 26, 6, 0, later_s)));
  assert.equal(at(-3600), "just now");
  assert.equal(at(59), "just now");
  assert.equal(at(60), "1 min ago");
  assert.equal(at(2 * 3600), "2 h ago");
  assert.equal(at(47 * 3600), "47 h ago");
  assert.equal(at(72 * 3600), "3 days ago");
});

test("a deviation is blue inside, white on the reference, orange outside, grey where it is not known", () => {
  const [inside, on, outside, unknown] = [-200, 0, 200, -32768].map((um) => deviationColour(um, 200));
  assert.ok(inside && on && outside && unknown);
  assert.ok(inside.b > 2 * inside.r && outside.r > 2 * outside.b);
  assert.ok(on.r > 0.8 && Math.abs(on.r - on.b) < 0.01);
  assert.ok(unknown.r < 0.3 && Math.abs(unknown.r - unknown.b) < 0.1);
  assert.deepEqual(deviationColour(5000, 200), outside);
  assert.deepEqual(
    [-201, -200, 200, 201, -32768].map((um) => isOutside(um, 200)),
    [true, false, false, true, false],
  );
});

test("the scale holds 95 % of the vertices", () => {
  assert.deepEqual([0.01, 0.05, 0.051, 0.9, 80].map(topFor), [0.05, 0.05, 0.1, 1, 5]);
});

test("what the report says of a model, pose by pose", () => {
  const known = (deg: number, mm: number) => ({
    rotation_deg: { sigma: [deg, 0.001, 0.001] },
    translation_mm: { sigma: [mm, 0.001, 0.001] },
  });
  const two = figuresOf({
    poses: [{ residual_median_mm: 0.011 }, { residual_median_mm: 0.0134 }],
    pose_refinement: { uncertainty: known(0.0043, 0.0069) },
    mesh: { area_mm2: 12345, measured_share: 0.9973, volume_mm3: 45678 },
  });
  assert.deepEqual(
    two.map(({ name, text }) => `${name}: ${text}`),
    [
      "Surface: 123.5 cm², 99.7 % measured",
      "Volume: 45.68 cm³",
      "Views: agree to 0.013 mm (median)",
      "Pose 2: ± 0.0043° and ± 0.0069 mm in the least certain direction (k = 1)",
    ],
  );
  const three = figuresOf({
    pose_refinement: {
      turn_is_open: true,
      poses: [
        { pose: 1, uncertainty: known(0.01, 0.02) },
        { pose: 2, uncertainty: known(40, 0.03) },
      ],
    },
  });
  assert.deepEqual(
    three.map(({ name }) => name),
    ["Pose 2", "Pose 3"],
  );
  assert.match(three[1]?.text ?? "", /^± 0.0300 mm .* any turn/);
  assert.deepEqual(figuresOf({}), []);
});
