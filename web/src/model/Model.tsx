import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { fileOf, read } from "../api/client.ts";
import { jobs, newestFirst } from "../api/store.ts";
import type { FileList, Job } from "../api/types.ts";
import { JobLine } from "../jobs/JobLine.tsx";
import { go } from "../screens.ts";
import type { Viewer } from "../view3d/viewer.ts";
import { bytes, words } from "../words.ts";
import { modelFile } from "./file.ts";

type Colouring = keyof typeof words.colourings;

function Canvas({ job, file }: { job: string; file: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const viewer = useRef<Viewer | null>(null);
  const state = useSignal<string>(words.loading);
  const colouring = useSignal<Colouring>("texture");
  const section = useSignal(0); // share of the height that is cut away
  const measuring = useSignal(false);
  const distance = useSignal("");

  useEffect(() => {
    let ended = false;
    const load = async () => {
      const { openViewer } = await import("../view3d/viewer.ts");
      if (ended || !canvas.current) return;
      viewer.current = await openViewer(canvas.current, fileOf(job, file), (mm) => {
        distance.value = mm === null ? words.rulerHint : words.distance(mm);
      });
      if (ended) viewer.current.close();
      state.value = "";
    };
    load().catch((error: Error) => {
      state.value = error.message;
    });
    return () => {
      ended = true;
      viewer.current?.close();
    };
  }, [job, file]);

  return (
    <div class="stack">
      <canvas ref={canvas} class="view3d" aria-label={words.screens.model} />
      {state.value && <p role="status">{state.value}</p>}
      <div class="row">
        {(Object.keys(words.colourings) as Colouring[]).map((name) => (
          <button
            key={name}
            type="button"
            aria-pressed={colouring.value === name}
            onClick={() => {
              colouring.value = name;
              viewer.current?.colour(name);
            }}
          >
            {words.colourings[name]}
          </button>
        ))}
        <label class="row">
          {words.section}
          <input
            type="range"
            min="0"
            max="1"
            step="0.01"
            value={section.value}
            onInput={(event) => {
              section.value = Number(event.currentTarget.value);
              viewer.current?.cut(section.value);
            }}
          />
        </label>
        <button
          type="button"
          aria-pressed={measuring.value}
          onClick={() => {
            measuring.value = !measuring.value;
            distance.value = measuring.value ? words.rulerHint : "";
            viewer.current?.measure(measuring.value);
          }}
        >
          {words.ruler}
        </button>
      </div>
      {distance.value && <p role="status">{distance.value}</p>}
    </div>
  );
}

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
        </section>
        {list.value && <Files job={id} list={list.value} />}
      </div>
    </main>
  );
}
