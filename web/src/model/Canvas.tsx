// The model to turn, colour, cut and measure.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { fileOf, order } from "../api/client.ts";
import type { Length } from "../api/types.ts";
import type { Colouring } from "../view3d/colourings.ts";
import type { Point, Viewer } from "../view3d/viewer.ts";
import { words } from "../words.ts";
import { Compare } from "./Compare.tsx";

const KEYS: Record<string, Colouring> = { t: "texture", g: "shade", m: "measured", e: "sigma", d: "deviation" };

function askLength(job: string, [from, to]: [Point, Point]): Promise<Length> {
  return order<Length>(`/jobs/${encodeURIComponent(job)}/measure`, {
    from_x: from[0],
    from_y: from[1],
    from_z: from[2],
    to_x: to[0],
    to_y: to[1],
    to_z: to[2],
  });
}

export function Canvas({ job, file }: { job: string; file: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const viewer = useRef<Viewer | null>(null);
  const state = useSignal<string>(words.loading);
  const colouring = useSignal<Colouring>("texture");
  const colourings = useSignal<Colouring[]>([]);
  const section = useSignal(0); // share of the height that is cut away
  const measuring = useSignal(false);
  const distance = useSignal("");

  const colour = (name: Colouring) => {
    colouring.value = name;
    viewer.current?.colour(name);
  };
  const cut = (share: number) => {
    section.value = share;
    viewer.current?.cut(share);
  };
  const measure = (on: boolean) => {
    measuring.value = on;
    distance.value = on ? words.rulerHint : "";
    viewer.current?.measure(on);
  };
  const onCompared = (shown: boolean) => {
    const own = viewer.current?.colourings ?? [];
    colourings.value = shown ? [...own, "deviation"] : own;
    if (shown) colouring.value = "deviation";
    else if (colouring.value === "deviation") colour("texture");
  };
  const onEnds = async (ends: [Point, Point] | null) => {
    distance.value = ends ? words.measuring : words.rulerHint;
    if (!ends) return;
    distance.value = await askLength(job, ends).then(words.length, (error: Error) => error.message);
  };

  useEffect(() => {
    let ended = false;
    const load = async () => {
      const { openViewer } = await import("../view3d/viewer.ts");
      if (ended || !canvas.current) return;
      viewer.current = await openViewer(canvas.current, fileOf(job, file), onEnds);
      if (ended) return viewer.current.close();
      colourings.value = viewer.current.colourings;
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

  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (event.target instanceof HTMLInputElement || event.ctrlKey || event.altKey || event.metaKey) return;
      const name = KEYS[event.key];
      if (name && colourings.value.includes(name)) colour(name);
      if (event.key === "r") measure(!measuring.value);
      if (event.key === "c") cut(section.value > 0 ? 0 : 0.5);
    };
    addEventListener("keydown", onKey);
    return () => removeEventListener("keydown", onKey);
  }, []);

  return (
    <div class="stack">
      <canvas ref={canvas} class="view3d" aria-label={words.screens.model} />
      {state.value && <p role="status">{state.value}</p>}
      <div class="row">
        {colourings.value.map((name) => (
          <button key={name} type="button" aria-pressed={colouring.value === name} onClick={() => colour(name)}>
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
            onInput={(event) => cut(Number(event.currentTarget.value))}
          />
        </label>
        <button type="button" aria-pressed={measuring.value} onClick={() => measure(!measuring.value)}>
          {words.ruler}
        </button>
      </div>
      {words.legends[colouring.value] && (
        <p class="row dim">
          {colouring.value === "sigma" && <span class="scale" aria-hidden="true" />}
          {words.legends[colouring.value]}
        </p>
      )}
      {!state.value && <Compare key={file} job={job} file={file} viewer={viewer} onShown={onCompared} />}
      {distance.value && (
        <p role="status" class="sentence">
          {distance.value}
        </p>
      )}
    </div>
  );
}
