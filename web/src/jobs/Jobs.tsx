import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { order, read } from "../api/client.ts";
import { newestFirst, status } from "../api/store.ts";
import type { Job, Recipe } from "../api/types.ts";
import { Order } from "../parts/Order.tsx";
import { go } from "../screens.ts";
import { words } from "../words.ts";
import { Choices } from "./Choices.tsx";
import { chosen, type Filter } from "./filter.ts";
import { JobLine } from "./JobLine.tsx";

const MAX_POSES = 8;
const PAGE = 50; // of a long list; the rest on demand

/// A scan with all its views.
function canGrow(job: Job): boolean {
  const isWhole = (job.state === "done" || job.state === "failed") && job.stored.length === job.all_views;
  return job.kind === "scan" && isWhole && !job.quarantined && job.poses < MAX_POSES;
}

function Orders({ job }: { job: Job }) {
  const path = `/jobs/${encodeURIComponent(job.id)}`;
  const ended = ["done", "failed", "interrupted", "cancelled"].includes(job.state);
  return (
    <div class="row">
      {job.model && (
        <button type="button" onClick={() => go("model", job.id)}>
          {words.showModel}
        </button>
      )}
      {job.resumable && (
        <Order needs="operator" send={() => order(`${path}/resume`)}>
          {words.resume}
        </Order>
      )}
      {job.state === "queued" && (
        <Order needs="operator" send={() => order(`${path}/first`)}>
          {words.first}
        </Order>
      )}
      {job.state === "done" && !job.exported && (
        <Order needs="operator" send={() => order(`${path}/exported`)}>
          {words.exported}
        </Order>
      )}
      {job.kind === "scan" && (job.state === "done" || job.state === "failed") && (
        <Order needs="engineer" send={() => order(`${path}/reprocess`)}>
          {words.reprocess}
        </Order>
      )}
      {canGrow(job) && (
        <Order needs="operator" send={() => order(`${path}/add-pose`)}>
          {words.addPose}
        </Order>
      )}
      {!ended && (
        <Order needs="operator" hold send={() => order(`${path}/cancel`)}>
          {words.hold(words.cancel)}
        </Order>
      )}
      {ended && (
        <Order needs="engineer" hold send={() => order(path, {}, "DELETE")}>
          {words.hold(words.remove)}
        </Order>
      )}
    </div>
  );
}

function NewJob() {
  const part = useSignal("");
  const recipe = useSignal("default");
  const recipes = useSignal<Recipe[]>([]);
  useEffect(() => {
    read<{ recipes: Recipe[] }>("/recipes").then(
      (got) => {
        recipes.value = got.recipes;
      },
      () => {},
    );
  }, []);
  const send = async () => {
    await order("/jobs", { part: part.value, recipe: recipe.value });
    part.value = "";
  };
  return (
    <section class="card">
      <label>
        {words.part}
        <input
          maxLength={200}
          value={part.value}
          onInput={(event) => {
            part.value = event.currentTarget.value;
          }}
        />
      </label>
      {recipes.value.length > 1 && (
        <label>
          {words.recipe}
          <select
            value={recipe.value}
            onChange={(event) => {
              recipe.value = event.currentTarget.value;
            }}
          >
            {recipes.value.map((one) => (
              <option key={one.name} value={one.name}>
                {words.recipeOf(one.name, one.poses, one.views)}
              </option>
            ))}
          </select>
        </label>
      )}
      <Order needs="operator" class="big" send={send}>
        {words.orderScan}
      </Order>
    </section>
  );
}

export function Jobs() {
  const filter = useSignal<Filter>("all");
  const shown = useSignal(PAGE);
  const queue = status.value?.queue ?? [];
  const list = newestFirst.value.filter((job) => chosen(filter.value, job, queue));
  return (
    <main class="columns">
      <div class="stack">
        <div class="row">
          {(Object.keys(words.filters) as Filter[]).map((name) => (
            <button
              key={name}
              type="button"
              aria-pressed={filter.value === name}
              onClick={() => {
                filter.value = name;
              }}
            >
              {words.filters[name]}
            </button>
          ))}
        </div>
        {list.length === 0 && <p class="dim">{words.noJobs}</p>}
        <ul class="stack">
          {list.slice(0, shown.value).map((job) => (
            <li key={job.id} class="card">
              <JobLine job={job} />
              {(job.state === "failed" || job.state === "done") && job.choices.length > 0 && <Choices job={job} />}
              <Orders job={job} />
            </li>
          ))}
        </ul>
        {list.length > shown.value && (
          <button
            type="button"
            onClick={() => {
              shown.value += PAGE;
            }}
          >
            {words.more}
          </button>
        )}
      </div>
      <NewJob />
    </main>
  );
}
