// A camera's latest image: fetched, decoded, then swapped, never blank; grey when it is old.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect } from "preact/hooks";
import { API } from "../api/client.ts";
import { words } from "../words.ts";

const PERIOD_MS = 500;
const OLD_MS = 2000;

export type Size = [number, number]; // pixels

interface Props {
  side: "left" | "right";
  over?: (image: Size) => ComponentChildren; // drawn over the image, in its pixels
}

export function Picture({ side, over }: Props) {
  const shown = useSignal("");
  const size = useSignal<Size>([4, 3]);
  const old = useSignal(false);
  useEffect(() => {
    let ended = false;
    let taken = performance.now();
    let timer: ReturnType<typeof setTimeout>;
    const next = async () => {
      try {
        if (!document.hidden) {
          const response = await fetch(`${API}/preview/${side}?or_nothing=true`, {
            cache: "no-store",
            signal: AbortSignal.timeout(5000),
          });
          if (response.status !== 200) throw new Error(response.statusText);
          const url = URL.createObjectURL(await response.blob());
          const image = new Image();
          image.src = url;
          await image.decode();
          if (shown.value) URL.revokeObjectURL(shown.value);
          shown.value = url;
          size.value = [image.naturalWidth, image.naturalHeight];
          taken = performance.now();
        }
      } catch {
        // the next one, or none: then it is shown as old
      }
      old.value = performance.now() - taken > OLD_MS;
      if (!ended) timer = setTimeout(next, PERIOD_MS);
    };
    next();
    return () => {
      ended = true;
      clearTimeout(timer);
      if (shown.value) URL.revokeObjectURL(shown.value);
    };
  }, [side]);
  const name = words[side];
  return (
    <figure class={`picture ${old.value ? "picture-old" : ""}`}>
      {shown.value ? <img src={shown.value} alt={name} /> : <span>{words.noPicture}</span>}
      {shown.value && over?.(size.value)}
      <figcaption>
        {name}
        {shown.value && old.value ? `, ${words.frozen}` : ""}
      </figcaption>
    </figure>
  );
}
