// The middle of both images in full resolution, how sharp it is, and the sharpest so far: to turn a lens by.
import { useSignal } from "@preact/signals";
import { usePreview } from "../parts/preview.ts";
import { words } from "../words.ts";
import { type Exposure, exposureOf, sharpnessOf } from "./sharpness.ts";

const PERIOD_MS = 300;

interface Seen {
  sharpness: number;
  best: number;
  exposure: Exposure;
}

async function pixelsOf(blob: Blob): Promise<ImageData> {
  const bitmap = await createImageBitmap(blob);
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = canvas.getContext("2d");
  if (!context) throw new Error("no canvas");
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

function Eye({ side }: { side: "left" | "right" }) {
  const seen = useSignal<Seen | null>(null);
  const { url, old } = usePreview(`${side}?or_nothing=true&middle=true`, PERIOD_MS, async (image) => {
    const pixels = await pixelsOf(image);
    const sharpness = sharpnessOf(pixels);
    seen.value = { sharpness, best: Math.max(sharpness, seen.value?.best ?? 0), exposure: exposureOf(pixels) };
  });
  const now = seen.value;
  return (
    <figure class={`picture focus ${old.value ? "picture-old" : ""}`}>
      {url.value ? <img src={url.value} alt={words[side]} /> : <span>{words.noPicture}</span>}
      <figcaption>
        {words[side]}
        {now && (
          <>
            <meter min={0} max={now.best || 1} value={now.sharpness} aria-label={words.sharpness} />
            {words.sharpnessOf(now.sharpness / (now.best || 1))}{" "}
            {words.exposure(now.exposure.dark, now.exposure.bright)}
          </>
        )}
      </figcaption>
    </figure>
  );
}

export function FocusCard() {
  const open = useSignal(false);
  return (
    <section class="card">
      <h2>{words.focus}</h2>
      <p class="dim">{words.focusHint}</p>
      <button
        type="button"
        aria-pressed={open.value}
        onClick={() => {
          open.value = !open.value;
        }}
      >
        {open.value ? words.focusEnd : words.focusBegin}
      </button>
      {open.value && (
        <div class="pictures">
          <Eye side="left" />
          <Eye side="right" />
        </div>
      )}
    </section>
  );
}
