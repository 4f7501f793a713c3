import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { fileOf, read } from "../api/client.ts";
import { jobs, newestFirst } from "../api/store.ts";
import type { FileList, Job } from "../api/types.ts";
import { JobLine } from "../jobs/JobLine.tsx";
import { go } from "../screens.ts";
import { bytes, words } from "../words.ts";
import { Canvas } from "./Canvas.tsx";
import { Figures } from "./Figures.tsx";
import { modelFile } from "./file.ts";

function Files({ job, list }: { job: string; list: FileList }) {
  return (
    <section class="card">
      <h2>{words.files}</h2>
      <ul>
        {list.files
          .filter((file) => file.path.startsWith("model/"))
          .map((file) => (
            <li key={file.path}>
              <a href={fileOf(job, file.path)} download={file.path.split("/").at(-1)}>
                {file.path.slice("model/".length)}
              </a>{" "}
              <span class="dim">{bytes(file.bytes)}</span>
            </li>
          ))}
      </ul>
    </section>
  );
}

function Chooser({ list }: { list: Job[] }) {
  return (
    <main class="stack">
      <p>{words.chooseJob}</p>
      <ul class="stack">
        {list.map((job) => (
          <li key={job.id} class="card">
            <JobLine job={job} />
            <button type="button" onClick={() => go("model", job.id)}>
              {words.showModel}
            </button>
          </li>
        ))}
      </ul>
    </main>
  );
}

export function Model({ id }: { id: string }) {
  const job = jobs.value.get(id);
  const list = useSignal<FileList | null>(null);
  useEffect(() => {
    if (!id) return;
    read<FileList>(`/jobs/${encodeURIComponent(id)}/files`).then(
      (got) => {
        list.value = got;
      },
      () => {},
    );
  }, [id, job?.model]);
  if (!job) return <Chooser list={newestFirst.value.filter((one) => one.model)} />;
  const file = list.value ? modelFile(list.value) : undefined;
  return (
    <main class="columns">
      {file ? <Canvas job={id} file={file} /> : <p>{list.value ? words.noModel : words.loading}</p>}
      <div class="stack">
        <section class="card">
          <h2>{words.facts}</h2>
          <JobLine job={job} />
          <Figures job={id} model={job.model} />
        </section>
        {list.value && <Files job={id} list={list.value} />}
      </div>
    </main>
  );
}
