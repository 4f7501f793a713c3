// A camera's latest image, never blank; grey when it is old.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { usePreview } from "../parts/preview.ts";
import { words } from "../words.ts";

const PERIOD_MS = 500;

export type Size = [number, number]; // pixels

interface Props {
  side: "left" | "right";
  over?: (image: Size) => ComponentChildren; // drawn over the image, in its pixels
}

export function Picture({ side, over }: Props) {
  const size = useSignal<Size>([4, 3]);
  const { url, old } = usePreview(`${side}?or_nothing=true`, PERIOD_MS, async (_, made) => {
    const image = new Image();
    image.src = made;
    await image.decode();
    size.value = [image.naturalWidth, image.naturalHeight];
  });
  const name = words[side];
  return (
    <figure class={`picture ${old.value ? "picture-old" : ""}`}>
      {url.value ? <img src={url.value} alt={name} /> : <span>{words.noPicture}</span>}
      {url.value && over?.(size.value)}
      <figcaption>
        {name}
        {url.value && old.value ? `, ${words.frozen}` : ""}
      </figcaption>
    </figure>
  );
}
