import type { Job } from "../api/types.ts";
import { Ring } from "../parts/Ring.tsx";
import { badge } from "../words.ts";

export function JobLine({ job }: { job: Job }) {
  const { word, tone } = badge(job);
  return (
    <div class={`row tone-${tone}`}>
      {(job.state === "scanning" || job.state === "waiting_for_flip") && <Ring job={job} />}
      <div class="stack">
        <p>
          <span class="badge">{word}</span> <strong>{job.part || job.id}</strong> <span class="dim">{job.recipe}</span>
        </p>
        <p>{job.sentence}</p>
        <p class="dim">{job.next_action}</p>
        {job.remarks
          .filter((remark) => !job.sentence.includes(remark))
          .map((remark) => (
            <p key={remark} class="dim">
              {remark}
            </p>
          ))}
      </div>
    </div>
  );
}
