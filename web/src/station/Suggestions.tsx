// How the part can lie in the next pose: what the rig proposes, best first.
import { suggestionOf } from "../api/client.ts";
import type { Job } from "../api/types.ts";
import { words } from "../words.ts";

export function Suggestions({ job }: { job: Job }) {
  return (
    <section class="card suggestions">
      {job.suggestions.map(({ number, sentence, doubt, image }) => (
        <figure key={number}>
          {image && <img src={suggestionOf(job.id, number)} alt={sentence} />}
          <figcaption>
            <strong>{words.suggested(number)}</strong>
            <p>{sentence}</p>
            {doubt && <p class="wrong">{doubt}</p>}
          </figcaption>
        </figure>
      ))}
      <p class="dim">{words.suggestionKey}</p>
    </section>
  );
}
