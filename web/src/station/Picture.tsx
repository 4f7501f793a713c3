// A camera's latest image: fetched, decoded, then swapped, never blank; grey when it is old.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect } from "preact/hooks";
import { API } from "../api/client.ts";
import { words } from "../words.ts";

const PERIOD_MS = 500;
const OLD_MS = 2000;

export function Picture({ side, children }: { side: "left" | "right"; children?: ComponentChildren }) {
  const shown = useSignal("");
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
      {children}
      <figcaption>
        {name}
        {shown.value && old.value ? `, ${words.frozen}` : ""}
      </figcaption>
    </figure>
  );
}
