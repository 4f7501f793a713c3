// A camera's latest images for as long as a part of the page shows them.
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { API } from "../api/client.ts";

const OLD_MS = 2000;
const LIMIT_MS = 5000;

export interface Shown {
  url: Signal<string>; // of the image; empty before the first
  old: Signal<boolean>;
}

/** One image after the other: each is swapped in when `look` is done with it, so that the place is never blank. */
export function usePreview(path: string, period_ms: number, look: (image: Blob, url: string) => Promise<void>): Shown {
  const url = useSignal("");
  const old = useSignal(false);
  useEffect(() => {
    let ended = false;
    let taken = performance.now();
    let timer: ReturnType<typeof setTimeout>;
    const next = async () => {
      try {
        if (!document.hidden) {
          const response = await fetch(`${API}/preview/${path}`, {
            cache: "no-store",
            signal: AbortSignal.timeout(LIMIT_MS),
          });
          if (response.status !== 200) throw new Error(response.statusText);
          const image = await response.blob();
          const made = URL.createObjectURL(image);
          await look(image, made);
          if (url.value) URL.revokeObjectURL(url.value);
          url.value = made;
          taken = performance.now();
        }
      } catch {
        // the next one, or none: then it is shown as old
      }
      old.value = performance.now() - taken > OLD_MS;
      if (!ended) timer = setTimeout(next, period_ms);
    };
    next();
    return () => {
      ended = true;
      clearTimeout(timer);
      if (url.value) URL.revokeObjectURL(url.value);
    };
  }, [path]);
  return { url, old };
}
