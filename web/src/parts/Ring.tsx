import type { Job } from "../api/types.ts";
import { words } from "../words.ts";
import { arc, segments } from "./ring.ts";

export function Ring({ job }: { job: Job }) {
  return (
    <svg class="ring" viewBox="0 0 100 100" role="img" aria-label={words.progress(job.stored.length, job.all_views)}>
      {segments(job).map((one) => (
        <path
          key={one.key}
          class={`ring-part ${one.stored ? "ring-stored" : ""} ${one.retaken ? "ring-retaken" : ""}`}
          d={arc(one.from, one.to)}
        />
      ))}
    </svg>
  );
}
