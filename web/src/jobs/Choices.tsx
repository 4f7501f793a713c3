// Where pose 2 fits in several ways that give different surfaces: one picture of each, and a person says which is right.
import { fileOf, order } from "../api/client.ts";
import type { Job } from "../api/types.ts";
import { Order } from "../parts/Order.tsx";
import { words } from "../words.ts";

export function Choices({ job }: { job: Job }) {
  const path = `/jobs/${encodeURIComponent(job.id)}/choose`;
  return (
    <section class="suggestions">
      {job.choices.map(({ number, sentence, image, picked }) => (
        <figure key={number}>
          {image && <img src={fileOf(job.id, image)} alt={words.choiceShown(number)} />}
          <figcaption>
            <strong>{words.choice(number, picked)}</strong>
            <p>{sentence}</p>
            {!picked && (
              <Order needs="operator" send={() => order(path, { number })}>
                {words.choose(number)}
              </Order>
            )}
          </figcaption>
        </figure>
      ))}
      <p class="dim">{words.choiceKey}</p>
    </section>
  );
}
