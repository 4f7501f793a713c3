// The model as it grows, view by view; while the object is to be turned over, how.
import { useEffect, useRef } from "preact/hooks";
import { fileOf } from "../api/client.ts";
import type { Job } from "../api/types.ts";
import type { LiveView } from "../view3d/live.ts";
import { words } from "../words.ts";

export function Live({ job }: { job: Job }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<Promise<LiveView> | null>(null);
  const isFlip = job.state === "waiting_for_flip";
  useEffect(() => {
    view.current = import("../view3d/live.ts").then(({ openLive }) => {
      if (!canvas.current) throw new Error("closed before it was loaded");
      return openLive(canvas.current, (name) => fileOf(job.id, `live/${name}.glb`));
    });
    view.current.catch(() => {}); // without it the ring and the images are there
    return () => {
      view.current?.then((open) => open.close()).catch(() => {});
    };
  }, [job.id]);
  useEffect(() => {
    view.current?.then((open) => open.show(job.live)).catch(() => {});
  }, [job.id, job.live.join()]);
  useEffect(() => {
    view.current?.then((open) => open.turnOver(isFlip)).catch(() => {});
  }, [job.id, isFlip]);
  return (
    <figure class="live">
      <canvas ref={canvas} class="view3d" aria-label={isFlip ? words.flipPicture : words.live} />
      <figcaption>{isFlip ? words.flipPicture : words.live}</figcaption>
    </figure>
  );
}
