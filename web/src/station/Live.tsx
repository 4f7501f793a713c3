// The model as it grows, view by view; while the object is to be turned over, how.
import { useEffect, useRef } from "preact/hooks";
import { fileOf } from "../api/client.ts";
import type { Job } from "../api/types.ts";
import { type LiveView, openLive } from "../view3d/live.ts";
import { words } from "../words.ts";

export function Live({ job }: { job: Job }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<LiveView | null>(null);
  const isFlip = job.state === "waiting_for_flip";
  const caption = isFlip ? (job.suggestions[0]?.sentence ?? words.flipPicture) : words.live;
  useEffect(() => {
    if (!canvas.current) return;
    view.current = openLive(canvas.current, (name) => fileOf(job.id, `live/${name}.glb`));
    return () => view.current?.close();
  }, []);
  useEffect(() => view.current?.show(job.live), [job.live.join()]);
  useEffect(() => view.current?.turnOver(isFlip), [isFlip]);
  return (
    <figure class="live">
      <canvas ref={canvas} class="view3d" aria-label={caption} />
      <figcaption>{caption}</figcaption>
    </figure>
  );
}
